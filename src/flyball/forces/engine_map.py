"""Combustion engine: its torque by speed and throttle, with idle governor and speed limiter."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, ClassVar

from ..errors import ModelError
from ..model.element import Element, Law, LawOf, Number, Unit, element, nonnegative, positive
from ..model.force import JointForce
from ..model.table import Column
from ..model.table_2d import Rows, Table2D
from .motor import Motor
from .rotor_inertia import RotorInertia

if TYPE_CHECKING:
    from ..model.model import Model

BAND = 0.05  # of idle speed or speed limit: range in which governor and limiter move the throttle


@element
class EngineMap(JointForce):
    """An engine whose torque is a function of speed and throttle, given on a grid.

    Between the points the torque is bicubic (`Table2D`), beyond them it continues with the slope of the edge. The row
    of the closed throttle is the drag of the engine: engine braking. An idle governor opens the throttle where the
    speed falls below ``idle``, fully at 5 % less; a limiter closes it at ``limit``, from 5 % below on. With the
    throttle p of the driver, that of the engine is (1 - (1 - p)(1 - p_idle)) p_limit.

    Its parts belong to it: the table ``NAME_map``, the `Motor` ``NAME_torque``, and with ``inertia`` the `RotorInertia`
    ``NAME_rotor``.

    Parameters
    ----------
    name : str
        One word, as the parts are named in expressions.
    joint : str
        Joint with a coordinate ``angle``: the crankshaft in its engine. The torque is positive on ``body_j``.
    speeds : numbers [rad/s]
        Speeds of the grid, ascending; in ``speed_unit`` if given.
    throttles : numbers
        Throttle positions of the grid, ascending from 0 to 1.
    torques : lists of numbers [N m]
        ``torques[i][k]`` at ``speeds[i]`` and ``throttles[k]``.
    throttle : law
        Position from 0, closed, to 1: an expression of ``t``, ``angle``, ``rate``, sensors, parameters and controllers:
        ``"driver.throttle"``.
    idle, limit : number [rad/s]
        Idle speed and speed limit; no governor, no limiter if not given.
    inertia : number [kg m^2]
        Inertia of crankshaft and flywheel about the axis, in addition to that of ``body_j``.
    speed_unit : str
        Unit in which the speeds are written, such as ``"rpm"``.

    Notes
    -----
    A result contains ``angle``, ``rate`` and ``torque``. Consumption, turbo lag and torsional excitation by the
    cylinders are not modelled; a lag is that of the throttle, by a `Lag`.
    """

    speeds: Column
    throttles: Column
    torques: Rows
    throttle: Annotated[Law, LawOf("1", ("angle", "rate"))]
    idle: Annotated[Number | None, Unit("rad/s")] = None
    limit: Annotated[Number | None, Unit("rad/s")] = None
    inertia: Annotated[Number, Unit("kg*m^2")] = 0.0
    speed_unit: str = ""

    odd: ClassVar[tuple[str, ...] | None] = None
    outputs: ClassVar[dict[str, str]] = {"angle": "rad", "rate": "rad/s", "torque": "N*m"}
    shows_parts: ClassVar[bool] = False

    def check(self, n: SimpleNamespace) -> None:
        """Require a name of one word, throttles from 0 to 1, and an idle speed below the limit."""
        if not all(word.isidentifier() for word in self.name.split(".")):
            raise ModelError(f"{self.title}: its parts occur in expressions; give it a name of one word")
        if self.throttles[:1] != (0.0,) or self.throttles[-1:] != (1.0,):
            raise ModelError(
                f"{self.title}: throttles is {self.throttles}; the grid begins at 0, the closed throttle, and ends at 1"
            )
        positive(self, n, "idle", "limit")
        nonnegative(self, n, "inertia")
        if n.idle is not None and n.limit is not None and not n.idle.real < (1.0 - BAND) * n.limit.real:
            raise ModelError(
                f"{self.title}: idle is {n.idle:g} rad/s and limit {n.limit:g} rad/s; the limit must exceed the "
                f"idle speed by more than {100 * BAND:g} %"
            )

    def acts(self) -> bool:
        """Return False: its parts act."""
        return False

    def transmitted(self) -> str:
        """Return the curve of the part that carries its torque."""
        return f"{self.name}_torque.torque"

    def position(self) -> str:
        """Return the throttle position of the engine: that of the driver, of the governor and of the limiter."""
        out = f"({self.throttle})"
        if self.idle is not None:
            out = f"(1 - (1 - {out})*(1 - step(rate, {1.0 - BAND}*({self.idle}), 1, ({self.idle}), 0)))"
        if self.limit is not None:
            out = f"{out}*step(rate, {1.0 - BAND}*({self.limit}), 1, ({self.limit}), 0)"
        return out

    def parts(self, model: Model) -> tuple[Element, ...]:
        """Return the map, the torque by it, and the inertia."""
        table = Table2D(
            f"{self.name}_map", x=self.speeds, y=self.throttles, z=self.torques, x_unit=self.speed_unit, beyond="line"
        )
        torque = Motor(f"{self.name}_torque", self.joint, torque=f"{table.name}(rate, {self.position()})")
        if self.inertia == 0.0:
            return (table, torque)
        return (table, torque, RotorInertia(f"{self.name}_rotor", self.coordinate_text(), inertia=self.inertia))
