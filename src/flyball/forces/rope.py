"""Rope: an elastic line over two or more points that pulls and never pushes."""

from __future__ import annotations

import itertools
from dataclasses import field
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator

from ..compiler.jit import formula
from ..constraints.blocks import DISTANCE, Row
from ..errors import ModelError
from ..math.scalar import choose, maximum
from ..model.element import Damping, Length, Numbers, Stiffness, Unit, element, nonnegative, positive
from ..model.force import CoordinateForce
from ..model.geometry import vector
from ..model.joint import WorldFrame

KIND = 2


@formula
def effort(par, x, rate, laws, load):
    """Along the rope's length x: -max(0, k (x - x_0) + c rate) where it is longer than x_0, else nothing."""
    o = 0.0 * x
    stretch = x - par[2]
    return -choose(stretch, maximum(par[0] * stretch + par[1] * rate, o), o)


@formula
def energy(par, x):
    """Potential energy k max(0, x - x_0)^2 / 2 [J]."""
    stretch = maximum(x - par[2], 0.0 * x)
    return 0.5 * par[0] * stretch * stretch


def _list(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


Points = Annotated[tuple[Numbers, ...], BeforeValidator(_list), Unit("m")]


@element
class Rope(CoordinateForce):
    """An elastic rope that runs freely over points of bodies: tension is the same everywhere in it.

    It pulls with k (l - length) + c ldot while it is longer than its free length, and hangs slack otherwise. Points
    between its ends are eyes or small pulleys without friction; the same body may come again.

    Parameters
    ----------
    name : str
    bodies : list of str
        Bodies or frames that carry the points, in order: two or more; ``"ground"`` too.
    at : list of points [m]
        The points, in world coordinates of the drawn configuration. Not given: the origins of the frames.
    stiffness : number [N/m]
        Of the whole rope: E A / length.
    damping : number [N s/m]
    length : number [m]
        Free length; the drawn length if not given.
    """

    bodies: tuple[str, ...] = field(kw_only=False)
    at: Points | None = None
    stiffness: Stiffness
    damping: Damping = 0.0
    length: Length | None = None

    kind: ClassVar[int] = KIND
    effort: ClassVar = staticmethod(effort)
    energy: ClassVar = staticmethod(energy)
    sign: ClassVar[float] = -1.0
    outputs: ClassVar[dict[str, str]] = {"length": "m", "rate": "m/s", "tension": "N"}
    drawn: ClassVar[str] = "rope"
    single: ClassVar[str] = "rope"
    fails: ClassVar[str] = "Two neighbouring points of it coincide, where the rope between them has no direction"

    def ends(self) -> dict[str, str]:
        """One frame for each point."""
        return {f"P{k}": name for k, name in enumerate(self.bodies)}

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """The points."""
        if n.at is None:
            return None
        points = [vector(p, planar, f"'at' of {self.title}") for p in n.at]
        for k, (a, b) in enumerate(itertools.pairwise(points)):
            if not (a.real != b.real).any():
                raise ModelError(
                    f"{self.title}: points {k + 1} and {k + 2} are both at {tuple(a.real.tolist())} m, where the rope "
                    f"between them has no direction; move one, or leave it out"
                )
        return {f"P{k}": (p, np.eye(3)) for k, p in enumerate(points)}

    def path(self) -> tuple[tuple[str, str, Row], ...]:
        """The distance from each point to the next."""
        return tuple((f"P{k}", f"P{k + 1}", DISTANCE) for k in range(len(self.bodies) - 1))

    def check(self, n: SimpleNamespace) -> None:
        """Enough points, and a stiffness."""
        if len(self.bodies) < 2:
            raise ModelError(f"{self.title}: a rope has two ends at least, got bodies {self.bodies}; name the second")
        if n.at is not None and len(n.at) != len(self.bodies):
            raise ModelError(f"{self.title}: {len(self.bodies)} bodies need as many points in 'at', got {len(n.at)}")
        positive(self, n, "stiffness", why="A rope that cannot stretch is a Distance joint or a Coupler")
        nonnegative(self, n, "damping", "length")

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Numbers that the formulas see."""
        return (n.stiffness, n.damping, separation if n.length is None else n.length)

    def conservative(self) -> bool:
        """Whether its energy is all that it ever takes or gives."""
        return self.damping == 0.0
