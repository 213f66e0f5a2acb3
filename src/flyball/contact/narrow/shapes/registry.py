"""Every kind of convex shape, found in the files of this folder.

A file says ``KIND``, its number (`kinds`), and ``support``; it then works with every other convex shape. It may also
say ``face`` (contacts at more than one point) and ``radius``. All are formulas; ``G`` is the `Geometry`, ``i`` the
shape, and all is in the shape's axes:

- ``support(G, i, d)`` -> the point of its core that is farthest along ``d``; of points equally far always the same
  one. ``d`` is any vector, not all zeros.
- ``face(G, i, d, room, at)`` -> how many corners, number of the face. The flat part of the core's surface that faces
  the unit vector ``d`` best: its corners, counter-clockwise seen from the tip of ``d``, into columns 0 to 2 of the rows
  of ``room`` from ``at`` on, at most `room.CORNERS`; two corners are an edge, one is a point. The point of
  ``support(G, i, d)`` is among its points. Corners and number stay the same while the shape turns a little.
- ``radius(G, i)`` -> rounding radius of its core.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

from ....compiler.formulas import formula


@dataclass(frozen=True)
class Shape:
    """A kind of convex shape."""

    kind: int
    support: Callable
    face: Callable | None
    radius: Callable


@formula
def sharp(G, i):
    """No rounding."""
    return 0.0


def _modules() -> list[ModuleType]:
    package = __name__.rpartition(".")[0]
    path = importlib.import_module(package).__path__
    names = [info.name for info in pkgutil.iter_modules(path) if info.name != "registry"]
    return [importlib.import_module(f"{package}.{name}") for name in names]


def found(modules: list[ModuleType]) -> tuple[Shape, ...]:
    """Shapes that these modules declare, by number.

    Raises
    ------
    RuntimeError
        If a number is taken twice.
    """
    shapes: dict[int, Shape] = {}
    for m in modules:
        if hasattr(m, "KIND"):
            if m.KIND in shapes:
                raise RuntimeError(f"shape KIND {m.KIND} is taken twice, the second time by {m.__name__}")
            shapes[m.KIND] = Shape(m.KIND, m.support, getattr(m, "face", None), getattr(m, "radius", sharp))
    return tuple(shapes[k] for k in sorted(shapes))


SHAPES = found(_modules())
