"""Crowds of spheres and planes as tables, and all their contacts by looking at every pair."""

import numpy as np

from flyball.collision.contact_finder import no_movers
from flyball.collision.shape_kinds import PLANE, SPHERE
from flyball.collision.tables import AXES, BEFORE, FOUND, GAP, KIND, MASK, MEMBER, MOVER, PAR, RADIUS, Geometry


def geometry(radii, movers=None, planes=(), apart=(), member=1, mask=-1, places=None):
    """Spheres, each on a mover of its own (unless said), then planes that stand still: (point, normal)."""
    n, k = len(radii), len(planes)
    shape_i, shape_x = np.zeros((n + k, 9), np.int64), np.zeros((n + k, 24))
    shape_i[:, MEMBER], shape_i[:, MASK] = 1, -1
    shape_i[:n, MEMBER], shape_i[:n, MASK] = member, mask
    shape_i[:n, KIND], shape_i[:n, MOVER] = SPHERE, np.arange(n) if movers is None else movers
    shape_x[:, [AXES, AXES + 4, AXES + 8]] = 1.0
    shape_x[:n, PAR] = shape_x[:n, RADIUS] = radii
    if places is not None:
        shape_x[:n, :3] = places
    for i, (point, normal) in enumerate(planes, start=n):
        shape_i[i, KIND], shape_i[i, MOVER], shape_x[i, RADIUS] = PLANE, -1, np.inf
        z = np.array(normal) / np.linalg.norm(normal)
        x = np.cross(z, [0.3, 0.5, -0.7])
        x /= np.linalg.norm(x)
        shape_x[i, :3], shape_x[i, AXES : AXES + 9] = point, np.stack([x, np.cross(z, x), z], 1).ravel()
    pairs = np.array(sorted((min(p), max(p)) for p in apart), np.int64).reshape(-1, 2)
    return Geometry(shape_i, shape_x, np.zeros((0, 3)), np.zeros(0, np.int64), pairs)


def moving(x, v=None):
    """Movers at these positions with these velocities."""
    M = no_movers(len(x))
    M.pose[:, :3] = x
    if v is not None:
        M.twist[:, :3] = v
    return M


def spheres_that_touch(x, v, r, margin, ahead):
    """{(i, j)} of spheres whose surfaces come within the margin, as they go or if one of them is stopped, by all pairs."""
    i, j = np.triu_indices(len(x), 1)
    d = x[j] - x[i]
    near = np.zeros(len(i), bool)
    for u in (v[j] - v[i], v[j], -v[i]):
        u2 = np.maximum((u * u).sum(1), 1e-300)
        t = np.clip(-(d * u).sum(1) / u2, 0.0, ahead)
        near |= np.linalg.norm(d + t[:, None] * u, axis=1) - r[i] - r[j] < margin
    return {(a, b) for a, b in zip(i[near], j[near])}


def on_planes(G, x, v, r, margin, ahead):
    """The same with the planes of G."""
    n = len(x)
    out = set()
    for k in range(n, len(G.shape_i)):
        z, p = G.shape_x[k, [AXES + 2, AXES + 5, AXES + 8]], G.shape_x[k, :3]
        gap = (x - p) @ z - r
        out |= {(i, k) for i in np.flatnonzero(gap < margin + ahead * np.maximum(0.0, -(v @ z)))}
    return out


def pairs_of(C):
    """The pairs of shapes that have contacts."""
    n = C.count[FOUND]
    return [(int(a), int(b)) for a, b in C.at[:n, :2]]


def gaps_of(C):
    """Gap by pair."""
    return dict(zip(pairs_of(C), C.x[: C.count[FOUND], GAP]))


def identities_hold(C, O, features=True):
    """Every contact names the one of the same shapes and feature before it, if there was one; else none."""
    n, m = C.count[FOUND], O.count[FOUND]
    told = {tuple(row[:3]): k for k, row in enumerate(O.at[:m].tolist())}
    return all(told.get(tuple(row[:3]), -1) == row[BEFORE] for row in C.at[:n].tolist())
