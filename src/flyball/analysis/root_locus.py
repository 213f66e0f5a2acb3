"""Root loci: eigenvalues over a parameter of the model, and the values at which stability changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..errors import AnalysisError, ModelError
from ..model.model import Model
from ..results.equilibrium import Equilibrium
from ..results.root_locus import Crossing, RootLocus
from .equilibria import EquilibriaOptions, checked, equilibria, stopped
from .equilibrium import equilibrium, resting
from .linear.crossings import Event, Search
from .linear.in_bodies import in_bodies
from .linear.passing import passing
from .linear.sample import Sample, match, sample
from .linear.sliders import of_states_only, refuse_sampled
from .linearize import InstantOptions, without_inputs
from .progress import Tell, shown
from .untouched import refuse_contact

SAME = 1e-9  # of the stretch between two values: events closer together at one eigenvalue are one
ROUNDED = 1e-13  # of the largest value: what is none
ASIDE = (0.25, 0.0625, 0.015625, 0.00390625)  # of the way to the next value: samples beside where branches meet
SOON = 2.0  # stretches between values: eigenvalues that are one, and apart again within these, only meet
MEETINGS = 16  # places where branches meet that are shown finely


@dataclass(frozen=True, kw_only=True)
class RootLocusOptions(InstantOptions):
    """What `Mechanism.root_locus` is asked."""

    parameter: str
    values: Sequence[float] | np.ndarray
    equilibrium: bool
    progress: bool | Callable[[float], None]

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.about, Equilibrium):
            raise ModelError("root_locus: an equilibrium is one of its own parameters; say equilibrium=True instead")
        if self.about is not None and self.equilibrium:
            raise ModelError("root_locus: say either about or equilibrium=True, which places the mechanism itself")
        if self.frozen and self.equilibrium:
            raise ModelError("root_locus: frozen does nothing where nothing moves: leave out frozen or equilibrium")

    def here(self, value: float, about: Equilibrium | None) -> InstantOptions:
        """Where the mechanism is at a value; at an equilibrium if that is given."""
        t, parameters = self.t, dict(self.parameters or {})
        if self.parameter == "t":
            t = value
        else:
            parameters[self.parameter] = float(value)
        return InstantOptions(
            about=self.about if about is None else about,
            t=t if about is None else None,
            parameters=parameters,
            coordinates=self.coordinates,
            frozen=self.frozen,
        )

    def rest(self, values: Sequence[float] | np.ndarray, start: Equilibrium | None = None) -> EquilibriaOptions:
        """What is asked for the equilibria at values."""
        return EquilibriaOptions(
            parameter=self.parameter,
            values=values,
            t=self.t or 0.0,
            parameters=self.parameters,
            start=start,
            stable=False,
            progress=False,
        )


def root_locus(model: Model, o: RootLocusOptions) -> RootLocus:
    """Eigenvalues over values of a parameter, as branches, and where stability changes: see `Mechanism.root_locus`."""
    refuse_contact(model, "root_locus", controlled=True)
    refuse_sampled(model, "root_locus")
    points = checked(model, o.parameter, o.values, o.t, o.parameters)
    rest = (_Controlled if model.controllers else _Series)(model, o, points)

    def at(place: float) -> Sample:
        value = float(np.interp(place, np.arange(len(points)), points))
        about = rest.at(place, value) if o.equilibrium else None
        here = o.here(value, about)
        if not model.controllers:
            return sample(place, value, *without_inputs(here.state(model), o.frozen))
        d = in_bodies(model, here.state(model), o.coordinates, (), frozen=o.frozen)
        with d.in_own_words():
            f, frame, r = without_inputs(d.state, o.frozen, off=d.off)
        return sample(place, value, f, frame, of_states_only(r, f, d.other.slides))

    done = RootLocus(model.name, o.parameter, points[:0], np.zeros((0, 0), complex))
    with shown(o.progress, f"eigenvalues over {o.parameter}") as tell:
        return _traced(done, points, at, tell)


class _Series:
    """Equilibria at the values and between them, along one branch."""

    def __init__(self, model: Model, o: RootLocusOptions, points: np.ndarray) -> None:
        self.model, self.o = model, o
        self.along = equilibria(model, o.rest(points)) if o.equilibrium else None

    def at(self, place: float, value: float) -> Equilibrium:
        """The equilibrium at a place among the values."""
        assert self.along is not None
        about = self.along[int(place)]
        if place == int(place):
            return about
        return equilibria(self.model, self.o.rest([self.along.values[int(place)], value], about))[1]


class _Controlled:
    """The same with controllers: each search begins at the nearest one that is known."""

    def __init__(self, model: Model, o: RootLocusOptions, points: np.ndarray) -> None:
        self.model, self.o, self.known = model, o, dict[float, Equilibrium]()

    def at(self, place: float, value: float) -> Equilibrium:
        """The equilibrium at a place among the values."""
        if place not in self.known:
            near = min(self.known, key=lambda k: abs(k - place), default=None)
            here = self.o.here(value, None)
            start = None if near is None else self.known[near]
            self.known[place] = equilibrium(self.model, resting(here.t or 0.0, here.parameters, start))
        return self.known[place]


def _traced(done: RootLocus, points: np.ndarray, at: Callable[[float], Sample], tell: Tell) -> RootLocus:
    """The locus at the values, then between them."""
    taken: list[Sample] = []
    for k, value in enumerate(points):
        try:
            taken.append(at(float(k)))
            if len(taken[k].w) != len(taken[0].w):
                raise AnalysisError(f"there are {len(taken[k].w)} states, and {len(taken[0].w)} at the values before")
        except AnalysisError as error:
            raise stopped(done, value, error) from error
        _told(done, taken)
        tell(0.5 * (k + 1) / len(points), f"{value:.6g}")
    search = Search(at, min(x.counts.get("zero", 0) for x in taken))
    search.taken = list(taken)
    events = _events(search, taken, tell)
    done.crossings = _crossings(events, taken)
    _refined(search, [e for e in events if "meet" in e.what or "part" in e.what], taken)
    _told(done, search.taken)
    tell(1.0, "")
    return done


def _told(done: RootLocus, taken: Sequence[Sample]) -> None:
    """Write samples as branches."""
    order = sorted(taken, key=lambda x: x.place)
    base, last = order[0], np.lexsort((order[0].w.real, order[0].w.imag))
    rows = [base.w[last]]
    for k, x in enumerate(order[1:], 1):
        own = match(base, x)[last]
        rows.append(x.w[own])
        if not _met(base, x, order[k + 1 :]):
            base, last = x, own
    done.path, done.path_values = np.array(rows), np.array([x.value for x in order])
    given = [k for k, x in enumerate(order) if x.place == int(x.place)]
    done.values, done.eigenvalues = done.path_values[given], done.path[given]
    done.seen_from = tuple(dict.fromkeys(x.told for x in order if x.told))


def _met(base: Sample, x: Sample, later: Sequence[Sample]) -> bool:
    """Whether eigenvalues that are apart before and soon after are one at a sample, where none has its own shape."""
    many = len(np.unique(x.w))
    if many >= len(np.unique(base.w)):
        return False
    return any(len(np.unique(y.w)) > many for y in later if y.place - base.place <= SOON)


def _events(search: Search, taken: Sequence[Sample], tell: Tell) -> list[Event]:
    """Events between the given values; those that lie on an event are passed over."""
    on = passing(taken)
    kept = [taken[0]]
    for k, x in enumerate(taken[1:], 1):
        if k == len(taken) - 1 or not (on[k] or _at_zero(kept[-1], x, taken[k + 1])):
            kept.append(x)
    _heading(search, kept)
    found = []
    for a, b in pairwise(kept):
        found += search.between(a, b)
        tell(0.5 + 0.5 * b.place / len(taken), "where stability changes")
    return found


def _at_zero(a: Sample, x: Sample, b: Sample) -> bool:
    """Whether more eigenvalues are zero at a sample than at either beside it."""
    before, here, after = (k.counts.get("zero", 0) for k in (a, x, b))
    return here > max(before, after)


def _heading(search: Search, kept: list[Sample]) -> None:
    """Add samples where a parabola through three real parts of a branch turns on the other side of the axis."""
    more = []
    for a, b, c in zip(kept, kept[1:], kept[2:], strict=False):
        if not a.counts == b.counts == c.counts:
            continue
        to, on = match(b, a), match(b, c)
        for k in range(len(b.w)):
            y = [a.w[to[k]].real, b.w[k].real, c.w[on[k]].real]
            if 0.0 in y:
                continue
            bend = np.polyfit([a.place - b.place, 0.0, c.place - b.place], y, 2)
            turn = -bend[1] / (2.0 * bend[0]) if bend[0] else np.inf
            if a.place < b.place + turn < c.place and np.polyval(bend, turn) * y[1] < 0.0:
                more.append(b.place + turn)
    for place in dict.fromkeys(more):
        kept.append(search.at(float(place)))
    kept.sort(key=lambda x: x.place)


def _crossings(events: Sequence[Event], taken: Sequence[Sample]) -> list[Crossing]:
    """Changes of stability, those at one place and eigenvalue as one."""
    fastest = max(float(np.abs(x.w).max(initial=0.0)) for x in taken)
    least = ROUNDED * max(abs(x.value) for x in taken)
    found: list[tuple[float, Crossing]] = []
    for e in sorted(events, key=lambda e: e.at.place):
        if not e.change:
            continue
        kind = "flutter" if e.eigenvalue.imag > 0.0 else "divergence"
        own = Crossing(e.at.value if abs(e.at.value) > least else 0.0, e.eigenvalue, kind, e.change)
        if found:
            place, other = found[-1]
            if e.at.place - place <= SAME and abs(other.eigenvalue - own.eigenvalue) <= SAME * fastest:
                found[-1] = place, other._replace(change=other.change + own.change)
                continue
        found.append((e.at.place, own))
    return [c for _, c in found if c.change]


def _refined(search: Search, events: Sequence[Event], taken: Sequence[Sample]) -> None:
    """Samples beside the places where branches meet: there they move as a square root does."""
    for e in events[:MEETINGS]:
        for side in (-1.0, 1.0):
            end = np.floor(e.at.place) if side < 0.0 else np.floor(e.at.place) + 1.0
            for part in ASIDE:
                search.at(float(e.at.place + part * (min(end, len(taken) - 1.0) - e.at.place)))
