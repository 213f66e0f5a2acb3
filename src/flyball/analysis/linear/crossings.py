"""Where eigenvalues pass from one half plane into the other, and where they meet.

Eigenvalues themselves are no smooth functions where they meet: there they move as a square root does. What is smooth
are symmetric functions of those that meet, such as the square of half their difference (Kato 1966, II.1). So an event
is first bracketed by counting eigenvalues by where they lie, then found as the zero of the smooth function that belongs
to it:

    a real one through zero           itself
    a pair through the imaginary axis its real part
    a pair on the axis parts at zero  (half the difference)^2, from -w^2 to +s^2
    two pairs on the axis meet        (half the difference)^2, from -d^2 to +s^2 (Krein collision)
    two real ones become a pair       (half the difference)^2

Zeros that are always there, of motions that nothing holds, are left out of it: what is near them is found from sums
over all that are near zero.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .sample import Sample, match

EXACT = 1e-14  # of the stretch between two values, and of the value
BISECTED = 48  # halvings after which what is left is taken for one event
TRIED = 200  # evaluations between two values, after which only the change of stability is sought
LEFT = 1e-6  # of what it is at the ends: what a smooth function may be at its zero
UNEVEN = 0.4375  # where a stretch is parted: not where a round value is likely to lie

EVENTS = {  # change of counts -> what happens
    "a real one through zero": Counter({"+real": 1, "-real": -1}),
    "a pair through the axis": Counter({"+pair": 1, "-pair": -1}),
    "parting at zero": Counter({"axis": -1, "+real": 1, "-real": 1}),
    "pairs meet": Counter({"axis": -2, "+pair": 1, "-pair": 1}),
    "+ real ones meet": Counter({"+real": -2, "+pair": 1}),
    "- real ones meet": Counter({"-real": -2, "-pair": 1}),
}


@dataclass
class Event:
    """A change of where eigenvalues lie: at ``at``, between ``before`` and ``after``."""

    what: str
    at: Sample
    eigenvalue: complex
    before: Sample
    after: Sample

    @property
    def change(self) -> int:
        """How many eigenvalues more have a positive real part after it."""
        return self.after.growing - self.before.growing


class Search:
    """Finds events between samples.

    Parameters
    ----------
    at : callable
        Takes a sample at a place.
    always : int
        How many eigenvalues are zero at all values.
    """

    def __init__(self, at: Callable[[float], Sample], always: int) -> None:
        self.take, self.always = at, always
        self.taken: list[Sample] = []

    def at(self, place: float) -> Sample:
        """A sample at a place; all are kept."""
        found = next((x for x in self.taken if x.place == place), None)
        if found is None:
            found = self.take(place)
            self.taken.append(found)
        return found

    def between(self, a: Sample, b: Sample) -> list[Event]:
        """All events between two samples."""
        return self._parted(a, b, len(self.taken), 0)

    def _parted(self, a: Sample, b: Sample, before: int, depth: int) -> list[Event]:
        if a.counts == b.counts:
            return []
        tired = len(self.taken) - before > TRIED
        if tired and a.growing == b.growing:
            return []
        what = _what(a, b)
        found = None if what is None else self._found(what, a, b)
        if found is not None:
            return [found]
        if depth == BISECTED or b.place - a.place <= EXACT * max(1.0, b.place):
            return [_left(a, b)]
        middle = self.at(a.place + UNEVEN * (b.place - a.place))
        if tired:
            near = (a, middle) if a.growing != middle.growing else (middle, b)
            return self._parted(*near, before, depth + 1)
        return self._parted(a, middle, before, depth + 1) + self._parted(middle, b, before, depth + 1)

    def _found(self, what: str, a: Sample, b: Sample) -> Event | None:
        """The event, from its smooth function; None if it has not the zero that it should."""
        from scipy.optimize import brentq

        of = self._alone(a, b) if "through" in what else self._meeting(what, a, b)
        if of is None:
            return None
        f0, f1 = of(a)[0], of(b)[0]
        if f0 * f1 > 0.0 or (f0 == 0.0 and f1 == 0.0):
            return None
        x0, x1 = a.place, b.place
        place = float(brentq(lambda x: of(self.at(x))[0], x0, x1, xtol=EXACT * max(1.0, x1), rtol=EXACT))
        at = self.at(place)
        left, value = of(at)
        if abs(left) > LEFT * max(abs(f0), abs(f1)):
            return None
        return Event(what, at, value, a, b)

    def _alone(self, a: Sample, b: Sample) -> Callable[[Sample], tuple[float, complex]] | None:
        """Real part of the one eigenvalue that changes sides, and it."""
        on = match(a, b)
        sides = a.w.real * b.w[on].real
        ones = np.flatnonzero((sides < 0.0) & (a.w.imag >= 0.0) & (b.w[on].imag >= 0.0))
        if len(ones) != 1:
            return None
        known = {a.place: complex(a.w[ones[0]]), b.place: complex(b.w[on[ones[0]]])}

        def of(x: Sample) -> tuple[float, complex]:
            if x.place not in known:
                candidates = np.argsort(np.abs(x.raw))[self.always :]
                k = int(candidates[np.argmin(np.abs(x.raw[candidates] - _between(known, x.place)))])
                value = complex(x.raw[k])
                if x.w[k] == 0.0:  # it cannot be told from those that are always zero, but their sum can
                    value = complex(x.raw[x.w == 0.0].sum().real)
                known[x.place] = value
            value = known[x.place]
            return value.real, complex(0.0, abs(value.imag))

        return of

    def _meeting(self, what: str, a: Sample, b: Sample) -> Callable[[Sample], tuple[float, complex]] | None:
        """The square of half the difference of two eigenvalues that meet, and their mean."""
        if what == "parting at zero":

            def near_zero(x: Sample) -> tuple[float, complex]:
                w = x.raw[np.argsort(np.abs(x.raw))[: self.always + 2]]
                return float((w * w).sum().real / 2.0), 0j

            return near_zero
        pair = _pair(what, a, b)
        if pair is None:
            return None
        known = {x.place: complex(w.mean()) for x, w in zip((a, b), pair, strict=True)}

        def of(x: Sample) -> tuple[float, complex]:
            mean = known.get(x.place)
            if mean is None:
                mean = _between(known, x.place)
            w = x.raw[np.argsort(np.abs(x.raw - mean))[:2]]
            known.setdefault(x.place, complex(w.mean()))
            upper = complex(0.0, abs(w.mean().imag)) if what == "pairs meet" else complex(w.mean().real)
            return float((((w[0] - w[1]) / 2.0) ** 2).real), upper

        return of


def _what(a: Sample, b: Sample) -> str | None:
    """The one event that makes of one sample's counts the other's, if there is one."""
    change = Counter(b.counts)
    change.subtract(a.counts)
    change = Counter({k: n for k, n in change.items() if n})
    for what, own in EVENTS.items():
        if change in (own, Counter({k: -n for k, n in own.items()})):
            return what
    return None


def _pair(what: str, a: Sample, b: Sample) -> tuple[np.ndarray, np.ndarray] | None:
    """The two eigenvalues that meet, at both ends."""
    apart, pair = ("axis", "+pair") if what == "pairs meet" else (f"{what[0]}real", f"{what[0]}pair")
    here, there = (a, b) if a.counts.get(apart, 0) > b.counts.get(apart, 0) else (b, a)
    on = match(here, there)
    kinds = there.kinds[on]
    gone = ("+pair", "-pair") if what == "pairs meet" else (pair, "")
    ones = np.flatnonzero((here.kinds == apart) & np.isin(kinds, gone))
    if len(ones) != 2:
        return None
    found = here.w[ones], there.w[on[ones]]
    return found if here is a else (found[1], found[0])


def _between(known: dict[float, complex], place: float) -> complex:
    """An eigenvalue as it follows from those known on both sides."""
    low, high = max(k for k in known if k < place), min(k for k in known if k > place)
    return known[low] + (place - low) / (high - low) * (known[high] - known[low])


def _left(a: Sample, b: Sample) -> Event:
    """Several events that cannot be told apart, or one that is no zero of anything smooth."""
    more = a if a.growing > b.growing else b
    ones = more.w[np.isin(more.kinds, ("+real", "+pair"))]
    value = complex(ones[np.argmin(np.abs(ones.real))]) if len(ones) else 0j
    return Event("several", b, complex(0.0, value.imag), a, b)
