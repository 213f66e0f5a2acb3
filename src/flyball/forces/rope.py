"""Rope: a line over two or more points that pulls and never pushes, elastic or of constant length."""

from __future__ import annotations

import itertools
from dataclasses import field
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator

from ..compiler.formulas import formula
from ..constraints.blocks import DISTANCE, Row
from ..constraints.switch_kinds import ELASTIC, FROZEN, STOP
from ..errors import ModelError
from ..math.scalar import choose, maximum
from ..model.contact import check_restitution
from ..model.element import Damping, Length, Numbers, Ratio, Stiffness, Unit, element, nonnegative
from ..model.force import CoordinateForce, Switch, check_elastic
from ..model.geometry import vector
from ..model.joint import WorldFrame
from .limit import stop_switch_numbers

KIND = 2


@formula
def effort(par, x, rate, laws, load):
    """Along the rope's length x: -max(0, k (x - x_0) + c rate) where it is longer than x_0, else nothing.

    Where it is frozen taut or slack (`constraints.modes.FROZEN`) the formula goes on beyond the corner.
    """
    o = 0.0 * x
    stretch = x - par[2]
    pull = par[0] * stretch + par[1] * rate
    side = laws[2] - FROZEN
    return -choose(side + 1.5, choose(-side, pull, o), choose(stretch, maximum(pull, o), o))


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
    """A rope that runs freely over points of bodies: tension is the same everywhere in it.

    With a stiffness it is elastic: it pulls with k (l - length) + c ldot while it is longer than its free length and
    that is positive, and hangs slack otherwise. Without one it does not stretch: it gets no longer than its length, and
    where it jerks taut at the speed v it goes slack again at ``restitution`` times v. Points between its ends are eyes
    or small pulleys without friction; the same body may come again.

    Parameters
    ----------
    name : str
    bodies : list of str
        Bodies or frames that carry the points, in order: two or more; ``"ground"`` too.
    at : list of points [m]
        The points, in world coordinates of the drawn configuration. Not given: the origins of the frames.
    stiffness : number [N/m]
        Of the whole rope: E A / length. Not given: it does not stretch.
    damping : number [N s/m]
        Of an elastic one.
    length : number [m]
        Free length; the drawn length if not given.
    restitution : number [1]
        Of one that does not stretch, from 0 (it stays taut, and what stands if it is not given) to 1.

    Notes
    -----
    A result tells ``length``, its ``rate``, the ``tension``, and ``taut``: 1 where it pulls, 0 where it hangs slack.
    """

    bodies: tuple[str, ...] = field(kw_only=False)
    at: Points | None = None
    stiffness: Stiffness | None = None
    damping: Damping = 0.0
    length: Length | None = None
    restitution: Ratio | None = None

    kind: ClassVar[int] = KIND
    effort: ClassVar = staticmethod(effort)
    energy: ClassVar = staticmethod(energy)
    sign: ClassVar[float] = -1.0
    outputs: ClassVar[dict[str, str]] = {"length": "m", "rate": "m/s", "tension": "N", "taut": "1"}
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
        check_restitution(self, n)
        check_elastic(self, n, "a rope that does not stretch")
        nonnegative(self, n, "length")

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Numbers that the formulas see."""
        return (n.stiffness, n.damping, self._free(n, separation))

    @staticmethod
    def _free(n: SimpleNamespace, separation: float) -> float:
        return separation if n.length is None else n.length

    def acts(self) -> bool:
        """Whether it is a force: an elastic one."""
        return self.stiffness is not None

    def switches(self) -> tuple[Switch, ...]:
        """One along its length."""
        return (Switch(ELASTIC if self.acts() else STOP, path=self.path(), slides=self.acts()),)

    def switched(self, n: SimpleNamespace, label: str, separation: float) -> tuple[float, ...]:
        """It ends at its length."""
        return stop_switch_numbers(n, None, self._free(n, separation))

    def conservative(self) -> bool:
        """Whether its energy is all that it ever takes or gives."""
        return self.damping == 0.0
