"""Two shapes anywhere, and the contacts that the narrow phase finds between them."""

from __future__ import annotations

import numpy as np

from flyball.collision.narrow_phase.dispatch import collide
from flyball.collision.narrow_phase.primitives import SCRATCH_ROWS
from flyball.collision.tables import Dimensions, Geometry, Movers, Shapes
from tests.compiled import compiled


def _collide(G, M, i, j, reach, room):
    return collide(G, M, i, j, reach, room)


meet = compiled(_collide)


def geometry(*shapes):
    """Shapes (kind, parameters) or (kind, parameters, vertices, faces), each on a mover of its own."""
    n = len(shapes)
    shape, dimensions = Shapes.blank(n), Dimensions.blank(n)
    vertex, face = [], []
    for k, (kind, par, *more) in enumerate(shapes):
        corners = np.reshape(more[0], (-1, 3)) if more else np.zeros((0, 3))
        faces = more[1] if len(more) > 1 else []
        shape[k, :4] = kind, k, sum(map(len, vertex)), len(corners)
        shape.face_first[k], shape.face_count[k] = sum(len(f) + 1 for f in face), len(faces)
        dimensions.axes[k] = np.eye(3).ravel()
        dimensions.par[k, : len(par)] = par
        dimensions.radius[k] = np.inf if kind == 1 else np.linalg.norm(par) + max([0, *np.linalg.norm(corners, axis=1)])
        vertex.append(corners)
        face += faces
    flat = np.array([x for f in face for x in (len(f), *f)], dtype=np.int64)
    return Geometry(shape, dimensions, np.concatenate(vertex), flat, np.zeros((0, 2), dtype=np.int64))


def contacts(a, b, at_a, at_b, reach=np.inf, exchange=False):
    """Contacts (rows: point, normal from a to b, gap, feature) of shapes at (position, rotation matrix)."""
    G = geometry(a, b)
    pose = np.array([[*p, *np.ravel(R)] for p, R in (at_a, at_b)], dtype=float)
    room = np.full((SCRATCH_ROWS, 8), np.nan)
    i, j = (1, 0) if exchange else (0, 1)
    count = meet(G, Movers(pose, np.zeros((2, 6))), i, j, float(reach), room)
    found = room[:count].copy()
    if exchange:
        found[:, 3:6] *= -1
    return found


def turned(axis, angle):
    """Rotation matrix (Rodrigues)."""
    e = np.array(axis, dtype=float)
    e /= np.linalg.norm(e)
    K = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
