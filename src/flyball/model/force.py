"""What every force declares: its formulas, its parameters and laws, and the frames it acts between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from types import SimpleNamespace
from typing import ClassVar

import numpy as np

from .element import Element, Number, PointPair
from .geometry import vector


@dataclass(frozen=True)
class Force(Element):
    """A force element between a frame F and a frame M.

    The formulas ``inputs(par, F, M, turns)`` (what its laws may depend on besides time), ``wrench(par, F, M, laws,
    values)`` with the values of the inputs (force and torque on M at M's origin, world axes; the reverse acts on F's
    body) and ``energy(par, F, M, turns)``
    stand in the subclass's file, as plain functions of numbers.
    """

    category: ClassVar[str] = "forces"
    kind: ClassVar[int]
    inputs: ClassVar[Callable]
    wrench: ClassVar[Callable]
    energy: ClassVar[Callable | None] = None
    outputs: ClassVar[dict[str, str]] = {}
    on_joint: ClassVar[bool] = False  # acts about a joint's axis and counts its turns
    drawn: ClassVar[str] = ""

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Up to eight numbers that the formulas see."""
        return ()

    def laws(self) -> tuple[Number | None, ...]:
        """Up to three expressions that the formulas see."""
        return ()

    def conservative(self) -> bool:
        """Whether its energy is all that it ever takes or gives."""
        return False


@dataclass(frozen=True)
class TwoPointForce(Force):
    """A force along the line between two points."""

    body_i: str
    body_j: str
    _: KW_ONLY
    at: PointPair | None = None

    def world_points(self, n: SimpleNamespace, planar: bool) -> tuple[np.ndarray, np.ndarray]:
        """The two points in world coordinates of the drawn configuration."""
        a, b = (vector(p, planar, f"'at' of {self.title}") for p in n.at)
        return a, b


@dataclass(frozen=True)
class JointForce(Force):
    """A torque about the axis of a joint that has an angle, positive on ``body_j``."""

    joint: str

    on_joint: ClassVar[bool] = True


@dataclass(frozen=True)
class BodyForce(Force):
    """A force or torque on one body, from outside."""

    body: str
