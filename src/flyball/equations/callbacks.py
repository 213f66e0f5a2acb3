"""What loops of integrators ask of the equations, through the engine's door: written once for all of them.

``A`` begins with the engine's address, tables, scratch, its tableau, its desk, its sheet, and what holds together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.door import ask as through_door
from ..compiler.door import enter
from ..compiler.jit import formula
from ..numerics.integrators.clock import GROW, NEXT, SPAN, Clock, H, T
from ..numerics.integrators.tableaux import Tableau
from ..numerics.integrators.watching import Watch
from ..tables.system import G_SHARED, GUARD_KIND, LAM
from .engine import Sheet
from .sharing import Sharing, margin
from .tasks import ARRIVE, INSPECT, REPORT, TANGENT

ENGINE, S_, W_, R_, OWN, SHEET, GROUP = range(7)


class Own(NamedTuple):
    """What goes to the engine's door besides tables and scratch."""

    clock: Clock  # its desk: time and state that it is asked for
    sheet: Sheet
    R: Tableau
    doors: np.ndarray  # addresses of the engine, and of the residuals where they are asked


class Going(NamedTuple):
    """A motion that is going on."""

    clock: Clock
    watch: Watch
    group: Sharing  # what holds together


@formula
def through(A, task):
    """Have the engine do a task at the state on its desk."""
    return enter(A[ENGINE], A[S_], A[W_], A[R_], A[OWN], A[SHEET], task)


@formula
def steps(own, A, K, R, c, task):
    """What a loop asks of a method behind a door."""
    return through_door(own, task)


@formula
def put(own, t, y):
    """Lay a time and a state on the engine's desk."""
    own.real[T] = t
    for i in range(y.shape[0]):
        own.y[0, i] = y[i]


@formula
def arrive(t, y, dy, A, K):
    """Put y on the constraints, in place, and evaluate there; how far it moved."""
    own = A[OWN]
    put(own, t, y)
    status = through(A, ARRIVE)
    if status == 0:
        for i in range(dy.shape[0]):
            y[i] = own.y[0, i]
            dy[i] = own.K[0, i]
    return status, A[SHEET].rows[0, 0]


@formula
def tangent(y, e, A, K):
    """Take from an error what the projection takes."""
    own = A[OWN]
    put(own, own.real[T], y)
    for i in range(e.shape[0]):
        own.K[0, i] = e[i]
    through(A, TANGENT)
    for i in range(e.shape[0]):
        e[i] = own.K[0, i]


@formula
def inspect(t, h, span, first, seen, A, K):
    """What laws do within a step; see ``within.inspect``."""
    if seen.shape[1] == 0:
        return 0, 0.0, 0.0
    own = A[OWN]
    own.real[T], own.real[H], own.real[SPAN] = t, h, span
    own.count[NEXT] = first
    through(A, INSPECT)
    return own.count[NEXT], own.real[H], own.real[GROW]


@formula
def report(t, y, out, A, K):
    """Write a row of output."""
    own = A[OWN]
    put(own, t, y)
    status = through(A, REPORT)
    for i in range(y.shape[0]):
        y[i] = own.y[0, i]
    for i in range(out.shape[0]):
        out[i] = A[SHEET].rows[0, i]
    return status


@formula
def levels(A, K, at):
    """Keep what has no known rate."""
    W = A[W_]
    n = K.rows.shape[0]
    for k in range(n):
        K.levels[at, k] = W.row[LAM, K.rows[k]]
    for k in range(K.spots.shape[0]):
        K.levels[at, n + k] = W.sensed[K.spots[k, 0], K.spots[k, 1]]


@formula
def meet(A, K, j):
    """Keep guards and levels at place j of those that are met within a step; the engine has just done WATCH there."""
    S, last = A[S_], K.met_g.shape[1] - 1
    for i in range(last + 1):
        K.met_g[j, i] = A[SHEET].rows[0, i]
    if S.guard_i[last, GUARD_KIND] == G_SHARED:
        K.met_g[j, last] = margin(S, A[W_], A[OWN].real[T], A[GROUP])
    for k in range(K.stages.shape[0]):
        if K.stages[k] == K.met[j]:
            levels(A, K, 1 + k)
