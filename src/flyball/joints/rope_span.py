"""Straight part of a rope between two pulleys: what a `Rope` with radii consists of."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

from ..constraints.angle import unwrapped
from ..constraints.blocks import ANGLE, TANGENT, shift
from ..constraints.tangent import tangent
from ..errors import ModelError
from ..math.vec import matrix_product
from ..model.element import Numbers, PointPair, Unit, element
from ..model.joint import Coordinate, Joint, WorldFrame
from .distance import Distance


@element
class RopeSpan(Joint):
    """Straight part of a `Rope` between two pulleys, or between a pulley on ``body_i`` and a point of ``body_j``.

    It constrains nothing. Its coordinate ``length`` is that of the part, less the rope that it has wound on both
    pulleys since their reference directions as it swings; ``angle`` is that of ``body_j`` relative to ``body_i``;
    ``x`` and ``y`` are the position of the second centre relative to the first, in the plane of the pulleys and in axes
    of ``body_i``; ``place`` is the direction of the part in the frame of ``body_i``, with full turns [rad].

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies; ``"ground"`` is the world.
    at : pair of points [m]
        Both centres, in world coordinates of the drawn configuration.
    radii : pair of numbers [m]
        Positive where the rope, on its way from ``body_i`` to ``body_j``, runs counterclockwise around the pulley.
    axis : direction
        In space: normal of the plane of both pulleys.
    """

    at: PointPair | None = None  # type: ignore[assignment]
    radii: Annotated[Numbers, Unit("m")] = (0.0, 0.0)

    coordinates: ClassVar = {
        "length": Coordinate(TANGENT),
        "angle": Coordinate(ANGLE),
        "x": Coordinate(shift("x")),
        "y": Coordinate(shift("y")),
    }
    needs_axis: ClassVar[bool] = True
    handed: ClassVar[tuple[str, ...]] = ("radii",)
    axial: ClassVar[bool] = True
    place_unit: ClassVar[str] = "rad"
    symbol: ClassVar[str] = "rope"

    def check(self, n: SimpleNamespace) -> None:
        """Require two radii, and circles that a line touches."""
        if len(n.radii) != 2:
            raise ModelError(f"{self.title}: radii has {len(n.radii)} numbers; give two, 0 for a point")
        if n.at is None:
            return
        distance = sum((x.real - y.real) ** 2 for x, y in zip(*n.at, strict=True)) ** 0.5
        if text := self.degenerate(n, distance, 0.0):
            raise ModelError(text)

    def world_frames(self, n: SimpleNamespace, planar: bool) -> tuple[WorldFrame, WorldFrame]:
        """Return frames with origins at both centres and z along the axis."""
        R = self.orientation(n.axis, planar)
        (a, _), (b, _) = Distance.world_frames(self, n, planar)  # type: ignore[arg-type]
        return (a, R), (b, R)

    def curves(self, n: SimpleNamespace) -> tuple[list[Any], ...]:
        """Return the second radius less the first."""
        return ([n.radii[1] - n.radii[0]],)

    def nearest(self, n: SimpleNamespace, F: WorldFrame, M: WorldFrame) -> tuple[Any]:
        """Return the direction of the part in F, within half a turn of the drawn one."""
        (here, R), (there, _) = self.world_frames(n, len(n.at[0]) == 2)
        (b,) = self.curves(n)[0]
        drawn = tangent(tuple(matrix_product(R.T, there - here)), b)[1]
        return (unwrapped(tangent(tuple(matrix_product(F[1].T, M[0] - F[0])), b)[1], drawn),)

    def degenerate(self, n: SimpleNamespace, distance: float, near: float) -> str:
        """Return a message if no line touches both circles."""
        if distance > abs(n.radii[1].real - n.radii[0].real) + near:
            return ""
        i, j = (f"{x!r} (radius {abs(r.real):g} m)" for x, r in zip(self.ends().values(), n.radii, strict=True))
        return (
            f"{self.title} has no length left: {i} and {j} are {distance:.6g} m apart, and no line touches both from "
            "the given sides. Give a Limit that stops the motion before"
        )

    def end_message(self, n: SimpleNamespace, at: float) -> str:
        """Return nothing: it has no ends."""
        return ""
