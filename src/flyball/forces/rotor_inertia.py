"""Inertia of a rotor that turns with a joint's coordinate."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

from ..errors import ModelError
from ..model.element import Number, Unit, element, nonnegative
from ..model.force import CoordinateForce
from ..model.joint import Joint
from ..model.model import Model
from .coordinate_spring import KIND, effort


@element
class RotorInertia(CoordinateForce):
    """Inertia of a motor's rotor and gear, which turns ``ratio`` times as fast as a joint: the armature of a robot.

    It adds ``inertia * ratio**2`` to the entry of the mass matrix that belongs to the coordinate, and ``inertia *
    (ratio * rate)**2 / 2`` to the kinetic energy. Only the rotation relative to the body that carries the motor counts,
    as in Featherstone (2008, section 9.6) and in programs for robots. Neglected are therefore the acceleration of the
    rotor with its carrier, which is smaller by the factor 1/ratio, and the gyroscopic torque of its spin; both vanish
    on ground. To include them, describe the rotor as a `Body` of its own with a `GearPair`.

    Its ``force`` in results is the inertial force on the joint, -inertia * ratio**2 * acceleration.

    The mechanism is computed in joint coordinates. A coordinate that cannot be one of them, such as that of the joint
    at which a loop is cut, is refused.

    Parameters
    ----------
    name : str
    coordinate : str
        Angle or displacement of a joint: ``"elbow.angle"``.
    inertia : number [kg m^2]
        Moment of inertia of the rotor about its axis.
    ratio : number [1] or [rad/m]
        Speed of the rotor divided by that of the joint: turns per turn, for a slide radians per metre.

    Raises
    ------
    ModelError
        If the inertia is negative, the ratio is zero, or the coordinate is not that of an axis of a joint.
    """

    coordinate: str = field(kw_only=False)
    inertia: Annotated[Number, Unit("kg*m^2")]
    ratio: Annotated[Number, Unit(None)] = 1.0

    kind: ClassVar[int] = KIND
    odd: ClassVar[tuple[str, ...]] = ()
    effort: ClassVar = staticmethod(effort)
    adds_inertia: ClassVar[bool] = True
    dimensions: ClassVar = {"ratio": ("rad/m", "1")}
    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "force": "effort"}

    def coordinate_text(self) -> str:
        """Return the coordinate as given."""
        return self.coordinate

    def check(self, n: SimpleNamespace) -> None:
        """Require an inertia that is not negative, and a ratio other than zero."""
        nonnegative(self, n, "inertia")
        if n.ratio == 0.0:
            raise ModelError(
                f"{self.title}: ratio is 0, with which the rotor does not turn; give its turns per turn of the joint, "
                "for instance 50"
            )

    def examine(self, model: Model) -> None:
        """Require the coordinate of an axis of a joint."""
        owner, what = model.coordinate(self.coordinate, self)
        axes = []
        if isinstance(owner, Joint):
            axes = [p.coordinate for p in owner.primitives(model.planar) if p.kind != "S" and p.coordinate]
        if what not in axes:
            known = f"; {owner.title} has {', '.join(axes)}" if axes else ""
            raise ModelError(f"{self.title}: {self.coordinate!r} is not the coordinate of an axis of a joint{known}")

    def added_inertia(self, n: SimpleNamespace) -> Any:
        """Return the inertia reflected to the joint: inertia times ratio squared."""
        return n.inertia * n.ratio * n.ratio

    def conservative(self) -> bool:
        """Return True: it stores kinetic energy only."""
        return True
