"""A motion and how it changes with parameters, integrated together: the variational equations, in the house's own loop.

    dq' = dv + N dq, dvdot (see ``changes``); works change with the powers

After every step motion and changes are put back on their constraints. The steps suit both, to the same tolerance.
(Direct differentiation: Haug and Ehle 1982; Chang and Nikravesh 1985. That the changes may be put back like this, see
Serban and Freeman 1996.)

The state is (q, v, all (dq, dv), z, all dz). This loop holds no right-hand side: it goes through the doors of the
engine and of the residuals.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..compiler.kernels import kernel
from ..compiler.layout import Float2
from ..numerics.integrators.clock import Clock
from ..numerics.integrators.explicit import answer
from ..numerics.integrators.loop import advance, nothing, whole
from ..numerics.integrators.tableaux import Tableau
from ..tables.system import ComplexSystem, ComplexWork, System, Work
from .asking import OWN, S_, SHEET, W_, inspect, through
from .changes import COUNT, NQ, NZ, POWERS, Plan, change, closed, press, settle_at
from .tasks import ARRIVE, MOTION, REPORT, TANGENT, Bench, Sheet


@formula
def split(x, y, P, out):
    """Take the motion's own part of a state vector (or of its rates) ``y`` to ``x``; or back, if ``out``."""
    nv = P.zero.shape[0]
    own = P.size[NQ] + nv
    more = 2 * nv * P.size[COUNT]
    for i in range(x.shape[0]):
        j = i if i < own else i + more
        if out:
            y[j] = x[i]
        else:
            x[i] = y[j]


@formula
def changes(y, dy, A, P):
    """Rates of all changes at the state on the bench."""
    nv, nz, n = P.zero.shape[0], P.size[NZ], P.size[COUNT]
    at = P.size[NQ] + nv
    works = at + 2 * nv * n + nz
    press(A, P)
    for k in range(n):
        a = at + 2 * nv * k
        b = works + nz * k
        change(A, P, k, y[a : a + nv], y[a + nv : a + 2 * nv], dy[a : a + 2 * nv], dy[b : b + nz])


@formula
def derivative(t, y, dy, A, P):
    """Rates of the motion, at the state put on its constraints, and of its changes."""
    own = A[OWN]
    own.real.t = t
    split(own.y[0], y, P, False)
    status = through(A, MOTION)
    if status == 0:
        split(own.K[0], dy, P, True)
        settle_at(A, P, t, A[W_].y[0])
        changes(y, dy, A, P)
    return status


@formula
def land(t, y, dy, A, P):
    """Put all changes on their constraints, at the state that the engine has put on its own, and find their rates."""
    S = A[S_]
    nv = P.zero.shape[0]
    settle_at(A, P, t, A[OWN].y[0])
    bound = S.rows.law.shape[0] > 0
    for b in range(S.tree.parent.shape[0]):
        bound = bound or S.tree.law[b] >= 0
    if bound:
        for k in range(P.size[COUNT]):
            a = P.size[NQ] + nv + 2 * nv * k
            closed(A, P, k, y[a : a + nv], y[a + nv : a + 2 * nv])
    changes(y, dy, A, P)


@formula
def arrive(t, y, dy, A, P):
    """Put motion and changes on their constraints, in place, and evaluate there; how far the motion moved."""
    own, rows = A[OWN], A[SHEET].rows
    own.real.t = t
    split(own.y[0], y, P, False)
    status = through(A, ARRIVE)
    moved = rows[0, 0]
    if status == 0:
        split(own.y[0], y, P, True)
        split(own.K[0], dy, P, True)
        land(t, y, dy, A, P)
    return status, moved


@formula
def tangent(y, e, A, P):
    """Take from an error what the projection of the motion takes."""
    own = A[OWN]
    split(own.y[0], y, P, False)
    split(own.K[0], e, P, False)
    through(A, TANGENT)
    split(own.K[0], e, P, True)


@formula
def report(t, y, out, A, P):
    """Write a row of output: the motion's own; then of each parameter changes of positions, velocities, accelerations,
    multipliers, efforts and works (or powers).
    """
    own, rows = A[OWN], A[SHEET].rows
    nv, nz, n = P.zero.shape[0], P.size[NZ], P.size[COUNT]
    own.real.t = t
    split(own.y[0], y, P, False)
    status = through(A, REPORT)
    if status != 0:
        return status
    width = out.shape[0] - n * (2 * nv + P.found.shape[1] + nz)
    for i in range(width):
        out[i] = rows[0, i]
    split(own.y[0], y, P, True)
    rate = P.rate
    land(t, y, rate, A, P)
    at = P.size[NQ] + nv
    works = at + 2 * nv * n + nz
    to = width
    for k in range(n):
        for i in range(2 * nv):
            out[to + i] = y[at + 2 * nv * k + i]
        to += 2 * nv
        for i in range(P.found.shape[1]):
            out[to + i] = P.found[k, i]
        to += P.found.shape[1]
        for i in range(nz):
            j = works + nz * k + i
            out[to + i] = rate[j] if P.size[POWERS] == 1 else y[j]
        to += nz
    return status


@kernel
def variation_kernel(
    address: int,
    residual: int,
    S: System,
    W: Work,
    R: Tableau,
    own: Clock,
    sheet: Sheet,
    SC: ComplexSystem,
    WC: ComplexWork,
    bench: Bench,
    plan: Plan,
    clock: Clock,
    states: Float2,
    out: Float2,
) -> int:
    """Integrate motion and changes together, or report them at given states; see ``analysis.linear.variation``.

    Parameters
    ----------
    address, residual : int
        Of the doors of the engine and of the residuals.
    S, W : System, Work
        Of the motion.
    R : Tableau
    own, sheet : Clock, Sheet
        The engine's.
    SC, WC : System, Work
        In complex numbers.
    bench : Bench
    plan : Plan
    clock : Clock
        Of motion and changes.
    states : (n, width of the state)
        What to report, at the times of the clock; if there are none, all is integrated.
    out : (n, width)
        Rows of output.

    Returns
    -------
    int
        The number of rows written.
    """
    A = (address, S, W, R, own, sheet, residual, SC, WC, bench)
    if states.shape[0] == 0:
        callbacks = (answer, (derivative, arrive, tangent, inspect), report, nothing, whole)
        return advance(callbacks, A, plan, R, clock, out)
    for n in range(states.shape[0]):
        if report(clock.times[n], states[n], out[n], A, plan) != 0:
            return n
    return states.shape[0]
