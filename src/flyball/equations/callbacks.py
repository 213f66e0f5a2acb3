"""What a motion that is going on keeps beside the engine, and what of it is kept at stages of a step."""

from __future__ import annotations

from typing import NamedTuple

from ..compiler.formulas import formula
from ..compiler.layout import Int1
from ..numerics.integrators.clock import Clock
from ..numerics.integrators.tableaux import Tableau
from ..numerics.integrators.watching import Watch
from ..tables.system import G_SHARED
from .asking import GROUP, OWN, S_, SHEET, W_
from .sharing import Sharing, guard_of_group
from .tasks import Sheet


class Own(NamedTuple):
    """What goes to the engine's door besides tables and scratch."""

    clock: Clock  # its desk: time and state that it is asked for
    sheet: Sheet
    R: Tableau
    doors: Int1  # addresses of the engine, and of the residuals where they are asked


class Going(NamedTuple):
    """A motion that is going on."""

    clock: Clock
    watch: Watch
    group: Sharing  # what holds together


@formula
def levels(A, K, at):
    """Keep what has no known rate."""
    W = A[W_]
    n = K.rows.shape[0]
    for k in range(n):
        K.levels[at, k] = W.rows.multiplier[K.rows[k]]
    for k in range(K.spots.shape[0]):
        K.levels[at, n + k] = W.sensed[K.spots[k, 0], K.spots[k, 1]]


@formula
def meet(A, K, j):
    """Keep guards and levels at place j of those that are met within a step; the engine has just done WATCH there."""
    S, last = A[S_], K.way.shape[0] - 1
    for i in range(last + 1):
        K.met_g[j, i] = A[SHEET].rows[0, i]
    if S.guards.kind[last] == G_SHARED:
        guard_of_group(S, A[W_], A[OWN].real.t, A[GROUP], K, -1 - j)
    for k in range(K.stages.shape[0]):
        if K.stages[k] == K.met[j]:
            levels(A, K, 1 + k)
