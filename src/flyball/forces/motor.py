"""Motor and actuator: a torque or force by a law, or a speed by a law up to a largest torque or force."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from ..errors import ModelError
from ..model.body import RATE, Body, Driver
from ..model.element import Coordinates, Element, Law, LawOf, Numbers, Unit, element
from ..model.force import CoordinateForce, JointForce, WeightedSumForce
from .clutch import Clutch
from .coordinate_spring import KIND, effort

if TYPE_CHECKING:
    from ..model.model import Model

LITTLE = 1e-6  # kg, kg m^2: inertia of bodies whose motion is prescribed


@element
class DriveCoupling(Clutch):
    """The clutch of a drive of given speed, whose capacity is the drive's limit."""

    drive: str = ""  # title of the drive, for messages

    in_files: ClassVar[bool] = False
    words: ClassVar[dict[str, str]] = {"capacity": "limit"}
    fails: ClassVar[str] = "Its limit is negative there; a law such as 'max(0, ...)' never is"

    @property
    def title(self) -> str:  # type: ignore[override]
        """Return kind and name of the drive, for messages."""
        return self.drive


class Drive:
    """Base class of elements that act along a coordinate by the law of a force, or of a speed up to a largest force."""

    name: str
    title: str
    speed: Law | None
    limit: Law | None

    kind: ClassVar[int] = KIND
    effort: ClassVar = staticmethod(effort)
    effort_field: ClassVar[str]
    shows_parts: ClassVar[bool] = False

    def check_one_law(self) -> None:
        """Require the law of a force or of a speed, and a limit of the latter only."""
        what = self.effort_field
        if (self.acts()) == (self.speed is not None):
            given = f"{what} and speed are both given" if self.acts() else f"neither {what} nor speed is given"
            raise ModelError(f"{self.title}: {given}; give one of them. A speed up to a {what} is speed= and limit=")
        if self.acts() and self.limit is not None:
            raise ModelError(
                f"{self.title}: limit is for a given speed; write it into the law of {what}: max(-5, min(5, ...))"
            )

    def acts(self) -> bool:
        """Return whether it acts by its own law; otherwise by its parts."""
        return getattr(self, self.effort_field) is not None

    def laws(self) -> tuple[Law | None, ...]:
        """Return the law of the force."""
        return (getattr(self, self.effort_field),)

    def check_speed(self, model: Model, coordinate: str) -> None:
        """Require laws that its parts accept."""
        turns = model.unit(coordinate, self) == "rad"  # type: ignore[arg-type]
        model.law(self.speed, LawOf("rad/s" if turns else "m/s"), f"speed of {self.title}", driver=True)
        model.law(self.limit, LawOf("N*m" if turns else "N"), f"limit of {self.title}")

    def speed_parts(self, model: Model, coordinate: str) -> tuple[Element, ...]:
        """Return the driver of its speed, with a limit on a shaft or slide of its own behind a clutch."""
        if self.speed is None:
            return ()
        drive, coupling = f"{self.name}_drive", f"{self.name}_coupling"
        if self.limit is None:
            return (Driver(drive, f"{coordinate}{RATE}", self.speed),)
        n = 2 if model.planar else 3
        if model.unit(coordinate, self) == "rad":  # type: ignore[arg-type]
            shaft, guide, moves = f"{self.name}_shaft", f"{self.name}_bearing", "angle"
            joint: Any = Element.of_type("Revolute")  # joints are not known here
            axis: Any = None if model.planar else (0.0, 0.0, 1.0)
        else:
            shaft, guide, moves = f"{self.name}_slide", f"{self.name}_guide", "displacement"
            joint, axis = Element.of_type("Prismatic"), (1.0, *(0.0,) * (n - 1))
        return (
            Body(shaft, mass=LITTLE, inertia=LITTLE if model.planar else (LITTLE,) * 3, position=(0.0,) * n),
            joint(guide, "ground", shaft, at=(0.0,) * n, axis=axis),
            Driver(drive, f"{guide}.{moves}{RATE}", self.speed),
            DriveCoupling(coupling, f"{guide}.{moves}", coordinate, capacity=self.limit, drive=self.title),
        )

    def transmitted(self) -> str:
        """Return the curve of the part that carries its force; empty if it acts itself."""
        if self.speed is None:
            return ""
        return f"{self.name}_drive.effort" if self.limit is None else f"{self.name}_coupling.friction"


@element
class Motor(Drive, JointForce):
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

    odd: ClassVar[tuple[str, ...]] = ("torque", "speed")
    effort_field: ClassVar[str] = "torque"
    outputs: ClassVar[dict[str, str]] = {"angle": "rad", "rate": "rad/s", "torque": "N*m"}

    def check(self, n: SimpleNamespace) -> None:
        """Require a torque or a speed, and a limit of the latter only."""
        self.check_one_law()

    def examine(self, model: Model) -> None:
        """Require the joint's angle, and laws that its parts accept."""
        super().examine(model)
        self.check_speed(model, self.coordinate_text())

    def parts(self, model: Model) -> tuple[Element, ...]:
        """Return the parts that give it its speed."""
        return self.speed_parts(model, self.coordinate_text())


@element
class Actuator(WeightedSumForce, Drive, CoordinateForce):
    """A force or torque along a coordinate by a law, or a speed up to a largest force: a cylinder, a linear motor.

    An actuator of given speed is a `Motor` of given speed along any coordinate; along a displacement its parts are
    a slide ``NAME_slide`` in ``NAME_guide`` in place of the shaft.

    Parameters
    ----------
    name : str
    coordinate : str or list of str
        ``"joint.coordinate"``, or a world coordinate of a body's or frame's origin.
        With ``weights`` a list: the element acts along their sum.
    weights : list of numbers
        One for each of several coordinates; the first without unit, so that the sum has the first coordinate's unit.
    force : law [N] or [N m]
        An expression of ``t``, ``value``, ``rate``, sensors and parameters: ``"kp*(0.2 - value) - kd*rate"``.
    speed : law [m/s] or [rad/s]
        Along one coordinate: an expression of ``t``, parameters, tables, and sensors of positions and angles.
    limit : law [N] or [N m]
        Of a given speed: the largest force in either direction, an expression of ``t``, parameters and sensors, rates
        too; never negative. Without it the speed is kept whatever force it needs.
    """

    coordinate: Coordinates = field(kw_only=False)
    force: Annotated[Law | None, LawOf(None, ("value", "rate"))] = None
    speed: Law | None = None
    limit: Law | None = None
    weights: Annotated[Numbers | None, Unit(None)] = None

    effort_field: ClassVar[str] = "force"
    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "force": "effort"}

    def check(self, n: SimpleNamespace) -> None:
        """Require weights for a sum of coordinates, and one law."""
        self.check_weights_given(n)
        self.check_one_law()

    def examine(self, model: Model) -> None:
        """Require laws that its parts accept."""
        super().examine(model)
        if self.speed is None:
            return
        if not self.coordinate_text():
            raise ModelError(f"{self.title}: speed is that of one coordinate; give force= along a sum of several")
        self.check_speed(model, self.coordinate_text())

    def parts(self, model: Model) -> tuple[Element, ...]:
        """Return the parts that give it its speed."""
        return self.speed_parts(model, self.coordinate_text())

    def reversed_factors(self, signs: tuple[float, ...]) -> dict[str, Any]:
        """Return the factors of its speed, or of its weights."""
        return super().reversed_factors(signs) if self.speed is None else {"speed": signs[0]}
