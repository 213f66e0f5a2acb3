"""Ropes over pulleys: straight parts along common tangents, and arcs around the pulleys, as drawn and over time."""

from __future__ import annotations

import math
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from ..constraints.tangent import tangent
from ..errors import ModelError
from ..math.vec import matrix_product
from ..model.geometry import triad, vector

TURN = 2.0 * math.pi
LIFTED = 1e-9  # [rad] below zero: a wrap that rounding makes negative is zero, not a full turn
ARC = math.radians(10.0)  # largest angle between neighbouring points of an arc in pictures
COPLANAR = 1e-9  # relative to the distance of two points: how far they may be from one plane


class DrawnRope(NamedTuple):
    """A rope as drawn.

    Attributes
    ----------
    lengths, directions : tuple of numbers [m], [rad]
        Of its straight parts, from each point to the next.
    places : tuple of numbers [rad]
        Directions as a `RopeSpan` measures them: backwards where only the second end has a radius.
    wraps : tuple of numbers [rad]
        Around each point.
    """

    lengths: tuple[Any, ...]
    directions: tuple[Any, ...]
    places: tuple[Any, ...]
    wraps: tuple[Any, ...]

    def arcs(self, radii: tuple[Any, ...]) -> Any:
        """Return the length on all pulleys [m]."""
        return sum(sign(r) * r * phi for r, phi in zip(radii, self.wraps, strict=True))


def sign(radius: Any) -> float:
    """Return 1 if a rope runs counterclockwise, else -1."""
    return 1.0 if radius.real > 0.0 else -1.0


def is_backward(a: Any, b: Any) -> bool:
    """Return whether a `RopeSpan` is from the second of two ends with these radii to the first, which is a point."""
    return is_point(a) and not is_point(b)


def is_point(radius: Any) -> bool:
    """Return whether an end is a point: its radius is the number 0."""
    return not isinstance(radius, str) and radius == 0.0


def pulley_axes(e: Any, axis: Any, planar: bool) -> np.ndarray:
    """Return axes (columns) of which z is the axis of the pulleys of a rope."""
    if planar:
        if axis is not None:
            raise ModelError(f"{e.title}: in a planar mechanism the axis of its pulleys is the normal; leave axis out")
        return np.eye(3)
    if axis is None:
        raise ModelError(f"{e.title}: give the axis of its pulleys in world coordinates, for instance axis=(0, 0, 1)")
    return triad(vector(axis, False, f"axis of {e.title}", direction=True))


def drawn_rope(e: Any, n: SimpleNamespace) -> DrawnRope:
    """Return the lengths, directions and wraps of a rope over pulleys as drawn.

    Parameters
    ----------
    e : Element
        The rope, for messages.
    n : SimpleNamespace
        Its numbers: ``at`` [m], ``radii`` [m], ``turns``, ``axis``.

    Raises
    ------
    ModelError
        If two pulleys are so close that no line touches both, or are not in one plane.
    """
    planar = len(n.at[0]) == 2
    R = pulley_axes(e, n.axis, planar)
    p = [matrix_product(R.T, vector(x, planar, f"'at' of {e.title}")) for x in n.at]
    found = []
    for k, (here, there) in enumerate(pairwise(p)):
        b, d = n.radii[k + 1] - n.radii[k], there - here
        size = math.sqrt(float((d.real**2).sum()))
        if abs(d[2].real) > COPLANAR * size and (n.radii[k] or n.radii[k + 1]):
            raise ModelError(
                f"{e.title}: points {k + 1} and {k + 2} are {abs(d[2].real):.6g} m apart along the axis of its "
                "pulleys; all pulleys and the points next to them are in one plane. Move one, or divide the rope"
            )
        if not size > abs(b.real):
            raise ModelError(
                f"{e.title}: points {k + 1} and {k + 2} are {size:.6g} m apart, and with the radii {n.radii[k].real:g} "
                f"and {n.radii[k + 1].real:g} m no line touches both from the given sides; move one, or change a sign"
            )
        length, theta = tangent(tuple(d), b)
        found.append((length, theta, tangent(tuple(-d), b)[1] if is_backward(*n.radii[k : k + 2]) else theta))
    wraps = [TURN * n.turns[0]]
    for (_, before, _), (_, after, _), r, turns in zip(found, found[1:], n.radii[1:], n.turns[1:], strict=False):
        turned = (after - before) * sign(r)
        whole = math.floor((turned.real + LIFTED) / TURN)
        wraps.append((turned + TURN * (turns - whole)) if r else 0.0 * turned)
    lengths, directions, places = zip(*found, strict=True)
    return DrawnRope(lengths, directions, places, (*wraps, TURN * n.turns[-1]))


class RopeCourse(NamedTuple):
    """Where a rope over pulleys runs, over time; world axes, arrays (n, 3).

    Attributes
    ----------
    centres, axes : list of arrays [m], [1]
        Of its points.
    radii : tuple of numbers [m]
    pulls : list of arrays [1]
        Of each straight part: the unit vector along it, from each point to the next.
    normals : list of arrays [1]
        Of each straight part: the direction to its left in the plane of the pulleys.
    """

    centres: list[np.ndarray]
    axes: list[np.ndarray]
    radii: tuple[float, ...]
    pulls: list[np.ndarray]
    normals: list[np.ndarray]

    def ends(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Return both ends of straight part k (from 0) [m]."""
        a, b = (self.centres[i] - self.radii[i] * self.normals[k] for i in (k, k + 1))
        return a, b

    def line(self, wraps: list[np.ndarray]) -> list[np.ndarray]:
        """Return points of the rope with its arcs, for pictures; ``wraps`` are angles around each point [rad]."""
        out = []
        for i in range(len(self.centres)):
            if self.radii[i] == 0.0:
                out.append(self.centres[i])
            else:
                out += self._arc(i, wraps[i])
        return out

    def _arc(self, i: int, wrap: np.ndarray) -> list[np.ndarray]:
        """Return points of the arc around pulley i; of several turns the last incomplete one and a full one."""
        whole = np.floor(wrap / TURN)
        shown = np.maximum(np.where(whole > 0.0, TURN, 0.0) + wrap - whole * TURN, 0.0) * sign(self.radii[i])
        first = i == 0  # the arc then ends where the rope leaves; else it begins where the rope arrives
        arm = -self.radii[i] * self.normals[0 if first else i - 1]
        side = np.cross(self.axes[i], arm)
        count = 2 + math.ceil(float(np.abs(shown).max()) / ARC)
        parts = [(x - 1.0 if first else x) * shown[:, None] for x in np.linspace(0.0, 1.0, count)]
        return [self.centres[i] + np.cos(phi) * arm + np.sin(phi) * side for phi in parts]


def rope_course(centres: list[np.ndarray], axes: list[np.ndarray], radii: tuple[float, ...]) -> RopeCourse:
    """Return the course of a rope over pulleys with these centres [m] and axes over time."""
    pulls, normals = [], []
    for k, (a, b) in enumerate(pairwise(radii)):
        z, d, more = axes[k + 1 if is_backward(a, b) else k], centres[k + 1] - centres[k], b - a
        up = (z * d).sum(axis=1, keepdims=True)
        flat = d - up * z
        rho = (flat * flat).sum(axis=1, keepdims=True)
        left, run = np.cross(z, flat), np.sqrt(rho - more * more)
        length = np.sqrt((d * d).sum(axis=1, keepdims=True) - more * more)
        pulls.append(flat * (1.0 / length - more * more / (rho * run)) - left * (more / rho) + up * z / length)
        normals.append((left * run + flat * more) / rho)
    return RopeCourse(centres, axes, radii, pulls, normals)
