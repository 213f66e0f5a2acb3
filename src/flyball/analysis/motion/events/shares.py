"""Where redundancy leaves open how rows share what they hold: they hold as long as some shares are within all bounds.

The forces x of the small problem that hold are those of least squares and any z with A z = 0: nothing moves by these.
With a single one of them within all bounds all is at rest (so with steel on steel: what cannot carry more yields, and
others take it up; the lower bound theorem of plastic limit analysis). `numerics.cone.shares` finds the best.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....constraints.modes import FRICTION, SLIP
from ....equations.instant import FORCES, NUDGE
from ....equations.sharing import GRAIN
from ....numerics.cone.dense.problem import DRIVEN, EVEN, FOUND, GRIPS, HOLDS, OUT, PUSHES, TURNS, WITH, Dense
from ....numerics.cone.shares import CELLS, OPEN, best_kernel, room
from ....tables.system import G_SHARED, OFF
from .instant import Instant, Part
from .yielding import accelerations

SINGULAR = 1e-9  # of the largest eigenvalue: nothing tells rows apart
ROUNDED = 1e-13 / NUDGE  # of what friction holds: rounding of the differences that tell how it follows forces
TOUCHED = 1e-9  # of its largest row: what a null vector does to another is rounding
FIRST = 1e-6  # part of what friction holds that is taken from it to see what gives way
CLEAR = 1e-3  # of the accelerations that this makes: none
LEFT = 1e-6  # of the largest force: what is zero where a group gives way
SAME = 1e-7  # of the accelerations that one is the difference of: as good as none


class Held(NamedTuple):
    """Rows that hold together: forces, and by how much these are within their bounds at best, and of which size."""

    x: np.ndarray
    margin: float
    size: float


def roots(A: np.ndarray) -> np.ndarray:
    """By which forces of rows of different units compare."""
    d = np.sqrt(A.diagonal())
    return np.where(d > 0.0, d, 1.0)


def nulls(A: np.ndarray) -> np.ndarray:
    """Forces that move nothing, (n, k)."""
    n, d = len(A), roots(A)
    if n < 2:
        return np.zeros((n, 0))
    N = A / np.outer(d, d)
    try:
        np.linalg.cholesky(N - SINGULAR * np.eye(n))
        return np.zeros((n, 0))
    except np.linalg.LinAlgError:
        size, V = np.linalg.eigh(N)
        return np.asarray(V[:, size < SINGULAR * size[-1]] / d[:, None])


def rounding(A: np.ndarray, x: np.ndarray, reach: np.ndarray) -> float:
    """How far, by rounding, it is known how friction that holds ``reach`` follows forces x; of rows as they compare."""
    size = float(np.abs(x * roots(A)).max(initial=0.0))
    return ROUNDED * float(np.abs(reach).max(initial=0.0)) / size if size > 0.0 else 0.0


def unloading(Z: np.ndarray, loads: np.ndarray, d: np.ndarray, least: float) -> np.ndarray:
    """Of forces that move nothing those that do not press on what slides.

    ``loads``: how its friction follows them; of that ``least`` is nothing (`rounding`).
    """
    if not loads.any() or not Z.shape[1]:
        return Z
    M = loads @ Z
    _, size, V = np.linalg.svd(M)
    nothing = max(SINGULAR * np.abs(loads / d).max(), least) * np.abs(Z * d[:, None]).max()
    rank = int((size > nothing).sum())
    return np.asarray(Z @ V[rank:].T)


def free_shares(P: Dense, rows: np.ndarray) -> np.ndarray:
    """How the forces of these rows, which hold, are left open, (rows, k)."""
    Z = nulls(P.A[np.ix_(rows, rows)])
    driven = np.flatnonzero(P.rule == DRIVEN)
    return unloading(Z, P.gain[np.ix_(driven, rows)], roots(P.A)[rows], rounding(P.A, P.x, P.reach[driven]))


def slow(n: Instant, parts: list[Part], P: Dense) -> np.ndarray:
    """Of which rows the acceleration is none; of pairs of both or of neither."""
    terms = np.abs(P.b) + np.abs(P.A) @ np.abs(P.x)
    out = np.abs(P.u) <= SAME * terms + n.tiny[[p.switch for p in parts]]
    for i in np.flatnonzero(P.rule == TURNS):
        out[i] = out[i + 1] = out[i] and out[i + 1]
    return out


def rests(n: Instant, parts: list[Part], P: Dense, ended: int | None) -> np.ndarray:
    """Rows of friction that hold though they carry all they can: others, which hold, keep them at rest.

    All that can hold are tried first; where that is one of the solutions, what stuck goes on to stick. Forces that go
    with it are put into P then. ``ended``: how P was solved; None: all are tried whatever it is, and only where they
    hold clearly.
    """
    none = np.zeros(len(parts), bool)
    if not n.shares:
        return none
    friction = np.isin(P.rule, (GRIPS, TURNS, WITH))
    if ended is not None and not (friction & (P.state != EVEN)).any():
        return none
    together = np.flatnonzero(np.isin(P.rule, (HOLDS, PUSHES, GRIPS, TURNS, WITH)))
    Z = free_shares(P, together)
    if not Z.shape[1]:
        return none
    found = held(P, together, Z)
    least = LEFT if ended is None else -GRAIN
    if found is not None and found.margin >= least * found.size:
        P.x[:], P.u[:] = found.x, P.A @ found.x + P.b
        P.u[together], P.state[together] = 0.0, EVEN
        P.reach[:] = P.const + P.gain @ found.x
        return friction
    if ended != FOUND:  # also where it was not asked
        return none
    still = friction & slow(n, parts, P)
    rows = np.flatnonzero(still | (P.state == EVEN))
    Z = free_shares(P, rows)
    if not Z.shape[1]:
        return none
    Z = Z * roots(P.A)[rows, None]
    none[rows] = (np.abs(Z) > TOUCHED * np.abs(Z).max()).any(axis=1)
    return none & still


def held(P: Dense, rows: np.ndarray, Z: np.ndarray) -> Held | None:
    """These rows held, by the best shares; None if they cannot be at rest together."""
    n, d = len(P.b), roots(P.A)
    driven = np.flatnonzero(P.rule == DRIVEN)
    M, r, s = np.zeros((n, n)), np.zeros(n), 1.0 / d
    M[rows], r[rows] = P.A[rows], -P.b[rows]
    other = np.setdiff1d(np.arange(n), rows)
    M[other, other] = d[other] ** 2
    M[driven] = P.lean[driven, None] * P.gain[driven] * d[driven, None] ** 2
    M[driven, driven] += d[driven] ** 2
    r[driven] = -P.lean[driven] * P.const[driven] * d[driven] ** 2
    x = s * np.linalg.lstsq(M * np.outer(s, s), s * r, rcond=SINGULAR)[0]
    terms = np.abs(P.b) + np.abs(P.A) @ np.abs(x) + P.grain
    if (np.abs(P.A @ x + P.b)[rows] > SAME * terms[rows]).any():
        return None
    every = np.zeros((n, Z.shape[1]))
    every[rows] = Z / np.abs(Z * d[rows, None]).max(axis=0)
    Q = room(n, Z.shape[1])
    bounds(P, rows, x, every, Q)
    size = float(np.abs(Q.D[:, :, 0]).max())
    margin = float(best_kernel(Q))
    return Held(x + every @ Q.y[: Z.shape[1]], margin, size)


def bounds(P: Dense, rows: np.ndarray, x: np.ndarray, Z: np.ndarray, Q) -> None:
    """Cells of `cone.shares`: bounds of these rows at the forces x, and how they follow more of Z."""
    c, Q.count[OPEN], d, all_ = 0, Z.shape[1], roots(P.A), np.column_stack([x, Z])
    for i in rows.tolist():
        rule = P.rule[i]
        if rule == PUSHES:
            Q.D[c, 0] = d[i] * all_[i]
        elif rule in (GRIPS, TURNS):
            Q.D[c, 0] = d[i] * (P.gain[i] @ all_)
            Q.D[c, 0, 0] += d[i] * P.const[i]
            Q.D[c, 1] = d[i] * all_[i]
            if rule == TURNS:
                Q.D[c, 2] = d[i] * all_[i + 1]
        else:
            continue
        c += 1
    Q.count[CELLS] = c


def give_way(n: Instant, parts: list[Part], fired: np.ndarray) -> dict[int, Part]:
    """What slides or lets go where a group has come to the end of all shares, as it is then.

    A little is taken from what friction holds: what moves then slides, the way that it moves with what friction is
    left. If nothing does, what carries nothing by any shares lets go.
    """
    if not n.fired(fired, G_SHARED):
        return {}
    B, P, _ = n.problem(parts)
    n.balance(B, P, FORCES)
    together = np.flatnonzero(np.isin(P.rule, (HOLDS, PUSHES, GRIPS, TURNS, WITH)))
    Z = free_shares(P, together)
    found = held(P, together, Z) if Z.shape[1] else None
    if found is None or found.margin > LEFT * found.size:
        return {}
    out = sliding(n, parts, P)
    if out:
        return out
    gone = [i for i in together.tolist() if P.rule[i] == PUSHES and roots(P.A)[i] * found.x[i] <= LEFT * found.size]
    return {i: parts[i]._replace(rule=OUT) for i in gone}


def slides(n: Instant, parts: list[Part], P: Dense) -> dict[int, Part]:
    """What slides where redundancy leaves the small problem without an answer, as `give_way` says."""
    together = np.flatnonzero(np.isin(P.rule, (HOLDS, PUSHES, GRIPS, TURNS, WITH)))
    if not n.shares or not free_shares(P, together).shape[1]:
        return {}
    return sliding(n, parts, P)


def sliding(n: Instant, parts: list[Part], P: Dense) -> dict[int, Part]:
    """What slides if a little less is held than P says, by its friction in motion."""
    d, friction = roots(P.A), np.isin(P.rule, (GRIPS, TURNS, WITH))
    P.const[friction] *= 1.0 - FIRST
    P.gain[friction] *= 1.0 - FIRST
    for _ in range(2):  # with friction at rest: who; with friction in motion: which way
        P.state[:] = EVEN
        if n.again(P) != FOUND:
            found = accelerations(P)
            if found is None:
                return {}
            P.u[:], P.x[:] = found
        least = CLEAR * FIRST * np.abs(P.b / d).max()
        out: dict[int, Part] = {}
        for i, p in enumerate(parts):
            if P.rule[i] not in (GRIPS, TURNS):
                continue
            own = [i, i + 1] if P.rule[i] == TURNS else [i]
            speed = float(np.linalg.norm(P.u[own]))
            if speed / d[i] <= least:
                continue
            for k in own:
                lean = float(P.u[k]) / speed
                if n.kind[p.switch] == SLIP:
                    mu = float(n.S.switch_numbers.kinetic_friction[parts[own[0]].switch])
                    out[k] = parts[k]._replace(rule=DRIVEN, lean=lean, gain=mu)
                    P.gain[k, p.of] = (1.0 - FIRST) * mu
                else:
                    out[k] = parts[k]._replace(rule=DRIVEN, way=lean, lean=lean)
        if not out:
            break
    return out


def write_group(n: Instant, parts: list[Part], found: tuple[np.ndarray, ...]) -> None:
    """What holds together and shares, into the motion: its guard is that of the group.

    ``found`` are states, the matrix, how what friction holds follows forces, these, and what it holds.
    """
    if not n.shares:
        return
    (state, A, gain, x, reach), G, B = found, n.here.group, n.rooms[len(parts)].B
    n.W.modes.shared[:], G.Q.count[OPEN] = 0.0, 0
    on = n.W.modes.mode[[p.switch for p in parts]] != OFF  # slips of a gap that is let go are no rows
    rows = np.flatnonzero((state == EVEN) & on)
    rules = np.array([p.rule for p in parts])
    if not np.isin(rules[rows], (GRIPS, TURNS)).any():
        return
    d = roots(A)
    driven = np.flatnonzero((rules == DRIVEN) | ((state != EVEN) & np.isin(rules, (GRIPS, TURNS, WITH))))
    Z = unloading(nulls(A[np.ix_(rows, rows)]), gain[np.ix_(driven, rows)], d[rows], rounding(A, x, reach[driven]))
    if not Z.shape[1]:
        return
    every = np.zeros((len(parts), Z.shape[1]))
    every[rows] = Z / np.abs(Z * d[rows, None]).max(axis=0)
    part_of = (np.abs(every) * d[:, None] > TOUCHED).any(axis=1)
    for i in rows.tolist():
        p, follows = parts[i], gain[i] @ every
        if rules[i] in (GRIPS, TURNS):
            own = [i, i + 1] if rules[i] == TURNS else [i]
            moved = np.abs(follows).max() * d[i] > TOUCHED
            if moved or part_of[own].any():
                part_of[[*own, *([p.of] if p.of >= 0 else [])]] = True
    for i in np.flatnonzero(part_of).tolist():
        n.W.modes.shared[parts[i].switch] = d[i]
    for j, z in enumerate(every.T):
        G.null[j] = z @ B.L
        for i in rows.tolist():
            s = parts[i].switch
            G.null[j, n.S.switches.row[s]] += B.sign[i] * z[i]
            if n.kind[s] == FRICTION:
                G.bend[j, s] = gain[i] @ z
    G.Q.count[OPEN] = Z.shape[1]
