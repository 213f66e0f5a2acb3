"""Response surfaces over samples: the mean of what is scattered, where other parameters vary too."""

from __future__ import annotations

import numpy as np

GRID = 48  # places along each axis
LEAST = 1e-10  # smallest part of the largest singular value of a local fit that counts


def surface_of_means(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean of z by x and y on a grid, nan outside of the samples, which do not lie on a line.

    By local linear regression with Gaussian weights (Cleveland and Devlin, Journal of the American Statistical
    Association 83, 1988), their widths by Scott's rule, n^(-1/6) standard deviations (Scott, *Multivariate Density
    Estimation*, 1992, eq. 6.42).

    Parameters
    ----------
    x, y, z : ndarray (n,)

    Returns
    -------
    tuple of ndarray
        x (g,), y (g,), means (g, g), y along the rows.
    """
    from scipy.spatial import Delaunay

    points = np.column_stack([(v - v.mean()) / (v.std() or 1.0) for v in (x, y)])
    inside = Delaunay(points)
    axes = [np.linspace(v.min(), v.max(), GRID) for v in points.T]
    width = max(len(z), 2) ** (-1.0 / 6.0)
    means = np.full((GRID, GRID), np.nan)
    for k, b in enumerate(axes[1]):
        at = np.column_stack([axes[0], np.full(GRID, b)])
        known = inside.find_simplex(at) >= 0
        means[k, known] = _fitted(points, z, at[known], width)
    return np.linspace(x.min(), x.max(), GRID), np.linspace(y.min(), y.max(), GRID), means


def _fitted(points: np.ndarray, z: np.ndarray, at: np.ndarray, width: float) -> np.ndarray:
    """Values at some places of the planes that fit best near each of them."""
    d = points[None] - at[:, None]
    w = np.exp(-0.5 * (d**2).sum(axis=2) / width**2)
    A = np.concatenate([np.ones((*d.shape[:2], 1)), d], axis=2)
    S = np.einsum("gni,gn,gnj->gij", A, w, A)
    r = np.einsum("gni,gn->gi", A, w * z)
    return np.einsum("gij,gj->gi", np.linalg.pinv(S, rcond=LEAST, hermitian=True), r)[:, 0]
