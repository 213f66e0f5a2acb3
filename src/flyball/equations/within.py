"""What laws do within a step: a pulse, a thin wall, a table's corner that no stage of the step has seen.

Each law that can act briefly is sampled along the step, its inputs along the cubics through their values and rates at
the ends. Where it is not what eight of its values let expect, the place is named; the integrator looks whether that
matters. Samples are dense relative to the whole time span, so that their number is bounded: what is shorter than a
`SAMPLES`-th of the span may fall between them. A force whose formula breaks somewhere (a rotation vector at half a
turn) has to be on one branch of it at both ends of the step.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ..compiler.formulas import formula
from ..laws.evaluation import evaluate, evaluate_jet
from ..laws.manner import brief
from ..math.scalar import cos
from ..numerics.integrators.clock import AT_END, AT_START, FROM, FROM_RATE, TO, TO_RATE
from ..tables.system import (
    ALONG,
    BETWEEN,
    LAW_INPUT,
    LAW_INPUT_RATE,
    RATE,
    SAMPLED,
    SLIDING,
    VALUE,
)
from .dispatch import branch, breaks, inputs, kind_of
from .loads import wide
from .made import run
from .records import load
from .rows import BY_TIME, measured

SAMPLES = 20000  # of a law over the whole time span, in steps that are wide
LEAST = 8  # in any step
NODES = 8  # values of a law that tell what to expect of it: at Chebyshev's points, ends included
LAWS = 3  # of a force
PARTS = 5  # numbers that say on which branch of its formula a force is, and how fast it turns
WIDEST = 2.0  # turning within a step [rad] up to which the ends tell that
BREAKS = np.inf  # how long a place of no formula lasts: no width of step is right
ODD = 1e-3  # part of a law's change over the step by which it may differ from what is expected
BLURRED = 1e-9  # part of its size that is nothing
# rows of Clock.seen: sensors within the step; (sensors and inputs of forces, and rates, at its start and end;) nodes
# (1 for each law that is looked at)
WITHIN, EXPECTED, LOOK, ROWS = 0, 5, 6, 7


def law_starts(S) -> np.ndarray:
    """Where each law begins in the code, by its number (see `law_at`); -1 where there is none."""
    return np.r_[S.forces.laws.ravel(), S.rows.law, S.tree.law]


def noted(S) -> int:
    """How many numbers `take_note` keeps of each end."""
    return measured(S) + (1 + PARTS) * len(S.forces.F)


def breaking(S) -> bool:
    """Whether the formula of some force breaks somewhere."""
    return any(breaks(kind_of(S, k)) for k in range(len(S.forces.F)))


def kept(S, sampled: Collection[int] | None = None) -> np.ndarray:
    """What `inspect` writes on: no columns, and nothing is inspected, where no law can act briefly.

    ``sampled`` are the starts of the laws that are to be looked at; without it all that can act briefly are.
    """
    laws = law_starts(S)
    look = [at >= 0 and brief(S.code, at) and (sampled is None or at in sampled) for at in laws]
    if not any(look) and not breaking(S):
        return np.zeros((ROWS, 0))
    loads = int((S.forces.load >= 0).sum())
    sensed = 2 * measured(S) + loads + len(S.control_laws) + len(S.switches.row)
    seen = np.zeros((ROWS, max(sensed, noted(S), NODES, len(laws))))
    seen[LOOK, : len(laws)] = look
    return seen


@formula
def inspect(t, h, span, first, seen, S, W):
    """The next place within a step at which a law does something unexpected: (where to go on from, place, how long).

    Place and how long are parts of the step; the first is 0 where there is none. Where a formula breaks it lasts
    without end (`BREAKS`): every step is too wide. Each such law has two places: where it departs most from its
    polynomial, and where most from its mean, as a node may have met the pulse itself. With AT_START and AT_END the
    inputs of the laws, at the state in W, are kept.
    """
    if seen.shape[1] == 0:
        return 0, 0.0, 0.0
    if first == AT_START:
        take_note(S, W, seen, FROM)
        return 0, 0.0, 0.0
    if first == AT_END:
        take_note(S, W, seen, TO)
        return 0, 0.0, 0.0
    if first == 0 and parted(S, seen, h):
        return 1, 0.5, BREAKS
    again = first % 2 == 1  # the law that was named last has another place to look at
    for k in range(first // 2, LAWS * S.forces.F.shape[0] + S.rows.law.shape[0] + S.tree.parent.shape[0]):
        law = law_at(S, k)
        if seen[LOOK, k] > 0.0:
            n = max(LEAST, int(SAMPLES * min(1.0, h / span)))
            if again:
                x, share = farthest(S, W, k, law, t, h, n, seen)
                return 2 * k + 2, x, share
            x, share = unexpected(S, W, k, law, t, h, n, seen)
            if share > 0.0:
                return 2 * k + 1, x, share
        again = False
    return 0, 0.0, 0.0


@formula
def law_at(S, k):
    """Law number k, of forces, of rows, of prescribed coordinates; -1 if it has none."""
    if k < LAWS * S.forces.F.shape[0]:
        return S.forces.laws[k // LAWS, k % LAWS]
    k -= LAWS * S.forces.F.shape[0]
    if k < S.rows.law.shape[0]:
        return S.rows.law[k]
    return S.tree.law[k - S.rows.law.shape[0]]


@formula
def take_note(S, W, seen, row):
    """Keep what laws depend on, and its rates, at the state in W."""
    nm = measured(S)
    for m in range(2 * nm, W.sensed.shape[1]):  # sides of corners do not change within a step
        seen[WITHIN, m] = W.sensed[VALUE, m]
    for m in range(nm):
        seen[row, m] = W.sensed[VALUE, m]
        seen[row + 1, m] = W.sensed[RATE, m]
    for f in range(S.forces.F.shape[0]):
        if S.forces.family[f] == SLIDING:
            continue
        if S.forces.family[f] == ALONG:
            a, b = W.sensed[VALUE, S.forces.F[f]], W.sensed[RATE, S.forces.F[f]]
        else:
            F = load(W.FK, S.forces.F[f])
            M = load(W.FK, S.forces.M[f])
            a, b = inputs(kind_of(S, f), wide(S.force_parameters, f), F, M)
            if S.forces.family[f] == BETWEEN and breaks(kind_of(S, f)):
                side = branch(kind_of(S, f), wide(S.force_parameters, f), F, M)
                for i in range(PARTS):
                    seen[row, nm + S.forces.F.shape[0] + PARTS * f + i] = side[i]
        seen[row, nm + f] = a
        seen[row + 1, nm + f] = b


@formula
def parted(S, seen, h):
    """Whether some force is on another branch of its formula at the end of the step than at its begin, or may be."""
    nf = S.forces.F.shape[0]
    for f in range(nf):
        if S.forces.family[f] == BETWEEN and breaks(kind_of(S, f)):
            at = measured(S) + nf + PARTS * f
            s = 0.0
            for i in range(PARTS - 1):
                s += seen[FROM, at + i] * seen[TO, at + i]
            speed = max(seen[FROM, at + PARTS - 1], seen[TO, at + PARTS - 1])
            if not (s > 0.0 and speed * h <= WIDEST):
                return True
    return False


@formula
def unexpected(S, W, k, law, t, h, n, seen):
    """Where in the step, and for how long, a law is not what its values at the nodes let expect: parts of the step.

    How long is 0 where it is as expected.
    """
    least = most = sample(S, W, k, law, t, h, 0.0, seen)
    size = 0.0
    for j in range(NODES):
        f = sample(S, W, k, law, t, h, node(j), seen)
        seen[EXPECTED, j] = f
        least = min(least, f)
        most = max(most, f)
        size = max(size, abs(f))
    allowed = ODD * (most - least) + BLURRED * size
    worst = allowed
    at = -1.0
    total = 0.0
    for i in range(n):
        x = (i + 0.5) / n
        gap = abs(sample(S, W, k, law, t, h, x, seen) - expected(seen, x))
        total += gap
        if gap > worst:
            worst = gap
            at = x
    return at, (total / (n * worst) if at >= 0.0 else 0.0)


@formula
def farthest(S, W, k, law, t, h, n, seen):
    """Where in the step a law is farthest from its mean, and for how long: parts of the step."""
    mean = 0.0
    for i in range(n):
        mean += sample(S, W, k, law, t, h, (i + 0.5) / n, seen) / n
    worst = 0.0
    at = 0.5
    total = 0.0
    for i in range(n):
        gap = abs(sample(S, W, k, law, t, h, (i + 0.5) / n, seen) - mean)
        total += gap / n
        if gap > worst:
            worst = gap
            at = (i + 0.5) / n
    return at, (total / worst if worst > 0.0 else 0.0)


@formula
def node(j):
    """Place of a node in the step."""
    return 0.5 - 0.5 * cos(3.141592653589793 * j / (NODES - 1))


@formula
def expected(seen, x):
    """The polynomial through the values at the nodes (barycentric form)."""
    above = 0.0
    below = 0.0
    for j in range(NODES):
        w = 0.5 if j == 0 or j == NODES - 1 else 1.0
        d = x - node(j)
        if d == 0.0:
            return seen[EXPECTED, j]
        w /= d if j % 2 == 0 else -d
        above += w * seen[EXPECTED, j]
        below += w
    return above / below


@formula
def sample(S, W, k, law, t, h, x, seen):
    """Value of a law at a place in the step; of drivers' the second derivative, which is what asks for force."""
    nm = measured(S)
    s = t + x * h
    for m in range(nm):
        seen[WITHIN, m], seen[WITHIN, nm + m] = between(seen, m, x, h)
    made = W.made[SAMPLED]
    if k >= LAWS * S.forces.F.shape[0]:
        if made != 0:
            return run(S.flat[made + k], S, W, s, seen[WITHIN], seen[WITHIN], seen[WITHIN], seen[WITHIN])
        return evaluate_jet(S.code, S.const, law, W.stack, s, seen, BY_TIME)[2]
    a, b = between(seen, nm + k // LAWS, x, h)
    if made != 0:
        W.flat[LAW_INPUT], W.flat[LAW_INPUT_RATE] = a, b
        return run(S.flat[made + k], S, W, s, seen[WITHIN], seen[WITHIN], seen[WITHIN], seen[WITHIN])
    return evaluate(S.code, S.const, law, W.stack, (s, a, b), seen)


@formula
def between(seen, m, x, h):
    """Value and rate of column m at a place in the step: the cubic through value and rate at its ends."""
    f, g, u, v = seen[FROM, m], seen[TO, m], seen[FROM_RATE, m] * h, seen[TO_RATE, m] * h
    a = 2.0 * (f - g) + u + v
    b = 3.0 * (g - f) - 2.0 * u - v
    return f + x * (u + x * (b + x * a)), (u + x * (2.0 * b + 3.0 * x * a)) / (h if h > 0.0 else 1.0)
