"""Bodies and frames."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator

from ..errors import ModelError
from .color import check_color
from .element import (
    Angle,
    AngularVelocity,
    Density,
    Element,
    Flag,
    Law,
    Mass,
    Name,
    Number,
    Point,
    Unit,
    Velocity,
    element,
    plain,
)
from .geometry import orientation_matrix, rotation_about
from .orientation import Orientation
from .shapes import Solid

GROUND = "ground"


def _solids(value: Any) -> Any:
    """Shapes, or plain data of a model file that says their type."""
    if isinstance(value, dict):
        kind = value.get("type")
        known = [k for k, c in Element.registry.items() if issubclass(c, Solid) and c is not Solid]
        if kind not in known:
            problem = "a shape has no type" if kind is None else f"unknown shape type {kind!r}"
            raise ModelError(f"{problem}; there are {', '.join(sorted(known))}")
        return Element.of_type(kind)(**{k: v for k, v in value.items() if k != "type"})
    if isinstance(value, (list, tuple)):
        return tuple(_solids(v) for v in value)
    if value is not None and not isinstance(value, Solid):
        raise ValueError("give a shape such as Sphere(radius=0.1), or a list of shapes")
    return value


Inertia = Annotated[
    float | str | tuple[float | str, ...] | tuple[tuple[float | str, ...], ...],
    BeforeValidator(plain),
    Unit("kg*m^2"),
]
Shapes = Annotated[Solid | tuple[Solid, ...] | None, BeforeValidator(_solids)]


def listed(shape: Solid | tuple[Solid, ...] | None) -> tuple[Solid, ...]:
    """Shapes as a tuple, however many were given."""
    if shape is None:
        return ()
    return shape if isinstance(shape, tuple) else (shape,)


@element
class Body(Element):
    """A rigid body.

    Its reference frame is where the user puts it: ``position`` and ``angle`` (planar) or ``orientation`` (spatial)
    in the drawn configuration. Mass properties and everything attached are counted from that frame.

    Give ``mass`` and ``inertia``; then shapes are for looks only. Or give shapes with a ``density`` or a ``mass``, or
    with densities or masses of their own: these say what it weighs, where its centre of mass is, and its inertia. In a
    planar mechanism shapes are solids as in space, and their inertia about z counts. What would have no effect is
    refused.

    Parameters
    ----------
    name : str
    mass : number [kg]
        0, with inertia 0, for a ring or link that only joins others and moves with them, as in a gimbal.
        With shapes and no ``inertia``: shared out among the shapes by volume, or, where all have a density of their
        own, by volume times density.
    inertia : number [kg m^2]
        Planar: one number. Spatial: three principal moments (Ixx, Iyy, Izz) or the inertia tensor as a symmetric 3x3
        matrix, whose diagonal holds the moments, Ixx = sum of m (y^2 + z^2), and which off the diagonal holds *minus*
        the products of inertia, Ixy = -sum of m x y. A program that lists products with the plus sign needs its signs
        turned. 0 for a point mass: if all that acts on it acts at its centre of mass and needs no orientation, it has
        velocities and does not turn; else joints must hold it. 0 for one moment, and the others equal, for an ideal
        thin rod.
    inertia_about : point [m]
        Point of the reference frame that ``inertia`` is about; the centre of mass if not given.
    inertia_axes : orientation
        Axes that a spatial ``inertia`` is given in, relative to the reference frame; its axes if not given.
    com : point [m]
        Centre of mass in the reference frame. If not given: the shapes' where they give the inertia, else its origin.
    position : point [m]
        Origin of the reference frame, in the world.
    angle : number [rad]
        Planar: orientation of the reference frame.
    orientation : quaternion (scalar first), Bryant angles (x-y-z) [rad], rotation object or 3x3 matrix
        Spatial: orientation of the reference frame.
    velocity : vector [m/s]
        Velocity of the reference frame's origin at the start, world axes. It is kept where joints and drivers allow
        it; where they do not, the nearest is taken and said. If not given it is free: it follows from what is given
        elsewhere, and where nothing determines it the kinetic energy of the whole is the least, so that what is told
        nothing rests; told ``angular_velocity`` only, a body on no joint turns about its mass centre.
    angular_velocity : number or vector [rad/s]
        At the start, world axes; the same holds: give 0 if a body on no joint that is told ``velocity`` is not to turn.
    shape : shape or list of shapes
        What the body looks like and, unless ``inertia`` is given, what it weighs (see `Solid`).
    density : number [kg/m^3]
        Of the shapes that have no mass or density of their own.
    as_drawn : bool
        Assembly must not change the pose, nor the velocities given here. It holds nothing during the motion: to weld a
        body to ground add a `Fixed` joint.
    material : str
        `Material` that its shapes touch others with, where they name none of their own.
    color : str
        Colour in pictures: a name of CSS such as ``"steelblue"``, or ``"#rgb"`` or ``"#rrggbb"``.
    """

    mass: Mass | None = None
    inertia: Inertia | None = None
    inertia_about: Point | None = None
    inertia_axes: Orientation | None = None
    com: Point | None = None
    position: Point = (0.0, 0.0, 0.0)
    angle: Angle = 0.0
    orientation: Orientation | None = None
    velocity: Velocity | None = None
    angular_velocity: AngularVelocity | None = None
    shape: Shapes = field(default=None)
    density: Density | None = None
    as_drawn: Flag = False
    material: Name | None = None
    color: str | None = None

    category: ClassVar[str] = "bodies"

    hints: ClassVar[dict[str, str]] = {
        "fixed": "to weld it to ground add a Fixed joint; to keep assembly from moving it, as_drawn=True"
    }

    def check(self, n: SimpleNamespace) -> None:
        """A colour that there is; masses and shapes are looked at by `mass_properties`."""
        if self.color is not None:
            check_color(self.color, self.title)

    def ends(self) -> dict[str, str]:
        """Its reference frame."""
        return {"M": self.name}

    def shapes(self) -> tuple[Solid, ...]:
        """Its shapes, as a tuple."""
        return listed(self.shape)

    def solids(self) -> tuple[Solid, ...]:
        """Its shapes that are seen: all but holes."""
        return tuple(s for s in self.shapes() if not s.hole)

    def rotation(self, n: Any) -> np.ndarray:
        """Rotation matrix of the reference frame in the drawn configuration."""
        if n.orientation is not None:
            return orientation_matrix(n.orientation, f"orientation of {self.title}")
        return rotation_about(2, n.angle)


@element
class Frame(Element):
    """A frame fixed on a body or on ground: joints, forces and sensors may attach to it by name.

    Parameters
    ----------
    name : str
    body : str
        Body that carries it, or ``"ground"``.
    position : point [m]
        Its origin in the body's reference frame.
    angle : number [rad]
        Planar: its orientation in the body's reference frame.
    orientation : quaternion, Bryant angles [rad], rotation object or matrix
        Spatial: its orientation in the body's reference frame.
    """

    body: str = field(kw_only=False)
    position: Point = (0.0, 0.0, 0.0)
    angle: Angle = 0.0
    orientation: Orientation | None = None

    category: ClassVar[str] = "frames"
    rotation = Body.rotation
    ends = Body.ends


@element
class Driver(Element):
    """A coordinate made to follow a function of time (a rheonomic constraint).

    Parameters
    ----------
    name : str
    coordinate : str
        ``"joint.coordinate"`` such as ``"A.angle"``, or a world coordinate of a body's or frame's origin such as
        ``"slider.x"``.
    law : expression
        Its value [rad] or [m], an expression of ``t``, tables, parameters, and sensors of positions and angles; its
        derivatives are found exactly. No Python function, whose derivatives are not known.
    """

    coordinate: str = field(kw_only=False)
    law: Law = field(kw_only=False)

    category: ClassVar[str] = "drivers"
    omission: ClassVar[float] = 0.5  # what it costs to leave it out where rows are too many


@element
class Initial(Element):
    """A coordinate, its rate, or both, that assembly has to meet at the start. One of them must be given.

    Parameters
    ----------
    name : str
        The coordinate: ``"A.angle"`` or ``"slider.x"``.
    value : number [rad] or [m]
    rate : number [rad/s] or [m/s]
    """

    value: Number | None = None
    rate: Number | None = None

    category: ClassVar[str] = "initial"

    def check(self, n: SimpleNamespace) -> None:
        """Something to meet."""
        if self.value is None and self.rate is None:
            raise ModelError(f"{self.title}: it says nothing; give value=..., rate=... or both")
