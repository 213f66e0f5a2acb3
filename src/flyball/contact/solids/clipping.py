"""Triangles cut by planes, corners of regions, and what is inside a closed surface."""

from __future__ import annotations

import itertools

import numpy as np

SLIVER = 1e-9  # of the size cubed: less volume is none


def normals_of(triangles: np.ndarray) -> np.ndarray:
    """Unit normals (m, 3); nan for triangles without area."""
    n = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    with np.errstate(invalid="ignore"):
        return n / np.linalg.norm(n, axis=1, keepdims=True)


def clipped(triangles: np.ndarray, plane: np.ndarray, thick: float) -> np.ndarray:
    """Triangles (m, 3, 3) where n . x <= c, the plane being (n, c).

    Of triangles within ``thick`` of the plane those remain whose solid, behind them, is on that side.
    """
    d = triangles @ plane[:3] - plane[3]
    d[np.abs(d) <= thick] = 0.0
    flat = (d == 0.0).all(axis=1)
    same = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) @ plane[:3] > 0
    keep = np.where(flat, same, (d <= 0.0).all(axis=1))
    across = (d > 0.0).any(axis=1) & (d < 0.0).any(axis=1)
    cut = [x for t, s in zip(triangles[across], d[across], strict=True) for x in _cut(t, s)]
    return np.concatenate([triangles[keep], np.array(cut).reshape(-1, 3, 3)])


def _cut(t: np.ndarray, d: np.ndarray) -> list[np.ndarray]:
    """What is below of one triangle whose corners are at heights d, as triangles (Sutherland and Hodgman 1974)."""
    out = []
    for k in range(3):
        a, b, x, y = t[k], t[(k + 1) % 3], d[k], d[(k + 1) % 3]
        if x <= 0.0:
            out.append(a)
        if x * y < 0.0:
            out.append(a + (x / (x - y)) * (b - a))
    return [np.array([out[0], b, c]) for b, c in itertools.pairwise(out[1:])]


def corners_of(planes: np.ndarray, thick: float) -> np.ndarray:
    """Corners (k, 3) of the region n . x <= c of all planes (n, c)."""
    triples = np.array(list(itertools.combinations(range(len(planes)), 3)))
    normal, c = planes[triples, :3], planes[triples, 3]
    good = np.abs(np.linalg.det(normal)) > 1e-6
    if not good.any():
        return np.zeros((0, 3))
    x = np.linalg.solve(normal[good], c[good][..., None])[..., 0]
    return x[(x @ planes[:, :3].T <= planes[:, 3] + thick).all(axis=1)]


def winding(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """How often a closed surface goes round each point: 1 inside, 0 outside (Van Oosterom and Strackee 1983)."""
    out = np.zeros(len(points))
    for k, x in enumerate(points):
        a, b, c = np.moveaxis(triangles - x, 1, 0)
        la, lb, lc = (np.linalg.norm(s, axis=1) for s in (a, b, c))
        top = np.einsum("ij,ij->i", a, np.cross(b, c))
        ab, bc, ca = (np.einsum("ij,ij->i", s, t) for s, t in ((a, b), (b, c), (c, a)))
        out[k] = np.sum(np.arctan2(top, la * lb * lc + ab * lc + bc * la + ca * lb)) / (2 * np.pi)
    return out
