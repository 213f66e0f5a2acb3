"""What is kept of a motion with contact at the output times."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....contact.tables import FOUND, GAP, MOVER, SHAPE_1, SHAPE_2
from ....math.vec import mtv, quaternion_matrix
from ....model.model import Model
from ....results.bulk import Bulk
from ....results.contacts import Contacts
from ....results.sides import OPEN, SLIP, STICK, Sides
from ....stepping.stepper import Stepper
from ....stepping.tables import (
    ANGLE,
    GIVEN,
    IMPULSE,
    KICK,
    LOST_FRICTION,
    LOST_IMPACT,
    NUMERICAL,
    SLIDES,
    STEP,
    STORED,
    STORED_FIRST,
    TIME,
)
from ....tables.contact import Touching
from ...assembly.start import Assembly
from .held import Held

SUMS = (LOST_FRICTION, LOST_IMPACT, GIVEN, NUMERICAL, STORED)


class Collected:
    """Rows of output, put together at the end.

    Parameters
    ----------
    stepper : Stepper
    held : Held, optional
        The mechanism.
    side_of : (movers + 1,) of int
        Of each mover the side that it is in `Sides`; the last one is that of ground.
    """

    def __init__(self, stepper: Stepper, held: Held | None, side_of: np.ndarray) -> None:
        self.stepper, self.held, self.side_of = stepper, held, side_of
        self.t: list[float] = []
        self.pose: list[np.ndarray] = []
        self.turn: list[np.ndarray] = []
        self.angle: list[np.ndarray] = []  # of bodies in the plane: whole turns count
        self.twist: list[np.ndarray] = []
        self.acceleration: list[
            np.ndarray
        ] = []  # mean of the step that ends at the time; of the first step at the start
        self.sums: list[np.ndarray] = []
        self.contacts: list[dict[str, np.ndarray]] = []

    def add(self, moved: bool) -> None:
        """Keep where the stepper is now, and the contacts of the last step if one led here."""
        s = self.stepper
        self.t.append(float(s.pace.real[TIME]))
        self.pose.append(s.movers.pose[: len(s.free.turn), :3].copy())
        self.turn.append(s.free.turn.copy())
        self.angle.append(s.free.move[:, ANGLE].copy())
        self.twist.append(s.rooms.X.v[:, :6].copy())
        sums = s.pace.real[list(SUMS)]
        sums[SUMS.index(LOST_IMPACT)] += s.joints.real.lost
        sums[SUMS.index(NUMERICAL)] += s.joints.real.astray
        self.sums.append(sums)
        if self.held:
            self.held.add(s.joints, moved)
        if moved:
            self.begin()
        self.contacts.append(self._touching() if moved else {})

    def first(self) -> None:
        """Keep the mean accelerations of the first step for the start, and what was stored there."""
        self.sums[0][SUMS.index(STORED)] = self.stepper.pace.real[STORED_FIRST]
        self.begin()

    def begin(self) -> None:
        """Keep the mean accelerations of the last step."""
        s = self.stepper
        self.acceleration.append((s.rooms.X.v[:, :6] - s.free.before[:, :6]) / s.pace.real[STEP])

    def _touching(self) -> dict[str, np.ndarray]:
        """Contacts with a force, and the normals along which these were found: those of the middle of the step.

        Their points have the arms by which they were found, from where mass centres were when the step began; between
        two that move the mean of both. So the torques of the table are those of the motion.
        """
        s = self.stepper
        C, kept = s.last()
        n = int(C.count[FOUND])
        impulse = kept[:n, IMPULSE : IMPULSE + 3] + kept[:n, KICK : KICK + 3]
        k = np.flatnonzero((impulse != 0.0).any(axis=1))
        mover = s.geometry.shape_i[C.at[k][:, [SHAPE_1, SHAPE_2]], MOVER]
        moving = (mover >= 0)[:, :, None]
        points = np.where(moving, s.free.start[mover, :3] + s.rooms.P.arm[k].reshape(-1, 2, 3), 0.0)
        return {
            "pair": self.side_of[mover],
            "point": points.sum(axis=1) / np.maximum(moving.sum(axis=1), 1),
            "normal": s.rooms.P.frame[k, :3].copy(),
            "gap": C.x[k, GAP],
            "force": impulse[k] / s.pace.real[STEP],
            "state": np.where(kept[k, SLIDES] > 0.5, SLIP, np.where(kept[k, SLIDES] < -0.5, OPEN, STICK)),
            "friction": s.rooms.P.mu[k],
        }

    def as_contacts(self, sides: Sides, planar: bool) -> Contacts:
        """All contacts of all output times."""
        empty: dict[str, Any] = {"pair": np.zeros((0, 2), np.int64), "state": np.zeros(0, np.int64)}
        empty |= {k: np.zeros((0, 3)) for k in ("point", "normal", "force")}
        empty |= {k: np.zeros(0) for k in ("gap", "friction")}
        rows = [c or empty for c in self.contacts]
        begin = np.cumsum([0, *(len(c["gap"]) for c in rows)])
        table: dict[str, Any] = {k: np.concatenate([c[k] for c in rows]) for k in empty}
        return Contacts(t=np.array(self.t), sides=sides, begin=begin, planar=planar, **table)


def coordinates(base: Assembly, scene: Touching, kept: Collected) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Absolute coordinates (n, nq), velocities and accelerations (n, nv) of single bodies over time."""
    s = base.compiled.structure
    tree = s.tables["tree"]
    n = len(kept.t)
    q, v = np.tile(base.q, (n, 1)), np.zeros((n, s.nv))
    a = np.zeros((n, s.nv))
    pose, turn, twist = np.array(kept.pose), np.array(kept.turn), np.array(kept.twist)
    change = np.array(kept.acceleration[:n]) if kept.acceleration else np.zeros_like(twist)
    for name, b in s.place.items():
        if b < 0 or name not in scene.carriers.slices:
            continue
        k = scene.carriers.slices[name].start
        if k >= pose.shape[1]:  # of the mechanism
            continue
        q0, v0, width = tree.q[b], tree.v[b], tree.nv[b]
        line = slice(v0, v0 + 2 if s.model.planar else v0 + 3)
        v[:, line], a[:, line] = twist[:, k, : line.stop - v0], change[:, k, : line.stop - v0]
        if s.model.planar:
            q[:, q0 : q0 + 2] = pose[:, k, :2]
            if width == 3:
                q[:, q0 + 2] = base.q[q0 + 2] + np.array(kept.angle)[:, k]
                v[:, v0 + 2], a[:, v0 + 2] = twist[:, k, 5], change[:, k, 5]
            continue
        q[:, q0 : q0 + 3] = pose[:, k]
        if width == 6:
            e = turn[:, k] * (1.0 if turn[0, k] @ base.q[q0 + 3 : q0 + 7] >= 0.0 else -1.0)
            q[:, q0 + 3 : q0 + 7] = e
            R = quaternion_matrix(*e.T)
            v[:, v0 + 3 : v0 + 6] = np.stack(mtv(R, twist[:, k, 3:].T), axis=1)
            a[:, v0 + 3 : v0 + 6] = np.stack(mtv(R, change[:, k, 3:].T), axis=1)
    return q, v, a


def sets(model: Model, scene: Touching, kept: Collected) -> dict[str, Bulk]:
    """Sets of bodies by name."""
    out = {}
    for name in scene.carriers.names:
        if name in scene.carriers.single:
            continue
        at = scene.carriers.slices[name]
        J = scene.carriers.inertia[at]
        out[name] = Bulk(
            name=name,
            mass=scene.carriers.mass[at],
            inertia=J,
            com=model[name].sizes()[:, None] * scene.carriers.com[name],
            position=np.array([p[at] for p in kept.pose]),
            quaternion=np.array([p[at] for p in kept.turn]),
            velocity=np.array([p[at, :3] for p in kept.twist]),
            angular_velocity=np.array([p[at, 3:] for p in kept.twist]),
        )
    return out
