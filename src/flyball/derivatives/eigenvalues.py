"""Eigenvalues and eigenvectors of a system matrix, their uncertainty, and which eigenvalues are equal.

A perturbation E of the matrix moves a simple eigenvalue by y^H E x / y^H x (Wilkinson 1965). With E what rounding
may have made of every entry, smaller real and imaginary parts are set to zero. What the solver has left of A x - w
x is as large as rounding of the largest entry: a simple eigenvalue is computed as y^H A x / y^H x, whose error is
its square (Ostrowski 1958), so that slow ones are accurate beside fast ones. Where eigenvectors are nearly
parallel, rounding by r splits a defective eigenvalue by as much as sqrt(r), but not its mean: eigenvalues that
cannot be separated become their mean (Kato 1966, II.2), and their number of common eigenvectors is found in the
invariant subspace.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import AnalysisError
from .reduced_equations import MatrixUncertainty

ENTRY_ROUNDING = 4.0 * np.finfo(float).eps  # of every entry: what is uncertain of it at least
EQUAL_TOLERANCE = 1e-9  # difference of eigenvalues, of their own size, below which they are one
MAX_SPLITTING = 1e-4  # of the matrix' size: a defective eigenvalue is not split further than this by rounding
NULL_TOLERANCE = 1e-9  # singular values below this part of the largest are none
RESIDUAL_LIMIT = 1e-9  # what may be left of A x - w x, of |A| |x| + |w| |x|
CORRECTION_LIMIT = (
    1e-2  # of the way to the next eigenvalue: corrections are small beside it, and their squares are none
)
NEGLIGIBLE_ENTRY = 1e-15  # of the largest entry: left out where balancing makes too much of small entries


@dataclass
class Spectrum:
    """Eigenvalues and eigenvectors.

    Attributes
    ----------
    raw : ndarray (n,) complex
        Eigenvalues as computed: sums of those of a group, and of their powers, are exact to rounding.
    values : ndarray (n,) complex
        The same, those of one group replaced by their mean; real and imaginary parts that are rounding are 0.
    vectors : ndarray (n, n) complex
        Eigenvectors, of a group as many as it has, then as computed.
    groups : list of list of int
        Indices of eigenvalues that are one.
    multiplicity, geometric : ndarray (n,) int
        How many eigenvalues are one with each, and how many eigenvectors they have in common.
    blur : ndarray (n,)
        What each of the values is uncertain by.
    residual : float
        The largest part of A x - w x, of |A| |x| + |w| |x|.
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
    uncertainty : Doubt, optional
        What is uncertain of it, besides the last digits of its entries.

    Raises
    ------
    AnalysisError
        If eigenvectors do not fulfil A x = w x.
    """
    n = len(A)
    if not n:
        none = np.zeros(0, complex)
        return Spectrum(none, none, np.zeros((0, 0), complex), [], np.zeros(0, int), np.zeros(0, int), none.real, 0.0)
    B, scale, w, left, right, residual = _balanced_eigenpairs(A)
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
    """What makes a simple eigenvalue better, where the solver has left more than the matrix is uncertain by."""
    others = np.abs(np.delete(w, k) - w[k]).min(initial=np.inf)
    return np.where((np.abs(by) > uncertainty[k]) & (np.abs(by) < CORRECTION_LIMIT * others), by, 0.0)


def _separate_group(
    out: Spectrum, group: list[int], B: np.ndarray, E: Sequence[tuple[np.ndarray, np.ndarray]], uncertainty: np.ndarray
) -> None:
    """Replace eigenvalues that are one by their mean; those that are not leave the group, one after the other."""
    w = out.raw
    while len(group) > 1:
        mean, blurred, X, squares = _group_mean(B, E, w[group])
        total, power = w[group].sum(), (w[group] ** 2).sum()
        far = group[int(np.argmax(np.abs(w[group] - mean)))]
        if X is not None and blurred < abs(mean.real) and abs(power - total**2) <= squares:
            out.values[far], uncertainty[far] = total.real, len(group) * blurred  # one beside others that are zero
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
    """Eigenvalues without parts that are rounding."""
    return np.where(np.abs(w.real) <= uncertainty, 0.0, w.real) + 1j * np.where(
        np.abs(w.imag) <= uncertainty, 0.0, w.imag
    )


def equal_groups(w: np.ndarray, uncertainty: np.ndarray) -> list[list[int]]:
    """Indices of eigenvalues that are the same as far as can be told, where ``uncertainty`` is what each is uncertain by."""
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
    """Of eigenvalues that may be one: mean, what it is uncertain by, eigenvectors; what squares are uncertain by.

    There are no vectors if they are not one: the sum of squared distances from the mean is found as exactly as the
    matrix is known, however ill-conditioned each of them is by itself. With ``centre`` it is known that all but one are
    that, which is then returned for the mean.
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
    """Orthonormal basis (n, k) of what belongs to k eigenvalues."""
    from scipy.linalg import schur

    def nearest(z: complex) -> float:
        return float(np.abs(values - z).min())

    T = np.diag(schur(B, "complex")[0])
    last = np.sort([nearest(z) for z in T])[len(values) - 1]
    return schur(B, "complex", sort=lambda z: nearest(z) <= last * (1.0 + 1e-9) + 1e-300)[1][:, : len(values)]
