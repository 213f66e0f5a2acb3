"""The same motion by several formulations of the equations: drift, energy and cost of each."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..model.messages import listing, suggest

if TYPE_CHECKING:
    from .result import Result

FIGURE_NAMES = (
    "position_drift", "velocity_drift", "energy_drift", "difference", "steps", "rejected", "evaluations",
    "factorisations", "exchanges", "cpu",
)  # fmt: skip
COLUMN_HEADS = ("|g|", "|G v - nu|", "energy [J]", "difference", "steps", "evaluations", "CPU [ms]")


@dataclass
class Formulation:
    """One formulation, and the motion computed with it.

    Attributes
    ----------
    name, meaning : str
    success : bool
        Whether the end was reached; if not, ``message`` says why, and the curves end at ``t[-1]``.
    t : ndarray (n,) [s]
        Output times.
    g, gv, balance : ndarray (n,)
        At these: largest violation |g| of positions [m or rad] and |G v - nu| of velocities [m/s or rad/s], by the
        rows of all joints and drivers in absolute coordinates, whatever coordinates it was computed in; deviation from
        the energy balance [J].
    difference : float
        How far the motion is from the reference at any output time, or at the end: of any body the way of its mass
        centre [m] and its turn at the mechanism's length, whichever is more; nan if the end was not reached, or without
        a reference.
    steps, rejected, evaluations, factorisations : int
        Of the motion without outputs on the way; evaluations of the constraints and of the kinematics behind them.
    exchanges : int
        How often another coordinate became an independent one (coordinate partitioning).
    cpu : float
        Time of the processor [s] for the motion without outputs on the way, the median of several runs; assembly and
        compilation are not counted. Nan if the end was not reached.
    result : Result or None
        The motion itself.
    """

    name: str
    meaning: str
    success: bool
    message: str
    t: np.ndarray
    g: np.ndarray
    gv: np.ndarray
    balance: np.ndarray
    difference: float = np.nan
    steps: int = 0
    rejected: int = 0
    evaluations: int = 0
    factorisations: int = 0
    exchanges: int = 0
    cpu: float = np.nan
    result: Result | None = field(default=None, repr=False)

    @property
    def position_drift(self) -> float:
        """Largest |g| at an output time [m or rad]; nan if there is none."""
        return _largest_size(self.g)

    @property
    def velocity_drift(self) -> float:
        """Largest |G v - nu| at an output time [m/s or rad/s]."""
        return _largest_size(self.gv)

    @property
    def energy_drift(self) -> float:
        """Largest deviation from the energy balance [J]."""
        return _largest_size(self.balance)

    def as_dict(self) -> dict[str, Any]:
        """Figures as plain numbers."""
        plain = {k: getattr(self, k) for k in FIGURE_NAMES}
        return {"meaning": self.meaning, "success": self.success, "message": self.message} | plain


@dataclass
class Comparison:
    """The same motion by several formulations: ``comparison["baumgarte"]`` is one of them.

    Attributes
    ----------
    model : str
    t_end : float [s]
    formulations : tuple of Formulation
    reference : str
        Reference motion of the comparison.
    energy : float [J]
        Largest kinetic energy of the reference, nan if there is none: the reference for drifts of energy.
    options : dict
        Tolerances and the like, the same for all.
    """

    model: str
    t_end: float
    formulations: tuple[Formulation, ...]
    reference: str
    energy: float
    options: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Formulation:
        for f in self.formulations:
            if f.name == name:
                return f
        raise ModelError(f"{name!r} was not compared{suggest(str(name), self.names)}; {listing(list(self.names))}")

    def __iter__(self) -> Iterator[Formulation]:
        return iter(self.formulations)

    def __len__(self) -> int:
        return len(self.formulations)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the formulations."""
        return tuple(f.name for f in self.formulations)

    def lines(self) -> list[tuple[str, str]]:
        """Return a table, and the formulations that did not reach the end."""
        widths = [max(11, len(c)) for c in COLUMN_HEADS]
        out = [("formulation", " ".join(f"{c:>{w}}" for c, w in zip(COLUMN_HEADS, widths, strict=True)))]
        for f in self.formulations:
            cells = [f"{x:.1e}" for x in (f.position_drift, f.velocity_drift, f.energy_drift, f.difference)]
            cells += [str(f.steps + f.rejected), str(f.evaluations), f"{1e3 * f.cpu:.3g}"]
            text = " ".join(f"{'-' if c == 'nan' else c:>{w}}" for c, w in zip(cells, widths, strict=True))
            out.append((f.name, text if len(f.t) else "-"))
        out += [(f"{f.name} failed", f.message) for f in self.formulations if not f.success]
        for f in self.formulations:
            more = f"; here coordinates changed places {f.exchanges} times" if f.exchanges else ""
            out.append((f"{f.name} is", f.meaning + more))
        size = "" if np.isnan(self.energy) else f"; its largest kinetic energy is {self.energy:.3g} J"
        return [*out, ("reference", self.reference + size)]

    def as_dict(self) -> dict[str, Any]:
        """Figures as plain numbers and names; the curves over time are attributes of the formulations."""
        head = {"model": self.model, "t_end": self.t_end, "reference": self.reference, "kinetic_energy": self.energy}
        return head | {"options": self.options, "formulations": {f.name: f.as_dict() for f in self.formulations}}

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Drift and energy over time, and cost; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.result_plots import comparison_plot

        return comparison_plot(self, path)

    def __repr__(self) -> str:
        width = max(len(label) for label, _ in self.lines())
        return "\n".join(f"{label:<{width}}  {text}" for label, text in self.lines())


def _largest_size(x: np.ndarray) -> float:
    return float(np.abs(x).max()) if len(x) else float("nan")
