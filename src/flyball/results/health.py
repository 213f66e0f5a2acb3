"""Health report of a motion: accuracy figures, contact solves, and deviations of the start from the description."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np

from .wording import number_text, tuple_text

PASSED_THROUGH = (
    0.5  # overlap, relative to the size of the smallest body, above which bodies may be pushed out on the other side
)


DRIVEN_REMEDY = "or a Motor in place of a Driver that moves a body against another: no contact force can stop a Driver"


@dataclass(frozen=True)
class ContactHealth:
    """Figures of contact over a whole run.

    Attributes
    ----------
    solver : str
        Contact solver, and why it was chosen.
    impacts : str
        Impact law, and whether impacts are simultaneous or sequential.
    most : int
        Largest number of contacts in one step.
    worst_overlap : float [m]
        Deepest overlap after any step.
    overlap_at_start : float [m]
        Deepest overlap as described.
    residual : float [m/s]
        Largest residual velocity of any solve.
    force_residual : float
        Largest residual impulse relative to the largest impulse of its solve.
    tolerance : float [m/s]
        Tolerance of the residual.
    step : float [s]
        Longest step; steps are shortened so that they end at the output times.
    step_reason : str
        Why this step.
    solves, iterations, unconverged : int
        Number of velocity solves, of all iterations, and of solves stopped with a residual larger than the velocity
        that gravity adds in a step.
    worst_at : float or None [s]
        Time of the largest residual.
    size : float [m]
        Size of the smallest body in contact, the reference for overlaps.
    halved, reduced, impacted, endless : int
        Number of divided steps; of impacts with less rebound than their law prescribes, and of all impacts; of steps in
        which the sequence of impacts did not end.
    notes : tuple of str
        Further remarks: a softened impact law, a position without unique forces (Painleve).
    """

    solver: str = ""
    impacts: str = ""
    most: int = 0
    worst_overlap: float = 0.0
    overlap_at_start: float = 0.0
    residual: float = 0.0
    force_residual: float = 0.0
    tolerance: float = 0.0
    step: float = 0.0
    step_reason: str = ""
    solves: int = 0
    iterations: int = 0
    unconverged: int = 0
    worst_at: float | None = None
    size: float = 0.0
    notes: tuple[str, ...] = field(default_factory=tuple)
    halved: int = 0
    reduced: int = 0
    impacted: int = 0
    endless: int = 0

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts for people."""
        out = [("contact", f"{self.most} contacts at most")]
        if self.solver:
            out.append(("contact solver", self.solver))
        if self.step:
            out.append(("contact step", f"at most {self.step:.3g} s, {self.step_reason}"))
        if self.impacts:
            out.append(("impacts", self.impacts))
        out.append(("worst overlap", f"{self.worst_overlap:.2g} m"))
        out.append(("contact residual", f"{self.residual:.2e} m/s, {self.force_residual:.2e} of the largest force"))
        if self.solves:
            left = f", {self.unconverged} not converged" if self.unconverged else ""
            out.append(("contact solves", f"{self.solves}, {self.iterations / self.solves:.3g} iterations each{left}"))
        return out

    @property
    def doubts(self) -> tuple[str, ...]:
        """Return reasons why the motion may be wrong."""
        out = []
        if self.endless:
            out.append(
                f"in {self.endless} of {self.solves} steps the sequence of impacts did not end, and the last impacts "
                "were computed as inelastic: take shorter steps, method=fb.Stepping(step=...), with fewer impacts in "
                "each"
            )
        if self.size > 0.0 and self.worst_overlap > max(PASSED_THROUGH * self.size, 1.01 * self.overlap_at_start):
            out.append(
                f"bodies overlap by up to {self.worst_overlap:.2g} m, more than half of the smallest body "
                f"({self.size:.2g} m), and may have passed through each other: take shorter steps, "
                f"method=fb.Stepping(step=...), {DRIVEN_REMEDY}"
            )
        return tuple(out)

    def warnings(self) -> tuple[str, ...]:
        """Return reasons to check the motion."""
        out = list(self.notes)
        if self.halved:
            out.append(f"{self.halved} steps were divided, since joints could not be closed: give shorter steps")
        if self.reduced:
            law = self.impacts.partition(",")[0]
            out.append(
                f"{self.reduced} of {self.impacted} impacts rebound less than {law}'s law prescribes, since that "
                "rebound would have added energy"
            )
        if self.unconverged:
            when = f", the worst at t = {self.worst_at:.4g} s" if self.worst_at is not None else ""
            share = f"{self.unconverged} of {self.solves} contact solves were stopped before convergence{when}"
            out.append(
                f"{share}: their forces are inaccurate; take shorter steps, or allow more iterations by "
                "method=fb.Stepping(iterations=...)"
            )
        if self.size > 0.0 and self.worst_overlap > max(0.02 * self.size, 1.01 * self.overlap_at_start):
            part = f"{100.0 * self.worst_overlap / self.size:.3g} per cent of the smallest body"
            out.append(
                f"bodies overlap by up to {self.worst_overlap:.2g} m, {part}; take shorter steps, {DRIVEN_REMEDY}"
            )
        if self.size > 0.0 and self.overlap_at_start > 1e-3 * self.size:
            out.append(
                f"bodies overlap by {self.overlap_at_start:.2g} m in the reference configuration; they are pushed "
                "apart at the start"
            )
        return tuple(out)

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> ContactHealth:
        """Restore from the result of `as_dict`."""
        return cls(**(data | {"notes": tuple(data.get("notes", ()))}))


MAX_NAMED = 4  # number of elements in a line
WRITTEN_PRECISION = 1e-5  # relative error of numbers written with few digits
LARGE_VELOCITY = (
    100.0  # times the largest given or prescribed velocity: larger velocities that were not given are reported
)
VELOCITY_FIELDS = ("velocity", "angular_velocity")


@dataclass(frozen=True)
class InitialDeviation:
    """A number of the description that the initial state does not satisfy.

    Attributes
    ----------
    element : str
        The body.
    what : str
        Its field: ``"position"``, ``"angle"``, ``"orientation"`` (quaternion), ``"velocity"``, ``"angular_velocity"``.
    given, got : tuple of float
        Value as described, and initial value: of the reference frame, in world axes. ``given`` is empty for a velocity
        that is not given but far larger than the given ones.
    unit : str
    """

    element: str
    what: str
    given: tuple[float, ...]
    got: tuple[float, ...]
    unit: str

    @property
    def distance(self) -> float:
        """Difference [unit]; of orientations the angle of the rotation between them [rad]."""
        a, b = np.array(self.given or (0.0,) * len(self.got)), np.array(self.got)
        if self.what == "orientation":
            # |a - b| = 2 |sin(theta / 4)|, |a + b| = 2 |cos(theta / 4)|; b and -b are the same orientation
            apart, opposite = sorted((float(np.linalg.norm(a - b)), float(np.linalg.norm(a + b))))
            return float(4.0 * np.arctan2(apart, opposite))
        return float(np.linalg.norm(b - a))

    @property
    def text(self) -> str:
        """In words."""
        field = self.what.replace("_", " ")
        size = max(map(abs, (*self.given, *self.got)), default=0.0)
        given = f"given {_components_text(self.given, size)}" if self.given else "not given"
        return f"{field} of {self.element!r}: {given}, got {_components_text(self.got, size)} {self.unit}"

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "element": self.element,
            "what": self.what,
            "given": list(self.given),
            "got": list(self.got),
            "unit": self.unit,
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> InitialDeviation:
        """Restore from the result of `as_dict`."""
        return cls(**{**data, "given": tuple(data["given"]), "got": tuple(data["got"])})


def _components_text(values: Sequence[float], size: float) -> str:
    """Return components in brackets, a single one bare; values negligible beside ``size`` are 0."""
    return number_text(values[0], size) if len(values) == 1 else tuple_text(values, 6, size)


def changed_velocities(deviations: Sequence[InitialDeviation]) -> list[InitialDeviation]:
    """Return given velocities that changed by more than the digits that users write, and others that are very large."""
    return [
        d
        for d in deviations
        if d.what in VELOCITY_FIELDS
        and d.distance > WRITTEN_PRECISION * max(np.linalg.norm(d.given), np.linalg.norm(d.got))
    ]


def velocity_not_allowed(d: InitialDeviation) -> str:
    """Return the message on an unsatisfied, or unexpected, initial velocity, with remedies."""
    if not d.given:
        return (
            f"{d.text}: more than {LARGE_VELOCITY:g} times the largest velocity that is given; the constraints need "
            "it for velocities as near as possible to the given ones. Check those, and whether the position is near "
            f"a dead centre, or give {d.element!r} a velocity too"
        )
    return (
        f"{d.text}: joints, drivers or other given velocities do not allow it; the nearest possible velocity is used. "
        "Correct it, or leave it out: velocities that are not given are free"
    )


def deviation_summary(deviations: Sequence[InitialDeviation]) -> str:
    """Return one line: what assembly moved, and which velocities were changed."""
    moved: dict[str, InitialDeviation] = {}
    for d in deviations:
        if d.what not in VELOCITY_FIELDS and (d.element not in moved or d.what == "position"):
            moved[d.element] = d
    text = "closed in the reference configuration"
    if moved:
        count = f"{len(moved)} {'body' if len(moved) == 1 else 'bodies'}"
        worst = max(moved.values(), key=lambda d: (d.what == "position", d.distance))
        far = (
            f"{worst.distance:.3g} m" if worst.what == "position" else f"turned by {np.degrees(worst.distance):.3g} deg"
        )
        text = f"closed after moving {count}, {worst.element} farthest: {far}"
    changed = changed_velocities(deviations)
    for what, found in (
        ("velocities that the constraints do not allow", [d for d in changed if d.given]),
        ("velocities far larger than those given", [d for d in changed if not d.given]),
    ):
        if found:
            more = f"; and {len(found) - MAX_NAMED} more" if len(found) > MAX_NAMED else ""
            text += f"; {what}: {'; '.join(d.text for d in found[:MAX_NAMED])}{more}"
    return text


DEFERRED_FIGURES = (
    *("freedoms", "redundant", "redundant_cut", "undetermined", "energy_drift", "acceleration_violation", "creep"),
    *("warnings", "doubtful"),
)
"""Figures that are computed on demand."""


@dataclass
class Health:
    """Figures by which to judge whether a result can be trusted.

    Expensive ones (degrees of freedom by rank, undetermined reactions, the energy balance, creep, warnings) are
    computed on demand.
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
    method: str = ""  # method of a motion with contact, and why
    engine: str = ""  # engine or generated code, and where the code comes from
    crowd: int = 0  # bodies in sets, whose degrees of freedom are not counted
    remarks: tuple[str, ...] = ()  # warnings of the analysis itself
    departures: tuple[InitialDeviation, ...] = ()  # unsatisfied numbers of the description: element, given, got
    event_detection: str = ""  # resolution of event detection
    compiling: float = 0.0  # part of these seconds for compiling or loading code at first calls [s]
    events: str = ""  # number of events, and how often each occurred
    contact: ContactHealth | None = None  # contact solver, if there are contacts

    @property
    def simulated(self) -> bool:
        """Return whether these are figures of a motion, rather than of one state."""
        return "energy_drift" in self.late

    def _found(self, name: str) -> Any:
        value = self.late[name]
        if callable(value):
            value = self.late[name] = value()
        return value

    @property
    def status(self) -> str:
        """How it ended: ``"done"``, or the time and the event of the model that stopped it, or the error."""
        end = "done" if self.success and self.simulated and not self.ended_early else self.message
        return f"{end}, but doubtful" if self.success and self.doubtful else end

    @property
    def ended_early(self) -> bool:
        """Whether an event of the model stopped the motion."""
        return self.success and self.message.startswith("ended at ")

    @property
    def freedoms(self) -> int:
        """Degrees of freedom by rank, at the start."""
        return self._found("mobility").freedoms

    @property
    def redundant(self) -> tuple[str, ...]:
        """Joints with dependent constraints."""
        return self._found("mobility").redundant

    @property
    def redundant_cut(self) -> str:
        """Why `redundant` and `undetermined` are incomplete for a too large mechanism, if so."""
        return self._found("mobility").cut

    @property
    def undetermined(self) -> dict[str, tuple[str, ...]]:
        """Joint -> reaction components (world axes) that redundancy leaves undetermined."""
        return self._found("mobility").undetermined

    @property
    def energy_drift(self) -> float:
        """Largest deviation from the energy balance [J]; 0 if nothing was simulated, nan if not measured."""
        return self._found("energy_drift") if self.simulated else 0.0

    @property
    def balance(self) -> str:
        """Description of the accuracy of the energy balance."""
        if math.isnan(self.energy_drift):
            return "not measured: fewer than two output times"
        return f"{self.energy_drift:.2e} J largest deviation"

    @property
    def acceleration_violation(self) -> float:
        """Largest |G vdot - gamma| at output times, relative to its terms."""
        return self._found("acceleration_violation") if "acceleration_violation" in self.late else 0.0

    @property
    def creep(self) -> dict[str, tuple[float, float]]:
        """Joint friction -> largest creep speed [m/s] and distance [m]; see `diagnostics.friction_creep`."""
        return self._found("creep") if "creep" in self.late else {}

    @property
    def doubtful(self) -> tuple[str, ...]:
        """Reasons why the motion may not satisfy its tolerance: energy, accelerations, constraints."""
        return tuple(self._found("doubtful")) if "doubtful" in self.late else ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to check the result: energy balance, violated constraints, undetermined loads, creep."""
        found = self._found("warnings") if "warnings" in self.late else self.remarks
        own = self.contact.warnings() if self.contact else ()
        return tuple(dict.fromkeys((*found, *own)))

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        plain = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "late"}
        plain["contact"] = self.contact.as_dict() if self.contact else None
        plain["departures"] = [d.as_dict() for d in self.departures]
        return plain | {k: getattr(self, k) for k in DEFERRED_FIGURES}

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
            *([("assembly", deviation_summary(self.departures))] if self.departures else []),
            ("freedoms", str(self.freedoms) + (f", and those of {self.crowd} bodies in sets" if self.crowd else "")),
            ("steps", f"{self.steps} accepted, {self.rejected} rejected"),
            ("energy balance", self.balance),
            ("violation", f"{self.violation:.2e} of positions, {self.velocity_violation:.2e} of velocities"),
            ("time used", f"{self.seconds:.2f} s{self._compiled}"),
        ]
        out = [line for line in out if self.simulated or line[0] not in ("steps", "energy balance", "time used")]
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
        if self.event_detection:
            out.append(("event detection", self.event_detection))
        if self.events:
            out.append(("events", self.events))
        if self.contact:
            out += self.contact.lines()
        out += [("doubtful", text) for text in self.doubtful]
        others = [text for text in self.warnings if text not in self.doubtful]
        return out + [(f"warning {k}", text) for k, text in enumerate(others, 1)]

    def __str__(self) -> str:
        lines = self.lines()
        width = max(len(k) for k, _ in lines)
        return "\n".join(f"{k:<{width}}  {v}" for k, v in lines)
