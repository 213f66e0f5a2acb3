"""Rope: a line over two or more points that can pull but not push, elastic or inextensible."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import ClassVar

from ..compiler.formulas import formula
from ..constraints.switches.elastic_stop import ELASTIC
from ..constraints.switches.stop import STOP
from ..constraints.switches.switch_kind import FROZEN
from ..math.scalar import choose, maximum
from ..model.contact import check_restitution
from ..model.element import Damping, Length, Ratio, Stiffness, element, nonnegative
from ..model.force import PathForce, Switch, check_elastic
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


_WORDS = {"closing": ("taut", "goes taut"), "opening": ("slack", "goes slack"), "states": ("taut", "slack")}
RIGID_ROPE, ELASTIC_ROPE = replace(STOP, **_WORDS), replace(ELASTIC, **_WORDS)  # type: ignore[arg-type]


@element
class Rope(PathForce):
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

    stiffness: Stiffness | None = None
    damping: Damping = 0.0
    length: Length | None = None
    restitution: Ratio | None = None

    kind: ClassVar[int] = KIND
    effort: ClassVar = staticmethod(effort)
    energy: ClassVar = staticmethod(energy)
    outputs: ClassVar[dict[str, str]] = {"length": "m", "rate": "m/s", "tension": "N", "taut": "1"}
    single: ClassVar[str] = "rope"

    def check(self, n: SimpleNamespace) -> None:
        """Require enough points, and valid constants."""
        super().check(n)
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
