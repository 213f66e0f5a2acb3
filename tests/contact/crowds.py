"""Crowds of spheres and planes as tables, and all their contacts by looking at every pair."""

import numpy as np

from flyball.collision.contact_finder import no_movers
from flyball.collision.shape_kinds import PLANE, SPHERE
from flyball.collision.tables import Dimensions, Geometry, Shapes


def geometry(radii, movers=None, planes=(), apart=(), member=1, mask=-1, places=None):
    """Spheres, each on a mover of its own (unless said), then planes that stand still: (point, normal)."""
    n, k = len(radii), len(planes)
    shape, dimensions = Shapes.blank(n + k), Dimensions.blank(n + k)
    shape.member[:], shape.mask[:] = 1, -1
    shape.member[:n], shape.mask[:n] = member, mask
    shape.kind[:n], shape.mover[:n] = SPHERE, np.arange(n) if movers is None else movers
    dimensions.axes[:, [0, 4, 8]] = 1.0
    dimensions.par[:n, 0] = dimensions.radius[:n] = radii
    if places is not None:
        dimensions.place[:n] = places
    for i, (point, normal) in enumerate(planes, start=n):
        shape.kind[i], shape.mover[i], dimensions.radius[i] = PLANE, -1, np.inf
        z = np.array(normal) / np.linalg.norm(normal)
        x = np.cross(z, [0.3, 0.5, -0.7])
        x /= np.linalg.norm(x)
        dimensions.place[i], dimensions.axes[i] = point, np.stack([x, np.cross(z, x), z], 1).ravel()
    pairs = np.array(sorted((min(p), max(p)) for p in apart), np.int64).reshape(-1, 2)
    return Geometry(shape, dimensions, np.zeros((0, 3)), np.zeros(0, np.int64), pairs)


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
    for k in range(n, len(G.shape)):
        z, p = G.dimensions.axes[k, [2, 5, 8]], G.dimensions.place[k]
        gap = (x - p) @ z - r
        out |= {(i, k) for i in np.flatnonzero(gap < margin + ahead * np.maximum(0.0, -(v @ z)))}
    return out


def pairs_of(C):
    """The pairs of shapes that have contacts."""
    n = C.count.found
    return [(int(a), int(b)) for a, b in C.at[:n, :2]]


def gaps_of(C):
    """Gap by pair."""
    return dict(zip(pairs_of(C), C.x.gap[: C.count.found]))


def identities_hold(C, O, features=True):
    """Every contact names the one of the same shapes and feature before it, if there was one; else none."""
    n, m = C.count.found, O.count.found
    told = {tuple(row[:3]): k for k, row in enumerate(O.at[:m].tolist())}
    return [told.get(tuple(row[:3]), -1) for row in C.at[:n].tolist()] == C.at.before[:n].tolist()
