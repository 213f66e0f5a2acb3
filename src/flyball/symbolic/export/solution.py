"""Accelerations and multipliers as straight-line code: the one solve of the house (`equations/solve.py`) on nodes.

    [M G^T; G 0] [vdot; -lam] = [f; gamma]

Nothing is inverted: the matrices are factored sparsely, with the engine's regularisation, and the solution is refined a
fixed number of times, since straight-line code cannot decide when to stop. Of the multipliers that redundancy leaves
open it finds those that the engine declares.

Loads of joints with friction, of which the forces are linear functions, follow from a fixed number of Newton's steps,
from no load upwards: see `equations/friction.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...equations.solve import factor_schur, inverse_mass
from ...errors import ModelError
from ...graph.arrays import objects, zeros
from ...graph.derivative import jacobian, replaced
from ...graph.printers.routine import refuse_long
from ...graph.values import symbols
from ...numerics.ldl import Pattern, analyse, ldl_factor, ldl_solve
from ...tables.system import changed
from ...tracing.trace import Traced

REFINEMENTS = 2  # what the regularisation leaves of a well determined solution goes below rounding with the first
LIGHT = 4  # where a mass is semidefinite, a stand-in has to be taken out too
STEPS = 7  # of Newton's for loads: quadratic from the first step on whose side the solution is

Once = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass
class Solution:
    """What the equations of motion give at a state that fulfils g = 0 and G v = nu."""

    vdot: np.ndarray  # (nv,)
    lam: np.ndarray  # (nr,)
    loads: np.ndarray  # (nl,): of joints with friction


def solution(x: Traced) -> Solution:
    """Solve the traced equations.

    Parameters
    ----------
    x : Traced
        With rows for all that drivers prescribe, as `symbolic.formulated` has them.

    Raises
    ------
    ModelError
        If a force is no linear function of the load of a joint with friction.
    """
    once = coupled(x) if len(x.system.mass_entries.row) else schur(x)
    if not x.loads:
        return Solution(*_refined(x, once, x.f, x.gamma), zeros(0))
    return _loaded(x, once)


def _refined(x: Traced, once: Once, f: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A solution, put right by what it misses of the true equations."""
    light = x.system.scales.semidefinite > 0.0
    balanced = not len(x.system.mass_entries.row) and not light  # each step fulfils M vdot = f + G^T lam then
    vdot, lam = once(f, gamma)
    for _ in range(LIGHT if light else REFINEMENTS if len(lam) else 1):
        left = zeros(len(f)) if balanced else f - x.M @ vdot + _forces(x.G, lam)
        dv, dl = once(left, gamma - x.G @ vdot if len(lam) else gamma)
        vdot, lam = vdot + dv, lam + dl
    return vdot, lam


def _forces(G: np.ndarray, lam: np.ndarray) -> np.ndarray:
    return G.T @ lam if len(lam) else zeros(G.shape[1])


def schur(x: Traced) -> Once:
    """Through S = G M^-1 G^T, M being of the bodies themselves: `solve.factor_schur`."""
    S, nr = x.system, len(x.lam)
    rows = np.repeat(np.arange(nr), np.diff(S.row_start[: nr + 1]))
    W = x.work._replace(
        G=zeros(len(x.work.G)), H=zeros(len(x.work.H)), rows=changed(lambda _, a: a.copy(), x.work.rows)
    )
    W.G[: len(rows)] = x.G[rows, S.column[: len(rows)]]
    _refuse_long(S.ldl)
    n = len(S.ldl.perm)
    D = np.array([zeros(n), zeros(n), zeros(n)], object)
    W = W._replace(A=zeros(len(S.ldl.Ai) + 1), L=zeros(len(S.ldl.Li)), D=D)
    factor_schur(S, W)
    L, D = W.L, W.D[0]

    def once(f: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        dx = zeros(len(f))
        for b in range(len(S.tree.parent)):
            inverse_mass(S, b, f, S.tree.v[b], dx, S.tree.v[b])
        mu = solved(S.ldl, L, D, gamma - x.G @ dx) if nr else gamma
        for e, k in enumerate(rows):
            dx[S.column[e]] = dx[S.column[e]] + W.H[e] * mu[k]
        return dx, mu

    return once


def coupled(x: Traced) -> Once:
    """With [M G^T; G -delta]: `solve.factor_coupled`; zeros that the tables cannot know are left out of the pattern."""
    nv, nr = len(x.v), len(x.lam)
    K = np.zeros((nv + nr, nv + nr), object)
    K[:nv, :nv] = x.M
    K[nv:, :nv] = x.G
    lever = min(1.0, float(x.system.scales.length.real)) ** 2
    for k in range(nr):
        size: Any = 0.0
        for d in weighed(x, k):
            size = size + (x.G[k, d] * x.G[k, d] + lever) / x.M[d, d]
        K[nv + k, nv + k] = -x.system.scales.regularization * (1.0 if size == 0.0 else size)
    below = [(i, j) for i in range(nv + nr) for j in touched(K[i, :i])]
    i, j = np.array(below, np.int64).reshape(-1, 2).T
    P, place = analyse(nv + nr, i, j)
    A = zeros(len(P.Ai))
    for at, entry in zip(place, [*K[i, j], *K.diagonal()], strict=True):
        A[at] = entry
    L, D = factored(P, A)

    def once(f: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        both = solved(P, L, D, np.concatenate([f, gamma]))
        return both[:nv], -both[nv:]

    return once


def weighed(x: Traced, k: int) -> list[int]:
    """Velocities whose inertia says how large row k is: all that it could touch, without those prescribed."""
    S = x.system
    if k >= len(S.rows.law):  # of a driver that prescribes a velocity
        return touched(x.G[k])
    entries = range(S.row_start[k], S.row_start[k + 1])
    return [int(S.column[e]) for e in entries if S.pairs.place[e] < len(S.ldl.Ai)]


def touched(row: np.ndarray) -> list[int]:
    """Places of a row that are not known to be zero."""
    return [d for d, entry in enumerate(row) if not entry == 0.0]


def factored(P: Pattern, A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """L and the inverse diagonal: the engine's own factor on nodes, which takes pivots for granted.

    Raises
    ------
    ModelError
        If it takes more operations than straight-line code is written of.
    """
    _refuse_long(P)
    n = len(P.perm)
    L, D = zeros(len(P.Li)), zeros(n)
    ldl_factor(P, A, L, D, zeros(n))
    return L, D


def _refuse_long(P: Pattern) -> None:
    columns = np.diff(P.Lp)
    refuse_long("the solution", int(2 * (columns * (columns + 3)).sum()))


def solved(P: Pattern, L: np.ndarray, D: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Solve with a factor."""
    z = zeros(len(b))
    z[P.perm] = b
    ldl_solve(P, L, D, z)
    return z[P.perm]


def _loaded(x: Traced, once: Once) -> Solution:
    """Where friction depends on the reactions and these on friction.

    Multipliers are linear functions of the loads, lam = lam0 + K load; each load is a norm of some of them.
    """
    slopes = jacobian(list(x.f), x.loads)
    if set(symbols(list(slopes.ravel()))) & set(x.loads):
        raise ModelError("a force is no linear function of the load of a joint with friction: simulate it here")
    f0 = objects(replaced(list(x.f), [(s, 0.0) for s in x.loads]))
    vdot, lam = _refined(x, once, f0, x.gamma)
    columns = [_refined(x, once, slopes[:, n], zeros(len(lam))) for n in range(len(x.loads))]
    A, K = (np.array([c[k] for c in columns], object).T for k in (0, 1))
    by_lam = jacobian(list(x.returned), x.lam)
    loads = zeros(len(x.loads))
    for _ in range(STEPS):
        at = list(zip(x.lam, lam + K @ loads, strict=True))
        back = objects(replaced(list(x.returned), at))
        slope = objects(replaced(list(by_lam.ravel()), at)).reshape(by_lam.shape) @ K
        loads = loads + eliminated(np.eye(len(loads)) - slope, back - loads)
    return Solution(vdot + A @ loads, lam + K @ loads, loads)


def eliminated(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Solve a few equations by Gauss' elimination, in the order given: the diagonal is one less a slope below one."""
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
