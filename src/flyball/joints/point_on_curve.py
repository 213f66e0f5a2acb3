"""A point that follows a curve in space, given by points or by formulas."""

from __future__ import annotations

from functools import lru_cache
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ..constraints import space_curve
from ..constraints.blocks import ACROSS_CURVE, ALONG_CURVE, Row
from ..errors import ModelError
from ..math.scalar import atan2
from ..math.spline import complex_cubic, pack_spline
from ..math.vec import matrix_product
from ..model.element import Flag, Numbers, Point, element
from ..model.expressions import Expression
from ..model.geometry import vector
from ..model.joint import Coordinate, Joint, WorldFrame
from .cam import END_TOLERANCE, GRACE, Points, closed_polygon, point_text

SEGMENTS = 240  # least number of pieces of the spline
SAMPLES = 960  # points at which formulas are evaluated
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)
REMEDY = "give it more points, a Limit of its position that stops the point before, or closed=True"


@element
class PointOnCurve(Joint):
    """A point of ``body_j`` follows a curve fixed in ``body_i``: a bead on a wire, a car on the rails of a coaster.

    All rotations are free. The curve is the C2 spline through ``points``, or formulas of a parameter u. The coordinate
    ``position`` is the arc length from its first point, counted over the laps of a closed curve. In the plane it has
    one row, in space two. It guides on both sides.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Body that carries the curve (``"ground"`` is the world), and the follower; or frames fixed on bodies: the curve
        is then in the axes of the first, from its origin.
    at : point [m]
        The follower's point, in world coordinates of the drawn configuration; assembly moves it to the curve.
    points : list of points [m]
        Four or more points of the curve in the drawn configuration, along the world's axes from ``centre``. The first
        is not repeated at the end of a closed curve.
    formulas : list of expressions [m]
        In place of points: two components in the plane, three in space, of ``u`` and parameters:
        ``("R*cos(u)", "R*sin(u)", "pitch*u/(2*pi)")``.
    interval : two numbers
        First and last u.
    centre : point [m]
        Origin of the curve's coordinates, in world coordinates; the world's origin if not given.
    closed : bool
        Whether the curve closes on itself. A motion beyond the end of another one stops.

    Notes
    -----
    Formulas are evaluated at 961 points, through which a spline goes; arc lengths are exact at these points. Frames of
    the two rows follow the curve without twist about it (Wang, Jüttler, Zheng and Liu, *Computation of rotation
    minimizing frames*, ACM Trans. Graph. 27, 2008).
    """

    points: Points | None = None
    formulas: tuple[str, ...] | None = None
    interval: Numbers | None = None
    centre: Point = (0.0, 0.0, 0.0)
    closed: Flag = False

    blocks: ClassVar = ACROSS_CURVE
    local: ClassVar[tuple[str, ...]] = ("points", "formulas")
    coordinates: ClassVar = {"position": Coordinate(ALONG_CURVE)}
    symbol: ClassVar[str] = "curve"

    def derive(self, n: SimpleNamespace, env: Any) -> None:
        """Replace formulas by points."""
        if self.formulas is not None and self.interval is not None and len(self.interval) == 2:
            n.interval = tuple(
                x if isinstance(x, float) else Expression.parse(str(x)).evaluate(dict(env)) for x in self.interval
            )
            u: Any = np.linspace(n.interval[0], n.interval[1], SAMPLES + 1)[: SAMPLES + 1 - self.closed]
            parsed = [Expression.parse(text) for text in self.formulas]
            with np.errstate(all="ignore"):
                each = [x.evaluate({**env, "u": u}) + 0.0 * u for x in parsed]
            n.points = tuple(map(tuple, np.column_stack(each).tolist()))

    def check(self, n: SimpleNamespace) -> None:
        """Require points or formulas, finite, no two consecutive points equal."""
        if (self.points is None) == (self.formulas is None):
            raise ModelError(f"{self.title}: give either points=... or formulas=... with interval=...")
        if (self.formulas is None) != (self.interval is None) or (self.interval and len(self.interval) != 2):
            raise ModelError(f"{self.title}: formulas need interval=(first u, last u), and points have none")
        if len(n.points) < 4 or len({len(p) for p in n.points}) != 1 or len(n.points[0]) not in (2, 3):
            raise ModelError(f"{self.title}: a curve needs four points or more, each (x, y) or (x, y, z)")
        p = closed_polygon(n.points, self.closed)
        if not np.isfinite(p).all():
            raise ModelError(f"{self.title}: a formula has no finite value for some u in {self.interval}")
        steps = np.sqrt((np.diff(p, axis=0) ** 2).sum(axis=1))
        if not (steps.real > 0.0).all():
            k = int(np.argmin(steps.real))
            last = self.closed and k == len(n.points) - 1
            raise ModelError(
                f"{self.title}: points {k} and {0 if last else k + 1} of its curve coincide at "
                f"{point_text(n.points[k])}; "
                + ("a closed curve does not repeat its first point" if last else "leave one out")
            )

    def world_frames(self, n: SimpleNamespace, planar: bool) -> tuple[WorldFrame, WorldFrame]:
        """Return F at the origin of the curve's coordinates, M at the follower's point."""
        centre = vector(n.centre[: 2 if planar and not n.centre[2:] else 3], planar, f"centre of {self.title}")
        vector(n.points[0], planar, f"points of {self.title}")
        return (centre, np.eye(3)), (vector(n.at, planar, f"'at' of {self.title}"), np.eye(3))

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """Return which row it is, and the parameters at the ends; the engine adds the splines' positions."""
        first, last = self.extent(n)
        at = self.nearest(n, F, M)[0]
        if last.real > first.real and self.ended(at.real, first.real, last.real):
            raise ModelError(
                f"{self.title}: in the reference configuration its point is beyond an end of the curve, which extends "
                f"from {point_text(n.points[0])} to {point_text(n.points[-1])}; {REMEDY}"
            )
        return (row.par[0], 0.0, 0.0, 0.0, first, last, 0.0)

    def extent(self, n: SimpleNamespace) -> tuple[Any, Any]:
        """Return the positions of the ends; (0, 0) of a closed curve."""
        return (0.0, 0.0) if self.closed else (0.0, space_curve_splines(n.points, False)[0])

    @staticmethod
    def ended(at: float, first: float, last: float, near: float = GRACE) -> bool:
        """Return whether a position is beyond the ends, or nearer to them than ``-near`` times their distance."""
        return max(first - at, at - last) > near * (last - first)

    def end_message(self, n: SimpleNamespace, at: float) -> str:
        """Return the message for a point that has reached an end of the curve near this position; else nothing."""
        first, last = (x.real for x in self.extent(n))
        if not last > first or not self.ended(at, first, last, -END_TOLERANCE):
            return ""
        k = 0 if at < 0.5 * (first + last) else -1
        return (
            f"the point of {self.title} is at an end of the curve, position {last if k else first:.6g} m at "
            f"{point_text(n.points[k])}, and there is none beyond; {REMEDY}"
        )

    def nearest(self, n: SimpleNamespace, F: WorldFrame, M: WorldFrame) -> tuple[Any]:
        """Return the position of the curve point nearest to M."""
        length, splines = space_curve_splines(n.points, self.closed)
        data, width = np.concatenate(splines), len(splines[0])
        par = (0.0, 0.0, float(width), 0.0, 0.0, 0.0, 0.0, 1.0)
        s = np.linspace(0.0, length.real, 2 * SEGMENTS + 1)
        p = matrix_product(F[1].T, M[0] - F[0])
        curve = space_curve.vector(par, 0, s, data)[0]
        guess = float(s[np.argmin(sum((x - y).real ** 2 for x, y in zip(curve, p, strict=True)))])
        zero = np.zeros(3)
        i, j = ((tuple(f[0]), tuple(f[1].ravel()), *(tuple(zero),) * 4) for f in (F, M))
        return (space_curve.foot(par, i, j, guess, data),)

    def outline(self, n: SimpleNamespace) -> np.ndarray:
        """Return points of the curve, (k, 3), for pictures."""
        length, splines = space_curve_splines(n.points, self.closed)
        par = (0.0, 0.0, float(len(splines[0])), 0.0, 0.0, 0.0, 0.0, 1.0)
        s = np.linspace(0.0, float(length.real), SEGMENTS + 1)
        return np.column_stack([x.real for x in space_curve.vector(par, 0, s, np.concatenate(splines))[0]])

    def curves(self, n: SimpleNamespace) -> tuple[list[float], ...]:
        """Return the splines of the curve and of the two directions across it, three components each."""
        if any(hasattr(x, "called") and not x.known for p in n.points for x in p):
            raise ModelError(
                f"{self.title}: its curve follows parameters, and a curve through symbols is not written out; give "
                f"these parameters as numbers"
            )
        return space_curve_splines(n.points, self.closed)[1]


def _pieces(s: np.ndarray, y: np.ndarray, closed: bool) -> np.ndarray:
    """Return the coefficients of the C2 spline through values y at s, also of complex ones."""
    if np.iscomplexobj(s) or np.iscomplexobj(y):
        return complex_cubic(s, y, closed)
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(s, y, bc_type="periodic" if closed else "not-a-knot").c[::-1].T)


@lru_cache(maxsize=64)
def space_curve_splines(points: tuple, closed: bool) -> tuple[Any, tuple[list[float], ...]]:
    """Return the length of a curve, and nine splines over its arc length: itself, and two directions across it."""
    if not np.iscomplexobj(np.array(points)):
        return _fitted(points, closed)
    length, real = space_curve_splines(tuple(tuple(x.real for x in p) for p in points), closed)
    moved, made = _fitted(points, closed)
    splines = tuple((np.array(r) + 1j * np.imag(c)).tolist() for r, c in zip(real, made, strict=True))
    return length + 1j * moved.imag, splines


def _fitted(points: tuple, closed: bool) -> tuple[Any, tuple[list[float], ...]]:
    """Return the same for numbers of one type.

    The spline through the points is divided into shorter pieces, whose lengths are integrated by Gauss' method; another
    spline over the arc length goes through their ends.
    """
    p = closed_polygon(points, closed)
    p = np.column_stack([p, np.zeros(len(p))]) if p.shape[1] == 2 else p
    chords = np.r_[0.0, np.cumsum(np.sqrt((np.diff(p, axis=0) ** 2).sum(axis=1)))]
    parts = max(1, -(-SEGMENTS // (len(p) - 1)))
    given = np.stack([_pieces(chords, c, closed) for c in p.T], axis=-1)  # (n - 1, 4, 3)
    h = np.repeat(np.diff(chords), parts) / parts
    first = h * np.tile(np.arange(parts), len(p) - 1)
    each = np.repeat(given, parts, axis=0)
    x = first[:, None]
    knots = np.vstack([each[:, 0] + x * (each[:, 1] + x * (each[:, 2] + x * each[:, 3])), p[-1:]])
    x = (first[:, None] + h[:, None] * (0.5 + 0.5 * NODES))[..., None]
    speed = np.sqrt(((each[:, None, 1] + x * (2.0 * each[:, None, 2] + 3.0 * x * each[:, None, 3])) ** 2).sum(axis=-1))
    s = np.r_[0.0, np.cumsum(0.5 * h * (speed @ WEIGHTS))]
    tangents = each[:, 1] + first[:, None] * (2.0 * each[:, 2] + 3.0 * first[:, None] * each[:, 3])
    end = tangents[:1] if closed else knots[-1:] - knots[-2:-1]
    across = directions_across(knots, np.vstack([tangents, end]), s, closed)
    if closed:
        knots[-1] = knots[0]
    values = [knots, *across]
    beyond = "repeat" if closed else "line"  # the rows refuse positions beyond; the search may pass through them
    return s[-1], tuple(pack_spline(s, c, _pieces(s, c, closed), beyond).tolist() for v in values for c in v.T)


def directions_across(p: np.ndarray, t: np.ndarray, s: np.ndarray, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors across the tangents t at points p that do not turn about the curve (double reflection).

    On a closed curve the angle by which they miss themselves after a lap is spread over it.
    """
    t = t / np.sqrt((t * t).sum(axis=1, keepdims=True))
    flat = not np.ptp(p[:, 2].real) > 0.0
    start = np.array([0.0, 0.0, 1.0]) if flat else np.eye(3)[int(np.argmin(np.abs(t[0].real)))]
    b = np.zeros_like(p)
    b[0] = start - (start @ t[0]) * t[0]
    b[0] /= np.sqrt(b[0] @ b[0])
    for k in range(len(p) - 1):
        v = p[k + 1] - p[k]
        mirrored, turned = b[k] - 2.0 * (v @ b[k]) / (v @ v) * v, t[k] - 2.0 * (v @ t[k]) / (v @ v) * v
        w = t[k + 1] - turned
        size = w @ w
        b[k + 1] = mirrored - 2.0 * (w @ mirrored) / size * w if size.real > 0.0 else mirrored
    a = np.cross(b, t)
    if closed:
        missed = atan2(b[-1] @ a[0], b[-1] @ b[0])
        angle = (missed * s / s[-1])[:, None]
        a, b = np.cos(angle) * a + np.sin(angle) * b, np.cos(angle) * b - np.sin(angle) * a
        a[-1], b[-1] = a[0], b[0]
    return a, b
