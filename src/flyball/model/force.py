"""What every force declares: its formulas, its parameters and laws, and what it acts on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..constraints.blocks import Row
from .element import Element, Law, Point, PointPair
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
