"""A mechanism that is stepped at the pace of a clock, and pulled by a spring from the mouse to a body."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ..errors import ModelError
from ..forces.point_force import PointForce
from ..forces.point_torque import PointTorque
from ..model.model import Model
from ..model.units import to_si
from ..results.result import Result
from ..simulation.measurement import StateSample, model_with_inputs
from .body_points import connected_mass, effective_mass, point_kinematics
from .dragging import DragTarget
from .options import Slider

MAX_PULLED_BODIES = 40
"""Bodies that can be pulled: each adds a force and a torque to every step."""
MAX_SAMPLES = 12
"""States of one picture that are kept for the curves, besides the last."""
PICTURE_INTERVAL = 1.0 / 30.0
"""Interval between two pictures while stepping [s]; steps that are due but not taken by then are omitted, and the page
says so."""
MIN_COMPUTING_TIME = 0.25 * PICTURE_INTERVAL
"""Least time for the steps of one picture [s], if recording the last one has left less."""
MAX_PICTURE_INTERVAL = 1.0
"""Time between two pictures [s] for which steps are made up: a page that was hidden for longer goes on from there."""
SPRING_FREQUENCY = 0.25
"""Angular frequency of the mouse's spring, times a step: the force is constant in a step, which larger values feel."""
SPRING_DAMPING_RATIO = 0.7


class LiveStepping:
    """A stepper with a force and a torque on every body, and with those parameters as inputs that only laws read.

    Parameters
    ----------
    model : Model
    sliders : mapping of str to Slider
    dt : float [s]
        Duration of a step.

    Attributes
    ----------
    recording : float [s]
        Time for recording the last picture, which is not left for steps.

    Raises
    ------
    ModelError
        If the mechanism cannot be stepped, as `Mechanism.stepper`.
    """

    def __init__(self, model: Model, sliders: Mapping[str, Slider], dt: float) -> None:
        self.dt, self._planar = dt, model.planar
        parameters: dict[str, Any] = {name: x.quantity for name, x in sliders.items()}
        c = self._absolute = compile_mechanism(model.snapshot(), parameters=parameters, solved=False)
        out, self._wrenches = _with_wrenches(
            model, [b.name for b in model.bodies][:MAX_PULLED_BODIES], c.structure.points
        )
        self._count = sum(map(len, self._wrenches.values()))
        self._inputs = [name for name in sliders if _is_input(model, name)]
        names = [name for own in self._wrenches.values() for name in own]
        self._stepper = out.stepper(dt, inputs=[*names, *self._inputs], parameters=parameters)
        self.method = self._stepper.method
        self._gripped: tuple[str, tuple[float, ...]] | None = None
        self._slow, self._seconds_per_step = "", math.inf
        self.recording = 0.0
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
        """Return the motion through states, with zero pulls: positions, velocities and energies do not depend on them.

        Then states with the same values of parameters share their tables.
        """
        own = [dataclasses.replace(x, inputs=np.r_[np.zeros(self._count), x.inputs[self._count :]]) for x in samples]
        return self._stepper.motion(own)

    def slow_remark(self) -> str:
        """Say how slow stepping is; nothing if it keeps pace."""
        return self._slow

    def advance(
        self, sliders: Mapping[str, Slider], target: DragTarget | None, count: int | None, speed: float
    ) -> list[StateSample]:
        """Take a number of steps, or those that are due at this speed; return states to show."""
        began, t = time.monotonic(), float(self._stepper.t)
        if began - self.shown > MAX_PICTURE_INTERVAL:
            self.begin_pace()
        due = math.floor(((began - self._since) * speed - (t - self._from)) / self.dt) if count is None else count
        if due <= 0:
            self.shown = began
            return []
        values = np.array([to_si(str(sliders[k].quantity), None) for k in self._inputs])
        end = math.inf if count is not None else began + max(MIN_COMPUTING_TIME, PICTURE_INTERVAL - self.recording)
        samples, done = self._take_steps(due, values, target, end)
        self._slow = ""
        if done < due:
            self._slow = slow_text((time.monotonic() - began) / (done * self.dt), speed)
            self.begin_pace()
        self.shown = began
        return samples

    def _take_steps(
        self, due: int, values: np.ndarray, target: DragTarget | None, end: float
    ) -> tuple[list[StateSample], int]:
        """Take steps until a time of the clock; return states to show, the last among them, and the number of steps."""
        samples, done, stride = [], 0, max(1, due // MAX_SAMPLES)
        while done < due:
            now = time.monotonic()
            if done and now >= end:
                break
            affordable = 1 if end - now < self._seconds_per_step else (end - now) / self._seconds_per_step
            n = 1 if target is not None else int(min(stride - done % stride, due - done, affordable))
            self._stepper.step(np.r_[self._pull(target), values], steps=n)
            self._seconds_per_step = (time.monotonic() - now) / n
            done += n
            if done % stride == 0:
                samples.append(self.sample())
        if done % stride:
            samples.append(self.sample())
        return samples, done

    def _pull(self, target: DragTarget | None) -> np.ndarray:
        """Return the forces and torques on all bodies [N, N m], from the spring between a point and its target.

        Its stiffness and damping follow from the effective mass of the point at the present position. Where that grows
        beyond all bounds, as at a dead centre, the mass of the connected bodies limits it, and with it the force.
        """
        if target is None:
            self._gripped = None
            return np.zeros(self._count)
        if target.body not in self._wrenches:
            raise ModelError(
                f"body {target.body!r} cannot be pulled: only the first {MAX_PULLED_BODIES} bodies of a mechanism can"
            )
        c, v = self._absolute_state()
        mass, grip = effective_mass(c, target.body, target.at), (target.body, tuple(target.at.tolist()))
        if mass == math.inf and grip != self._gripped:
            raise ModelError(
                f"body {target.body!r} cannot be pulled at this point: its joints and drivers leave it no motion"
            )
        self._gripped = grip
        mass, rate = min(mass, connected_mass(c, target.body)), SPRING_FREQUENCY / self.dt
        position, arm, J = point_kinematics(c, target.body, target.at)
        force = mass * rate * (rate * (target.to - position) - 2.0 * SPRING_DAMPING_RATIO * (J @ v))
        moment = np.cross(arm, force)
        wrench = [force[0], force[1], moment[2]] if self._planar else [*force, *moment]
        return np.concatenate(
            [wrench[: len(own)] if body == target.body else np.zeros(len(own)) for body, own in self._wrenches.items()]
        )

    def _absolute_state(self) -> tuple[CompiledMechanism, np.ndarray]:
        """Return the mechanism in absolute coordinates, evaluated at the present position, and the velocities."""
        now = self.motion([self.sample()])
        other, c, t = CompiledMechanism(now.values, now.states[0].copy()), self._absolute, float(now.t[0])
        q, v = c.take(other, t, now.q[0], now.v[0])
        c.at(t, q, np.zeros(c.structure.nv))
        return c, v


def slow_text(seconds: float, speed: float = 0.0) -> str:
    """Say how many seconds of computing a second of motion needs, and that a speed is higher than it allows."""
    text = f"slow: {seconds:.2g} s of computing for 1 s of motion"
    possible = 1.0 / seconds
    return f"{text}, which allows {possible:.2g} of real time and not {speed:g}" if speed > possible else text


def _is_input(model: Model, name: str) -> bool:
    """Return whether a parameter can change while the mechanism moves: only laws read it."""
    try:
        model_with_inputs(model.snapshot(), [name])
    except ModelError:
        return False
    return True


def _with_wrenches(model: Model, bodies: list[str], points: Collection[str]) -> tuple[Any, dict[str, list[str]]]:
    """Return a copy with a force at the mass centre of each body and a torque, zero for now, world axes.

    Parameters
    ----------
    model : Model
    bodies : list of str
    points : collection of str
        Point masses, which have no orientation and get no torque.

    Returns
    -------
    model : Model
    names : dict
        Body -> its inputs: components x, y of the force and the torque in the plane, x, y, z of both in space.
    """
    out, names = model.copy(), {}
    for body in bodies:
        force, torque = (_unused_name(out, f"{what} on {body}") for what in ("force", "torque"))
        zero, axes = ((0, 0), "xy") if model.planar else ((0, 0, 0), "xyz")
        out.add(PointForce(force, body, force=zero))
        names[body] = [f"{force}.{axis}" for axis in axes]
        if body in points:
            continue
        out.add(PointTorque(torque, body, torque=0 if model.planar else zero))
        names[body] += [torque] if model.planar else [f"{torque}.{axis}" for axis in axes]
    return out, names


def _unused_name(model: Model, name: str) -> str:
    while name in model:
        name += "'"
    return name
