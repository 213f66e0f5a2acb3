"""Joints, their reactions in any axes and on either body; drivers, couplings, controllers and sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...engine.rows import COEFFICIENT
from ...errors import ModelError
from ...math.scalar import atan2, rounded
from ...math.vec import mtv, sub
from ...model.controller_signals import signal_law
from ...tables.forest import coordinate_row
from ..motion_record import FULL_TURN, Wrench, curve_places, gravity_over_time, measured_coordinate
from .base import PartView, components_array

if TYPE_CHECKING:
    from ..result import Result

DERIVATIVE_ENDINGS = ("", "_rate", "_acceleration")


class JointView(PartView):
    """Coordinates and reaction of a joint."""

    def __init__(self, result: Result, element: Any) -> None:
        super().__init__(result, element)
        self._known: dict[tuple[str, bool], tuple[np.ndarray, np.ndarray, np.ndarray]] = {}

    def _measure(self, what: str, solved: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return a coordinate, its rate and, if ``solved``, its acceleration, by the row that measures it."""
        e = self.element
        records = self._result.records if solved else self._result.motions
        kind = e.coordinates[what].row.of_kind
        turns = curve_places(self._result, e) if kind.place else self._turns(what) if kind.turns else None
        value, rate, second = measured_coordinate(records, e, what, turns)
        return value + e.offset(self._x.numbers[e.name], what), rate, second

    def _turns(self, what: str) -> Any:
        """Return an approximation of the measured angle that includes full turns; None if nothing counts them."""
        s, S = self._x.structure, self._x.system
        row = coordinate_row(s, self.element.name, what)
        if row is not None:
            return self.element.coordinates[what].sign * self._result.q[:, S.tree.q[row]]
        name = f"{self.element.name}.{what}"
        if name in s.state_at:
            return self._result.states[:, s.state_at[name]]
        if not self._result.planar:
            return None
        r = self._result.motions
        i, j = (s.frame_at[self.element.name, role, ""] for role in self.element.coordinates[what].frames)
        (here, drawn_here), (there, drawn_there) = (
            (
                self._heading(k) + r.angle(int(S.frame_body[k])),
                self._heading(k) + r.reference_angle(int(S.frame_body[k])),
            )
            for k in (i, j)
        )
        return there - here - FULL_TURN * rounded((drawn_there - drawn_here) / FULL_TURN)

    def _heading(self, frame: int) -> Any:
        """In the plane: return the angle of a frame's x axis in its body."""
        R = self._x.system.frames.rotation[frame]
        return atan2(*R[[3, 0]].tolist())

    def _found(self, name: str) -> np.ndarray:
        """Return a coordinate by name, or its derivatives with ``_rate`` and ``_acceleration`` appended."""
        if name == "place":
            return curve_places(self._result, self.element)
        if name.endswith("_effort"):
            return self.lock_effort(name.removesuffix("_effort"))
        k = next((k for k, ending in enumerate(DERIVATIVE_ENDINGS) if k and name.endswith(ending)), 0)
        what = name.removesuffix(DERIVATIVE_ENDINGS[k])
        if (key := (what, k == 2)) not in self._known:
            self._known[key] = self._measure(*key)
        return self._known[key][k]

    def _wrench(self) -> Wrench:
        """Return the force on body_j at M's origin and the torque about it, world components."""
        if "force" not in self.names:
            raise AttributeError(self._unknown("force"))
        return self._result.reactions.of(self.element.name)

    def reaction(self, *, axes: str = "world", on: str | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Reaction force and torque of the joint.

        Parameters
        ----------
        axes : ``"world"``, ``"joint"`` or the name of one of the two bodies
            Axes of the components; ``"joint"`` are those of the joint's frame on ``body_i``.
        on : str
            Body on which it acts; ``body_j`` if not given.

        Returns
        -------
        force [N], torque [N m] : ndarray (n, 3)
            The torque is about the joint's point on ``body_j`` (for a two-point link: its second end).
        """
        return self._result.reactions.in_axes(self.element, axes, on)

    def rotation(self, axes: str) -> np.ndarray:
        """Return rotation matrices, world from the axes named as in `reaction`, (n, 3, 3)."""
        full = [np.broadcast_to(x, len(self._result.t)) for x in self._result.reactions.axes(self.element, axes)]
        return np.stack(full, axis=1).reshape(-1, 3, 3)

    @property
    def force(self) -> np.ndarray:
        """Reaction force on ``body_j``, world axes [N], (n, 2) or (n, 3)."""
        return components_array(self._wrench()[0], self._result.planar)

    @property
    def torque(self) -> np.ndarray:
        """Reaction torque on ``body_j`` about the joint's point, world axes [N m]; planar: (n,)."""
        t = self._wrench()[1]
        return t[2] if self._result.planar else np.stack(t, axis=1)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Reaction components that redundancy leaves undetermined; results contain one of the possible values."""
        return self._result.health.undetermined.get(self.element.name, ())


class DriverView(PartView):
    """Effort and work of a driver."""

    @property
    def effort(self) -> np.ndarray:
        """Force [N] or torque [N m] along its coordinate."""
        return self._result.multipliers[:, self._x.structure.slices[self.element.name].start]

    @property
    def work(self) -> np.ndarray:
        """Work done on the mechanism since the start [J]."""
        return self._result.states[:, self._x.structure.state_at[f"{self.element.name}.work"]]


class CouplingView(PartView):
    """Efforts of a coupling."""

    def effort(self, coordinate: str) -> np.ndarray:
        """Return the force [N] or torque [N m] of the coupling on one of its coordinates, along it."""
        s, S = self._x.structure, self._x.system
        row = s.rows[s.slices[self.element.name].start]
        if row.law >= 0 and coordinate in self.element.coupled():
            slope = self._result.reactions.law_slope(row.law, s.slots[coordinate])
            return -slope * self._result.multipliers[:, s.slices[self.element.name].start]
        for k in s.terms_of.get(self.element.name, ()):
            t = s.terms[k]
            if f"{t.owner.name}.{t.what}" == coordinate:
                return self._result.multipliers[:, t.row] * S.term_parameters[k, COEFFICIENT] / t.sign
        has = ", ".join(self.element.coupled())
        raise ModelError(f"{self.element.title} does not couple {coordinate!r}; it couples {has}")

    def _found(self, name: str) -> np.ndarray:
        """Return ``effort_1``, ``effort_2`` ... on its coordinates, in order, or the work of an equation of time."""
        if name == "work":
            return self._result.states[:, self._x.structure.state_at[f"{self.element.name}.work"]]
        return self.effort(list(self.element.coupled())[int(name.removeprefix("effort_")) - 1])


class ControllerView(PartView):
    """States and signals of a controller over time."""

    def _found(self, name: str) -> np.ndarray:
        """Return a state, or a signal from the formula that replaces it in laws."""
        s = self._x.structure
        state = s.state_at.get(f"{self.element.name}.{name}")
        if state is not None:
            return self._result.states[:, state]
        law = signal_law(s.model, self.element, name)
        sensed = self._result.measured.slots
        env: dict[str, Any] = {"t": self._result.t, **self._x.env}
        env |= {k: sensed[0, m] for k, m in s.slots.items()}
        return law.evaluate(env, s.model.law_tables()) + self._result.records.zeros()


class SensorView(PartView):
    """A measured quantity with its own name."""

    @property
    def value(self) -> np.ndarray:
        """Measured values over time, in SI units."""
        return self._result.channel(self.element.of)[1]

    @property
    def unit(self) -> str:
        """Unit of the measured quantity."""
        return self.names["value"].unit


class IMUView(PartView):
    """Readings of accelerometers and gyroscopes on a body."""

    def _axes(self) -> tuple:
        return self._result.records.named(self.element.frame)

    @property
    def specific_force(self) -> np.ndarray:
        """Acceleration of its origin minus gravity, along its own axes [m/s^2], (n, 3)."""
        _, R, _, _, _, a = self._axes()
        gravity = gravity_over_time(self._result)
        return np.stack(mtv(R, sub(a, gravity)), axis=1)

    @property
    def angular_velocity(self) -> np.ndarray:
        """Angular velocity along its own axes [rad/s], (n, 3)."""
        _, R, w, _, _, _ = self._axes()
        return np.stack(mtv(R, w), axis=1)
