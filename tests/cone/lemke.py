"""Lemke's pivoting for small linear complementarity problems, and for small pyramids of contacts.

w = M z + q, w >= 0, z >= 0, w . z = 0 (Lemke 1965; Cottle, Pang and Stone 1992, algorithm 4.4.5). Ties are
broken lexicographically, so that it cannot cycle. For copositive-plus M, as those of friction pyramids
(Stewart and Trinkle 1996), it finds a solution if one exists. Dense and in NumPy: a pivot costs the square
of the size, and the number of pivots is usually similar to that of unknowns.
"""

from __future__ import annotations

import numpy as np

from flyball.errors import AnalysisError
from flyball.numerics.complementarity.contact_operator import (
    apply_contact_impulse,
    apply_line_impulse,
    contact_velocity,
    line_velocity,
)
from flyball.numerics.complementarity.contact_problem import ContactProblem, ContactSolution

MAX_UNKNOWNS = 2000  # maximum number of unknowns: takes seconds
PIVOT_TOLERANCE = 1e-11  # relative to the largest entry of the column; smaller pivots count as zero


def lemke(M: np.ndarray, q: np.ndarray, pivots: int = 0) -> np.ndarray:
    """Find z with w = M z + q, w >= 0, z >= 0, w . z = 0.

    Parameters
    ----------
    M : ndarray (n, n)
    q : ndarray (n,)
    pivots : int
        Maximum number of pivots; 50 n if 0.

    Returns
    -------
    ndarray (n,)

    Raises
    ------
    AnalysisError
        If pivoting ends on a ray: for copositive-plus M there is no solution then. If there are more than 2000
        unknowns, or the maximum number of pivots is reached.
    """
    n = len(q)
    if n > MAX_UNKNOWNS:
        raise AnalysisError(f"{n} unknowns are too many for pivoting (at most {MAX_UNKNOWNS}): use an iterative solver")
    if (q >= 0).all():
        return np.zeros(n)
    # columns: w, z, z0, q; rows are those of the basis, of which the first n columns are the inverse
    T = np.hstack([np.eye(n), -M, -np.ones((n, 1)), q[:, None]]).astype(float)
    basis = np.arange(n)
    enter, row = 2 * n, _lexicographic_row(T, np.arange(n), -np.ones(n), n, start=True)
    for _ in range(pivots or 50 * n + 50):
        leave = int(basis[row])
        _pivot(T, row, enter)
        basis[row] = enter
        if leave == 2 * n:
            return _read_solution(T, basis, n)
        enter = leave + n if leave < n else leave - n  # the complement
        column = T[:, enter]
        rows = np.flatnonzero(column > PIVOT_TOLERANCE * max(1.0, abs(column).max()))
        if not rows.size:
            raise AnalysisError("pivoting ended on a ray: no impulses satisfy all conditions of these contacts")
        held = np.flatnonzero(basis[rows] == 2 * n)
        ratios = T[rows, -1] / column[rows]
        if held.size and ratios[held[0]] <= ratios.min() * (1 + 1e-12) + 1e-300:
            row = int(rows[held[0]])  # z0 may leave: solved
        else:
            row = _lexicographic_row(T, rows, column, n)
    raise AnalysisError(f"pivoting found no solution in {pivots or 50 * n + 50} pivots")


def _lexicographic_row(T: np.ndarray, rows: np.ndarray, column: np.ndarray, n: int, start: bool = False) -> int:
    """Row with the lexicographically smallest (q, inverse of the basis) / column; it is unique."""
    order = [-1, *range(n)]
    for k in order:
        if len(rows) == 1:
            break
        ratio = T[rows, k] / (1.0 if start else column[rows])
        rows = rows[ratio <= ratio.min() + 1e-14 * max(1e-300, abs(ratio).max())]
    return int(rows[0])


def _pivot(T: np.ndarray, row: int, column: int) -> None:
    T[row] /= T[row, column]
    factor = T[:, column].copy()
    factor[row] = 0.0
    T -= factor[:, None] * T[row]


def _read_solution(T: np.ndarray, basis: np.ndarray, n: int) -> np.ndarray:
    z = np.zeros(n)
    inside = (basis >= n) & (basis < 2 * n)
    z[basis[inside] - n] = np.maximum(T[inside, -1], 0.0)
    return z


def delassus(P: ContactProblem, X: ContactSolution) -> tuple[np.ndarray, np.ndarray]:
    """Compute N and b as dense arrays: impulses contact by contact, then lines; without rolling friction."""
    nc, nl = int(P.size[0]), int(P.size[3])
    v, wide = np.zeros_like(X.v), np.zeros_like(X.wide)
    N = np.zeros((3 * nc + nl, 3 * nc + nl))

    def velocities(v: np.ndarray, wide: np.ndarray) -> np.ndarray:
        contacts = [x for c in range(nc) for x in contact_velocity(P, v, wide, c)]
        return np.array([*contacts, *(line_velocity(P, wide, k) for k in range(nl))])

    for k in range(3 * nc + nl):
        v[:], wide[:] = 0.0, 0.0
        if k < 3 * nc:
            apply_contact_impulse(P, v, wide, k // 3, tuple(1.0 * (k % 3 == s) for s in range(3)))
        else:
            apply_line_impulse(P, wide, k - 3 * nc, 1.0)
        N[:, k] = velocities(v, wide)
    N[3 * np.arange(nc), 3 * np.arange(nc)] += P.soft[:nc]
    at = 3 * nc + np.arange(nl)
    N[at, at] += P.line_law.soft[:nl]
    return N, velocities(X.v, X.wide) + np.concatenate([P.bias[:nc].ravel(), P.line_law.bias[:nl]])


def pyramid_by_lemke(P: ContactProblem, X: ContactSolution, directions: int = 8) -> None:
    """Solve contacts with friction pyramids by pivoting; writes impulses and velocities to X.

    Parameters
    ----------
    P : ContactProblem
        Contacts of nodes and groups, without lines and rolling friction.
    X : ContactState
        Velocities without impulses on entry.
    directions : int
        Number of edges of a pyramid, at least three.

    Raises
    ------
    AnalysisError
        If there are lines, rolling friction, or fewer than three directions; also as `lemke`.
    """
    nc = int(P.size[0])
    if P.size[3] or len(P.turn) or directions < 3:
        raise AnalysisError("pivoting takes contacts without lines or rolling friction, pyramids of 3 edges or more")
    N, b = delassus(P, X)
    angle = 2 * np.pi * np.arange(directions) / directions
    G = np.zeros((3 * nc, nc * (1 + directions)))
    for c in range(nc):
        G[3 * c, c] = 1.0
        edges = slice(nc + c * directions, nc + (c + 1) * directions)
        G[3 * c + 1, edges], G[3 * c + 2, edges] = np.cos(angle), np.sin(angle)
    E = np.zeros((nc * (1 + directions), nc))
    E[nc:] = np.repeat(np.eye(nc), directions, axis=0)
    bound = -E.T
    bound[:, :nc] = np.diag(P.mu[:nc])
    M = np.block([[G.T @ N @ G, E], [bound, np.zeros((nc, nc))]])
    size = np.trace(N) / len(N)  # scales velocities and impulses to one size
    z = lemke(
        np.block([[M[:-nc, :-nc] / size, E], [bound, np.zeros((nc, nc))]]), np.concatenate([G.T @ b, np.zeros(nc)])
    )
    X.p[:nc] = (G @ z[: nc * (1 + directions)] / size).reshape(nc, 3)
    for c in range(nc):
        apply_contact_impulse(P, X.v, X.wide, c, tuple(X.p[c]))
