"""Cam: a point or a roller that follows a smooth curve."""

from __future__ import annotations

from functools import lru_cache
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator

from ..constraints import curve
from ..constraints.blocks import CURVE, Row
from ..errors import ModelError
from ..math.scalar import absolute
from ..math.spline import GRACE, complex_cubic, pack_spline
from ..math.vec import matrix_product
from ..model.element import Flag, Length, Numbers, Point, Unit, element, nonnegative
from ..model.geometry import vector
from ..model.joint import Joint, WorldFrame
from ..model.table import Table

END_TOLERANCE = (
    1e-3  # a motion that stops within this part of the profile's length from an end is taken to have reached the end
)
REMEDY = "give it more points, a Limit that stops the follower, beyond='line', or closed=True"


def _list(value: Any) -> Any:
    if isinstance(value, str):
        return value
    value = value.tolist() if hasattr(value, "tolist") else value
    if not isinstance(value, list | tuple) or not all(isinstance(p, list | tuple) for p in value):
        raise ValueError("give points (x, y)")
    return tuple(map(tuple, value))


Points = Annotated[tuple[Numbers, ...], BeforeValidator(_list), Unit("m")]


@element
class Cam(Joint):
    """A point of ``body_j``, or the centre of a roller on it, follows a smooth curve fixed in ``body_i``.

    The curve is the C2 spline through ``points``, parametrised by their chord length. In space it is the profile of a
    cylinder along ``axis``: one row, which fixes the distance from the profile and leaves the axial direction free. The
    constraint can pull as well as push; if a follower without a groove pulls, ``health.warnings`` of a motion reports
    it. A point (no ``radius``) on a profile that is not closed is treated as a pin in a slot, guided on both sides.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        The cam and the follower; bodies, or frames fixed on bodies (the curve then lies in the x-y plane of the first).
    points : list of points [m]
        Points of the profile in the drawn configuration, two components each: in the plane world coordinates from
        ``centre``, in space along the axes of a frame there whose z is ``axis``. At least four; the first is not
        repeated at the end of a closed curve.
    at : point [m]
        The follower's point, or its roller's centre, in world coordinates of the drawn configuration.
    centre : point [m]
        Origin of the profile's coordinates, in world coordinates; the world's origin if not given.
    axis : direction
        In space: normal of the profile's plane, in world coordinates.
    closed : bool
        Whether the profile closes on itself.
    beyond : ``"refuse"`` or ``"line"``
        Extension of a profile that is not closed: none, and a motion that gets there stops; or a straight line with the
        slope of the end.
    radius : number [m]
        Radius of the follower's roller.
    groove : bool
        Whether the follower runs in a groove, which guides it on both sides.
    """

    points: Points
    centre: Point = (0.0, 0.0, 0.0)
    closed: Flag = True
    beyond: Literal["refuse", "line"] = "refuse"
    radius: Length = 0.0
    groove: Flag = False

    blocks: ClassVar = (CURVE,)
    local: ClassVar[tuple[str, ...]] = ("points",)
    needs_axis: ClassVar[bool] = True
    symbol: ClassVar[str] = "cam"
    one_sided: ClassVar[bool] = True
    both_sides: ClassVar[str] = ", or give groove=True if the follower is guided on both sides"

    def check(self, n: SimpleNamespace) -> None:
        """Require enough points, each with two coordinates, no two consecutive ones equal."""
        nonnegative(self, n, "radius")
        if self.closed and self.beyond != "refuse":
            raise ModelError(
                f"{self.title}: beyond= has no effect on a closed profile; leave it out, or give closed=False"
            )
        if len(n.points) < 4 or not all(len(p) == 2 for p in n.points):
            raise ModelError(f"{self.title}: a profile needs four points or more, each (x, y), got {len(n.points)}")
        for k, d in enumerate(np.sqrt((np.diff(closed_polygon(n.points, self.closed), axis=0) ** 2).sum(axis=1))):
            if not d.real > 0.0:
                raise ModelError(
                    f"{self.title}: points {k} and {(k + 1) % len(n.points)} of its profile coincide at "
                    f"{tuple(n.points[k])}; leave one out"
                )

    def world_frames(self, n: SimpleNamespace, planar: bool) -> tuple[WorldFrame, WorldFrame]:
        """Return F at the profile's origin, M at the follower's point."""
        R = self.orientation(n.axis, planar)
        centre = vector(n.centre[: 2 if planar and not n.centre[2:] else 3], planar, f"centre of {self.title}")
        return (centre, R), (vector(n.at, planar, f"'at' of {self.title}"), R)

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """The roller's side of the curve, the end parameters and the radius; the engine adds the splines' positions."""
        at, side, gap = self.nearest(n, F, M)
        first, last = self.extent(n)
        if last.real > first.real and self.ended(at.real, first.real, last.real):
            raise ModelError(
                f"{self.title}: in the reference configuration its follower is beyond an end of the profile, which "
                f"extends from {point_text(n.points[0])} to {point_text(n.points[-1])}; {REMEDY}"
            )
        bend = max(0.0, -self.sharpest(n, side)) * n.radius.real
        if bend >= 1.0:
            raise ModelError(
                f"{self.title}: its roller of {n.radius:g} m does not fit into the profile, which bends with a radius "
                f"of {n.radius / bend:.4g} m; take a smaller roller or a smoother profile"
            )
        return (0.0, 0.0, 0.0, side, first, last, n.radius)

    def pushing_sign(self, n: SimpleNamespace, F: WorldFrame, M: WorldFrame) -> float | None:
        """The sign of a force from the profile towards the roller; it is unknown for a point on a closed profile."""
        if self.groove or (n.radius.real == 0.0 and not self.closed):
            return None
        return 1.0 if n.radius.real > 0.0 else 0.0

    def extent(self, n: SimpleNamespace) -> tuple[Any, Any]:
        """Return the parameters at the ends of the profile; (0, 0) if it continues beyond its points."""
        return (0.0, 0.0) if self.closed or self.beyond == "line" else (0.0, chord_lengths(n.points, False)[-1])

    @staticmethod
    def ended(at: float, first: float, last: float, near: float = GRACE) -> bool:
        """Return whether a parameter is beyond the ends, or nearer to them than ``-near`` times their distance."""
        return max(first - at, at - last) > near * (last - first)

    def end_message(self, n: SimpleNamespace, at: float) -> str:
        """The message for a follower that has reached an end of the profile near this parameter; otherwise nothing."""
        first, last = (x.real for x in self.extent(n))
        if not last > first or not self.ended(at, first, last, -END_TOLERANCE):
            return ""
        k = 0 if at < 0.5 * (first + last) else -1
        return (
            f"the follower of {self.title} is at an end of the profile, point {k % len(n.points)} at "
            f"{point_text(n.points[k])}, and there is none beyond; {REMEDY}"
        )

    def nearest(self, n: SimpleNamespace, F: WorldFrame, M: WorldFrame) -> tuple[Any, float, Any]:
        """Return the parameter of the profile point nearest to M, the side that M is on (+1, -1), and its distance."""
        data = np.concatenate(self.curves(n))
        par = (0.0, 0.0, float(len(self.curves(n)[0])), 1.0, 0.0, 0.0, 0.0, 1.0)
        s = np.linspace(0.0, chord_lengths(n.points, self.closed)[-1].real, 20 * len(n.points) + 1)
        x, _, _, y, _, _ = curve.point(par, s, data)
        p = matrix_product(F[1].T, M[0] - F[0])
        guess = float(s[np.argmin((x - p[0]).real ** 2 + (y - p[1]).real ** 2)])
        zero = np.zeros(3)
        i, j = ((tuple(f[0]), tuple(f[1].ravel()), *(tuple(zero),) * 4) for f in (F, M))
        at = curve.foot(par, i, j, guess, data)
        delta = curve.local(par, i, j, at, data)[2]
        return at, -1.0 if delta.real < 0.0 else 1.0, absolute(delta)

    def sharpest(self, n: SimpleNamespace, side: float) -> float:
        """Return the least curvature [1/m] towards the given side: negative where the profile is concave there."""
        data = np.concatenate(self.curves(n)).real
        par = (0.0, 0.0, float(len(self.curves(n)[0])))
        s = np.linspace(0.0, chord_lengths(n.points, self.closed)[-1].real, 20 * len(n.points) + 1)
        _, x1, x2, _, y1, y2 = curve.point(par, s, data)
        return float((side * (x1 * y2 - y1 * x2) / (x1 * x1 + y1 * y1) ** 1.5).min())

    def curves(self, n: SimpleNamespace) -> tuple[list[float], ...]:
        """Return the splines x(s) and y(s)."""
        if any(hasattr(x, "called") and not x.known for p in n.points for x in p):
            raise ModelError(
                f"{self.title}: points of its profile follow parameters, and a curve through symbols is not written "
                f"out; give these parameters as numbers"
            )
        return profile_splines(n.points, self.closed)


def point_text(point: tuple) -> str:
    """Return a point with its unit, for messages."""
    return f"({', '.join(f'{x.real:g}' for x in point)}) m"


def closed_polygon(points: tuple, closed: bool) -> np.ndarray:
    """Return points as an array; if closed, with the first again at the end."""
    p = np.array(points)
    return np.vstack([p, p[:1]]) if closed else p


def chord_lengths(points: tuple, closed: bool) -> np.ndarray:
    """Return the length along the polygon up to each point."""
    steps = np.sqrt((np.diff(closed_polygon(points, closed), axis=0) ** 2).sum(axis=1))
    return np.r_[0.0, np.cumsum(steps)]


@lru_cache(maxsize=64)
def profile_splines(points: tuple, closed: bool) -> tuple[list[float], list[float]]:
    """Return the splines x(s) and y(s) through points of the plane, s being the chord length."""
    s = tuple(chord_lengths(points, closed).tolist())
    beyond: Any = "repeat" if closed else "line"  # the row refuses positions beyond; the search may pass through them
    if np.iscomplexobj(s):
        real = profile_splines(tuple(tuple(x.real for x in p) for p in points), closed)
        at, columns = np.array(s), closed_polygon(points, closed).T
        steps = (pack_spline(at, c, complex_cubic(at, c, closed), beyond).imag for c in columns)
        return tuple((np.array(r) + 1j * d).tolist() for r, d in zip(real, steps, strict=True))  # type: ignore[return-value]
    x, y = (tuple(c) for c in closed_polygon(points, closed).T.tolist())
    return tuple(Table(k, x=s, y=c, beyond=beyond).data() for k, c in (("px", x), ("py", y)))  # type: ignore[return-value]
