"""Inspection of laws within a step, to find pulses, thin walls or corners of tables between the stages of the step.

Each law that can act briefly is sampled along the step; its inputs follow the cubics through their values and rates at
the ends. Where it departs from the polynomial through eight of its values, the place is reported, and the integrator
decides whether that matters. The number of samples is relative to the whole time span and so bounded: what is shorter
than a `SAMPLES`-th of the span may fall between them. A force whose formula is discontinuous somewhere (a rotation
vector at half a turn) must be on the same branch at both ends of the step.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ..compiler.formulas import formula
from ..laws.bytecode import SENSOR, evaluate, evaluate_jet, may_be_brief
from ..math.scalar import cos
from ..numerics.integrators.time_loop import (
    AT_END,
    AT_START,
    INSPECTED_END,
    INSPECTED_END_RATE,
    INSPECTED_START,
    INSPECTED_START_RATE,
)
from ..tables.table_definitions import ALONG, BETWEEN, LAW_INPUT, LAW_INPUT_RATE, SAMPLED, SLIDING
from .calls import call_generated
from .element_dispatch import branch, breaks, force_kind, inputs
from .kinematics import load_record
from .loads import force_row
from .rows import BY_TIME, count_measured

SAMPLES = 20000  # samples of a law over the whole time span, in long steps
MIN_SAMPLES = 8  # samples in any step
NODES = 8  # values of a law that the expected polynomial is fitted to, at Chebyshev points with the ends included
LAWS = 3  # laws of each force
BRANCH_NUMBERS = 5  # numbers that describe the branch of a force's formula, and how fast it turns
MAX_TURN = 2.0  # rotation within a step [rad] up to which the ends identify the branch
UNBOUNDED = np.inf  # duration reported at a change of branch: no step is short enough
DEPARTURE = 1e-3  # accepted deviation from the polynomial, relative to the law's change over the step
LAW_ROUNDING = 1e-9  # deviation that is only rounding, relative to the law's size
# rows of StepState.inspection: sensors within the step; sensors and inputs of forces and their rates, at its start and
# at its end; values at the nodes; 1 for each law that is inspected
INPUTS_WITHIN, NODE_VALUES, LAW_SELECTED, INSPECTION_ROWS = 0, 5, 6, 7


def law_starts(S) -> np.ndarray:
    """Start of each law in the code, by its number (see `law_at`); -1 where there is none."""
    return np.r_[S.forces.laws.ravel(), S.rows.law, S.tree.law, S.gravity_laws[:3]]


def count_law_inputs(S) -> int:
    """Number of values that `store_law_inputs` stores for each end."""
    return count_measured(S) + (1 + BRANCH_NUMBERS) * len(S.forces.F)


def any_formula_breaks(S) -> bool:
    """Whether the formula of some force is discontinuous somewhere."""
    return any(breaks(force_kind(S, k)) for k in range(len(S.forces.F)))


def inspection_buffer(S, sampled: Collection[int] | None = None) -> np.ndarray:
    """Buffer of `inspect_step`; without columns, and without inspection, where no law can act briefly.

    ``sampled``: starts of the laws to be inspected; by default all laws that can act briefly.
    """
    laws = law_starts(S)
    look = [at >= 0 and may_be_brief(S.code, at) and (sampled is None or at in sampled) for at in laws]
    if not any(look) and not any_formula_breaks(S):
        return np.zeros((INSPECTION_ROWS, 0))
    loads = int((S.forces.load >= 0).sum())
    sensed = 2 * count_measured(S) + loads + len(S.control_laws) + len(S.switches.row)
    seen = np.zeros((INSPECTION_ROWS, max(sensed, count_law_inputs(S), NODES, len(laws))))
    seen[LAW_SELECTED, : len(laws)] = look
    return seen


@formula
def inspect_step(t, h, span, first, buffer, S, W):
    """Next place within a step where a law acts unexpectedly: (where to continue, place, duration).

    Place and duration are fractions of the step; the first value is 0 if there is no such place. At a change of branch
    of a formula the duration is `UNBOUNDED`: every step is too long. Each such law gives two places: where it departs
    most from its polynomial, and where it departs most from its mean, as a node may lie in the pulse itself. With
    AT_START and AT_END only the inputs of the laws, at the state in W, are stored.
    """
    if buffer.shape[1] == 0:
        return 0, 0.0, 0.0
    if first == AT_START:
        store_law_inputs(S, W, buffer, INSPECTED_START)
        return 0, 0.0, 0.0
    if first == AT_END:
        store_law_inputs(S, W, buffer, INSPECTED_END)
        return 0, 0.0, 0.0
    if first == 0 and branch_changes(S, buffer, h):
        return 1, 0.5, UNBOUNDED
    again = first % 2 == 1  # the law reported last has a second place
    for k in range(first // 2, LAWS * S.forces.F.shape[0] + S.rows.law.shape[0] + S.tree.parent.shape[0] + 3):
        law = law_at(S, k)
        if buffer[LAW_SELECTED, k] > 0.0:
            n = max(MIN_SAMPLES, int(SAMPLES * min(1.0, h / span)))
            if again:
                x, share = farthest_from_mean(S, W, k, law, t, h, n, buffer)
                return 2 * k + 2, x, share
            x, share = largest_departure(S, W, k, law, t, h, n, buffer)
            if share > 0.0:
                return 2 * k + 1, x, share
        again = False
    return 0, 0.0, 0.0


@formula
def law_at(S, k):
    """Start of law number k, in the order forces, rows, prescribed coordinates, gravity; -1 if it has none."""
    if k < LAWS * S.forces.F.shape[0]:
        return S.forces.laws[k // LAWS, k % LAWS]
    k -= LAWS * S.forces.F.shape[0]
    if k < S.rows.law.shape[0]:
        return S.rows.law[k]
    k -= S.rows.law.shape[0]
    return S.tree.law[k] if k < S.tree.parent.shape[0] else S.gravity_laws[k - S.tree.parent.shape[0]]


@formula
def store_law_inputs(S, W, buffer, row):
    """Store the inputs of laws and their rates at the state in W."""
    nm = count_measured(S)
    for m in range(2 * nm, W.sensed.shape[1]):  # sides of nonsmooth points do not change within a step
        buffer[INPUTS_WITHIN, m] = W.sensed.value[m]
    for m in range(nm):
        buffer[row, m] = W.sensed.value[m]
        buffer[row + 1, m] = W.sensed.rate[m]
    for f in range(S.forces.F.shape[0]):
        if S.forces.family[f] == SLIDING:
            continue
        if S.forces.family[f] == ALONG:
            a, b = W.sensed.value[S.forces.F[f]], W.sensed.rate[S.forces.F[f]]
        else:
            F = load_record(W.frames, S.forces.F[f])
            M = load_record(W.frames, S.forces.M[f])
            a, b = inputs(force_kind(S, f), force_row(S.force_parameters, f), F, M)
            if S.forces.family[f] == BETWEEN and breaks(force_kind(S, f)):
                side = branch(force_kind(S, f), force_row(S.force_parameters, f), F, M)
                for i in range(BRANCH_NUMBERS):
                    buffer[row, nm + S.forces.F.shape[0] + BRANCH_NUMBERS * f + i] = side[i]
        buffer[row, nm + f] = a
        buffer[row + 1, nm + f] = b


@formula
def branch_changes(S, buffer, h):
    """Whether some force may be on another branch of its formula at the end of the step than at its start."""
    nf = S.forces.F.shape[0]
    for f in range(nf):
        if S.forces.family[f] == BETWEEN and breaks(force_kind(S, f)):
            at = count_measured(S) + nf + BRANCH_NUMBERS * f
            s = 0.0
            for i in range(BRANCH_NUMBERS - 1):
                s += buffer[INSPECTED_START, at + i] * buffer[INSPECTED_END, at + i]
            speed = max(
                buffer[INSPECTED_START, at + BRANCH_NUMBERS - 1], buffer[INSPECTED_END, at + BRANCH_NUMBERS - 1]
            )
            if not (s > 0.0 and speed * h <= MAX_TURN):
                return True
    return False


@formula
def largest_departure(S, W, k, law, t, h, n, buffer):
    """Place and duration, as fractions of the step, of a law's largest departure from the polynomial through its nodes.

    The duration is 0 where the law is as expected.
    """
    least = most = sample_law(S, W, k, law, t, h, 0.0, buffer)
    size = 0.0
    for j in range(NODES):
        f = sample_law(S, W, k, law, t, h, chebyshev_node(j), buffer)
        buffer[NODE_VALUES, j] = f
        least = min(least, f)
        most = max(most, f)
        size = max(size, abs(f))
    allowed = DEPARTURE * (most - least) + LAW_ROUNDING * size
    worst = allowed
    at = -1.0
    total = 0.0
    for i in range(n):
        x = (i + 0.5) / n
        gap = abs(sample_law(S, W, k, law, t, h, x, buffer) - law_polynomial(buffer, x))
        total += gap
        if gap > worst:
            worst = gap
            at = x
    return at, (total / (n * worst) if at >= 0.0 else 0.0)


@formula
def farthest_from_mean(S, W, k, law, t, h, n, buffer):
    """Place and duration, as fractions of the step, of a law's largest departure from its mean."""
    mean = 0.0
    for i in range(n):
        mean += sample_law(S, W, k, law, t, h, (i + 0.5) / n, buffer) / n
    worst = 0.0
    at = 0.5
    total = 0.0
    for i in range(n):
        gap = abs(sample_law(S, W, k, law, t, h, (i + 0.5) / n, buffer) - mean)
        total += gap / n
        if gap > worst:
            worst = gap
            at = (i + 0.5) / n
    return at, (total / worst if worst > 0.0 else 0.0)


@formula
def chebyshev_node(j):
    """Node j as a fraction of the step."""
    return 0.5 - 0.5 * cos(3.141592653589793 * j / (NODES - 1))


@formula
def law_polynomial(buffer, x):
    """The polynomial through the values at the nodes (barycentric form)."""
    above = 0.0
    below = 0.0
    for j in range(NODES):
        w = 0.5 if j == 0 or j == NODES - 1 else 1.0
        d = x - chebyshev_node(j)
        if d == 0.0:
            return buffer[NODE_VALUES, j]
        w /= d if j % 2 == 0 else -d
        above += w * buffer[NODE_VALUES, j]
        below += w
    return above / below


@formula
def sample_law(S, W, k, law, t, h, x, buffer):
    """Value of a law at fraction x of the step; for a driver's law the second derivative, which requires force."""
    nm = count_measured(S)
    s = t + x * h
    store_sensors_within(S, law, x, h, nm, buffer)
    made = W.generated[SAMPLED]
    if k >= LAWS * S.forces.F.shape[0]:
        if made != 0:
            return call_generated(
                S.flat[made + k],
                S,
                W,
                s,
                buffer[INPUTS_WITHIN],
                buffer[INPUTS_WITHIN],
                buffer[INPUTS_WITHIN],
                buffer[INPUTS_WITHIN],
            )
        return evaluate_jet(S.code, S.const, law, W.stack, s, buffer, BY_TIME)[2]
    a, b = input_within(buffer, nm + k // LAWS, x, h)
    if made != 0:
        W.flat[LAW_INPUT], W.flat[LAW_INPUT_RATE] = a, b
        return call_generated(
            S.flat[made + k],
            S,
            W,
            s,
            buffer[INPUTS_WITHIN],
            buffer[INPUTS_WITHIN],
            buffer[INPUTS_WITHIN],
            buffer[INPUTS_WITHIN],
        )
    return evaluate(S.code, S.const, law, W.stack, (s, a, b), buffer)


@formula
def store_sensors_within(S, law, x, h, nm, buffer):
    """Store the sensors that a law reads, of ``nm`` measured quantities and their rates, at fraction x of the step."""
    for i in range(law + 2, law + 2 + 2 * S.code[law], 2):
        if S.code[i] == SENSOR:
            m = S.code[i + 1]
            if m < nm:
                buffer[INPUTS_WITHIN, m] = input_within(buffer, m, x, h)[0]
            elif m < 2 * nm:
                buffer[INPUTS_WITHIN, m] = input_within(buffer, m - nm, x, h)[1]


@formula
def input_within(buffer, m, x, h):
    """Value and rate of column m at fraction x of the step: the cubic through value and rate at its ends."""
    f, g, u, v = (
        buffer[INSPECTED_START, m],
        buffer[INSPECTED_END, m],
        buffer[INSPECTED_START_RATE, m] * h,
        buffer[INSPECTED_END_RATE, m] * h,
    )
    a = 2.0 * (f - g) + u + v
    b = 3.0 * (g - f) - 2.0 * u - v
    return f + x * (u + x * (b + x * a)), (u + x * (2.0 * b + 3.0 * x * a)) / (h if h > 0.0 else 1.0)
