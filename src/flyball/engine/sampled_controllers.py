"""Sampled controllers: at sampling instants outputs are computed and held until the next, and states are advanced.

    y_k = h(t_k, x_k, measured),  x_(k+1) = f(t_k, x_k, measured, y_k)

Signals come first, in an order in which each is known before it is needed, including those of other controllers sampled
at the same instant; then all states at once. Measured quantities are those just before the instant: positions and
velocities do not jump there. No table changes, so that an instant costs two evaluations of the motion.

Steps end at instants. Where an interval between two is much shorter than a step that the tolerance allows, it is
integrated by a method of lower order with fewer stages. That is done as long as the errors of such steps together stay
below the tolerance, the share of each being the fraction of the motion that its step covers.
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
from ..tables.table_definitions import System, Work
from .calls import INTEGRATE, MOTION, OutputBuffer
from .entry_point import engine
from .rows import controller_column

PERIOD, OFFSET = range(2)  # columns of SamplePlan.clock
SAMPLE_CLOCK, SAMPLE_STATE, SAMPLE_LAW, IS_LATER = range(
    4
)  # columns of SamplePlan.row: clock, state, law, whether it comes after all others
INSTANT_TOLERANCE = 1e-9  # relative to the period: a time this near counts as an instant
INSTANT_ROUNDING = 8.0 * 2.0**-52  # relative to the time: exceeds the rounding error of an instant
OUTPUT_ROWS = 64  # rows of output taken at a time
ENGINE, S_, W_, R_, CLOCK, OUTPUT, PLAN, LOWER = range(8)
WAIT, AGAIN, TAKEN, REFUSED = range(4)  # entries of SamplePlan.lower
MAX_WAIT = 1024  # largest number of intervals before the lower order is tried again


class SamplePlan(NamedTuple):
    """What is sampled, and when."""

    clock: Float2  # (ns, 2): period and offset [s]
    next: Int1  # (ns,): number of the next instant
    row: Int2  # (nu, 4): clock, state, law, whether all others come first; in order
    value: Float1  # (nu,): scratch
    end: Float1  # (1,): end of the motion [s], where nothing is sampled
    # intervals until the lower order is tried (0: it is in use, -1: never); how many if it fails; steps accepted and
    # rejected when this interval began, which may continue in another call
    lower: Int1  # (4,)


@formula
def next_instant(P, k):
    """Time of the next instant of clock k."""
    return P.clock[k, OFFSET] + P.next[k] * P.clock[k, PERIOD]


@formula
def earliest_instant(P):
    """Next instant at which something is sampled; infinite if there is none before the end."""
    first = np.inf
    for k in range(P.next.shape[0]):
        at = next_instant(P, k)
        if at < P.end[0] - INSTANT_TOLERANCE * P.clock[k, PERIOD]:
            first = min(first, at)
    return first


@formula
def matching_output_time(P, times, at):
    """Output time that equals an instant except for rounding, if there is one; else that instant."""
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
    """Sample all due controllers at the time and state of ``clock``. Returns the status of the evaluation there."""
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
                at += INSTANT_ROUNDING * abs(at)  # laws that jump at the instant have their later value
                P.value[u] = evaluate(S.code, S.const, P.row[u, SAMPLE_LAW], W.stack, (at, 0.0, 0.0), W.sensed)
                if late == 0:
                    W.sensed.value[controller_column(S, W, P.row[u, SAMPLE_STATE])] = P.value[u]
    for u in range(P.row.shape[0]):
        if is_due(P, P.row[u, SAMPLE_CLOCK], t):
            clock.y.current[z + P.row[u, SAMPLE_STATE]] = P.value[u]
    for k in range(P.next.shape[0]):
        while is_due(P, k, t):
            P.next[k] += 1
    clock.count.started = FORCES_JUMPED
    clock.real.h = max(clock.real.h, clock.real.wide)  # the last step was shortened to end here
    return 0


@kernel
def sample_kernel(
    address: int, S: System, W: Work, R: Tableau, clock: StepState, output: OutputBuffer, P: SamplePlan
) -> int:
    """Sample all due controllers, as a kernel."""
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
    """Integrate from instant to instant, with the engine's INTEGRATE between them. Returns the number of rows."""
    A = (address, S, W, R, clock, output, P, lower)
    return advance_between_samples(integrate_by_engine, A, A, output.rows, out)


@formula
def integrate_by_engine(A, rows):
    """Integrate by the engine's own loop into its output buffer, by the lower order where that is accurate enough."""
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
    """Continue until ``clock.real.t_end``, where nothing is sampled, or until ``loop`` stops otherwise.

    ``loop(loop_arguments, rows)`` returns the number of rows it has written to ``rows``. Returns the number of rows
    written to ``out``.
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
        if not over and n > 0 and rows[n - 1, 0] == at:  # written later, when the values held from then on are known
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
    """Sampled controllers of a motion and their next instants.

    Parameters
    ----------
    plan : SamplePlan
    R, lower : Tableau
        The method, and one of lower order for short intervals.
    width, most : int
        Length of a row of output; maximum number of rows.
    """

    def __init__(self, plan: SamplePlan, R: Tableau, lower: Tableau, width: int, most: int) -> None:
        self.plan, self.R, self.lower = plan, R, lower
        self.output = OutputBuffer(np.zeros((max(1, min(OUTPUT_ROWS, most // 2)), max(width, 1))))

    def go_on(self, S: System, W: Work, clock: StepState, out: np.ndarray) -> int:
        """Continue the integration with sampling. Returns the number of rows written."""
        return int(sampled_kernel(engine.address, S, W, self.R, clock, self.output, self.plan, self.lower, out))

    def differs(self, other: SampledControllers) -> bool:
        """Whether another one has other instants."""
        return not np.array_equal(self.plan.clock, other.plan.clock)

    def due(self, t: float) -> bool:
        """Whether something is sampled at t."""
        return bool(any_due(self.plan, t))

    def due_states(self, t: float) -> list[tuple[int, bool]]:
        """States that are sampled at t, in order of evaluation, and whether they come after all signals."""
        rows = sorted(self.plan.row.tolist(), key=lambda row: row[IS_LATER])
        return [(row[SAMPLE_STATE], bool(row[IS_LATER])) for row in rows if is_due(self.plan, row[SAMPLE_CLOCK], t)]

    def next(self, times: np.ndarray) -> float:
        """Next instant; infinite if there is none. ``times`` are the output times."""
        return float(matching_output_time(self.plan, times, earliest_instant(self.plan)))

    def sample(self, S: System, W: Work, clock: StepState) -> int:
        """Sample all controllers due now. Returns the status of the evaluation there."""
        return int(sample_kernel(engine.address, S, W, self.R, clock, self.output, self.plan))
