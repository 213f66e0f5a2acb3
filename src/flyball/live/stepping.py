"""A mechanism that is stepped in the pace of a watch, and pulled by a spring from the mouse to a body."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ModelError
from ..forces.point_force import PointForce
from ..forces.point_torque import PointTorque
from ..model.model import Model
from ..model.units import to_si
from ..results.result import Result
from ..simulation.measurement import StateSample, model_with_inputs
from .dragging import DragTarget
from .options import Slider

MOST_PULLED = 40
"""Bodies that can be pulled: each adds a force and a torque to every step."""
MOST_SAMPLES = 12
"""States of one picture that are kept for the curves."""
BUDGET = 0.04
"""Time for the steps of one picture [s]; what is not done by then is left out, and the page says so."""
LONGEST_GAP = 1.0
"""Time between two pictures [s] for which steps are made up: a page that was hidden for longer goes on from there."""
SPRING_PHASE = 0.25
"""Angular frequency of the mouse's spring, times a step: the force is constant in a step, which larger values feel."""
SPRING_DAMPING = 0.7
"""Damping ratio of the mouse's spring."""
RIGID = 1e-6
"""Motion of a pulled point, relative to that of the free total mass, below which it does not give way."""


@dataclass(frozen=True)
class _Grip:
    """A pulled point: stiffness [N/m] and damping [N s/m] of the spring, and mass centre in the body's frame [m]."""

    body: str
    at: tuple[float, ...]
    stiffness: float
    damping: float
    com: np.ndarray


class LiveStepping:
    """A stepper with a pull on every body, and with those parameters as inputs that only laws read.

    Parameters
    ----------
    model : Model
    sliders : mapping of str to Slider
    dt : float [s]
        Duration of a step.

    Raises
    ------
    ModelError
        If the mechanism cannot be stepped, as `Mechanism.stepper`.
    """

    def __init__(self, model: Model, sliders: Mapping[str, Slider], dt: float) -> None:
        self.dt, self._planar = dt, model.planar
        self._pulled = [b.name for b in model.bodies][:MOST_PULLED]
        out, pulls = _with_wrenches(model, self._pulled)
        self._inputs = [name for name in sliders if _is_input(model, name)]
        parameters = {name: x.quantity for name, x in sliders.items()}
        self._stepper = out.stepper(dt, inputs=[*pulls, *self._inputs], parameters=parameters)
        self.method = self._stepper.method
        self._width = len(pulls) // max(len(self._pulled), 1)
        self._grip: _Grip | None = None
        self._slow = ""
        self.begin_pace()

    def accepts(self, name: str) -> bool:
        """Return whether a new value of this parameter acts at once, without a new start."""
        return name in self._inputs

    def begin_pace(self) -> None:
        """Begin to keep pace from now on."""
        self._since, self._from = time.monotonic(), float(self._stepper.t)
        self.shown = self._since

    def sample(self) -> StateSample:
        """Return the present state."""
        return self._stepper.sample()

    def motion(self, samples: list[StateSample]) -> Result:
        """Return the motion through states."""
        return self._stepper.motion(samples)

    def slow_remark(self) -> str:
        """Say how slow stepping is; nothing if it keeps pace."""
        return self._slow

    def advance(
        self, sliders: Mapping[str, Slider], target: DragTarget | None, count: int | None, speed: float
    ) -> list[StateSample]:
        """Take a number of steps, or those that are due at this speed; return states to show."""
        began, t = time.monotonic(), float(self._stepper.t)
        if began - self.shown > LONGEST_GAP:
            self.begin_pace()
        due = math.floor(((began - self._since) * speed - (t - self._from)) / self.dt) if count is None else count
        if due <= 0:
            self.shown = began
            return []
        values = np.array([to_si(str(sliders[k].quantity), None) for k in self._inputs])
        grip = self._gripped(target, values) if target is not None else None
        samples, done = [], 0
        stride = max(1, due // MOST_SAMPLES)
        while done < due:
            n = min(stride, due - done) if grip is None else 1
            self._stepper.step(np.r_[self._wrench(grip, target), values], steps=n)
            done += n
            if done % stride == 0 or done == due:
                samples.append(self._stepper.sample())
            if count is None and time.monotonic() - began > BUDGET:
                break
        self._slow = ""
        if done < due:
            samples = samples or [self._stepper.sample()]
            self._slow = f"slow: {(time.monotonic() - began) / (done * self.dt):.2g} s of computing for 1 s of motion"
            self.begin_pace()
        self.shown = began
        return samples

    def _gripped(self, target: DragTarget, values: np.ndarray) -> _Grip:
        """Return the spring on the point of a target, made by how easily the point gives way."""
        at = tuple(target.at.tolist())
        if self._grip is not None and (self._grip.body, self._grip.at) == (target.body, at):
            return self._grip
        if target.body not in self._pulled:
            raise ModelError(
                f"body {target.body!r} cannot be pulled: only the first {MOST_PULLED} bodies of a mechanism can"
            )
        x = self.motion([self.sample()]).values
        unit = _Grip(target.body, at, 0.0, 0.0, np.real(x.bodies[target.body].com))
        mass = self._effective_mass(unit, values, float(x.system.bodies.mass.real.sum()))
        rate = SPRING_PHASE / self.dt
        self._grip = _Grip(target.body, at, mass * rate**2, 2.0 * SPRING_DAMPING * mass * rate, unit.com)
        return self._grip

    def _effective_mass(self, grip: _Grip, values: np.ndarray, total: float) -> float:
        """Return the least mass that the point shows to a force along an axis, joints and contacts included [kg].

        It is measured by trial steps with small forces; the state is restored.
        """
        saved, axes = self._stepper.state, 2 if self._planar else 3
        trial = total / self.dt  # changes the velocity of the free total mass by 1 m/s
        velocities = []
        for force in (np.zeros(3), *(1e-3 * trial * np.eye(3)[:axes])):
            self._stepper.step(np.r_[self._applied(grip, force), values])
            velocities.append(self._kinematics(grip)[1])
            self._stepper.state = saved
        given = max(float((v - velocities[0])[k]) for k, v in enumerate(velocities[1:])) / 1e-3
        if not given > RIGID:
            raise ModelError(f"body {grip.body!r} does not give way at this point: joints or drivers hold it")
        return total / given

    def _kinematics(self, grip: _Grip) -> tuple[np.ndarray, np.ndarray]:
        """Return position and velocity of the gripped point, in the world."""
        (p, R), (v, w) = self._stepper.pose(grip.body), self._stepper.velocity(grip.body)
        arm = R @ np.array(grip.at)
        return p + arm, v + np.cross(w, arm)

    def _wrench(self, grip: _Grip | None, target: DragTarget | None) -> np.ndarray:
        """Return the inputs of all pulls."""
        if grip is None or target is None:
            return np.zeros(self._width * len(self._pulled))
        p, v = self._kinematics(grip)
        return self._applied(grip, grip.stiffness * (target.to - p) - grip.damping * v)

    def _applied(self, grip: _Grip, force: np.ndarray) -> np.ndarray:
        """Return the inputs of all pulls for a force at the gripped point."""
        out = np.zeros((len(self._pulled), self._width))
        _, R = self._stepper.pose(grip.body)
        moment = np.cross(R @ (np.array(grip.at) - grip.com), force)
        row = [force[0], force[1], moment[2]] if self._planar else [*force, *moment]
        out[self._pulled.index(grip.body)] = row[: self._width]
        return out.ravel()


def _is_input(model: Model, name: str) -> bool:
    """Return whether a parameter can change while the mechanism moves: only laws read it."""
    try:
        model_with_inputs(model.snapshot(), [name])
    except ModelError:
        return False
    return True


def _with_wrenches(model: Model, bodies: list[str]) -> tuple[Any, list[str]]:
    """Return a copy with a force at the mass centre of each body and a torque, zero for now, world axes.

    Parameters
    ----------
    model : Model
    bodies : list of str

    Returns
    -------
    model : Model
    names : list of str
        Of the components as inputs: for each body x, y and the torque in the plane, x, y, z of both in space.
    """
    out, names = model.copy(), []
    for body in bodies:
        force, torque = (_unused_name(out, f"{what} on {body}") for what in ("force", "torque"))
        if model.planar:
            out.add(PointForce(force, body, force=(0, 0)), PointTorque(torque, body, torque=0))
            names += [f"{force}.x", f"{force}.y", torque]
        else:
            out.add(PointForce(force, body, force=(0, 0, 0)), PointTorque(torque, body, torque=(0, 0, 0)))
            names += [f"{name}.{axis}" for name in (force, torque) for axis in "xyz"]
    return out, names


def _unused_name(model: Model, name: str) -> str:
    while name in model:
        name += "'"
    return name
