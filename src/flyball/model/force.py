"""What every force declares: formulas, parameters, laws, frames; one-sided elements and their switches.

A `Switch` is a row with modes: a constraint that holds at times (stops, friction, locks). `Unilateral` elements
have a quantity that is free on one side, and held or pushed on the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..constraints.blocks import Row
from ..errors import ModelError
from .element import Element, Law, Point, PointPair, nonnegative, positive
from .geometry import vector
from .joint import WorldFrame

if TYPE_CHECKING:
    from .model import Model


@dataclass(frozen=True)
class Force(Element):
    """A force element.

    One family acts between a frame F and a frame M: ``inputs(par, F, M)`` (what its laws may depend on besides time)
    and ``wrench(par, F, M, laws, values)`` with the values of the inputs: force and torque on M at M's origin, world
    axes; the reverse acts on F's body at the same point. The other acts along a measured quantity x:
    ``effort(par, x, rate, laws, load)``, positive where it pushes x up (`CoordinateForce`). Either may have an
    ``energy``. They stand in the subclass's file, as plain functions of numbers; ``kind`` numbers them.
    """

    category: ClassVar[str] = "forces"
    kind: ClassVar[int]
    inputs: ClassVar[Callable]
    wrench: ClassVar[Callable]
    energy: ClassVar[Callable | None] = None
    outputs: ClassVar[dict[str, str]] = {}
    drawn: ClassVar[str] = ""
    single: ClassVar[str] = ""  # "rope" or "friction": steps by impulses take it as a single row, not as a force
    fails: ClassVar[str] = "Its numbers are too large"  # where its formulas give no number, and what to do

    def ends(self) -> dict[str, str]:
        """Role of each of its frames -> body or frame that it is on."""
        raise NotImplementedError

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """Its frames in the world as drawn, if it says where they are; else they are those that it names."""
        return None

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Up to sixteen numbers that the formulas see."""
        return ()

    def laws(self) -> tuple[Law | None, ...]:
        """Up to three expressions that the formulas see."""
        return ()

    def conservative(self) -> bool:
        """Whether its energy is all that it ever takes or gives."""
        return False

    def needs(self) -> str:
        """Element whose numbers its own depend on too, which then are ``n.of``; none if empty."""
        return ""

    def on_points(self) -> bool:
        """Whether it sees of its frames no more than where their origins are, and makes no torque about them."""
        return False


def no_inputs(par, F, M):  # type: ignore[no-untyped-def]
    """Nothing that laws may depend on."""
    return 0.0 * M[0][0], 0.0 * M[0][0]


@dataclass(frozen=True)
class TwoPointForce(Force):
    """A force along the line between two points."""

    body_i: str
    body_j: str
    _: KW_ONLY
    at: PointPair | None = None
    inputs: ClassVar[Callable] = staticmethod(no_inputs)

    def ends(self) -> dict[str, str]:
        """F on ``body_i``, M on ``body_j``."""
        return {"F": self.body_i, "M": self.body_j}

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """The two points."""
        if n.at is None:
            return None
        a, b = (vector(p, planar, f"'at' of {self.title}") for p in n.at)
        return {"F": (a, np.eye(3)), "M": (b, np.eye(3))}

    def on_points(self) -> bool:
        """The line is all it needs."""
        return True


@dataclass(frozen=True)
class TwoFrameForce(Force):
    """A force and a torque between two frames that lie on one another when they are drawn at a point."""

    body_i: str
    body_j: str
    _: KW_ONLY
    at: Point | None = None
    inputs: ClassVar[Callable] = staticmethod(no_inputs)

    def ends(self) -> dict[str, str]:
        """F on ``body_i``, M on ``body_j``."""
        return {"F": self.body_i, "M": self.body_j}


@dataclass(frozen=True)
class BodyForce(Force):
    """A force or torque on one body, from outside."""

    body: str
    inputs: ClassVar[Callable] = staticmethod(no_inputs)

    def ends(self) -> dict[str, str]:
        """M on the body."""
        return {"M": self.body}


@dataclass(frozen=True)
class CoordinateForce(Force):
    """A force along a measured quantity: a joint's coordinate, or a sum of distances."""

    effort: ClassVar[Callable]
    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "force": "effort"}  # value and rate first
    dimensions: ClassVar[dict[str, tuple[str, str]]] = {  # of fields, along a displacement and about an angle
        "stiffness": ("N/m", "N*m/rad"),
        "damping": ("N*s/m", "N*m*s/rad"),
        "viscous": ("N*s/m", "N*m*s/rad"),
        "rest": ("m", "rad"),
        "force": ("N", "N*m"),
    }
    not_negative: ClassVar[tuple[str, ...]] = ()  # laws that must not be
    sign: ClassVar[float] = 1.0  # of the output that follows value and rate, relative to the effort

    def ends(self) -> dict[str, str]:
        """No frames of its own."""
        return {}

    def coordinate_text(self) -> str:
        """The coordinate that it acts along: ``"A.angle"``."""
        return ""

    def along(self) -> tuple[str, ...]:
        """Coordinates whose sum it acts along, each times its weight (`switch_weights`); none if it has a path."""
        return (self.coordinate_text(),) if self.coordinate_text() else ()

    def outward(self, n: SimpleNamespace) -> float:
        """1, or -1 where results tell its quantity, rate and effort the other way round than the formulas have them."""
        return 1.0

    def examine(self, model: Model) -> None:
        """Refuse what it cannot act along."""

    def path(self) -> tuple[tuple[str, str, Row], ...]:
        """Or the terms (role of F, role of M, formula) whose sum it acts along."""
        return ()

    def on_points(self) -> bool:
        """Its terms say."""
        return all(set("FM") <= set(formula.of_kind.points) for _, _, formula in self.path())


@dataclass(frozen=True)
class JointForce(CoordinateForce):
    """A torque about the axis of a joint that has an angle, positive on ``body_j``."""

    joint: str

    def coordinate_text(self) -> str:
        """The joint's angle."""
        return f"{self.joint}.angle"

    def examine(self, model: Model) -> None:
        """It acts about a joint, not on a body's angle."""
        model.joint(self.joint, self, "angle")


@dataclass(frozen=True)
class Switch:
    """A row with a mode along one quantity: a weighted sum of coordinates, or of terms of the element's own.

    Attributes
    ----------
    kind : int
        STOP, FRICTION, ONE_WAY, LOCK, ELASTIC, RATCHET or SLIP of `constraints.modes`.
    label : str
        Which of the element's it is; empty if it has one.
    along : tuple of str
        Coordinates (``"A.angle"``, ``"block.x"``) whose sum is the quantity, with weights if there are several.
    path : tuple of (role, role, Row)
        Or terms between frames of the element's own, such as the parts of a rope.
    seen : tuple of (role, role, Row)
        What is measured in place of ``path``, where the row itself says less than that while it is off.
    other : str
        Label of the element's switch that it belongs to: of a slip, the gap.
    slides : bool
        Whether the element is a force along the same quantity that acts while the row is off (friction), or whose
        corners are watched (what is elastic).
    weighted : bool
        Whether a single coordinate has a weight too.
    """

    kind: int
    label: str = ""
    along: tuple[str, ...] = ()
    path: tuple[tuple[str, str, Row], ...] = ()
    seen: tuple[tuple[str, str, Row], ...] = ()
    other: str = ""
    slides: bool = False
    weighted: bool = False

    @property
    def summed(self) -> bool:
        """Whether the quantity is a sum with weights (`Element.switch_weights`), and so the element's own."""
        return self.weighted or len(self.along) > 1


DIRECTIONS = (1.0, -1.0)


@dataclass(frozen=True)
class Unilateral(CoordinateForce):
    """A stop, a play, a latch: along a coordinate, or along a weighted sum of some.

    A rigid one is a row that holds at times (`switches`), an elastic one a force with a corner. Of either a result
    tells ``value`` and ``rate`` of the quantity, the ``force`` along it (positive where it pushes the value up), and
    ``closed``: 1 where it holds or pushes at its lower side, -1 at its upper, 0 where it is open.
    """

    category: ClassVar[str] = "limits"
    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "force": "effort", "closed": "1"}

    def acts(self) -> bool:
        """Whether it is a force: an elastic one."""
        return getattr(self, "stiffness", None) is not None

    def check_range(self, n: SimpleNamespace, unit: str) -> None:
        """Refuse sides that leave no room; ``unit`` is that of its quantity."""

    def conservative(self) -> bool:
        """Whether its energy is all that it ever takes or gives."""
        return getattr(self, "damping", 0.0) == 0.0


@dataclass(frozen=True)
class Latch(Unilateral):
    """What may move one way: a coordinate, or the difference of two."""

    coordinate: str

    def along(self) -> tuple[str, ...]:
        """The coordinate, and that which it is relative to."""
        other = getattr(self, "relative_to", None)
        return (self.coordinate,) if other is None else (self.coordinate, other)

    def switch_weights(self, n: SimpleNamespace, label: str) -> tuple[float, ...]:
        """Such that the quantity may grow."""
        way = float(n.direction.real)
        return (way, -way)[: len(self.along())]

    def outward(self, n: SimpleNamespace) -> float:
        """As the user's coordinate goes."""
        return float(n.direction.real)

    def examine(self, model: Model) -> None:
        """Its coordinates are there, and of one kind."""
        for text in self.along():
            model.coordinate(text, self)
        if len(self.along()) == 2:
            check_same_kind(self, model, *self.along())


def check_elastic(e: Element, n: SimpleNamespace, rigid: str = "a rigid one, which gives no way") -> None:
    """Refuse a stiffness that is none, and what goes with the other kind of stop only."""
    positive(e, n, "stiffness", why=f"Leave it out for {rigid}")
    nonnegative(e, n, "damping")
    if n.stiffness is None and n.damping != 0.0:
        raise ModelError(
            f"{e.title}: damping is {n.damping:g}, and a rigid one has none; give stiffness= too, or neither"
        )
    if n.stiffness is not None and n.restitution is not None:
        raise ModelError(
            f"{e.title}: restitution belongs to a rigid one and stiffness to an elastic one, which bounces off by "
            f"itself; leave one out"
        )


def check_direction(e: Element, value: Any) -> None:
    """Refuse a direction that is none."""
    if value not in DIRECTIONS:
        raise ModelError(f"{e.title}: direction is {value!r}; it must be 1 (the value may grow) or -1 (it may fall)")


def check_same_kind(e: Any, model: Model, first: str, second: str) -> None:
    """Refuse two coordinates of which one is an angle and the other a length, or that are the same."""
    if first == second:
        raise ModelError(f"{e.title}: {first!r} relative to itself never moves; name another, or leave it out")
    units = [model.unit(text, e) for text in (first, second)]
    if units[0] != units[1]:
        raise ModelError(f"{e.title}: {first!r} is in {units[0]} and {second!r} in {units[1]}; name two of one kind")
