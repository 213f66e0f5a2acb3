"""All kinds of convex shapes, found in the files of this folder, and formulas that select by kind.

A file declares ``KIND``, its number (`shape_kinds`), and ``support``; it then has contacts with every other shape:
convex shapes, planes and height fields. It may also define ``face`` (contacts at more than one point) and ``radius``.
All are formulas; ``G`` is the `Geometry`, ``i`` the shape, and everything is in the shape's axes:

- ``support(G, i, d)`` -> the point of its core farthest along ``d``; always the same one of equally far points.
  ``d`` is any vector, not all zeros.
- ``face(G, i, d, scratch, at)`` -> number of corners, number of the face. It writes the flat part of the core's
  surface that faces the unit vector ``d`` best: its corners, counter-clockwise seen from the tip of ``d``, to
  columns 0 to 2 of the rows of ``scratch`` from ``at`` on, at most `MAX_CORNERS`; two corners are an edge, one is
  a point. The point of ``support(G, i, d)`` is part of it. Corners and number are unchanged by a small rotation of
  the shape.
- ``radius(G, i)`` -> rounding radius of its core.

Formulas of an unknown kind return nan.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

from ...compiler.formulas import dispatch_by_kind, formula
from ...math.vec import store3


@dataclass(frozen=True)
class ShapeKind:
    """A kind of convex shape."""

    kind: int
    support: Callable
    face: Callable | None
    radius: Callable


@formula
def no_rounding(G, i):
    """Return zero, the rounding radius of shapes without rounding."""
    return 0.0


def _modules() -> list[ModuleType]:
    package = __name__.rpartition(".")[0]
    path = importlib.import_module(package).__path__
    names = [info.name for info in pkgutil.iter_modules(path) if info.name != "registry"]
    return [importlib.import_module(f"{package}.{name}") for name in names]


def declared_shapes(modules: list[ModuleType]) -> tuple[ShapeKind, ...]:
    """Collect the shapes declared by these modules, by number.

    Raises
    ------
    RuntimeError
        If a number is taken twice.
    """
    shapes: dict[int, ShapeKind] = {}
    for m in modules:
        if hasattr(m, "KIND"):
            if m.KIND in shapes:
                free = 1 + max(x.KIND for x in modules if hasattr(x, "KIND"))
                raise RuntimeError(
                    f"shape KIND {m.KIND} is taken twice, the second time by {m.__name__}; the next free is {free}"
                )
            shapes[m.KIND] = ShapeKind(m.KIND, m.support, getattr(m, "face", None), getattr(m, "radius", no_rounding))
    return tuple(shapes[k] for k in sorted(shapes))


SHAPES = declared_shapes(_modules())


support = dispatch_by_kind(__name__, "support", "G, i, d", {s.kind: s.support for s in SHAPES}, "(nan, nan, nan)")
"""Farthest point of a core along d."""

radius = dispatch_by_kind(__name__, "radius", "G, i", {s.kind: s.radius for s in SHAPES}, "nan")
"""Rounding radius."""

_flat_face = dispatch_by_kind(__name__, "flat", "G, i, d, room, at", {s.kind: s.face for s in SHAPES if s.face}, "0, 0")


@formula
def face(kind, G, i, d, scratch, at):
    """Corners of the part of a core's surface that faces d, and its number; a kind without faces has one point."""
    count, number = _flat_face(kind, G, i, d, scratch, at)
    if count == 0:
        store3(scratch, at, 0, support(kind, G, i, d))
        count = 1
    return count, number
