"""Accelerations and multipliers as straight-line code: the engine's regularised solve evaluated on expressions.

    [M G^T; G 0] [vdot; -lam] = [f; gamma]

No matrix is inverted: the matrices are factorised sparsely with the engine's regularisation, and the solution is
refined a fixed number of times, since straight-line code cannot test convergence. Multipliers that redundant
constraints leave undetermined are those of the engine. Forces are linear functions of the loads of joints with
friction; the loads follow from a fixed number of Newton steps that start without load.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...engine.solve import apply_inverse_mass, factor_schur
from ...errors import ModelError
from ...expression_graph.evaluation import jacobian, substitute, symbols_of
from ...expression_graph.graph import object_vector, zero_objects
from ...expression_graph.printers.routines import refuse_too_long
from ...expression_graph.tracing import TracedEquations
from ...numerics.sparse_factorisation import LDLPattern, analyse_ldl, ldl_factor, ldl_solve
from ...tables.table_definitions import FactorVectors, map_arrays

# The first refinement reduces the regularisation error of a well determined solution below rounding.
REFINEMENTS = 2
# A semidefinite mass matrix uses substitute masses, whose effect must be removed, too.
LIGHT_VELOCITIES = 4
# Newton steps for loads; convergence is quadratic from the first step on the solution's side.
NEWTON_STEPS = 7

SinglePass = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass
class Solution:
    """Solution of the equations of motion at a state that fulfils g = 0 and G v = nu."""

    vdot: np.ndarray  # (nv,)
    lam: np.ndarray  # (nr,)
    loads: np.ndarray  # (nl,), of joints with friction


def solve_traced(x: TracedEquations) -> Solution:
    """Solve the traced equations.

    Parameters
    ----------
    x : TracedEquations
        With rows for all prescribed coordinates, as in `symbolic.named_equations`.

    Raises
    ------
    ModelError
        If a force is not a linear function of the load of a joint with friction.
    """
    once = coupled(x) if len(x.system.mass_entries.row) else schur(x)
    if not x.loads:
        return Solution(*_refined(x, once, x.f, x.gamma), zero_objects(0))
    return _loaded(x, once)


def _refined(x: TracedEquations, once: SinglePass, f: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solution refined by its residuals in the unregularised equations."""
    light = x.system.scales.semidefinite > 0.0
    balanced = not len(x.system.mass_entries.row) and not light  # each step fulfils M vdot = f + G^T lam then
    vdot, lam = once(f, gamma)
    for _ in range(LIGHT_VELOCITIES if light else REFINEMENTS if len(lam) else 1):
        left = zero_objects(len(f)) if balanced else f - x.M @ vdot + _forces(x.G, lam)
        dv, dl = once(left, gamma - x.G @ vdot if len(lam) else gamma)
        vdot, lam = vdot + dv, lam + dl
    return vdot, lam


def _forces(G: np.ndarray, lam: np.ndarray) -> np.ndarray:
    return G.T @ lam if len(lam) else zero_objects(G.shape[1])


def schur(x: TracedEquations) -> SinglePass:
    """Solution by S = G M^-1 G^T with the mass matrix M of single bodies: `solve.factor_schur`."""
    S, nr = x.system, len(x.lam)
    rows = np.repeat(np.arange(nr), np.diff(S.row_start[: nr + 1]))
    W = x.work._replace(
        G=zero_objects(len(x.work.G)),
        H=zero_objects(len(x.work.H)),
        rows=map_arrays(lambda _, a: a.copy(), x.work.rows),
    )
    W.G[: len(rows)] = x.G[rows, S.column[: len(rows)]]
    _refuse_long(S.ldl)
    n = len(S.ldl.perm)
    ldl = zero_objects(FactorVectors.layout.width, n).view(FactorVectors)
    W = W._replace(A=zero_objects(len(S.ldl.Ai) + 1), L=zero_objects(len(S.ldl.Li)), ldl=ldl)
    factor_schur(S, W)
    L, D = W.L, W.ldl.inverse_diagonal

    def once(f: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        dx = zero_objects(len(f))
        for b in range(len(S.tree.parent)):
            apply_inverse_mass(S, b, f, S.tree.v[b], dx, S.tree.v[b])
        mu = solve_factored(S.ldl, L, D, gamma - x.G @ dx) if nr else gamma
        for e, k in enumerate(rows):
            dx[S.column[e]] = dx[S.column[e]] + W.H[e] * mu[k]
        return dx, mu

    return once


def coupled(x: TracedEquations) -> SinglePass:
    """Solution by [M G^T; G -delta]: `solve.factor_coupled`; symbolic zeros are left out of the pattern."""
    nv, nr = len(x.v), len(x.lam)
    K = np.zeros((nv + nr, nv + nr), object)
    K[:nv, :nv] = x.M
    K[nv:, :nv] = x.G
    for k in range(nr):
        size: Any = 0.0
        for d, least in zip(inertia_velocities(x, k), entry_sizes(x, k), strict=True):
            size = size + (x.G[k, d] * x.G[k, d] + least * least) / x.M[d, d]
        K[nv + k, nv + k] = -x.system.scales.regularization * (1.0 if size == 0.0 else size)
    below = [(i, j) for i in range(nv + nr) for j in possible_entries(K[i, :i])]
    i, j = np.array(below, np.int64).reshape(-1, 2).T
    P, place = analyse_ldl(nv + nr, i, j)
    A = zero_objects(len(P.Ai))
    for at, entry in zip(place, [*K[i, j], *K.diagonal()], strict=True):
        A[at] = entry
    L, D = factor_matrix(P, A)

    def once(f: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        both = solve_factored(P, L, D, np.concatenate([f, gamma]))
        return both[:nv], -both[nv:]

    return once


def inertia_velocities(x: TracedEquations, k: int) -> list[int]:
    """Velocities whose inertia scales row k: all that it can act on, except prescribed ones."""
    S = x.system
    if k >= len(S.rows.law):  # row of a driver that prescribes a velocity
        return possible_entries(x.G[k])
    return [int(S.column[e]) for e in inertia_entries(x, k)]


def entry_sizes(x: TracedEquations, k: int) -> np.ndarray:
    """Size of the entry of row k in the column of each of its `inertia_velocities`."""
    S = x.system
    if k >= len(S.rows.law):
        return np.ones(len(possible_entries(x.G[k])))  # the row has the unit of the velocity that it prescribes
    return S.entry_sizes[inertia_entries(x, k)]


def inertia_entries(x: TracedEquations, k: int) -> list[int]:
    """Entries of row k, of those in `Work.G`, except in columns of prescribed velocities."""
    S = x.system
    return [e for e in range(S.row_start[k], S.row_start[k + 1]) if S.pairs.place[e] < len(S.ldl.Ai)]


def possible_entries(row: np.ndarray) -> list[int]:
    """Indices of the entries of a row that are not known to be zero."""
    return [d for d, entry in enumerate(row) if not entry == 0.0]


def factor_matrix(P: LDLPattern, A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """L and the inverse diagonal, by the engine's factorisation on nodes, which assumes nonzero pivots.

    Raises
    ------
    ModelError
        If it takes too many operations for straight-line code.
    """
    _refuse_long(P)
    n = len(P.perm)
    L, D = zero_objects(len(P.Li)), zero_objects(n)
    ldl_factor(P, A, L, D, zero_objects(n))
    return L, D


def _refuse_long(P: LDLPattern) -> None:
    columns = np.diff(P.Lp)
    refuse_too_long("the solution", int(2 * (columns * (columns + 3)).sum()))


def solve_factored(P: LDLPattern, L: np.ndarray, D: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Solve with the factors."""
    z = zero_objects(len(b))
    z[P.perm] = b
    ldl_solve(P, L, D, z)
    return z[P.perm]


def _loaded(x: TracedEquations, once: SinglePass) -> Solution:
    """Solution where friction depends on the reactions, and these on friction.

    Multipliers are linear functions of the loads, lam = lam0 + K load; each load is a norm of some of them.
    """
    slopes = jacobian(list(x.f), x.loads)
    if set(symbols_of(list(slopes.ravel()))) & set(x.loads):
        raise ModelError("a force is no linear function of the load of a joint with friction: simulate it here")
    f0 = object_vector(substitute(list(x.f), [(s, 0.0) for s in x.loads]))
    vdot, lam = _refined(x, once, f0, x.gamma)
    columns = [_refined(x, once, slopes[:, n], zero_objects(len(lam))) for n in range(len(x.loads))]
    A, K = (np.array([c[k] for c in columns], object).T for k in (0, 1))
    by_lam = jacobian(list(x.returned), x.lam)
    loads = zero_objects(len(x.loads))
    for _ in range(NEWTON_STEPS):
        at = list(zip(x.lam, lam + K @ loads, strict=True))
        back = object_vector(substitute(list(x.returned), at))
        slope = object_vector(substitute(list(by_lam.ravel()), at)).reshape(by_lam.shape) @ K
        loads = loads + eliminate(np.eye(len(loads)) - slope, back - loads)
    return Solution(vdot + A @ loads, lam + K @ loads, loads)


def eliminate(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Solve a few equations by Gaussian elimination without pivoting: the diagonal is one minus a slope below one."""
    A, b, n = A.astype(object), b.copy(), len(b)
    for k in range(n):
        for i in range(k + 1, n):
            factor = A[i, k] / A[k, k]
            A[i, k + 1 :] = A[i, k + 1 :] - factor * A[k, k + 1 :]
            b[i] = b[i] - factor * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] = b[k] - A[k, j] * b[j]
        b[k] = b[k] / A[k, k]
    return b
