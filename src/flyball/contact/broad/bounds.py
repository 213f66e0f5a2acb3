"""Boxes about shapes, along their own axes."""

from __future__ import annotations

import numpy as np

from ..kinds import BOX, CAPSULE, CONE, CYLINDER, ELLIPSOID, FIELD, HEMISPHERE, HULL, POLYGON, SPHERE
from ..tables import AXES, COUNT, FIRST, KIND, PAR, PLACE, RADIUS, Geometry


def holds(G: Geometry) -> np.ndarray:
    """A sphere and a box about every bounded shape, with one middle.

    A kind without a rule here gets those of the sphere that the table gives it.

    Returns
    -------
    ndarray (ns, 8)
        The middle [m] in the mover's axes, the radius [m] (inf for what is unbounded), the box's half edges [m] along
        the shape's axes. Of what is unbounded the fifth number is its greatest height along its z axis.
    """
    kind, par, radius = G.shape_i[:, KIND], G.shape_x[:, PAR : PAR + 3], G.shape_x[:, RADIUS]
    middle, wide = np.zeros((len(kind), 3)), ~np.isfinite(radius)
    half = np.repeat(np.where(wide, 0.0, radius)[:, None], 3, axis=1)
    size = np.full(len(kind), np.inf)
    for of, columns in _COLUMNS.items():
        half[kind == of] = np.stack(columns(*par[kind == of].T), axis=1)
    middle[kind == CONE, 2] = 0.5 * par[kind == CONE, 1]
    middle[kind == HEMISPHERE, 2] = 0.5 * par[kind == HEMISPHERE, 0]
    for i in np.flatnonzero((kind == HULL) | (kind == POLYGON)):
        first, count = G.shape_i[i, [FIRST, COUNT]]
        vertices = G.vertex[first : first + count]
        low, high = vertices.min(0), vertices.max(0)
        middle[i], half[i] = 0.5 * (low + high), 0.5 * (high - low) + par[i, 0]
        size[i] = np.linalg.norm(vertices - middle[i], axis=1).max() + par[i, 0]
    for i in np.flatnonzero((kind == FIELD) & wide):
        heights = G.vertex[G.shape_i[i, FIRST] :].ravel()[: int(par[i, 0] * par[i, 1])]
        half[i, 0] = heights.max()
    out = np.zeros((len(kind), 8))
    axes = G.shape_x[:, AXES : AXES + 9].reshape(-1, 3, 3)
    out[:, :3] = G.shape_x[:, PLACE : PLACE + 3] + np.einsum("nij,nj->ni", axes, middle)
    size = np.minimum(size, np.minimum(np.linalg.norm(half, axis=1), radius + np.linalg.norm(middle, axis=1)))
    out[:, 3] = np.where(wide, np.inf, np.where(kind == SPHERE, par[:, 0], size))
    out[:, 4:7] = half
    return out


_COLUMNS = {  # half edges from the parameters
    SPHERE: lambda r, a, b: (r, r, r),
    BOX: lambda x, y, z: (x, y, z),
    ELLIPSOID: lambda x, y, z: (x, y, z),
    CAPSULE: lambda r, h, z: (r, r, r + h),
    CYLINDER: lambda r, h, z: (r, r, h),
    CONE: lambda r, h, z: (r, r, 0.5 * h),
    HEMISPHERE: lambda r, a, b: (r, r, 0.5 * r),
}
