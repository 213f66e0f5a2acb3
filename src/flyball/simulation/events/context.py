"""Event context: the motion at an instant, the bounds of its switches, and locking and releasing.

All code that resolves an event reads and writes the `EventContext`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...assembly.compiled_mechanism import CompiledMechanism
from ...constraints.switches.switch_kind import FROZEN, HELD, OFF
from ...engine.entry_point import MOTION, POSITION, evaluate_state
from ...engine.guards import ForceDistribution, empty_distribution
from ...errors import SimulationError
from ...model.contact_point import Touch
from ...model.event import Event, Lock, Release
from ...model.event_validation import LockTarget, lock_target
from ...numerics.integrators.time_loop import StepState
from ...results.result import Result
from ...tables.constraint_rows import SwitchSpec
from ...tables.structure_definition import Structure
from ..initial_state import InitialState


@dataclass
class EventContext:
    """The state of a motion at an instant.

    Modes are in ``c.work.modes``. The states of switches (side, direction of sliding) follow the measured quantities in
    ``c.work.sensed`` (see `engine.rows.direction_column`).

    Attributes
    ----------
    start : InitialState
        Start of the motion, with its coordinates.
    clock : StepState
        State of the integrator: its time and state are those of the instant.
    records : list of EventRecord
        Events so far, in order.
    lost : float
        Mechanical energy [J] that impacts and sudden changes dissipated so far.
    given : float
        Mechanical energy [J] that applied impulses and changed parameters supplied so far.
    stopped : str
        Why the motion ends here; empty: it continues.
    external_impulse : ndarray, optional
        Generalised impulse (nv,) applied at this instant, used by the next jump.
    external_impulses : list
        The applied impulses that it consists of; see `results.reactions.AppliedImpulse`.
    doubts : list of str
        Health remarks on what rigid-body equations left undetermined.
    bounces : dict
        Switch -> `impacts.BounceSeries`: its recent impacts.
    corner_passages : dict
        Switch -> times of the last passages through its corner.
    counts : dict
        Event -> how often it happened so far.
    true : list of str
        Events whose comparisons were true at the start of the motion.
    settled_keys : dict
        What actions settled at the instant ``settled_at`` -> event and action.
    nothing : mapping
        Guard -> the rounding of its value at the instant, where that is known.
    zero : dict
        Event -> size of its guard where it last triggered: zero to rounding.
    final_signs : dict
        Event -> the last sign of its guard, where the guard is zero to rounding at the end of the motion.
    fresh : bool
        Whether forces or velocities jump at the instant: the next step is then no wider than recent ones.
    instant_problem : InstantProblem, optional
        Workspace for resolving instants (`events.instant_problem`).
    failed : Exception
        Why the motion cannot continue.
    detection_remark : str
        Description of how closely events were detected.
    method : str
        Description of the methods used, where there were several.
    missed_crossings : frozenset of int
        Switches whose crossing was missed (`event_loop.missed_crossings`): stops left in the wrong direction at
        negligible speed, which close without a bounce, and corners whose laws were on the wrong side.
    sharing : ForceDistribution, optional
        Rows that hold together with indeterminate forces (`engine.guards`).
    tied : frozenset of tuple
        Guards (kind, switch) of quantities at a bound that other active rows keep there.
    least : dict
        Switch -> force that is rounding, for the rows of the last mode decision.
    still : tuple of int
        Measured quantities whose rates active rows keep at zero (`mode_selection.held_rates`).
    engaging : dict
        Switch -> rate that its driver prescribes: drivers that engage at the instant.
    recorder : PhaseRecorder, optional
        Modes at the output rows so far (`event_loop.PhaseRecorder`).
    """

    start: InitialState
    clock: StepState
    records: list[Any] = field(default_factory=list)
    lost: float = 0.0
    stopped: str = ""
    fresh: bool = False
    instant_problem: Any = None
    failed: Exception | None = None
    detection_remark: str = ""
    method: str = ""
    given: float = 0.0
    external_impulse: np.ndarray | None = None
    external_impulses: list[Any] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)
    bounces: dict[int, Any] = field(default_factory=dict)
    corner_passages: dict[int, list[float]] = field(default_factory=dict)
    tied: frozenset[tuple[int, int]] = frozenset()
    least: dict[int, float] = field(default_factory=dict)
    still: tuple[int, ...] = ()
    engaging: dict[int, float] = field(default_factory=dict)
    recorder: Any = None
    sharing: Any = None
    counts: dict[str, int] = field(default_factory=dict)
    settled_keys: dict[str, Any] = field(default_factory=dict)
    settled_at: float = float("nan")
    missed_crossings: frozenset[int] = frozenset()
    true: list[str] = field(default_factory=list)
    nothing: Mapping[int, float] = field(default_factory=dict)
    zero: dict[str, float] = field(default_factory=dict)
    final_signs: dict[str, float] = field(default_factory=dict)

    @property
    def c(self) -> CompiledMechanism:
        """Tables and workspace of the mechanism."""
        return self.start.assembly.compiled

    @property
    def structure(self) -> Structure:
        """Structure of the mechanism."""
        return self.c.structure

    @property
    def t(self) -> float:
        """The instant [s]."""
        return float(self.clock.real.t)

    @property
    def y(self) -> np.ndarray:
        """The state (q, v, z) at the instant, writable in place, (ny,)."""
        return self.clock.y.current

    @property
    def group(self) -> ForceDistribution:
        """The rows that share indeterminate forces; `empty_distribution` when first accessed."""
        if self.sharing is None:
            self.sharing = empty_distribution(len(self.c.system.switches.row), len(self.c.system.rows.law))
        return self.sharing

    @property
    def q(self) -> np.ndarray:
        """Positions, writable in place, (nq,)."""
        return self.y[: self.structure.nq]

    @property
    def v(self) -> np.ndarray:
        """Velocities, writable in place, (nv,)."""
        return self.y[self.structure.nq : self.structure.nq + self.structure.nv]

    def evaluate(self) -> None:
        """Evaluate kinematics, rows, forces and measured quantities at the state of the instant."""
        evaluate_state(*self.c.buffers, self.t, self.y.copy(), MOTION)

    def names(self) -> dict[str, float]:
        """Return the values of all names in event expressions, at the state last evaluated."""
        c, sensed = self.c, self.c.work.sensed
        return {"t": self.t, **c.values.env, **{k: float(sensed.value[m]) for k, m in self.structure.slots.items()}}


PRINTED_ZERO = 1e-12  # m or rad: printed as 0


def switch_units(s: Structure) -> list[str]:
    """Return the unit of every switch's quantity: m or rad."""
    rows = len(s.rows)
    measures = {t.row - rows: t.formula.measure for t in s.terms if t.measured and t.index == 0}
    return ["m" if measures.get(x.measured) == "m" else "rad" for x in s.switches]


def switch_scales(s: Structure, length: float) -> np.ndarray:
    """Return the reference length of every switch's quantity: the mechanism's length, or a radian, (ns,)."""
    return np.array([length if unit == "m" else 1.0 for unit in switch_units(s)])


def bounded_quantity(spec: SwitchSpec) -> str:
    """Return the name of a switch's quantity, for messages."""
    if spec.switch.path:
        return "its gap" if isinstance(spec.element, Touch) else "its length"
    return repr(spec.switch.along[0]) if len(spec.switch.along) == 1 else f"the play of {', '.join(spec.switch.along)}"


def value_in_words(x: float, unit: str) -> str:
    """Return a value with its unit; an angle in degrees too."""
    if abs(x) < PRINTED_ZERO:
        return f"0 {unit}"
    return f"{x:.6g} m" if unit == "m" else f"{x:.6g} rad ({math.degrees(x):.4g} deg)"


def violated_rule(spec: SwitchSpec, x: float, bounds: tuple[float, float], unit: str) -> str:
    """Describe a quantity and the bound that it violates."""
    lower, upper = bounds
    must = f"at least {value_in_words(lower, unit)}" if x < lower else f"at most {value_in_words(upper, unit)}"
    return f"{bounded_quantity(spec)} is {value_in_words(x, unit)} and must be {must}"


def violated_bounds(here: EventContext, near: np.ndarray) -> dict[int, float]:
    """Return the switches beyond their bounds, or off the tooth that holds them, by more than ``near``, and the
    distance.

    A closed stop whose quantity is no longer at its bound but on its free side is opened. Quantities at the state are
    in the workspace.
    """
    S, W, out = here.c.system, here.c.work, dict[int, float]()
    ways = W.sensed.value[W.sensed.shape[1] - W.modes.mode.shape[0] :]
    for s, spec in enumerate(here.structure.switches):
        kind = spec.switch.kind
        if kind.keeps_bounds:
            past = kind.distance_from_bounds(W.modes, S.switch_numbers, s, W.sensed.value[spec.measured])
            if past > near[s]:
                out[s] = past
            elif W.modes.mode[s] == HELD:
                kind.follow_bound(W.modes, ways, s, W.sensed.value[spec.measured], near[s])
    return out


CLOSED_TOLERANCE = 1e-6  # largest gap of a released joint that can be locked, relative to the mechanism's length
RELEASED = 1.0  # in `Modes.released`: the element was released and is inactive


def lock(here: EventContext, e: Event, a: Lock) -> str:
    """Lock coordinates at their values, lock a closed joint, engage a driver, or reactivate a limit or rope.

    Raises
    ------
    SimulationError
        If the joint is open.
    """
    W, S = here.c.work, here.c.system
    held = lock_target(here.structure.model, e, a)
    for k in switch_numbers_of(here, held):
        if held.element:
            W.modes.released[k] = 0.0
            W.modes.lower[k], W.modes.upper[k] = S.switch_numbers.lower[k], S.switch_numbers.upper[k]
            here.given += elastic_energy(here, k)
            continue
        if held.driver:
            engage(here, k)
            continue
        x = W.sensed.value[S.switches.measured[k]]
        if held.joint and abs(x) > CLOSED_TOLERANCE * here.c.values.length:
            raise SimulationError(
                f"at t = {here.t:.9g} s {a.title} in {e.title}: it is open by {abs(x):.3g}, and can lock again only "
                "where its bodies meet; choose a condition of the event that holds there",
                t=here.t,
            )
        if W.modes.mode[k] == OFF:
            W.modes.hold[k] = 0.0 if held.joint else x
        W.modes.mode[k] = HELD
    return f"{a.what} is in force" if held.element or held.driver else f"locked {a.what}"


def engage(here: EventContext, k: int) -> None:
    """Let a released driver prescribe its coordinate again: its law continues from the present value."""
    W, row = here.c.work, here.structure.switches[k].row
    if W.modes.mode[k] != OFF:
        return
    W.modes.mode[k], W.modes.hold[k] = HELD, 0.0
    evaluate_state(*here.c.buffers, here.t, here.y.copy(), POSITION)
    W.modes.hold[k], here.engaging[k] = W.rows.value[row], float(W.rows.nu[row])
    W.modes.mode[k] = OFF  # until its impact is resolved
    here.evaluate()


def release(here: EventContext, e: Event, a: Release) -> str:
    """Release coordinates, a joint, a driver, a limit or a rope."""
    W = here.c.work
    ways = W.sensed.value[W.sensed.shape[1] - W.modes.mode.shape[0] :]
    held, switches = lock_target(here.structure.model, e, a), here.structure.switches
    every = switch_numbers_of(here, held)
    if not any(W.modes.released[k] == 0.0 if held.element else W.modes.mode[k] != OFF for k in every):
        return f"{a.what} was {'released already' if held.element or held.driver else 'not locked'}"
    for k in every:
        if held.element:
            here.given -= elastic_energy(here, k)
        W.modes.mode[k], ways[k] = OFF, FROZEN if switches[k].switch.kind.elastic else 0.0
        if held.element:
            W.modes.released[k], W.modes.lower[k], W.modes.upper[k] = RELEASED, -np.inf, np.inf
    return f"released {a.what}"


def elastic_energy(here: EventContext, k: int) -> float:
    """Return the energy [J] of an elastic switch at the state last evaluated; releasing it removes that energy."""
    S, W = here.c.system, here.c.work
    if not here.structure.switches[k].switch.kind.elastic:
        return 0.0
    x = W.sensed.value[S.switches.measured[k]]
    depth = max(W.modes.lower[k] - x, x - W.modes.upper[k], 0.0)
    return float(0.5 * S.switch_numbers.stiffness[k] * depth**2)


def switch_numbers_of(here: EventContext, target: LockTarget) -> list[int]:
    """Return the switches of what an action locks or releases."""
    out = []
    commanded = target.joint or target.driver
    for k, spec in enumerate(here.structure.switches):
        own = isinstance(spec.element, Event)
        if (own and spec.switch.label in target.coordinates) or (
            not own
            and spec.element.name == (commanded or target.element)
            and spec.switch.kind.commanded == bool(commanded)
        ):
            out.append(k)
    return out


def restore_locks(here: EventContext, before: Result) -> None:
    """Restore locks and releases as at the end of an earlier motion."""
    phases = getattr(before, "phases", None)
    if phases is None or not phases.all:
        return
    last, W = phases.all[-1], here.c.work
    old = {(x.element.name, x.switch.label): k for k, x in enumerate(last.values.structure.switches)}
    for k, spec in enumerate(here.structure.switches):
        j = old.get((spec.element.name, spec.switch.label))
        if j is None:
            continue
        if spec.switch.kind.commanded:
            W.modes.mode[k], W.modes.hold[k] = last.modes.mode[j], last.modes.hold[j]
        elif last.modes.released[j] == RELEASED:
            W.modes.released[k], W.modes.lower[k], W.modes.upper[k] = RELEASED, -np.inf, np.inf
            W.sensed.value[W.sensed.shape[1] - W.modes.mode.shape[0] + k] = FROZEN if spec.switch.kind.elastic else 0.0
