"""Eigenvalues and eigenvectors of a system matrix, their uncertainty, and which eigenvalues are equal.

A perturbation E of the matrix A changes a simple eigenvalue w by y^H E x / y^H x, with x and y the right and left
eigenvectors (Wilkinson 1965). E is taken as the rounding error of every entry; real and imaginary parts smaller than
the resulting uncertainty are set to zero.

The residual A x - w x of the eigenvalue solver is as large as the rounding error of the largest entry. A simple
eigenvalue is therefore recomputed as y^H A x / y^H x, whose error is the square of the residual (Ostrowski 1958), so
that slow eigenvalues are accurate beside fast ones.

Where eigenvectors are nearly parallel, a rounding error r splits a defective eigenvalue by up to sqrt(r), but leaves
the mean of the split values unchanged. Eigenvalues that cannot be separated are therefore replaced by their mean
(Kato 1966, II.2). The number of their eigenvectors is found in their invariant subspace.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import AnalysisError
from .linearized_equations import MatrixUncertainty

ENTRY_ROUNDING = 4.0 * np.finfo(float).eps  # smallest relative uncertainty of every entry
EQUAL_TOLERANCE = 1e-9  # relative difference below which two eigenvalues are equal
MAX_SPLITTING = 1e-4  # rounding splits a defective eigenvalue by less than this part of the matrix norm
NULL_TOLERANCE = 1e-9  # singular values below this part of the largest count as zero
RESIDUAL_LIMIT = 1e-9  # largest residual of A x - w x, relative to |A| |x| + |w| |x|
CORRECTION_LIMIT = 1e-2  # corrections are applied only below this part of the distance to the next eigenvalue
# Entries below this part of the largest are dropped in the second attempt, where balancing over-scales small entries.
NEGLIGIBLE_ENTRY = 1e-15


@dataclass
class Spectrum:
    """Eigenvalues and eigenvectors.

    Attributes
    ----------
    raw : ndarray (n,) complex
        Eigenvalues as computed. Sums of the eigenvalues of a group, and of their powers, are exact to rounding.
    values : ndarray (n,) complex
        The same, with each group replaced by its mean. Real and imaginary parts within rounding are 0.
    vectors : ndarray (n, n) complex
        Eigenvectors. Of each group the first columns are its independent eigenvectors, the rest are as computed.
    groups : list of list of int
        Indices of equal eigenvalues.
    multiplicity, geometric : ndarray (n,) int
        Algebraic and geometric multiplicity of each eigenvalue.
    uncertainty : ndarray (n,)
        Uncertainty of each value.
    residual : float
        Largest residual of A x - w x, relative to |A| |x| + |w| |x|.
    """

    raw: np.ndarray
    values: np.ndarray
    vectors: np.ndarray
    groups: list[list[int]]
    multiplicity: np.ndarray
    geometric: np.ndarray
    uncertainty: np.ndarray
    residual: float


def spectrum(A: np.ndarray, uncertainty: MatrixUncertainty | None = None) -> Spectrum:
    """Solve the eigenvalue problem of a real matrix.

    Parameters
    ----------
    A : ndarray (n, n)
    uncertainty : MatrixUncertainty, optional
        Uncertainty of A, in addition to the rounding of its entries.

    Raises
    ------
    AnalysisError
        If the computed eigenvectors do not fulfil A x = w x.
    """
    n = len(A)
    if not n:
        none = np.zeros(0, complex)
        return Spectrum(none, none, np.zeros((0, 0), complex), [], np.zeros(0, int), np.zeros(0, int), none.real, 0.0)
    # in natural units before the matrix is balanced, so that rounding does not depend on its units
    unit = np.ones(n) if uncertainty is None else 2.0 ** np.round(np.log2(uncertainty.unit))
    B, scale, w, left, right, residual = _balanced_eigenpairs(A / unit[:, None] * unit)
    scale *= unit
    E = [(np.eye(n), ENTRY_ROUNDING * np.abs(B))]
    if uncertainty is not None:
        E.append((uncertainty.by / scale[:, None], uncertainty.size * scale))
    size = float(np.linalg.norm(B, 2))
    inner = (left.conj() * right).sum(axis=0)
    known = sum((np.abs(left.conj().T @ L) * (X @ np.abs(right)).T).sum(axis=1) for L, X in E)
    blur = np.minimum(known / np.maximum(np.abs(inner), 1e-300), MAX_SPLITTING * size)
    better = (left.conj() * (B @ right - w * right)).sum(axis=0) / np.where(inner != 0.0, inner, 1.0)
    out = Spectrum(w, w.copy(), right.copy(), [], np.ones(n, int), np.ones(n, int), blur, residual)
    for group in equal_groups(w, blur):
        if len(group) == 1:
            out.values[group] += _correction(w, group[0], better[group], blur)
        _separate_group(out, group, B, E, blur)
    out.groups.sort()
    out.values = _without_rounding(out.values, blur)
    out.vectors = scale[:, None] * out.vectors
    out.vectors /= np.maximum(np.abs(out.vectors).max(axis=0), 1e-300)
    return out


def _correction(w: np.ndarray, k: int, by: np.ndarray, uncertainty: np.ndarray) -> np.ndarray:
    """Correction of a simple eigenvalue, or 0 where it is within the uncertainty or too large to be trusted."""
    others = np.abs(np.delete(w, k) - w[k]).min(initial=np.inf)
    return np.where((np.abs(by) > uncertainty[k]) & (np.abs(by) < CORRECTION_LIMIT * others), by, 0.0)


def _separate_group(
    out: Spectrum, group: list[int], B: np.ndarray, E: Sequence[tuple[np.ndarray, np.ndarray]], uncertainty: np.ndarray
) -> None:
    """Replace equal eigenvalues by their mean; eigenvalues that differ are removed from the group one by one."""
    w = out.raw
    while len(group) > 1:
        mean, blurred, X, squares = _group_mean(B, E, w[group])
        total, power = w[group].sum(), (w[group] ** 2).sum()
        far = group[int(np.argmax(np.abs(w[group] - mean)))]
        if X is not None and blurred < abs(mean.real) and abs(power - total**2) <= squares:
            # One eigenvalue is nonzero, all others are zero.
            out.values[far], uncertainty[far] = total.real, len(group) * blurred
            mean, blurred, X, _ = _group_mean(B, E, w[group], 0j)
            group.remove(far)
            out.groups.append([far])
        if X is not None:
            X = X[:, : len(group)]
            out.values[group], uncertainty[group] = mean, blurred
            out.vectors[:, group[: X.shape[1]]] = X
            out.multiplicity[group], out.geometric[group] = len(group), X.shape[1]
            break
        group.remove(far)
        out.groups.append([far])
        uncertainty[far] = min(uncertainty[far], squares / abs(w[far] - mean))
    else:
        others = np.abs(np.delete(w, group) - w[group[0]])
        uncertainty[group] = np.minimum(uncertainty[group], 0.5 * others.min(initial=np.inf))
    out.groups.append(group)


def _balanced_eigenpairs(A: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """Balanced matrix, its scale, eigenvalues, left and right unit eigenvectors, and the largest residual."""
    from scipy.linalg import eig, matrix_balance

    kept = np.abs(A) > NEGLIGIBLE_ENTRY * np.abs(A).max()
    worst = np.inf
    for X in (A, np.where(kept, A, 0.0)):
        _, (scale, _) = matrix_balance(X, permute=False, separate=True)
        B = A / scale[:, None] * scale
        w, left, right = eig(X / scale[:, None] * scale, left=True)
        w = w.astype(complex)
        size = np.linalg.norm(np.abs(B) @ np.abs(right), axis=0) + np.abs(w)
        residual = np.linalg.norm(B @ right - w * right, axis=0)
        worst = float((residual / np.where(size > 0.0, size, 1.0)).max())
        if worst <= RESIDUAL_LIMIT:
            return B, scale, w, left, right, worst
    raise AnalysisError(
        f"eigenvectors of the linear equations were found to {worst:.1e} only: their coefficients differ too much in "
        f"size. Look for stiffnesses or masses that are far too large or small"
    )


def _without_rounding(w: np.ndarray, uncertainty: np.ndarray) -> np.ndarray:
    """Set real and imaginary parts that are within the uncertainty to 0."""
    return np.where(np.abs(w.real) <= uncertainty, 0.0, w.real) + 1j * np.where(
        np.abs(w.imag) <= uncertainty, 0.0, w.imag
    )


def equal_groups(w: np.ndarray, uncertainty: np.ndarray) -> list[list[int]]:
    """Indices of eigenvalues that cannot be distinguished, given the ``uncertainty`` of each."""
    size = np.abs(w)
    near = np.abs(w[:, None] - w) <= np.maximum(
        np.minimum(uncertainty[:, None], uncertainty), EQUAL_TOLERANCE * np.minimum(size[:, None], size)
    )
    left, out = set(range(len(w))), []
    while left:
        group, more = set(), {min(left)}
        while more:
            group |= more
            more = {int(j) for i in more for j in np.flatnonzero(near[i])} - group
        left -= group
        out.append(sorted(group))
    return out


def _group_mean(
    B: np.ndarray, E: Sequence[tuple[np.ndarray, np.ndarray]], w: np.ndarray, centre: complex | None = None
) -> tuple[complex, float, np.ndarray | None, float]:
    """Mean of possibly equal eigenvalues, its uncertainty, their eigenvectors, and the uncertainty of their squares.

    The eigenvectors are None if the eigenvalues are not equal. The test uses the sum of squared distances from the
    mean, which is as accurate as the matrix even where each eigenvalue by itself is ill-conditioned. If ``centre`` is
    given, all but one of the eigenvalues are known to equal it, and it is returned as the mean.
    """
    V, W = invariant_subspace(B, w), invariant_subspace(B.conj().T, w.conj())
    inner = np.linalg.pinv(W.conj().T @ V) @ W.conj().T
    mean = complex(w.mean()) if centre is None else centre
    doubt = sum(np.abs(inner @ L) @ X @ np.abs(V) for L, X in E)
    blur = float(np.trace(doubt)) / len(w)
    if abs(mean.imag) <= blur:
        mean = complex(mean.real)
    N = inner @ B @ V - mean * np.eye(len(w))
    squares = 2.0 * float(np.abs(N * doubt.T).sum()) + float((doubt * doubt.T).sum())
    if centre is None and abs(((w - mean) ** 2).sum()) > squares + len(w) * (EQUAL_TOLERANCE * abs(mean)) ** 2:
        return mean, blur, None, squares
    _, d, Vh = np.linalg.svd(N)
    count = max(1, int((d <= max(100.0 * doubt.max(), NULL_TOLERANCE * d[0], EQUAL_TOLERANCE * abs(mean))).sum()))
    X = V @ Vh[len(w) - count :].conj().T
    if mean.imag == 0.0:
        X = np.linalg.svd(np.hstack([X.real, X.imag]))[0][:, :count]
    return mean, blur, X, squares


def invariant_subspace(B: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Orthonormal basis (n, k) of the invariant subspace of k eigenvalues."""
    from scipy.linalg import schur

    def nearest(z: complex) -> float:
        return float(np.abs(values - z).min())

    T = np.diag(schur(B, "complex")[0])
    last = np.sort([nearest(z) for z in T])[len(values) - 1]
    return schur(B, "complex", sort=lambda z: nearest(z) <= last * (1.0 + 1e-9) + 1e-300)[1][:, : len(values)]
