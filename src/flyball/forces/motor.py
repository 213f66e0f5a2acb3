"""Motor: about a joint's axis, a torque by a law, or a speed by a law up to a largest torque."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from ..errors import ModelError
from ..model.body import RATE, Body, Driver
from ..model.element import Element, Law, LawOf, element
from ..model.force import JointForce
from .clutch import Clutch
from .coordinate_spring import KIND, effort

if TYPE_CHECKING:
    from ..model.model import Model

LITTLE = 1e-6  # kg, kg m^2: inertia of bodies whose motion is prescribed


@element
class Motor(JointForce):
    """A motor about the axis of a joint with an angle: its torque follows a law, or its speed up to a largest torque.

    The torque is positive on ``body_j``. A motor of given speed runs at exactly that speed, from any position, while
    it needs less torque than ``limit``; else it acts with that torque towards its speed, until it has reached it. This
    is an ideal drive behind a slipping clutch, and so it is computed. Its parts are a shaft ``NAME_shaft`` in
    ``NAME_bearing`` on ground, whose motion is prescribed (its 1e-6 kg m^2 move nothing), the `Driver` of its rate
    ``NAME_drive``, and the `Clutch` ``NAME_coupling``, which decides what an analysis makes of it. Without ``limit``
    the driver of the joint's rate is its only part.

    Parameters
    ----------
    name : str
    joint : str
        Joint with a coordinate ``angle``.
    torque : law [N m]
        An expression of ``t``, ``angle``, ``rate``, sensors and parameters: ``"stall*(1 - rate/no_load)"``.
    speed : law [rad/s]
        An expression of ``t``, parameters, tables, and sensors of positions and angles: ``"60 rpm"``, or for a servo
        ``"gain*(target - elbow)"`` with a sensor ``elbow`` of the angle.
    limit : law [N m]
        Largest torque in either direction, an expression of ``t``, parameters and sensors, rates too; never negative.

    Notes
    -----
    A result contains ``angle``, ``rate``, ``torque``, and with a limit the events ``stick`` (it reaches its speed) and
    ``slip`` (its torque is at the limit) of ``NAME_coupling``.
    """

    torque: Annotated[Law | None, LawOf("N*m", ("angle", "rate"))] = None
    speed: Law | None = None
    limit: Law | None = None

    kind: ClassVar[int] = KIND
    odd: ClassVar[tuple[str, ...]] = ("torque", "speed")
    effort: ClassVar = staticmethod(effort)
    outputs: ClassVar[dict[str, str]] = {"angle": "rad", "rate": "rad/s", "torque": "N*m"}
    shows_parts: ClassVar[bool] = False

    def check(self, n: SimpleNamespace) -> None:
        """Require a torque or a speed, and a limit of the latter only."""
        if (self.torque is None) == (self.speed is None):
            what = "neither torque nor speed is given" if self.torque is None else "torque and speed are both given"
            raise ModelError(f"{self.title}: {what}; give one of them. A speed up to a torque is speed= and limit=")
        if self.torque is not None and self.limit is not None:
            raise ModelError(
                f"{self.title}: limit is for a given speed; write it into the law of torque: max(-5, min(5, ...))"
            )

    def examine(self, model: Model) -> None:
        """Require the joint's angle, and laws that its parts accept."""
        super().examine(model)
        model.law(self.speed, LawOf("rad/s"), f"speed of {self.title}", driver=True)
        model.law(self.limit, LawOf("N*m"), f"limit of {self.title}")

    def acts(self) -> bool:
        """Return whether it acts by its own law; otherwise by its parts."""
        return self.torque is not None

    def laws(self) -> tuple[Law | None, ...]:
        """Return the torque law."""
        return (self.torque,)

    def parts(self, model: Model) -> tuple[Element, ...]:
        """Return the driver of its speed, with a limit on a shaft of its own behind a clutch."""
        if self.speed is None:
            return ()
        shaft, bearing, drive, coupling = (f"{self.name}_{x}" for x in ("shaft", "bearing", "drive", "coupling"))
        coordinate = f"{self.joint}.angle"
        if self.limit is None:
            return (Driver(drive, f"{coordinate}{RATE}", self.speed),)
        revolute: Any = Element.of_type("Revolute")  # joints are not known here
        n = 2 if model.planar else 3
        return (
            Body(shaft, mass=LITTLE, inertia=LITTLE if model.planar else (LITTLE,) * 3, position=(0.0,) * n),
            revolute(bearing, "ground", shaft, at=(0.0,) * n, axis=None if model.planar else (0.0, 0.0, 1.0)),
            Driver(drive, f"{bearing}.angle{RATE}", self.speed),
            Clutch(coupling, f"{bearing}.angle", coordinate, capacity=self.limit),
        )

    def transmitted(self) -> str:
        """Return the curve of the part that carries its torque; empty if it acts itself."""
        if self.speed is None:
            return ""
        return f"{self.name}_drive.effort" if self.limit is None else f"{self.name}_coupling.friction"
