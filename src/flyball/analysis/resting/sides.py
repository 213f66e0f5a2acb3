"""How a shape is curved where it touches: what it rolls on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...contact import kinds
from ...contact.tables import AXES, COUNT, FIRST, KIND, MOVER, PAR, PLACE, Geometry
from ..motion.impulse.scene import Movers

FLAT, EDGE, CORNER, BALL, DISK, ODD = "flat", "edge", "corner", "ball", "disk", "odd"
SHARP = (FLAT, EDGE, CORNER)
ALIKE = 1e-6  # parts of a unit vector, or of a shape, that are nothing


@dataclass(frozen=True)
class Side:
    """One side of a contact.

    Attributes
    ----------
    form : str
        ``"flat"``; ``"edge"`` or ``"corner"``, whose material point stays the same; ``"ball"`` about a centre;
        ``"disk"``, the sharp rim about an axle or one end of a cylinder; ``"odd"`` where its curvature is not known.
    centre : ndarray (3,)
        Of a ball or disk, in the world.
    axle : ndarray (3,)
        Of a disk.
    radius : float [m]
    """

    form: str
    centre: np.ndarray
    axle: np.ndarray
    radius: float = 0.0


def side(G: Geometry, M: Movers, shape: int, point: np.ndarray, normal: np.ndarray) -> Side:
    """A shape at a point of its surface.

    Parameters
    ----------
    G, M : Geometry, Movers
    shape : int
    point, normal : ndarray (3,)
        In the world; the normal leads out of the shape.
    """
    p, R = _pose(G, M, shape)
    x, n = R.T @ (point - p), R.T @ normal
    kind, par = int(G.shape_i[shape, KIND]), G.shape_x[shape, PAR:]
    form, centre, radius = _local(G, shape, kind, par, x, n)
    return Side(form, p + R @ centre, R[:, 2], radius)


def _pose(G: Geometry, M: Movers, shape: int) -> tuple[np.ndarray, np.ndarray]:
    """Origin and axes of a shape in the world."""
    p, R = G.shape_x[shape, PLACE : PLACE + 3], G.shape_x[shape, AXES : AXES + 9].reshape(3, 3)
    mover = int(G.shape_i[shape, MOVER])
    if mover < 0:
        return p, R
    q, T = M.pose[mover, :3], M.pose[mover, 3:].reshape(3, 3)
    return q + T @ p, T @ R


def _local(
    G: Geometry, shape: int, kind: int, par: np.ndarray, x: np.ndarray, n: np.ndarray
) -> tuple[str, np.ndarray, float]:
    """Form, centre and radius, in the shape's axes."""
    o = np.zeros(3)
    up = np.array([0.0, 0.0, 1.0])
    if kind == kinds.SPHERE:
        return BALL, o, float(par[0])
    if kind == kinds.PLANE:
        return FLAT, o, 0.0
    if kind == kinds.BOX:
        return (FLAT, EDGE, CORNER)[min(2, int((np.abs(n) > ALIKE).sum()) - 1)], o, 0.0
    if kind == kinds.CAPSULE:
        z = float(x[2] - par[0] * n[2])  # of the place on the core
        if abs(abs(z) - par[1]) <= ALIKE * (par[0] + par[1]):
            return BALL, np.sign(z) * par[1] * up, float(par[0])
        return ODD, o, 0.0
    if kind == kinds.CYLINDER:
        return (FLAT, o, 0.0) if abs(n[2]) >= 1.0 - ALIKE else (DISK, float(x[2]) * up, float(par[0]))
    if kind == kinds.CONE:
        return _cone(par, x, n)
    if kind == kinds.HEMISPHERE:
        if n[2] > ALIKE:
            return BALL, o, float(par[0])
        return (FLAT, o, 0.0) if n[2] <= -1.0 + ALIKE else (DISK, o, float(par[0]))
    if kind in (kinds.HULL, kinds.POLYGON):
        return _corners(G, shape, kind, float(par[0]), x, n)
    return ODD, o, 0.0


def _cone(par: np.ndarray, x: np.ndarray, n: np.ndarray) -> tuple[str, np.ndarray, float]:
    o = np.zeros(3)
    if n[2] <= -1.0 + ALIKE:
        return FLAT, o, 0.0
    if abs(x[2] - par[1]) <= ALIKE * par[1]:
        return CORNER, o, 0.0
    slope = par[1] * n[2] - par[0] * np.hypot(n[0], n[1])  # 0 where the normal is that of the slope
    if abs(x[2]) <= ALIKE * par[1] and slope < -ALIKE * par[1]:
        return DISK, o, float(par[0])
    return ODD, o, 0.0


def _corners(
    G: Geometry, shape: int, kind: int, radius: float, x: np.ndarray, n: np.ndarray
) -> tuple[str, np.ndarray, float]:
    """Of a hull or polygon by how many corners are farthest along the normal."""
    first, count = int(G.shape_i[shape, FIRST]), int(G.shape_i[shape, COUNT])
    corner = G.vertex[first : first + count]
    reach = corner @ n
    far = corner[reach >= reach.max() - ALIKE * np.ptp(corner, axis=0).max()]
    if np.linalg.matrix_rank(far - far[0], tol=ALIKE * np.ptp(corner, axis=0).max()) >= (
        1 if kind == kinds.POLYGON else 2
    ):
        return FLAT, np.zeros(3), 0.0
    if len(far) > 1:
        return (EDGE if radius == 0.0 else ODD), np.zeros(3), 0.0
    return (CORNER, far[0], 0.0) if radius == 0.0 else (BALL, far[0], radius)
