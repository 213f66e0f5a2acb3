"""Symbols of joints, couplings, gear wheels, springs and dampers, and the frames where elements attach.

The symbol is selected by the class attribute ``drawn`` of an element. Unknown values give a plain mark. Pitch circles
of gear wheels follow from the distance of their axes; teeth mesh in the reference configuration.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.body import GROUND
from ..model.force import CoordinateForce
from ..model.geometry import matrix_to_quaternion
from ..model.joint import Joint
from ..results.motion_record import unit_effort_wrench
from .recording import RecordedCurve, RecordedJoint, RecordedLine

if TYPE_CHECKING:
    from ..results.result import Result


@dataclass(frozen=True)
class AttachedFrame:
    """A frame on a body: origin [m] and axes (columns) in the body's reference frame, and the body's index."""

    body: str
    p: np.ndarray
    R: np.ndarray
    frame: int

    @property
    def grounded(self) -> bool:
        """Whether it is fixed in the world."""
        return self.body == GROUND


class AttachedFrames:
    """The frames of a result's elements."""

    def __init__(self, result: Result) -> None:
        self.result = result
        self._names = {b: name for name, b in result.values.structure.place.items()}

    def end(self, name: str, role: str) -> AttachedFrame | None:
        """Return the frame F or M of an element; None if it has no such frame."""
        x = self.result.values
        k = x.structure.frame_at.get((name, role, ""))
        if k is None:
            return None
        body = self._names.get(int(x.system.frame_body[k]), GROUND)
        p, R = x.system.frames.position[k].real, x.system.frames.rotation[k].real
        return AttachedFrame(body, p + x.bodies[body].com.real, R.reshape(3, 3), k)

    def ends(self, e: Any) -> tuple[AttachedFrame, AttachedFrame] | None:
        """Return F and M of an element that connects two bodies; None otherwise."""
        a, b = self.end(e.name, "F"), self.end(e.name, "M")
        return None if a is None or b is None else (a, b)

    def track(self, end: AttachedFrame) -> tuple[np.ndarray, np.ndarray]:
        """Return origin (n, 3) and axes (n, 3, 3) of a frame in the world, over time."""
        n = len(self.result.t)
        p, R = self.result.records.frame(end.frame)[:2]
        full = [np.broadcast_to(c, n) for c in (*p, *R)]
        return np.stack(full[:3], axis=1), np.stack(full[3:], axis=1).reshape(-1, 3, 3)

    def relative_origin(self, end: AttachedFrame, other: AttachedFrame) -> np.ndarray:
        """Return the origin of the other frame relative to the first, in its axes, over time (n, 3)."""
        (p, R), (q, _) = self.track(end), self.track(other)
        return np.einsum("nij,ni->nj", R, q - p)

    def reach(self, end: AttachedFrame, other: AttachedFrame) -> tuple[float, float, float, float, float, float]:
        """Return the ranges of the other frame's origin along x, y, z of the first: low x, high x, low y, ..."""
        d = self.relative_origin(end, other)
        d = d[np.isfinite(d).all(axis=1)]
        if not len(d):
            return (0.0,) * 6
        return tuple(float(x) for pair in zip(d.min(axis=0), d.max(axis=0), strict=True) for x in pair)  # type: ignore[return-value]


def float_triple(p: np.ndarray) -> tuple[float, float, float]:
    """Three plain numbers."""
    return tuple(float(c) for c in p)  # type: ignore[return-value]


DEFAULT_TEETH = 18  # of the smaller wheel of a pair, if radii were given, or there are too many teeth to be visible
MAX_TEETH = 120


@dataclass(frozen=True)
class GearWheel:
    """A drawn wheel: its body, radius, number of teeth, and direction of one tooth at the start."""

    body: str
    radius: float
    teeth: int
    tooth: np.ndarray


def gear_pair(e: Any, places: AttachedFrames, wheels_so_far: list[GearWheel]) -> Iterator[RecordedJoint]:
    """Return two wheels with tangent pitch circles; plain discs if the axes are not parallel (bevel gears).

    Wheels in ``wheels_so_far``, drawn for another pair, are unchanged, and the other wheel is fitted to them.
    """
    model = places.result.model
    wheels = _moving_ends(places, model[e.joint_1], model[e.joint_2])
    if wheels is None or not len(places.result.t):
        return
    (p, a), (q, b) = (_initial_frame(places, w) for w in wheels)
    z = np.array(places.result.values.numbers[e.name].teeth, float)
    inside = bool(getattr(e, "internal", False))
    d = q - p
    across = [d - (d @ n) * n for n in (a, b)]
    distance = float(np.sqrt(across[0] @ across[0]))
    if distance <= 1e-9 * places.result.values.length or (inside and z[1] <= z[0]):
        return
    if abs(a @ b) <= 1.0 - 1e-6:
        for wheel, other, arm in zip(wheels, wheels[::-1], across, strict=True):
            yield _gear_symbol(e.name, "gear", wheel, wheel.R, other.body, (float(np.sqrt(arm @ arm)), 0.0, 0.0, 0.0))
        return
    radii = distance * z / (z[1] - z[0] if inside else z.sum())
    towards = across[0] / distance * (-1.0 if inside else 1.0)
    pair = _Mesh(a, b, (towards, towards if inside else -towards), inside)
    counts = _tooth_counts(z)
    known = [
        _find_wheel(wheels_so_far, w.body, float(r), int(n)) for w, r, n in zip(wheels, radii, counts, strict=True)
    ]
    for k, tooth in enumerate(pair.teeth(known, counts)):
        if known[k] is not None:
            continue
        wheels_so_far.append(GearWheel(wheels[k].body, float(radii[k]), int(counts[k]), tooth))
        x = _in_frame(places, wheels[k], tooth)
        size = float(radii[k]), float(counts[k]), float(np.arctan2(x[1], x[0])), float(inside and k == 1)
        yield _gear_symbol(e.name, "gear", wheels[k], wheels[k].R, wheels[1 - k].body, size)


@dataclass(frozen=True)
class _Mesh:
    """The contact of two wheels with parallel axes a and b, seen from the centre of each."""

    a: np.ndarray
    b: np.ndarray
    contacts: tuple[np.ndarray, np.ndarray]
    inside: bool

    def teeth(self, known: Sequence[GearWheel | None], counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the direction of a tooth of each, so that they mesh.

        With f the angle from the contact to a tooth in pitches, and s = +1 or -1 for equal or opposite axes: teeth meet
        gaps where f_1 + s f_2 = 1/2 for wheels that turn against one another, f_1 - s f_2 = 1/2 inside a ring.
        """
        s = (-1.0 if self.inside else 1.0) * np.sign(self.a @ self.b)
        f = [self.offset(k, w.tooth, w.teeth) if w is not None else None for k, w in enumerate(known)]
        one = f[0] if f[0] is not None else 0.5 - s * f[1] if f[1] is not None else 0.0
        other = f[1] if f[1] is not None else s * (0.5 - one)
        return self.turned(0, one / counts[0]), self.turned(1, other / counts[1])

    def offset(self, k: int, tooth: np.ndarray, count: int) -> float:
        """Return the angle from the contact to a tooth, in pitches, about the wheel's axis."""
        return _signed_angle((self.a, self.b)[k], self.contacts[k], tooth) * count / (2.0 * np.pi)

    def turned(self, k: int, turns: float) -> np.ndarray:
        """Return the direction of the contact rotated about the wheel's axis."""
        return _rotated((self.a, self.b)[k], self.contacts[k], 2.0 * np.pi * turns)


def _find_wheel(wheels: Sequence[GearWheel], body: str, radius: float, teeth: int) -> GearWheel | None:
    return next(
        (w for w in wheels if w.body == body and w.teeth == teeth and abs(w.radius - radius) < 1e-3 * radius), None
    )


def _signed_angle(axis: np.ndarray, start: np.ndarray, end: np.ndarray) -> float:
    """Return the angle from one direction to another about an axis perpendicular to both [rad]."""
    return float(np.arctan2(np.cross(start, end) @ axis, start @ end))


def _rotated(axis: np.ndarray, direction: np.ndarray, angle: float) -> np.ndarray:
    return np.cos(angle) * direction + np.sin(angle) * np.cross(axis, direction)


def rack(e: Any, places: AttachedFrames, wheels_so_far: list[GearWheel]) -> Iterator[RecordedJoint]:
    """Return the pinion, and the rack whose pitch line is at the pinion's radius from its centre."""
    model = places.result.model
    movers = _moving_ends(places, model[e.pinion], model[e.rack])
    if movers is None or not len(places.result.t):
        return
    pinion, bar = movers
    radius = float(places.result.values.numbers[e.name].radius)
    (p, n), (_, a) = (_initial_frame(places, w) for w in movers)
    for end, joint in ((pinion, model[e.pinion]), (bar, model[e.rack])):
        if end.body == model.carrier(joint.body_i, joint):  # its coordinate belongs to the other body
            radius = -radius
    # displacement = radius * angle: the rim point moving along +a is at a x n
    side = np.cross(a, n) * np.sign(radius)
    radius = abs(radius)
    same = [w for w in wheels_so_far if w.body == pinion.body and abs(w.radius - radius) < 1e-3 * radius]
    wheel = same[0] if same else GearWheel(pinion.body, radius, DEFAULT_TEETH, side)
    if not same:
        wheels_so_far.append(wheel)
        x = _in_frame(places, pinion, side)
        size = radius, float(DEFAULT_TEETH), float(np.arctan2(x[1], x[0])), 0.0
        yield _gear_symbol(e.name, "gear", pinion, pinion.R, bar.body, size)
    # the rack's frame: origin in a tooth gap at the contact in the reference configuration, x along the slide, y
    # towards the pinion
    q, S = places.track(bar)
    body = S[0] @ bar.R.T
    axes = body.T @ np.column_stack([a, -side, np.cross(a, -side)])
    shift = radius * _signed_angle(n, side, wheel.tooth) * np.cross(n, side)
    at = bar.p + body.T @ (p + radius * side + shift - q[0])
    moved = np.einsum("ni,ni->n", q - places.track(pinion)[0], S[:, :, 2])
    moved = moved - moved[0] + shift @ a
    reach = (float(-np.nanmax(moved)), float(-np.nanmin(moved)), 0.0, 0.0, 0.0, 0.0)
    pitch = 2.0 * np.pi * radius / wheel.teeth
    yield _gear_symbol(
        e.name, "rack", AttachedFrame(bar.body, at, axes, bar.frame), axes, pinion.body, (radius, pitch), reach
    )


def _moving_ends(places: AttachedFrames, first: Any, second: Any) -> tuple[AttachedFrame, AttachedFrame] | None:
    """Return, for two joints on one carrier, the frames off the carrier; else the moving frames."""
    pairs = [places.ends(joint) for joint in (first, second)]
    if pairs[0] is None or pairs[1] is None:
        return None
    common = {end.body for end in pairs[0]} & {end.body for end in pairs[1]}
    out = []
    for pair in pairs:
        assert pair is not None
        free = [end for end in pair if end.body not in common] if len(common) == 1 else []
        out.append(free[0] if free else pair[0] if pair[1].grounded else pair[1])
    return out[0], out[1]


def _initial_frame(places: AttachedFrames, end: AttachedFrame) -> tuple[np.ndarray, np.ndarray]:
    """Return origin and z axis of a frame in the world, at the first time."""
    p, R = places.track(end)
    return p[0], R[0][:, 2]


def _in_frame(places: AttachedFrames, end: AttachedFrame, direction: np.ndarray) -> np.ndarray:
    """Return a world direction in a frame at the first time."""
    return places.track(end)[1][0].T @ direction


def _gear_symbol(
    name: str, kind: str, end: AttachedFrame, R: np.ndarray, mate: str, size: tuple[float, ...], reach: Any = None
) -> RecordedJoint:
    turn = tuple(matrix_to_quaternion(R).tolist())
    return RecordedJoint(name, kind, end.body, float_triple(end.p), float_triple(R[:, 2]), turn, mate, reach, size)


def _tooth_counts(z: np.ndarray) -> np.ndarray:
    """Return the numbers of teeth to draw: as given if whole and visible, else approximately in the same ratio."""
    if (z == z.round()).all() and z.min() >= 6 and z.max() <= MAX_TEETH:
        return z.astype(int)
    return np.clip((z / z.min() * DEFAULT_TEETH).round(), 3, MAX_TEETH).astype(int)


MIN_SPRING_LENGTH = 0.5  # shortest length of a drawn spring, relative to the mechanism's typical length
TRAVEL_PART = 0.3  # and relative to its travel
SPIRAL_RADII = (0.03, 0.13)  # radii of a spiral, relative to the typical length
SPIRAL_TURNS, SPIRAL_POINTS = 2.75, 120


def coordinate_spring_line(
    e: Any, places: AttachedFrames, every: np.ndarray, size: float
) -> RecordedLine | RecordedCurve | None:
    """Return the line of a spring or damper along a coordinate; None if it is neither, or has no position.

    The model does not define its other end; it is placed beyond the range and the rest position of the coordinate.
    """
    numbers = places.result.values.numbers[e.name]
    if not isinstance(e, CoordinateForce) or not hasattr(numbers, "stiffness") or not e.coordinate_text():
        return None
    if numbers.stiffness == 0.0 and numbers.damping == 0.0:
        return None
    owner, what = places.result.model.coordinate(e.coordinate_text(), e)
    base, moving = coordinate_frames_of(e, owner, what, places)
    if base is None or moving is None:
        return None
    if is_rotational(owner, what):
        return _spiral_spring(e, base, np.array(_coordinate_rotation(owner, what)), size)
    return _spring_line(e, numbers, (base, moving, owner, what), places, every, size)


def coordinate_frames_of(
    e: Any, owner: Any, what: str, places: AttachedFrames
) -> tuple[AttachedFrame | None, AttachedFrame | None]:
    """Return the frame whose axes define a coordinate, and the frame that moves."""
    moving = places.end(e.name, "M") or places.end(owner.name, "M")
    if not isinstance(owner, Joint):
        return moving, moving
    return places.end(owner.name, owner.coordinates[what].frames[0]), places.end(owner.name, "M")


def is_rotational(owner: Any, what: str) -> bool:
    """Return whether a coordinate is an angle."""
    return owner.coordinates[what].unit == "rad"


def coordinate_axis(owner: Any, what: str, base: AttachedFrame, places: AttachedFrames) -> np.ndarray:
    """Return the direction of a coordinate, or its axis, in the world over time, (n, 3)."""
    c = owner.coordinates[what]
    if c.singular or (not c.row.axes and not is_rotational(owner, what)):  # torque or force of a unit effort
        wrench = unit_effort_wrench(places.result, owner, what)
        return np.stack(wrench[is_rotational(owner, what)], axis=1)
    k = "xyz".index(what) if what in ("x", "y", "z") else 2
    if not isinstance(owner, Joint):
        return np.tile(np.eye(3)[k], (len(places.result.t), 1))
    return (places.track(base)[1] @ np.array(_coordinate_rotation(owner, what)))[:, :, k]


def _coordinate_rotation(owner: Any, what: str) -> Any:
    """Return the axes of a coordinate relative to those of its frame."""
    c = owner.coordinates[what]
    turn = getattr(c, f"turn_{c.frames[0]}")
    return turn if len(turn) else np.eye(3)


def _spring_line(
    e: Any,
    numbers: Any,
    along: tuple[AttachedFrame, AttachedFrame, Any, str],
    places: AttachedFrames,
    every: np.ndarray,
    size: float,
) -> RecordedLine | None:
    base, moving, owner, what = along
    x = np.asarray(getattr(places.result[e.name], next(iter(e.outputs))))
    if not np.isfinite(x).any():
        return None
    low = min(float(np.nanmin(x)), float(getattr(numbers, "rest", np.inf)))
    held = low - max(MIN_SPRING_LENGTH * size, TRAVEL_PART * float(np.nanmax(x) - low))
    point = places.track(moving)[0]
    foot = point - coordinate_axis(owner, what, base, places) * (x - held)[:, None]
    kind = "spring" if numbers.stiffness != 0.0 else "damper"
    return RecordedLine(e.name, kind, (foot[every], point[every]))


def _spiral_spring(e: Any, base: AttachedFrame, turn: np.ndarray, size: float) -> RecordedCurve:
    """Return a spiral spring fixed on the body against which it turns; it is not drawn deformed."""
    s = np.linspace(0.0, 1.0, SPIRAL_POINTS)
    radius, angle = size * np.interp(s, (0.0, 1.0), SPIRAL_RADII), 2.0 * np.pi * SPIRAL_TURNS * s
    flat = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * s], axis=1)
    return RecordedCurve(e.name, base.body, base.p + flat @ (base.R @ turn).T)


POINTS_PER_VERTEX, MIN_PROFILE_POINTS, MAX_PROFILE_POINTS = (
    8,
    120,
    600,
)  # points of a drawn profile: for each given point, and in total
SymbolPart = RecordedJoint | RecordedCurve | RecordedLine

PINNED = ("revolute", "spherical", "universal", "fixed")  # symbols of one size, whose parts do not move apart
BODY_SYMBOLS = ("gear", "rack", "wheel", "ball")  # symbols of the body itself, if it has no shape of its own


def element_symbols(e: Any, places: AttachedFrames, every: np.ndarray, wheels: list[GearWheel]) -> Iterator[SymbolPart]:
    """Return the symbols of a joint, a coupling or a bushing.

    Parameters
    ----------
    e : Joint, Coupling or Force
    places : Places
    every : ndarray of int
        Indices of the displayed times.
    wheels : list of Wheel
        Gear wheels drawn so far; new ones are added.
    """
    kind = getattr(e, "symbol", "")
    if kind == "gear":
        yield from gear_pair(e, places, wheels)
    elif kind == "rack":
        yield from rack(e, places, wheels)
    ends = places.ends(e)
    if ends is None or kind in ("coupler", ""):
        return
    F, M = ends
    numbers = places.result.values.numbers[e.name]
    if kind == "linear_actuator":
        if e.barrel is None:  # these have shapes
            yield replace(_link_line(e, places, every), kind="damper")
    elif kind == "link":
        yield _link_line(e, places, every)
    elif (
        kind == "universal"
        and np.abs(places.relative_origin(F, M)).max(initial=0.0) > 1e-6 * places.result.values.length
    ):
        yield _link_line(e, places, every)  # a massless link with a hinge at each end
        yield _joint_symbol(e, "revolute", F, M, places)
        yield _joint_symbol(e, "revolute", M, F, places)
    elif kind in ("planar", "point_in_plane"):
        yield _joint_symbol(e, "plane", F, M, places)
        yield _joint_symbol(e, "point", M, F, places)
    elif kind == "point_on_line":
        yield _joint_symbol(e, "rail", F, M, places)
        yield _joint_symbol(e, "point", M, F, places)
    elif kind == "rolling":
        yield _joint_symbol(e, "plane", F, M, places)
        ball = not places.result.planar and not hasattr(numbers, "tread")
        yield _joint_symbol(e, "ball" if ball else "wheel", M, F, places, (wheel_radius(e, places),))
    elif kind == "cam":
        outline = cam_outline(numbers)
        if outline is not None:
            closed = bool(getattr(numbers, "closed", True))
            yield RecordedCurve(e.name, F.body, F.p + outline @ F.R.T, closed)
        radius = float(getattr(numbers, "radius", None) or 0.0)
        yield _joint_symbol(e, "roller" if radius else "point", M, F, places, (radius,))
    elif kind == "curve":
        yield RecordedCurve(e.name, F.body, F.p + e.outline(numbers) @ F.R.T, numbers.closed)
        yield _joint_symbol(e, "point", M, F, places)
    elif kind == "knife_edge":
        yield _joint_symbol(e, "knife_edge", M, F, places)
    else:
        first, second = ends_by_carrier(F, M)
        size = (float(numbers.lead),) if kind == "screw" and hasattr(numbers, "lead") else ()
        yield _joint_symbol(e, kind, first, second, places, size)


def ends_by_carrier(F: AttachedFrame, M: AttachedFrame) -> tuple[AttachedFrame, AttachedFrame]:
    """Return the frame on which a symbol is fixed: ground if the joint is fixed there, else that of the first body."""
    return (M, F) if M.grounded else (F, M)


def wheel_radius(e: Any, places: AttachedFrames) -> float:
    """The radius of a rolling wheel: as given, with its tread; else the distance of its centre from the surface."""
    n = places.result.values.numbers[e.name]
    if hasattr(n, "radius"):
        return float(n.radius) + float(getattr(n, "tread", 0.0))
    ends = places.ends(e)
    assert ends is not None
    return float(np.sqrt((places.relative_origin(*ends)[:1, :2] ** 2).sum()))


def cam_outline(n: Any) -> np.ndarray | None:
    """Points of a cam's profile in its frame, (k, 3): along the C2 spline through the points given, by chord length."""
    if getattr(n, "points", None) is None:
        return None
    from scipy.interpolate import CubicSpline

    p = np.asarray(n.points, float).real[:, :2]
    closed = bool(getattr(n, "closed", True))
    if closed:
        p = np.vstack([p, p[:1]])
    s = np.r_[0.0, np.cumsum(np.sqrt((np.diff(p, axis=0) ** 2).sum(axis=1)))]
    each = max(
        1, min(max(POINTS_PER_VERTEX, MIN_PROFILE_POINTS // (len(p) - 1)), MAX_PROFILE_POINTS // (len(p) - 1))
    )  # the given points are among them
    at = np.interp(np.arange(each * (len(p) - 1) + (not closed)) / each, np.arange(len(p)), s)
    xy = CubicSpline(s, p, bc_type="periodic" if closed else "natural")(at)
    return np.column_stack([xy, np.zeros(len(xy))])


def _joint_symbol(
    e: Any, kind: str, end: AttachedFrame, other: AttachedFrame, places: AttachedFrames, size: tuple[float, ...] = ()
) -> RecordedJoint:
    turn = tuple(matrix_to_quaternion(end.R).tolist())
    reach = None if kind in PINNED else places.reach(end, other)
    return RecordedJoint(
        e.name, kind, end.body, float_triple(end.p), float_triple(end.R[:, 2]), turn, other.body, reach, size
    )


def _link_line(e: Any, places: AttachedFrames, every: np.ndarray) -> RecordedLine:
    ends = places.ends(e)
    assert ends is not None
    return RecordedLine(e.name, "link", tuple(places.track(end)[0][every] for end in ends))
