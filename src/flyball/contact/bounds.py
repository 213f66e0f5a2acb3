"""Boxes about shapes, along their own axes."""

from __future__ import annotations

import numpy as np

from .kinds import BOX, CAPSULE, CONE, CYLINDER, ELLIPSOID, HULL, POLYGON, SPHERE
from .tables import AXES, COUNT, FIRST, KIND, PAR, PLACE, RADIUS, Geometry


def _own_box(kind: int, par: np.ndarray, vertices: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Middle and half edges, in the shape's axes; for kinds without a rule here those of the sphere that holds it."""
    middle = np.zeros(3)
    if kind in (BOX, ELLIPSOID):
        return middle, par[:3].copy()
    if kind == CAPSULE:
        return middle, np.array([par[0], par[0], par[0] + par[1]])
    if kind == CYLINDER:
        return middle, np.array([par[0], par[0], par[1]])
    if kind == CONE:
        return np.array([0.0, 0.0, 0.5 * par[1]]), np.array([par[0], par[0], 0.5 * par[1]])
    if kind in (HULL, POLYGON) and len(vertices):
        low, high = vertices.min(0), vertices.max(0)
        return 0.5 * (low + high), 0.5 * (high - low) + par[0]
    return middle, np.full(3, par[0] if kind == SPHERE else radius)


def holds(G: Geometry) -> np.ndarray:
    """A sphere and a box about every bounded shape, with one middle.

    Returns
    -------
    ndarray (ns, 8)
        The middle [m] in the mover's axes, the radius [m] (inf for what is unbounded), the box's half edges [m] along
        the shape's axes.
    """
    out = np.zeros((len(G.shape_i), 8))
    radius = G.shape_x[:, RADIUS]
    out[:, :3], out[:, 3] = G.shape_x[:, PLACE : PLACE + 3], radius
    out[:, 4:7] = radius[:, None]
    for i in np.flatnonzero((G.shape_i[:, KIND] != SPHERE) & np.isfinite(radius)):
        x, (first, count) = G.shape_x[i], G.shape_i[i, [FIRST, COUNT]]
        kind, par = int(G.shape_i[i, KIND]), x[PAR : PAR + 8]
        vertices = G.vertex[first : first + count]
        middle, half = _own_box(kind, par, vertices, radius[i])
        if kind in (HULL, POLYGON) and len(vertices):
            size = np.linalg.norm(vertices - middle, axis=1).max() + par[0]
        else:
            size = np.linalg.norm(half)
        out[i, :3] += x[AXES : AXES + 9].reshape(3, 3) @ middle
        out[i, 3] = min(size, radius[i] + np.linalg.norm(middle))
        out[i, 4:7] = half
    ball = G.shape_i[:, KIND] == SPHERE
    out[ball, 3] = G.shape_x[ball, PAR]
    return out
