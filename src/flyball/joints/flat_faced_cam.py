"""Flat-faced cam: a plane face of the follower touches a convex profile."""

from __future__ import annotations

from functools import lru_cache
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ..constraints.blocks import FLAT_FACE, Row
from ..errors import ModelError
from ..math.spline import complex_cubic, pack_spline, spline
from ..math.vec import matrix_product
from ..model.element import Direction, Flag, Point, element
from ..model.geometry import vector
from ..model.joint import Joint, WorldFrame
from .cam import Points, chord_lengths, profile_splines

DIRECTIONS = 360  # directions in which the extent of the profile is computed; a spline goes through these values
PASSES = 12
TURN = 2.0 * np.pi


@element
class FlatFacedCam(Joint):
    """A plane face of ``body_j`` touches a closed convex profile fixed in ``body_i``: a flat-faced tappet or lever.

    The follower may translate or turn. The force acts at the contact point, which moves along the face. In space the
    axes of cam and follower must stay parallel. The constraint can pull as well as push; if it pulls without
    ``conjugate``, contact is lost: ``health.warnings`` of a motion reports it.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        The cam and the follower.
    points : list of points [m]
        Points of the profile in the drawn configuration, as for a `Cam`.
    at : point [m]
        A point on the face, in world coordinates of the drawn configuration.
    normal : direction
        Normal of the face, from the cam to the follower, in world coordinates of the drawn configuration.
    centre : point [m]
        Origin of the profile's coordinates, in world coordinates; the world's origin if not given.
    axis : direction
        In space: normal of the profile's plane, in world coordinates.
    conjugate : bool
        Form closure: a second cam on the same shaft (or the other side of a yoke) guides a second face, so that the
        contact can pull: a negative force is that of the second cam. `conjugate_points` gives its profile.

    Raises
    ------
    ModelError
        If the profile is concave somewhere: a face spans the hollow (undercut), and cannot follow it.

    Notes
    -----
    With the support function h(psi) of the profile, its extent along the normal of the face at the angle psi in the
    cam, the distance of the face from the centre is h, the contact is at h' along the face, and the radius of curvature
    is h + h''. An eccentric disk of radius r has h = r + e cos(psi).
    """

    points: Points
    normal: Direction
    centre: Point = (0.0, 0.0, 0.0)
    conjugate: Flag = False

    blocks: ClassVar = (FLAT_FACE,)
    local: ClassVar[tuple[str, ...]] = ("points",)
    needs_axis: ClassVar[bool] = True
    symbol: ClassVar[str] = "cam"
    one_sided: ClassVar[bool] = True
    both_sides: ClassVar[str] = ", or give conjugate=True if a second cam guides the follower from the other side"

    def check(self, n: SimpleNamespace) -> None:
        """Require enough points, each with two coordinates, of a convex profile."""
        if len(n.points) < 4 or not all(len(p) == 2 for p in n.points):
            raise ModelError(f"{self.title}: a profile needs four points or more, each (x, y), got {len(n.points)}")
        if not (np.diff(chord_lengths(n.points, True)).real > 0.0).all():
            raise ModelError(f"{self.title}: two consecutive points of its profile coincide; leave one out")
        _, bend, at = _profile(n.points, 20 * len(n.points))
        if not bend.min() > 0.0:
            k = int(np.argmin(bend))
            raise ModelError(
                f"{self.title}: its profile is concave near ({at[k, 0]:.4g}, {at[k, 1]:.4g}) m, where the curvature is "
                f"{bend[k]:.4g} 1/m: a flat face spans the hollow (undercut). Take a larger base circle, or a "
                f"slower lift"
            )

    def world_frames(self, n: SimpleNamespace, planar: bool) -> tuple[WorldFrame, WorldFrame]:
        """Return F at the profile's origin, M at the point on the face with its x axis along the normal."""
        R = self.orientation(n.axis, planar)
        centre = vector(n.centre[: 2 if planar and not n.centre[2:] else 3], planar, f"centre of {self.title}")
        x = vector(n.normal, planar, f"normal of {self.title}", direction=True)
        if abs(matrix_product(R.T, x)[2].real) > 1e-9:
            raise ModelError(f"{self.title}: the normal of its face must be square to the axis")
        z = R[:, 2]
        return (centre, R), (vector(n.at, planar, f"'at' of {self.title}"), np.column_stack([x, np.cross(z, x), z]))

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """Return zeros; the engine adds the spline's position."""
        return (0.0,) * 7

    def pushing_sign(self, n: SimpleNamespace, F: WorldFrame, M: WorldFrame) -> float | None:
        """Return the sign of a force along the normal, from the cam to the follower."""
        return None if self.conjugate else 1.0

    def curves(self, n: SimpleNamespace) -> tuple[list[float], ...]:
        """Return the spline of the support function."""
        if any(hasattr(x, "called") and not x.known for p in n.points for x in p):
            raise ModelError(
                f"{self.title}: points of its profile follow parameters, and a curve through symbols is not written "
                f"out; give these parameters as numbers"
            )
        return (support_function(n.points),)

    def conjugate_points(self, breadth: float) -> list[tuple[float, float]]:
        """Return points of the conjugate profile, along the same axes: of a second cam, which guides a second face.

        That face is opposite to the first, at a distance ``breadth`` [m] from it (towards the cam).

        Raises
        ------
        ModelError
            If the profile is concave somewhere: the breadth is too small.
        """
        data = np.array(support_function(tuple(tuple(map(float, p)) for p in self.points)))
        psi = np.linspace(0.0, TURN, DIRECTIONS, endpoint=False)
        h, h1, h2 = spline(data, 0, psi)
        radius = breadth - h - h2
        if not radius.min() > 0.0:
            raise ModelError(
                f"{self.title}: the conjugate profile for a breadth of {breadth:g} m is concave; give more than "
                f"{(h + h2).max():.4g} m"
            )
        # its extent is breadth - h(psi) along -n, and the contact is at h'(psi) along t
        n, t = np.stack([np.cos(psi), np.sin(psi)], axis=1), np.stack([-np.sin(psi), np.cos(psi)], axis=1)
        p = -(breadth - h)[:, None] * n + h1[:, None] * t
        return [(float(x), float(y)) for x, y in p]


def _profile(points: tuple, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return directions of the outward normals, curvatures (positive: convex) and points of a profile."""
    x, y = (np.array(c).real for c in profile_splines(points, True))
    s = np.linspace(0.0, chord_lengths(points, True)[-1].real, count, endpoint=False)
    (x0, x1, x2), (y0, y1, y2) = spline(x, 0, s), spline(y, 0, s)
    way = np.sign(np.sum(x0 * y1 - y0 * x1))  # 1: counterclockwise
    return (
        np.arctan2(-way * x1, way * y1),
        way * (x1 * y2 - y1 * x2) / (x1**2 + y1**2) ** 1.5,
        np.column_stack([x0, y0]),
    )


@lru_cache(maxsize=64)
def support_function(points: tuple) -> list[float]:
    """Return the periodic spline of the largest c.n over a closed convex profile, for n at angles from 0 to 2 pi."""
    if np.iscomplexobj(np.array(points)):
        real = support_function(tuple(tuple(x.real for x in p) for p in points))
        return (np.array(real) + 1j * np.imag(_fitted(points))).tolist()  # type: ignore[no-any-return]
    return _fitted(points)


def _fitted(points: tuple) -> list[float]:
    """Return the same for numbers of one type."""
    x, y = (np.array(c) for c in profile_splines(points, True))
    length = chord_lengths(points, True)[-1]
    s = np.linspace(0.0, length.real, 20 * len(points), endpoint=False)
    psi = np.linspace(0.0, TURN, DIRECTIONS + 1)
    c, w = np.cos(psi), np.sin(psi)
    values = np.outer(c, spline(x, 0, s)[0].real) + np.outer(w, spline(y, 0, s)[0].real)
    at: Any = s[np.argmax(values, axis=1)] + 0.0 * length
    for _ in range(PASSES):  # Newton's method for c'.n = 0
        (x0, x1, x2), (y0, y1, y2) = spline(x, 0, at), spline(y, 0, at)
        at = at - (x1 * c + y1 * w) / (x2 * c + y2 * w)
    (x0, _, _), (y0, _, _) = spline(x, 0, at), spline(y, 0, at)
    h = x0 * c + y0 * w
    h[-1] = h[0]
    if np.iscomplexobj(h):
        pieces = complex_cubic(psi, h, True)
    else:
        from scipy.interpolate import CubicSpline

        pieces = CubicSpline(psi, h, bc_type="periodic").c[::-1].T
    return pack_spline(psi, h, pieces, "repeat").tolist()
