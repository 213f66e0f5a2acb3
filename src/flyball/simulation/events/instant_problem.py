"""The complementarity problem at an instant: its workspace, and the stops, locks and friction rows in it.

`InstantProblem` evaluates quantities and rates of all switches, the problem of the rows that take part, and responses
to generalised forces. `rows_of_velocities` and `rows_of_accelerations` select the rows that take part.

A slip is one row with the rule FRICTION_LINE in the plane, and two rows FRICTION_DISC and FRICTION_DISC_2 in space;
they carry at most mu times the force of the gap. A contact that slides at a speed slides in a known direction:
SLIDING.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ...compiler.kernels import BoundKernel, StructBuffer
from ...constraints.switches.contact_slip import EDGE
from ...constraints.switches.switch_kind import (
    DISC,
    G_BACK,
    G_CONE,
    G_LOWER,
    G_REVERSES,
    G_SHARED,
    G_SLIDES,
    G_TURNS,
    G_UPPER,
    HELD,
    INTERVAL,
    NOT_IN_USE,
    OFF,
    ProblemRow,
    SwitchKind,
)
from ...engine.calls import ARRIVE, GUARD_VALUES, MOTION, SOLVE, OutputBuffer
from ...engine.entry_point import engine
from ...engine.guards import margin_kernel
from ...engine.loads import ONSET_END, ONSET_LENGTH, ONSET_SPEED
from ...engine.mode_complementarity import (
    FREE_MOTION,
    IMPULSES,
    RESUME_SOLVE,
    SOLVE_MODES,
    STORE_RATES,
    EngineCall,
    ModeProblem,
    empty_mode_problem,
    mode_kernel,
)
from ...numerics.complementarity.dense_problem import (
    AT_REST,
    BILATERAL,
    DISC_SLIPS,
    FRICTION_DISC,
    FRICTION_DISC_2,
    FRICTION_LINE,
    SLIDING,
    DenseProblem,
    allocate_dense,
)
from ...numerics.integrators.butcher_tableaux import tableau
from ...numerics.integrators.time_loop import StateVectors, StepCounts, StepReals, StepState
from .context import RELEASED, EventContext, switch_scales, switch_units

POSITION_TOLERANCE = 1e-10  # distance at which a bound is reached, relative to the mechanism's length or a radian
RATE_TOLERANCE = (
    1e-12  # rate that counts as zero, relative to the mechanism's length (or a radian) times `reference_rate`
)
IMMOVABLE_MOBILITY = (
    1e-10  # mobility, relative to that of the total mass, below which only drivers move it; rounding leaves 1e-11
)
REST_ACCELERATION = 1e-9  # negligible acceleration of an immovable row, relative to the reference acceleration
FAINT_ACCELERATION = 1e-5  # part of that which is negligible for any row
POSITION_ROUNDING = 2e-15  # rounding of positions, relative to the mechanism's length or a radian


class ProblemWorkspace(NamedTuple):
    """Arrays of a complementarity problem, and its kernel."""

    B: ModeProblem
    P: DenseProblem
    do: BoundKernel


class InstantProblem:
    """Evaluation and solution of the problem at an instant of a motion.

    Attributes
    ----------
    x, rate : ndarray (ns,)
        Value and rate of every switch's quantity.
    near, still : ndarray (ns,)
        Tolerances of these.
    mode, hold, way : ndarray (ns,)
        Modes, held values and switch states before the evaluation.
    shares : bool
        Whether active rows may have indeterminate forces: the last guard is then that of the group.
    over : float
        Time at which a series of bounces is over that has become shorter than rounding here.
    pace : float [1/s]
        See `reference_rate`.
    energy : float [J]
        Reference energy: that of the total mass at the mechanism's own speed.
    """

    def __init__(self, here: EventContext) -> None:
        c, self.here = here.c, here
        self.engaging: Collection[int] = here.engaging
        self.S, self.W = c.system, c.work
        S, s = self.S, c.structure
        self.m = S.switches.measured
        self.force = S.switches.force
        self.first = self.W.sensed.shape[1] - len(self.m)
        ny, width = len(here.y), max(s.nv, len(S.rows.law), len(S.guards.kind), 1)
        none, y = np.zeros(0, np.int64), StateVectors.blank(ny)
        seen = np.zeros((here.clock.inspection.shape[0], 0))
        self.state = StepState(StepReals.blank(), StepCounts.blank(), np.zeros(0), y, np.zeros((1, ny)), none, seen)
        R, self.output = tableau("rk45"), OutputBuffer(np.zeros((4, width)))
        self.tables = c.buffers
        self.engine = BoundKernel(
            engine, *self.tables, StructBuffer(R), StructBuffer(self.state), StructBuffer(self.output)
        )
        self.asked = StructBuffer(EngineCall(np.array([self.engine.address]), R, self.state, self.output))
        self.units = switch_units(s)
        self.characteristic_rate = float(here.c.array("options").rate)
        self.unit, metric = switch_scales(s, c.values.length), [unit == "m" for unit in self.units]
        mass, spin = S.bodies.mass.sum(), np.trace(S.bodies.inertia.reshape(-1, 3, 3).sum(axis=0))
        turning = mass * c.values.length**2 + spin
        self.inertia = np.array([mass if m else turning for m in metric])
        self.pace = reference_rate(here)
        fall = np.linalg.norm(S.gravity) / c.values.length + self.pace**2
        self.energy = mass * c.values.length**2 * fall
        self.negligible_acceleration = REST_ACCELERATION * self.unit * fall
        self.near, self.least = POSITION_TOLERANCE * self.unit, RATE_TOLERANCE * self.unit * self.pace
        self.workspaces: dict[int, ProblemWorkspace] = {}
        self.guarded = list(zip(*(x.tolist() for x in S.guards), strict=True))
        self.shares = bool(self.guarded) and self.guarded[-1][0] == G_SHARED
        self.all = self.room(len(self.m))
        self.all.B.which[:] = np.arange(len(self.m))
        self.workspaces.clear()
        self.begin()
        self.acceleration_rounding = self._acceleration_rounding()

    def begin(self) -> None:
        """Prepare for another instant, where other elements may have been released."""
        self.over = np.nan
        released = self.W.modes.released == RELEASED
        self.kinds: list[SwitchKind] = [
            NOT_IN_USE if gone else x.switch.kind
            for x, gone in zip(self.here.structure.switches, released.tolist(), strict=True)
        ]
        self.decided = [s for s in self.of(lambda kind: kind.decided) if self.m[s] >= 0]

    def _acceleration_rounding(self) -> np.ndarray:
        """Return how the rounding of positions changes the accelerations of switches' quantities, (ns,).

        This is rounding of forces, as of stiff springs near their free lengths: gradients are those of the positions as
        they are, since that of a deflection turns by any angle near zero. All decided switches are off.
        """
        c, nq, nv = self.here.c, len(self.here.q), self.here.structure.nv
        which, modes = np.flatnonzero(self.m >= 0), self.W.modes.mode.copy()
        self.switch_off_decided()
        self.put()
        self.state.y.current[nq : nq + nv] = c.sizes * (1.5 + np.cos(np.arange(nv)))  # a direction without symmetry
        self.engine(MOTION)
        q_dot, out, before = self.state.K[0, :nq].copy(), np.zeros(len(self.m)), np.zeros(nv)
        G = self.gradients(which)
        for step in (0.0, POSITION_ROUNDING, -POSITION_ROUNDING):
            self.put()
            self.state.y.current[:nq] += step * q_dot
            if self.engine(MOTION) != 0:
                break
            solved = self.W.velocities.solved[:nv].copy()
            before = solved if step == 0.0 else before
            out[which] = np.fmax(out[which], np.abs(G @ (solved - before)))
        self.W.modes.mode[:] = modes
        self.run_engine(MOTION)
        return out

    def of(self, chosen: Callable[[SwitchKind], bool]) -> list[int]:
        """Return the switches of the chosen kinds."""
        return [s for s, kind in enumerate(self.kinds) if chosen(kind)]

    def fired(self, guards: Iterable[int], *kinds: int) -> set[int]:
        """Return the switches of the guards that are of these kinds."""
        rows = (self.guarded[g] for g in guards)
        return {s for kind, s, _ in rows if kind in kinds}

    def room(self, n: int) -> ProblemWorkspace:
        """Return the workspace for a problem of n rows."""
        if n not in self.workspaces:
            B, P = empty_mode_problem(n, self.here.structure.nv, len(self.S.rows.law)), allocate_dense(n)
            self.workspaces[n] = ProblemWorkspace(
                B, P, BoundKernel(mode_kernel, *self.tables, self.asked, StructBuffer(B), StructBuffer(P))
            )
        return self.workspaces[n]

    def ways(self) -> np.ndarray:
        """Return the states of all switches, writable in place."""
        return self.W.sensed.value[self.first :]

    def put(self) -> None:
        """Copy time and state of the motion into the workspace."""
        self.state.real.t = self.here.t
        self.state.y.current = self.here.y

    def run_engine(self, task: int) -> int:
        """Run a task of the engine at the state of the motion, on a copy of it."""
        self.put()
        return self.engine(task)

    def evaluate_switches(self) -> None:
        """Evaluate quantities and rates of all switches, with all decided switches off."""
        self.mode, self.hold, self.way = self.W.modes.mode.copy(), self.W.modes.hold.copy(), self.ways().copy()
        self.reevaluate_switches()

    def reevaluate_switches(self) -> None:
        """Evaluate them again after a jump."""
        self.switch_off_decided()
        self.put()
        self.all.do(STORE_RATES)
        B = self.all.B
        self.x, self.rate, self.still = B.now.copy(), B.rate.copy(), B.previous + self.least
        for s, prescribed in self.here.engaging.items():
            self.rate[s] -= prescribed

    def engage_drivers(self) -> None:
        """Let the drivers that engage at this instant act as constraints from now on."""
        if self.engaging:
            self.mode[list(self.engaging)] = self.W.modes.mode[list(self.engaging)] = HELD
            self.here.engaging.clear()
            self.reevaluate_switches()

    def switch_off_decided(self) -> None:
        """Switch off all decided switches."""
        self.W.modes.mode[self.decided] = OFF

    def set_sliding(self, parts: list[ProblemRow]) -> None:
        """Set the sliding direction of friction that is no row of the problem; friction of its rows acts by them
        alone.
        """
        ways, own = self.ways(), {p.switch for p in parts}
        for s in self.of(lambda kind: kind.forces == INTERVAL):
            ways[s] = 0.0 if s in own or self.is_loaded(s) else np.sign(self.rate[s])

    def is_loaded(self, s: int) -> bool:
        """Return whether the force of switch s depends on a load."""
        return bool(self.force[s] >= 0 and self.S.forces.load[self.force[s]] >= 0)

    def acceleration(self, s: int) -> float:
        """Return the second derivative of a quantity with the present modes."""
        self.run_engine(MOTION)
        nq = self.S.sizes.coordinates
        vdot = self.state.K[0, nq : nq + self.here.structure.nv]
        return float(self.gradients(np.array([s]))[0] @ vdot + self.W.sensed.bias[self.m[s]])

    def response(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return accelerations, multipliers and driver efforts due to a generalised force at the state last
        evaluated.
        """
        out, nv, nr = self.output.rows, len(force), len(self.S.rows.law)
        out[:2] = 0.0
        out[0, :nv] = force
        self.run_engine(SOLVE)
        return out[2, :nv].copy(), out[3, :nr].copy(), self.W.velocities.effort.copy()

    def gradients(self, which: np.ndarray) -> np.ndarray:
        """Return the gradients of the quantities of these switches, (n, nv)."""
        S, nr = self.S, len(self.S.rows.law)
        out = np.zeros((len(which), self.here.structure.nv))
        for i, s in enumerate(which.tolist()):
            at = slice(S.row_start[nr + self.m[s]], S.row_start[nr + self.m[s] + 1])
            out[i, S.column[at]] += self.W.G[at]
        return out

    def restore_modes(self) -> None:
        """Restore modes and switch states from before the evaluation."""
        self.W.modes.mode[:] = self.mode
        self.ways()[:] = self.way

    def problem(self, parts: list[ProblemRow]) -> tuple[ModeProblem, DenseProblem, int]:
        """Set up the problem of these rows at the state of the motion. Returns it and the status of its evaluation."""
        room = self.room(len(parts))
        B, P = room.B, room.P
        for x in (B.asks, P.const, P.gain, P.bound_sign, P.grain):
            x[...] = 0
        for i, part in enumerate(parts):
            B.which[i], B.sign[i], B.way[i], B.rate[i] = part.switch, part.sign, part.way, part.rate
            P.rule[i], P.bound_sign[i], P.const[i], P.state[i] = part.rule, part.direction, part.const, part.state
            if part.of >= 0:
                P.gain[i, part.of] = part.gain
        self.set_sliding(parts)
        self.put()
        status = room.do(FREE_MOTION)
        P.grain[:] += FAINT_ACCELERATION * self.negligible_acceleration[B.which] + self.acceleration_rounding[B.which]
        for i in np.flatnonzero(P.A.diagonal() * self.inertia[B.which] < IMMOVABLE_MOBILITY).tolist():
            P.A[i] = P.A[:, i] = 0.0
            if abs(P.b[i]) <= self.negligible_acceleration[B.which[i]]:
                P.b[i] = 0.0
        return B, P, status

    def balance(self, B: ModeProblem, P: DenseProblem, impulses: int) -> int:
        """Solve the problem for forces or impulses (constants of `engine.mode_complementarity`). Returns the solver
        status.
        """
        B.asks[IMPULSES] = impulses
        self.state.real.t = self.here.t
        return self.workspaces[len(P.b)].do(SOLVE_MODES)

    def again(self, P: DenseProblem) -> int:
        """Solve it again from the states stored in it, with the present friction limits. Returns the solver status."""
        return self.workspaces[len(P.b)].do(RESUME_SOLVE)

    def project(self) -> None:
        """Project the state onto the active rows."""
        if self.run_engine(ARRIVE) == 0:
            self.here.y[:] = self.state.y.current

    def guards(self) -> np.ndarray:
        """Return the values of all guards, (ng,)."""
        self.run_engine(GUARD_VALUES)
        out = self.output.rows[0, : len(self.S.guards.kind)].copy()
        if self.shares:
            out[-1] = margin_kernel(*self.tables, self.here.t, self.here.group)
        return out

    def name(self, s: int) -> str:
        """Return the name of the element of switch s, or of the coordinate that an event locks."""
        spec = self.here.structure.switches[s]
        return str(spec.switch.label if spec.element.category == "events" else spec.element.name)

    def holds(self, s: int) -> bool:
        """Return whether switch s was active before the evaluation."""
        return bool(self.mode[s] == HELD)


def reference_rate(here: EventContext) -> float:
    """Return a reference rate [1/s], to which velocities (per length) and accelerations (squared) are compared.

    It is the characteristic rate of the mechanism, or the inverse of the motion's duration where that is slower. A
    short duration does not raise it: a force of the weight of a body at rest counts, however little it would move the
    body.
    """
    return min(float(here.c.array("options").rate), 1.0 / float(here.clock.real.span))


def instant_problem(here: EventContext) -> InstantProblem:
    """Return the `InstantProblem` of a motion at the present instant, reused with the same tables and workspace."""
    n = here.instant_problem
    if n is None or n.S is not here.c.system or n.W is not here.c.work:
        here.instant_problem = n = InstantProblem(here)
    n.begin()
    return n


SLIP_SPEED_SHARE = 0.9  # part of the speed from which on the velocity alone gives the direction of a slip
SLOW_SLIP = 1e3  # speed, in tolerances of rates, below which a spatial slip ends where its guard triggered


def slips_of(n: InstantProblem) -> list[int]:
    """Return the slips of all contact points."""
    return n.of(lambda kind: kind.forces == DISC)


def slips_at_gap(n: InstantProblem, gap: int) -> list[int]:
    """Return the slips of a gap's contact point: none, one, or two in a row."""
    return [s for s in slips_of(n) if n.S.switches.other[s] == gap]


def gaps_beyond_edges(n: InstantProblem) -> set[int]:
    """Return the gaps of corners that leave their face: at its edge and moving outwards."""
    leaving = (n.x <= n.near) & ((n.rate < -n.still) | (n.x < -n.near))
    return {int(n.S.switches.other[s]) for s in n.of(lambda kind: kind is EDGE) if leaving[s]}


def mark_ended_slips(n: InstantProblem, fired: np.ndarray, still: np.ndarray) -> None:
    """Mark in ``still`` which slips have ended; of a pair both or none."""
    done = n.fired(fired, G_TURNS)
    for s in slips_of(n):
        other = int(n.S.switches.partner[s])
        if other < 0:
            still[s] |= s in done
        elif s < other:
            slow = np.hypot(n.rate[s], n.rate[other]) <= SLOW_SLIP * (n.still[s] + n.still[other])
            still[[s, other]] = (still[s] and still[other]) or (
                slow and s in done and not _slip_continues(n, [s, other])
            )


def stop_slips(n: InstantProblem, fired: np.ndarray) -> None:
    """Set the remaining speed of ended spatial slips to zero, so that further sliding follows the acceleration.

    Closed gaps stay closed; all other switches are evaluated again.
    """
    over = []
    for s in sorted(n.fired(fired, G_TURNS)):
        pair = [s, int(n.S.switches.partner[s])]
        speed, still = np.linalg.norm(n.rate[pair]), n.still[pair].sum()
        if (
            n.kinds[s].forces == DISC
            and pair[1] >= 0
            and still < speed <= SLOW_SLIP * still
            and not _slip_continues(n, pair)
        ):
            over += pair
    if not over:
        return
    gaps = [s for s in n.of(lambda kind: kind.keeps_bounds) if n.mode[s] != OFF]
    B, P, _ = n.problem([ProblemRow(s, BILATERAL) for s in (*over, *gaps)])
    rates = np.zeros(len(B.which))
    rates[: len(over)] = n.rate[over]
    n.here.v[:] -= np.linalg.lstsq(P.A, rates, rcond=1e-12)[0] @ B.Y
    n.reevaluate_switches()


def _slip_continues(n: InstantProblem, pair: list[int]) -> bool:
    """Return whether a slip that has just begun keeps its direction: it is slow because it started from rest."""
    fresh = len(pair) > 1 and n.way[pair] @ n.way[pair] > ONSET_LENGTH and n.way[pair] @ n.rate[pair] > 0.0
    return bool(
        fresh and np.linalg.norm(n.rate[pair]) < SLIP_SPEED_SHARE * ONSET_END * ONSET_SPEED * n.here.c.values.length
    )


def _slip_direction(n: InstantProblem, slips: list[int]) -> np.ndarray:
    """Return the sliding direction of a contact point, as in `engine.loads.sliding_direction`."""
    u = n.rate[slips]
    if _slip_continues(n, slips):
        first = ONSET_SPEED * n.here.c.values.length
        u = u + first * np.exp(-(u @ u) / first**2) * n.way[slips] / ONSET_LENGTH
    return np.asarray(u / np.linalg.norm(u))


def slip_rows(n: InstantProblem, gap: int, at: int, still: np.ndarray, *, known_direction: bool) -> list[ProblemRow]:
    """Return the rows of the slips of a gap, which is row ``at``.

    With ``known_direction`` a sliding contact slides in its present direction; else the direction is solved for, as in
    an impact.
    """
    own = slips_at_gap(n, gap)
    if not own:
        return []
    held = bool(still[own].all())
    numbers = n.S.switch_numbers
    mu = float((numbers.static_friction if held else numbers.kinetic_friction)[own[0]])
    if held or not known_direction:
        rules = (FRICTION_LINE,) if len(own) == 1 else (FRICTION_DISC, FRICTION_DISC_2)
        return [ProblemRow(s, rule, state=AT_REST, gain=mu, of=at) for s, rule in zip(own, rules, strict=True)]
    d = _slip_direction(n, own)
    return [ProblemRow(s, SLIDING, direction=float(x), gain=mu, of=at) for s, x in zip(own, d, strict=True)]


def use_kinetic_friction(n: InstantProblem, parts: Sequence[ProblemRow], P: DenseProblem, resting: np.ndarray) -> bool:
    """Set the kinetic coefficient for contacts that begin to slip, except those that others keep at rest.

    Returns whether that changed the problem.
    """
    other = False
    for i, p in enumerate(parts):
        if (
            n.kinds[p.switch].forces == DISC
            and P.rule[i] != FRICTION_DISC_2
            and P.state[i] != AT_REST
            and not resting[i]
        ):
            mu = float(n.S.switch_numbers.kinetic_friction[p.switch])
            other |= P.gain[i, p.of] != mu
            P.gain[i, p.of] = mu
    return other


def sliding_at_cone(
    n: InstantProblem, parts: Sequence[ProblemRow], found: tuple[np.ndarray, ...], fired: np.ndarray
) -> dict[int, ProblemRow]:
    """Return rows that stick exactly at their friction limit, by guards that triggered, as sliding rows.

    ``found`` are forces, states, friction limits, and negligible forces.
    """
    x, state, reach, least = found
    ends = n.fired(fired, G_CONE)
    out = {}
    for i, p in enumerate(parts):
        own = [i] if p.rule == FRICTION_LINE else [i, i + 1]
        if (
            p.switch not in ends
            or p.rule not in (FRICTION_LINE, FRICTION_DISC)
            or n.kinds[p.switch].forces != DISC
            or state[i] != AT_REST
        ):
            continue
        size = float(np.linalg.norm(x[own]))
        if size >= reach[i] - least[i]:
            mu = float(n.S.switch_numbers.kinetic_friction[p.switch])
            for k in own:
                out[k] = parts[k]._replace(rule=SLIDING, direction=-float(x[k]) / size if size else 0.0, gain=mu)
    return out


def write_slips(n: InstantProblem, parts: Sequence[ProblemRow], found: tuple[np.ndarray, ...]) -> None:
    """Write modes and states of all slips: they stick or slide where the gap is closed.

    ``found`` are states, forces, rates, and known directions.
    """
    state, x, u, lean = found
    W, ways = n.W, n.ways()
    slips = slips_of(n)
    W.modes.mode[slips], W.modes.hold[slips] = OFF, 0.0
    for i, p in enumerate(parts):
        own = slips_at_gap(n, int(n.S.switches.other[p.switch])) if n.kinds[p.switch].forces == DISC else [-1]
        if p.switch != own[0] or state[p.of] != AT_REST:
            continue
        rows = np.arange(i, i + len(own))
        if (state[rows] == AT_REST).all():
            W.modes.mode[own], ways[own] = HELD, 0.0
            continue
        d = lean[rows]
        if state[i] == DISC_SLIPS:  # along the acceleration; opposite to the friction force if that is zero
            d = u[rows] if np.linalg.norm(u[rows]) > 0.0 else -x[rows]
            d = d / np.linalg.norm(d)
        if n.mode[own[0]] == OFF and _slip_continues(n, own):
            ways[own] = n.way[own]
            continue
        ways[own] = ONSET_LENGTH * d if len(own) > 1 and _slip_begins(n, own, d, u[rows]) else d


def _slip_begins(n: InstantProblem, slips: list[int], d: np.ndarray, u: np.ndarray) -> bool:
    """Return whether a spatial slip has hardly any speed yet and accelerates in the direction d."""
    speed = np.linalg.norm(n.rate[slips])
    return bool(speed <= n.still[slips].sum() or (speed < ONSET_SPEED * n.here.c.values.length and u @ d > 0.0))


SIDE_OF_GUARD = {G_LOWER: 1.0, G_UPPER: -1.0}


def closed_bounds(n: InstantProblem, fired: np.ndarray) -> dict[int, tuple[float, ...]]:
    """Return for every stop the bounds that it is at: +1 the lower one, -1 the upper one."""
    hit = {(s, SIDE_OF_GUARD[k]) for k, s, _ in (n.guarded[g] for g in fired) if k in SIDE_OF_GUARD}
    out = {}
    gone = gaps_beyond_edges(n)
    for s in n.of(lambda kind: kind.keeps_bounds):
        if s in gone:
            continue
        gaps = {1.0: n.x[s] - n.W.modes.lower[s], -1.0: n.W.modes.upper[s] - n.x[s]}
        held = n.way[s] if n.mode[s] != OFF else 0.0
        at = tuple(w for w, gap in gaps.items() if gap < np.inf and (gap <= n.near[s] or (s, w) in hit or w == held))
        if at:
            out[s] = at
    return out


def switches_at_rest(n: InstantProblem, fired: np.ndarray) -> np.ndarray:
    """Return whether the rate of each switch counts as zero, (ns,)."""
    still = np.abs(n.rate) <= n.still
    still[list(n.fired(fired, G_SLIDES, G_REVERSES, G_BACK))] = True
    mark_ended_slips(n, fired, still)
    return still


def rows_of_velocities(n: InstantProblem, at: dict[int, tuple[float, ...]], still: np.ndarray) -> list[ProblemRow]:
    """Return the rows along which impulses may act."""
    out: list[ProblemRow] = []
    for s, kind in enumerate(n.kinds):
        own = kind.velocity_rows(n, s, at.get(s, ()), bool(still[s]))
        out += own
        if own and kind.keeps_bounds:
            out += slip_rows(n, s, len(out) - 1, still, known_direction=False)
    return out


def rows_of_accelerations(n: InstantProblem, at: dict[int, tuple[float, ...]], still: np.ndarray) -> list[ProblemRow]:
    """Return the rows along which forces may act; of separating or sliding ones only friction that depends on its
    load.
    """
    out: list[ProblemRow] = []
    for s, kind in enumerate(n.kinds):
        own = kind.acceleration_rows(n, s, at.get(s, ()), bool(still[s]))
        out += own
        if own and kind.keeps_bounds:
            out += slip_rows(n, s, len(out) - 1, still, known_direction=True)
    return out
