"""Indeterminate contact forces: how redundant rows share a load, and what slides if they cannot.

The forces of active rows are the least-squares solution plus any z with A z = 0, which causes no motion. If one
distribution is within all bounds, all rows stay at rest (the lower bound theorem of plastic limit analysis);
`numerics/complementarity` finds the one with the largest margin. If none is, the accelerations are still unique: they
minimise

    |w - w_d|^2 / 2 + sum reach_i |u_i|,    u = b + B w,   A = B B^T

(Gauss's principle with friction, Moreau 1963), where w is the change of the accelerations in the metric of the masses.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...constraints.switches.switch_kind import DISC, G_SHARED, INTERVAL, OFF
from ...engine.guards import GROUP_ROUNDING
from ...engine.mode_complementarity import FORCES, IMPULSE_STEP
from ...numerics.complementarity.dense_problem import (
    AT_REST,
    BILATERAL,
    FRICTION_DISC,
    FRICTION_DISC_2,
    FRICTION_LINE,
    INACTIVE,
    SLIDING,
    SOLUTION_FOUND,
    UNILATERAL,
    DenseProblem,
)
from ...numerics.complementarity.interior_point import (
    CONE_COUNT,
    UNKNOWN_COUNT,
    allocate_cone_program,
    largest_margin_kernel,
)
from .instant_problem import InstantProblem, ProblemRow

SINGULAR_ROOT = 1e-9  # relative eigenvalue below which one counts as zero
SMOOTHING = 1e-11  # final smoothing of |u|, relative to the largest acceleration
SMOOTHING_FACTOR = 0.1
NEWTON_STEPS = 60
LOAD_ITERATIONS = 60  # alternating iterations of loads and sliding friction
LOAD_TOLERANCE = 1e-10


def least_accelerations(P: DenseProblem) -> tuple[np.ndarray, np.ndarray] | None:
    """Return accelerations u and forces x of all rows, with unilateral rows closed; None if there is no solution."""
    d = np.sqrt(np.maximum(P.A.diagonal(), 1e-300))
    size, V = np.linalg.eigh(P.A / np.outer(d, d))
    kept = size > SINGULAR_ROOT * size[-1]
    B = d[:, None] * V[:, kept] * np.sqrt(size[kept])
    held = np.flatnonzero((P.rule == BILATERAL) | (P.rule == UNILATERAL))
    C = B[held] / d[held, None]
    first, _, rank, _ = np.linalg.lstsq(C, -P.b[held] / d[held], rcond=SINGULAR_ROOT) if len(held) else (0.0, 0, 0, 0)
    free = np.linalg.svd(C)[2][rank:].T if len(held) else np.eye(B.shape[1])
    first = np.zeros(B.shape[1]) + first
    scale = np.abs(P.b / d).max()
    if len(held) and np.abs(C @ first + P.b[held] / d[held]).max() > 1e-7 * scale:
        return None
    pairs = [
        [i, i + 1] if P.rule[i] == FRICTION_DISC else [i]
        for i in np.flatnonzero(np.isin(P.rule, (FRICTION_LINE, FRICTION_DISC)))
    ]
    driven = np.flatnonzero(P.rule == SLIDING)
    x, z, soft = np.zeros(len(P.b)), np.zeros(free.shape[1]), scale
    for turn in range(LOAD_ITERATIONS):
        reach = np.maximum(P.const + P.gain @ x, 0.0)
        x[driven] = -P.bound_sign[driven] * reach[driven]
        w_d = B[driven].T @ x[driven]
        soft = max(SMOOTHING_FACTOR * soft, SMOOTHING * scale)
        old = x.copy()
        for soft_now in (soft,) if turn else _smoothing_sequence(scale):
            soft = soft_now
            z = _minimise(P.b, B, (first, free, w_d), (pairs, reach, soft * d.mean()), z)
        w = first + free @ z
        u = P.b + B @ w
        for own in pairs:
            x[own] = -reach[own[0]] * u[own] / np.sqrt(u[own] @ u[own] + (soft * d.mean()) ** 2)
        rest = w - w_d - sum((B[own].T @ x[own] for own in pairs), np.zeros(len(w)))
        x[held] = np.linalg.lstsq(C.T, rest, rcond=SINGULAR_ROOT)[0] / d[held] if len(held) else 0.0
        if np.abs((x - old) * d).max() <= LOAD_TOLERANCE * np.abs(x * d).max():
            return u, x
    return None


def _smoothing_sequence(scale: float) -> list[float]:
    """Return smoothing parameters from coarse to fine."""
    out = [scale]
    while out[-1] > SMOOTHING * scale:
        out.append(max(SMOOTHING_FACTOR * out[-1], SMOOTHING * scale))
    return out


def _minimise(b: np.ndarray, B: np.ndarray, of: tuple, friction: tuple, z: np.ndarray) -> np.ndarray:
    """Return the minimiser z, by Newton's method."""
    (first, free, w_d), (pairs, reach, soft) = of, friction

    def value(z: np.ndarray) -> float:
        w = first + free @ z
        u = b + B @ w
        rubs = sum(reach[own[0]] * np.sqrt(u[own] @ u[own] + soft * soft) for own in pairs)
        return float(0.5 * (w - w_d) @ (w - w_d) + rubs)

    now = value(z)
    for _ in range(NEWTON_STEPS):
        w = first + free @ z
        u, g, H = b + B @ w, w - w_d, np.eye(len(w))
        for own in pairs:
            rho = np.sqrt(u[own] @ u[own] + soft * soft)
            e = u[own] / rho
            g = g + reach[own[0]] * (B[own].T @ e)
            H += reach[own[0]] / rho * (B[own].T @ (np.eye(len(own)) - np.outer(e, e)) @ B[own])
        step = -np.linalg.solve(free.T @ H @ free, free.T @ g)
        part = 1.0
        while part > 1e-6 and value(z + part * step) > now:
            part *= 0.5
        if part <= 1e-6:
            break
        z = z + part * step
        less, now = now, value(z)
        if less - now <= 1e-15 * abs(now):
            break
    return z


SINGULAR = 1e-9  # relative eigenvalue below which rows are linearly dependent
LOAD_ROUNDING = 1e-13 / IMPULSE_STEP  # relative rounding of the finite differences of the friction limit by forces
NULL_TOLERANCE = 1e-9  # entry of a null vector, relative to its largest, that is rounding
FRICTION_REDUCTION = 1e-6  # part by which friction limits are reduced to find which rows slide
CLEAR_ACCELERATION = 1e-3  # part of the resulting accelerations below which a row does not slide
ZERO_FORCE = 1e-6  # part of the largest force that counts as zero where a group releases
ZERO_ACCELERATION = 1e-7  # part of its terms below which an acceleration counts as zero


class Distribution(NamedTuple):
    """Rows that hold together: forces, their largest margin to the bounds, and the reference force."""

    x: np.ndarray
    margin: float
    size: float


def force_scales(A: np.ndarray) -> np.ndarray:
    """Return scales by which forces of rows with different units are comparable."""
    d = np.sqrt(A.diagonal())
    return np.where(d > 0.0, d, 1.0)


def null_forces(A: np.ndarray) -> np.ndarray:
    """Return a basis of the forces that cause no acceleration, (n, k)."""
    n, d = len(A), force_scales(A)
    if n < 2:
        return np.zeros((n, 0))
    N = A / np.outer(d, d)
    try:
        np.linalg.cholesky(N - SINGULAR * np.eye(n))
        return np.zeros((n, 0))
    except np.linalg.LinAlgError:
        size, V = np.linalg.eigh(N)
        return np.asarray(V[:, size < SINGULAR * size[-1]] / d[:, None])


def load_rounding(A: np.ndarray, x: np.ndarray, reach: np.ndarray) -> float:
    """Return the rounding of the derivatives of friction limits ``reach`` with respect to scaled forces x."""
    size = float(np.abs(x * force_scales(A)).max(initial=0.0))
    return LOAD_ROUNDING * float(np.abs(reach).max(initial=0.0)) / size if size > 0.0 else 0.0


def unloading_null_forces(Z: np.ndarray, loads: np.ndarray, d: np.ndarray, least: float) -> np.ndarray:
    """Return the null forces that do not change the load of sliding friction.

    ``loads``: derivatives of the sliding friction by the forces, of which ``least`` is rounding (`load_rounding`).
    """
    if not loads.any() or not Z.shape[1]:
        return Z
    M = loads @ Z
    _, size, V = np.linalg.svd(M)
    nothing = max(SINGULAR * np.abs(loads / d).max(), least) * np.abs(Z * d[:, None]).max()
    rank = int((size > nothing).sum())
    return np.asarray(Z @ V[rank:].T)


def indeterminate_forces(P: DenseProblem, rows: np.ndarray) -> np.ndarray:
    """Return a basis of the forces by which the solution of these active rows is indeterminate, (rows, k)."""
    Z = null_forces(P.A[np.ix_(rows, rows)])
    driven = np.flatnonzero(P.rule == SLIDING)
    return unloading_null_forces(
        Z, P.gain[np.ix_(driven, rows)], force_scales(P.A)[rows], load_rounding(P.A, P.x, P.reach[driven])
    )


def without_acceleration(n: InstantProblem, parts: list[ProblemRow], P: DenseProblem) -> np.ndarray:
    """Return which rows have zero acceleration; of the two rows of a friction disc both or neither."""
    terms = np.abs(P.b) + np.abs(P.A) @ np.abs(P.x)
    out = np.abs(P.u) <= ZERO_ACCELERATION * terms + n.negligible_acceleration[[p.switch for p in parts]]
    for i in np.flatnonzero(P.rule == FRICTION_DISC):
        out[i] = out[i + 1] = out[i] and out[i + 1]
    return out


def held_at_rest(n: InstantProblem, parts: list[ProblemRow], P: DenseProblem, ended: int | None) -> np.ndarray:
    """Return the friction rows that stay at rest at their limit because other active rows keep them there.

    First it is tested whether all rows that can hold do hold; if that is one of the solutions, sticking rows go on
    sticking, and the corresponding forces are written into P. ``ended`` is the status of the solve of P. With None all
    rows are tested whatever the status, and must hold by a clear margin.
    """
    none = np.zeros(len(parts), bool)
    if not n.shares:
        return none
    friction = np.isin(P.rule, (FRICTION_LINE, FRICTION_DISC, FRICTION_DISC_2))
    if ended is not None and not (friction & (P.state != AT_REST)).any():
        return none
    together = np.flatnonzero(np.isin(P.rule, (BILATERAL, UNILATERAL, FRICTION_LINE, FRICTION_DISC, FRICTION_DISC_2)))
    Z = indeterminate_forces(P, together)
    if not Z.shape[1]:
        return none
    found = admissible_distribution(P, together, Z)
    least = ZERO_FORCE if ended is None else -GROUP_ROUNDING
    if found is not None and found.margin >= least * found.size:
        P.x[:], P.u[:] = found.x, P.A @ found.x + P.b
        P.u[together], P.state[together] = 0.0, AT_REST
        P.reach[:] = P.const + P.gain @ found.x
        return friction
    if ended != SOLUTION_FOUND:  # also where P was not solved
        return none
    still = friction & without_acceleration(n, parts, P)
    rows = np.flatnonzero(still | (P.state == AT_REST))
    Z = indeterminate_forces(P, rows)
    if not Z.shape[1]:
        return none
    Z = Z * force_scales(P.A)[rows, None]
    none[rows] = (np.abs(Z) > NULL_TOLERANCE * np.abs(Z).max()).any(axis=1)
    return none & still


def admissible_distribution(P: DenseProblem, rows: np.ndarray, Z: np.ndarray) -> Distribution | None:
    """Return the distribution of largest margin that holds these rows; None if they cannot be at rest together."""
    n, d = len(P.b), force_scales(P.A)
    driven = np.flatnonzero(P.rule == SLIDING)
    M, r, s = np.zeros((n, n)), np.zeros(n), 1.0 / d
    M[rows], r[rows] = P.A[rows], -P.b[rows]
    other = np.setdiff1d(np.arange(n), rows)
    M[other, other] = d[other] ** 2
    M[driven] = P.bound_sign[driven, None] * P.gain[driven] * d[driven, None] ** 2
    M[driven, driven] += d[driven] ** 2
    r[driven] = -P.bound_sign[driven] * P.const[driven] * d[driven] ** 2
    x = s * np.linalg.lstsq(M * np.outer(s, s), s * r, rcond=SINGULAR)[0]
    terms = np.abs(P.b) + np.abs(P.A) @ np.abs(x) + P.grain
    if (np.abs(P.A @ x + P.b)[rows] > ZERO_ACCELERATION * terms[rows]).any():
        return None
    every = np.zeros((n, Z.shape[1]))
    every[rows] = Z / np.abs(Z * d[rows, None]).max(axis=0)
    Q = allocate_cone_program(n, Z.shape[1])
    write_bounds(P, rows, x, every, Q)
    size = float(np.abs(Q.D[:, :, 0]).max())
    margin = float(largest_margin_kernel(Q))
    return Distribution(x + every @ Q.y[: Z.shape[1]], margin, size)


def write_bounds(P: DenseProblem, rows: np.ndarray, x: np.ndarray, Z: np.ndarray, Q) -> None:
    """Write the cells of the cone program: bounds of these rows at the forces x, and their derivatives by Z."""
    c, Q.count[UNKNOWN_COUNT], d, all_ = 0, Z.shape[1], force_scales(P.A), np.column_stack([x, Z])
    for i in rows.tolist():
        rule = P.rule[i]
        if rule == UNILATERAL:
            Q.D[c, 0] = d[i] * all_[i]
        elif rule in (FRICTION_LINE, FRICTION_DISC):
            Q.D[c, 0] = d[i] * (P.gain[i] @ all_)
            Q.D[c, 0, 0] += d[i] * P.const[i]
            Q.D[c, 1] = d[i] * all_[i]
            if rule == FRICTION_DISC:
                Q.D[c, 2] = d[i] * all_[i + 1]
        else:
            continue
        c += 1
    Q.count[CONE_COUNT] = c


def released_by_group(n: InstantProblem, parts: list[ProblemRow], fired: np.ndarray) -> dict[int, ProblemRow]:
    """Return the rows that slide or open where no distribution within the bounds is left, with their new rules.

    Friction limits are reduced slightly. Rows that then move slide in the direction of that motion. If none does, rows
    that carry no force in any distribution open.
    """
    if not n.fired(fired, G_SHARED):
        return {}
    B, P, _ = n.problem(parts)
    n.balance(B, P, FORCES)
    together = np.flatnonzero(np.isin(P.rule, (BILATERAL, UNILATERAL, FRICTION_LINE, FRICTION_DISC, FRICTION_DISC_2)))
    Z = indeterminate_forces(P, together)
    found = admissible_distribution(P, together, Z) if Z.shape[1] else None
    if found is None or found.margin > ZERO_FORCE * found.size:
        return {}
    out = sliding_rows(n, parts, P)
    if out:
        return out
    gone = [
        i
        for i in together.tolist()
        if P.rule[i] == UNILATERAL and force_scales(P.A)[i] * found.x[i] <= ZERO_FORCE * found.size
    ]
    return {i: parts[i]._replace(rule=INACTIVE) for i in gone}


def sliding_without_solution(n: InstantProblem, parts: list[ProblemRow], P: DenseProblem) -> dict[int, ProblemRow]:
    """Return the rows that slide where redundancy leaves the complementarity problem unsolved; see
    `released_by_group`.
    """
    together = np.flatnonzero(np.isin(P.rule, (BILATERAL, UNILATERAL, FRICTION_LINE, FRICTION_DISC, FRICTION_DISC_2)))
    if not n.shares or not indeterminate_forces(P, together).shape[1]:
        return {}
    return sliding_rows(n, parts, P)


def sliding_rows(n: InstantProblem, parts: list[ProblemRow], P: DenseProblem) -> dict[int, ProblemRow]:
    """Return the rows that slide if friction limits are slightly less than in P, with kinetic friction."""
    d, friction = force_scales(P.A), np.isin(P.rule, (FRICTION_LINE, FRICTION_DISC, FRICTION_DISC_2))
    P.const[friction] *= 1.0 - FRICTION_REDUCTION
    P.gain[friction] *= 1.0 - FRICTION_REDUCTION
    for _ in range(2):  # static friction: which rows slide; kinetic friction: in which direction
        P.state[:] = AT_REST
        if n.again(P) != SOLUTION_FOUND:
            found = least_accelerations(P)
            if found is None:
                return {}
            P.u[:], P.x[:] = found
        least = CLEAR_ACCELERATION * FRICTION_REDUCTION * np.abs(P.b / d).max()
        out: dict[int, ProblemRow] = {}
        for i, p in enumerate(parts):
            if P.rule[i] not in (FRICTION_LINE, FRICTION_DISC):
                continue
            own = [i, i + 1] if P.rule[i] == FRICTION_DISC else [i]
            speed = float(np.linalg.norm(P.u[own]))
            if speed / d[i] <= least:
                continue
            for k in own:
                lean = float(P.u[k]) / speed
                if n.kinds[p.switch].forces == DISC:
                    mu = float(n.S.switch_numbers.kinetic_friction[parts[own[0]].switch])
                    out[k] = parts[k]._replace(rule=SLIDING, direction=lean, gain=mu)
                    P.gain[k, p.of] = (1.0 - FRICTION_REDUCTION) * mu
                else:
                    out[k] = parts[k].sliding(lean)
        if not out:
            break
    return out


def write_sharing_group(n: InstantProblem, parts: list[ProblemRow], found: tuple[np.ndarray, ...]) -> None:
    """Write the group of rows with indeterminate forces into the motion, for the guard of the group.

    ``found`` are states, the matrix, derivatives of friction limits by forces, the forces, and the friction limits.
    """
    if not n.shares:
        return
    (state, A, gain, x, reach), G, B = found, n.here.group, n.workspaces[len(parts)].B
    n.W.modes.shared[:], G.Q.count[UNKNOWN_COUNT] = 0.0, 0
    on = n.W.modes.mode[[p.switch for p in parts]] != OFF  # slips of an open gap have no rows
    rows = np.flatnonzero((state == AT_REST) & on)
    rules = np.array([p.rule for p in parts])
    if not np.isin(rules[rows], (FRICTION_LINE, FRICTION_DISC)).any():
        return
    d = force_scales(A)
    driven = np.flatnonzero(
        (rules == SLIDING) | ((state != AT_REST) & np.isin(rules, (FRICTION_LINE, FRICTION_DISC, FRICTION_DISC_2)))
    )
    Z = unloading_null_forces(
        null_forces(A[np.ix_(rows, rows)]), gain[np.ix_(driven, rows)], d[rows], load_rounding(A, x, reach[driven])
    )
    if not Z.shape[1]:
        return
    every = np.zeros((len(parts), Z.shape[1]))
    every[rows] = Z / np.abs(Z * d[rows, None]).max(axis=0)
    part_of = (np.abs(every) * d[:, None] > NULL_TOLERANCE).any(axis=1)
    for i in rows.tolist():
        p, follows = parts[i], gain[i] @ every
        if rules[i] in (FRICTION_LINE, FRICTION_DISC):
            own = [i, i + 1] if rules[i] == FRICTION_DISC else [i]
            moved = np.abs(follows).max() * d[i] > NULL_TOLERANCE
            if moved or part_of[own].any():
                part_of[[*own, *([p.of] if p.of >= 0 else [])]] = True
    for i in np.flatnonzero(part_of).tolist():
        n.W.modes.shared[parts[i].switch] = d[i]
    for j, z in enumerate(every.T):
        G.null[j] = z @ B.L
        for i in rows.tolist():
            s = parts[i].switch
            G.null[j, n.S.switches.row[s]] += B.sign[i] * z[i]
            if n.kinds[s].forces == INTERVAL:
                G.bend[j, s] = gain[i] @ z
    G.Q.count[UNKNOWN_COUNT] = Z.shape[1]
