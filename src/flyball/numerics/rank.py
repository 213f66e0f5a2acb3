"""Rank, null spaces and saddle-point solves, of dense and of sparse matrices; defines which singular values are zero.

The rows of sparse matrices have unit length. Rank and dependencies are found by singular values where the matrix is
small, by the pivots of L D L^T of G G^T where it is large. Saddle-point equations (an operator with constraint rows)
are solved by a sparse L U with iterative refinement, which also yields an orthonormal basis of what independent rows
allow.

The compiled part finds the combinations of rows with the smallest singular values by inverse iteration with one
factor of H H^T (Golub and Van Loan 2013, sections 7.3 and 8.2). All but the last vector of a block become
dependencies; the last turns to the combination with the smallest singular value that is not zero. Dependencies
are refined with the true residual x H, because squaring in H H^T loses digits.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..compiler.formulas import formula
from ..errors import AnalysisError
from .sparse_factorisation import LDLPattern, analyse_ldl, ldl_factor_kernel, ldl_solve

RANK_TOLERANCE = 1e-8  # relative to the largest singular value; rows are scaled to unit length


def svd(A: np.ndarray, full: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Singular values and vectors: U, d, V^T of A = U diag(d) V^T.

    NumPy's algorithm, divide and conquer (LAPACK's ``gesdd``), does not converge for some finite matrices with many
    singular values that are equal up to rounding. The slower implicit QR iteration (``gesvd``) does.
    """
    try:
        return np.linalg.svd(A, full_matrices=full)
    except np.linalg.LinAlgError:
        from scipy.linalg import svd as by_iteration

        return by_iteration(A, full_matrices=full, lapack_driver="gesvd")


class FundamentalSubspaces(NamedTuple):
    """Orthonormal bases of the four fundamental subspaces of a matrix A (n, m) of rank r."""

    span: np.ndarray  # (n, r): column space
    dependencies: np.ndarray  # (n, n - r): y with y A = 0
    row_space: np.ndarray  # (m, r): row space
    null: np.ndarray  # (m, m - r): x with A x = 0
    values: np.ndarray  # (r,): nonzero singular values

    @property
    def rank(self) -> int:
        """Number of independent rows."""
        return len(self.values)


def fundamental_subspaces(
    A: np.ndarray, tolerance: float = RANK_TOLERANCE, size: float | None = None
) -> FundamentalSubspaces:
    """Compute the four fundamental subspaces by singular value decomposition.

    Parameters
    ----------
    A : ndarray (n, m)
    tolerance : float
        Singular values below ``tolerance * size`` count as zero.
    size : float, optional
        Default: the largest singular value.
    """
    n, m = A.shape
    if not A.size:
        return FundamentalSubspaces(np.zeros((n, 0)), np.eye(n), np.zeros((m, 0)), np.eye(m), np.zeros(0))
    U, d, Vt = svd(A, full=True)
    r = _count_nonzero(d, tolerance, size)
    return FundamentalSubspaces(U[:, :r], U[:, r:], Vt[:r].T, Vt[r:].T, d[:r])


def rank(A: np.ndarray, tolerance: float = RANK_TOLERANCE, size: float | None = None) -> int:
    """Return the number of independent rows (and columns); parameters as for `fundamental_subspaces`."""
    return _count_nonzero(np.linalg.svd(A, compute_uv=False), tolerance, size) if A.size else 0


def column_space(A: np.ndarray, tolerance: float = RANK_TOLERANCE, size: float | None = None) -> np.ndarray:
    """Orthonormal basis (n, r) of the column space; efficient for few columns. As for `fundamental_subspaces`."""
    if not A.size:
        return A[:, :0]
    U, d, _ = svd(A)
    return U[:, : _count_nonzero(d, tolerance, size)]


def null_space(A: np.ndarray, tolerance: float = RANK_TOLERANCE, size: float | None = None) -> np.ndarray:
    """Orthonormal basis (m, m - r) of the vectors x with A x = 0; parameters as for `fundamental_subspaces`."""
    return fundamental_subspaces(A, tolerance, size).null


def _count_nonzero(d: np.ndarray, tolerance: float, size: float | None) -> int:
    return int((d > tolerance * max(d[0] if size is None else size, 1e-300)).sum())


MAX_ITERATIONS, MIN_ITERATIONS = 50, 2  # iterations of singular values
VALUE_TOLERANCE = 1e-4  # relative change of a singular value at which its iteration ends
DEPENDENCY_REFINEMENTS = 2  # refinement steps per dependency


@formula
def combine_rows(row_p, col_i, H, x, w):
    """Write x H to w; returns its squared norm."""
    for d in range(w.shape[0]):
        w[d] = 0.0
    for k in range(x.shape[0]):
        for e in range(row_p[k], row_p[k + 1]):
            w[col_i[e]] += H[e] * x[k]
    s = 0.0
    for d in range(w.shape[0]):
        s += w[d] * w[d]
    return s


@formula
def largest_singular_value(row_p, col_i, H, y, w):
    """Estimate the largest singular value by power iteration with H H^T from y, which the next call can start from."""
    value = 0.0
    for _ in range(MAX_ITERATIONS):
        size = 0.0
        for k in range(y.shape[0]):
            size += y[k] * y[k]
        size = size**0.5
        for k in range(y.shape[0]):
            y[k] /= size
        before = value
        value = combine_rows(row_p, col_i, H, y, w) ** 0.5
        for k in range(y.shape[0]):
            y[k] = row_times_vector(row_p, col_i, H, w, k)
        if abs(before - value) <= VALUE_TOLERANCE * value:
            break
    return value


@formula
def row_times_vector(row_p, col_i, H, w, k):
    """Row k of H times w."""
    s = 0.0
    for e in range(row_p[k], row_p[k + 1]):
        s += H[e] * w[col_i[e]]
    return s


@formula
def solve_normal_equations(P, L, D, x, z):
    """Overwrite x with (H H^T)^-1 x; ``z`` is scratch."""
    for k in range(x.shape[0]):
        z[P.perm[k]] = x[k]
    ldl_solve(P, L, D, z)
    for k in range(x.shape[0]):
        x[k] = z[P.perm[k]]


@formula
def refine_dependency(P, L, D, row_p, col_i, H, x, w, z):
    """Subtract from x the correction given by its residual x H."""
    combine_rows(row_p, col_i, H, x, w)
    for k in range(x.shape[0]):
        z[P.perm[k]] = row_times_vector(row_p, col_i, H, w, k)
    ldl_solve(P, L, D, z)
    for k in range(x.shape[0]):
        x[k] -= z[P.perm[k]]


@formula
def orthonormalise(X, i):
    """Orthogonalise vector i against those before it, twice because rounding is magnified, and normalise it."""
    n = X.shape[1]
    for _ in range(2):
        s = 0.0
        for k in range(n):
            s += X[i, k] * X[i, k]
        s = 1.0 / s**0.5 if s > 0.0 else 0.0
        for k in range(n):
            X[i, k] *= s
        for j in range(i):
            s = 0.0
            for k in range(n):
                s += X[i, k] * X[j, k]
            for k in range(n):
                X[i, k] -= s * X[j, k]
    s = 0.0
    for k in range(n):
        s += X[i, k] * X[i, k]
    s = 1.0 / s**0.5 if s > 0.0 else 0.0
    for k in range(n):
        X[i, k] *= s


@formula
def smallest_singular_values(P, L, D, row_p, col_i, H, X, w, z):
    """Rotate the rows of X to the row combinations with the smallest singular values; w (m,) and z (n,) are scratch.

    Returns (singular value of the last one, the largest of the others, which are the candidate dependencies).
    """
    last = X.shape[0] - 1
    value = 1e300
    for turn in range(MAX_ITERATIONS):
        for i in range(last + 1):
            solve_normal_equations(P, L, D, X[i], z)
            orthonormalise(X, i)
        before = value
        value = combine_rows(row_p, col_i, H, X[last], w) ** 0.5
        if turn >= MIN_ITERATIONS and abs(before - value) <= VALUE_TOLERANCE * value:
            break
    largest = 0.0
    for i in range(last):
        for _ in range(DEPENDENCY_REFINEMENTS):
            refine_dependency(P, L, D, row_p, col_i, H, X[i], w, z)
        orthonormalise(X, i)
        largest = max(largest, combine_rows(row_p, col_i, H, X[i], w) ** 0.5)
    return value, largest


MAX_SVD_SIZE = 150  # rows or columns up to which singular values are as fast as pivots
MAX_DOUBTFUL_SVD_SIZE = 1500  # rows or columns up to which singular values decide doubtful pivots
CERTAIN_PIVOT = 1e-8  # pivots of unit rows above this are certainly nonzero: singular values above 1e-4
ZERO_PIVOT = 1e-10  # pivots of a large matrix with unit rows below this count as zero
DOUBTFUL_PIVOT = 1e-5  # pivots up to this may come from the diagonal shift (null vectors with |x|^2 < 1e8)
DIAGONAL_SHIFT = 1e-13  # added to the diagonal of such a matrix
ROOM = 2**24  # largest number of entries (128 MB) of a null-space basis of a matrix larger than `MAX_DOUBTFUL_SVD_SIZE`


def sparse_matrix_rank(G: Any) -> int:
    """Return the number of independent rows of a sparse matrix or an array."""
    if max(G.shape) > MAX_SVD_SIZE and (found := rank_by_pivots(G)) is not None:
        return found[0]
    return rank(_as_array(G))


def null_spaces(G: Any) -> tuple[int, np.ndarray, np.ndarray | None]:
    """Rank, dependencies among the rows (n, n - rank), and a basis of the null space (m, m - rank).

    G is sparse, or an array. If pivots decide, the basis of dependencies is not orthonormal and the null space is None.
    For a matrix larger than `MAX_DOUBTFUL_SVD_SIZE` only as many dependencies are returned as `ROOM` allows.
    """
    if max(G.shape) > MAX_SVD_SIZE and (found := rank_by_pivots(G)) is not None:
        return *found, None
    q = fundamental_subspaces(_as_array(G))
    return q.rank, q.dependencies, q.null


def rank_by_pivots(G: Any) -> tuple[int, np.ndarray] | None:
    """Rank and dependencies among the rows; None if pivots are doubtful and singular values must decide."""
    import scipy.sparse as sp

    G = sp.csr_matrix(G)
    p = SemidefinitePivots(G @ G.T)
    basis = p.vectors(p.reported_pivots) if max(G.shape) > MAX_DOUBTFUL_SVD_SIZE else p.dependencies(G)
    return None if basis is None else (int(G.shape[0]) - len(p.weak), basis)


def _as_array(G: Any) -> np.ndarray:
    return G if isinstance(G, np.ndarray) else np.asarray(G.toarray())


def sparse_null_space(A: Any) -> tuple[int, np.ndarray]:
    """Dimension and basis of the null space of a sparse semidefinite matrix; as many vectors as `ROOM` allows."""
    weak, vectors = weak_pivots(A)
    return len(weak), vectors


def weak_pivots(A: Any) -> tuple[np.ndarray, np.ndarray]:
    """Unknowns of a sparse positive semidefinite matrix whose pivots are zero, and null-space vectors.

    Returns
    -------
    weak : ndarray of int
        As many as the null space has dimensions. For G G^T: rows that depend on the other rows, which are independent.
    vectors : ndarray (n, k)
        Basis of the null space: as many vectors as `ROOM` allows.
    """
    p = SemidefinitePivots(A)
    return np.argsort(p.pattern.perm)[p.weak], p.vectors(p.reported_pivots)


class SemidefinitePivots:
    """Zero pivots of a sparse positive semidefinite matrix, in the elimination order chosen here.

    Uses A + shift = L D L^T. If a pivot is no larger than the shift of the diagonal, L^T x = e_k yields a vector of the
    null space. The pivot equals x^T A x, so for a vector with many or large entries it is larger in proportion to
    |x|^2; the Rayleigh quotient decides then.

    Attributes
    ----------
    weak : ndarray of int
        Indices of zero pivots, in elimination order.
    least : float
        The smallest of the other pivots.
    """

    def __init__(self, A: Any) -> None:
        import scipy.sparse as sp

        n = A.shape[0]
        self.size = np.sqrt(np.where(A.diagonal() > 0.0, A.diagonal(), 1.0))
        unit = sp.diags(1.0 / self.size)
        self.pattern, L, self.inverse = _factor_shifted(unit @ A @ unit, DIAGONAL_SHIFT)
        self.lower = sp.csc_matrix((L, self.pattern.Li, self.pattern.Lp), shape=(n, n)) + sp.identity(n, format="csc")
        with np.errstate(divide="ignore"):
            pivots = 1.0 / self.inverse
        sure, doubtful = ~(pivots > ZERO_PIVOT), (pivots > ZERO_PIVOT) & (pivots < DOUBTFUL_PIVOT)
        found = [np.flatnonzero(sure)]
        for which in np.split(rest := np.flatnonzero(doubtful), range(max_vectors(n), len(rest), max_vectors(n))):
            quotients = pivots[which] / np.maximum((self._ends(which) ** 2).sum(axis=0), 1.0)
            found.append(which[quotients < 10.0 * DIAGONAL_SHIFT])
        self.weak = np.sort(np.concatenate(found))
        self.least = float(np.delete(pivots, self.weak).min(initial=np.inf))

    @property
    def reported_pivots(self) -> np.ndarray:
        """Zero pivots whose null vectors fit into `ROOM`."""
        return self.weak[: max_vectors(len(self.inverse))]

    def vectors(self, which: np.ndarray) -> np.ndarray:
        """Null-space vectors (n, k) of the given zero pivots, scaled to largest entry 1."""
        return _scale_columns(self._ends(which)[self.pattern.perm] / self.size[:, None])

    def dependencies(self, G: Any) -> np.ndarray | None:
        """Basis (n, k) of the null space of the matrix G G^T; None if zero pivots are doubtful.

        A step of inverse iteration removes the effect of the diagonal shift. The residual x G then decides on
        dependency as reliably as singular values.
        """
        if not self.least > CERTAIN_PIVOT:
            return None
        x = self.vectors(self.weak)
        if len(self.weak):
            x = _scale_columns(x - self._solve(G @ (G.T @ x)))
            if not (np.linalg.norm(G.T @ x, axis=0) <= RANK_TOLERANCE * np.linalg.norm(x, axis=0)).all():
                return None
        return x

    def _ends(self, which: np.ndarray) -> np.ndarray:
        """Vectors x with L^T x = e_k, in elimination order."""
        from scipy.sparse.linalg import spsolve_triangular

        ends = np.zeros((len(self.inverse), len(which)))
        ends[which, np.arange(len(which))] = 1.0
        return spsolve_triangular(self._upper, ends, lower=False) if len(which) else ends

    @cached_property
    def _upper(self) -> Any:
        return self.lower.T.tocsr()

    def _solve(self, b: np.ndarray) -> np.ndarray:
        """Solve with A + diagonal shift."""
        from scipy.sparse.linalg import spsolve_triangular

        y = np.zeros_like(b)
        y[self.pattern.perm] = b / self.size[:, None]
        y = spsolve_triangular(self.lower.tocsr(), y, unit_diagonal=True)
        y = spsolve_triangular(self._upper, self.inverse[:, None] * y, lower=False, unit_diagonal=True)
        return y[self.pattern.perm] / self.size[:, None]


def max_vectors(n: int) -> int:
    """Return the number of vectors of n numbers that fit into `ROOM`."""
    return max(ROOM // max(n, 1), 1)


def _scale_columns(x: np.ndarray) -> np.ndarray:
    """Scale columns to largest entry 1."""
    return x / np.maximum(np.abs(x).max(axis=0, initial=0.0), 1e-300)


def negative_pivots(A: Any) -> int:
    """Return the number of negative eigenvalues of a sparse symmetric matrix (Sylvester's law of inertia)."""
    return int((_factor_shifted(A, 0.0)[2] < 0.0).sum())


def _factor_shifted(A: Any, added: float) -> tuple[LDLPattern, np.ndarray, np.ndarray]:
    """Factor A + ``added`` * I = L D L^T; returns the pattern, L, and the inverse of D."""
    A = A.tocoo()
    n = A.shape[0]
    P, place = analyse_ldl(n, A.row, A.col)
    upper = P.perm[A.row] <= P.perm[A.col]  # each pair of entries counts once
    x = np.zeros(len(P.Ai))
    np.add.at(x, place[: A.nnz][upper], A.data[upper])
    x[P.Ap[1:] - 1] += added
    D, L = np.zeros(n), np.zeros(len(P.Li))
    ldl_factor_kernel(P, x, L, D, np.zeros(n))
    return P, L, D


SOLVE_REFINEMENTS = 2  # refinement steps of a solution
INDEPENDENCE_MARGIN = 1e-4  # relative size above which singular values are certainly nonzero


def saddle_point_solver(
    P: Any, G: Any, H: Any = None, refined: int = SOLVE_REFINEMENTS
) -> Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return a solver for x and l of P x - G^T l = f, H x = g; H defaults to G; ``refined`` refinement steps.

    Raises
    ------
    AnalysisError
        If the linear system is singular.
    """
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu

    n, size = P.shape[0], abs(P).max() or 1.0
    A = (sp.bmat([[P, -size * G.T], [size * (G if H is None else H), None]]) if G.shape[0] else P).tocsc()
    try:
        factor = splu(A)
    except RuntimeError:
        raise AnalysisError(
            "the linear equations have no one solution: something moves without inertia, or this is an eigenvalue"
        ) from None

    def once(b: np.ndarray) -> np.ndarray:
        if np.iscomplexobj(b) and not np.iscomplexobj(A.data):
            return once(np.ascontiguousarray(b.real)) + 1j * once(np.ascontiguousarray(b.imag))
        return factor.solve(b.astype(A.dtype))

    def solve(f: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        b = np.concatenate([f, size * g])
        y = once(b)
        for _ in range(refined):
            y += once(b - A @ y)
        return y[:n], size * y[n:]

    return solve


def null_basis(G: Any) -> np.ndarray:
    """Orthonormal basis (n, n - m) of the null space of independent rows (m, n).

    Random vectors are projected on it and made orthonormal by the Cholesky factor of their Gram matrix, twice
    (Yamamoto and others 2015). These are matrix products; Householder reflections would take several times as long.
    """
    import scipy.sparse as sp
    from scipy.linalg import solve_triangular

    m, n = G.shape
    if not m:
        return np.eye(n)
    project = saddle_point_solver(sp.identity(n, format="csr"), G, refined=0)  # the second projection refines it
    basis = np.random.default_rng(1).standard_normal((n, n - m))
    for _ in range(2):
        basis = project(basis, np.zeros((m, n - m)))[0]
        basis = solve_triangular(np.linalg.cholesky(basis.T @ basis), basis.T, lower=True).T
    return basis


def clearly_independent(G: Any) -> bool:
    """Whether rows of unit size are clearly independent: G G^T minus a small multiple of I has no negative pivots."""
    import scipy.sparse as sp

    A = G @ G.T
    largest = np.sqrt(abs(A).sum(axis=1).max())
    return negative_pivots(A - (INDEPENDENCE_MARGIN * largest) ** 2 * sp.identity(A.shape[0])) == 0
