"""Accelerations and multipliers as straight-line code: the one solve of the house (`equations/solve.py`) on nodes.

    [M G^T; G 0] [vdot; -lam] = [f; gamma]

Nothing is inverted: the matrices are factored in the engine's own pattern and order of elimination, with its
regularisation, and the solution is refined a fixed number of times, since straight-line code cannot decide when to
stop. Of the multipliers that redundancy leaves open it finds the same ones as the engine.

Loads of joints with friction, of which the forces are linear functions, follow from a fixed number of Newton's steps,
from no load upwards: see `equations/friction.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..equations.rows import BY_TIME
from ..equations.solve import ROUNDING, inverse_mass, natural_size, turn_rows
from ..errors import ModelError
from ..graph.derivative import jacobian, replaced
from ..graph.node import Node
from ..graph.values import symbols
from ..laws.evaluation import evaluate_jet
from ..numerics.ldl import Pattern, ldl_solve
from ..tables.system import BODY_LAW, DIAGONAL, LENGTH, OFFSET, Q0, REGULARISE, SEMIDEFINITE, V0
from .trace import Traced

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
    effort: np.ndarray  # (nv,): what drivers do along velocities that they prescribe; 0 elsewhere
    prescribed: list[tuple[Node, Any]]  # coordinates and velocities that drivers prescribe, and what these are


def solution(x: Traced, refinements: int | None = None) -> Solution:
    """Solve the traced equations.

    Parameters
    ----------
    x : Traced
    refinements : int, optional
        How often the solution is put right by what it misses.

    Raises
    ------
    ModelError
        If a force is no linear function of the load of a joint with friction.
    """
    if refinements is None:
        refinements = LIGHT if x.system.glob[SEMIDEFINITE] > 0.0 else REFINEMENTS
    given, law_of = prescribed(x)
    once = coupled(x) if len(x.system.mass_i) else schur(x)

    def solved(f: np.ndarray, gamma: np.ndarray, at: dict[int, Any]) -> tuple[np.ndarray, np.ndarray]:
        return _refined(x, once, (f, gamma, at), refinements)

    if not x.loads:
        vdot, lam = solved(x.f, x.gamma, given)
        loads = _zeros(0)
    else:
        vdot, lam, loads = _loaded(x, solved, given)
    f = _array(replaced(list(x.f), list(zip(x.loads, loads, strict=True))))
    missing = f - x.M @ vdot + x.G.T @ lam
    effort = _zeros(len(vdot))
    for d in given:
        effort[d] = -missing[d]
    found = (
        [_array(replaced(list(a), law_of)) for a in (vdot, lam, loads, effort)]
        if law_of
        else [vdot, lam, loads, effort]
    )
    return Solution(*found, law_of)


def prescribed(x: Traced) -> tuple[dict[int, Any], list[tuple[Node, Any]]]:
    """Accelerations of prescribed velocities by their numbers; what such coordinates and velocities are by their laws."""
    S, W = x.system, x.work
    given: dict[int, Any] = {}
    law_of: list[tuple[Node, Any]] = []
    for b in range(len(S.body_i)):
        law = S.body_i[b, BODY_LAW]
        if law >= 0:
            f, f1, f2 = evaluate_jet(S.code, S.const, law, W.stack, x.t, W.sensed, BY_TIME)
            given[int(S.body_i[b, V0])] = f2
            law_of += [(x.q[S.body_i[b, Q0]], f - S.body_x[b, OFFSET]), (x.v[S.body_i[b, V0]], f1)]
    return given, law_of


def _refined(x: Traced, once: Once, sides: tuple[Any, ...], refinements: int) -> tuple[np.ndarray, np.ndarray]:
    """A solution, put right by what it misses of the true equations."""
    f, gamma, given = sides
    vdot, lam = _zeros(len(x.v)), _zeros(len(x.lam))
    for d, a in given.items():
        vdot[d] = a
    heavy = not len(x.system.mass_i) and not x.system.glob[SEMIDEFINITE] > 0.0  # M vdot = f + G^T lam by construction
    for n in range(1 + refinements):
        left = _zeros(len(f)) if heavy and n else f - x.M @ vdot + x.G.T @ lam
        for d in given:
            left[d] = 0.0
        dv, dl = once(left, gamma - x.G @ vdot)
        for d in given:
            dv[d] = 0.0
        vdot, lam = vdot + dv, lam + dl
    return vdot, lam


def schur(x: Traced) -> Once:
    """Through S = G M^-1 G^T, M being of the bodies themselves: `solve.factor_schur`."""
    S, W = x.system, x.work
    nr = len(x.lam)
    turn_rows(S, W)
    A = _zeros(len(S.ldl.Ai))
    for i, j, length, place in S.pair_i:
        for k in range(length):
            A[place] = A[place] + W.G[i + k] * W.H[j + k]
    natural_size(S, W)
    for k in range(nr):
        place = S.ldl.Ap[S.ldl.perm[k] + 1] - 1
        A[place] = A[place] + S.glob[REGULARISE] * W.row[DIAGONAL, k] + ROUNDING * A[place]
    L, D = factored(S.ldl, A)
    H = W.H.copy()

    def once(f: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        dx = _zeros(len(f))
        for b in range(len(S.body_i)):
            inverse_mass(S, b, f, S.body_i[b, V0], dx, S.body_i[b, V0])
        mu = solved(S.ldl, L, D, gamma - x.G @ dx)
        for k in range(nr):
            for e in range(S.row_p[k], S.row_p[k + 1]):
                dx[S.col_i[e]] = dx[S.col_i[e]] + H[e] * mu[k]
        return dx, mu

    return once


def coupled(x: Traced) -> Once:
    """With [M G^T; G -delta]: `solve.factor_coupled`."""
    S, W = x.system, x.work
    nv, nr = len(x.v), len(x.lam)
    A, per = _zeros(len(S.ldl.Ai) + 1), _zeros(nv)
    lever = min(1.0, float(S.glob[LENGTH].real)) ** 2
    for e, (i, j, place) in enumerate(S.mass_i):
        A[place] = W.M[e]
        if i == j:
            per[i] = 1.0 / W.M[e]
    for k in range(nr):
        size: Any = 0.0
        for e in range(S.row_p[k], S.row_p[k + 1]):
            place = S.pair_i[e, 3]
            A[place] = W.G[e]
            if place < len(S.ldl.Ai):  # prescribed velocities have no say
                size = size + (W.G[e] * W.G[e] + lever) * per[S.col_i[e]]
        A[S.ldl.Ap[S.ldl.perm[nv + k] + 1] - 1] = -S.glob[REGULARISE] * (1.0 if size == 0.0 else size)
    L, D = factored(S.ldl, A)

    def once(f: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        both = solved(S.ldl, L, D, np.concatenate([f, gamma]))
        return both[:nv], -both[nv:]

    return once


def factored(P: Pattern, A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """L and the inverse diagonal: `numerics.ldl.ldl_factor`, without a look at pivots, whose size nobody knows here."""
    n = len(P.perm)
    L, D, Y = _zeros(len(P.Li)), _zeros(n), _zeros(n)
    for k in range(n):
        last = P.Ap[k + 1] - 1
        d = A[last]
        Y[P.Ai[P.Ap[k] : last]] = A[P.Ap[k] : last]
        for e in range(P.Rp[k], P.Rp[k + 1]):
            i, at = P.Ri[e], P.Rx[e]
            y, Y[i] = Y[i], 0.0
            for p in range(P.Lp[i], at):
                Y[P.Li[p]] = Y[P.Li[p]] - L[p] * y
            L[at] = y * D[i]
            d = d - L[at] * y
        D[k] = 1.0 / d
    return L, D


def solved(P: Pattern, L: np.ndarray, D: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Solve with a factor."""
    z = _zeros(len(b))
    z[P.perm] = b
    ldl_solve(P, L, D, z)
    return z[P.perm]


def _loaded(x: Traced, solve: Callable[..., Any], given: dict[int, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Accelerations, multipliers and loads where friction depends on the reactions and these on friction.

    Multipliers are linear functions of the loads, lam = lam0 + K load; each load is a norm of some of them.
    """
    slopes = jacobian(list(x.f), x.loads)
    if set(symbols(list(slopes.ravel()))) & set(x.loads):
        raise ModelError("a force is no linear function of the load of a joint with friction: simulate it here")
    nothing = [(s, 0.0) for s in x.loads]
    f0 = _array(replaced(list(x.f), nothing))
    vdot, lam = solve(f0, x.gamma, given)
    none = dict.fromkeys(given, 0.0)
    columns = [solve(slopes[:, n], _zeros(len(lam)), none) for n in range(len(x.loads))]
    K = np.array([c[1] for c in columns], object).T.reshape(len(lam), len(columns))
    A = np.array([c[0] for c in columns], object).T.reshape(len(vdot), len(columns))
    by_lam = jacobian(list(x.returned), x.lam)
    loads = _zeros(len(x.loads))
    for _ in range(STEPS):
        at = list(zip(x.lam, lam + K @ loads, strict=True))
        back = _array(replaced(list(x.returned), at))
        slope = _array(replaced(list(by_lam.ravel()), at)).reshape(by_lam.shape) @ K
        loads = loads + eliminated(np.eye(len(loads)) - slope, back - loads)
    return vdot + A @ loads, lam + K @ loads, loads


def eliminated(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Solve a few equations by Gauss' elimination, in the order given: the diagonal is one less a slope below one."""
    A, b, n = A.astype(object), b.copy(), len(b)
    for k in range(n):
        for i in range(k + 1, n):
            factor = A[i, k] / A[k, k]
            A[i, k + 1 :] = A[i, k + 1 :] - factor * A[k, k + 1 :]
            b[i] = b[i] - factor * b[k]
    for k in range(n - 1, -1, -1):
        b[k] = (b[k] - A[k, k + 1 :] @ b[k + 1 :] if k + 1 < n else b[k]) / A[k, k]
    return b


def _zeros(n: int) -> np.ndarray:
    out = np.empty(n, object)
    out[:] = 0.0
    return out


def _array(items: list[Any]) -> np.ndarray:
    out = _zeros(len(items))
    out[:] = items
    return out
