"""Small motions of mechanisms with sampled controllers, from one cycle of instants to the next: exact, by exponentials.

Between instants x' = A x + B u, with what is held among the states and u held over the cycle; at an instant signals
take their values one after the other, then states all at once, each by the slopes of its law (Astrom and Wittenmark,
*Computer-Controlled Systems*, 1997, sections 2.3 and 8.4). Of one period that is the usual zero-order-hold model.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from ...errors import ModelError
from ...results.linear import StateSpace
from .rounding import Doubt
from .spectrum import Spectrum, spectrum

EXACT = 1e-9  # of a period: what periods may be off a common one
FINEST = 10_000  # common parts of a period, and instants of a cycle, at most
SETTLED = 1e-6  # part of its size, or of a large change of it, by which what is held is what its law says

ROUNDED = 4.0 * np.finfo(float).eps  # of the largest number of an equation: what exponentials leave uncertain


class Sample(NamedTuple):
    """A signal or a state that is taken at instants.

    Attributes
    ----------
    name : str
        Of the state of the linear equations that holds it.
    output : int
        Which output of the linear equations its law is.
    clock : tuple of float
        Period and offset [s].
    signal : bool
        Whether it is known before others of the same instant are.
    """

    name: str
    output: int
    clock: tuple[float, float]
    signal: bool


def instants(clocks: Sequence[tuple[float, float]]) -> tuple[float, list[tuple[float, list[tuple[float, float]]]]]:
    """Length of the cycle [s], and its instants from the first on, with the clocks that are due at each.

    Raises
    ------
    ModelError
        If periods have no common multiple.
    """
    clocks = sorted(set(clocks))
    least = min(period for period, _ in clocks)
    parts = [Fraction(period / least).limit_denominator(FINEST) for period, _ in clocks]
    for (period, _), part in zip(clocks, parts, strict=True):
        if abs(float(part) * least - period) > EXACT * least:
            raise ModelError(
                f"periods {least:g} s and {period:g} s of sampled controllers have no common multiple, so that there "
                f"is no cycle from which to tell small motions; give one that is a simple multiple of the other"
            )
    whole = math.lcm(*(p.numerator for p in parts)) // math.gcd(*(p.denominator for p in parts))
    whole = next(n for n in (whole * k for k in range(1, FINEST)) if all((n / p).denominator == 1 for p in parts))
    cycle = least * whole
    if sum(round(cycle / period) for period, _ in clocks) > FINEST:
        raise ModelError(f"the cycle of the sampled controllers is {cycle:g} s long, with more than {FINEST} instants")
    first = min(offset for _, offset in clocks)
    due = sorted(
        ((offset - first) % period + k * period, clock)
        for clock in clocks
        for period, offset in [clock]
        for k in range(round(cycle / period))
    )
    found: list[tuple[float, list[tuple[float, float]]]] = []
    for t, clock in due:
        if found and t - found[-1][0] <= EXACT * least:
            found[-1][1].append(clock)
        elif cycle - t > EXACT * least:
            found.append((t, [clock]))
        else:  # it begins the cycle but for rounding
            found[0][1].append(clock)
    return cycle, found


def refuse_unsettled(samples: Sequence[Sample], at: np.ndarray, law: np.ndarray, sizes: np.ndarray, name: str) -> None:
    """Refuse a state in which what is held is not what it will be; ``sizes`` are large changes of it."""
    for s, held, next_one, size in zip(samples, at.tolist(), law.tolist(), sizes.tolist(), strict=True):
        if not abs(next_one - held) <= SETTLED * max(size, abs(held)):
            raise ModelError(
                f"{name!r} does not rest there: {s.name!r} is {held:.6g}, and {next_one:.6g} when it is sampled next; "
                f"ask about an equilibrium, about=m.equilibrium(), or about the end of a motion that has settled"
            )


def over_a_cycle(space: StateSpace, samples: Sequence[Sample], outputs: int) -> tuple[StateSpace, Spectrum, float]:
    """The equations from the begin of one cycle to that of the next, their multipliers, its length [s]; see `Sample`.

    The state is that just before the first instant, outputs and inputs are those from this instant on.
    """
    cycle, due = instants([s.clock for s in samples])
    n, m = len(space.A), space.B.shape[1]
    X = np.hstack([np.eye(n), np.zeros((n, m))])
    U = np.hstack([np.zeros((m, n)), np.eye(m)])
    C = np.hstack([space.C[:outputs], space.D[:outputs]])
    for k, (t, clocks) in enumerate(due):
        for own in _one_after_the_other([s for s in samples if s.clock in clocks]):
            at = [space.states.index(s.name) for s in own]
            laws = [s.output for s in own]
            X[at] = space.C[laws] @ X + space.D[laws] @ U
        if k == 0:
            Y = C[:, :n] @ X + C[:, n:] @ U
        X = _passed(space, (due[k + 1][0] if k + 1 < len(due) else cycle) - t, X, U)
    A, B = X[:, :n], X[:, n:]
    left = _seen(A, Y[:, :n], [space.states.index(s.name) for s in samples])
    names = tuple(space.states[i] for i in left)
    out = replace(
        space, A=A[np.ix_(left, left)], B=B[left], C=Y[:, left], D=Y[:, n:], states=names,
        state_units=tuple(space.state_units[i] for i in left), motion=space.motion[:, left],
    )  # fmt: skip
    rounded = ROUNDED * np.abs(out.A).max(axis=1, keepdims=True, initial=0.0) * np.ones(len(left))
    found = spectrum(out.A, Doubt(np.eye(len(left)), rounded))
    return replace(out, eigenvalues=found.values), found, cycle


def _one_after_the_other(due: list[Sample]) -> Iterator[list[Sample]]:
    """Signals each for itself, then all states at once."""
    yield from ([s] for s in due if s.signal)
    yield [s for s in due if not s.signal]


def _passed(space: StateSpace, h: float, X: np.ndarray, U: np.ndarray) -> np.ndarray:
    """The state a time later, inputs being held."""
    from scipy.linalg import expm

    n, m = space.B.shape
    E = expm(h * np.block([[space.A, space.B], [np.zeros((m, n + m))]]))
    return np.asarray(E[:n, :n] @ X + E[:n, n:] @ U)


def _seen(A: np.ndarray, C: np.ndarray, held: Sequence[int]) -> np.ndarray:
    """States without those held ones that nothing depends on: signals that are taken anew as the cycle begins."""
    left = np.ones(len(A), bool)
    while True:
        gone = [i for i in held if left[i] and not A[left, i].any() and not C[:, i].any()]
        if not gone:
            return np.flatnonzero(left)
        left[gone] = False
