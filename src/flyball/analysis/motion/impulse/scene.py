"""The scene at the start of a motion with contact: what moves, where it is, and the stepper that moves it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ....contact import surfaces as su
from ....contact.tables import RADIUS, Movers
from ....model.geometry import matrix_to_quaternion
from ....stepping.stepper import Stepper, free_bodies
from ....stepping.tables import (
    COUNTS,
    DIVIDES,
    ENOUGH_V,
    ENOUGH_X,
    FLAT,
    GRAVITY,
    LAW,
    LIFTS,
    NO_RESTITUTION,
    REALS,
    ROUGH,
    SEQUENTIAL,
    SLOWEST,
    SWEEPS,
    YIELDING,
    Pace,
)
from ....tables.contact import Touching
from ....tables.coordinates import BodyState
from ....tables.values import Values
from ...assembly.start import Assembly
from .held import Held
from .settings import RESTITUTION, Stepping

MARGIN = 0.01  # gap up to which what does not approach is a contact, in parts of the smallest shape
FLATTEST = 1e-9  # overlap that is none, in parts of the smallest shape
SLOW = 1e-6  # speed [m/s] below which nothing bounces, whatever gravity is
USUAL = {"auto": 30, "newton": 100, "gauss-seidel": 50, "admm": 200}
"""Most iterations by solver, where nobody says how many; of the others `OFTEN`."""
COARSE = 100.0  # times the tolerance that a solve which is cut may leave without a word; or what a body falls faster
OFTEN, LIFTS_USUAL, STEPS_USUAL = 150, 25, 100


def smallest(scene: Touching, values: Values) -> float:
    """Radius [m] of the smallest shape; the mechanism's length where all are without end."""
    sizes = scene.geometry.shape_x[:, RADIUS]
    bounded = sizes[np.isfinite(sizes)]
    return float(bounded.min() if len(bounded) else values.length)


def placed(scene: Touching, base: Assembly) -> Movers:
    """Movers where the assembled mechanism has them; sets of bodies are as described."""
    return movers(scene, base.compiled.moving(base.t, base.q, base.v))


def movers(scene: Touching, bodies: Mapping[str, BodyState]) -> Movers:
    """Movers where the single bodies are; sets of bodies are as described."""
    M = Movers(scene.carriers.movers.pose.copy(), scene.carriers.movers.twist.copy())
    for name, b in bodies.items():
        k = scene.carriers.slices[name].start
        M.pose[k] = np.r_[b.p, b.R.ravel()]
        M.twist[k] = np.r_[b.v, b.w]
    return M


def begin(scene: Touching, M: Movers, values: Values, o: Stepping, held: Held | None = None) -> Stepper:
    """The stepper at the start."""
    planar = values.structure.model.planar
    real, count = np.zeros(REALS), np.zeros(COUNTS, np.int64)
    real[GRAVITY : GRAVITY + 3] = values.system.gravity
    size = smallest(scene, values)
    real[SLOWEST], real[FLAT] = SLOW, FLATTEST * size
    real[ENOUGH_V], real[ENOUGH_X] = o.tolerance, o.tolerance
    real[ROUGH] = max(float(np.sqrt((real[GRAVITY : GRAVITY + 3] ** 2).sum())), COARSE * o.tolerance / o.longest)
    usual = USUAL.get(o.solver, OFTEN)
    count[SWEEPS], count[LIFTS] = o.iterations or usual, o.position_iterations or max(LIFTS_USUAL, usual // 2)
    law = RESTITUTION.index(o.restitution) + 1
    count[LAW] = law if (np.nan_to_num(scene.surfaces.pair[..., su.RESTITUTION]) > 0.0).any() else NO_RESTITUTION
    n = len(M.pose) - (len(held.joints.mover) if held else 0)
    turn = matrix_to_quaternion(M.pose[:n, 3:].reshape(-1, 3, 3))
    free = free_bodies(scene.carriers.mass[:n], scene.carriers.inertia[:n], turn, planar)
    count[DIVIDES] = o.step is None
    count[SEQUENTIAL] = o.impacts == "sequential"
    count[YIELDING] = (np.nan_to_num(scene.surfaces.pair[..., [su.STIFFNESS, su.MODULUS]]) > 0.0).any()
    pace = Pace(real, count, np.zeros(8, np.int64))
    joints = held.joints if held else None
    at, twist, margin = M.pose[:n, :3], M.twist[:n], MARGIN * size
    stepper = Stepper(scene.geometry, free, at, twist, scene.surfaces, pace, margin, o.solver, joints)
    choices = stepper.rooms.O.count
    choices.coulomb = o.coulomb
    choices.most_steps = STEPS_USUAL if o.iterations is None else 0
    return stepper
