"""Inputs and outputs of a stepper: parameters that laws read, and quantities measured at a state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..assembly.compiled_mechanism import compile_mechanism
from ..engine.entry_point import POSITION
from ..errors import ModelError
from ..model.body import GROUND, Driver, Frame
from ..model.controller import Sensor
from ..model.element_laws import with_inputs
from ..model.model import Model
from ..model.quantities import single_quantity
from ..numerics.integrators.butcher_tableaux import tableau
from ..numerics.integrators.time_loop import StateVectors, StepCounts, StepReals, StepState
from ..tables.element_numbers import element_numbers
from ..tables.law_inputs import element_laws
from ..tables.structure_definition import Structure

CHANGED_INPUT = 1.5  # factor of an input's value, to find out which numbers depend on it


def model_with_inputs(model: Model, names: Sequence[str]) -> tuple[Model, list[str]]:
    """Return a copy of a model in which inputs are parameters, and the names of these parameters.

    Raises
    ------
    ModelError
        If there is no such input, or it sets more than laws of forces, motors and controllers.
    """
    repeated = [name for k, name in enumerate(names) if name in names[:k]]
    if repeated:
        raise ModelError(f"the input {repeated[0]!r} is named twice; leave one of them out")
    out, inputs = with_inputs(model, names)
    for x in inputs:
        driven = [e.title for e, law, _ in element_laws(out) if isinstance(e, Driver) and x.parameter in law.names]
        if driven:
            raise ModelError(
                f"{x.name!r} cannot be an input of a stepper: it sets the position of {driven[0]}, which would jump "
                "from one step to the next. Use a motor whose torque is the input, or whose law is that of a servo"
            )
        _refuse_numbers(out, x.name, x.parameter)
    return out.snapshot(), [x.parameter for x in inputs]


def _refuse_numbers(model: Model, name: str, parameter: str) -> None:
    """Refuse a parameter that numbers of elements depend on."""
    value = float(model.environment({})[parameter])
    numbers = element_numbers(model)
    try:
        changed = element_numbers(model, {parameter: CHANGED_INPUT * value if value else 1.0})
    except ModelError as error:  # the other value is invalid: some number depends on it
        raise ModelError(
            f"{name!r} cannot be an input of a stepper, since it sets numbers of elements: {error}"
        ) from None
    found = [k for k, x in numbers.of.items() if not _equal(vars(x), vars(changed.of[k]))]
    if found:
        raise ModelError(
            f"{name!r} cannot be an input of a stepper: {model[found[0]].title} depends on it by a number (a mass, a "
            "length, a stiffness), and inputs are read by laws only. Give a force or motor as input, or write the law "
            "with a parameter of its own"
        )


def _equal(a: Mapping[str, Any], b: Mapping[str, Any]) -> bool:
    return all(repr(x) == repr(b[k]) for k, x in a.items())


class Measurement:
    """Outputs, and poses of bodies and frames, at states of one motion.

    Parameters
    ----------
    model : Model
    outputs : sequence of str
        Sensors, and curves such as ``"A.angle"``.
    tree : sequence of str
        Tree joints of the motion's coordinates; empty for absolute coordinates.
    parameters : mapping, optional

    Attributes
    ----------
    state : ndarray (ny,)
        The state (q, v, z) that `update` evaluates; to be written in place.
    q, v : ndarray (nq,), (nv,)
        Parts of it.

    Raises
    ------
    ModelError
        If an output is not a position, angle, length or rate.
    """

    def __init__(
        self,
        model: Model,
        outputs: Sequence[str],
        tree: Sequence[str],
        parameters: Mapping[str, float] | None,
    ) -> None:
        model, names = _with_sensors(model, outputs)
        c = self._compiled = compile_mechanism(model, parameters=parameters, tree=tree, outputs=names, solved=False)
        s = self.structure = c.structure
        ny = s.nq + s.nv + len(s.states)
        y = StateVectors.blank(ny)
        clock = StepState(
            StepReals.blank(), StepCounts.blank(), np.zeros(0), y, np.zeros((1, ny)), np.zeros(0, np.int64)
        )
        self._time, self.state = clock.real, y.current
        self.state[:] = np.concatenate([c.values.q, c.values.v, c.z])
        self.q, self.v = self.state[: s.nq], self.state[s.nq : s.nq + s.nv]
        self._evaluate = c.bound(tableau("rk45"), clock, np.zeros((0, 0)))
        self._columns = np.array([s.slots[name] for name in names], np.int64)
        self._values, self._records = c.work.sensed.value, c.work.BK
        self._frames: dict[str, tuple[int, np.ndarray, np.ndarray]] = {}

    def common_states(self, other: Structure) -> list[tuple[int, int]]:
        """Return the entries of controller states, angles and places in the state of another structure, and in this."""
        first, here = other.nq + other.nv, self.structure.nq + self.structure.nv
        own = self.structure.state_at
        return [(first + k, here + own[name]) for name, k in other.state_at.items() if name in own]

    def update(self, t: float) -> None:
        """Evaluate at time t and the state."""
        self._time.t = t
        self._evaluate(POSITION)

    def outputs(self, out: np.ndarray) -> None:
        """Write the outputs at the state last evaluated."""
        out[:] = self._values[self._columns]

    def pose(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return position (3,) and rotation (3, 3) of a body's reference frame or a named frame."""
        b, p, R = self._frame(name)
        if b < 0:
            return p.copy(), R.copy()
        record = self._records[b]
        turned = record[3:12].reshape(3, 3)
        return record[:3] + turned @ p, turned @ R

    def velocity(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the velocity of the origin and the angular velocity of a body's reference frame or a named frame.

        Both are (3,), along the axes of the world.
        """
        b, p, _ = self._frame(name)
        if b < 0:
            return np.zeros(3), np.zeros(3)
        record = self._records[b]
        spin = record[12:15].copy()
        return record[15:18] + np.cross(spin, record[3:12].reshape(3, 3) @ p), spin

    def _frame(self, name: str) -> tuple[int, np.ndarray, np.ndarray]:
        """Return the body's row, and the frame's position and rotation on it."""
        if name not in self._frames:
            values, e = self._compiled.values, self.structure.model[name]
            if name != GROUND and e.category not in ("bodies", "frames"):
                raise ModelError(f"{e.title} has no pose; name a body or a frame")
            p, R = values.poses.named(name)
            carrier = e.body if isinstance(e, Frame) else name
            body, row = values.bodies[carrier], self.structure.place[carrier]
            self._frames[name] = (row, p, R) if row < 0 else (row, body.R.T @ (p - body.c), body.R.T @ R)
        return self._frames[name]


def _with_sensors(model: Model, outputs: Sequence[str]) -> tuple[Model, list[str]]:
    """Return a copy with a sensor for each output that is not one, and the names of the sensors."""
    out, names = model.copy(), []
    for k, name in enumerate(outputs):
        single_quantity(model, name)  # refuses unknown names
        sensor = out.find(name) if "." not in name else None
        if not isinstance(sensor, Sensor):
            sensor = Sensor(f"output_{k}_of_{''.join(c if c.isalnum() else '_' for c in name)}", of=name)
            out.add(sensor)
        if out.measured(sensor) is None:
            raise ModelError(
                f"{name!r} cannot be an output of a stepper, which are positions, angles, lengths and their rates; "
                "accelerations and reactions follow from forces"
            )
        names.append(sensor.name)
    return out.snapshot(), names
