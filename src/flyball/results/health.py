"""How well a motion was computed: what every result says about itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any

from .contact_health import ContactHealth
from .departure import Departure, summary

LATE = (
    *("freedoms", "redundant", "redundant_cut", "undetermined", "energy_drift", "acceleration_violation", "creep"),
    *("warnings", "doubtful"),
)
"""Figures that are found when first asked for."""


@dataclass
class Health:
    """Figures that tell whether a result can be trusted.

    Those that take time to find (freedoms by rank, undetermined reactions, the energy balance, creep, warnings) are
    found when first asked for.
    """

    success: bool
    message: str
    violation: float  # largest |g| at a reported time [m or rad]
    velocity_violation: float  # largest |G v - nu| at a reported time [m/s or rad/s]
    steps: int
    rejected: int
    evaluations: int
    factorisations: int
    seconds: float  # wall time, assembly included [s]
    options: dict[str, Any] = field(default_factory=dict)
    late: dict[str, Callable[[], Any]] = field(default_factory=dict, repr=False, compare=False)
    coordinates: str = ""  # "absolute: why", or "joint: why"
    method: str = ""  # by what a motion with contact was computed, and why
    engine: str = ""  # "table-driven: why", or "made for this mechanism: where from"
    crowd: int = 0  # bodies in sets, whose freedoms are not counted
    remarks: tuple[str, ...] = ()  # warnings that the analysis itself has to give
    departures: tuple[Departure, ...] = ()  # what of the description the start does not have: element, given, got
    watched: str = ""  # how closely it was looked for events
    compiling: float = 0.0  # of these seconds, those in which code was compiled or read: at first calls [s]
    events: str = ""  # how many happened at instants, and how often each
    contact: ContactHealth | None = None  # how contacts were solved, where there are any

    @property
    def _simulated(self) -> bool:
        """Whether these are figures of a motion, rather than of one state."""
        return "energy_drift" in self.late

    def _found(self, name: str) -> Any:
        value = self.late[name]
        if callable(value):
            value = self.late[name] = value()
        return value

    @property
    def status(self) -> str:
        """How it ended: ``"done"``, or where and by which event of the model, or why it could not go on."""
        end = "done" if self.success and self._simulated and not self.ended_early else self.message
        return f"{end}, but doubtful" if self.success and self.doubtful else end

    @property
    def ended_early(self) -> bool:
        """Whether an event of the model ended the motion, as asked for."""
        return self.success and self.message.startswith("ended at ")

    @property
    def freedoms(self) -> int:
        """Freedoms by rank, at the start."""
        return self._found("mobility").freedoms

    @property
    def redundant(self) -> tuple[str, ...]:
        """Joints whose constraints depend on one another."""
        return self._found("mobility").redundant

    @property
    def redundant_cut(self) -> str:
        """In words, whether `redundant` and `undetermined` are not complete, since the mechanism is too large."""
        return self._found("mobility").cut

    @property
    def undetermined(self) -> dict[str, tuple[str, ...]]:
        """Joint -> reaction components (world axes) that redundancy leaves undetermined."""
        return self._found("mobility").undetermined

    @property
    def energy_drift(self) -> float:
        """Largest deviation from the energy balance [J]; 0 where nothing was simulated, nan where not measured."""
        return self._found("energy_drift") if self._simulated else 0.0

    @property
    def balance(self) -> str:
        """How well the energy balance closes, in words."""
        if math.isnan(self.energy_drift):
            return "not measured: it compares the energy at output times, and there are fewer than two"
        return f"{self.energy_drift:.2e} J largest deviation"

    @property
    def acceleration_violation(self) -> float:
        """Largest |G vdot - gamma| at output times, relative to the terms that make it up."""
        return self._found("acceleration_violation") if "acceleration_violation" in self.late else 0.0

    @property
    def creep(self) -> dict[str, tuple[float, float]]:
        """Joint friction -> largest creep speed [m/s] and distance [m] while it should stick; see `doubts.creep`."""
        return self._found("creep") if "creep" in self.late else {}

    @property
    def doubtful(self) -> tuple[str, ...]:
        """Reasons to think that the motion is not what its tolerance asks for: energy, accelerations, constraints."""
        return tuple(self._found("doubtful")) if "doubtful" in self.late else ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to look at the result twice: energy balance, violated constraints, undetermined loads, creep."""
        found = self._found("warnings") if "warnings" in self.late else self.remarks
        own = self.contact.warnings() if self.contact else ()
        return tuple(dict.fromkeys((*found, *own)))

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        plain = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "late"}
        plain["contact"] = self.contact.as_dict() if self.contact else None
        plain["departures"] = [d.as_dict() for d in self.departures]
        return plain | {k: getattr(self, k) for k in LATE}

    @property
    def _compiled(self) -> str:
        return f", of which {self.compiling:.2f} s of compiling" if self.compiling > 0.1 * self.seconds else ""

    def lines(self) -> list[tuple[str, str]]:
        """Label and text of what a reader wants to see first."""
        out = [
            ("status", self.status),
            *([("method", self.method)] if self.method else []),
            *([("coordinates", self.coordinates)] if self.coordinates else []),
            *([("engine", self.engine)] if self.engine else []),
            *([("assembly", summary(self.departures))] if self.departures else []),
            ("freedoms", str(self.freedoms) + (f", and those of {self.crowd} bodies in sets" if self.crowd else "")),
            ("steps", f"{self.steps} accepted, {self.rejected} refused"),
            ("energy balance", self.balance),
            ("violation", f"{self.violation:.2e} of positions, {self.velocity_violation:.2e} of velocities"),
            ("time used", f"{self.seconds:.2f} s{self._compiled}"),
        ]
        out = [line for line in out if self._simulated or line[0] not in ("steps", "energy balance", "time used")]
        more = []
        if self.redundant:
            more.append(("redundant", "; ".join(filter(None, (", ".join(self.redundant), self.redundant_cut)))))
        if self.undetermined:
            text = "; ".join(f"{k}: {', '.join(v)}" for k, v in self.undetermined.items())
            more.append(("reactions not determined", text))
        after = 1 + next(k for k, (label, _) in enumerate(out) if label == "freedoms")
        out[after:after] = more
        crept = {k: c for k, c in self.creep.items() if c[1] > 0.0}
        if crept:
            text = "; ".join(f"{k}: {way:.2e} m at up to {speed:.2e} m/s" for k, (speed, way) in crept.items())
            out.append(("creep of friction", text))
        if self.watched:
            out.append(("watched", self.watched))
        if self.events:
            out.append(("events", self.events))
        if self.contact:
            out += self.contact.lines()
        out += [("doubtful", text) for text in self.doubtful]
        others = [text for text in self.warnings if text not in self.doubtful]
        return out + [(f"warning {k}", text) for k, text in enumerate(others, 1)]

    def __str__(self) -> str:
        width = max(len(k) for k, _ in self.lines())
        return "\n".join(f"{k:<{width}}  {v}" for k, v in self.lines())
