"""Mechanisms with sampled controllers: linear equations from one sampling instant to the next, and root loci.

Between sampling instants x' = A x + B u, with the held signals among the states. At an instant signals are updated one
after the other, then all states at once. Over one period this is the zero-order-hold model (Astrom and Wittenmark,
*Computer-Controlled Systems*, 1997, sections 2.3 and 8.4).

A deviation is multiplied by the eigenvalues z of the matrix of one cycle; it dies away where all are within the unit
circle. A multiplier that crosses the circle at 1 belongs to a deviation that grows monotonically, at -1 to one that
changes sign from cycle to cycle, elsewhere to an oscillation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..derivatives.eigenvalues import Spectrum, spectrum
from ..derivatives.linearized_equations import MatrixUncertainty
from ..errors import AnalysisError, ModelError
from ..progress import ReportProgress
from ..results.linear_model import StateSpaceForm
from ..results.modes import Crossing, RootLocus, outside_circle

PERIOD_TOLERANCE = 1e-9  # relative deviation allowed from a common period
MAX_INSTANTS = 10_000  # largest denominator of a ratio of periods, and largest number of instants in a cycle
# Largest deviation of a held value from its law at rest, relative to its size or a large change of it.
SETTLED_TOLERANCE = 1e-6

EXPONENTIAL_ROUNDING = (
    4.0 * np.finfo(float).eps
)  # uncertainty of matrix exponentials, relative to the largest entry of a row


class SampledSignal(NamedTuple):
    """A sampled signal or state.

    Attributes
    ----------
    name : str
        Name of the state of the linear equations that stores its held value.
    output : int
        Index of the output of the linear equations with the value of its law.
    clock : tuple of float
        Period and offset [s].
    signal : bool
        Whether it is a signal, which is updated before the states of the same instant.
    """

    name: str
    output: int
    clock: tuple[float, float]
    signal: bool


def sampling_instants(
    clocks: Sequence[tuple[float, float]],
) -> tuple[float, list[tuple[float, list[tuple[float, float]]]]]:
    """Length of the cycle [s], and its instants with the clocks that sample at each.

    Raises
    ------
    ModelError
        If periods have no common multiple.
    """
    clocks = sorted(set(clocks))
    least = min(period for period, _ in clocks)
    parts = [Fraction(period / least).limit_denominator(MAX_INSTANTS) for period, _ in clocks]
    for (period, _), part in zip(clocks, parts, strict=True):
        if abs(float(part) * least - period) > PERIOD_TOLERANCE * least:
            raise ModelError(
                f"periods {least:g} s and {period:g} s of sampled controllers have no common multiple, so that there "
                f"is no cycle from which to tell small motions; give one that is a simple multiple of the other"
            )
    whole = math.lcm(*(p.numerator for p in parts)) // math.gcd(*(p.denominator for p in parts))
    whole = next(n for n in (whole * k for k in range(1, MAX_INSTANTS)) if all((n / p).denominator == 1 for p in parts))
    cycle = least * whole
    if sum(round(cycle / period) for period, _ in clocks) > MAX_INSTANTS:
        raise ModelError(
            f"the cycle of the sampled controllers is {cycle:g} s long, with more than {MAX_INSTANTS} instants"
        )
    first = min(offset for _, offset in clocks)
    due = sorted(
        ((offset - first) % period + k * period, clock)
        for clock in clocks
        for period, offset in [clock]
        for k in range(round(cycle / period))
    )
    found: list[tuple[float, list[tuple[float, float]]]] = []
    for t, clock in due:
        if found and t - found[-1][0] <= PERIOD_TOLERANCE * least:
            found[-1][1].append(clock)
        elif cycle - t > PERIOD_TOLERANCE * least:
            found.append((t, [clock]))
        else:  # equal to the start of the cycle, within rounding
            found[0][1].append(clock)
    return cycle, found


def refuse_unsettled(
    samples: Sequence[SampledSignal], at: np.ndarray, law: np.ndarray, sizes: np.ndarray, name: str
) -> None:
    """Refuse a state in which a held value changes at the next sample; ``sizes`` are its large changes."""
    for s, held, next_one, size in zip(samples, at.tolist(), law.tolist(), sizes.tolist(), strict=True):
        if not abs(next_one - held) <= SETTLED_TOLERANCE * max(size, abs(held)):
            raise ModelError(
                f"{name!r} does not rest there: {s.name!r} is {held:.6g}, and {next_one:.6g} when it is sampled next; "
                f"ask about an equilibrium, about=m.equilibrium(), or about the end of a motion that has settled"
            )


def cycle_equations(
    space: StateSpaceForm, samples: Sequence[SampledSignal], outputs: int
) -> tuple[StateSpaceForm, Spectrum, float]:
    """Difference equations over one cycle, their eigenvalues (multipliers), and the length of the cycle [s].

    The state is that just before the first instant of the cycle; outputs and inputs are those just after it. See
    `SampledSignal`.
    """
    cycle, due = sampling_instants([s.clock for s in samples])
    n, m = len(space.A), space.B.shape[1]
    X = np.hstack([np.eye(n), np.zeros((n, m))])
    U = np.hstack([np.zeros((m, n)), np.eye(m)])
    C = np.hstack([space.C[:outputs], space.D[:outputs]])
    for k, (t, clocks) in enumerate(due):
        for own in _update_groups([s for s in samples if s.clock in clocks]):
            at = [space.states.index(s.name) for s in own]
            laws = [s.output for s in own]
            X[at] = space.C[laws] @ X + space.D[laws] @ U
        if k == 0:
            Y = C[:, :n] @ X + C[:, n:] @ U
        X = _advanced_by_exponential(space, (due[k + 1][0] if k + 1 < len(due) else cycle) - t, X, U)
    A, B = X[:, :n], X[:, n:]
    left = _needed_states(A, Y[:, :n], [space.states.index(s.name) for s in samples])
    names = tuple(space.states[i] for i in left)
    out = replace(
        space, A=A[np.ix_(left, left)], B=B[left], C=Y[:, left], D=Y[:, n:], states=names,
        state_units=tuple(space.state_units[i] for i in left), motion=space.motion[:, left],
    )  # fmt: skip
    rounded = EXPONENTIAL_ROUNDING * np.abs(out.A).max(axis=1, keepdims=True, initial=0.0) * np.ones(len(left))
    found = spectrum(out.A, MatrixUncertainty(np.eye(len(left)), rounded, np.ones(len(left))))
    return replace(out, eigenvalues=found.values), found, cycle


def _update_groups(due: list[SampledSignal]) -> Iterator[list[SampledSignal]]:
    """Groups that are updated together: each signal by itself, then all states."""
    yield from ([s] for s in due if s.signal)
    yield [s for s in due if not s.signal]


def _advanced_by_exponential(space: StateSpaceForm, h: float, X: np.ndarray, U: np.ndarray) -> np.ndarray:
    """Advance the state by a time ``h`` with constant inputs."""
    from scipy.linalg import expm

    n, m = space.B.shape
    E = expm(h * np.block([[space.A, space.B], [np.zeros((m, n + m))]]))
    return np.asarray(E[:n, :n] @ X + E[:n, n:] @ U)


def _needed_states(A: np.ndarray, C: np.ndarray, held: Sequence[int]) -> np.ndarray:
    """Indices of states without unused held ones: signals that are sampled anew at the start of the cycle."""
    left = np.ones(len(A), bool)
    while True:
        gone = [i for i in held if left[i] and not A[left, i].any() and not C[:, i].any()]
        if not gone:
            return np.flatnonzero(left)
        left[gone] = False


ROOT_TOLERANCE = 1e-13  # relative to the interval between two values
ON_REAL_AXIS = 1e-9  # imaginary part, relative to the multiplier, that counts as none
MAX_BISECTIONS = 48

CycleMatrix = Callable[[float], np.ndarray]
LocusFailure = Callable[[RootLocus, float, AnalysisError], Exception]


def sampled_root_locus(
    done: RootLocus, points: np.ndarray, matrix: CycleMatrix, failure: LocusFailure, report: ReportProgress
) -> RootLocus:
    """Complete a locus: branches of the multipliers at the values of the parameter, and the changes of stability.

    Parameters
    ----------
    done : RootLocus
        Without values; its ``period`` is that of one cycle.
    points : ndarray (m,)
        Values of the parameter.
    matrix : callable
        Returns the matrix of one cycle for a value.
    failure : callable
        Returns the error to raise for an `AnalysisError` at a value.
    report : callable
    """
    rows: list[np.ndarray] = []
    for k, value in enumerate(points.tolist()):
        try:
            w = np.linalg.eigvals(matrix(value)).astype(complex)
            if rows and len(w) != len(rows[0]):
                raise AnalysisError(f"there are {len(w)} states, and {len(rows[0])} at the values before")
        except AnalysisError as error:
            raise failure(done, value, error) from error
        rows.append(w[_continued(rows[-1], w)] if rows else w[np.lexsort((w.real, w.imag))])
        done.values, done.eigenvalues = points[: k + 1], np.array(rows)
        done.path_values, done.path = done.values, done.eigenvalues
        report(0.7 * (k + 1) / len(points), f"{value:.6g}")
    for a, b in pairwise(points.tolist()):
        try:
            done.crossings += _crossings(matrix, a, b)
        except AnalysisError as error:
            raise failure(done, a, error) from error
    report(1.0, "")
    return done


def _continued(before: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Indices of the multipliers that continue those before, by the least sum of distances."""
    from scipy.optimize import linear_sum_assignment

    return linear_sum_assignment(np.abs(before[:, None] - w))[1]


def _crossings(matrix: CycleMatrix, a: float, b: float) -> list[Crossing]:
    """Changes of stability between two values, by bisection to intervals in which one branch crosses the circle."""
    out = []
    waiting = [(a, b, 0)]
    while waiting:
        a, b, depth = waiting.pop()
        here, there = (np.linalg.eigvals(matrix(x)) for x in (a, b))
        change = int(outside_circle(there).sum()) - int(outside_circle(here).sum())
        on = _continued(here, there)
        moved = np.flatnonzero(outside_circle(here) != outside_circle(there[on]))
        if not len(moved) or (change == 0 and depth == MAX_BISECTIONS):
            continue
        alone = len(moved) == 1 or (len(moved) == 2 and _is_pair(here[moved]) and _is_pair(there[on][moved]))
        if alone or depth == MAX_BISECTIONS:
            outside = max(int(outside_circle(w).sum()) for w in (here, there))
            out.append(_located(matrix, (a, b), outside, change))
            continue
        middle = 0.5 * (a + b)
        waiting += [(middle, b, depth + 1), (a, middle, depth + 1)]
    return out


def _is_pair(w: np.ndarray) -> bool:
    return bool(abs(w[0] - w[1].conjugate()) <= ON_REAL_AXIS * abs(w[0]))


def _located(matrix: CycleMatrix, between: tuple[float, float], outside: int, change: int) -> Crossing:
    """The value at which the multiplier of that rank in size, or the pair that ends with it, crosses the unit circle.

    ``outside`` is the larger number of multipliers outside the circle at the ends: the size of that rank is a
    continuous function, above 1 at one end and not at the other.
    """
    from scipy.optimize import brentq

    a, b = between

    def ranked(x: float) -> complex:
        w = np.linalg.eigvals(matrix(x))
        return complex(w[np.argsort(-np.abs(w))[outside - 1]])

    def distance(x: float) -> float:
        return abs(ranked(x)) - 1.0

    ends = distance(a), distance(b)
    if ends[0] * ends[1] > 0.0:  # on the circle but for rounding at one end
        value = a if abs(ends[0]) < abs(ends[1]) else b
    else:
        value = float(brentq(distance, a, b, xtol=ROOT_TOLERANCE * abs(b - a), rtol=1e-14))
    z = ranked(value)
    if abs(z.imag) > ON_REAL_AXIS * abs(z):
        return Crossing(value, complex(z.real, abs(z.imag)), "flutter", change)
    return Crossing(value, complex(z.real), "divergence" if z.real > 0.0 else "alternation", change)
