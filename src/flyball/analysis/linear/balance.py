"""When forces balance: each equation of motion is judged by its own terms.

Nothing stiff or heavy elsewhere hides what is left of it. What cannot be told from zero is measured: the equations are
evaluated again where positions, velocities, multipliers and the mechanism's numbers (whole ones are exact) differ in
their last digits, so that every term is rounded anew (stochastic arithmetic: Vignes 1993). Large forces that cancel
leave more than small ones, whatever they come from.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from ...equations.tree import lengths, retract
from ...tables.system import with_numbers
from .derivatives import Equations, State
from .free import prescribed
from .least import least

SAMPLES = 4
ROUNDED = 4.0 * np.finfo(float).eps  # what positions and multipliers are changed by, of their size
WIDER = 8.0  # than the samples: what is below so many times their spread is nothing


def acting(e: Equations) -> np.ndarray:
    """What acts in every equation of motion: the total force, and each constraint's, (nv,)."""
    x, at = e.state, e.at
    G = e.by_velocity[at["n"]]
    M = e.by_acceleration[at["r"]]
    force = e.residual[at["r"]] - M @ x.vdot + G.T @ x.lam
    return np.abs(force) + abs(G).T @ np.abs(x.lam) + np.abs(x.effort)


def rounding(e: Equations) -> np.ndarray:
    """What rounding may leave of every equation of motion, (nv,).

    Constraints hand on what they carry: the largest of all that is connected, in energy, counts for each.
    """
    size = e.state.c.sizes
    spread = np.zeros(len(size))
    for other in shaken(e.state):
        np.maximum(spread, np.abs(Equations(other).block("r") - e.block("r")), out=spread)
    part = _joined(e)
    most = np.zeros(len(size))
    np.maximum.at(most, part, size * np.maximum(spread, ROUNDED * acting(e)))
    return WIDER * most[part] / size


def _joined(e: Equations) -> np.ndarray:
    """Numbers of the parts of the mechanism that nothing connects, for every velocity, (nv,).

    All that a constraint can act on is connected, whether it does in this position or not: an equation may hold nothing
    but a multiplier that is rounding itself, and what acts beside it tells of what.
    """
    from scipy.sparse.csgraph import connected_components

    G, r = e.state.c.sparse_jacobian(), e.at["r"]
    G.data[:] = 1.0
    return connected_components(abs(e.by_position[r]) + abs(e.by_acceleration[r]) + G.T @ G, directed=False)[1]


def stiffness_rounding(e: Equations) -> list:
    """What rounding makes of the stiffness: some samples, sparse (nv, nv)."""
    K = e.by_position[e.at["r"]]
    return [WIDER * (Equations(other).by_position[e.at["r"]] - K) for other in shaken(e.state)]


def at_rest(e: Equations) -> Equations:
    """The equations without accelerations, under the multipliers and efforts that leave the least of them."""
    import scipy.sparse as sp

    x, c = e.state, e.state.c
    rows = e.by_velocity[e.at["n"]]
    still = replace(x, vdot=0.0 * x.vdot, lam=0.0 * x.lam, effort=0.0 * x.effort)
    A = sp.diags(c.sizes) @ sp.vstack([rows, prescribed(c)]).T.tocsr()
    if not A.shape[1]:
        return Equations(still)
    size = np.sqrt(np.asarray(A.multiply(A).sum(axis=0)).ravel())
    size = 1.0 / np.where(size > 0.0, size, 1.0)
    y = size * least(A @ sp.diags(size), c.sizes * Equations(still).block("r"))
    return Equations(replace(still, lam=y[: len(x.lam)], effort=prescribed(c).T @ y[len(x.lam) :]))


def settled(e: Equations, part: float) -> bool:
    """Whether every equation of motion is balanced, but for a part of what acts in it, and rounding."""
    return clearly_settled(e, part) or bool((np.abs(e.block("r")) <= part * acting(e) + rounding(e)).all())


def clearly_settled(e: Equations, part: float) -> bool:
    """The same without rounding, which where a force jumps may be all of it."""
    return bool((np.abs(e.block("r")) <= part * acting(e)).all())


def unbalanced(e: Equations) -> float:
    """The largest force that is left, of those that act in its equation; zero where rounding leaves as much."""
    left, acts = np.abs(e.block("r")), acting(e)
    return float(np.where(left > rounding(e), left / np.where(acts > 0.0, acts, 1.0), 0.0).max(initial=0.0))


def shaken(x: State) -> Iterator[State]:
    """The state and the mechanism's numbers with other last digits: the same for all that can be told."""
    S = x.c.values.system
    size = x.c.sizes
    for b in range(len(S.tree.parent)):
        q0, v0, n = int(S.tree.q[b]), int(S.tree.v[b]), lengths(S, b)
        size[v0 : v0 + n] += np.abs(x.q[q0 : q0 + n])
    rng = np.random.default_rng(0)
    for _ in range(SAMPLES):
        digits = partial(rng.uniform, -ROUNDED, ROUNDED)
        q = x.q.copy()
        retract(S, q, size * digits(size=len(size)))
        v, vdot, lam, effort = (a * (1.0 + digits(size=len(a))) for a in (x.v, x.vdot, x.lam, x.effort))
        rounded = with_numbers(S, lambda _, a: np.where(a == np.rint(a), a, a * (1.0 + digits(size=a.shape))))  # noqa: B023
        c = replace(x.c, values=replace(x.c.values, system=rounded))
        yield replace(x, c=c, q=q, v=v, vdot=vdot, lam=lam, effort=effort)
