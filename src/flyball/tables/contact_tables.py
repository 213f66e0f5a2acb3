"""Contact tables of a model: the bodies that carry shapes, the shapes, and the properties of their surfaces.

Shapes given by a description are converted here: point sets to hulls, closed surfaces to convex parts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..collision import shape_kinds
from ..collision import tables as ct
from ..collision.convex_decomposition import (
    MAX_PARTS,
    PART_TOLERANCE,
    ConvexParts,
    ConvexPolyhedron,
    convex_hull,
    convex_parts,
)
from ..collision.shapes.solid import SUPPORT_SIGNATURES
from ..collision.tables import Movers
from ..compiler.kernels import CodeTable, code_table, table_addresses
from ..errors import ModelError, PerformanceNotice, warn_user
from ..model.body import GROUND, Bodies, Body, Ground, frame_of
from ..model.contact import Owner
from ..model.element import resolve
from ..model.model import Model
from ..model.shapes.geometry import ConvexPart, polygon_outline
from ..model.shapes.solid import ConvexSolid, Solid
from .contact_surfaces import ContactGroups, Surface, check_curvature, contact_groups, surface_motion, surface_pairs
from .element_numbers import ElementNumbers
from .table_definitions import Surfaces


@dataclass(frozen=True)
class Carriers:
    """Bodies, and many bodies, that carry shapes, in the requested order.

    A mover's origin is its centre of mass, its axes are those of its reference frame.

    Attributes
    ----------
    names : tuple of str
    slices : dict
        Name -> the movers of that name.
    movers : Movers
        Initial state; velocities are those of the centres of mass.
    mass : (n,) [kg]
    inertia : (n, 3, 3) [kg m^2]
        About the centre of mass, in the mover's axes.
    com : dict
        Name -> its centre of mass [m] in its reference frame; of many bodies, with ``scale`` 1.
    """

    names: tuple[str, ...]
    slices: dict[str, slice]
    movers: Movers
    mass: np.ndarray
    inertia: np.ndarray
    com: dict[str, np.ndarray]

    def name(self, mover: int) -> str:
        """Name of a mover in messages and results: ``"crank"`` or ``"balls[17]"``; ``"ground"`` for -1."""
        for name, at in self.slices.items():
            if at.start <= mover < at.stop:
                return name if name in self.single else f"{name}[{mover - at.start}]"
        return "ground"

    single: frozenset[str] = frozenset()


def contact_carriers(model: Model, given: ElementNumbers, names: Sequence[str]) -> Carriers:
    """Bodies of these names, in this order; of many bodies, each one.

    Raises
    ------
    ModelError
        If there is no such body.
    """
    parts, slices, com, at = [], {}, {}, 0
    for name in names:
        e = model.find(name)
        part, com[name] = _many_bodies(e, model, given) if isinstance(e, Bodies) else _single_body(name, given)
        slices[name] = slice(at, at + len(part[0]))
        at = slices[name].stop
        parts.append(part)
    if not parts:
        parts = [tuple(np.zeros((0, *s)) for s in ((3,), (3, 3), (3,), (3,), (), (3, 3)))]
    p, R, v, w, mass, inertia = (np.concatenate(x) for x in zip(*parts, strict=True))
    movers = Movers(np.hstack([p, R.reshape(-1, 9)]), np.hstack([v, w]))
    single = frozenset(name for name in names if not isinstance(model.find(name), Bodies))
    return Carriers(tuple(names), slices, movers, mass, inertia, com, single)


def _single_body(name: str, given: ElementNumbers) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    if name not in given.bodies:
        raise ModelError(f"there is no body named {name!r}")
    b = given.bodies[name]
    inertia = np.real(b.inertia).reshape(3, 3)
    row = (b.c, b.R, b.v, b.w, b.mass, inertia)
    return tuple(np.real(np.asarray(x, float))[None] for x in row), np.real(b.com)


def _many_bodies(e: Bodies, model: Model, given: ElementNumbers) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Movers of many bodies: lengths grow with the scale, masses with its cube, inertias with its fifth power."""
    one = e.weight(given.of[e.name], given.env, model.planar)
    p, R, v, w = e.start(model.planar)
    s = e.sizes()
    com = np.real(one.com)
    arm = s[:, None] * (R @ com)
    mass = np.real(one.mass) * s**3
    inertia = (s**5)[:, None, None] * np.real(one.inertia)
    return (p + arm, R, v + np.cross(w, arm), w, mass, inertia), com


def finished_forms(form: ConvexPart) -> list[ConvexPart]:
    """Convert a shape to the convex parts that contact uses: one or several.

    Raises
    ------
    ModelError
        If points or a surface enclose no solid.
    """
    if form.kind == "HULL" and len(form.par) == 1:
        return [_hull_form(convex_hull(form.vertex), form, form.par[0])]
    if form.kind == "MESH":
        return [_hull_form(h, form, 0.0) for h in _convex_parts(form).hulls]
    return [form]


def outline_forms(form: ConvexPart) -> list[ConvexPart]:
    """Convert a shape of a planar mechanism: each part projected along z."""
    if form.kind == "MESH":
        return [polygon_outline(h.vertices) for h in _convex_parts(form).hulls]
    return [form]


def _hull_form(h: ConvexPolyhedron, form: ConvexPart, rounding: float) -> ConvexPart:
    """Convex part of a hull, with the middle of its bounding box as origin."""
    middle = (h.vertices.min(axis=0) + h.vertices.max(axis=0)) / 2
    h = ConvexPolyhedron(h.vertices - middle, h.normals, h.sides)
    face, edges = h.table(0)
    return ConvexPart(
        "HULL",
        (rounding, float(edges)),
        np.sqrt((h.vertices**2).sum(axis=1)).max() + rounding,
        form.place + form.axes @ middle,
        form.axes,
        h.rows,
        face,
        len(h.vertices),
        len(h.sides),
    )


def _convex_parts(form: ConvexPart) -> ConvexParts:
    """Convex parts of a surface; warns if they approximate it poorly."""
    v = np.ascontiguousarray(form.vertex, float)
    found = _cached_parts(v.tobytes(), np.ascontiguousarray(form.face, np.int64).tobytes())
    size = float(np.linalg.norm(np.ptp(v, axis=0)))
    if found.beyond > PART_TOLERANCE * size:
        warn_user(
            f"a surface of {form.face.size // 3} triangles is {MAX_PARTS} convex parts where it touches others, and "
            f"these still fill up to {found.beyond:.3g} m of its hollows; describe it by simpler shapes where "
            f"that matters",
            PerformanceNotice,
        )
    return found


@lru_cache(maxsize=64)
def _cached_parts(vertices: bytes, faces: bytes) -> ConvexParts:
    return convex_parts(np.frombuffer(vertices).reshape(-1, 3), np.frombuffer(faces, np.int64).reshape(-1, 3))


@dataclass(frozen=True)
class ContactTables:
    """Contact tables of a model.

    Attributes
    ----------
    geometry : collision.tables.Geometry
    surfaces : tables.table_definitions.Surfaces
    carriers : Carriers
        The movers of the geometry.
    parts : tuple of str
        Names of the shapes' owners.
    part : (ns,)
        Of each shape, its index in ``parts``.
    code : list of CodeTable or None
        Of each user-defined shape, its support function; their addresses are in the geometry.
    """

    geometry: ct.Geometry
    surfaces: Surfaces
    carriers: Carriers
    parts: tuple[str, ...]
    part: np.ndarray
    code: list[CodeTable | None]

    def name(self, shape: int) -> str:
        """Name of a shape's owner, for messages: ``"floor"``, ``"crank"``, ``"balls[17]"``."""
        mover = int(self.geometry.shape.mover[shape])
        return self.parts[self.part[shape]] if mover < 0 else self.carriers.name(mover)


def contact_tables(model: Model, given: ElementNumbers, names: Sequence[str]) -> ContactTables:
    """Contact tables of a model.

    Parameters
    ----------
    model : Model
    given : ElementNumbers
        Numbers of its elements.
    names : sequence of str
        Bodies and many bodies that move, in the order that their movers are to have. Shapes of others, and of
        ground, are left out or do not move.

    Raises
    ------
    ModelError
        If the form of a shape is not supported, a touching body has no mass, or the friction of a pair is not given.
    """
    at = contact_carriers(model, given, names)
    owners: list[Owner] = [*model.ground, *(e for name in names if isinstance(e := model.find(name), (Body, Bodies)))]
    owners = [e for e in owners if any(s.touches for s in e.shapes())]
    _refuse_massless(owners, at)
    g = contact_groups(model, owners)
    rows = _ShapeRows(model, given, at, g)
    for k, e in enumerate(owners):
        rows.add(k, e)
    own = _concatenated(rows.own, (0, 2, 3))
    surfaces = Surfaces(surface_pairs(model, given, g, rows.surfaces), own[:, 0].copy(), own[:, 1].copy())
    apart = np.array(
        sorted(sorted((at.slices[a].start, at.slices[b].start)) for a, b in g.excluded_pairs), np.int64
    ).reshape(-1, 2)
    geometry = ct.Geometry(
        np.concatenate([ct.Shapes.blank(0), *rows.ints]).view(ct.Shapes),
        np.concatenate([ct.Dimensions.blank(0), *rows.reals]).view(ct.Dimensions),
        _concatenated(rows.vertex, (0, 3)),
        _concatenated(rows.face, (0,), np.int64),
        apart,
        table_addresses(rows.code),
    )
    check_curvature(geometry, surfaces.pair, [m or "" for _, m in rows.surfaces], model.planar)
    part = _concatenated(rows.part, (0,), np.int64)
    return ContactTables(geometry, surfaces, at, tuple(e.name for e in owners), part, rows.code)


def _refuse_massless(owners: list[Owner], at: Carriers) -> None:
    """Refuse bodies without mass, to which impulses would give arbitrary velocities."""
    for e in owners:
        if not isinstance(e, Ground) and not at.mass[at.slices[e.name].start] > 0.0:
            raise ModelError(
                f"{e.title}: it touches and has no mass; give it one, or contact=False to its shapes and put such that "
                f"touch on the bodies that it joins"
            )


def _concatenated(parts: list[np.ndarray], empty: tuple[int, ...], dtype: type = float) -> np.ndarray:
    return np.ascontiguousarray(np.concatenate([np.zeros(empty, dtype), *parts]), dtype)


class _ShapeRows:
    """Rows of the shape tables, added owner by owner."""

    def __init__(self, model: Model, given: ElementNumbers, at: Carriers, g: ContactGroups) -> None:
        self.model, self.given, self.at, self.groups = model, given, at, g
        self.surfaces: dict[Surface, set[str]] = {}  # carriers of each surface; ground counts as one
        self.ints: list[np.ndarray] = []
        self.reals: list[np.ndarray] = []
        self.own: list[np.ndarray] = []
        self.part: list[np.ndarray] = []
        self.vertex: list[np.ndarray] = []
        self.face: list[np.ndarray] = []
        self.code: list[CodeTable | None] = []
        self._corners = self._places = 0

    def add(self, k: int, e: Owner) -> None:
        """Add the shapes of one owner; of many bodies, those of the first, of the second, and so on."""
        where, movers, sizes, com = self._frame(e)
        forms = [(s, f) for s in e.shapes() if s.touches for f in self._forms(e, s)]
        count, n = len(movers), len(forms)
        ints, reals = ct.Shapes.blank(count * n), ct.Dimensions.blank(count * n)
        own_ints, own_reals = ints.reshape(count, n, -1), reals.reshape(count, n, -1)
        mine = np.zeros((n, 2, 3))
        for j, (s, form) in enumerate(forms):
            f = form if where is None else form.transformed(*where)
            own_reals[:, j] = _shape_numbers(f, com, sizes, self._places)
            own_ints[:, j] = self._ints(e, s, f, sizes)
            mine[j] = self._surface_velocity(e, s, where)
        ints.mover = np.repeat(movers, n)
        self.ints.append(ints)
        self.reals.append(reals)
        self.own.append(np.broadcast_to(mine, (count, n, 2, 3)).reshape(-1, 2, 3))
        self.part.append(np.full(count * n, k))
        self.code += [None if f.owner is None else code_table(f.owner, SUPPORT_SIGNATURES) for _, f in forms] * count

    def _frame(self, e: Owner) -> tuple:
        """World frame of an owner that does not move, its movers, sizes, centre of mass."""
        if isinstance(e, Ground):
            return frame_of(e, self.given.of[e.name]), np.array([-1]), np.ones(1), np.zeros(3)
        at = self.at.slices[e.name]
        sizes = e.sizes() if isinstance(e, Bodies) else np.ones(1)
        return None, np.arange(at.start, at.stop), sizes, self.at.com[e.name]

    def _forms(self, e: Owner, s: Solid) -> list[ConvexPart]:
        """Convex parts of a shape, in the body's reference frame."""
        n = resolve(s, self.given.env)
        try:
            if isinstance(s, ConvexSolid):
                code_table(type(s), SUPPORT_SIGNATURES, SUPPORT_SIGNATURES)
            if self.model.planar:
                return [g for f in s.outlines(n) for g in outline_forms(f)]
            p, R = s.pose(n)
            return [g.transformed(p, R) for f in s.forms(n) for g in finished_forms(f)]
        except ModelError as error:
            raise type(error)(f"{e.title}: {error}") from None

    def _ints(self, e: Owner, s: Solid, f: ConvexPart, sizes: np.ndarray) -> np.ndarray:
        """Integers of a shape: kind, first corners and faces, group and surface; each size has corners of its own."""
        group, material = self.groups.of[e.name], s.material or e.material
        row = ct.Shapes.blank(len(sizes))
        if f.kind not in shape_kinds.KIND_NUMBERS:
            known = ", ".join(shape_kinds.KIND_NUMBERS)
            raise ModelError(
                f"{e.title}: {type(s).__name__}.forms gives a ConvexPart of kind {f.kind!r}; kinds: {known}"
            )
        row.kind[:] = shape_kinds.KIND_NUMBERS[f.kind]
        row.count[:] = len(f.vertex) if f.corners is None else f.corners
        row.face_count[:] = f.sides
        row.first[:], row.face_first[:] = self._corners, self._places
        if len(f.vertex):
            other = (sizes != sizes[0]).any()
            row.first[:] += len(f.vertex) * np.arange(len(sizes)) if other else 0
            self.vertex.append(f.grown(sizes if other else sizes[:1])[1])
            self.face.append(np.asarray(f.face, np.int64))
            self._corners += len(self.vertex[-1])
            self._places += len(f.face)
        row.member[:], row.mask[:] = 1 << group, self.groups.meets(group)
        surface = group, material
        on = self.surfaces.setdefault(surface, set())
        on |= {GROUND} if isinstance(e, Ground) else {e.name, f"{e.name}[1]"} if len(sizes) > 1 else {e.name}
        row.material[:] = list(self.surfaces).index(surface)
        return row

    def _surface_velocity(self, e: Owner, s: Solid, where: tuple | None) -> np.ndarray:
        name = s.material or e.material
        out = surface_motion(self.model.find(name) if name else None, self.given.of)  # type: ignore[arg-type]
        return out if where is None else out @ where[1].T


def _shape_numbers(f: ConvexPart, com: np.ndarray, sizes: np.ndarray, places: int) -> np.ndarray:
    """Numbers of a shape: pose in the mover, parameters, radius; the edges of a hull are counted from all faces."""
    row = ct.Dimensions.blank(len(sizes))
    row.place = sizes[:, None] * (np.real(f.place) - com)
    row.axes = np.real(f.axes).ravel()
    row.par[:, : len(f.par)] = replace(f, vertex=np.zeros((0, 3))).grown(sizes)[0]
    if f.kind == "HULL" and f.par[1] >= 0:
        row.par[:, 1] += places
    row.radius[:] = sizes * np.real(f.reach)
    return row
