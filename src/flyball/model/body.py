"""Bodies, frames, ground shapes, drivers and initial conditions; many equal bodies as arrays."""

from __future__ import annotations

import difflib
import os
import re
from dataclasses import field, fields
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator

from ..constraints.blocks import ANGLE, point_coordinate
from ..errors import ModelError
from ..math.vec import quaternion_matrix
from ..rotations.arrays import unit_quaternions
from .element import (
    LARGEST_NUMBER,
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
    python_data,
)
from .geometry import Orientation, orientation_matrix, rotation_about
from .inertia import MassProperties, mass_properties
from .joint import ORIENTATION_ANGLES, Coordinate
from .linked_files import current_folder
from .shapes import Solid

_NAMES = """
    aliceblue antiquewhite aqua aquamarine azure beige bisque black blanchedalmond blue blueviolet brown burlywood
    cadetblue chartreuse chocolate coral cornflowerblue cornsilk crimson cyan darkblue darkcyan darkgoldenrod
    darkgray darkgreen darkgrey darkkhaki darkmagenta darkolivegreen darkorange darkorchid darkred darksalmon
    darkseagreen darkslateblue darkslategray darkslategrey darkturquoise darkviolet deeppink deepskyblue dimgray
    dimgrey dodgerblue firebrick floralwhite forestgreen fuchsia gainsboro ghostwhite gold goldenrod gray green
    greenyellow grey honeydew hotpink indianred indigo ivory khaki lavender lavenderblush lawngreen lemonchiffon
    lightblue lightcoral lightcyan lightgoldenrodyellow lightgray lightgreen lightgrey lightpink lightsalmon
    lightseagreen lightskyblue lightslategray lightslategrey lightsteelblue lightyellow lime limegreen linen magenta
    maroon mediumaquamarine mediumblue mediumorchid mediumpurple mediumseagreen mediumslateblue mediumspringgreen
    mediumturquoise mediumvioletred midnightblue mintcream mistyrose moccasin navajowhite navy oldlace olive
    olivedrab orange orangered orchid palegoldenrod palegreen paleturquoise palevioletred papayawhip peachpuff peru
    pink plum powderblue purple rebeccapurple red rosybrown royalblue saddlebrown salmon sandybrown seagreen
    seashell sienna silver skyblue slateblue slategray slategrey snow springgreen steelblue tan teal thistle tomato
    turquoise violet wheat white whitesmoke yellow yellowgreen
"""
NAMES = frozenset(_NAMES.split())
"""The named colours of CSS Color Module Level 4, section 6.1 (W3C)."""
_HEX = re.compile(r"#(?:[0-9a-fA-F]{3}|[0-9a-fA-F]{6})")


def check_color(text: str, who: str) -> None:
    """Refuse a string that is neither a colour name nor #rgb or #rrggbb."""
    if _HEX.fullmatch(text) or text.lower() in NAMES:
        return
    close = difflib.get_close_matches(text.lower(), sorted(NAMES), 1)
    hint = f" (did you mean {close[0]!r}?)" if close else ""
    raise ModelError(
        f"{who}: color {text!r} is no colour{hint}; write a name of CSS such as 'steelblue', or #rgb or #rrggbb"
    )


GROUND = "ground"


def _solids(value: Any) -> Any:
    """Convert plain data of a model file with a type to shapes."""
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
    BeforeValidator(python_data),
    Unit("kg*m^2"),
]
Shapes = Annotated[Solid | tuple[Solid, ...] | None, BeforeValidator(_solids)]


def shape_tuple(shape: Solid | tuple[Solid, ...] | None) -> tuple[Solid, ...]:
    """Return one or several shapes as a tuple."""
    if shape is None:
        return ()
    return shape if isinstance(shape, tuple) else (shape,)


class Located(Element):
    """What has a reference frame that may move: its coordinates are measured from the world's frame."""

    coordinates: ClassVar[dict[str, Coordinate]] = {
        **{a: Coordinate(point_coordinate(a)) for a in "xyz"},
        "angle": Coordinate(ANGLE),
        **ORIENTATION_ANGLES,
    }

    def ends(self) -> dict[str, str]:
        """Return the reference frame."""
        return {"M": self.name}

    def measured(self, planar: bool) -> dict[str, Coordinate]:
        """Return its coordinates: in the plane x, y, angle; in space x, y, z, roll, pitch, yaw."""
        names = ("x", "y", "angle") if planar else ("x", "y", "z", *ORIENTATION_ANGLES)
        return {k: self.coordinates[k] for k in names}


@element
class Body(Located):
    """A rigid body.

    Its reference frame is given by ``position`` and ``angle`` (planar) or ``orientation`` (spatial) in the drawn
    configuration. Mass properties and attached points are given relative to that frame.

    Give either ``mass`` and ``inertia``; shapes are then for display only. Or give shapes with a ``density`` or a
    ``mass``, or with densities or masses of their own: mass, centre of mass and inertia are then computed from these.
    In a planar mechanism shapes are solids as in space, and their inertia about z is used. Fields without effect are
    refused.

    Parameters
    ----------
    name : str
    mass : number [kg]
        0, with inertia 0, for a massless ring or link that only connects others, as in a gimbal. With shapes and no
        ``inertia``: distributed over the shapes by volume, or by volume times density if all have a density of their
        own.
    inertia : number [kg m^2]
        Planar: one number. Spatial: three principal moments (Ixx, Iyy, Izz) or the inertia tensor as a symmetric 3x3
        matrix, with the moments Ixx = sum of m (y^2 + z^2) on the diagonal and *minus* the products of inertia, Ixy =
        -sum of m x y, off the diagonal. Reverse the signs of products that another program lists with the plus sign. 0
        for a point mass: if everything that acts on it acts at its centre of mass and needs no orientation, it only
        translates; otherwise joints must determine its rotation. 0 for one moment, and the others equal, for an ideal
        thin rod.
    inertia_about : point [m]
        Reference point of ``inertia``, in the reference frame; the centre of mass if not given.
    inertia_axes : orientation
        Axes of a spatial ``inertia``, relative to the reference frame; the frame's axes if not given.
    com : point [m]
        Centre of mass in the reference frame. If not given: that of the shapes if they give the inertia, else the
        origin.
    position : point [m]
        Origin of the reference frame, in the world.
    angle : number [rad]
        Planar: orientation of the reference frame.
    orientation : quaternion (scalar first), Bryant angles (x-y-z) [rad], rotation object or 3x3 matrix
        Spatial: orientation of the reference frame.
    velocity : vector [m/s]
        Initial velocity of the reference frame's origin, world axes. It is used if joints and drivers allow it;
        otherwise the nearest consistent velocity is used and reported. If not given, it is free: it follows from other
        given velocities; what these leave undetermined is chosen for the least total kinetic energy, so that a body
        without given velocities is at rest, and a body without joints and only with ``angular_velocity`` turns about
        its mass centre.
    angular_velocity : number or vector [rad/s]
        Initial angular velocity, world axes; as for ``velocity``. Give 0 if a body without joints but with ``velocity``
        must not turn.
    shape : shape or list of shapes
        Display geometry and, unless ``inertia`` is given, mass distribution (see `Solid`).
    density : number [kg/m^3]
        Density of shapes without mass or density of their own.
    as_drawn : bool
        Assembly must change neither the pose nor the velocities given here. It has no effect during the motion: to fix
        a body to ground add a `Fixed` joint.
    material : str
        `Material` of shapes that do not name their own.
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
    local: ClassVar[tuple[str, ...]] = ("com", "inertia_about", "inertia_axes")

    hints: ClassVar[dict[str, str]] = {
        "fixed": "to weld it to ground add a Fixed joint; to keep assembly from moving it, as_drawn=True"
    }

    def check(self, n: SimpleNamespace) -> None:
        """Refuse an invalid colour; masses and shapes are checked by `mass_properties`."""
        if self.color is not None:
            check_color(self.color, self.title)

    def shapes(self) -> tuple[Solid, ...]:
        """Return its shapes, as a tuple."""
        return shape_tuple(self.shape)

    def solids(self) -> tuple[Solid, ...]:
        """Return its visible shapes: all but holes."""
        return tuple(s for s in self.shapes() if not s.hole)

    def rotation(self, n: Any) -> np.ndarray:
        """Return the rotation matrix of the reference frame in the drawn configuration."""
        if n.orientation is not None:
            return orientation_matrix(n.orientation, f"orientation of {self.title}")
        return rotation_about(2, n.angle)


@element
class Frame(Located):
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


RATE = "_rate"
"""Ending of the name of a coordinate's rate."""


@element
class Driver(Element):
    """A coordinate, or its rate, that follows a prescribed function of time (a rheonomic constraint).

    Drivers of ``x``, ``y``, ``z``, ``roll``, ``pitch``, ``yaw`` of a frame (in the plane ``x``, ``y``, ``angle``)
    prescribe its whole motion. Angles are those of R = R_z(yaw) R_y(pitch) R_x(roll), with whole turns of roll and yaw;
    a motion through a pitch of 90 deg is refused there: describe it from a `Frame` with other axes.

    Its ``effort`` does the power effort times rate on the mechanism: for ``x`` the force along x at the frame's origin;
    for ``yaw``, ``pitch``, ``roll`` driven together the components of their total torque along the world's z axis, the
    axis of pitch (square to that and the frame's x axis), and the frame's x axis. Any of these angles driven alone has
    a torque square to the other two of these axes.

    Parameters
    ----------
    name : str
    coordinate : str
        ``"joint.coordinate"`` such as ``"A.angle"``; or of a body or frame ``x``, ``y``, ``z`` of its origin in the
        world, and ``roll``, ``pitch``, ``yaw`` (in the plane ``angle``) of its axes: ``"slider.x"``. Or the rate of a
        joint's coordinate, ``"A.angle_rate"``: a motor that runs at a speed from any position.
    law : expression
        Its value [rad] or [m], or the rate [rad/s] or [m/s]: an expression of ``t``, tables, parameters, and sensors of
        positions and angles; its derivatives are exact. Python functions are not permitted, since their derivatives
        are unknown.
    """

    coordinate: str = field(kw_only=False)
    law: Law = field(kw_only=False)

    category: ClassVar[str] = "drivers"
    omission: ClassVar[float] = 0.5  # cost of omitting it as a remedy for redundant constraints

    @property
    def of_rate(self) -> bool:
        """Return whether it prescribes a rate: a constraint of velocities only."""
        return self.coordinate.endswith(RATE)

    @property
    def moved(self) -> str:
        """Return the coordinate that it moves."""
        return self.coordinate.removesuffix(RATE)


@element
class Initial(Element):
    """Initial value of a coordinate, its rate, or both, which assembly satisfies. At least one must be given.

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
        """Require a value or a rate."""
        if self.value is None and self.rate is None:
            raise ModelError(f"{self.title}: it has no effect; give value=..., rate=... or both")


@element
class Ground(Element):
    """Fixed shapes: a floor, a wall, a box without a lid.

    Parameters
    ----------
    name : str
        Name of this part of ground, such as ``"floor"``.
    shape : shape or list of shapes
        Display geometry, and contact geometry if a `Contact` applies. Masses of shapes have no effect.
    position : point [m]
        Origin of its frame, in the world.
    angle : number [rad]
        Planar: orientation of its frame.
    orientation : quaternion (scalar first), Bryant angles (x-y-z) [rad], rotation object or 3x3 matrix
        Spatial: orientation of its frame.
    material : str
        `Material` of shapes that do not name their own.
    color : str
        Colour in pictures.
    """

    shape: Shapes = field(kw_only=True)
    position: Point = (0.0, 0.0, 0.0)
    angle: Angle = 0.0
    orientation: Orientation | None = None
    material: Name | None = None
    color: str | None = None

    category: ClassVar[str] = "ground"

    def shapes(self) -> tuple[Solid, ...]:
        """Return its shapes, as a tuple."""
        return shape_tuple(self.shape)

    def rotation(self, n: Any) -> np.ndarray:
        """Return the rotation matrix of its frame."""
        if n.orientation is not None:
            return orientation_matrix(n.orientation, f"orientation of {self.title}")
        return rotation_about(2, n.angle)

    def check(self, n: SimpleNamespace) -> None:
        """Require a shape, and refuse fields that have no effect on ground."""
        if self.color is not None:
            check_color(self.color, self.title)
        if not self.shapes():
            raise ModelError(f"{self.title}: it has no shape; give shape=Plane() or another")
        for s in self.shapes():
            _check_weightless(self, s)


def _check_weightless(e: Ground, s: Solid) -> None:
    for name in ("mass", "density"):
        if getattr(s, name) is not None:
            raise ModelError(f"{e.title}: {s.title} has a {name}, which means nothing on ground; leave it out")
    if s.hole:
        raise ModelError(f"{e.title}: {s.title} is a hole, which takes away mass only; leave it out")


def frame_of(e: Ground, n: SimpleNamespace) -> tuple[np.ndarray, np.ndarray]:
    """Return origin and axes of its frame, in the world."""
    p = np.zeros(3)
    p[: len(n.position)] = np.real(n.position)
    return p, np.real(e.rotation(n))


def _read(path: Path) -> np.ndarray:
    """Read an array from a NumPy file, or from comma-separated text."""
    kind = path.suffix.lower()
    if kind not in (".npy", ".csv"):
        raise ValueError("give an array of numbers, or the path of a file '*.npy' or '*.csv' that contains one")
    try:
        return np.load(path, allow_pickle=False) if kind == ".npy" else np.loadtxt(path, delimiter=",", ndmin=1)
    except OSError as error:
        raise ValueError(f"cannot read {os.fspath(path)!r}: {error.strerror or error}") from None
    except ValueError as error:
        raise ValueError(f"{os.fspath(path)!r} contains no array of numbers: {error}") from None


def _numbers(value: Any) -> Any:
    """Return a read-only copy as an array of numbers."""
    if isinstance(value, (str, os.PathLike)):
        value = _read(current_folder() / value)
    try:
        a = np.array(value)
    except ValueError:
        raise ValueError("give an array of numbers, as long in every row") from None
    if a.dtype.kind not in "iuf":
        raise ValueError("give an array of numbers, in SI units")
    a = np.array(a, float, order="C")
    a.setflags(write=False)
    return a


Array = Annotated[
    Any,
    BeforeValidator(_numbers, json_schema_input_type=float | str | tuple[float, ...] | tuple[tuple[float, ...], ...]),
]
ARRAYS = ("position", "angle", "orientation", "velocity", "angular_velocity", "scale")


@element
class Bodies(Element):
    """Many bodies of one shape, subject to gravity and contact only: grains, balls, bricks.

    Their numbers are arrays in SI units with a row for each body: 100,000 take no longer to describe than one. An array
    can also be given as the path of a file, ``"grains.npy"`` or ``"grains.csv"``, relative to the folder of the model
    file; it is read immediately, and saved models contain the numbers. In messages and results the eighteenth of
    ``"balls"`` is ``"balls[17]"``. Joints, drivers and forces cannot act on them; use a `Body`.

    Parameters
    ----------
    name : str
    shape : shape or list of shapes
        Shape of each body, in its reference frame.
    position : (n, 3) numbers [m]
        Origins of their reference frames, in the world; in a planar mechanism (n, 2) suffices.
    density : number [kg/m^3]
        Of shapes without a mass or density of their own, as for a `Body`.
    mass, inertia : number [kg], [kg m^2]
        Of each body, as for a `Body`.
    angle : n numbers [rad]
        Planar: orientations of the reference frames; 0 if not given. One number applies to all.
    orientation : (n, 4) numbers
        Spatial: quaternions, scalar first; the world's axes if not given. One row applies to all.
    velocity : (n, 3) numbers [m/s]
        At the start, of the reference frames' origins, world axes; 0 if not given. One row applies to all.
    angular_velocity : (n, 3) numbers [rad/s]
        At the start, world axes; in a planar mechanism n numbers. 0 if not given. One row applies to all.
    scale : n numbers [1]
        Size of each relative to ``shape``: lengths scale with it, masses with its cube, inertias with its fifth power.
    material : str
        `Material` of shapes that do not name their own.
    color : str
        Colour in pictures.
    """

    shape: Shapes = field(kw_only=True)
    position: Array = field(kw_only=True, repr=False)
    density: Density | None = None
    mass: Mass | None = None
    inertia: Inertia | None = None
    angle: Array | None = field(default=None, repr=False)
    orientation: Array | None = field(default=None, repr=False)
    velocity: Array | None = field(default=None, repr=False)
    angular_velocity: Array | None = field(default=None, repr=False)
    scale: Array | None = field(default=None, repr=False)
    material: Name | None = None
    color: str | None = None

    category: ClassVar[str] = "bulk"

    def __eq__(self, other: object) -> bool:
        """Return whether every field is equal, to the bit."""
        return isinstance(other, Bodies) and all(
            _same(getattr(self, f.name), getattr(other, f.name)) for f in fields(self)
        )

    def __hash__(self) -> int:
        return hash((self.name, self.shape, self.position.tobytes()))

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        for name in ARRAYS:
            if getattr(self, name) is not None:
                getattr(self, name).setflags(write=False)

    @property
    def count(self) -> int:
        """Return the number of bodies."""
        return len(self.position)

    @cached_property
    def one(self) -> Body:
        """Return one of them as a `Body`, with ``scale`` 1 and at the origin."""
        return Body(
            self.name,
            shape=self.shape,
            density=self.density,
            mass=self.mass,
            inertia=self.inertia,
            material=self.material,
            color=self.color,
        )

    def shapes(self) -> tuple[Solid, ...]:
        """Return its shapes, as a tuple."""
        return shape_tuple(self.shape)

    def check(self, n: SimpleNamespace) -> None:
        """Require arrays with finite numbers for all bodies; whatever depends on the plane is checked later."""
        self.one.check(n)
        if not self.shapes():
            raise ModelError(f"{self.title}: it has no shape; give shape=Sphere(radius=...) or another")
        if self.position.ndim != 2 or not len(self.position):
            raise ModelError(
                f"{self.title}: position has the shape {self.position.shape}; give an array (n, 3), a row for each body"
            )
        for name in ARRAYS:
            a = getattr(self, name)
            if a is not None and not (np.abs(a) <= LARGEST_NUMBER).all():
                k = np.argwhere(~(np.abs(a) <= LARGEST_NUMBER))[0]
                raise ModelError(
                    f"{self.title}: {name}[{', '.join(map(str, k))}] is {a[tuple(k)]:g}; give finite numbers, "
                    f"{LARGEST_NUMBER:g} at most"
                )
        if self.scale is not None and not (self.scale > 0.0).all():
            k = int(np.argmin(self.scale > 0.0))
            raise ModelError(f"{self.title}: scale[{k}] is {self.scale.flat[k]:g}; it must be greater than 0")

    def weight(self, n: SimpleNamespace, env: Any, planar: bool) -> MassProperties:
        """Return the mass properties of one of them with ``scale`` 1.

        Raises
        ------
        ModelError
            If a shape is invalid, or there is no mass or inertia.
        """
        given = {name: getattr(n, name) for name in ("mass", "density", "inertia")}
        given |= dict.fromkeys(("inertia_about", "inertia_axes", "com"))
        found = mass_properties(self.one, SimpleNamespace(**given), env, planar)
        if not found.mass.real > 0.0:
            raise ModelError(f"{self.title}: its mass is 0, and a body in contact needs one")
        return found

    def start(self, planar: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Positions (n, 3), rotations (n, 3, 3), velocities (n, 3) of the origins and angular velocities (n, 3).

        Raises
        ------
        ModelError
            If an array has the wrong shape.
        """
        n = self.count
        p = _rows(self, "position", n, (3, 2) if planar else (3,))
        v = _rows(self, "velocity", n, (3, 2) if planar else (3,))
        if planar:
            if self.orientation is not None:
                raise ModelError(f"{self.title}: in a planar mechanism give angle=, not orientation=")
            if (np.abs(p[:, 2]) + np.abs(v[:, 2])).any():
                raise ModelError(f"{self.title}: the mechanism is planar; z of position and velocity must be 0")
            turn, w = _line(self, "angle", n), np.zeros((n, 3))
            w[:, 2] = _line(self, "angular_velocity", n)
            R = np.zeros((n, 3, 3))
            R[:, 0, 0] = R[:, 1, 1] = np.cos(turn)
            R[:, 1, 0] = np.sin(turn)
            R[:, 0, 1] = -R[:, 1, 0]
            R[:, 2, 2] = 1.0
            return p, R, v, w
        if self.angle is not None:
            raise ModelError(f"{self.title}: in a spatial mechanism give orientation=, not angle=")
        return p, self._turned(n), v, _rows(self, "angular_velocity", n, (3,))

    def _turned(self, n: int) -> np.ndarray:
        if self.orientation is None:
            return np.broadcast_to(np.eye(3), (n, 3, 3))
        e = unit_quaternions(_rows(self, "orientation", n, (4,)), f"orientation of {self.title}")
        return np.stack(quaternion_matrix(*e.T), axis=1).reshape(n, 3, 3)

    def sizes(self) -> np.ndarray:
        """Return the scale (n,) of each body."""
        return np.ones(self.count) if self.scale is None else _line(self, "scale", self.count)


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.shape == b.shape and a.tobytes() == b.tobytes()
    return type(a) is type(b) and bool(a == b)


def _rows(e: Bodies, name: str, n: int, widths: tuple[int, ...]) -> np.ndarray:
    """Return the array (n, 3 or 4) of a field: as given, one row repeated, or zeros."""
    out = np.zeros((n, widths[0]))
    a = getattr(e, name)
    if a is None:
        return out
    if a.shape[-1:] not in {(w,) for w in widths} or a.ndim > 2 or (a.ndim == 2 and len(a) != n):
        wanted = " or ".join(f"({n}, {w})" for w in widths)
        raise ModelError(f"{e.title}: {name} has the shape {a.shape}; it must be {wanted}, a row for each body")
    out[:, : a.shape[-1]] = a
    return out


def _line(e: Bodies, name: str, n: int) -> np.ndarray:
    """Return the array (n,) of a field: as given, one number repeated, or zeros."""
    a = getattr(e, name)
    if a is not None and a.shape not in ((), (n,)):
        raise ModelError(f"{e.title}: {name} has the shape {a.shape}; it must be ({n},), a number for each body")
    return np.zeros(n) if a is None else np.broadcast_to(a, (n,))
