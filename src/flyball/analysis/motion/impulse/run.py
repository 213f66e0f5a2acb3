"""Motion with contact: the scene in arrays, the steps, and what comes of them."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Mapping

import numpy as np

from ....contact import surfaces as su
from ....contact.tables import RADIUS, Movers
from ....model.geometry import matrix_to_quaternion
from ....model.model import Model
from ....numerics.cone.gauss_seidel import gauss_seidel
from ....numerics.cone.problem import COULOMB
from ....results.health import Health
from ....results.result import Result
from ....results.sides import Sides
from ....stepping.stepper import Stepper, free_bodies
from ....stepping.tables import (
    COUNTS,
    ENOUGH_V,
    ENOUGH_X,
    FLAT,
    GRAVITY,
    ITERATIONS,
    LAW,
    LIFTS,
    NO_RESTITUTION,
    REALS,
    SEQUENTIAL,
    SLOWEST,
    SWEEPS,
    TAKEN,
    TIME,
    Pace,
)
from ....tables.contact import Touching, touching
from ....tables.values import Values
from ...assemble import assemble
from ...assembly.start import Assembly
from ...progress import Tell
from .collect import Collected, coordinates, sets
from .parts import parts
from .settings import RESTITUTION, Impulse

MARGIN = 0.01  # gap up to which what does not approach is a contact, in parts of the smallest shape
FLATTEST = 1e-9  # overlap that is none, in parts of the smallest shape
SLOW = 1e-6  # speed [m/s] below which nothing bounces, whatever gravity is
SWEEPS_USUAL, LIFTS_USUAL = 50, 30


def impulse_motion(
    model: Model, t_end: float, times: np.ndarray, o: Impulse, parameters: Mapping[str, float] | None, tell: Tell
) -> Result:
    """The motion by steps of impulses; see `Mechanism.simulate`.

    Raises
    ------
    ModelError
        If the scene makes no sense.
    SimulationError
        If the steps cannot go on.
    """
    since = time.perf_counter()
    model = model.snapshot()
    base = assemble(model, t=float(times[0]), parameters=parameters)
    values = base.compiled.values
    found = parts(model, values)
    scene = touching(model, values.given, (*found.free, *found.held))
    movers = placed(scene, base)
    stepper = begin(scene, movers, values, o)
    names = [*scene.carriers.names, "ground"]
    counts = [-1 if n in scene.carriers.single or n == "ground" else _size(scene, n) for n in names]
    sides = Sides(names, counts)
    kept = Collected(stepper, np.arange(len(scene.carriers.mass) + 1))
    march(stepper, t_end, times, o.longest, kept, tell)
    return result_of(base, scene, stepper, kept, sides, o, since)


def _size(scene: Touching, name: str) -> int:
    at = scene.carriers.slices[name]
    return at.stop - at.start


def placed(scene: Touching, base: Assembly) -> Movers:
    """Movers where the assembled mechanism has them; sets of bodies are as described."""
    M = Movers(scene.carriers.movers.pose.copy(), scene.carriers.movers.twist.copy())
    for name, b in base.compiled.moving(base.t, base.q, base.v).items():
        k = scene.carriers.slices[name].start
        M.pose[k] = np.r_[b.p, b.R.ravel()]
        M.twist[k] = np.r_[b.v, b.w]
    return M


def begin(scene: Touching, M: Movers, values: Values, o: Impulse) -> Stepper:
    """The stepper at the start."""
    planar = values.structure.model.planar
    real, count = np.zeros(REALS), np.zeros(COUNTS, np.int64)
    real[GRAVITY : GRAVITY + 3] = values.system.glob[:3]
    sizes = scene.geometry.shape_x[:, RADIUS]
    smallest = float(np.min(sizes[np.isfinite(sizes)], initial=values.length))
    real[SLOWEST], real[FLAT] = SLOW, FLATTEST * smallest
    real[ENOUGH_V], real[ENOUGH_X] = o.tolerance, o.tolerance
    count[SWEEPS], count[LIFTS] = o.iterations or SWEEPS_USUAL, o.position_iterations or LIFTS_USUAL
    law = RESTITUTION.index(o.restitution) + 1
    count[LAW] = law if (np.nan_to_num(scene.surfaces.pair[..., su.RESTITUTION]) > 0.0).any() else NO_RESTITUTION
    turn = matrix_to_quaternion(M.pose[:, 3:].reshape(-1, 3, 3))
    free = free_bodies(scene.carriers.mass, scene.carriers.inertia, turn, planar)
    count[SEQUENTIAL] = o.impacts == "sequential"
    pace = Pace(real, count, np.zeros(8, np.int64))
    stepper = Stepper(scene.geometry, free, M.pose[:, :3], M.twist, scene.surfaces, pace, MARGIN * smallest)
    r = stepper.rooms
    r.O.count[COULOMB] = o.coulomb
    pace.door[1:4] = gauss_seidel.address(r.P, r.X, r.W, r.O, r.F)
    return stepper


def march(stepper: Stepper, t_end: float, times: np.ndarray, longest: float, kept: Collected, tell: Tell) -> None:
    """Steps of at most ``longest`` seconds that end at the output times, as equal as these allow."""
    first = float(times[0])
    stepper.pace.real[TIME] = first
    kept.add(0.0)
    for t in times[1:]:
        way = float(t) - float(stepper.pace.real[TIME])
        steps = max(1, math.ceil(way / longest * (1.0 - 1e-9)))
        stepper.run(steps, way / steps)
        stepper.pace.real[TIME] = float(t)
        kept.add(way / steps)
        tell((float(t) - first) / ((t_end - first) or 1.0))


def result_of(
    base: Assembly, scene: Touching, stepper: Stepper, kept: Collected, sides: Sides, o: Impulse, since: float
) -> Result:
    """The motion by name."""
    values, model = base.compiled.values, base.compiled.structure.model
    q, v = coordinates(base, scene, kept)
    t = np.array(kept.t)
    vdot = np.zeros_like(v)
    vdot[1:] = np.diff(v, axis=0) / np.diff(t)[:, None] if len(t) > 1 else 0.0
    count = stepper.pace.count
    health = Health(
        success=True,
        message="reached the end",
        violation=0.0,
        velocity_violation=0.0,
        steps=int(count[TAKEN]),
        rejected=0,
        evaluations=int(count[ITERATIONS]),
        factorisations=0,
        seconds=time.perf_counter() - since,
        options=dataclasses.asdict(o),
        coordinates="absolute: steps of impulses",
    )
    states = np.zeros((len(t), len(values.structure.states)))
    lam = np.zeros((len(t), len(values.system.row_i)))
    result = Result(model, values, t, q, v, states, vdot, lam, health)
    result.contacts = kept.as_contacts(sides, model.planar)
    result.bulk = sets(model, scene, kept)
    return result
