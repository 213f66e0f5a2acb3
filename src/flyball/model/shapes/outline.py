"""Outlines in the plane of the mechanism: what solids are there, seen along z."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import ModelError
from .form import Form
from .surface import cross

ALONG = 1e-9  # sine of the angle between directions that count as the same
OBLIQUE = (
    "it stands oblique to the plane of the mechanism, so it has no outline that contact knows; turn it, or give it "
    "contact=False"
)


def polygon(points: np.ndarray, rounding: Any = 0.0) -> Form:
    """The convex polygon around points (k, 2 or 3), seen along z, and all within ``rounding`` of it; in their axes."""
    corners = hull(np.asarray(points, float)[:, :2])
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    at = np.hstack([corners - middle, np.zeros((len(corners), 1))])
    reach = np.sqrt((at**2).sum(axis=1)).max() + rounding
    return Form("POLYGON", (rounding,), reach, np.array([*middle, 0.0]), vertex=at)


def circle(radius: Any, p: np.ndarray) -> Form:
    """A circle about p, seen along z."""
    return Form("SPHERE", (radius,), radius, np.array([p[0], p[1], 0.0]))


def around_axis(what: Any, p: np.ndarray, R: np.ndarray, radius: Any, profile: list[tuple[Any, Any]]) -> Form:
    """What is round about its own z axis: a circle seen along it, seen from the side the points (r, z) and (-r, z).

    Raises
    ------
    ModelError
        If it stands oblique to the plane of the mechanism.
    """
    if np.hypot(*R[:2, 2]) < ALONG:
        return circle(radius, p)
    if not abs(R[2, 2]) < ALONG:
        raise ModelError(f"{what.title}: {OBLIQUE}")
    z = R[:2, 2]
    x = np.array([-z[1], z[0]])
    return polygon(np.array([p[:2] + r * x * side + h * z for r, h in profile for side in (-1.0, 1.0)]))


def hull(p: np.ndarray) -> np.ndarray:
    """Corners (k, 2) of the convex hull of points in the plane, counter-clockwise (Andrew 1979)."""
    p = np.unique(p, axis=0)  # sorted
    size = np.ptp(p, axis=0).max() if len(p) else 0.0
    chains = []
    for way in (p, p[::-1]):
        chain: list[np.ndarray] = []
        for x in way:
            while len(chain) > 1 and cross(chain[-1] - chain[-2], x - chain[-1]) <= 1e-12 * size**2:
                chain.pop()
            chain.append(x)
        chains.append(chain[:-1])
    return np.array([*chains[0], *chains[1]]) if len(p) > 1 else p
