"""Checks of a convex shape: its support function, its mass properties, its file."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from ..contact.narrow.shapes.solid import SIGNATURES
from ..files import load
from ..mechanism import Mechanism
from ..model.body import Body
from ..model.shapes.polyhedron import integrals
from ..model.shapes.solid import DIRECTIONS, ConvexSolid
from .states import State

ROUNDING = 1e-11  # of the size of the shape
LENGTHS = (1e-6, 3.0, 1e6)  # of directions
FINE = 96  # corners of a circle on the surface whose inside is integrated
CLOSE = 1e-2  # of volume, inertia and size: what such a surface is off by, and more


class Shape(NamedTuple):
    """What is tested: a shape, its fields in SI units, and the parameters of its support function."""

    element: ConvexSolid
    numbers: SimpleNamespace
    par: tuple[float, ...]

    def point(self, d: Any) -> np.ndarray:
        """The farthest point along a direction."""
        return np.array(type(self.element).support(self.par, tuple(float(x) for x in d)), float)


def _directions() -> np.ndarray:
    given = np.random.default_rng(5).normal(size=(100, 3))
    return np.vstack([DIRECTIONS, given]) / np.linalg.norm(np.vstack([DIRECTIONS, given]), axis=1)[:, None]


def finite(s: Shape) -> str:
    """The support function is finite in every direction."""
    s.element.forms(s.numbers)
    return ""


def compiled(s: Shape) -> str:
    """Compiled code gives what the Python formula gives."""
    size = np.abs(s.point((1.0, 1.0, 1.0))).max()
    for d in _directions():
        state = State(SIGNATURES[0], type(s.element).support, (s.par, tuple(d.tolist())))
        plain, fast = s.point(d), state.compiled(state.numbers, False)
        if not np.abs(plain - fast).max() <= ROUNDING * size:
            return f"support(par, {d}) is {plain} in Python and {fast} compiled"
    return ""


def farthest(s: Shape) -> str:
    """No point of the surface is farther along a direction than the point that the support function gives for it."""
    directions = _directions()
    points = np.array([s.point(d) for d in directions])
    size = np.abs(points).max()
    reached = directions @ points.T  # of each direction, how far along it all points are
    k, other = np.unravel_index(int(np.argmax(reached - np.diag(reached)[:, None])), reached.shape)
    if reached[k, other] - reached[k, k] > ROUNDING * size:
        return (
            f"support(par, {directions[k]}) is {points[k]}, at {reached[k, k]:.6g} along that direction; the point "
            f"{points[other]}, which it gives for {directions[other]}, is at {reached[k, other]:.6g}"
        )
    for d, x in zip(directions, points, strict=True):
        for length in LENGTHS:
            if not np.abs(s.point(length * d) - x).max() <= ROUNDING * size:
                return f"support(par, d) is {x} for d = {d} and {s.point(length * d)} for {length:g} d"
    return ""


def mass(s: Shape) -> str:
    """Volume, centre and inertia, if they are defined, are those of the solid inside the surface."""
    e = s.element
    if type(e).volume is ConvexSolid.volume:
        return ""
    found = integrals(*e.surface(s.numbers, FINE))
    gyration = np.real(np.asarray(e.gyration(s.numbers)))
    given = {
        "volume": (np.real(e.volume(s.numbers)), found.volume, found.volume),
        "centre": (np.real(e.centre(s.numbers)), found.centre, found.volume ** (1 / 3)),
        "gyration": (np.diag(gyration) if gyration.ndim == 1 else gyration, found.gyration, np.trace(found.gyration)),
    }
    for name, (value, wanted, size) in given.items():
        if not np.abs(np.asarray(value) - wanted).max() <= CLOSE * size:
            return f"{name} is {value}; of the solid inside the surface it is {wanted}"
    return ""


def file(s: Shape) -> str:
    """Saved and loaded again it is the same."""
    m = Mechanism("sample")
    m.add(Body("body", mass=1, inertia=(1, 1, 1), shape=s.element))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "saved.toml"
        m.save(path)
        again = load(path)
    return "" if again == m else f"saved and loaded again it is {again['body']}, and was {m['body']}"


CHECKS: dict[str, Callable[[Shape], str]] = {
    "numbers": finite,
    "compiled": compiled,
    "support": farthest,
    "mass": mass,
    "file": file,
}
