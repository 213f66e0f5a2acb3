"""Health report of a motion: accuracy figures, contact solves, and deviations of the start from the description."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np

from .wording import number_text, tuple_text

PASSED_THROUGH = (
    0.5  # overlap, over the size of the smallest body, from which on bodies are pushed out on the other side
)


@dataclass(frozen=True)
class ContactHealth:
    """Figures of contact over a whole run.

    Attributes
    ----------
    solver : str
        What solved the contacts, and why it was chosen.
    impacts : str
        Law of impacts, and whether they come together or one after the other.
    most : int
        Contacts in one step, at most.
    worst_overlap : float [m]
        Deepest overlap after any step.
    overlap_at_start : float [m]
        Deepest overlap as described.
    residual : float [m/s]
        Largest velocity left in any solve that should vanish.
    force_residual : float
        Largest part of an impulse that was left, over the largest impulse of its solve.
    tolerance : float [m/s]
        What the residual was asked to be.
    solves, iterations, unconverged : int
        How many solves of velocities there were, all iterations, and how many solves were cut off with more left than
        what gravity makes in a step.
    worst_at : float or None [s]
        Time of the largest residual.
    size : float [m]
        Of the smallest body that touches, which overlaps are compared with.
    halved, reduced, impacted, endless : int
        Steps that were divided; impacts that gave back less than their law says, of how many; steps in which the
        sequence of impacts did not end.
    notes : tuple of str
        What else has to be said: a law of impacts that was softened, a position without unique forces (Painleve).
    """

    solver: str = ""
    impacts: str = ""
    most: int = 0
    worst_overlap: float = 0.0
    overlap_at_start: float = 0.0
    residual: float = 0.0
    force_residual: float = 0.0
    tolerance: float = 0.0
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
        """Reasons to think that the motion is wrong."""
        out = []
        if self.endless:
            out.append(
                f"in {self.endless} of {self.solves} steps the sequence of impacts did not end, and the last were "
                f"taken as inelastic: take shorter steps, method=fb.Stepping(step=...), with fewer impacts in each"
            )
        if self.size > 0.0 and self.worst_overlap > max(PASSED_THROUGH * self.size, 1.01 * self.overlap_at_start):
            out.append(
                f"bodies overlap by up to {self.worst_overlap:.2g} m, more than half of the smallest body "
                f"({self.size:.2g} m), and may have passed through each other: take shorter steps, "
                f"method=fb.Stepping(step=...)"
            )
        return tuple(out)

    def warnings(self) -> tuple[str, ...]:
        """Reasons to look at the motion twice."""
        out = list(self.notes)
        if self.halved:
            out.append(
                f"{self.halved} steps were taken in shorter ones, as joints could not follow: give shorter steps"
            )
        if self.reduced:
            law = self.impacts.partition(",")[0]
            out.append(
                f"{self.reduced} of {self.impacted} impacts gave back less than {law}'s law says, which would have "
                f"made energy there"
            )
        if self.unconverged:
            when = f", the worst at t = {self.worst_at:.4g} s" if self.worst_at is not None else ""
            share = f"{self.unconverged} of {self.solves} contact solves were cut off before they had converged{when}"
            out.append(
                f"{share}: forces are rough there; take shorter steps, or allow more by "
                f"method=fb.Stepping(iterations=...)"
            )
        if self.size > 0.0 and self.worst_overlap > max(0.02 * self.size, 1.01 * self.overlap_at_start):
            part = f"{100.0 * self.worst_overlap / self.size:.2g} per cent of the smallest body"
            out.append(f"bodies overlap by up to {self.worst_overlap:.2g} m, {part}; take shorter steps")
        if self.size > 0.0 and self.overlap_at_start > 1e-3 * self.size:
            out.append(f"bodies overlap by {self.overlap_at_start:.2g} m as described; they are pushed apart at first")
        return tuple(out)

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> ContactHealth:
        """What `as_dict` gave."""
        return cls(**(data | {"notes": tuple(data.get("notes", ()))}))


MAX_NAMED = 4  # elements that a line names
WRITTEN_PRECISION = 1e-5  # part by which numbers written with some digits are off
LARGE_VELOCITY = (
    100.0  # times the largest velocity that is given or prescribed, above which one that is not given is said
)
VELOCITY_FIELDS = ("velocity", "angular_velocity")


@dataclass(frozen=True)
class InitialDeviation:
    """A number of the description that the start does not have.

    Attributes
    ----------
    element : str
        The body.
    what : str
        Its field: ``"position"``, ``"angle"``, ``"orientation"`` (quaternion), ``"velocity"``, ``"angular_velocity"``.
    given, got : tuple of float
        As described, and where or how it starts: of the reference frame, along world axes. Of a velocity that is not
        given, and is far larger than those that are, ``given`` is empty.
    unit : str
    """

    element: str
    what: str
    given: tuple[float, ...]
    got: tuple[float, ...]
    unit: str

    @property
    def distance(self) -> float:
        """How far apart these are [unit]; of orientations the angle of the turn between them [rad]."""
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
        """As `as_dict` gave it."""
        return cls(**{**data, "given": tuple(data["given"]), "got": tuple(data["got"])})


def _components_text(values: Sequence[float], size: float) -> str:
    """Components in brackets, one number bare; what is rounding beside ``size`` is 0."""
    return number_text(values[0], size) if len(values) == 1 else tuple_text(values, 6, size)


def changed_velocities(deviations: Sequence[InitialDeviation]) -> list[InitialDeviation]:
    """Given velocities that were changed by more than the digits that users write, and others that are very large."""
    return [
        d
        for d in deviations
        if d.what in VELOCITY_FIELDS
        and d.distance > WRITTEN_PRECISION * max(np.linalg.norm(d.given), np.linalg.norm(d.got))
    ]


def velocity_not_allowed(d: InitialDeviation) -> str:
    """What to say of a velocity that the start does not have, or has unasked, and what to do."""
    if not d.given:
        return (
            f"{d.text}: more than {LARGE_VELOCITY:g} times the largest velocity that is given; the constraints need it to keep "
            f"given velocities as nearly as they can. Check those, and whether the position is near a dead centre, or "
            f"give {d.element!r} a velocity too"
        )
    return (
        f"{d.text}: joints, drivers or other given velocities do not allow it; the nearest was taken. Correct it, or "
        f"leave it out: what is not given is free"
    )


def deviation_summary(deviations: Sequence[InitialDeviation]) -> str:
    """One line: what assembly moved, and which velocities it could not keep."""
    moved: dict[str, InitialDeviation] = {}
    for d in deviations:
        if d.what not in VELOCITY_FIELDS and (d.element not in moved or d.what == "position"):
            moved[d.element] = d
    text = "closed as drawn"
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
    departures: tuple[
        InitialDeviation, ...
    ] = ()  # what of the description the start does not have: element, given, got
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
        """Joint friction -> largest creep speed [m/s] and distance [m] while it should stick; see `diagnostics.friction_creep`."""
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
