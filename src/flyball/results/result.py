"""A motion, read by name."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.model import Model
from ..model.quantities import ENERGY, MEMBER, one, quantities
from ..model.writing import PAGE, RESULT, TABLE, ending, write
from ..tables.values import Values
from .booked import Begun
from .bulk import Bulk
from .contacts import Contacts
from .energy import Energy
from .events import Events, Happening, bound
from .health import Health
from .measured import Measured
from .numbers import span
from .reactions import Reactions
from .records import Records
from .stretches import Stretches, cut_up
from .turn import Turn
from .views import has_view, view
from .views.base import Curves
from .views.bulk import MemberView, SetView
from .views.spliced import Spliced

TOLD = 12  # curves in a text
_NO_WHOLE: Any = None  # else a result and the output times that are a piece of it
Owed = Callable[[], tuple[np.ndarray, np.ndarray]]

if TYPE_CHECKING:
    import pandas
    import xarray


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
        Planar body -> whole turns [rad] that coordinates count and its angle does not (`records.wound`): those that a
        joint was told to begin with.
    contacts : Contacts
        Where bodies touched and with which forces; None where the mechanism has no contact.
    bulk : dict
        Set of bodies -> its motion (`Bulk`); their members are read by ``result["balls[17]"]``.
    events : Events
        What happened at instants, in the order of time: the model's events, impacts, what stuck, locked or let go.
    exchanged : dict
        Energy [J] since the start, (n,), by the names of `energy.EXCHANGED`, and given by events.
    begun : Begun
        How it began, and what had been exchanged before.
    carried : dict
        What a motion that goes on from it knows besides its end: how often events happened, for instance.
    stretches : Stretches
        What held between events: modes of what switches, parameters; None where nothing can switch.
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
        self._turn, self._states = Turn(), states
        self.unsolved: Owed | None = None  # finds accelerations and multipliers that are not there yet
        self.owed: Owed | None = None  # finds works that are not there yet
        self._final: tuple[float, np.ndarray] = (float("nan"), np.zeros(0))
        self.wound: dict[str, float] = {}
        self.contacts: Contacts | None = None
        self.bulk: dict[str, Bulk] = {}
        self.exchanged: dict[str, np.ndarray] = {}
        self.begun, self.within = Begun(), _NO_WHOLE
        self.carried: dict[str, Any] = {}
        self.stretches: Stretches | None = None
        self._events = Events((), self)
        self.energy = Energy(self)

    @property
    def vdot(self) -> np.ndarray:
        """Accelerations, (n, nv): solved for when something first asks for them."""
        self._solve()
        return self._vdot

    @property
    def multipliers(self) -> np.ndarray:
        """Of the constraint rows, then efforts of drivers that prescribe a coordinate."""
        self._solve()
        return self._multipliers

    def _solve(self) -> None:
        with self._turn:  # there is one scratch
            if (find := self.unsolved) is not None:
                self._vdot, self._multipliers = find()
                self.unsolved = None

    @property
    def events(self) -> Events:
        """What happened at instants, in the order of time."""
        return self._events

    @events.setter
    def events(self, happened: Iterable[Happening]) -> None:
        """Say what happened; states before and after are read by name from then on."""
        self._events = Events(bound(list(happened), self), self)
        self.health.events = self._events.summary()

    @property
    def states(self) -> np.ndarray:
        """Works of accounted elements, turned angles, places on curves, (n, nz)."""
        self._settle()
        return self._states

    @property
    def hints(self) -> np.ndarray:
        """The same, but works that are not there yet are not found: for those who want turns and places only."""
        return self._states

    @property
    def final(self) -> tuple[float, np.ndarray]:
        """Time and state vector to go on from."""
        self._settle()
        return self._final

    @final.setter
    def final(self, value: tuple[float, np.ndarray]) -> None:
        """Say where the motion ended."""
        self._final = value

    def _settle(self) -> None:  # works of a motion that was followed, not integrated
        with self._turn:
            if (find := self.owed) is not None:  # owed still if it is interrupted
                self._states, y = find()
                self._final = (self._final[0], y)
                self.owed = None

    def __getstate__(self) -> dict[str, Any]:
        """All is found before it is pickled or copied: of what it is found with nothing goes along."""
        self._solve()
        self._settle()
        return vars(self)

    @property
    def planar(self) -> bool:
        """Whether the mechanism moves in the plane."""
        return self.model.planar

    @cached_property
    def pieces(self) -> tuple[Result, ...]:
        """The motion piece by piece, if parameters changed in it, each with its own; else none."""
        return cut_up(self)

    @cached_property
    def records(self) -> Records:
        """Kinematics of every body and frame at the output times."""
        return Records(self.values, self.q, self.v, self.vdot, self.wound)

    @cached_property
    def motions(self) -> Records:
        """The same without the accelerations, which have to be solved for."""
        return Records(self.values, self.q, self.v, None, self.wound)

    @cached_property
    def measured(self) -> Measured:
        """Quantities that forces act along and that laws name."""
        return Measured(self)

    @cached_property
    def reactions(self) -> Reactions:
        """Wrenches that joints carry."""
        return Reactions(self)

    def __getitem__(self, name: str) -> Any:
        """A part by its name, or anything of it by ``"part.quantity"``.

        Raises
        ------
        ModelError
            If there is no such part or quantity; the message lists what there is.
        """
        if not isinstance(name, str):
            raise ModelError(
                f"a result is read by name, for instance result['crank'] or result['crank.x'], not {name!r}"
            )
        return self.channel(name)[1] if "." in name else self._view(name)

    def __contains__(self, name: object) -> bool:
        """Whether there is a part, or a quantity, of that name."""
        owner, dot, what = name.partition(".") if isinstance(name, str) else ("", "", "")
        if owner not in self.parts() and self._set_of(owner) is None:
            return False
        return not dot or what in self._view(owner).names

    def _view(self, name: str) -> Any:
        views = self.__dict__.setdefault("_views", {})
        if name not in views:
            views[name] = self._viewed(name)
        return views[name]

    def _viewed(self, name: str) -> Any:
        if name == ENERGY:
            return self.energy
        if (found := self._set_of(name)) is None:
            if self.pieces:
                return Spliced([p._view(name) for p in self.pieces], [len(p.t) for p in self.pieces])
            return view(self, self.model[name])
        own, k = found
        return SetView(self, own) if k is None else MemberView(self, own, k)

    def _set_of(self, name: str) -> tuple[Bulk, int | None] | None:
        """The set of bodies of a name; of a member such as ``"balls[17]"`` its set and its number.

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
        """Names of all that the result says something of."""
        return [*(e.name for e in self.model.elements() if e.category == "bulk" or has_view(e)), ENERGY]

    def names(self) -> list[str]:
        """Every name that ``result[name]`` knows: parts, and ``"part.quantity"``."""
        owners = self.parts()
        return [*owners, *(f"{name}.{k}" for name in owners for k in quantities(self.model, name))]

    def _ipython_key_completions_(self) -> list[str]:
        return self.names()

    def channel(self, name: str) -> tuple[str, np.ndarray]:
        """(unit, values) of anything that a part has: a curve such as ``"slider.x"``, (n,), or ``"A.force"``, (n, k).

        Raises
        ------
        ModelError
            If there is no such part or quantity; the message lists what there is.
        """
        owner, _, what = name.partition(".")
        return self._view(owner).quantity(what)

    def curve(self, name: str) -> tuple[str, np.ndarray]:
        """(unit, values) of one number over time: a curve such as ``"slider.x"``, or a sensor by its name.

        Raises
        ------
        ModelError
            If there is none of that name, or it has several components.
        """
        one(self.model, name)
        return self.channel(name if "." in name else f"{name}.value")

    def channels(self) -> dict[str, tuple[str, np.ndarray]]:
        """Every named curve: ``"part.curve"`` -> (unit, values)."""
        return {f"{name}.{k}": c for name in self.parts() for k, c in self._view(name).channels().items()}

    def state_at_end(self, compiled: Any) -> np.ndarray:
        """State vector to go on from.

        Raises
        ------
        ModelError
            If the mechanism it is wanted for has other coordinates.
        """
        own, other = self.values.structure, compiled.structure
        if list(own.place) != list(other.place) or own.states != other.states or list(own.slices) != list(other.slices):
            raise ModelError(f"the result of {self.model.name!r} cannot be gone on with: the mechanism is another one")
        return self.final[1].copy()

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts for people: times, what the health says, and between which values the first curves stay."""
        over = f"{self.t[0]:g} to {self.t[-1]:g} s, {len(self.t)} times" if len(self.t) else "no times"
        out = [("motion", f"{self.model.name}, {over}"), *self.health.lines()]
        return out + [(name, f"{span(v)} {unit.replace('*', ' ')}") for name, (unit, v) in self._telling().items()]

    def _telling(self) -> Curves:
        """At most a dozen curves that say most: what sensors measure, efforts of drivers, coordinates of joints."""
        m, planar = self.model, self.planar
        names = [f"{s.name}.value" for s in m.sensors if "value" in quantities(m, s.name)]
        names += [f"{d.name}.effort" for d in m.drivers]
        names += [f"{j.name}.{what}" for j in m.joints for what in j.measured(planar)]
        names += [f"{b.name}.{a}" for b in m.bodies for a in (("x", "y", "angle") if planar else "xyz")]
        return {name: self.channel(name) for name in names[:TOLD]} if len(self.t) else {}

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
        from .files import to_dataframe

        return to_dataframe(self)

    def to_csv(self, path: str | os.PathLike) -> None:
        """All curves as a table; the header holds names and units."""
        from .files import to_csv

        to_csv(self, path)

    def save(self, path: str | os.PathLike) -> None:
        """Everything, the model included, as one NetCDF file (.nc); ``flyball.load_result`` reads it back.

        The ending says what is written: a path that ends in .csv or .html is written as by `to_csv` or `to_html`.

        Raises
        ------
        ModelError
            If the ending is another, or the file cannot be written.
        """
        from .files import save

        found = ending(path, (*RESULT, *TABLE, *PAGE))
        if found in TABLE:
            self.to_csv(path)
        elif found in PAGE:
            self.to_html(path)
        else:
            save(self, path)

    def plot(self, *names: str, path: str | os.PathLike | None = None) -> Any:
        """Plot curves over time; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.plots import plot

        return plot(self, *names, path=path)

    def plot_path(self, *points: Any, **options: Any) -> Any:
        """Draw paths of points with their velocities; see `flyball.view.paths.plot_path` for the options."""
        from ..view.paths import plot_path

        return plot_path(self, *points, **options)

    def html(self, **options: Any) -> str:
        """The animation page as text; ``paths`` and ``show`` as in `flyball.view.animate.animation`."""
        from ..view.animate import animation

        return animation(self, **options)

    def to_html(self, path: str | os.PathLike, **options: Any) -> None:
        """Write the animation page: one file that opens offline in any browser. Options as for `html`.

        Raises
        ------
        ModelError
            If the file cannot be written, or there is nothing to draw.
        """
        write(path, self.html(**options), PAGE)

    def report(self, **options: Any) -> str:
        """The report as text: summary, animation, plots, tables of the model, and its file. Options as for `html`."""
        from ..view.report import report

        return report(self, **options)

    def to_report(self, path: str | os.PathLike, **options: Any) -> None:
        """Write the report: one file that opens offline in any browser. Options as for `html`.

        Raises
        ------
        ModelError
            If the file cannot be written, or there is nothing to draw.
        """
        write(path, self.report(**options), PAGE)

    def _repr_html_(self) -> str:
        from ..view.notebook import iframe

        return iframe(self.html())

    def __repr__(self) -> str:
        span = f"{self.t[0]:g} to {self.t[-1]:g} s, {len(self.t)} times" if len(self.t) else "no times"
        return f"<Result of {self.model.name!r}: {span}>\n{self.health}"
