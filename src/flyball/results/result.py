"""`Result`: a motion read by name; and concatenation of results of consecutive parts of a motion."""

from __future__ import annotations

import dataclasses
import itertools
import os
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.model import Model
from ..model.names import curve_parts
from ..model.output_files import (
    MATLAB,
    PAGE,
    PARQUET,
    RESULT,
    SCENE,
    SCENE_PICTURE,
    TABLE,
    VIDEO,
    file_extension,
    write_file,
)
from ..model.quantities import ENERGY, MEMBER, quantities, single_quantity
from ..model.snapshot import hidden_parts
from ..tables.values import Values, values
from .contacts import Contacts, concatenate_contacts
from .energy_balance import CONTACT_ELASTIC, Energy, EnergyBudget, total_budget
from .events import (
    EventRecord,
    Events,
    Moment,
    MotionStart,
    Phase,
    Phases,
    event_energies,
    phases_or_none,
    split_by_parameters,
    with_moments,
)
from .health import ContactHealth, Health
from .motion_record import MeasuredQuantities, MotionRecord, RecordedMotion, record_motion
from .part_views import has_view, view_of
from .part_views.base import SplicedView
from .part_views.bodies import SET_MOTION_ARRAYS, BodySetMotion, BodySetView, SetMemberView
from .part_views.groups import GroupView
from .reactions import EventImpulses, JointReactions
from .wording import range_text

if TYPE_CHECKING:
    import pandas
    import xarray

    from .differences import Differences
    from .measurements import MeasurementComparison
    from .momentum import Momentum
    from .spectrum import Spectrum


def _write_scene(result: Result, path: str | os.PathLike) -> None:
    from ..view.video import write_scene

    write_scene(result, path)


class OwnedLock:
    """A reentrant lock; a copy or a pickle of its owner gets a new one."""

    def __init__(self) -> None:
        self._lock = threading.RLock()

    def __enter__(self) -> None:
        self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    def __reduce__(self) -> Any:
        return OwnedLock, ()


SHOWN_CURVES = 12  # number of curves in a text
_NO_PARENT: Any = None  # a result, and the output times that are a piece of it
DeferredArrays = Callable[[], tuple[np.ndarray, np.ndarray]]


class Result:
    """Motion of a mechanism at the output times, with reactions, energies and a health report.

    ``result["crank"]`` is the part of that name; ``result["crank.x"]`` one of its curves. All in SI units and radians,
    times along the first axis.

    Attributes
    ----------
    t : ndarray (n,) [s]
    q, v, vdot : ndarray
        Coordinates, velocities and accelerations of the compiled mechanism.
    multipliers : ndarray
        One for each constraint row; then the effort of each driver that prescribes one of the coordinates.
    health : Health
    energy : Energy
    wound : dict
        Planar body -> full turns [rad] that coordinates count and its angle does not
        (`motion_record.extra_turns`): turns in the initial angles of joints.
    contacts : Contacts
        Contact points and forces; None if the mechanism has no contact.
    bulk : dict
        Set of bodies -> its motion (`BodySetMotion`); their members are read by ``result["balls[17]"]``.
    events : Events
        Events in the order of time: the model's events, impacts, sticking, locking and release.
    exchanged : dict
        Energy [J] since the start, (n,), by the names of `energy_balance.EXCHANGE_SIGNS`, and given by events.
    begun : MotionStart
        Initial state, and energies exchanged before.
    carried : dict
        Data for a continued motion besides the final state, such as the counts of events.
    stretches : Phases
        Modes of switches and parameters between events; None if nothing can switch.
    """

    def __init__(
        self,
        model: Model,
        values: Values,
        t: np.ndarray,
        q: np.ndarray,
        v: np.ndarray,
        states: np.ndarray,
        vdot: np.ndarray,
        multipliers: np.ndarray,
        health: Health,
    ) -> None:
        self.model, self.values, self.health = model, values, health
        self.t, self.q, self.v, self._vdot, self._multipliers = t, q, v, vdot, multipliers
        self._turn, self._states = OwnedLock(), states
        self.deferred_accelerations: DeferredArrays | None = None  # computes accelerations and multipliers on demand
        self.deferred_works: DeferredArrays | None = None  # computes works on demand
        self._final: tuple[float, np.ndarray] = (float("nan"), np.zeros(0))
        self.wound: dict[str, float] = {}
        self.contacts: Contacts | None = None
        self.bulk: dict[str, BodySetMotion] = {}
        self.exchanged: dict[str, np.ndarray] = {}
        self.begun, self.within = MotionStart(), _NO_PARENT
        self.carried: dict[str, Any] = {}
        self.phases: Phases | None = None
        self._events = Events((), self)
        self.energy = Energy(self)

    @property
    def vdot(self) -> np.ndarray:
        """Accelerations, (n, nv), computed on demand."""
        self._solve()
        return self._vdot

    @property
    def multipliers(self) -> np.ndarray:
        """Multipliers of the constraint rows, then efforts of drivers that prescribe a coordinate."""
        self._solve()
        return self._multipliers

    def _solve(self) -> None:
        with self._turn:  # there is only one workspace
            if (find := self.deferred_accelerations) is not None:
                self._vdot, self._multipliers = find()
                self.deferred_accelerations = None

    @property
    def events(self) -> Events:
        """Events, in the order of time."""
        return self._events

    @events.setter
    def events(self, happened: Iterable[EventRecord]) -> None:
        """Set the events; states before and after can be read by name from then on."""
        self._events = Events(with_moments(list(happened), self), self)
        self.health.events = self._events.summary()

    @property
    def states(self) -> np.ndarray:
        """Works of elements, accumulated angles, positions on curves, (n, nz)."""
        self._settle()
        return self._states

    @property
    def hints(self) -> np.ndarray:
        """The same without computing missing works, for angles and positions on curves only."""
        return self._states

    @property
    def final(self) -> tuple[float, np.ndarray]:
        """Final time and state vector, for continuation."""
        self._settle()
        return self._final

    @final.setter
    def final(self, value: tuple[float, np.ndarray]) -> None:
        """Set the final time and state."""
        self._final = value

    def _settle(self) -> None:  # works of a prescribed motion, which was not integrated
        with self._turn:
            if (find := self.deferred_works) is not None:  # still to be done if it is interrupted
                self._states, y = find()
                self._final = (self._final[0], y)
                self.deferred_works = None

    def __getstate__(self) -> dict[str, Any]:
        """Complete the data before pickling or copying; the means of computing them are not included."""
        self._solve()
        self._settle()
        return vars(self)

    @property
    def planar(self) -> bool:
        """Whether the mechanism moves in the plane."""
        return self.model.planar

    @cached_property
    def pieces(self) -> tuple[Result, ...]:
        """The motion in pieces of constant parameters, if parameters changed; else none."""
        return split_by_parameters(self)

    @cached_property
    def records(self) -> RecordedMotion:
        """Kinematics of every body and frame at the output times."""
        return RecordedMotion(self.values, self.q, self.v, self.vdot, self.wound)

    @cached_property
    def motions(self) -> RecordedMotion:
        """The same without accelerations, which have to be solved for."""
        return RecordedMotion(self.values, self.q, self.v, None, self.wound)

    @cached_property
    def record(self) -> MotionRecord:
        """Energies and errors at recorded times, by which the result judges itself."""
        return record_motion(self)

    @cached_property
    def budget(self) -> EnergyBudget:
        """Energy budget of all bodies at recorded times."""
        return total_budget(self)

    @cached_property
    def measured(self) -> MeasuredQuantities:
        """Quantities along which forces act and which laws use."""
        return MeasuredQuantities(self)

    @cached_property
    def reactions(self) -> JointReactions:
        """Reaction wrenches of joints."""
        return JointReactions(self)

    def __getitem__(self, name: str) -> Any:
        """Return a part by its name, a group of parts, or a quantity of a part by ``"part.quantity"``.

        Raises
        ------
        ModelError
            If there is no such part or quantity; the message lists the existing ones.
        """
        if not isinstance(name, str):
            raise ModelError(
                f"a result is read by name, for instance result['crank'] or result['crank.x'], not {name!r}"
            )
        whole = name in self.model.groups or not curve_parts(name, self.model)[1]
        return self._view(name) if whole else self.channel(name)[1]

    def __contains__(self, name: object) -> bool:
        """Return whether there is a part, or a quantity, of that name."""
        owner, what = curve_parts(name, self.model) if isinstance(name, str) else ("", "")
        if name in self.model.groups:
            return True
        if owner not in self.parts() and self.set_of_bodies(owner) is None:
            return False
        return not what or what in self._view(owner).names

    def _view(self, name: str) -> Any:
        views = self.__dict__.setdefault("_views", {})
        if name not in views:
            views[name] = self._viewed(name)
        return views[name]

    def _viewed(self, name: str) -> Any:
        if name == ENERGY:
            return self.energy
        if name in self.model.groups:
            return GroupView(self, name)
        if (found := self.set_of_bodies(name)) is None:
            if self.pieces:
                return SplicedView([p._view(name) for p in self.pieces], [len(p.t) for p in self.pieces])
            return view_of(self, self.model[name])
        own, k = found
        return BodySetView(self, own) if k is None else SetMemberView(self, own, k)

    def set_of_bodies(self, name: str) -> tuple[BodySetMotion, int | None] | None:
        """Return the set of bodies of a name; for a member such as ``"balls[17]"`` its set and its index.

        Raises
        ------
        ModelError
            If the set has no such member.
        """
        if name in self.bulk:
            return self.bulk[name], None
        member = MEMBER.fullmatch(name) if self.bulk else None
        if member is None or member[1] not in self.bulk:
            return None
        own, k = self.bulk[member[1]], int(member[2])
        if k >= len(own):
            raise ModelError(f"there is no {name!r}: {own.name!r} has the members 0 to {len(own) - 1}")
        return own, k

    def parts(self) -> list[str]:
        """Names of all parts with quantities."""
        return [*(e.name for e in self.model.elements() if e.category == "bulk" or has_view(e)), ENERGY]

    def names(self) -> list[str]:
        """Every name that ``result[name]`` accepts: parts, and ``"part.quantity"``."""
        owners = self.parts()
        return [*owners, *(f"{name}.{k}" for name in owners for k in quantities(self.model, name))]

    def _ipython_key_completions_(self) -> list[str]:
        return self.names()

    def channel(self, name: str) -> tuple[str, np.ndarray]:
        """Return (unit, values) of any quantity: a curve such as ``"slider.x"``, (n,), or ``"A.force"``, (n, k).

        Raises
        ------
        ModelError
            If there is no such part or quantity; the message lists the existing ones.
        """
        owner, what = curve_parts(name, self.model)
        return self._view(owner).quantity(what)

    def curve(self, name: str) -> tuple[str, np.ndarray]:
        """Return (unit, values) of a scalar over time: a curve such as ``"slider.x"``, or a sensor by its name.

        Raises
        ------
        ModelError
            If there is none of that name, or it has several components.
        """
        single_quantity(self.model, name)
        return self.channel(f"{name}.value" if name in self.model else name)

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """Every named curve: ``"part.curve"`` -> (unit, values)."""
        out: dict[str, tuple[str, np.ndarray]] = {}
        for name in self.parts():
            out |= {f"{name}.{k}": c for k, c in self._view(name).channels().items()}
            self.forget()
        return out

    def forget(self) -> None:
        """Discard arrays cached for single parts, which need much memory for all parts together."""
        vars(self).pop("_views", None)
        for name in ("records", "motions"):
            if name in vars(self):
                getattr(self, name).forget()

    def state_at_end(self, compiled: Any) -> np.ndarray:
        """Return the final state vector, for continuation.

        Raises
        ------
        ModelError
            If the other mechanism has different coordinates.
        """
        own, other = self.values.structure, compiled.structure
        if list(own.place) != list(other.place) or own.states != other.states or list(own.slices) != list(other.slices):
            raise ModelError(f"the result of {self.model.name!r} cannot be continued: the mechanism is a different one")
        return self.final[1].copy()

    def lines(self) -> list[tuple[str, str]]:
        """Return labels and texts: times, health, and ranges of the first curves."""
        over = f"{self.t[0]:g} to {self.t[-1]:g} s, {len(self.t)} times" if len(self.t) else "no times"
        out = [("motion", f"{self.model.name}, {over}"), *self.health.lines()]
        curves = {name: self.channel(name) for name in self.main_curves()} if len(self.t) else {}
        return out + [(name, f"{range_text(v)} {unit.replace('*', ' ')}") for name, (unit, v) in curves.items()]

    def main_curves(self) -> list[str]:
        """Return up to twelve of the most important curves: sensors, efforts of drivers, coordinates of joints."""
        m, planar = self.model, self.planar
        names = [f"{s.name}.value" for s in m.sensors if "value" in quantities(m, s.name)]
        names += [f"{d.name}.effort" for d in m.drivers]
        hidden = hidden_parts(m)
        names += [f"{j.name}.{what}" for j in m.joints if j.name not in hidden for what in j.independent(planar)]
        names += [
            f"{b.name}.{a}"
            for b in m.bodies
            if b.name not in hidden
            for a in (("x", "y", "angle") if planar else "xyz")
        ]
        return names[:SHOWN_CURVES]

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names: times, all curves with their units, and the health."""
        curves = {k: {"unit": unit, "values": np.asarray(v).tolist()} for k, (unit, v) in self.channels().items()}
        out = {"name": self.model.name, "t": self.t.tolist(), "curves": curves}
        out |= {"events": self.events.as_dict()} if len(self.events) else {}
        return out | {"health": self.health.as_dict()}

    def to_xarray(self) -> xarray.Dataset:
        """All curves as a labelled dataset with units."""
        from .files import to_xarray

        return to_xarray(self)

    def to_dataframe(self) -> pandas.DataFrame:
        """All curves as a data frame, time as index, units in ``attrs["units"]``."""
        from .result_tables import to_dataframe

        return to_dataframe(self)

    def to_csv(self, path: str | os.PathLike) -> None:
        """All curves as a table; the header holds names and units."""
        from .result_tables import to_csv

        to_csv(self, path)

    def save(self, path: str | os.PathLike) -> None:
        """Write everything, the model included, to one NetCDF file (.nc); ``flyball.load_result`` reads it back.

        The extension selects the format. Tables of all curves are .csv, .parquet (with the package pyarrow) and .mat,
        for MATLAB; .html is the page of `to_html`. The animated scene in glTF is .glb, which slides, Blender and web
        viewers open. Videos as by `to_video` are .gif, .mp4 and .webm; .png and .svg show the scene at the first time.

        Raises
        ------
        ModelError
            If the extension is unknown, or the file cannot be written.
        """
        from . import result_tables
        from .files import save

        writers: dict[tuple[str, ...], Callable[..., None]] = {
            RESULT: partial(save, self),
            TABLE: self.to_csv,
            PARQUET: partial(result_tables.to_parquet, self),
            MATLAB: partial(result_tables.to_mat, self),
            PAGE: self.to_html,
            VIDEO: self.to_video,
            (*SCENE, *SCENE_PICTURE): partial(_write_scene, self),
        }
        found = file_extension(path, tuple(itertools.chain(*writers)))
        next((w for endings, w in writers.items() if found in endings), writers[RESULT])(path)

    def plot(self, *names: str, path: str | os.PathLike | None = None) -> Any:
        """Plot curves over time; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.result_plots import plot_curves

        return plot_curves(self, *names, path=path)

    def compare(self, data: str | os.PathLike | Mapping[str, Any]) -> MeasurementComparison:
        """Compare the motion with measured curves: root mean square and largest deviation, R^2.

        Parameters
        ----------
        data : str, path, or mapping of str to array
            A table (.csv) with a heading line, or arrays by heading: times ``t [s]``, and measured curves such as
            ``slider.x [mm]``; without a unit in SI. An empty entry or nan is a value that was not measured. Times
            outside the motion are left out.

        Returns
        -------
        MeasurementComparison

        Raises
        ------
        ModelError
            If a quantity does not exist, the data are no table of numbers, or no value can be compared.
        """
        from .measurements import compare_with_measurements

        return compare_with_measurements(self, data)

    def differences(self, other: Result, *names: str) -> Differences:
        """Return the differences of another motion from this one: parameters, parts, curves, events, health.

        The motions may be those of different mechanisms. Compared are the curves that both have under one name and
        unit, over the times that both have; parts that only one has are listed.

        Parameters
        ----------
        other : Result
        *names : str
            Curves to compare; all common ones by default.

        Returns
        -------
        Differences

        Raises
        ------
        ModelError
            If a curve does not exist in both, one mechanism is planar and the other spatial, or they have no body or no
            time in common.
        """
        from .differences import compare_results

        return compare_results(self, other, names)

    def momentum(self, *bodies: str, about: Any = "com") -> Momentum:
        """Return the linear and angular momentum of bodies over time.

        Inertias of rotors (`RotorInertia`) are not part of it.

        Parameters
        ----------
        *bodies : str
            Bodies, sets of bodies or members of sets; without names the whole mechanism.
        about : str or coordinates [m]
            Point of the angular momentum: ``"com"``, the common mass centre of the bodies; the origin of a body or a
            frame, by its name; or a point of the world, ``(0, 0, 0)``.

        Returns
        -------
        Momentum

        Raises
        ------
        ModelError
            If there is no such moving body, or ``about`` is no point.
        """
        from .momentum import result_momentum

        return result_momentum(self, bodies, about)

    def spectrum(
        self,
        *names: str,
        window: str = "hann",
        start: float | str | None = None,
        segment: float | str | None = None,
        outputs: int | None = None,
    ) -> Spectrum:
        """Return amplitude spectra (fast Fourier transform) and power spectral densities (Welch) of curves.

        Parameters
        ----------
        *names : str
            Scalar curves such as ``"A.rate"``, or sensors by name.
        window : str
            A window of ``scipy.signal`` by name. The Hann window keeps a line from spreading over all frequencies, and
            spreads it over its two neighbours. ``"boxcar"`` (none) is for whole periods, ``"flattop"`` for amplitudes
            at any frequency.
        start : number or quantity [s], optional
            Begin at this time, for instance after a transient motion.
        segment : number or quantity [s], optional
            Length of the segments of Welch's method, by default a quarter of the record. Longer ones resolve
            frequencies better and average less.
        outputs : int, optional
            Interpolate at this number of evenly spaced times first, by cubic splines. Nothing filters out frequencies
            above half the new sampling frequency.

        Returns
        -------
        Spectrum

        Raises
        ------
        ModelError
            If there is no such curve or window, or a length does not fit the motion.
        AnalysisError
            If output times are too few or, without ``outputs``, not evenly spaced; or a curve is not finite.
        """
        from .spectrum import curve_spectrum

        return curve_spectrum(self, names, window, start, segment, outputs)

    def plot_path(self, *points: Any, **options: Any) -> Any:
        """Draw paths of points with their velocities; see `flyball.view.path_plots.plot_path` for the options."""
        from ..view.path_plots import plot_path

        return plot_path(self, *points, **options)

    def html(self, **options: Any) -> str:
        """The animation page as text.

        Options are those of `flyball.view.animation.animation_html`: ``paths`` of points, what to ``show``, ``others``
        to compare with, such as ``others={"stiff": other}``, and ``measured="test.csv"``.
        """
        from ..view.animation import animation_html

        return animation_html(self, **options)

    def to_html(self, path: str | os.PathLike, **options: Any) -> None:
        """Write the animation page: one file that opens offline in any browser. Options as for `html`.

        Raises
        ------
        ModelError
            If the file cannot be written, or there is nothing to draw.
        """
        write_file(path, self.html(**options), PAGE)

    def to_video(self, path: str | os.PathLike, **options: Any) -> None:
        """Write the animation as a video: .gif, or .mp4 and .webm, which need the program ffmpeg.

        Options are ``speed`` (seconds of motion in a second of video; by default real time, or a round factor for short
        and long motions), ``frames_per_second`` and ``width`` [px].

        Raises
        ------
        ModelError
            If the file cannot be written, or ffmpeg is not installed.
        """
        from ..view.video import save_video

        save_video(self, path, **options)

    def report(self, **options: Any) -> str:
        """The report as text: summary, animation, plots, tables of the model, and its file. Options as for `html`."""
        from ..view.report import report_html

        return report_html(self, **options)

    def to_report(self, path: str | os.PathLike, **options: Any) -> None:
        """Write the report: one file that opens offline in any browser. Options as for `html`.

        Raises
        ------
        ModelError
            If the file cannot be written, or there is nothing to draw.
        """
        write_file(path, self.report(**options), PAGE)

    def _repr_html_(self) -> str:
        from ..view.page import notebook_iframe

        return notebook_iframe(self.html())

    def __repr__(self) -> str:
        span = f"{self.t[0]:g} to {self.t[-1]:g} s, {len(self.t)} times" if len(self.t) else "no times"
        return f"<Result of {self.model.name!r}: {span}>\n{self.health}"


TIME_ROUNDING = 1e-12  # difference of times, relative to the motion's length, that counts as none


def motion_until(result: Result, t: float) -> Result:
    """Return the motion up to one of its output times; at an event that is the state after it.

    Raises
    ------
    ModelError
        If it is none of the output times.
    """
    near = int(np.argmin(np.abs(result.t - t))) if len(result.t) else 0
    if not len(result.t) or abs(result.t[near] - t) > TIME_ROUNDING * np.ptp(result.t):
        times = f"; the nearest is {result.t[near]:.6g} s" if len(result.t) else ""
        raise ModelError(f"t = {t:g} s is no output time of the motion{times}. Give it in outputs=")
    n = int(np.flatnonzero(result.t == result.t[near])[-1]) + 1
    if n == len(result.t):
        return result
    t_, q, v, states, vdot, multipliers = (
        getattr(result, name)[:n] for name in ("t", "q", "v", "states", "vdot", "multipliers")
    )
    phases = None if result.phases is None else Phases(tuple(x for x in result.phases.cut(n).all if x.rows))
    values = result.values if phases is None else phases.all[-1].values
    out = Result(result.model, values, t_, q, v, states, vdot, multipliers, result.health)
    out.phases, out.wound, out.begun = phases, result.wound, result.begun
    out.final = float(t_[-1]), np.concatenate([q[-1], v[-1], states[-1]])
    return out


def concatenate_results(parts: Sequence[Result], times: np.ndarray) -> Result:
    """Concatenate the parts to one result at the requested output times; the last row of the last part is kept, too.

    Energies counted since the start of each part are accumulated. The caller sets the deferred figures of its health.
    """
    if len(parts) == 1:
        return parts[0]
    last = parts[-1]
    keep = [np.isin(p.t, times) for p in parts]
    if len(keep[-1]):
        keep[-1][-1] = True
    for p, mine, after in zip(parts, keep, parts[1:], strict=False):
        if len(p.t) and len(after.t) and p.t[-1] == after.t[0]:  # the event at that time belongs to the later part
            mine[-1] = False
    t, *rows = (
        np.concatenate([getattr(p, name)[k] for p, k in zip(parts, keep, strict=True)])
        for name in ("t", "q", "v", "states", "vdot", "multipliers")
    )
    q, v, states, vdot, multipliers = rows
    out = Result(last.model, last.values, t, q, v, states, vdot, multipliers, _joined_health([p.health for p in parts]))
    out.final, out.carried, out.wound = last.final, dict(last.carried), parts[0].wound
    out.begun = parts[0].begun
    known = SharedTables(last.values)
    out.phases = _joined_phases(parts, keep, known)
    out.exchanged = _joined_exchanges(parts, keep)
    if out.phases is not None:
        out.exchanged |= event_energies(out)
    if last.contacts is not None:
        taken = [
            p.contacts.at_times(np.flatnonzero(k)) for p, k in zip(parts, keep, strict=True) if p.contacts is not None
        ]
        out.contacts = concatenate_contacts(taken, out.t)
    out.bulk = {name: _joined_set([p.bulk[name] for p in parts], keep) for name in last.bulk}
    out.events = [_unbound_event(h, known) for p in parts for h in p.events]  # type: ignore[assignment]
    return out


class SharedTables:
    """Tables of one structure by their parameters; parts read from files have tables of their own."""

    def __init__(self, x: Values) -> None:
        self._structure, self._all = x.structure, {self._key(x): x}

    @staticmethod
    def _key(x: Values) -> bytes:
        return x.system.const[: len(x.structure.model.parameters)].tobytes()

    def __call__(self, x: Values) -> Values:
        """Return tables with the same numbers in the one structure, always the same object."""
        key = self._key(x)
        if key not in self._all:
            self._all[key] = x if x.structure is self._structure else values(self._structure, x.parameter_values)
        return self._all[key]


def _joined_phases(parts: Sequence[Result], keep: Sequence[np.ndarray], known: SharedTables) -> Phases | None:
    out: list[Phase] = []
    lost = given = 0.0
    for p, k in zip(parts, keep, strict=True):
        if p.phases is None:
            return None
        first = 0
        for x in p.phases.all:
            mine = k[first : first + x.rows]
            first += x.rows
            out.append(
                dataclasses.replace(
                    x,
                    rows=int(mine.sum()),
                    sigma=x.sigma[:, mine] if x.sigma.ndim == 2 else x.sigma,
                    values=known(x.values),
                    lost=x.lost + lost,
                    given=x.given + given,
                )
            )
        lost, given = out[-1].lost, out[-1].given
    return phases_or_none(out)


def _joined_exchanges(parts: Sequence[Result], keep: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
    """Return energies exchanged by contacts since the start of all parts; the last row of a part is its end."""
    out = {}
    for name in parts[-1].exchanged:
        rows, before = [], 0.0
        for p, k in zip(parts, keep, strict=True):
            x = p.exchanged[name] + (0.0 if name == CONTACT_ELASTIC else before)
            rows.append(x[k])
            before = float(x[-1]) if len(x) else before
        out[name] = np.concatenate(rows)
    return out


def _joined_set(every: Sequence[BodySetMotion], keep: Sequence[np.ndarray]) -> BodySetMotion:
    """Concatenate the motions of a set; quaternions stay continuous in sign."""
    turns = [every[0].quaternion]
    for b in every[1:]:
        q = b.quaternion
        if len(q) and len(turns[-1]):
            q = q * np.where((q[:1] * turns[-1][-1:]).sum(axis=2, keepdims=True) < 0.0, -1.0, 1.0)
        turns.append(q)
    told = {name: [getattr(b, name) for b in every] for name in SET_MOTION_ARRAYS} | {"quaternion": turns}
    rows: dict[str, Any] = {
        name: np.concatenate([x[k] for x, k in zip(all_of, keep, strict=True)]) for name, all_of in told.items()
    }
    return dataclasses.replace(every[0], **rows)


def _unbound_event(h: EventRecord, known: SharedTables) -> EventRecord:
    """Return an event without its result, so that its states are read in the concatenated one."""
    sides = [x.y if isinstance(x, Moment) else x for x in (h.before, h.after)]
    both = [known(x.values) for x in (h.before, h.after) if isinstance(x, Moment)]
    impulses = h.impulses.loose() if isinstance(h.impulses, EventImpulses) else h.impulses
    tables = tuple(both) if len(both) == 2 else None
    return dataclasses.replace(h, before=sides[0], after=sides[1], tables=tables, impulses=impulses)


def _joined_health(every: Sequence[Health]) -> Health:
    first, last = every[0], every[-1]
    return dataclasses.replace(
        last,
        **{name: max(getattr(h, name) for h in every) for name in ("violation", "velocity_violation")},
        **{name: sum(getattr(h, name) for h in every) for name in SUMMED_FIGURES},
        **{name: getattr(first, name) for name in ("coordinates", "engine", "departures", "options")},
        method=_joined_method([h.method for h in every]),
        remarks=tuple(dict.fromkeys(r for h in every for r in h.remarks)),
        event_detection=next((h.event_detection for h in reversed(every) if h.event_detection), ""),
        contact=_joined_contact_health([h.contact for h in every if h.contact]),
        late={},
    )


def _joined_method(every: Sequence[str]) -> str:
    """Join the methods of all parts and their start times; reasons against another method are given once."""
    told = every[0].split("; ")
    for words in (x for part in every[1:] for x in part.split("; ") if CHANGE_MARK in x):
        if words not in told and not (NO_CHANGE_MARK in words and any(NO_CHANGE_MARK in x for x in told)):
            told.append(words)
    return "; ".join(told)


CHANGE_MARK, NO_CHANGE_MARK = (
    " from t = ",
    ", though ",
)  # text by which the stiffness monitor reports a change of the method, or none
SUMMED_FIGURES = ("steps", "rejected", "evaluations", "factorisations", "seconds", "compiling")
LARGEST_CONTACT_FIGURES = ("most", "worst_overlap", "residual", "force_residual")
SUMMED_CONTACT_FIGURES = ("solves", "iterations", "unconverged", "halved", "reduced", "impacted")


def _joined_contact_health(every: Sequence[ContactHealth]) -> ContactHealth | None:
    if not every:
        return None
    worst = max(every, key=lambda h: h.residual)
    return dataclasses.replace(
        every[0],
        **{name: max(getattr(h, name) for h in every) for name in LARGEST_CONTACT_FIGURES},
        **{name: sum(getattr(h, name) for h in every) for name in SUMMED_CONTACT_FIGURES},
        impacts=next((h.impacts for h in every if h.impacts), ""),
        worst_at=worst.worst_at,
        notes=tuple(dict.fromkeys(n for h in every for n in h.notes)),
    )
