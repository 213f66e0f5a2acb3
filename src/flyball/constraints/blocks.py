"""Building blocks of joints: named groups of scalar rows (after Hahn, *Rigid Body Dynamics of Mechanisms*, BB1 to BB5).

A joint is a tuple of these. Each row also names the axes that it constrains, so that rows that are always satisfied in
a planar mechanism are omitted, and the row that replaces it during assembly from far away.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

from . import (
    alignment,
    angle,
    coincident,
    curve,
    displacement,
    distance,
    flat_face,
    inclination,
    knife_edge,
    perpendicular,
    relative_spin,
    rolling,
    rotation_component,
    skew_lines,
    space_curve,
    tangent,
)
from .registry import BY_ADDRESS, KINDS, Kind

_UNIT = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_ZERO = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Row:
    """One scalar term: the kind of its formula, its parameters, the constrained axes, its replacement for assembly.

    ``par`` has eight numbers: six for the formula, one that is subtracted from the value, one that multiplies the row
    (1). `Joint.constants` may replace the first seven for the drawn frames.
    """

    kind: int
    par: tuple[float, ...]
    axes: str = ""
    world: bool = False  # axes of the world, not of the joint
    far: Row | None = None
    measure: str = "m"  # unit of its value
    holonomic: bool = True  # whether it has a value; otherwise it constrains velocities only
    plus: tuple[str, ...] = ()  # coordinates of the joint that are added to the row, with coefficients it gives

    parameters: ClassVar[int] = 7  # that its joint may give (`Joint.constants`)

    @property
    def of_kind(self) -> Kind:
        """The kind of the formula, with its properties."""
        return KINDS[self.kind]


@dataclass(frozen=True)
class ConstraintRow(Row):
    """A constraint equation with a user-defined formula: a subclass defines it as a static method.

    ``row(par, F, M)`` returns the value, the force on M at its origin (the reverse acts on F's body at F's origin), the
    torques on the bodies of M and F about the origins of M and F, and the acceleration bias: with v, w, a, alpha the
    velocities and accelerations in the records F and M,

    - force . (v_M - v_F) + torque_M . w_M + torque_F . w_F is the rate of the value,
    - the bias is the rate of that.

    Force and torques are thus the reaction at a Lagrange multiplier of 1.

    Parameters
    ----------
    axes : str
        Axes of the joint frame, such as ``"xy"``, that the equation is about. In a planar mechanism a row whose axes
        include the normal is left out.
    far : Row, optional
        A row in place of this one while the mechanism is assembled from far away.
    measure : str
        Unit of the value, ``"m"`` or ``"rad"``.
    holonomic : bool
        Whether the row has a value. If not, only the velocities are constrained; the formula returns a value of 0.
    """

    kind: int = field(default=BY_ADDRESS, init=False)
    par: tuple[float, ...] = field(default=(0.0,) * 7 + (1.0,), init=False)

    parameters: ClassVar[int] = 6
    points: ClassVar[str] = ""
    """``"F"``, ``"M"`` or ``"FM"``: frames of which the formula reads the origin's motion only, with no torque there.
    Such a frame may be on a point mass."""
    row: ClassVar[Callable[..., Any]]

    @property
    def of_kind(self) -> Kind:
        """Its kind, with a formula called like those of the built-in rows: parameter 6 is subtracted from the value."""

        def row(par: Any, F: Any, M: Any, hint: Any, data: Any) -> Any:
            value, *wrench = type(self).row(par[:6], F, M)
            return value - par[6], *wrench

        return Kind(self.kind, row, points=self.points)


def _row(kind: int, a: str, b: str = "", **more) -> Row:
    par = (*_UNIT[a], *(_UNIT[b] if b else _ZERO), 0.0, 1.0)
    return Row(kind, par, a + b, **more)


def _third(a: str, b: str) -> str:
    return next(c for c in "xyz" if c not in a + b)


def _perpendicular(m: str, f: str, far_kind: int | None = None) -> Row:
    """Return a row that keeps axis m of M perpendicular to axis f of F."""
    par = (*_UNIT[f], *_UNIT[m], 0.0, 1.0)
    far = None if far_kind is None else _row(far_kind, _third(m, f), measure="rad")
    return Row(perpendicular.KIND, par, m + f, far=far, measure="rad")


COMMON_POINT = tuple(_row(coincident.KIND, a, world=True) for a in "xyz")
"""BB1: the origins of F and M coincide."""

PARALLEL_AXES = (
    _perpendicular("z", "x", alignment.KIND_AXIS),
    _perpendicular("z", "y", alignment.KIND_AXIS),
)
"""BB2: the z axes of F and M are parallel, and point the same way."""

STRAIGHT_LINE = (_row(displacement.KIND, "x"), _row(displacement.KIND, "y"))
"""BB3: the origin of M stays on the z axis of F."""

SAME_AXES = (
    _perpendicular("z", "x", alignment.KIND_FULL),
    _perpendicular("z", "y", alignment.KIND_FULL),
    _perpendicular("x", "y", alignment.KIND_FULL),
)
"""BB2 + BB4: the axes of F and M are parallel, all three."""

CROSSED_AXES = (_perpendicular("z", "z"),)
"""BB4: the z axes of F and M are at right angles."""

CONSTANT_DISTANCE = (Row(distance.KIND, (0.0,) * 7 + (1.0,)),)
"""BB5: the origins of F and M have a constant distance (the length is parameter 6)."""

ANGLE = Row(angle.KIND, (0.0,) * 7 + (1.0,), measure="rad")
"""Coordinate: angle of M's x axis about F's z axis."""

PITCH = _row(inclination.KIND_PITCH, "z", "x", measure="rad")
"""Coordinate: angle of M's x axis below F's x-y plane."""

DEFLECTION = _row(inclination.KIND_ANGLE, "z", "z", measure="rad")
"""Coordinate: angle between the z axes of F and M."""


def rotation_along(axis: str) -> Row:
    """Coordinate: component along an axis of F of the rotation vector from F to M."""
    return _row(rotation_component.KIND, axis, measure="rad")


SLIDE = _row(displacement.KIND, "z")
"""Coordinate: displacement of M along F's z axis."""


def point_coordinate(axis: str) -> Row:
    """Coordinate: world component of the vector from F to M."""
    return _row(coincident.KIND, axis, world=True)


SKEW_LINES = (
    *CROSSED_AXES,
    *(Row(skew_lines.KIND, (*_UNIT[a], 0.0, 0.0, 0.0, 0.0, 1.0), a, world=True) for a in "xyz"),
)
"""The z axes of F and M keep their relative position; each body may slide and turn along its axis."""

IN_PLANE = _row(displacement.KIND, "z")
"""The origin of M stays in F's x-y plane (or at a height above it)."""

CURVE = Row(curve.KIND, (0.0,) * 7 + (1.0,), "xy")
"""The origin of M stays at a constant distance from a curve in F's x-y plane."""


FLAT_FACE = Row(flat_face.KIND, (0.0,) * 7 + (1.0,), "xy")
"""The plane through M's origin across M's x axis touches a convex profile in F's x-y plane."""

ACROSS_CURVE = tuple(
    Row(space_curve.KIND, (which, *(0.0,) * 6, 1.0), axes) for which, axes in ((1.0, "xy"), (2.0, "z"))
)
"""The origin of M stays on a curve in F."""

ALONG_CURVE = Row(space_curve.KIND, (0.0,) * 7 + (1.0,))
"""Coordinate: position of M's origin along a curve in F, its arc length."""


def shift(axis: str) -> Row:
    """Coordinate: displacement of M along an axis of F."""
    return _row(displacement.KIND, axis)


def no_slip(axis: str) -> Row:
    """The wheel M does not slip on F's x-y plane along an axis of F (radii: parameters 3 and 4)."""
    return Row(rolling.KIND, (*_UNIT[axis], 0.0, 0.0, 0.0, 0.0, 1.0), axis, holonomic=False)


ON_PLANE = Row(rolling.KIND, (*_UNIT["z"], 0.0, 0.0, 1.0, 0.0, 1.0), "z")
"""The wheel M touches F's x-y plane."""


def no_sideways(axis: str) -> Row:
    """The origin of M has no velocity, seen from F, along an axis of M."""
    return Row(knife_edge.KIND, (*_UNIT[axis], 0.0, 0.0, 0.0, 0.0, 1.0), axis, holonomic=False)


def turning(axis: str) -> Row:
    """Measured: angular velocity of M relative to F about an axis of M."""
    return Row(relative_spin.KIND, (*_UNIT[axis], 0.0, 0.0, 0.0, 0.0, 1.0), axis, measure="rad", holonomic=False)


DISTANCE = Row(distance.KIND, (0.0,) * 7 + (1.0,))
"""Measured: distance of the origins of F and M."""

TANGENT = Row(tangent.KIND, (0.0,) * 7 + (1.0,))
"""Measured: length of the tangent of two circles, with the change of the arcs on them; see `tangent`."""
