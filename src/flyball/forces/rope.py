"""Rope: a line over two or more points that can pull but not push, elastic or inextensible."""

from __future__ import annotations

import itertools
from dataclasses import field, replace
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator

from ..compiler.formulas import formula
from ..constraints.blocks import DISTANCE, Row
from ..constraints.switches.elastic_stop import ELASTIC
from ..constraints.switches.stop import STOP
from ..constraints.switches.switch_kind import FROZEN
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
    """Return the effort along the rope's length x: -max(0, k (x - x_0) + c rate) if longer than x_0, else zero.

    While its state is fixed as taut or slack (`switch_kind.FROZEN`), the formula is continued smoothly beyond the
    corner.
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


_WORDS = {"closing": ("taut", "goes taut"), "opening": ("slack", "goes slack"), "states": ("taut", "slack")}
RIGID_ROPE, ELASTIC_ROPE = replace(STOP, **_WORDS), replace(ELASTIC, **_WORDS)  # type: ignore[arg-type]
Points = Annotated[tuple[Numbers, ...], BeforeValidator(_list), Unit("m")]


@element
class Rope(CoordinateForce):
    """A rope that runs without friction over points of bodies: the tension is the same everywhere.

    With a stiffness it is elastic: the tension is k (l - length) + c ldot while the rope is longer than its free length
    and this is positive; otherwise it is slack. Without a stiffness it is inextensible: when it becomes taut at the
    speed v it rebounds at ``restitution`` times v. Intermediate points are frictionless eyes or small pulleys; a body
    may occur more than once.

    Parameters
    ----------
    name : str
    bodies : list of str
        Bodies or frames with the points, in order, two or more; ``"ground"`` is the world.
    at : list of points [m]
        The points, in world coordinates of the drawn configuration. Not given: the origins of the frames.
    stiffness : number [N/m]
        Of the whole rope: E A / length. If not given, the rope is inextensible.
    damping : number [N s/m]
        Of an elastic rope.
    length : number [m]
        Free length; that in the reference configuration if not given.
    restitution : number [1]
        Of an inextensible rope, from 0 (it stays taut; the default) to 1.

    Notes
    -----
    A result contains ``length``, its ``rate``, the ``tension``, and ``taut``: 1 if taut, 0 if slack.
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
    symbol: ClassVar[str] = "rope"
    single: ClassVar[str] = "rope"
    fails: ClassVar[str] = "Two neighbouring points of it coincide, where the rope between them has no direction"

    def ends(self) -> dict[str, str]:
        """Return one frame for each point."""
        return {f"P{k}": name for k, name in enumerate(self.bodies)}

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame] | None:
        """Return the points in the reference configuration."""
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
        """Return the terms: the distance from each point to the next."""
        return tuple((f"P{k}", f"P{k + 1}", DISTANCE) for k in range(len(self.bodies) - 1))

    def check(self, n: SimpleNamespace) -> None:
        """Require enough points, and valid constants."""
        if len(self.bodies) < 2:
            raise ModelError(f"{self.title}: a rope has two ends at least, got bodies {self.bodies}; name the second")
        if n.at is not None and len(n.at) != len(self.bodies):
            raise ModelError(f"{self.title}: {len(self.bodies)} bodies need as many points in 'at', got {len(n.at)}")
        check_restitution(self, n)
        check_elastic(self, n, "a rope that does not stretch")
        nonnegative(self, n, "length")

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        return (n.stiffness, n.damping, self._free(n, separation))

    @staticmethod
    def _free(n: SimpleNamespace, separation: float) -> float:
        return separation if n.length is None else n.length

    def acts(self) -> bool:
        """Return whether it acts as a force: it does if it is elastic."""
        return self.stiffness is not None

    def switches(self) -> tuple[Switch, ...]:
        """Return one switch along its length."""
        return (Switch(ELASTIC_ROPE if self.acts() else RIGID_ROPE, path=self.path(), slides=self.acts()),)

    def switched(self, n: SimpleNamespace, label: str, separation: float) -> tuple[float, ...]:
        """Return the bounds: its length is the upper one."""
        return stop_switch_numbers(n, None, self._free(n, separation))

    def conservative(self) -> bool:
        """Return whether it has no damping, so that it only exchanges stored energy."""
        return self.damping == 0.0
