"""Two shapes anywhere, and the contacts that the narrow phase finds between them."""

from __future__ import annotations

import numpy as np

from flyball.collision.narrow_phase.dispatch import collide
from flyball.collision.narrow_phase.primitives import SCRATCH_ROWS
from flyball.collision.tables import AXES, FACE_COUNT, FACE_FIRST, PAR, RADIUS, Geometry, Movers
from tests.compiled import compiled


def _collide(G, M, i, j, reach, room):
    return collide(G, M, i, j, reach, room)


meet = compiled(_collide)


def geometry(*shapes):
    """Shapes (kind, parameters) or (kind, parameters, vertices, faces), each on a mover of its own."""
    n = len(shapes)
    shape_i, shape_x = np.zeros((n, 9), dtype=np.int64), np.zeros((n, 24))
    vertex, face = [], []
    for k, (kind, par, *more) in enumerate(shapes):
        corners = np.reshape(more[0], (-1, 3)) if more else np.zeros((0, 3))
        faces = more[1] if len(more) > 1 else []
        shape_i[k, :4] = kind, k, sum(map(len, vertex)), len(corners)
        shape_i[k, FACE_FIRST], shape_i[k, FACE_COUNT] = sum(len(f) + 1 for f in face), len(faces)
        shape_x[k, AXES : AXES + 9] = np.eye(3).ravel()
        shape_x[k, PAR : PAR + len(par)] = par
        shape_x[k, RADIUS] = np.inf if kind == 1 else np.linalg.norm(par) + max([0, *np.linalg.norm(corners, axis=1)])
        vertex.append(corners)
        face += faces
    flat = np.array([x for f in face for x in (len(f), *f)], dtype=np.int64)
    return Geometry(shape_i, shape_x, np.concatenate(vertex), flat, np.zeros((0, 2), dtype=np.int64))


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
