"""Bodies and frames."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator

from .element import (
    Angle,
    AngularVelocity,
    Density,
    Element,
    Law,
    Mass,
    Number,
    Point,
    Unit,
    Velocity,
    _plain,
    element,
)
from .geometry import matrix_to_quaternion, orientation_matrix, rotation_about
from .shapes import Solid

GROUND = "ground"


def _orientation(value: Any) -> Any:
    """A rotation object (with ``as_quat`` or ``as_matrix``) becomes a quaternion, scalar first."""
    if hasattr(value, "as_matrix"):
        value = matrix_to_quaternion(np.asarray(value.as_matrix()))
    value = _plain(value)
    if not isinstance(value, (tuple, list)):
        raise ValueError("give a quaternion (4, scalar first), Bryant angles (3) or a 3x3 rotation matrix")
    if len(value) == 3 and all(isinstance(row, (tuple, list)) and len(row) == 3 for row in value):
        value = matrix_to_quaternion(orientation_matrix(value, "orientation")).tolist()
    return tuple(value)


def _solids(value: Any) -> Any:
    """Shapes, or plain data of a model file that says their type."""
    if isinstance(value, dict):
        from ..errors import ModelError

        kind = value.get("type")
        cls = Element.registry.get(str(kind))
        if cls is None or not issubclass(cls, Solid):
            known = sorted(k for k, v in Element.registry.items() if issubclass(v, Solid) and v is not Solid)
            raise ModelError(f"unknown shape type {kind!r}; there are {', '.join(known)}")
        return cls(**{k: v for k, v in value.items() if k != "type"})
    if isinstance(value, (list, tuple)):
        return tuple(_solids(v) for v in value)
    return value


Orientation = Annotated[tuple[float | str, ...], BeforeValidator(_orientation), Unit("rad")]
Inertia = Annotated[
    float | str | tuple[float | str, ...] | tuple[tuple[float | str, ...], ...],
    BeforeValidator(_plain),
    Unit("kg*m^2"),
]
Shapes = Annotated[Solid | tuple[Solid, ...] | None, BeforeValidator(_solids)]


@element
class Body(Element):
    """A rigid body.

    Its reference frame is where the user puts it: ``position`` and ``angle`` (planar) or ``orientation`` (spatial)
    in the drawn configuration. Mass properties and everything attached are counted from that frame.

    Parameters
    ----------
    name : str
    mass : number [kg]
    inertia : number [kg m^2]
        Planar: one number. Spatial: three principal moments or a 3x3 matrix. 0 for a point mass.
    inertia_about : point [m]
        Point of the reference frame that ``inertia`` is about; the centre of mass if not given.
    inertia_axes : orientation
        Axes that a spatial ``inertia`` is given in, relative to the reference frame.
    com : point [m]
        Centre of mass in the reference frame. If not given: the shapes' where they give the inertia, else its origin.
    position : point [m]
        Origin of the reference frame, in the world.
    angle : number [rad]
        Planar: orientation of the reference frame.
    orientation : quaternion (scalar first), Bryant angles (x-y-z) [rad], rotation object or 3x3 matrix
        Spatial: orientation of the reference frame.
    velocity : vector [m/s]
        Velocity of the reference frame's origin at the start, world axes. A guess: assembly makes it consistent.
    angular_velocity : number or vector [rad/s]
        At the start, world axes.
    shape : shape or list of shapes
        What the body looks like; with ``density`` or ``mass`` also what it weighs.
    density : number [kg/m^3]
    fixed : bool
        Assembly must not change the pose and velocities given here.
    color : str
        Colour in pictures, as in CSS.
    """

    mass: Mass | None = None
    inertia: Inertia | None = None
    inertia_about: Point | None = None
    inertia_axes: Orientation = (1.0, 0.0, 0.0, 0.0)
    com: Point | None = None
    position: Point = (0.0, 0.0, 0.0)
    angle: Angle = 0.0
    orientation: Orientation | None = None
    velocity: Velocity = (0.0, 0.0, 0.0)
    angular_velocity: AngularVelocity | None = None
    shape: Shapes = field(default=None)
    density: Density | None = None
    fixed: bool = False
    color: str | None = None

    category: ClassVar[str] = "bodies"

    def ends(self) -> dict[str, str]:
        """Its reference frame."""
        return {"M": self.name}

    def solids(self) -> tuple[Solid, ...]:
        """Its shapes, as a tuple."""
        if self.shape is None:
            return ()
        return self.shape if isinstance(self.shape, tuple) else (self.shape,)

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


@element
class Initial(Element):
    """A coordinate, its rate, or both, that assembly has to meet at the start.

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
