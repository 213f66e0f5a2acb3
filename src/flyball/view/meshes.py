"""Meshes made small enough for a page.

Vertices are gathered in the cells of a grid and each cell's vertices become one, put where it is nearest to the planes
of the cell's triangles: P. Lindstrom, "Out-of-core simplification of large polygonal models", SIGGRAPH 2000.
"""

from __future__ import annotations

import numpy as np

FLAT = 1e-3  # directions in which a cell's planes say less than this part of the most they say are left to its middle


def simplified(vertices: np.ndarray, triangles: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """A mesh of about the same shape with few triangles.

    Parameters
    ----------
    vertices : ndarray (k, 3) [m]
    triangles : ndarray (m, 3) of int
    most : int
        Number of triangles to keep at most; a mesh that has no more keeps its form exactly.

    Returns
    -------
    vertices, triangles : ndarray
        Only vertices that are used; equal ones are one.
    """
    vertices, triangles = _welded(np.asarray(vertices, float), np.asarray(triangles, np.int64))
    if len(triangles) <= most:
        return vertices, triangles
    low = vertices.min(axis=0)
    extent = float((vertices.max(axis=0) - low).max())
    coarse, fine = 1, 1024  # cells along the longest side
    while fine - coarse > 1:
        middle = (coarse + fine) // 2
        cells = _cells(vertices - low, extent / middle)
        if _kept(cells, triangles).sum() <= most:
            coarse = middle
        else:
            fine = middle
    cells = _cells(vertices - low, extent / coarse)
    points = _representatives(vertices, triangles, cells, extent / coarse)
    return _welded(points, cells[triangles[_kept(cells, triangles)]])


def _welded(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Equal vertices made one, unused ones and empty or repeated triangles left out."""
    used, index = np.unique(triangles, return_inverse=True)
    points, same = np.unique(vertices[used], axis=0, return_inverse=True)
    t = same.reshape(-1)[index.reshape(triangles.shape)]
    t = t[_kept(np.arange(len(points)), t)]
    first = np.unique(np.sort(t, axis=1), axis=0, return_index=True)[1]
    t = t[np.sort(first)]
    used, index = np.unique(t, return_inverse=True)
    return points[used], index.reshape(-1, 3)


def _cells(p: np.ndarray, edge: float) -> np.ndarray:
    """Number of each point's cell, counted from 0 over the cells that hold any."""
    k = (p / edge).astype(np.int64)
    n = k.max(axis=0) + 1
    return np.unique((k[:, 0] * n[1] + k[:, 1]) * n[2] + k[:, 2], return_inverse=True)[1].reshape(-1)


def _kept(cells: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Which triangles have their corners in three cells."""
    a, b, c = cells[triangles].T
    return (a != b) & (b != c) & (c != a)


def _representatives(vertices: np.ndarray, triangles: np.ndarray, cells: np.ndarray, edge: float) -> np.ndarray:
    """For each cell the point with the least sum of squared distances from its triangles' planes, in the cell."""
    count = int(cells.max()) + 1
    number = np.bincount(cells, minlength=count)
    middle = np.stack([np.bincount(cells, vertices[:, i], count) for i in range(3)], axis=1) / number[:, None]
    p, q, r = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(q - p, r - p)  # its length weighs a triangle by its area
    A, b = np.zeros((count, 3, 3)), np.zeros((count, 3))
    for k in range(3):
        home = cells[triangles[:, k]]
        height = np.einsum("ij,ij->i", normal, p - middle[home])
        np.add.at(A, home, normal[:, :, None] * normal[:, None, :])
        np.add.at(b, home, normal * height[:, None])
    w, V = np.linalg.eigh(A)
    firm = w > FLAT * w[:, -1:]
    inverse = np.where(firm, 1.0 / np.where(firm, w, 1.0), 0.0)
    shift = np.einsum("nij,nj,nkj,nk->ni", V, inverse, V, b)
    far = np.abs(shift).max(axis=1) > edge  # planes that meet outside of the cell say nothing about it
    shift[far] = 0.0
    return middle + shift
