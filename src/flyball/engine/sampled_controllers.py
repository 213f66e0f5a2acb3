"""Sampled controllers: at their instants outputs are computed and held until the next, and states are advanced.

    y_k = h(t_k, x_k, measured),  x_(k+1) = f(t_k, x_k, measured, y_k)

Signals first, in an order in which each is known before it is needed, those of other controllers that are sampled
at the same instant too; then all states at once. Measured quantities are those just before the instant: positions
and velocities do not jump there. No table changes, so that an instant costs two evaluations of the motion.

Steps end on instants. Where an interval between two is much shorter than a step that the tolerance allows, a method
of lower order with fewer stages takes it as well: as long as all errors of such steps together stay below the
tolerance, each no larger than the part of the motion that its step is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.formulas import call, formula
from ..compiler.kernels import kernel
from ..compiler.struct_layout import Float1, Float2, Int1, Int2
from ..laws.bytecode import evaluate
from ..numerics.integrators.butcher_tableaux import Tableau
from ..numerics.integrators.time_loop import DONE, FORCES_JUMPED, RUNNING, STEP_FAILED, StepState
from ..tables.table_definitions import VALUE, System, Work
from .calls import INTEGRATE, MOTION, OutputBuffer
from .entry_point import engine
from .rows import controller_column

PERIOD, OFFSET = range(2)  # columns of Samples.clock
SAMPLE_CLOCK, SAMPLE_STATE, SAMPLE_LAW, IS_LATER = range(
    4
)  # columns of Samples.row: clock, state, law, whether it waits for all others
INSTANT_TOLERANCE = 1e-9  # of a period: a time that is an instant
INSTANT_ROUNDING = (
    8.0 * 2.0**-52
)  # of a time: more than an instant is off, by rounding, from the time that it stands for
OUTPUT_ROWS = 64  # of output that are taken at once
ENGINE, S_, W_, R_, CLOCK, OUTPUT, PLAN, LOWER = range(8)
WAIT, AGAIN, TAKEN, REFUSED = range(4)  # entries of Samples.lower
MAX_WAIT = 1024  # intervals after which the lower order is tried again, at most


class SamplePlan(NamedTuple):
    """When what is sampled."""

    clock: Float2  # (ns, 2): period and offset [s]
    next: Int1  # (ns,): number of the next instant
    row: Int2  # (nu, 4): clock, state, law, whether all others come first; in order
    value: Float1  # (nu,): scratch
    end: Float1  # (1,): end of the motion [s], at which nothing is sampled any more
    # intervals until the lower order is tried, 0: it is taken, -1: never; how many if it fails; steps taken and refused
    # when this interval began, which may go on in another call
    lower: Int1  # (4,)


@formula
def next_instant(P, k):
    """Time of the next instant of clock k."""
    return P.clock[k, OFFSET] + P.next[k] * P.clock[k, PERIOD]


@formula
def earliest_instant(P):
    """The next instant at which something is sampled; none before the end: infinite."""
    first = np.inf
    for k in range(P.next.shape[0]):
        at = next_instant(P, k)
        if at < P.end[0] - INSTANT_TOLERANCE * P.clock[k, PERIOD]:
            first = min(first, at)
    return first


@formula
def matching_output_time(P, times, at):
    """The output time that is an instant but for rounding, if there is one; else that instant."""
    near = np.inf
    for k in range(P.next.shape[0]):
        near = min(near, INSTANT_TOLERANCE * P.clock[k, PERIOD])
    low, high = 0, times.shape[0]
    while low < high and at < np.inf:
        mid = (low + high) // 2
        if times[mid] < at - near:
            low = mid + 1
        else:
            high = mid
    return times[low] if low < times.shape[0] and abs(times[low] - at) <= near else at


@formula
def is_due(P, k, t):
    """Whether clock k samples at t."""
    near = INSTANT_TOLERANCE * P.clock[k, PERIOD]
    return next_instant(P, k) <= t + near and next_instant(P, k) < P.end[0] - near


@formula
def any_due(P, t):
    """Whether something is sampled at t."""
    count = 0
    for k in range(P.next.shape[0]):
        count += 1 if is_due(P, k, t) else 0
    return count > 0


@formula
def sample_controllers(A):
    """Sample what is due at the time and state of the clock. Returns the status of the evaluation there."""
    S, W, clock, P = A[S_], A[W_], A[CLOCK], A[PLAN]
    t = clock.real.t
    status = call(A[ENGINE], A[S_], A[W_], A[R_], A[CLOCK], A[OUTPUT], MOTION)
    if status != 0:
        return status
    z = S.sizes.coordinates + W.velocities.solved.shape[0]
    for late in range(2):
        for u in range(P.row.shape[0]):
            if P.row[u, IS_LATER] == late and is_due(P, P.row[u, SAMPLE_CLOCK], t):
                at = next_instant(P, P.row[u, SAMPLE_CLOCK])
                at += INSTANT_ROUNDING * abs(at)  # laws of time that jump there are those from then on
                P.value[u] = evaluate(S.code, S.const, P.row[u, SAMPLE_LAW], W.stack, (at, 0.0, 0.0), W.sensed)
                if late == 0:
                    W.sensed[VALUE, controller_column(S, W, P.row[u, SAMPLE_STATE])] = P.value[u]
    for u in range(P.row.shape[0]):
        if is_due(P, P.row[u, SAMPLE_CLOCK], t):
            clock.y[0, z + P.row[u, SAMPLE_STATE]] = P.value[u]
    for k in range(P.next.shape[0]):
        while is_due(P, k, t):
            P.next[k] += 1
    clock.count.started = FORCES_JUMPED
    clock.real.h = max(clock.real.h, clock.real.wide)  # the last step was cut short
    return 0


@kernel
def sample_kernel(
    address: int, S: System, W: Work, R: Tableau, clock: StepState, output: OutputBuffer, P: SamplePlan
) -> int:
    """Sample what is due."""
    return sample_controllers((address, S, W, R, clock, output, P))


@kernel
def sampled_kernel(
    address: int,
    S: System,
    W: Work,
    R: Tableau,
    clock: StepState,
    output: OutputBuffer,
    P: SamplePlan,
    lower: Tableau,
    out: Float2,
) -> int:
    """Integrate from instant to instant, as `engine.INTEGRATE` does between them. Returns rows written."""
    A = (address, S, W, R, clock, output, P, lower)
    return advance_between_samples(integrate_by_engine, A, A, output.rows, out)


@formula
def integrate_by_engine(A, rows):
    """The engine's own loop, which writes to its sheet; by the lower order where that is as good."""
    clock, lower = A[CLOCK], A[PLAN].lower
    if clock.count.started != 1:
        lower[TAKEN], lower[REFUSED] = clock.count.accepted, clock.count.rejected
    if lower[WAIT] == 0:
        n = call(A[ENGINE], A[S_], A[W_], A[LOWER], clock, A[OUTPUT], INTEGRATE)
    else:
        n = call(A[ENGINE], A[S_], A[W_], A[R_], clock, A[OUTPUT], INTEGRATE)
    if clock.count.status == DONE and lower[WAIT] >= 0:
        at_once = clock.count.accepted == lower[TAKEN] + 1 and clock.count.rejected == lower[REFUSED]
        if lower[WAIT] > 0:
            lower[WAIT] = lower[WAIT] - 1 if at_once else lower[AGAIN]
        elif at_once and clock.real.error * clock.real.span <= clock.real.tried:
            lower[AGAIN] = 1
        else:
            lower[WAIT] = lower[AGAIN]
            lower[AGAIN] = min(2 * lower[AGAIN], MAX_WAIT)
    return n


@formula
def advance_between_samples(loop, loop_arguments, A, rows, out):
    """Go on until the end of the stretch, at which nothing is sampled, or for what else the loop between returns.

    That is ``loop(own, rows)``: rows written, at most ``rows``.
    """
    clock, P = A[CLOCK], A[PLAN]
    used = 0
    end = clock.real.t_end
    taken = clock.count.accepted + clock.count.rejected
    while True:
        if any_due(P, clock.real.t) and sample_controllers(A) != 0:
            clock.count.status = STEP_FAILED
            break
        at = min(matching_output_time(P, clock.times, earliest_instant(P)), end)
        clock.real.t_end = at
        n = loop(loop_arguments, rows)
        clock.real.t_end = end
        over = clock.count.status != DONE or at == end
        if not over and n > 0 and rows[n - 1, 0] == at:  # written when it is known what is held from then on
            n -= 1
            clock.count.next -= 1
        for i in range(n):
            for j in range(out.shape[1]):
                out[used + i, j] = rows[i, j]
        used += n
        if over:
            break
        full = used + rows.shape[0] > out.shape[0]
        if full or clock.count.accepted + clock.count.rejected - taken >= clock.count.quota:
            clock.count.status = RUNNING
            break
    return used


class SampledControllers:
    """What is sampled in a motion, and when next.

    Parameters
    ----------
    plan : Samples
    R, lower : Tableau
        The method; one of lower order for short intervals.
    width, most : int
        Of a row of output; how many rows there is room for.
    """

    def __init__(self, plan: SamplePlan, R: Tableau, lower: Tableau, width: int, most: int) -> None:
        self.plan, self.R, self.lower = plan, R, lower
        self.output = OutputBuffer(np.zeros((max(1, min(OUTPUT_ROWS, most // 2)), max(width, 1))))

    def go_on(self, S: System, W: Work, clock: StepState, out: np.ndarray) -> int:
        """Integrate on, sampling on the way. Returns rows written."""
        return int(sampled_kernel(engine.address, S, W, self.R, clock, self.output, self.plan, self.lower, out))

    def differs(self, other: SampledControllers) -> bool:
        """Whether another one has other instants."""
        return not np.array_equal(self.plan.clock, other.plan.clock)

    def due(self, t: float) -> bool:
        """Whether something is sampled at t."""
        return bool(any_due(self.plan, t))

    def next(self, times: np.ndarray) -> float:
        """The next instant; infinite if there is none. ``times`` are those of output."""
        return float(matching_output_time(self.plan, times, earliest_instant(self.plan)))

    def sample(self, S: System, W: Work, clock: StepState) -> int:
        """Sample what is due now. Returns the status of the evaluation there."""
        return int(sample_kernel(engine.address, S, W, self.R, clock, self.output, self.plan))
