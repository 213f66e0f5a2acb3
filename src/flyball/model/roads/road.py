"""Roads: planes and height fields fixed on ground or on a body, and profiles along x."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import BeforeValidator

from ...errors import ModelError
from ..body import GROUND, Frame
from ..element import Element, Number, Unit, described_part, element, positive, python_data, resolve
from ..shapes.height_field import HeightField
from ..units import split_quantity

MOST_HEIGHTS = 50_000_000


class RoadGrid(NamedTuple):
    """Heights (nx, ny) [m]; first place and spacing along x, or along the line, and y, or across it; the line, if any.

    A height is nan where there is no road. ``line``: points (nx, 2) [m] at the arc lengths of the grid.
    """

    heights: np.ndarray
    along: tuple[float, float]
    across: tuple[float, float]
    line: np.ndarray | None = None


@dataclass(frozen=True)
class RoadSurface(Element):
    """Heights of a road over its x-y plane.

    Parameters
    ----------
    name : str
        Optional.
    """

    name: str = ""
    _: KW_ONLY

    category: ClassVar[str] = "road surfaces"

    @property
    def title(self) -> str:
        """Kind, and name if it has one, for messages."""
        return f"{type(self).__name__} {self.name!r}" if self.name else type(self).__name__

    def grid(self) -> RoadGrid:
        """Return its heights."""
        raise NotImplementedError


Surface = Annotated[
    RoadSurface | HeightField | None,
    described_part((RoadSurface, HeightField), "a surface such as RoadProfile(...) or HeightField(...)"),
]
PlainNumbers = Annotated[tuple[float, ...], BeforeValidator(python_data)]


@element
class RoadProfile(RoadSurface):
    """A profile along x: one height for all of the width, or one for each wheel track.

    Heights are interpolated by a cubic spline with two continuous derivatives. Two tracks are at y = track / 2 (left)
    and -track / 2 (right). The height changes smoothly from one to the other in the middle half between them, and is
    level across the road elsewhere, but for 1 % of the difference of the tracks.

    Parameters
    ----------
    name : str
        Optional.
    heights : numbers [m]
        At x = start, start + spacing, ...
    spacing : number [m]
    start : number [m]
    right : numbers [m]
        Heights of the right track; ``heights`` are then those of the left one.
    track : number [m]
        Distance of the two tracks.
    width : number [m]
        Of the road; its middle is y = 0. 100 m if not given, or twice the track.
    """

    heights: PlainNumbers
    spacing: float
    start: float = 0.0
    right: PlainNumbers | None = None
    track: float | None = None
    width: float | None = None

    def check(self, n: SimpleNamespace) -> None:
        """Refuse heights that make no profile."""
        for name in ("heights", "right"):
            z = getattr(self, name)
            if z is not None and (len(z) < 2 or not np.isfinite(z).all()):
                raise ModelError(f"{self.title}: {name} must be two or more finite numbers, got {reprlib.repr(z)}")
        if not self.spacing > 0.0 or not self.wide > 0.0:
            raise ModelError(
                f"{self.title}: spacing and width must be greater than 0, got {self.spacing}, {self.width}"
            )
        if (self.right is None) != (self.track is None):
            raise ModelError(f"{self.title}: right= and track= belong together; give both, or neither")
        if self.right is not None and len(self.right) != len(self.heights):
            raise ModelError(
                f"{self.title}: heights has {len(self.heights)} numbers and right {len(self.right)}; give as many"
            )
        if self.track is not None and not 0.0 < self.track < self.wide:
            raise ModelError(f"{self.title}: track must be between 0 and the width {self.wide:g} m, got {self.track:g}")

    @property
    def wide(self) -> float:
        """Return its width."""
        return self.width if self.width is not None else 2.0 * self.track if self.track is not None else WIDTH

    def grid(self) -> RoadGrid:
        """Return the profile across the width: 4 rows, or with two tracks `TRACK_CELLS` between them."""
        z = np.array(self.heights)
        if self.right is None or self.track is None:
            across = (-0.5 * self.wide, self.wide / 3.0)
            return RoadGrid(np.repeat(z[:, None], 4, axis=1), (self.start, self.spacing), across)
        step = self.track / TRACK_CELLS
        half = int(np.ceil(0.5 * self.wide / step - 1e-9))
        y = step * np.arange(-half, half + 1)
        share = np.clip(0.5 + 2.0 * y / self.track, 0.0, 1.0)
        share = share * share * (3.0 - 2.0 * share)
        heights = np.array(self.right)[:, None] * (1.0 - share) + z[:, None] * share
        return RoadGrid(heights, (self.start, self.spacing), (-half * step, step))


TRACK_CELLS = 12  # between two tracks
WIDTH = 100.0  # m: of a road with one profile


@element
class Road(Frame):
    """A road, for tyres: the x-y plane of a frame, or heights over it.

    Parameters
    ----------
    name : str
    body : str
        Body that carries it, a test rig for instance; ``"ground"`` if not given.
    position : point [m]
        Its origin in the body's reference frame.
    orientation : quaternion, Bryant angles [rad], rotation object or matrix
        Of its axes: x along the road, y to the left, z up. A slope of 5 % is ``(0, "-2.862 deg", 0)``.
    surface : surface
        `RoadProfile`, `RandomRoad`, `OpenCRG`, or `HeightField`; a plane without end if not given.
    friction : number [1]
        Factor of the tyres' friction: 1 for the surface on which they were measured.
    beyond : ``"refuse"`` or ``"hold"``
        Beyond the edges of the surface: there is no road, and a motion that gets there stops; or the edge's height.
    """

    body: str = GROUND
    surface: Surface = None
    friction: Annotated[Number, Unit("1")] = 1.0
    beyond: Literal["refuse", "hold"] = "refuse"

    def derive(self, n: SimpleNamespace, env: Mapping[str, Any]) -> None:
        """Resolve the numbers of the surface."""
        n.surface_numbers = None if self.surface is None else resolve(self.surface, env)

    def check(self, n: SimpleNamespace) -> None:
        """Refuse wrong numbers, and options without effect."""
        positive(self, n, "friction")
        if self.surface is not None:
            self.surface.check(n.surface_numbers)
            for name in ("dx", "dy"):
                given = getattr(self.surface, name, None)
                if isinstance(given, str) and split_quantity(given) is None:
                    raise ModelError(
                        f"{self.title}: {name} of its surface is {given!r}; the grid of a road does not follow "
                        "parameters: give a number or a quantity"
                    )
        elif self.beyond != "refuse":
            raise ModelError(f"{self.title}: a plane has no edges, so beyond has no effect; leave it out")

    def grid(self, n: SimpleNamespace) -> RoadGrid | None:
        """Return its heights; None for a plane.

        Raises
        ------
        ModelError
            If there are too many.
        """
        if self.surface is None:
            return None
        if isinstance(self.surface, HeightField):
            x = n.surface_numbers
            dy = x.dx if x.dy is None else x.dy
            z = np.array(self.surface.heights, float)
            found = RoadGrid(z, (0.0, float(x.dx.real)), (0.0, float(dy.real)))
        else:
            found = self.surface.grid()
        if found.heights.size > MOST_HEIGHTS:
            raise ModelError(f"{self.title}: its grid has {found.heights.size} heights, more than {MOST_HEIGHTS}")
        return found
