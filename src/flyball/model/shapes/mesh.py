"""A solid given by the triangles of its surface: from a file, or as arrays."""

from __future__ import annotations

import difflib
import os
import reprlib
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator

from ...errors import ModelError
from ..element import Length, element, positive
from ..linked_files import FilePath, LinkedFile
from ..placement import Placement
from .geometry import ConvexPart, Integrals, polyhedron_integrals, surface_defects, surface_part, weld_vertices
from .solid import RESOLUTION, Solid

COLLADA = ".dae"
MESH_FORMATS = (".stl", ".obj", ".ply", ".off", COLLADA)


@dataclass(frozen=True, eq=False)
class Triangulation:
    """Vertices (k, 3) and triangles (m, 3) with derived quantities, in their own units.

    ``color`` is that of the first part of a file whose parts have colours, as ``#rrggbb``; else empty.
    """

    v: np.ndarray
    f: np.ndarray
    color: str = ""

    @cached_property
    def flaws(self) -> str:
        """Return why the surface does not enclose a volume; empty if it does."""
        return surface_defects(self.v, self.f)

    @cached_property
    def integrals(self) -> Integrals:
        """Volume, centre, inertia."""
        return polyhedron_integrals(self.v, self.f)


def number_rows(kind: type) -> Any:
    """Convert rows of plain numbers to tuples quickly; leave anything else unchanged, for pydantic to refuse."""

    def convert(value: Any) -> Any:
        try:
            a = np.asarray(value)
        except ValueError:  # ragged
            return value
        if a.ndim != 2 or a.dtype.kind not in ("iuf" if kind is float else "iu"):
            return value
        return tuple(map(tuple, a.astype(kind).tolist()))

    return BeforeValidator(convert, json_schema_input_type=tuple[tuple[kind, ...], ...])  # type: ignore[valid-type]


@element
class Mesh(LinkedFile, Solid):
    """A solid given by its surface: triangles from a file, or vertices and faces.

    The surface must be closed and its triangles counter-clockwise seen from outside; then its volume, centre of mass
    and inertia are exact for the polyhedron. It may have several parts and, with triangles that face into them,
    cavities; parts that overlap count twice. For display only (``looks=True``, or the body's mass and inertia are
    given) any surface is accepted.

    Parameters
    ----------
    path : str
        An STL, OBJ, PLY, OFF or Collada (DAE) file. A relative path refers to the folder of the model file, or to the
        current folder for a mechanism described in Python. Reading requires the package trimesh, and pycollada for
        Collada.
    vertices : (k, 3) numbers
        In place of a path; in units of ``scale``.
    faces : (m, 3) whole numbers
        With ``vertices``: three indices of vertices, from 0, for each triangle.
    scale : number [m]
        Length of one unit of the file or of the vertices: ``"1 mm"`` for a drawing in millimetres; 1 m if not given.
        Only Collada files state their unit: they are read in metres.
    """

    path: FilePath = None
    vertices: Annotated[Any, number_rows(float)] = field(default=None, repr=False)
    faces: Annotated[Any, number_rows(int)] = field(default=None, repr=False)
    scale: Length = 1.0

    __eq__, __hash__ = LinkedFile.__eq__, LinkedFile.__hash__

    @property
    def title(self) -> str:
        """Return kind, and name or path if it has one, for messages."""
        name = self.name or self.path
        return f"Mesh {name!r}" if name else "Mesh"

    def reflected(self, axis: str, orientation: Any) -> dict[str, Any]:
        """Return the reflected triangles, which then no longer come from a file."""
        mesh = self.triangulation
        v = mesh.v @ Placement(mirror=axis).reflection + 0.0
        return {"path": None, "vertices": v.tolist(), "faces": mesh.f[:, ::-1].tolist()}

    def check(self, n: SimpleNamespace) -> None:
        """Require a valid surface, and a scale greater than zero."""
        positive(self, n, "scale")
        if (self.path is None) == (self.vertices is None):
            both = "both a path and vertices" if self.path is not None else "neither a path nor vertices"
            raise ModelError(f"{self.title}: it has {both}; give path='part.stl', or vertices=... and faces=...")
        if (self.vertices is None) != (self.faces is None):
            raise ModelError(f"{self.title}: vertices and faces belong together; a path has its own")
        if self.vertices is not None:
            self._check_rows()
        if not len(self.triangulation.f):
            raise ModelError(f"{self.title}: it has no triangles")
        super().check(n)

    def _check_rows(self) -> None:
        v, f = self.vertices, self.faces
        if not isinstance(v, tuple) or len(v) < 3 or len(v[0]) != 3 or not np.isfinite(v).all():
            raise ModelError(
                f"{self.title}: vertices must be three or more points of three finite numbers, got {reprlib.repr(v)}"
            )
        if not isinstance(f, tuple) or not f or len(f[0]) != 3:
            raise ModelError(
                f"{self.title}: faces must be triangles, each given by three indices of vertices, got {reprlib.repr(f)}"
            )
        low, high = int(np.min(f)), int(np.max(f))
        if low < 0 or high >= len(v):
            hint = ". They count from 0 here: subtract 1" if low == 1 and high == len(v) else ""
            raise ModelError(
                f"{self.title}: faces name the vertices {low} to {high}; there are those from 0 to {len(v) - 1}{hint}"
            )

    @cached_property
    def _given(self) -> Triangulation:
        return Triangulation(*weld_vertices(np.array(self.vertices, float), np.array(self.faces, int)))

    @property
    def triangulation(self) -> Triangulation:
        """Return its triangles, in its own units; a file is read again if it has changed.

        Raises
        ------
        ModelError
            If there is no such file, it cannot be read, or trimesh is not installed.
        """
        if self.file is None:
            return self._given
        try:
            stat = os.stat(self.file)
            return read_mesh(self.file, stat.st_mtime_ns, stat.st_size)
        except FileNotFoundError:
            folder = Path(self.file).parent
            there = [p.name for p in folder.iterdir()] if folder.is_dir() else []
            close = difflib.get_close_matches(Path(self.file).name, there, 1)
            hint = f" (did you mean {close[0]!r}?)" if close else ""
            raise ModelError(f"{self.title}: there is no file {self.file!r}{hint}") from None
        except OSError as error:
            raise ModelError(f"{self.title}: cannot read {self.file!r}: {error.strerror}") from None
        except ModelError as error:
            raise ModelError(f"{self.title}: {error}") from None

    def _integrals(self) -> Integrals:
        t = self.triangulation
        if t.flaws:
            raise ModelError(
                f"{self.title}: it gives no mass and inertia, since {t.flaws}. Or give mass and inertia of the body, "
                f"or looks=True here: then it is for looks only"
            )
        return t.integrals

    def volume(self, n: SimpleNamespace) -> Any:
        """By Gauss's theorem."""
        return self._integrals().volume * n.scale**3

    def centre(self, n: SimpleNamespace) -> Any:
        """By Gauss's theorem."""
        return self._integrals().centre * n.scale

    def gyration(self, n: SimpleNamespace) -> Any:
        """By Gauss's theorem; its axes need not be principal ones."""
        return self._integrals().gyration * n.scale**2

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Return its surface, which is decomposed into convex parts later.

        Raises
        ------
        ModelError
            If it is not closed.
        """
        return (surface_part(self._closed(self.surface(n))),)

    def outlines(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """The outlines of its convex parts."""
        return (surface_part(self._closed(self.mesh(n))),)

    def _closed(self, surface: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        if flaw := self.triangulation.flaws:
            raise ModelError(
                f"{self.title}: it cannot touch anything, since {flaw}. Close it, or give it contact=False and add a "
                "simpler shape for contact"
            )
        return surface

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Edges of the box around it."""
        return tuple((np.ptp(self.triangulation.v, axis=0) * n.scale).tolist())

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """Its triangles."""
        return self.triangulation.v * n.scale, self.triangulation.f


@lru_cache(maxsize=256)
def read_mesh(file: str, *stamp: int) -> Triangulation:
    """Return the triangles of a file; ``stamp`` identifies its state, so that a changed file is read again.

    Raises
    ------
    ModelError
        If a package is not installed, or cannot read it.
    """
    kind = Path(file).suffix.lower()
    if kind not in MESH_FORMATS:
        raise ModelError(
            f"{kind or 'a file without a suffix'} is no kind of mesh; export it as {', '.join(MESH_FORMATS)}"
        )
    try:
        import trimesh

        if kind == COLLADA:
            import collada  # noqa: F401
    except ImportError as error:
        raise ModelError(
            f"reading {kind} files takes the package {error.name}: pip install 'flyball[meshes]'"
        ) from None
    try:
        scene: Any = trimesh.load(file, force="scene", process=False)
        parts = [x for x in scene.dump() if hasattr(x, "faces")]
        unit = trimesh.units.unit_conversion(parts[0].units, "meters") if kind == COLLADA and parts else 1.0
        color = next((_hex(x.visual) for x in parts if x.visual.defined), "")
        v = np.concatenate([np.zeros((0, 3)), *(x.vertices for x in parts)]) * unit
        first = np.cumsum([0, *(len(x.vertices) for x in parts)])
        f = np.concatenate([np.zeros((0, 3), int), *(x.faces + k for x, k in zip(parts, first[:-1], strict=True))])
    except Exception as error:  # trimesh raises many kinds of errors for invalid files
        raise ModelError(f"{file!r} cannot be read as {kind[1:].upper()}: {error}") from None
    if v.ndim != 2 or not np.isfinite(v).all():
        raise ModelError(f"{file!r} has vertices that are no points")
    return Triangulation(*weld_vertices(v, f), color)


def _hex(visual: Any) -> str:
    """Return the main colour of a part of a file."""
    rgba = visual.material.main_color if hasattr(visual, "material") else visual.main_color
    return "#" + "".join(f"{int(x):02x}" for x in rgba[:3])
