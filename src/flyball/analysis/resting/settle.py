"""Where a mechanism that touches comes to rest, by steps of impulses from where it is drawn.

Whenever the kinetic energy has passed a peak all velocities are set to zero (kinetic damping: Cundall 1976), so that
what swings comes to rest in a few swings, and what sticks never moves. Time stands still for laws.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ...errors import AnalysisError, NotConverged
from ...model.model import Model
from ...stepping.stepper import NoWay, Stepper
from ...stepping.tables import LAW, NO_RESTITUTION, TIME
from ...tables.contact import Touching, touching
from ...tables.names import velocity_names
from ..assembly.start import Assembly
from ..compiled import Compiled
from ..linear.derivatives import State
from ..motion.impulse.collect import Collected, coordinates
from ..motion.impulse.held import Held, acting_values, held_apart
from ..motion.impulse.parts import parts
from ..motion.impulse.scene import begin, placed, smallest
from ..motion.impulse.settings import Stepping
from .closed import refuse_surfaces

STEPS = 40_000
ENDLESS = 20.0  # way in the mechanism's lengths after which nothing will hold it any more
PART = 0.04  # a step, in parts of the time in which the smallest shape would fall by its own size
RESTS = 1e-7  # acceleration from rest, in parts of what it would be without contact
ITERATIONS = 400


def settled(model: Model, base: Assembly, parameters: Mapping[str, float] | None) -> Assembly:
    """The mechanism where it has come to rest; absolute coordinates.

    Parameters
    ----------
    model : Model
        With its contacts.
    base : Assembly
        Where it begins: as assembled.
    parameters : mapping, optional

    Raises
    ------
    NotConverged
        If it does not come to rest.
    """
    values = base.compiled.values
    found = parts(model, acting_values(model, values, parameters))
    scene = touching(model, values.given, (*found.free, *found.held))
    refuse_surfaces(scene)
    free = len(scene.carriers.mass) - len(found.held)
    held = held_apart(values, base.t, parameters, found, free)
    gravity = float(np.linalg.norm(values.system.gravity))
    h = PART * math.sqrt(smallest(scene, values) / gravity) if gravity > 0.0 else 5e-3
    o = Stepping(step=h, tolerance=1e-9 * (gravity or 1.0) * h, iterations=ITERATIONS, position_iterations=ITERATIONS)
    still = Assembly(base.compiled, base.t, base.q, 0.0 * base.v)
    if held:
        own = held.start.assembly.compiled
        held.joints.clock.y[0, : own.structure.nq] = own.take(base.compiled, base.t, still.q, still.v)[0]
    try:
        stepper = begin(scene, placed(scene, still), values, o, held)
        stepper.pace.count[LAW] = NO_RESTITUTION
        _Way(scene, stepper, held, h, base).walk(model.name)
    except NoWay:
        raise AnalysisError(f"{model.name!r} cannot be settled: its equations have no solution on the way") from None
    kept = Collected(stepper, held, np.zeros(len(scene.carriers.mass) + 1, np.int64))
    kept.add(False)
    q, v, vdot = coordinates(base, scene, kept)
    if held:
        held.into(values, q, v, vdot)
    return Assembly(base.compiled, base.t, q[-1], 0.0 * base.v)


class _Way:
    """The way to rest.

    Parameters
    ----------
    scene : Touching
    stepper : Stepper
    held : Held, optional
    h : float [s]
    base : Assembly
        Where it begins.
    """

    def __init__(self, scene: Touching, stepper: Stepper, held: Held | None, h: float, base: Assembly) -> None:
        self.scene, self.stepper, self.held, self.t, self.h = scene, stepper, held, base.t, h
        c = base.compiled
        self.size = c.values.length
        vdot = State.moving(c, base.t, base.q, 0.0 * base.v).vdot
        self.usual = float(np.abs(vdot * self.size / c.sizes).max(initial=0.0))  # acceleration without contact

    def walk(self, name: str) -> None:
        """Step until nothing moves that begins at rest."""
        before, rested, begun = 0.0, True, self.stepper.movers.pose[:, :3].copy()
        self._stop()
        for _ in range(STEPS):
            self._step()
            now = self._energy()
            if rested:
                acceleration = max(self._speeds().values(), default=0.0) / self.h
                self.usual = max(self.usual, acceleration)
                if acceleration <= RESTS * self.usual:
                    return
                if float(np.abs(self.stepper.movers.pose[:, :3] - begun).max(initial=0.0)) > ENDLESS * self.size:
                    break
            rested = now <= before
            before = 0.0 if rested else now
            if rested:
                self._stop()
        raise self._failure(name)

    def _step(self) -> None:
        s = self.stepper
        s.pace.real[TIME] = self.t
        s.joints.real.time = self.t
        s.run(1, self.h)

    def _stop(self) -> None:
        """All velocities to zero."""
        s = self.stepper
        s.rooms.X.v[:], s.rooms.X.wide[:], s.movers.twist[:] = 0.0, 0.0, 0.0
        if self.held:
            self._wide()[:] = 0.0

    def _energy(self) -> float:
        s, at = self.stepper, self.scene.carriers
        n = len(s.free.turn)
        v = s.rooms.X.v[:n]
        w = np.einsum("kji,kj->ki", s.movers.pose[:n, 3:].reshape(-1, 3, 3), v[:, 3:6])
        own = at.mass[:n] * (v[:, :3] ** 2).sum(axis=1) + np.einsum("ki,kij,kj->k", w, at.inertia[:n], w)
        return 0.5 * float(own.sum()) + (self._mechanism().kinetic_energy(self._wide()) if self.held else 0.0)

    def _mechanism(self) -> Compiled:
        return self.held.start.assembly.compiled  # type: ignore[union-attr]

    def _wide(self) -> np.ndarray:
        """Velocities of the mechanism."""
        own = self._mechanism().structure
        return self.stepper.joints.clock.y[0, own.nq : own.nq + own.nv]

    def _speeds(self) -> dict[str, float]:
        """Of every body [m/s]: of its centre, and of turning at the radius of gyration."""
        s, at = self.stepper, self.scene.carriers
        n = len(s.free.turn)
        v = s.rooms.X.v[:n]
        radius = np.sqrt(np.trace(at.inertia[:n], axis1=1, axis2=2) / np.where(at.mass[:n] > 0.0, at.mass[:n], 1.0))
        free = np.hypot(np.linalg.norm(v[:, :3], axis=1), radius * np.linalg.norm(v[:, 3:6], axis=1))
        out = {at.name(k): float(free[k]) for k in range(n)}
        if self.held:
            c = self._mechanism()
            for own, x in zip(velocity_names(c.structure), self._wide() * c.values.length / c.sizes, strict=True):
                name = own.name.partition(".")[0]
                out[name] = max(out.get(name, 0.0), abs(float(x)))
        return out

    def _failure(self, name: str) -> NotConverged:
        speed = self._speeds()
        who = max(speed, key=lambda k: speed[k])
        return NotConverged(
            f"{name!r} does not come to rest: after {STEPS * self.h:.3g} s {who!r} still moves at {speed[who]:.3g} "
            f"m/s: it falls, slides or rolls away. Hold it by friction, a stop or a spring, or begin nearer to "
            f"where it rests",
            speed,
        )
