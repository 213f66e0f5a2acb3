"""Root loci: eigenvalues over a parameter as branches, and the values at which stability changes.

Branches are continued by eigenvalue and by mode shape (modal assurance criterion: Allemang and Brown 1982). Where
eigenvalues meet they are not smooth functions of the parameter: they move like a square root. Symmetric functions of
the eigenvalues that meet are smooth, such as the square of half their difference (Kato 1966, II.1). An event is
therefore first bracketed by counting the eigenvalues in each region of the complex plane, then found as the zero of
the smooth function that belongs to it:

    a real one through zero           the eigenvalue itself
    a pair through the imaginary axis its real part
    a pair on the axis parts at zero  (half the difference)^2, from -w^2 to +s^2
    two pairs on the axis meet        (half the difference)^2, from -d^2 to +s^2 (Krein collision)
    two real ones become a pair       (half the difference)^2

Eigenvalues that are always zero, of motions that nothing restrains, are left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import groupby, pairwise

import numpy as np

from ..derivatives.eigenvalues import spectrum
from ..derivatives.linearized_equations import FreeCoordinates, ReducedEquations, TurningFrame
from ..errors import AnalysisError, ModelError
from ..model.model import Model
from ..model.unsupported_elements import refuse_unsupported
from ..progress import ReportProgress, progress_bar
from ..results.equilibrium import Equilibrium
from ..results.modes import Crossing, RootLocus, half_plane
from ..statics.equilibrium import equilibrium, rest_options
from ..statics.equilibrium_series import EquilibriaOptions, checked_values, equilibria, series_error
from .linearize import LinearizeOptions, OperatingPointOptions, controlled_linear_model, equations_without_inputs
from .sampling_cycle import sampled_root_locus


@dataclass
class EigenvalueSample:
    """Eigenvalues at one value of the parameter.

    Attributes
    ----------
    place : float
        Index in the list of values; fractional between two values.
    value : float
        Value of the parameter.
    w, raw : ndarray (n,) complex
        Eigenvalues with rounding removed, and as computed.
    shapes : ndarray (2 nv + nz, n) complex
        Unit vectors of changes of positions, velocities and controller states, in natural units.
    frame : str
        Description of the frame that they refer to.
    """

    place: float
    value: float
    w: np.ndarray
    raw: np.ndarray
    shapes: np.ndarray
    frame: str

    @cached_property
    def kinds(self) -> np.ndarray:
        """Region of each eigenvalue: ``"zero"``, ``"+real"``, ``"-real"``, ``"axis"``, ``"+pair"``, ``"-pair"``, (n,).

        ``""`` marks the lower eigenvalue of a pair.
        """
        w = self.w
        real = half_plane(w)
        alone = np.where(real > 0, "+real", "-real")
        pair = np.where(real > 0, "+pair", np.where(real < 0, "-pair", "axis"))
        return np.where(w == 0.0, "zero", np.where(w.imag == 0.0, alone, np.where(w.imag > 0.0, pair, "")))

    @cached_property
    def half_planes(self) -> np.ndarray:
        """Half plane of each eigenvalue, (n,): 1 (right), -1 (left), or 0 (imaginary axis)."""
        return half_plane(self.w)

    @cached_property
    def counts(self) -> dict[str, int]:
        """Number of eigenvalues, one of each pair, in each region."""
        names, n = np.unique(self.kinds[self.kinds != ""], return_counts=True)
        return dict(zip(names.tolist(), n.tolist(), strict=True))

    @property
    def growing(self) -> int:
        """Number of eigenvalues with a positive real part."""
        return self.counts.get("+real", 0) + 2 * self.counts.get("+pair", 0)


def eigenvalue_sample(
    place: float, value: float, f: FreeCoordinates, frame: TurningFrame, r: ReducedEquations
) -> EigenvalueSample:
    """Eigenvalues and shapes of reduced linear equations."""
    own = spectrum(r.A, r.uncertainty)
    n = len(r.A)
    fast = float(np.abs(own.values).max(initial=0.0)) or 1.0
    parts = [r.position[:, :n] / f.scale[:, None], r.velocity[:, :n] / f.scale[:, None] / fast]
    shapes = np.vstack([*parts, r.states[:, :n] / r.changes[:, None]])
    shapes = shapes @ own.vectors
    shapes /= np.maximum(np.linalg.norm(shapes, axis=0), 1e-300)
    return EigenvalueSample(place, value, own.values, own.raw, shapes, frame.description)


def matching_branches(a: EigenvalueSample, b: EigenvalueSample) -> np.ndarray:
    """Indices (n,) of the eigenvalues of ``b`` that continue those of ``a``."""
    from scipy.optimize import linear_sum_assignment

    size = np.abs(a.w)[:, None] + np.abs(b.w)
    apart = np.abs(a.w[:, None] - b.w) / np.where(size > 0.0, size, 1.0)
    alike = np.abs(a.shapes.conj().T @ b.shapes) ** 2
    return linear_sum_assignment(apart + 1.0 - alike)[1]


MIN_CROSSING_SLOPE = 1e-3  # smallest slope of a real part on its way through the axis, relative to its mean slope


def crosses_axis(samples: Sequence[EigenvalueSample]) -> np.ndarray:
    """Whether, at each sample, an eigenvalue lies on the axis and off it before and after, (m,) bool.

    If it lies on the axis at several samples in a row, its real part must keep changing from one to the next.
    """
    branch = [np.arange(len(samples[0].w))]
    for a, b in pairwise(samples):
        branch.append(matching_branches(a, b)[branch[-1]])
    sides = np.array([x.half_planes[k] for x, k in zip(samples, branch, strict=True)])
    real = np.array([x.raw.real[k] for x, k in zip(samples, branch, strict=True)])
    place = np.array([x.place for x in samples])
    out = np.zeros(len(samples), bool)
    for j in range(sides.shape[1]):
        for off, run in groupby(range(len(samples)), (sides[:, j] != 0).tolist().__getitem__):
            own = list(run)
            first, last = own[0], own[-1]
            if off or first == 0 or last == len(samples) - 1:
                continue
            if first != last:
                usual = np.abs(real[last + 1, j] - real[first - 1, j]) / (place[last + 1] - place[first - 1])
                steps = np.abs(np.diff(real[own, j])) / np.diff(place[own])
                if sides[first - 1, j] == sides[last + 1, j] or not (steps >= MIN_CROSSING_SLOPE * usual).all():
                    continue
            out[own] = True
    return out


ROOT_TOLERANCE = 1e-14  # relative to the interval between two values, and to the value
MAX_BISECTIONS = 48  # bisections after which an interval counts as one event
MAX_EVALUATIONS = 200  # evaluations per interval; beyond, only the change of stability is located
ZERO_TOLERANCE = 1e-6  # residual allowed at a zero, relative to the values at the ends
SPLIT_FRACTIONS = (0.4375, 0.609375, 0.234375)  # points where an interval is split; unlikely to hit a round value

END_OFFSETS = (1e-6, 1e-3)  # fractions of an interval that count as next to its end
SLOPE_VARIATION = 0.1  # relative difference of the slopes of a real part between these
MAX_FOLLOWED_HALVINGS = 6  # bisections that follow eigenvalues which seem to exchange places with others

MEETING_KINDS = {  # event -> (change of the counts, change of the number of growing eigenvalues)
    "parting at zero": ({"axis": -1, "+real": 1, "-real": 1}, 1),
    "pairs meet": ({"axis": -2, "+pair": 1, "-pair": 1}, 2),
    "+ real ones meet": ({"+real": -2, "+pair": 1}, 0),
    "- real ones meet": ({"-real": -2, "-pair": 1}, 0),
}

SmoothFunction = Callable[
    [EigenvalueSample], tuple[float, complex]
]  # function that is zero at an event, and the eigenvalue there


@dataclass
class StabilityEvent:
    """An event at which eigenvalues change region, and the change of the number of growing eigenvalues."""

    what: str
    at: EigenvalueSample
    eigenvalue: complex
    change: int


class CrossingSearch:
    """Search for stability events between samples.

    Parameters
    ----------
    at : callable
        Computes the sample at a place.
    always : int
        Number of eigenvalues that are zero at all values.
    """

    def __init__(self, at: Callable[[float], EigenvalueSample], always: int) -> None:
        self.take, self.always = at, always
        self.taken: list[EigenvalueSample] = []

    def at(self, place: float) -> EigenvalueSample:
        """Sample at a place; computed once and stored."""
        found = next((x for x in self.taken if x.place == place), None)
        if found is None:
            found = self.take(place)
            self.taken.append(found)
        return found

    def between(self, a: EigenvalueSample, b: EigenvalueSample) -> list[StabilityEvent]:
        """All events between two samples."""
        before = len(self.taken)
        at_a, low = self._end(a, b)
        at_b, high = self._end(b, a)
        return at_a + (self._bisect(low, high, before, 0) if low.place < high.place else []) + at_b

    def _end(self, x: EigenvalueSample, y: EigenvalueSample) -> tuple[list[StabilityEvent], EigenvalueSample]:
        """Events at the end ``x`` of the interval to ``y``, and a sample beyond them."""
        found = self._at_end(x, y)
        more = abs(sum(e.change for e in found))
        for part in (*END_OFFSETS, *SPLIT_FRACTIONS[::-1]) if found else ():
            beyond = self.at(x.place + part * (y.place - x.place))
            if beyond.growing == x.growing + more:
                return found, beyond
        return found, y if found else x

    def _bisect(self, a: EigenvalueSample, b: EigenvalueSample, before: int, depth: int) -> list[StabilityEvent]:
        through = _axis_crossings(a, b)
        tired = len(self.taken) - before > MAX_EVALUATIONS
        if a.counts == b.counts and (not through or depth > MAX_FOLLOWED_HALVINGS or tired):
            return []
        if tired and a.growing == b.growing:
            return []
        found = self._isolated(a, b, through) if _is_explained(a, b, through) else self._meetings(a, b)
        if found:
            return found
        if depth == MAX_BISECTIONS or b.place - a.place <= ROOT_TOLERANCE * max(1.0, b.place):
            return [_unresolved_event(a, b)] if a.growing != b.growing else []
        middle = self._middle(a, b)
        if tired:
            near = (a, middle) if a.growing != middle.growing else (middle, b)
            return self._bisect(*near, before, depth + 1)
        return self._bisect(a, middle, before, depth + 1) + self._bisect(middle, b, before, depth + 1)

    def _at_end(self, x: EigenvalueSample, y: EigenvalueSample) -> list[StabilityEvent]:
        """Events at the end ``x`` of the interval to ``y``: eigenvalues that begin or cease to grow there."""
        there = np.isin(x.kinds, ("axis", "zero"))
        on = matching_branches(x, y)
        ones = np.flatnonzero(there & np.isin(y.kinds[on], ("+pair", "+real")))
        found = [(complex(0.0, abs(x.w[k].imag)), 2 if y.kinds[on[k]] == "+pair" else 1) for k in ones]
        if not found or not self._leaves(x, y, ones, sum(n for _, n in found)):
            return []
        more = 1 if y.place > x.place else -1
        return [StabilityEvent("at the end", x, w, n * more) for w, n in found]

    def _leaves(self, x: EigenvalueSample, y: EigenvalueSample, ones: np.ndarray, growing: int) -> bool:
        """Whether eigenvalues leave the axis at ``x``: that many grow next to it, or their real parts change evenly."""
        next_to, near = (self.at(x.place + part * (y.place - x.place)) for part in END_OFFSETS)
        if next_to.growing == x.growing + growing:
            return True
        at = [k.raw.real[matching_branches(x, k)[ones]] - x.raw.real[ones] for k in (next_to, near, y)]
        slope, usual = at[0] / END_OFFSETS[0], at[1] / END_OFFSETS[1]
        even = (usual > MIN_CROSSING_SLOPE * at[2]) & (np.abs(slope - usual) <= SLOPE_VARIATION * usual)
        return bool((even & (y.kinds[matching_branches(x, y)[ones]] == "+pair")).all())

    def _middle(self, a: EigenvalueSample, b: EigenvalueSample) -> EigenvalueSample:
        """Sample between two, if possible without an eigenvalue that is just crossing the axis."""
        for part in SPLIT_FRACTIONS:
            found = self.at(a.place + part * (b.place - a.place))
            if not crosses_axis((a, found, b))[1]:
                break
        return found

    def _zero(
        self, of: SmoothFunction, a: EigenvalueSample, b: EigenvalueSample
    ) -> tuple[EigenvalueSample, complex] | None:
        """Zero of a smooth function, and the eigenvalue there; None if the function has no zero in the interval."""
        from scipy.optimize import brentq

        f0, f1 = of(a)[0], of(b)[0]
        if f0 * f1 > 0.0 or (f0 == 0.0 and f1 == 0.0):
            return None
        x0, x1 = a.place, b.place
        place = float(
            brentq(lambda x: of(self.at(x))[0], x0, x1, xtol=ROOT_TOLERANCE * max(1.0, x1), rtol=ROOT_TOLERANCE)
        )
        at = self.at(place)
        left, value = of(at)
        return None if abs(left) > ZERO_TOLERANCE * max(abs(f0), abs(f1)) else (at, value)

    def _isolated(
        self, a: EigenvalueSample, b: EigenvalueSample, through: list[tuple[complex, complex]]
    ) -> list[StabilityEvent] | None:
        """Events of eigenvalues that cross the axis one by one; None if a zero is not found."""
        out = []
        for w0, w1 in through:
            found = self._zero(self._tracked({a.place: w0, b.place: w1}), a, b)
            if found is None:
                return None
            out.append(StabilityEvent("through", *found, int(np.sign(w1.real)) * (2 if w1.imag else 1)))
        return out

    def _meetings(self, a: EigenvalueSample, b: EigenvalueSample) -> list[StabilityEvent] | None:
        """Event of two eigenvalues that meet, if this explains all changes; else None."""
        for what, (counts, more) in MEETING_KINDS.items():
            for sign in (1, -1):
                if _count_changes(a, b) == {k: sign * n for k, n in counts.items()}:
                    of = self._meeting(what, a, b)
                    found = None if of is None else self._zero(of, a, b)
                    return None if found is None else [StabilityEvent(what, *found, sign * more)]
        return None

    def _tracked(self, known: dict[float, complex]) -> SmoothFunction:
        """Function: real part of an eigenvalue known at some places, and its point on the axis."""

        def of(x: EigenvalueSample) -> tuple[float, complex]:
            if x.place not in known:
                candidates = np.argsort(np.abs(x.raw))[self.always :]
                k = int(candidates[np.argmin(np.abs(x.raw[candidates] - _interpolated(known, x.place)))])
                value = complex(x.raw[k])
                if x.w[k] == 0.0:  # indistinguishable from the eigenvalues that are always zero, but their sum is not
                    value = complex(x.raw[x.w == 0.0].sum().real)
                known[x.place] = value
            value = known[x.place]
            return value.real, complex(0.0, abs(value.imag))

        return of

    def _meeting(self, what: str, a: EigenvalueSample, b: EigenvalueSample) -> SmoothFunction | None:
        """Function: square of half the difference of two eigenvalues that meet, and their mean."""
        if what == "parting at zero":

            def near_zero(x: EigenvalueSample) -> tuple[float, complex]:
                w = x.raw[np.argsort(np.abs(x.raw))[: self.always + 2]]
                return float((w * w).sum().real / 2.0), 0j

            return near_zero
        pair = _meeting_pair(what, a, b)
        if pair is None:
            return None
        known = {x.place: complex(w.mean()) for x, w in zip((a, b), pair, strict=True)}

        def of(x: EigenvalueSample) -> tuple[float, complex]:
            mean = known.get(x.place)
            if mean is None:
                mean = _interpolated(known, x.place)
            moving = x.raw[np.argsort(np.abs(x.raw))[self.always :]]
            w = moving[np.argsort(np.abs(moving - mean))[:2]]
            known.setdefault(x.place, complex(w.mean()))
            upper = complex(0.0, abs(w.mean().imag)) if what == "pairs meet" else complex(w.mean().real)
            return float((((w[0] - w[1]) / 2.0) ** 2).real), upper

        return of


def _count_changes(a: EigenvalueSample, b: EigenvalueSample) -> dict[str, int]:
    """Change of the number of eigenvalues in each region from ``a`` to ``b``."""
    change = Counter(b.counts)
    change.subtract(a.counts)
    return {k: n for k, n in change.items() if n}


def _axis_crossings(a: EigenvalueSample, b: EigenvalueSample) -> list[tuple[complex, complex]]:
    """Eigenvalues, one of each pair, whose real part changes sign: (in ``a``, in ``b``)."""
    on = matching_branches(a, b)
    alike = np.isin(a.kinds, ("+real", "-real")) == np.isin(b.kinds[on], ("+real", "-real"))
    signs = ("+real", "-real", "+pair", "-pair")
    moved = np.isin(a.kinds, signs) & np.isin(b.kinds[on], signs) & alike & (a.w.real * b.w[on].real < 0.0)
    return [(complex(a.w[k]), complex(b.w[on[k]])) for k in np.flatnonzero(moved)]


def _is_explained(a: EigenvalueSample, b: EigenvalueSample, through: list[tuple[complex, complex]]) -> bool:
    """Whether the eigenvalues that cross the axis explain all changes."""
    change: Counter[str] = Counter()
    for w0, w1 in through:
        what = "pair" if w0.imag else "real"
        change.update({("+" if w.real > 0.0 else "-") + what: n for w, n in ((w0, -1), (w1, 1))})
    return bool(through) and {k: n for k, n in change.items() if n} == _count_changes(a, b)


def _meeting_pair(what: str, a: EigenvalueSample, b: EigenvalueSample) -> tuple[np.ndarray, np.ndarray] | None:
    """The two eigenvalues that meet, at both ends of the interval."""
    apart, pair = ("axis", "+pair") if what == "pairs meet" else (f"{what[0]}real", f"{what[0]}pair")
    here, there = (a, b) if a.counts.get(apart, 0) > b.counts.get(apart, 0) else (b, a)
    on = matching_branches(here, there)
    kinds = there.kinds[on]
    gone = ("+pair", "-pair") if what == "pairs meet" else (pair, "")
    ones = np.flatnonzero((here.kinds == apart) & np.isin(kinds, gone))
    if len(ones) != 2:
        return None
    found = here.w[ones], there.w[on[ones]]
    return found if here is a else (found[1], found[0])


def _interpolated(known: dict[float, complex], place: float) -> complex:
    """Eigenvalue interpolated linearly between the nearest known places."""
    low, high = max(k for k in known if k < place), min(k for k in known if k > place)
    return known[low] + (place - low) / (high - low) * (known[high] - known[low])


def _unresolved_event(a: EigenvalueSample, b: EigenvalueSample) -> StabilityEvent:
    """Event for several events that cannot be separated, or for one that is no zero of a smooth function."""
    more = a if a.growing > b.growing else b
    grows = ("+real", "+pair")
    on = matching_branches(more, a if more is b else b)
    ones = more.w[np.isin(more.kinds, grows) & ~np.isin((a if more is b else b).kinds[on], grows)]
    value = complex(ones[np.argmin(np.abs(ones.real))]) if len(ones) else 0j
    return StabilityEvent("several", b, complex(0.0, value.imag), b.growing - a.growing)


# Events closer than this, relative to the interval, at one eigenvalue are one event.
EVENT_TOLERANCE = 1e-9
VALUE_ROUNDING = 1e-13  # values below this part of the largest count as zero
REFINEMENT_FRACTIONS = (
    0.25,
    0.0625,
    0.015625,
    0.00390625,
)  # positions of extra samples beside a meeting of branches, relative to the interval
# Equal eigenvalues that are distinct again within so many intervals only meet.
MEETING_SPAN = 2.0
MAX_REFINED_MEETINGS = 16  # meetings of branches with extra samples at most


@dataclass(frozen=True, kw_only=True)
class RootLocusOptions(OperatingPointOptions):
    """Arguments of `Mechanism.root_locus`."""

    parameter: str
    values: Sequence[float] | np.ndarray
    equilibrium: bool
    progress: bool | Callable[[float], None]

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.about, Equilibrium):
            raise ModelError("root_locus: an equilibrium has its own parameter values; give equilibrium=True")
        if self.about is not None and self.equilibrium:
            raise ModelError("root_locus: give either about or equilibrium=True, which finds the position itself")
        if self.frozen and self.equilibrium:
            raise ModelError("root_locus: frozen has no effect at an equilibrium: leave out frozen or equilibrium")

    def here(self, value: float, about: Equilibrium | None) -> OperatingPointOptions:
        """Operating point at a value; at an equilibrium if that is given."""
        t, parameters = self.t, dict(self.parameters or {})
        if self.parameter == "t":
            t = value
        else:
            parameters[self.parameter] = float(value)
        return OperatingPointOptions(
            about=self.about if about is None else about,
            t=t if about is None else None,
            parameters=parameters,
            coordinates=self.coordinates,
            frozen=self.frozen,
        )

    def rest(self, values: Sequence[float] | np.ndarray, start: Equilibrium | None = None) -> EquilibriaOptions:
        """Options of the equilibrium series at the values."""
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
    """Compute eigenvalues over a parameter as branches, and the stability changes: see `Mechanism.root_locus`."""
    refuse_unsupported(model, "root_locus", controlled=True)
    points = checked_values(model, o.parameter, o.values, o.t, o.parameters)
    rest = (_ControlledEquilibria if model.with_states() else _EquilibriumBranch)(model, o, points)

    if any(e.sampled for e in model.controllers):
        return _sampled_locus(model, o, points, rest)

    def at(place: float) -> EigenvalueSample:
        value = float(np.interp(place, np.arange(len(points)), points))
        about = rest.at(place, value) if o.equilibrium else None
        here = o.here(value, about)
        return eigenvalue_sample(place, value, *equations_without_inputs(here.state(model), o.frozen))

    done = RootLocus(model.name, o.parameter, points[:0], np.zeros((0, 0), complex))
    with progress_bar(o.progress, f"eigenvalues over {o.parameter}") as tell:
        return _trace_locus(done, points, at, tell)


def _sampled_locus(
    model: Model, o: RootLocusOptions, points: np.ndarray, rest: _EquilibriumBranch | _ControlledEquilibria
) -> RootLocus:
    """Root locus with sampled controllers."""
    done = RootLocus(model.name, o.parameter, points[:0], np.zeros((0, 0), complex), period=0.0)
    places = np.arange(len(points))

    def matrix(value: float) -> np.ndarray:
        step = 1 if points[0] < points[-1] else -1
        place = float(np.interp(value, points[::step], places[::step]))
        here = o.here(value, rest.at(place, value) if o.equilibrium else None)
        given = {f.name: getattr(here, f.name) for f in fields(OperatingPointOptions)}
        found, _ = controlled_linear_model(model, LinearizeOptions(**given, inputs=(), outputs=(), independent=()))
        done.period = found.period
        return found.A

    with progress_bar(o.progress, f"multipliers over {o.parameter}") as tell:
        return sampled_root_locus(done, points, matrix, series_error, tell)


class _EquilibriumBranch:
    """Equilibria at and between the values, along one branch."""

    def __init__(self, model: Model, o: RootLocusOptions, points: np.ndarray) -> None:
        self.model, self.o = model, o
        self.along = equilibria(model, o.rest(points)) if o.equilibrium else None

    def at(self, place: float, value: float) -> Equilibrium:
        """Equilibrium at a place (fractional index) among the values."""
        assert self.along is not None
        about = self.along[int(place)]
        if place == int(place):
            return about
        return equilibria(self.model, self.o.rest([self.along.values[int(place)], value], about))[1]


class _ControlledEquilibria:
    """Equilibria with controllers; each search begins at the nearest known equilibrium."""

    def __init__(self, model: Model, o: RootLocusOptions, points: np.ndarray) -> None:
        self.model, self.o, self.known = model, o, dict[float, Equilibrium]()

    def at(self, place: float, value: float) -> Equilibrium:
        """Equilibrium at a place (fractional index) among the values."""
        if place not in self.known:
            near = min(self.known, key=lambda k: abs(k - place), default=None)
            here = self.o.here(value, None)
            start = None if near is None else self.known[near]
            self.known[place] = equilibrium(self.model, rest_options(here.t or 0.0, here.parameters, start))
        return self.known[place]


def _trace_locus(
    done: RootLocus, points: np.ndarray, at: Callable[[float], EigenvalueSample], report: ReportProgress
) -> RootLocus:
    """Compute the locus at the values, then the events and refinements between them."""
    taken: list[EigenvalueSample] = []
    for k, value in enumerate(points):
        try:
            taken.append(at(float(k)))
            if len(taken[k].w) != len(taken[0].w):
                raise AnalysisError(f"there are {len(taken[k].w)} states, and {len(taken[0].w)} at the values before")
        except AnalysisError as error:
            raise series_error(done, value, error) from error
        _write_branches(done, taken)
        report(0.5 * (k + 1) / len(points), f"{value:.6g}")
    search = CrossingSearch(at, min(x.counts.get("zero", 0) for x in taken))
    search.taken = list(taken)
    events = _events_between(search, taken, report)
    done.crossings = _stability_changes(events, taken)
    _refine_meetings(search, [e for e in events if "meet" in e.what or "part" in e.what], taken)
    _write_branches(done, search.taken)
    report(1.0, "")
    return done


def _write_branches(done: RootLocus, samples: Sequence[EigenvalueSample]) -> None:
    """Sort the samples into branches and store them."""
    order = sorted(samples, key=lambda x: x.place)
    base, last = order[0], np.lexsort((order[0].w.real, order[0].w.imag))
    rows = [base.w[last]]
    for k, x in enumerate(order[1:], 1):
        own = matching_branches(base, x)[last]
        rows.append(x.w[own])
        if not _is_meeting(base, x, order[k + 1 :]):
            base, last = x, own
    done.path, done.path_values = np.array(rows), np.array([x.value for x in order])
    given = [k for k, x in enumerate(order) if x.place == int(x.place)]
    done.values, done.eigenvalues = done.path_values[given], done.path[given]
    done.seen_from = tuple(dict.fromkeys(x.frame for x in order if x.frame))


def _is_meeting(base: EigenvalueSample, x: EigenvalueSample, following: Sequence[EigenvalueSample]) -> bool:
    """Whether eigenvalues that are distinct before and soon after coincide at a sample, where shapes are ambiguous."""
    many = len(np.unique(x.w))
    if many >= len(np.unique(base.w)):
        return False
    return any(len(np.unique(y.w)) > many for y in following if y.place - base.place <= MEETING_SPAN)


def _events_between(
    search: CrossingSearch, samples: Sequence[EigenvalueSample], report: ReportProgress
) -> list[StabilityEvent]:
    """Events between the given values; values that lie on an event are skipped."""
    on = crosses_axis(samples)
    kept = [samples[0]]
    for k, x in enumerate(samples[1:], 1):
        if k == len(samples) - 1 or not (on[k] or _passes_zero(kept[-1], x, samples[k + 1])):
            kept.append(x)
    _add_turning_samples(search, kept)
    found = []
    for a, b in pairwise(kept):
        found += search.between(a, b)
        report(0.5 + 0.5 * b.place / len(samples), "where stability changes")
    return found


def _passes_zero(a: EigenvalueSample, x: EigenvalueSample, b: EigenvalueSample) -> bool:
    """Whether more eigenvalues are zero at a sample than at both neighbours."""
    before, here, after = (k.counts.get("zero", 0) for k in (a, x, b))
    return here > max(before, after)


def _add_turning_samples(search: CrossingSearch, samples: list[EigenvalueSample]) -> None:
    """Add a sample where a parabola through three real parts of a branch has its vertex across the axis."""
    more = []
    for a, b, c in zip(samples, samples[1:], samples[2:], strict=False):
        if not a.counts == b.counts == c.counts:
            continue
        to, on = matching_branches(b, a), matching_branches(b, c)
        for k in range(len(b.w)):
            y = [a.w[to[k]].real, b.w[k].real, c.w[on[k]].real]
            if 0.0 in y:
                continue
            bend = np.polyfit([a.place - b.place, 0.0, c.place - b.place], y, 2)
            turn = -bend[1] / (2.0 * bend[0]) if bend[0] else np.inf
            if a.place < b.place + turn < c.place and np.polyval(bend, turn) * y[1] < 0.0:
                more.append(b.place + turn)
    for place in dict.fromkeys(more):
        samples.append(search.at(float(place)))
    samples.sort(key=lambda x: x.place)


def _stability_changes(events: Sequence[StabilityEvent], samples: Sequence[EigenvalueSample]) -> list[Crossing]:
    """Stability changes; events at one place and eigenvalue are merged."""
    fastest = max(float(np.abs(x.w).max(initial=0.0)) for x in samples)
    least = VALUE_ROUNDING * max(abs(x.value) for x in samples)
    found: list[tuple[float, Crossing]] = []
    for e in sorted(events, key=lambda e: e.at.place):
        if not e.change:
            continue
        kind = "flutter" if e.eigenvalue.imag > 0.0 else "divergence"
        own = Crossing(e.at.value if abs(e.at.value) > least else 0.0, e.eigenvalue, kind, e.change)
        if found:
            place, other = found[-1]
            if (
                e.at.place - place <= EVENT_TOLERANCE
                and abs(other.eigenvalue - own.eigenvalue) <= EVENT_TOLERANCE * fastest
            ):
                found[-1] = place, other._replace(change=other.change + own.change)
                continue
        found.append((e.at.place, own))
    return [c for _, c in found if c.change]


def _refine_meetings(
    search: CrossingSearch, events: Sequence[StabilityEvent], samples: Sequence[EigenvalueSample]
) -> None:
    """Add samples beside meetings of branches, where eigenvalues move like a square root."""
    for e in events[:MAX_REFINED_MEETINGS]:
        for side in (-1.0, 1.0):
            end = np.floor(e.at.place) if side < 0.0 else np.floor(e.at.place) + 1.0
            for part in REFINEMENT_FRACTIONS:
                search.at(float(e.at.place + part * (min(end, len(samples) - 1.0) - e.at.place)))
