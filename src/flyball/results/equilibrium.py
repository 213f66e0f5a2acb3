"""An equilibrium or steady motion with its stability and contacts, and a series of equilibria over a parameter."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.names import curve_parts
from ..model.output_files import PAGE, write_file
from .wording import UNSTABLE, number_text

if TYPE_CHECKING:
    from .result import Result


STICKS, FRICTIONLESS, CLOSED = "sticks", "smooth", "closed"
AT_FRICTION_LIMIT, ABOUT_TO_OPEN = "at its friction limit", "about to open"


@dataclass(frozen=True)
class Touch:
    """A closed contact, an active stop, or a brake or joint friction that sticks, of a mechanism at rest.

    Attributes
    ----------
    name : str
        ``"block-floor"``, with a number if there are several; of a stop its own name.
    state : str
        ``"sticks"``; ``"smooth"`` without friction; ``"at its friction limit"``, on the verge of sliding; ``"closed"``,
        a stop, play, rope or latch that carries a force; or ``"about to open"``, without load.
    normal : float [`unit`]
        Normal force; of a stop its effort; of joint friction, a brake or clutch its capacity.
    tangential : float [`unit`]
        Friction force.
    used : float
        Friction force relative to the friction limit; 0 without friction.
    gap : float [m]
        Distance of the surfaces; below 0 they overlap.
    unit : str
        ``"N"``, or ``"N*m"`` of what acts along an angle.
    capacity : bool
        Whether ``normal`` is a capacity.
    """

    name: str
    state: str
    normal: float
    tangential: float = 0.0
    used: float = 0.0
    gap: float = 0.0
    unit: str = "N"
    capacity: bool = False

    def __str__(self) -> str:
        unit = self.unit.replace("*", " ")
        part = f", {100.0 * self.used:.3g} % of its largest force" if self.used else ""
        if self.capacity or self.state == CLOSED:
            carried = self.tangential if self.capacity else self.normal
            return f"{self.name} {self.state}, carries {carried:.4g} {unit}{part}"
        friction = f", friction {self.tangential:.4g} {unit}" if self.used else ""
        return f"{self.name} {self.state}, presses with {self.normal:.4g} {unit}{friction}{part}"


BY_EIGENVALUES, BY_MULTIPLIERS = "eigenvalues of the closed loop", "multipliers of the closed loop, sample by sample"
MAX_CONTACTS = 12  # number of contacts in a text


@dataclass(frozen=True)
class FreeStiffness:
    """Stiffness of the motions that the constraints allow; for its fields see `Equilibrium`."""

    freedoms: tuple[str, ...] = ()
    stiffness: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    weakest: dict[str, float] = field(default_factory=dict)
    least: float = math.nan


@dataclass
class Equilibrium:
    """A mechanism at rest under its forces, or in steady motion.

    ``equilibrium["A.fx"]`` is the value of a curve of the result.

    Attributes
    ----------
    stability : str
        ``"stable"``, ``"marginal"`` (a direction without stiffness) or ``"unstable"``, by the constrained stiffness
        (reactions turn with the bodies); for forces without potential, or with negative damping, also by the
        eigenvalues; with controllers by those of the closed loop alone. With contact, closed contacts are assumed to
        stay closed and to stick: ``"marginal"`` if one is about to open or to slide, and ``"not judged"`` for the
        reason in ``notes``.
    judged_by : str
        The criterion, with controllers.
    preload : dict
        Force -> offset added to its law [its unit].
    speeds : dict
        Coordinate -> speed [rad/s or m/s], of a steady motion.
    unbalanced : float
        The largest residual force, relative to the largest force term.
    method : str
        Method that found it.
    kinks : tuple of str
        Descriptions of forces with different one-sided slopes at this position; stability is then judged for all sides,
        and ``stiffness`` and ``least`` belong to the side with the lowest stiffness.
    result : Result
        Everything by name, as a result with one time; forces of contacts are in ``result.contacts``.
    touching : tuple of Touch
        State of every closed contact, and of every active stop.
    notes : tuple of str
        Further remarks: on contact, and on ropes, wheels and tyres that pull or leave their range.
    broken : tuple of str
        Shear pins that broke in the motion ``start``.
    switch_curves : dict
        Curves of stops, ropes, latches, brakes and clutches by name, such as ``"stop.force"``: their values at rest.
    free_stiffness : callable
        Returns the stiffness of the free motions; dense, and computed when it is first needed.
    """

    t: float
    stability: str
    unbalanced: float
    method: str
    parameters: dict[str, float]
    result: Result = field(repr=False)
    assembly: Any = field(repr=False)
    preload: dict[str, float] = field(default_factory=dict)
    speeds: dict[str, float] = field(default_factory=dict)
    kinks: tuple[str, ...] = ()
    judged_by: str = ""
    touching: tuple[Touch, ...] = ()
    notes: tuple[str, ...] = ()
    broken: tuple[str, ...] = ()
    switch_curves: dict[str, float] = field(default_factory=dict, repr=False)
    free_stiffness: Callable[[], FreeStiffness] = field(default=FreeStiffness, repr=False)

    @cached_property
    def _free(self) -> FreeStiffness:
        return self.free_stiffness()

    @property
    def freedoms(self) -> tuple[str, ...]:
        """Coordinates of the stiffness."""
        return self._free.freedoms

    @property
    def stiffness(self) -> np.ndarray:
        """Stiffness matrix (f, f); with controllers for constant states and held signals, when it decides nothing."""
        return self._free.stiffness

    @property
    def weakest(self) -> dict[str, float]:
        """Direction of lowest stiffness: coordinate -> component."""
        return self._free.weakest

    @property
    def least(self) -> float:
        """Lowest stiffness: energy per square of the length or radian, relative to the largest force term."""
        return self._free.least

    def __getitem__(self, name: str) -> Any:
        """Return a curve's value, or a part of the result."""
        if name in self.switch_curves:
            return self.switch_curves[name]
        found = self.result[name]
        if not isinstance(found, np.ndarray):
            return found
        return float(found[0]) if found.ndim == 1 else found[0]

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts for people."""
        what = "steady motion" if self.speeds else "equilibrium"
        by = f" by the {self.judged_by}" if self.judged_by else ""
        out = [(what, f"{self.stability}{by}, found by {self.method}"), ("time", f"{self.t:g} s")]
        out += [("position", text) for text in self._positions()]
        if self.weakest:
            parts = ", ".join(f"{k} {v:+.2g}" for k, v in self.weakest.items())
            what = "least stiffness" + (" with constant controllers' states" if self.judged_by else "")
            out.append((what, f"{self.least:.3g} of what acts, along {parts}"))
        out += [("kink", text) for text in self.kinks]
        out += [("contact", str(k)) for k in self.touching[:MAX_CONTACTS]]
        if len(self.touching) > MAX_CONTACTS:
            out.append(("contact", f"and {len(self.touching) - MAX_CONTACTS} more"))
        out += [("note", text) for text in self.notes]
        out += [("speed", f"{k}: {v:.9g}") for k, v in self.speeds.items()]
        out += [("preload", f"{k}: {v + 0.0:.6g}") for k, v in self.preload.items()]
        return [*out, ("unbalanced", f"{self.unbalanced:.1g} of what acts")]

    def _positions(self) -> list[str]:
        axes = ("x", "y", "angle") if self.result.planar else ("x", "y", "z")
        bodies = [b.name for b in self.result.model.bodies]
        length = self.result.values.length
        size = {a: 1.0 if a == "angle" else length for a in axes}
        return [
            f"{b}: "
            + ", ".join(f"{a} {number_text(self[f'{b}.{a}'], size[a])} {'rad' if a == 'angle' else 'm'}" for a in axes)
            for b in bodies[:12]
        ] + ([f"and {len(bodies) - 12} more bodies"] if len(bodies) > 12 else [])

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names, all curves included."""
        kept = ("t", "stability", "least", "unbalanced", "method", "weakest", "preload", "speeds", "parameters")
        out = {k: getattr(self, k) for k in kept}
        out["least"] = self.least if math.isfinite(self.least) else None  # JSON has no infinity
        out |= {"judged_by": self.judged_by} if self.judged_by else {}
        out |= {"freedoms": list(self.freedoms), "stiffness": self.stiffness.tolist(), "kinks": list(self.kinks)}
        out |= {"touching": [asdict(k) for k in self.touching], "notes": list(self.notes)}
        curves = self.result.channels().items()
        return out | {"values": {k: {"unit": unit, "value": float(x[0])} for k, (unit, x) in curves}}

    def html(self) -> str:
        """Return a page with the equilibrium position and the stability."""
        from ..view.animation import equilibrium_page

        return equilibrium_page(self)

    def to_html(self, path: str | os.PathLike) -> None:
        """Write the page with the equilibrium position and the stability."""
        write_file(path, self.html(), PAGE)

    def _repr_html_(self) -> str:
        """The page, in a notebook."""
        from ..view.page import notebook_iframe

        return notebook_iframe(self.html())

    def __repr__(self) -> str:
        return "\n".join(f"{a}: {b}" for a, b in self.lines())


@dataclass(frozen=True)
class Jump:
    """A jump from a branch: at ``value`` the equilibrium ``before`` ceases to exist, or to be stable."""

    value: float
    before: Equilibrium = field(repr=False)
    after: Equilibrium = field(repr=False)


@dataclass(repr=False)
class EquilibriumSeries:
    """Equilibria over values of a parameter, each following from the one before.

    ``series["A.angle"]`` is a curve over the values, ``series[3]`` one equilibrium.

    Attributes
    ----------
    parameter : str
        What is varied, ``"t"`` for time.
    values : ndarray (n,)
    equilibria : list of Equilibrium
    jumps : list of Jump
        Points where the branch ended, or became unstable and was left, and the equilibria reached then.
    """

    name: str
    parameter: str
    values: np.ndarray
    equilibria: list[Equilibrium]
    jumps: list[Jump] = field(default_factory=list)

    @property
    def stability(self) -> tuple[str, ...]:
        """``"stable"``, ``"marginal"`` or ``"unstable"`` at each value."""
        return tuple(e.stability for e in self.equilibria)

    @property
    def least(self) -> np.ndarray:
        """Lowest stiffness at each value, relative to the largest force term; with controllers for constant states."""
        return np.array([e.least for e in self.equilibria])

    def __len__(self) -> int:
        return len(self.equilibria)

    def __getitem__(self, which: str | int) -> Any:
        """Return a curve over the values by name, or an equilibrium by its index."""
        if isinstance(which, str):
            return self.channel(which)[1]
        return self.equilibria[which]

    def channel(self, name: str) -> tuple[str, np.ndarray]:
        """Unit of a curve, and its values.

        Raises
        ------
        ModelError
            If there is no such curve.
        """
        found = [e.result.channel(name) for e in self.equilibria]
        return found[0][0], np.array([values[0] for _, values in found])

    def lines(self) -> list[tuple[str, str]]:
        """A table for people."""
        names = self.telling()
        head = " ".join(f"{n:>16}" for n in names)
        sizes = {n: max((abs(e[n]) for e in self.equilibria), default=0.0) for n in names}
        held = any(e.judged_by for e in self.equilibria)
        what = "stiffness with constant controllers" if held else "least stiffness"
        out = [(self.parameter, f"{'stability':<9} {what:>16} {head}")]
        for value, e in zip(self.values, self.equilibria, strict=True):
            parts = " ".join(f"{number_text(e[n], sizes[n], 8):>16}" for n in names)
            out.append((f"{value:.6g}", f"{e.stability:<9} {e.least:16.4g} {parts}"))
        for j in self.jumps:
            why = "becomes unstable" if j.before.stability == UNSTABLE else "ends"
            where = ", ".join(f"{n} {j.before[n]:.6g} -> {j.after[n]:.6g}" for n in names)
            out.append(("jump", f"at {self.parameter} = {j.value:.6g} the branch {why}: {where}"))
        return out

    def telling(self) -> list[str]:
        """Up to three of the most important curves: coordinates of the degrees of freedom, else of the first body."""
        known = self.equilibria[0].result.channels() if self.equilibria else {}
        names = [f for f in self.equilibria[0].freedoms if f in known] if self.equilibria else []
        return (names or [n for n in known if curve_parts(n)[1] in ("x", "y", "z", "angle")])[:3]

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names, all curves included."""
        jumps = [{"value": j.value, "before": j.before.as_dict(), "after": j.after.as_dict()} for j in self.jumps]
        return {
            "name": self.name,
            "parameter": self.parameter,
            "values": self.values.tolist(),
            "equilibria": [e.as_dict() for e in self.equilibria],
            "jumps": jumps,
        }

    def plot(self, *names: str, path: str | os.PathLike | None = None) -> Any:
        """Curves over the parameter, unstable parts dashed; returns the figure, or writes it to ``path``."""
        from ..view.study_plots import series

        return series(self, *names, path=path)

    def __repr__(self) -> str:
        return "\n".join(f"{a:>12}  {b}" for a, b in self.lines())
