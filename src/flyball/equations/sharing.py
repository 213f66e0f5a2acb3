"""What holds together and may share its forces in many ways: places of contact, friction and stops of one group.

Multipliers that redundancy leaves open are those of the least squares and any combination of ``null``, the forces in
balance by themselves. A group holds as long as some of these combinations keep all of its rows within their bounds:

    a place of contact that sticks    |(t1, t2)| <= mu N
    friction that holds               |lam| <= most that it holds
    a stop, a latch                   way * lam >= 0

By how much they can is the guard of the group; the guards of its rows by themselves are not watched.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.formulas import call, formula
from ..compiler.kernels import kernel
from ..compiler.layout import Float1, Float2, Int1
from ..constraints.modes import FRICTION, SLIP
from ..math.scalar import magnitude, sqrt
from ..numerics.cone.shares import CELLS, OPEN, Shares, best, room
from ..numerics.integrators.clock import Clock
from ..numerics.integrators.tableaux import Tableau
from ..numerics.integrators.watching import Watch
from ..tables.system import (
    VALUE,
    System,
    Work,
)
from .guards import most
from .rows import way_of
from .tasks import SOLVE, Sheet

BALANCED = 1e-12  # of its terms: what the forces of a null vector leave
GRAIN = 1e-10  # of the largest force: rounding of the guard
HALVES = 50  # of the way from the shares of least squares to the best ones
NOT_WATCHED = float("nan")


class Sharing(NamedTuple):
    """The group: empty where ``Q.count[OPEN]`` is 0."""

    null: Float2  # (ns, nr): multipliers in balance by themselves, the first Q.count[OPEN] rows in use
    bend: Float2  # (ns, ns): how the most that the friction of a switch holds follows each of them
    size: Float1  # (1,): the largest force of the group, by its weight
    t: Float1  # (1,): the time at which its guard is asked for [s]
    door: Int1  # (1,): address of `shares`, once there is a group
    Q: Shares


def sharing(ns: int, nr: int) -> Sharing:
    """No group, and room for one."""
    return Sharing(
        np.zeros((ns, nr)), np.zeros((ns, ns)), np.zeros(1), np.zeros(1), np.zeros(1, np.int64), room(ns, ns)
    )


@formula
def cell_of(S, W, t, G, s, c):
    """Bounds of switch s into cell c. Returns whether it has one."""
    D, k, kind = G.Q.D, G.Q.count[OPEN], S.switches.kind[s]
    row, other = S.switches.row[s], S.switches.partner[s] if kind == SLIP else -1
    if -1 < other < s:
        return False
    for i in range(3):
        for j in range(k + 1):
            D[c, i, j] = 0.0
    if kind == SLIP:
        mu, gap = S.switch_numbers.static_friction[s], S.switches.row[S.switches.other[s]]
        D[c, 0, 0], D[c, 1, 0] = mu * W.rows.multiplier[gap], W.rows.multiplier[row]
        for j in range(k):
            D[c, 0, 1 + j], D[c, 1, 1 + j] = mu * G.null[j, gap], G.null[j, row]
        if other >= 0:
            along = S.switches.row[other]
            D[c, 2, 0] = W.rows.multiplier[along]
            for j in range(k):
                D[c, 2, 1 + j] = G.null[j, along]
    elif kind == FRICTION:
        D[c, 0, 0], D[c, 1, 0] = most(S, W, t, S.switches.force[s]), W.rows.multiplier[row]
        for j in range(k):
            D[c, 0, 1 + j], D[c, 1, 1 + j] = G.bend[j, s], G.null[j, row]
    else:
        way = W.sensed[VALUE, way_of(S, W, s)]
        if way == 0.0:  # it holds both ways
            return False
        D[c, 0, 0] = way * W.rows.multiplier[row]
        for j in range(k):
            D[c, 0, 1 + j] = way * G.null[j, row]
    for i in range(3):
        for j in range(k + 1):
            D[c, i, j] *= W.modes.shared[s]
    return True


@formula
def fill(S, W, t, G):
    """Bounds of all that is in the group, by the multipliers in W."""
    c, size = 0, 0.0
    for s in range(S.switches.row.shape[0]):
        if W.modes.shared[s] > 0.0 and cell_of(S, W, t, G, s, c):
            for i in range(3):
                size = max(size, magnitude(G.Q.D[c, i, 0]))
            c += 1
    G.Q.count[CELLS] = c
    G.size[0] = size


@formula
def margin(S, W, t, G):
    """By how much the group can stay within its bounds; nan where there is none."""
    if G.Q.count[OPEN] == 0:
        return NOT_WATCHED
    fill(S, W, t, G)
    return best(G.Q)


@formula
def terms(G, out, first):
    """What `margin` just came from, from a place on: q, a, b of every cell, which are smooth. Returns how many."""
    if G.Q.count[OPEN] == 0:
        return 0
    n = 0
    for c in range(G.Q.count[CELLS]):
        for i in range(3):
            out[first + n] = G.Q.D[c, i, 0]
            n += 1
    return n


@formula
def guard_of_group(S, W, t, G, K, row):
    """The guard of the group by W, the last of a row of guards, and behind it its terms: row of ``K.g``, or -1 - j.

    -1 - j: place j of those within a step, ``K.met_g[j]``. Behind a door, so that loops do not contain all laws.
    """
    if G.Q.count[OPEN] > 0:
        G.t[0] = t
        call(G.door[0], S, W, G, K, K, row)
    elif row >= 0:
        K.g[row, K.way.shape[0] - 1] = NOT_WATCHED
        K.count.terms = 0
    else:
        K.met_g[-1 - row, K.way.shape[0] - 1] = NOT_WATCHED
        K.count.terms = 0


@formula
def written(S, W, G, K, row):
    """`margin` and `terms` into that row."""
    out, last = K.g[row] if row >= 0 else K.met_g[-1 - row], K.way.shape[0] - 1
    out[last] = margin(S, W, G.t[0], G)
    K.count.terms = terms(G, out, last + 1)
    return 0


@kernel
def shares(S: System, W: Work, G: Sharing, K: Watch, _: Watch, row: int) -> int:
    """`written` behind an address."""
    return written(S, W, G, K, row)


@formula
def renewed(address, S, W, R, own, sheet, G):
    """The null vectors at the state last evaluated: what is not in balance any more is taken from them."""
    out, nr = sheet.rows, S.rows.law.shape[0]
    for j in range(G.Q.count[OPEN]):
        terms, left = 0.0, 0.0
        for d in range(out.shape[1]):
            out[0, d] = out[1, d] = out[2, d] = 0.0
        for k in range(nr):
            if G.null[j, k] != 0.0:
                for e in range(S.row_start[k], S.row_start[k + 1]):
                    p = G.null[j, k] * W.G[e]
                    out[0, S.column[e]] += p
                    out[2, S.column[e]] += magnitude(p)
        for d in range(W.velocities.solved.shape[0]):
            left, terms = max(left, magnitude(out[0, d])), max(terms, out[2, d])
        if left > BALANCED * terms:
            call(address, S, W, R, own, sheet, SOLVE)
            for k in range(nr):
                G.null[j, k] += out[3, k]


@formula
def shared(S, W, t, G):
    """Put shares within all bounds in place of those of least squares: as near to these as on the way to the best."""
    if not margin(S, W, t, G) > 0.0:
        return
    Q, low, high = G.Q, 0.0, 1.0
    if within(Q, 0.0):
        return
    for _ in range(HALVES):
        x = 0.5 * (low + high)
        if within(Q, x):
            high = x
        else:
            low = x
    for j in range(Q.count[OPEN]):
        for k in range(S.rows.law.shape[0]):
            W.rows.multiplier[k] += high * Q.y[j] * G.null[j, k]


@formula
def within(Q, x):
    """Whether shares at a part x of the way to the best are within all bounds."""
    for c in range(Q.count[CELLS]):
        q, a, b = reached(Q, c, 0, x), reached(Q, c, 1, x), reached(Q, c, 2, x)
        if not q >= sqrt(a * a + b * b):
            return False
    return True


@formula
def reached(Q, c, i, x):
    """A number of a cell there."""
    s = Q.D[c, i, 0]
    for j in range(Q.count[OPEN]):
        s += x * Q.D[c, i, 1 + j] * Q.y[j]
    return s


@kernel
def margin_kernel(S: System, W: Work, t: float, G: Sharing) -> float:
    """`margin`, called from Python."""
    return margin(S, W, t, G)


@kernel
def shared_kernel(S: System, W: Work, t: float, G: Sharing) -> None:
    """`shared`, called from Python."""
    shared(S, W, t, G)


@kernel
def renewed_kernel(address: int, S: System, W: Work, R: Tableau, own: Clock, sheet: Sheet, G: Sharing) -> None:
    """`renewed`, called from Python."""
    renewed(address, S, W, R, own, sheet, G)
