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

from .passing import SLOWER, passing
from .sample import Sample, match

EXACT = 1e-14  # of the stretch between two values, and of the value
BISECTED = 48  # halvings after which what is left is taken for one event
TRIED = 200  # evaluations between two values, after which only the change of stability is sought
LEFT = 1e-6  # of what it is at the ends: what a smooth function may be at its zero
UNEVEN = (0.4375, 0.609375, 0.234375)  # where a stretch is parted: not where a round value is likely to lie

BESIDE = (1e-6, 1e-3)  # parts of a stretch that are next to its end
STEADY = 0.1  # by what part of itself the slope of a real part may differ between these
WRONG = 6  # halvings in which eigenvalues that seem to change places with others are followed

MEETINGS = {  # what happens -> change of counts, of how many eigenvalues with a positive real part
    "parting at zero": ({"axis": -1, "+real": 1, "-real": 1}, 1),
    "pairs meet": ({"axis": -2, "+pair": 1, "-pair": 1}, 2),
    "+ real ones meet": ({"+real": -2, "+pair": 1}, 0),
    "- real ones meet": ({"-real": -2, "-pair": 1}, 0),
}

Smooth = Callable[[Sample], tuple[float, complex]]  # a function that is zero at an event, and the eigenvalue


@dataclass
class Event:
    """A change of where eigenvalues lie, and how many more have a positive real part after it."""

    what: str
    at: Sample
    eigenvalue: complex
    change: int


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
        before = len(self.taken)
        at_a, low = self._end(a, b)
        at_b, high = self._end(b, a)
        return at_a + (self._parted(low, high, before, 0) if low.place < high.place else []) + at_b

    def _end(self, x: Sample, y: Sample) -> tuple[list[Event], Sample]:
        """Events at the very end x of the stretch to y, and a sample beyond them."""
        found = self._at_end(x, y)
        more = abs(sum(e.change for e in found))
        for part in (*BESIDE, *UNEVEN[::-1]) if found else ():
            beyond = self.at(x.place + part * (y.place - x.place))
            if beyond.growing == x.growing + more:
                return found, beyond
        return found, y if found else x

    def _parted(self, a: Sample, b: Sample, before: int, depth: int) -> list[Event]:
        through = _through(a, b)
        tired = len(self.taken) - before > TRIED
        if a.counts == b.counts and (not through or depth > WRONG or tired):
            return []
        if tired and a.growing == b.growing:
            return []
        found = self._alone(a, b, through) if _explained(a, b, through) else self._met(a, b)
        if found:
            return found
        if depth == BISECTED or b.place - a.place <= EXACT * max(1.0, b.place):
            return [_left(a, b)] if a.growing != b.growing else []
        middle = self._middle(a, b)
        if tired:
            near = (a, middle) if a.growing != middle.growing else (middle, b)
            return self._parted(*near, before, depth + 1)
        return self._parted(a, middle, before, depth + 1) + self._parted(middle, b, before, depth + 1)

    def _at_end(self, x: Sample, y: Sample) -> list[Event]:
        """What begins to grow, or ceases to, at the very end x of the stretch to y."""
        there = np.isin(x.kinds, ("axis", "zero"))
        on = match(x, y)
        ones = np.flatnonzero(there & np.isin(y.kinds[on], ("+pair", "+real")))
        found = [(complex(0.0, abs(x.w[k].imag)), 2 if y.kinds[on[k]] == "+pair" else 1) for k in ones]
        if not found or not self._leaves(x, y, ones, sum(n for _, n in found)):
            return []
        more = 1 if y.place > x.place else -1
        return [Event("at the end", x, w, n * more) for w, n in found]

    def _leaves(self, x: Sample, y: Sample, ones: np.ndarray, growing: int) -> bool:
        """Whether eigenvalues leave the axis at x: as many grow next to it, or their real parts change evenly."""
        next_to, near = (self.at(x.place + part * (y.place - x.place)) for part in BESIDE)
        if next_to.growing == x.growing + growing:
            return True
        at = [k.raw.real[match(x, k)[ones]] - x.raw.real[ones] for k in (next_to, near, y)]
        slope, usual = at[0] / BESIDE[0], at[1] / BESIDE[1]
        even = (usual > SLOWER * at[2]) & (np.abs(slope - usual) <= STEADY * usual)
        return bool((even & (y.kinds[match(x, y)[ones]] == "+pair")).all())

    def _middle(self, a: Sample, b: Sample) -> Sample:
        """A sample between two, none of whose eigenvalues is on its way through the axis if that can be."""
        for part in UNEVEN:
            found = self.at(a.place + part * (b.place - a.place))
            if not passing((a, found, b))[1]:
                break
        return found

    def _zero(self, of: Smooth, a: Sample, b: Sample) -> tuple[Sample, complex] | None:
        """Where a smooth function is zero, and the eigenvalue there; None if it has not the zero that it should."""
        from scipy.optimize import brentq

        f0, f1 = of(a)[0], of(b)[0]
        if f0 * f1 > 0.0 or (f0 == 0.0 and f1 == 0.0):
            return None
        x0, x1 = a.place, b.place
        place = float(brentq(lambda x: of(self.at(x))[0], x0, x1, xtol=EXACT * max(1.0, x1), rtol=EXACT))
        at = self.at(place)
        left, value = of(at)
        return None if abs(left) > LEFT * max(abs(f0), abs(f1)) else (at, value)

    def _alone(self, a: Sample, b: Sample, through: list[tuple[complex, complex]]) -> list[Event] | None:
        """Eigenvalues that change sides, each by itself; None if one has not the zero that it should."""
        out = []
        for w0, w1 in through:
            found = self._zero(self._followed({a.place: w0, b.place: w1}), a, b)
            if found is None:
                return None
            out.append(Event("through", *found, int(np.sign(w1.real)) * (2 if w1.imag else 1)))
        return out

    def _met(self, a: Sample, b: Sample) -> list[Event] | None:
        """Two eigenvalues that meet, if that is all that happens."""
        for what, (counts, more) in MEETINGS.items():
            for sign in (1, -1):
                if _changed(a, b) == {k: sign * n for k, n in counts.items()}:
                    of = self._meeting(what, a, b)
                    found = None if of is None else self._zero(of, a, b)
                    return None if found is None else [Event(what, *found, sign * more)]
        return None

    def _followed(self, known: dict[float, complex]) -> Smooth:
        """Real part of an eigenvalue that is known at some places, and where it is on the axis."""

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

    def _meeting(self, what: str, a: Sample, b: Sample) -> Smooth | None:
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
            moving = x.raw[np.argsort(np.abs(x.raw))[self.always :]]
            w = moving[np.argsort(np.abs(moving - mean))[:2]]
            known.setdefault(x.place, complex(w.mean()))
            upper = complex(0.0, abs(w.mean().imag)) if what == "pairs meet" else complex(w.mean().real)
            return float((((w[0] - w[1]) / 2.0) ** 2).real), upper

        return of


def _changed(a: Sample, b: Sample) -> dict[str, int]:
    """How many eigenvalues more lie where, in b than in a."""
    change = Counter(b.counts)
    change.subtract(a.counts)
    return {k: n for k, n in change.items() if n}


def _through(a: Sample, b: Sample) -> list[tuple[complex, complex]]:
    """Eigenvalues, one of each pair, that go on as such with a real part of the other sign: (in a, in b)."""
    on = match(a, b)
    alike = np.isin(a.kinds, ("+real", "-real")) == np.isin(b.kinds[on], ("+real", "-real"))
    signs = ("+real", "-real", "+pair", "-pair")
    moved = np.isin(a.kinds, signs) & np.isin(b.kinds[on], signs) & alike & (a.w.real * b.w[on].real < 0.0)
    return [(complex(a.w[k]), complex(b.w[on[k]])) for k in np.flatnonzero(moved)]


def _explained(a: Sample, b: Sample, through: list[tuple[complex, complex]]) -> bool:
    """Whether eigenvalues that change sides are all that changes."""
    change: Counter[str] = Counter()
    for w0, w1 in through:
        what = "pair" if w0.imag else "real"
        change.update({("+" if w.real > 0.0 else "-") + what: n for w, n in ((w0, -1), (w1, 1))})
    return bool(through) and {k: n for k, n in change.items() if n} == _changed(a, b)


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
    grows = ("+real", "+pair")
    on = match(more, a if more is b else b)
    ones = more.w[np.isin(more.kinds, grows) & ~np.isin((a if more is b else b).kinds[on], grows)]
    value = complex(ones[np.argmin(np.abs(ones.real))]) if len(ones) else 0j
    return Event("several", b, complex(0.0, value.imag), b.growing - a.growing)
