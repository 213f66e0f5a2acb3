"""Eigenvalues: the largest of an operator, and a few of a constrained quadratic pencil.

`dominant_eigenvalue` is Arnoldi's method (Y. Saad, *Numerical Methods for Large Eigenvalue Problems*, 2nd
edition, 2011, section 6.2) for a matrix that is available only through products. Unlike the power method, which
oscillates on them, it finds complex pairs.

`QuadraticPencil` finds a few eigenvalues of M x'' + D x' + K x = G^T l, G x = 0 with sparse matrices and
without reduction to independent coordinates. With x = X exp(s t) and a shift z one solve with [K + z D + z^2 M,
-G^T; G, 0] applies (A - z E)^-1 E of the descriptor form to (x, x') on the subspace that the constraints allow;
its largest eigenvalues 1 / (s - z) belong to the s nearest to z (Ericsson and Ruhe 1980; the infinite
eigenvalues of the constraints become zeros and are removed by solves: Meerbergen and Spence 1997). Undamped
symmetric problems are solved in s^2 with half as many unknowns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import AnalysisError
from .rank import null_basis, saddle_point_solver

BREAKDOWN_TOLERANCE = 1e-10  # relative norm of the new direction below which the Krylov space counts as invariant


def dominant_eigenvalue(product: Callable[[np.ndarray], np.ndarray], start: np.ndarray, most: int) -> complex:
    """Compute the Ritz value of largest modulus.

    Parameters
    ----------
    product : callable
        Product of the matrix with a vector.
    start : numpy.ndarray
        Start vector with a large component along the wanted eigenvector; not zero.
    most : int
        Maximum number of products.

    Returns
    -------
    complex
        Either one of a complex pair; zero if a product is not finite.
    """
    most = min(most, len(start))
    space, H = np.zeros((most + 1, len(start))), np.zeros((most + 1, most))
    space[0] = start / np.linalg.norm(start)
    for k in range(most):
        out = product(space[k])
        if not np.isfinite(out).all():
            return 0j
        size = np.linalg.norm(out)
        for _ in range(2):  # repeated to remove what rounding leaves
            part = space[: k + 1] @ out
            H[: k + 1, k] += part
            out = out - part @ space[: k + 1]
        H[k + 1, k] = np.linalg.norm(out)
        if H[k + 1, k] <= BREAKDOWN_TOLERANCE * size:
            most = k + 1
            break
        space[k + 1] = out / H[k + 1, k]
    values = np.linalg.eigvals(H[:most, :most])
    return complex(values[np.argmax(np.abs(values))])


RELATIVE_SHIFT = 1e-3  # shift to the left of the target, relative to `QuadraticPencil.fastest`
DAMPING_TOLERANCE, SYMMETRY_TOLERANCE = 1e-12, 1e-8  # relative size below which a matrix counts as zero
DENSE_FREEDOMS = 40  # number of freedoms up to which all eigenvalues are computed densely
DISCRIMINANT_ROUNDING = 1e-14  # relative to the terms of the discriminant
START_SOLVES = 3  # solves that remove from the start vector the components forbidden by constraints
EIGENVALUE_TOLERANCE = 1e-6  # largest change by refinement, relative to the distance from the shift


@dataclass
class QuadraticPencil:
    """Matrices M, D, K, G of the linear equations M x'' + D x' + K x = G^T l, G x = 0 about a rest position.

    Attributes
    ----------
    M, D, K : sparse (n, n)
        Scaled so that the unknowns are of comparable size.
    G : sparse (m, n)
        Independent rows of unit size.
    """

    M: Any
    D: Any
    K: Any
    G: Any

    @property
    def freedoms(self) -> int:
        """Number of degrees of freedom: unknowns minus constraint rows."""
        return self.M.shape[0] - self.G.shape[0]

    @cached_property
    def fastest(self) -> float:
        """Rough estimate of the largest characteristic rate [1/s]."""
        stiff, slow = (float(abs(X).max()) if X.nnz else 0.0 for X in (self.K, self.D))
        mass = float(abs(self.M).max())
        return max(np.sqrt(stiff / mass), slow / mass) or 1.0

    @cached_property
    def conservative(self) -> bool:
        """Whether damping and gyroscopic terms vanish and the stiffness matrix is symmetric."""
        size = abs(self.K).max() if self.K.nnz else 0.0
        still = abs(self.D).max() * self.fastest <= DAMPING_TOLERANCE * max(size, 1e-300) if self.D.nnz else True
        return bool(still and (not self.K.nnz or abs(self.K - self.K.T).max() <= SYMMETRY_TOLERANCE * size))

    def solver(self, s: complex) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
        """Return a solver for x of (K + s D + s^2 M) x - G^T l = f, G x = g; raises as `saddle_point_solver`."""
        solve = saddle_point_solver(self.K + s * self.D + s * s * self.M, self.G)
        return lambda f, g: solve(f, g)[0]

    def nearest(self, count: int, near: complex = 0.0) -> tuple[np.ndarray, np.ndarray, float]:
        """Find the eigenvalues nearest to a number, with mode shapes and the largest residual.

        Parameters
        ----------
        count : int
            Minimum number. Both eigenvalues of a complex pair next to a real ``near`` are returned.
        near : complex [1/s]

        Returns
        -------
        w : ndarray (k,) complex
            Sorted by distance from ``near``.
        X : ndarray (n, k) complex
        residual : float
            Largest relative difference between an eigenvector and its image under the inverse iteration.

        Raises
        ------
        AnalysisError
            If the eigenvalues cannot be found.
        """
        if not self.freedoms:
            return np.zeros(0, complex), np.zeros((self.M.shape[0], 0), complex), 0.0
        if 2 * self.freedoms <= max(2 * DENSE_FREEDOMS, 2 * count + 20):
            w, X = self._all()
        elif self.conservative and near == 0.0:
            w, X = self._symmetric(count)
        else:
            w, X = self._shifted(count, near)
        w, X, residual = self._refined(w, X, near)
        order = np.argsort(np.round(np.abs(w - near) / self.fastest, 13), kind="stable")
        return w[order], X[:, order], residual

    def _all(self) -> tuple[np.ndarray, np.ndarray]:
        from scipy.linalg import eig, eigh

        Z = null_basis(self.G)
        M, D, K = (Z.T @ (X @ Z) for X in (self.M, self.D, self.K))
        if self.conservative:
            squares, V = eigh(0.5 * (K + K.T), M)
            return _eigenvalue_pairs(squares, Z @ V)
        one, none = np.eye(len(M)), np.zeros_like(M)
        w, V = eig(np.block([[none, one], [-K, -D]]), np.block([[one, none], [none, M]]))
        known = np.isfinite(w)
        return w[known], Z @ V[: len(M), known]

    def _symmetric(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        from scipy.sparse.linalg import LinearOperator, eigsh

        n, none = self.M.shape[0], np.zeros(self.G.shape[0])
        shift = RELATIVE_SHIFT * self.fastest
        solve = QuadraticPencil(self.M, 0.0 * self.D, 0.5 * (self.K + self.K.T), self.G).solver(shift)
        inverse = LinearOperator((n, n), matvec=lambda b: solve(b.ravel(), none), dtype=float)
        start = solve(self.M @ np.random.default_rng(0).standard_normal(n), none)
        return _eigenvalue_pairs(
            *eigsh(self.K, k=count, M=self.M, sigma=-(shift**2), OPinv=inverse, which="LM", v0=start)
        )

    def _shifted(self, count: int, near: complex) -> tuple[np.ndarray, np.ndarray]:
        from scipy.sparse.linalg import ArpackError, LinearOperator, eigs

        n = self.M.shape[0]
        apply, shift = self._inverse(near)
        start = np.random.default_rng(0).standard_normal(2 * n).astype(np.result_type(shift))
        for _ in range(START_SOLVES):
            start = apply(start)
            start /= np.linalg.norm(start)
        many = min(2 * count + 2, 2 * self.freedoms - 2)
        inverse = LinearOperator((2 * n, 2 * n), matvec=apply, dtype=start.dtype)
        try:
            values, V = eigs(inverse, k=many, which="LM", v0=start)
        except ArpackError as error:
            raise AnalysisError(f"the eigenvalues next to {near:.4g} 1/s were not found: {error}") from None
        return shift + 1.0 / values, V[:n]

    def _inverse(self, near: complex) -> tuple[Callable[[np.ndarray], np.ndarray], complex]:
        """Return the operator (A - z E)^-1 E on (x, x') and the shift z, slightly to the left of ``near``."""
        n = self.M.shape[0]
        z = near - RELATIVE_SHIFT * self.fastest
        z = float(np.real(z)) if np.imag(z) == 0.0 else z
        solve = self.solver(z)
        G, M, by = self.G, self.M, self.D + z * self.M

        def apply(b: np.ndarray) -> np.ndarray:
            b = b.ravel()
            x = solve(-(M @ b[n:]) - by @ b[:n], np.zeros(G.shape[0], b.dtype))
            return np.concatenate([x, b[:n] + z * x])

        return apply, z

    def _refined(self, w: np.ndarray, X: np.ndarray, near: complex) -> tuple[np.ndarray, np.ndarray, float]:
        """Refine eigenpairs by two inverse iterations each; returns them and the largest residual.

        The solves are not affected by rounding at the scale of the fastest motions.
        """
        w, X, worst = w.astype(complex), X.astype(complex), 0.0
        apply, z = self._inverse(near)
        for k in range(len(w)):
            before = np.concatenate([X[:, k], w[k] * X[:, k]])
            first = apply(before)
            first /= np.linalg.norm(first)
            then = apply(first)
            inverse = np.vdot(first, then)
            worst = max(worst, float(np.linalg.norm(then - inverse * first) / abs(inverse)))
            x = then[: len(X)] / np.linalg.norm(then[: len(X)])
            value = _nearest_quadratic_root([np.vdot(x, A @ x) for A in (self.M, self.D, self.K)], w[k])
            if abs(value - w[k]) <= EIGENVALUE_TOLERANCE * abs(w[k] - z):
                w[k], X[:, k] = value, x
        if self.conservative:
            w = np.where(np.abs(w.imag) > np.abs(w.real), 1j * w.imag, w.real)
        return w, X, worst


def _eigenvalue_pairs(squares: np.ndarray, V: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the eigenvalues +-w and their shapes from -w^2."""
    w = np.sqrt(-squares.astype(complex))
    return np.concatenate([w, -w]), np.hstack([V, V]).astype(complex)


def _nearest_quadratic_root(a: list[complex], near: complex) -> complex:
    """Return the root of a[0] s^2 + a[1] s + a[2] nearest to a number; the mean of a root split by rounding."""
    if abs(a[1] ** 2 - 4.0 * a[0] * a[2]) <= DISCRIMINANT_ROUNDING * abs(a[1]) ** 2:
        return -0.5 * a[1] / a[0]
    roots = np.roots(a)
    return complex(roots[np.argmin(np.abs(roots - near))]) if len(roots) else near
