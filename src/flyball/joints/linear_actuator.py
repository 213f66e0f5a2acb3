"""Linear actuator: the distance of two points as a coordinate, free, driven, or with a force."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from ..constraints.blocks import DISTANCE
from ..errors import ModelError
from ..model.body import Body, Driver, Shapes
from ..model.element import Element, Law, LawOf, PointPair, element
from ..model.joint import Coordinate, Joint
from .distance import Distance
from .prismatic import Prismatic
from .revolute import Revolute
from .spherical import Spherical
from .universal import Universal

if TYPE_CHECKING:
    from ..model.model import Model


@element
class LinearActuator(Joint):
    """A hydraulic cylinder, spindle or other linear actuator between a point of one body and a point of another.

    It constrains nothing by itself: its coordinate ``length`` is the distance of the two points. Drivers, limits,
    springs, brakes, sensors, controllers, events and laws use it as any coordinate: ``Limit("stroke", "boom.length",
    lower="0.8 m", upper="1.3 m")`` are the ends of its stroke. With ``length`` or ``speed`` it is driven, with
    ``force`` it pushes; with none of them it measures, or rests on what else acts along its coordinate.

    Without masses the force acts on the two bodies directly. With ``barrel`` and ``rod`` it acts between these two
    bodies, along their slide, and the pins at their ends carry it.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies; ``"ground"`` is the world.
    at : pair of points [m]
        The two ends, in world coordinates of the drawn configuration. Not given: the origins of the frames.
    length : law [m]
        Prescribed length, an expression of ``t``, tables, parameters and sensors of positions, as of a `Driver`.
    force : law [N]
        Force that pushes the ends apart, an expression of ``t``, ``value`` (the length), ``rate``, sensors and
        parameters, as of an `Actuator`.
    speed, limit : law [m/s], law [N]
        Speed at which the ends move apart, and the largest force with which it keeps that speed, as of an `Actuator`.
    barrel, rod : shape or list of shapes
        Shapes with a mass or density, of two bodies between the ends: the barrel on ``body_i``, the rod on ``body_j``.
        The reference frame of either has its origin at its end, and its x axis points to the other end.

    Notes
    -----
    Law and masses are elements of their own, which belong to it: the `Driver` or `Actuator` ``NAME_drive``, whose
    ``effort`` or ``force`` is positive where it pushes; the bodies ``NAME_barrel`` and ``NAME_rod`` with their joints
    ``NAME_foot``, ``NAME_slide`` and ``NAME_head``. The ``displacement`` of the slide is the length.
    """

    at: PointPair | None = None  # type: ignore[assignment]
    length: Annotated[Law | None, LawOf("m")] = None
    force: Annotated[Law | None, LawOf("N", ("value", "rate"))] = None
    speed: Law | None = None
    limit: Law | None = None
    barrel: Shapes = None
    rod: Shapes = None

    coordinates: ClassVar = {"length": Coordinate(DISTANCE)}
    axisless: ClassVar[bool] = True
    symbol: ClassVar[str] = "linear_actuator"

    world_frames = Distance.world_frames

    def check(self, n: SimpleNamespace) -> None:
        """Require one law at most, either both masses or none, and different ends."""
        laws = [k for k in ("length", "force", "speed") if getattr(self, k) is not None]
        if len(laws) > 1:
            raise ModelError(
                f"{self.title}: {laws[0]} and {laws[1]} are both given, and a prescribed motion determines the "
                "force; leave one out"
            )
        if self.limit is not None and self.speed is None:
            raise ModelError(f"{self.title}: limit is the largest force of a given speed; give speed=, or leave it out")
        if (self.barrel is None) != (self.rod is None):
            missing, given = ("barrel", "rod") if self.barrel is None else ("rod", "barrel")
            raise ModelError(f"{self.title}: it has a {given} and no {missing}; give both, or neither")
        if self.barrel is not None and n.at is None:
            raise ModelError(f"{self.title}: its barrel and rod are placed between two points; give at=")
        if n.at is not None and all(x.real == y.real for x, y in zip(*n.at, strict=True)):
            raise ModelError(f"{self.title}: both its ends are at {n.at[0]} m, where it has no direction; move one")

    def degenerate(self, n: SimpleNamespace, distance: float, near: float) -> str:
        """Return a message if both ends coincide."""
        if distance > near:
            return ""
        return (
            f"both ends of {self.title} are at one point, where it has no direction. Give a Limit of "
            f"'{self.name}.length' that stops it before, or guide its ends past each other"
        )

    def parts(self, model: Model) -> tuple[Element, ...]:
        """Return barrel and rod with their joints, and its driver or actuator."""
        masses = () if self.barrel is None else self._telescope(model.planar)
        coordinate, drive = f"{self.name}_slide.displacement" if masses else f"{self.name}.length", f"{self.name}_drive"
        if self.length is not None:
            return (*masses, Driver(drive, coordinate, self.length))
        if self.force is None and self.speed is None:
            return masses
        actuator: Any = Element.of_type("Actuator")  # forces are not known here
        return (*masses, actuator(drive, coordinate, force=self.force, speed=self.speed, limit=self.limit))

    def _telescope(self, planar: bool) -> tuple[Element, ...]:
        """Return barrel, rod, and the joints at the ends and between them."""
        assert self.at is not None
        barrel, rod, foot, slide, head = (f"{self.name}_{x}" for x in ("barrel", "rod", "foot", "slide", "head"))
        there, back = (_pointing(*ends, planar) for ends in (self.at, self.at[::-1]))
        bodies = (
            Body(barrel, position=self.at[0], shape=self.barrel, **there.turned),
            Body(rod, position=self.at[1], shape=self.rod, **back.turned),
        )
        guide = Prismatic(slide, barrel, rod, at=self.at[0], axis=there.direction, displacement=there.length)
        if planar:
            ends: tuple[Element, ...] = (
                Revolute(foot, self.body_i, barrel, at=self.at[0]),
                Revolute(head, rod, self.body_j, at=self.at[1]),
            )
        else:
            ends = (
                Universal(foot, self.body_i, barrel, at=self.at[0], axes=there.across),
                Spherical(head, rod, self.body_j, at=self.at[1]),
            )
        return (*bodies, ends[0], guide, ends[1])


def _pointing(start: tuple[Any, ...], end: tuple[Any, ...], planar: bool) -> SimpleNamespace:
    """Return expressions of a line: distance and direction of its ends; orientation and y and z axes of x along it.

    The orientation is R_y(b) R_z(c), in the plane R_z(c).
    """
    a, b = ([f"({x})" for x in p] for p in (start, end))
    d = [f"({y} - {x})" for x, y in zip(a, b, strict=True)]
    length = f"sqrt({' + '.join(f'{x}**2' for x in d)})"
    direction = tuple(f"{x}/{length}" for x in d)
    if planar:
        return SimpleNamespace(length=length, direction=direction, turned={"angle": f"atan2({d[1]}, {d[0]})"})
    turn, tilt = f"atan2(-{d[2]}, {d[0]})", f"asin({d[1]}/{length})"
    y = (f"-cos({turn})*sin({tilt})", f"cos({tilt})", f"sin({turn})*sin({tilt})")
    z = (f"sin({turn})", "0", f"cos({turn})")
    return SimpleNamespace(length=length, direction=direction, across=(z, y), turned={"orientation": ("0", turn, tilt)})
