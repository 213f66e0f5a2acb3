"""Base classes of joints and couplings: constraint rows, relative coordinates, frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from functools import cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..constraints.blocks import ANGLE, PITCH, Row
from ..errors import ModelError
from .element import Direction, Element, Point
from .geometry import triad, vector

if TYPE_CHECKING:
    from .expressions import Expression
    from .model import Model


WorldFrame = tuple[np.ndarray, np.ndarray]

Z_TO_X = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
"""Rotation of a frame whose x axis becomes the z axis of the original frame."""


@dataclass(frozen=True)
class Coordinate:
    """A relative coordinate: the formula that measures it, between which frames of the joint, with which sign."""

    row: Row
    frames: str = "FM"
    turn_F: tuple = ()
    turn_M: tuple = ()
    sign: float = 1.0
    offset: str = ""  # field with its value in the drawn configuration
    singular: str = ""  # of one of several descriptions of one rotation: where it is undefined

    @property
    def unit(self) -> str:
        """Unit of its value."""
        return self.row.measure


X_AND_Z = ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0))
"""Rotation of a frame that exchanges its x and z axes."""
GIMBAL_LOCK = "at a pitch of 90 deg, where roll and yaw are undefined"
ORIENTATION_ANGLES = {
    "roll": Coordinate(ANGLE, "MF", turn_F=Z_TO_X, turn_M=X_AND_Z, sign=-1.0, singular=GIMBAL_LOCK),
    "pitch": Coordinate(PITCH, singular=GIMBAL_LOCK),
    "yaw": Coordinate(ANGLE, singular=GIMBAL_LOCK),
}
"""Roll, pitch, yaw of M in F: R_FM = R_z(yaw) R_y(pitch) R_x(roll), as of vehicles (ISO 8855) and URDF."""


@dataclass(frozen=True)
class Primitive:
    """One step, from frame F to frame M, of the chain that represents a joint as a tree joint."""

    kind: str  # "R" rotates about the axis, "P" slides along it, "S" rotates about the point
    axis: str = "z"  # axis of the frame from which it starts; F as moved by the previous steps
    coordinate: str = ""  # the joint's coordinate that it represents, if that has a name


FLOATING = (Primitive("P", "x"), Primitive("P", "y"), Primitive("P", "z"), Primitive("S"))
"""A chain of six free motions, for joints that have no chain of their own."""


@dataclass(frozen=True)
class Joint(Element):
    """Rows of constraint between a frame F on ``body_i`` and a frame M on ``body_j``.

    A joint is data: a subclass only defines its ``blocks`` and ``coordinates``.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies, or frames fixed on bodies; ``"ground"`` is the world.
    at : point [m]
        Origin of both frames, in world coordinates of the drawn configuration.
    axis : direction
        Axis of the joint, in world coordinates of the drawn configuration.
    """

    body_i: str
    body_j: str
    _: KW_ONLY
    at: Point | None = None
    axis: Direction | None = None

    category: ClassVar[str] = "joints"
    blocks: ClassVar[tuple[Row, ...]] = ()
    coordinates: ClassVar[dict[str, Coordinate]] = {}
    chain: ClassVar[tuple[Primitive, ...] | None] = None  # its free motions, slides first; None: no chain of its own
    remaining_rows: ClassVar[tuple[Row, ...]] = ()  # blocks that its chain does not satisfy by itself
    rest: ClassVar[tuple[tuple[float, ...], ...]] = ()  # axes of M in F (columns) for zero coordinates
    planar_normal: ClassVar[str] = "z"  # joint axis that becomes the normal of the plane; "" if it cannot be planar
    spatial: ClassVar[bool] = True
    in_space: ClassVar[str] = "Prismatic"  # replacement for a joint that exists in the plane only
    needs_axis: ClassVar[bool] = False
    axisless: ClassVar[bool] = False  # value for axes that have no name of their own
    symbol: ClassVar[str] = "fixed"  # symbol in pictures
    replaceable: ClassVar[bool] = False  # whether a joint with fewer constraints may replace it as a remedy
    stand_in: ClassVar[float] = 0.0  # cost of using it as a replacement; 0: it is never proposed
    omission: ClassVar[float] = 3.5  # cost of leaving it out
    called: ClassVar[str] = ""  # its name in proposals, if not its kind
    one_sided: ClassVar[bool] = False  # whether its first row represents a contact that can only push
    both_sides: ClassVar[str] = ""  # the field that makes such a contact two-sided, for messages
    one_surface: ClassVar[bool] = False  # whether its coordinates are slips of one surface
    axial: ClassVar[bool] = False  # whether a reflection keeps rotations about its axes, not displacements along them
    place_unit: ClassVar[str] = "m"  # unit of ``place``, on a curve or of a direction, if it has ``nearest``
    thread: ClassVar[bool] = False  # whether its surface is a thread, along which all its coordinates slide together

    def ends(self) -> dict[str, str]:
        """Return role of each of its frames -> its body or frame."""
        return {"F": self.body_i, "M": self.body_j}

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """Return its frames in the world in the reference configuration, if it is given by ``at``; else None."""
        return None if n.at is None else dict(zip("FM", self.world_frames(n, planar), strict=True))

    def rows(self, planar: bool) -> list[Row]:
        """Return its active rows: in the plane, rows about the normal are always satisfied."""
        return list(_rows(type(self), planar))  # type: ignore[arg-type]

    def primitives(self, planar: bool) -> tuple[Primitive, ...]:
        """Return its chain as a tree joint, reduced to the plane if planar."""
        return _primitives(type(self), planar)  # type: ignore[arg-type]

    def loose(self, planar: bool) -> list[Row]:
        """Return the rows that remain if it is a tree joint."""
        return [r for r in self.rows(planar) if self.chain is None or r in self.remaining_rows]

    def world_frames(self, n: SimpleNamespace, planar: bool) -> tuple[WorldFrame, WorldFrame]:
        """F and M (origin, rotation) in world coordinates of the drawn configuration, for a joint given by ``at``."""
        p = vector(n.at, planar, f"'at' of {self.title}")
        R = self.orientation(n.axis, planar)
        return (p, R), (p, R)

    def orientation(self, axis: tuple[float, ...] | None, planar: bool) -> np.ndarray:
        """Return the axes of the joint frame: z along the joint's axis; in the plane one axis is the normal."""
        if axis is None:
            if self.needs_axis and (not planar or self.planar_normal != "z"):
                example = "(1, 0)" if planar else "(0, 0, 1)"
                raise ModelError(f"{self.title}: give its axis in world coordinates, for instance axis={example}")
            return np.eye(3)
        if planar and self.planar_normal == "z" and len(axis) != 3:
            raise ModelError(f"{self.title}: in a planar mechanism its axis is the normal; leave axis out")
        a = vector(axis, planar and self.planar_normal != "z", f"axis of {self.title}", direction=True)
        if planar and self.planar_normal == "z":
            if abs(a[0]) + abs(a[1]) > 1e-12 or a[:2].imag.any():
                raise ModelError(f"{self.title}: in a planar mechanism its axis is the normal; leave axis out")
            return np.eye(3)
        if planar:
            normal = np.array([0.0, 0.0, 1.0])
            return np.column_stack([np.cross(normal, a), normal, a])
        return triad(a)

    def measured(self, planar: bool) -> dict[str, Coordinate]:
        """Return its relative coordinates, reduced to the plane if planar."""
        if not planar:
            return self.coordinates
        return {k: c for k, c in self.coordinates.items() if self.planar_normal not in c.row.axes or not c.row.axes}

    def independent(self, planar: bool) -> list[str]:
        """Return the names of its coordinates but those that are one of several descriptions of one rotation."""
        return [k for k, c in self.measured(planar).items() if not c.singular]

    def locked(self, planar: bool) -> list[str]:
        """Return the names of the coordinates that are locked together to prevent all its relative motions."""
        return self.independent(planar)

    def offset(self, n: SimpleNamespace, coordinate: str) -> float:
        """Return the value of a coordinate in the drawn configuration."""
        name = self.coordinates[coordinate].offset
        return getattr(n, name) if name else 0.0

    def reversed_factors(self, signs: tuple[float, ...]) -> dict[str, Any]:
        """Return factors of the values of its coordinates in the drawn configuration."""
        own = self.coordinates.values()
        return {c.offset: sign for c, sign in zip(own, signs, strict=True) if c.offset}

    def constants(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """Return parameters 0 to 6 of a row for the drawn frames; the last is subtracted from its value.

        For a `ConstraintRow` up to six: ``par`` of its formula, in SI units.
        """
        return row.par[:7]

    def row_parameters(self, n: SimpleNamespace, row: Row, F: WorldFrame, M: WorldFrame) -> tuple[float, ...]:
        """Return the same, padded to seven.

        Raises
        ------
        ModelError
            If there are more than the row has.
        """
        par = tuple(self.constants(n, row, F, M))
        if len(par) > row.parameters:
            raise ModelError(
                f"{self.title}: constants() gives {len(par)} numbers for its {type(row).__name__}, which has up to "
                f"{row.parameters}"
            )
        return (*par, *(0.0,) * (7 - len(par)))

    def weight(self, n: SimpleNamespace, coordinate: str, F: WorldFrame, M: WorldFrame) -> float:
        """Return the coefficient of a coordinate that is added to a row (``Row.plus``)."""
        raise NotImplementedError

    def degenerate(self, n: SimpleNamespace, distance: float, near: float) -> str:
        """Return why its coordinates have no value, if they have none.

        ``distance`` is that of the origins of F and M [m]; differences less than ``near`` [m] count as zero.
        """
        return ""

    def pushing_sign(self, n: SimpleNamespace, F: WorldFrame, M: WorldFrame) -> float | None:
        """Return the sign of the first row's force while a one-sided contact pushes; 0: unknown, None: two-sided."""
        return 1.0

    def curves(self, n: SimpleNamespace) -> tuple[list[float], ...]:
        """Return the splines that its rows read, as flat lists of numbers (see ``math.spline``)."""
        return ()


@cache
def _rows(kind: type[Joint], planar: bool) -> tuple[Row, ...]:
    """Return the active rows of all joints of a kind (cached)."""
    if not planar:
        return kind.blocks
    return tuple(r for r in kind.blocks if ("z" if r.world else kind.planar_normal) not in r.axes)


@cache
def _primitives(kind: type[Joint], planar: bool) -> tuple[Primitive, ...]:
    """Return the chain of all joints of a kind as tree joints (cached)."""
    chain = FLOATING if kind.chain is None else kind.chain
    if not planar:
        return chain
    normal = kind.planar_normal
    flat = (Primitive("R", normal, p.coordinate) if p.kind == "S" else p for p in chain)
    return tuple(p for p in flat if (p.kind == "R") == (p.axis == normal))


WEIGHT_UNITS = ("1", "m", "m/rad", "rad/m", "1/m")
"""Permitted units of the weights of a sum of coordinates."""


def check_weights(e: Element, coordinates: tuple[str, ...], weights: tuple[float, ...]) -> None:
    """Require a nonzero weight for each of different coordinates.

    Raises
    ------
    ModelError
        If the numbers of coordinates and weights differ, a coordinate occurs twice, or a weight is 0.
    """
    twice = [c for k, c in enumerate(coordinates) if c in coordinates[:k]]
    if twice:
        raise ModelError(f"{e.title}: it names {twice[0]!r} twice; name it once, with both weights added up")
    if len(weights) != len(coordinates):
        raise ModelError(f"{e.title}: {len(coordinates)} coordinates need as many weights, got {len(weights)}")
    if not all(w != 0.0 for w in weights):
        raise ModelError(f"{e.title}: a weight is 0, which couples nothing; got {weights}")


@dataclass(frozen=True)
class Coupling(Element):
    """One constraint row: a weighted sum of coordinates keeps its reference value, or an equation of them holds.

    Full turns of angles are counted, so a gear train keeps its phase over any number of turns.
    """

    category: ClassVar[str] = "couplings"
    omission: ClassVar[float] = 2.0  # cost of leaving it out as a remedy for redundancy
    symbol: ClassVar[str] = "coupler"
    dimensions: ClassVar[dict[str, tuple[str, ...]]] = {}  # field -> permitted units

    def coupled(self) -> tuple[str, ...]:
        """Return the coordinates: ``"joint.coordinate"``, or ``"body.x"``."""
        raise NotImplementedError

    def factors(self, n: SimpleNamespace, model: Model, axes: Callable[[str], Any]) -> tuple[float, ...]:
        """Return a weight for each coordinate; ``axes(joint)`` is a joint's axis in the world, as drawn."""
        raise NotImplementedError

    def equation(self, model: Model) -> Expression | None:
        """Return the expression of coordinates and time that is kept at zero; None: the weighted sum is kept."""
        return None

    def first_weight(self, n: SimpleNamespace) -> float:
        """Return the weight of the first coordinate, as given."""
        return 1.0

    def total(self, n: SimpleNamespace) -> float | None:
        """Return the required value of the weighted sum; None: that of the reference configuration."""
        return None

    def examine(self, model: Model) -> None:
        """Refuse joints that it cannot couple."""


def shared_body(e: Coupling, model: Model, first: str, second: str, remedy: str) -> str:
    """Return the body that both joints share.

    Raises
    ------
    ModelError
        If they share none, or both.
    """
    if first == second:
        raise ModelError(f"{e.title}: both its joints are {first!r}; name two")
    ends = [{model.carrier(x, e) for x in (j.body_i, j.body_j)} for j in (model[first], model[second])]
    common = ends[0] & ends[1]
    if len(common) != 1:
        listed = " and ".join(f"{j!r} ({' - '.join(sorted(x))})" for j, x in zip((first, second), ends, strict=True))
        raise ModelError(f"{e.title}: {listed} have {'no body' if not common else 'both bodies'} in common; {remedy}")
    return common.pop()


def sense(model: Model, e: Coupling, joint: str, carrier: str) -> float:
    """Return +1 if the joint's coordinate is that of the other body relative to the carrier, -1 if reversed."""
    return -1.0 if model.carrier(model[joint].body_j, e) == carrier else 1.0
