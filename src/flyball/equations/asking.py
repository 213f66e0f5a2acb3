"""What loops of integrators ask of the equations, through the engine's door: written once for all of them.

``A`` begins with the engine's address, tables, scratch, its tableau, its desk, its sheet, and what holds together.
"""

from __future__ import annotations

from ..compiler.formulas import call, call_bound, formula
from .tasks import ARRIVE, INSPECT, REPORT, TANGENT

ENGINE, S_, W_, R_, OWN, SHEET, GROUP = range(7)


@formula
def through(A, task):
    """Have the engine do a task at the state on its desk."""
    return call(A[ENGINE], A[S_], A[W_], A[R_], A[OWN], A[SHEET], task)


@formula
def steps(own, A, K, R, c, task):
    """What a loop asks of a method behind a door."""
    return call_bound(own, task)


@formula
def put(own, t, y):
    """Lay a time and a state on the engine's desk."""
    own.real.t = t
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
    put(own, own.real.t, y)
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
    own.real.t, own.real.h, own.real.span = t, h, span
    own.count.next = first
    through(A, INSPECT)
    return own.count.next, own.real.h, own.real.grow


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
