"""The engine at an instant: what every row with a mode does there, and the small problem of those that take part."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ....compiler.buffers import StructBuffer
from ....compiler.kernels import BoundKernel
from ....constraints.modes import FRICTION, LOCK, ONE_WAY, RATCHET, SLIP, STOP
from ....equations.engine import engine
from ....equations.instant import AGAIN, BALANCE, BARE, IMPULSES, LOOK, Bench, Desk, bench, instant
from ....equations.sharing import margin_kernel
from ....equations.tasks import ARRIVE, MOTION, SOLVE, WATCH, Sheet
from ....numerics.cone.dense.problem import FREE, Dense, dense
from ....numerics.integrators.clock import STATES, Clock, ClockCounts, ClockReals
from ....numerics.integrators.tableaux import tableau
from ....tables.system import (
    BIAS,
    G_SHARED,
    HELD,
    OFF,
    VALUE,
)
from .bounds import sizes, units
from .here import Here
from .holding import GONE

NEAR = 1e-10  # of the mechanism's length, or of a radian: what is no farther from a side is at it
REST = 1e-12  # of the length of the mechanism (or a radian) at the rate `slowest`: the same where all is at rest
NO_KIND = -1  # of what was released: it takes no part
IMMOVABLE = 1e-10  # of all mass: what moves less by a force is moved by drivers only; redundant rows leave 1e-11 of it
STOPS = (STOP, RATCHET)  # kinds that keep their quantity within bounds
MOTIONLESS = 1e-9  # of how gravity accelerates: what nothing moves and has no more than that stands still
FAINT = 1e-5  # of that: an acceleration that is none, whatever it is the difference of
DIGITS = 2e-15  # of the mechanism's length, or of a radian: last digits of positions
DECIDED = (*STOPS, FRICTION, ONE_WAY, LOCK, SLIP)  # kinds whose modes follow from the small problem


class Part(NamedTuple):
    """A row of the small problem."""

    switch: int
    rule: int
    sign: float = 1.0
    way: float = 0.0  # what its friction is asked for; 0: reach is const + gain on row ``of``
    rate: float = 0.0
    lean: float = 0.0
    const: float = 0.0
    gain: float = 0.0
    of: int = -1
    state: int = FREE


class Room(NamedTuple):
    """Arrays of a small problem, and what works on them."""

    B: Bench
    P: Dense
    do: BoundKernel


class Instant:
    """A motion at an instant, with all that is decided on its own.

    Attributes
    ----------
    x, rate : ndarray (ns,)
        Value and rate of every switch's quantity.
    near, still : ndarray (ns,)
        What of these is nothing.
    mode, hold, way : ndarray (ns,)
        Modes, places and ways as they were when it was looked at.
    shares : bool
        Whether what holds may share it with others: the last guard is that of the group.
    over : float
        When a series of bounces is over that has become shorter than rounding here.
    pace : float [1/s]
        See `slowest`.
    energy : float [J]
        That of all mass at the mechanism's own speed.
    """

    def __init__(self, here: Here) -> None:
        c, self.here = here.c, here
        self.S, self.W = c.system, c.work
        S, s = self.S, c.structure
        self.m = S.switches.measured
        self.force = S.switches.force
        self.first = self.W.sensed.shape[1] - len(self.m)
        ny, width = len(here.y), max(s.nv, len(S.rows.law), len(S.guards.kind), 1)
        none, y = np.zeros(0, np.int64), np.zeros((STATES, ny))
        seen = np.zeros((here.clock.seen.shape[0], 0))
        self.desk = Clock(ClockReals.blank(), ClockCounts.blank(), np.zeros(0), y, np.zeros((1, ny)), none, seen)
        R, self.sheet = tableau("rk45"), Sheet(np.zeros((4, width)))
        self.tables = c.buffers
        self.engine = BoundKernel(
            engine, *self.tables, StructBuffer(R), StructBuffer(self.desk), StructBuffer(self.sheet)
        )
        self.asked = StructBuffer(Desk(np.array([self.engine.address]), R, self.desk, self.sheet))
        self.units = units(s)
        self.tempo = float(S.scales.rate.real)
        self.unit, metric = sizes(s, c.values.length), [unit == "m" for unit in self.units]
        mass, spin = S.bodies.mass.sum(), np.trace(S.bodies.inertia.reshape(-1, 3, 3).sum(axis=0))
        turning = mass * c.values.length**2 + spin
        self.inertia = np.array([mass if m else turning for m in metric])
        self.pace = slowest(here)
        fall = np.linalg.norm(S.gravity) / c.values.length + self.pace**2
        self.energy = mass * c.values.length**2 * fall
        self.tiny = MOTIONLESS * self.unit * fall
        self.near, self.least = NEAR * self.unit, REST * self.unit * self.pace
        self.rooms: dict[int, Room] = {}
        self.guarded = list(zip(*(x.tolist() for x in S.guards), strict=True))
        self.shares = bool(self.guarded) and self.guarded[-1][0] == G_SHARED
        self.all = self.room(len(self.m))
        self.all.B.which[:] = np.arange(len(self.m))
        self.rooms.clear()
        self.begin()
        self.blurred = self._blurred()

    def begin(self) -> None:
        """At another instant, where other elements may have been released."""
        self.over = np.nan
        self.kind = np.where(self.W.modes.released == GONE, NO_KIND, self.S.switches.kind)
        self.kinds = self.kind.tolist()
        self.decided = [s for s in self.of(*DECIDED) if self.m[s] >= 0]

    def _blurred(self) -> np.ndarray:
        """How the last digits of positions change the accelerations of switches' quantities, (ns,).

        That is rounding of forces, as of stiff springs near their free lengths. Everything that is decided is off.
        """
        c, nq, nv = self.here.c, len(self.here.q), self.here.structure.nv
        which, modes = np.flatnonzero(self.m >= 0), self.W.modes.mode.copy()
        self.bared()
        self.put()
        self.desk.y[0, nq : nq + nv] = c.sizes * (1.5 + np.cos(np.arange(nv)))  # a way that no symmetry has
        self.engine(MOTION)
        q_dot, out, before = self.desk.K[0, :nq].copy(), np.zeros(len(self.m)), np.zeros(0)
        for step in (0.0, DIGITS, -DIGITS):
            self.put()
            self.desk.y[0, :nq] += step * q_dot
            if self.engine(MOTION) != 0:
                break
            a = self.gradients(which) @ self.W.velocities.solved[:nv] + self.W.sensed[BIAS, self.m[which]]
            before = a if step == 0.0 else before
            out[which] = np.fmax(out[which], np.abs(a - before))
        self.W.modes.mode[:] = modes
        self.ask(MOTION)
        return out

    def of(self, *kinds: int) -> list[int]:
        """Switches of these kinds."""
        return [s for s, kind in enumerate(self.kinds) if kind in kinds]

    def fired(self, guards: Iterable[int], *kinds: int) -> set[int]:
        """Switches of those of some guards that are of these kinds."""
        rows = (self.guarded[g] for g in guards)
        return {s for kind, s, _ in rows if kind in kinds}

    def room(self, n: int) -> Room:
        """Room for a small problem of n rows."""
        if n not in self.rooms:
            B, P = bench(n, self.here.structure.nv, len(self.S.rows.law)), dense(n)
            self.rooms[n] = Room(B, P, BoundKernel(instant, *self.tables, self.asked, StructBuffer(B), StructBuffer(P)))
        return self.rooms[n]

    def ways(self) -> np.ndarray:
        """Ways of all switches, in place."""
        return self.W.sensed[VALUE, self.first :]

    def put(self) -> None:
        """Lay time and state of the motion on the desk."""
        self.desk.real.t = self.here.t
        self.desk.y[0] = self.here.y

    def ask(self, task: int) -> int:
        """Have the engine do a task at the state of the motion; the desk has a copy of it."""
        self.put()
        return self.engine(task)

    def look(self) -> None:
        """Quantities and rates of all switches, where none of those that are decided acts."""
        self.mode, self.hold, self.way = self.W.modes.mode.copy(), self.W.modes.hold.copy(), self.ways().copy()
        self.look_again()

    def look_again(self) -> None:
        """The same after a jump."""
        self.bared()
        self.put()
        self.all.do(LOOK)
        B = self.all.B
        self.x, self.rate, self.still = B.now.copy(), B.rate.copy(), B.seen + self.least

    def bared(self) -> None:
        """Switch off what is decided."""
        self.W.modes.mode[self.decided] = OFF

    def slide(self, parts: list[Part]) -> None:
        """Let friction that is no row of the problem slide as it does; that of its rows acts by them alone."""
        ways, own = self.ways(), {p.switch for p in parts}
        for s in self.of(FRICTION):
            loaded = self.S.forces.load[self.force[s]] >= 0
            ways[s] = 0.0 if s in own or loaded else np.sign(self.rate[s])

    def response(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What a generalised force does at the state last looked at: accelerations, multipliers, efforts of drivers."""
        out, nv, nr = self.sheet.rows, len(force), len(self.S.rows.law)
        out[:2] = 0.0
        out[0, :nv] = force
        self.ask(SOLVE)
        return out[2, :nv].copy(), out[3, :nr].copy(), self.W.velocities.effort.copy()

    def gradients(self, which: np.ndarray) -> np.ndarray:
        """Gradients of the quantities of these switches, (n, nv)."""
        S, nr = self.S, len(self.S.rows.law)
        out = np.zeros((len(which), self.here.structure.nv))
        for i, s in enumerate(which.tolist()):
            at = slice(S.row_start[nr + self.m[s]], S.row_start[nr + self.m[s] + 1])
            out[i, S.column[at]] += self.W.G[at]
        return out

    def restored(self) -> None:
        """Modes and ways as they were when it was looked at."""
        self.W.modes.mode[:] = self.mode
        self.ways()[:] = self.way

    def problem(self, parts: list[Part]) -> tuple[Bench, Dense, int]:
        """The small problem of these rows at the state of the motion; and how its evaluation ended."""
        room = self.room(len(parts))
        B, P = room.B, room.P
        for x in (B.asks, P.const, P.gain, P.lean, P.grain):
            x[...] = 0
        for i, part in enumerate(parts):
            B.which[i], B.sign[i], B.way[i], B.rate[i] = part.switch, part.sign, part.way, part.rate
            P.rule[i], P.lean[i], P.const[i], P.state[i] = part.rule, part.lean, part.const, part.state
            if part.of >= 0:
                P.gain[i, part.of] = part.gain
        self.slide(parts)
        self.put()
        status = room.do(BARE)
        P.grain[:] += FAINT * self.tiny[B.which] + self.blurred[B.which]
        for i in np.flatnonzero(P.A.diagonal() * self.inertia[B.which] < IMMOVABLE).tolist():
            P.A[i] = P.A[:, i] = 0.0
            if abs(P.b[i]) <= self.tiny[B.which[i]]:
                P.b[i] = 0.0
        return B, P, status

    def balance(self, B: Bench, P: Dense, impulses: int) -> int:
        """Solve it for forces or impulses, as `equations.instant` names them. Returns how it ended."""
        B.asks[IMPULSES] = impulses
        self.desk.real.t = self.here.t
        return self.rooms[len(P.b)].do(BALANCE)

    def again(self, P: Dense) -> int:
        """Solve it once more from the states that stand in it, with reaches as they are. Returns how it ended."""
        return self.rooms[len(P.b)].do(AGAIN)

    def arrive(self) -> None:
        """Put the state on the rows as they are now held."""
        if self.ask(ARRIVE) == 0:
            self.here.y[:] = self.desk.y[0]

    def guards(self) -> np.ndarray:
        """What is watched, (ng,)."""
        self.ask(WATCH)
        out = self.sheet.rows[0, : len(self.S.guards.kind)].copy()
        if self.shares:
            out[-1] = margin_kernel(*self.tables, self.here.t, self.here.group)
        return out

    def name(self, s: int) -> str:
        """Name of the element that switch s is of; of the coordinate that an event locks."""
        spec = self.here.structure.switches[s]
        return str(spec.switch.label if spec.element.category == "events" else spec.element.name)

    def holds(self, s: int) -> bool:
        """Whether switch s held when it was looked at."""
        return bool(self.mode[s] == HELD)


def slowest(here: Here) -> float:
    """A rate [1/s] that per length is a speed, squared an acceleration, of which small parts are none.

    That of the mechanism itself, or a change in the whole time of a motion where that is slower. A time that is short
    makes nothing small: a force of the weight of a body at rest presses, however little it would move the body.
    """
    return min(float(here.c.system.scales.rate.real), 1.0 / float(here.clock.real.span))


def instant_of(here: Here) -> Instant:
    """What decides at the instants of a motion, at the present one: the same as long as tables and scratch are."""
    n = here.decider
    if n is None or n.S is not here.c.system or n.W is not here.c.work:
        here.decider = n = Instant(here)
    n.begin()
    return n
