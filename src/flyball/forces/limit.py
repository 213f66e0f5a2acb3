"""Limit: stops of a coordinate, rigid or elastic."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import Annotated, ClassVar

import numpy as np

from ..compiler.formulas import formula
from ..constraints.switches.elastic_stop import ELASTIC
from ..constraints.switches.stop import STOP
from ..constraints.switches.switch_kind import FROZEN
from ..errors import ModelError
from ..math.scalar import choose, maximum
from ..model.contact import check_restitution
from ..model.element import Coordinates, Number, Numbers, Ratio, Unit, element
from ..model.force import Switch, Unilateral, WeightedSumForce, check_elastic

KIND = 8


@formula
def effort(par, x, rate, laws, load):
    """Effort along x: max(0, k (lower - x) - c rate) below the lower stop, -max(0, k (x - upper) + c rate) above upper.

    A side without a stop has k = c = 0. While a side is fixed (`switch_kind.FROZEN`), its formula is continued
    smoothly beyond the corner.
    """
    o = 0.0 * x
    below, above = par[4] - x, x - par[5]
    low, high = par[0] * below - par[1] * rate, par[2] * above + par[3] * rate
    pushed = choose(below, maximum(low, o), o) - choose(above, maximum(high, o), o)
    side = laws[2] - FROZEN
    return choose(side + 1.5, choose(side, low, choose(-side, -high, o)), pushed)


@formula
def energy(par, x):
    """Return the potential energy k d^2 / 2 [J], where d is the overrun of either stop."""
    o = 0.0 * x
    below, above = maximum(par[4] - x, o), maximum(x - par[5], o)
    return 0.5 * (par[0] * below * below + par[2] * above * above)


def stop_parameters(n: SimpleNamespace, lower: float | None, upper: float | None) -> tuple[float, ...]:
    """Return the parameters of the formulas: stiffness and damping of either side, and their positions."""
    out: list[float] = []
    for side in (lower, upper):
        out += (0.0, 0.0) if side is None else (n.stiffness, n.damping)
    return (*out, 0.0 if lower is None else lower, 0.0 if upper is None else upper)


def stop_switch_numbers(n: SimpleNamespace, lower: float | None, upper: float | None) -> tuple[float, ...]:
    """Return the numbers of its switch: least and greatest value, restitution, stiffness, damping."""
    bounds = -np.inf if lower is None else lower, np.inf if upper is None else upper
    elastic = (0.0, 0.0) if n.stiffness is None else (n.stiffness, n.damping)
    return (*bounds, 0.0 if n.restitution is None else n.restitution, *elastic)


@element
class Limit(WeightedSumForce, Unilateral):
    """Stops of a coordinate: it stays between ``lower`` and ``upper``.

    A rigid stop reflects an impact at the speed v with ``restitution`` times v. An elastic stop (``stiffness``) pushes
    back with k d + c ddot at the depth d while this is positive: it never pulls.

    Parameters
    ----------
    name : str
    coordinate : str or list of str
        ``"joint.coordinate"`` such as ``"knee.angle"``, or a world coordinate of a body's or frame's origin such as
        ``"slider.x"``. With ``weights`` a list: the stops are those of the sum.
    weights : list of numbers
        One for each of several coordinates; the first without unit, so that the sum has the first coordinate's unit.
    lower, upper : number [rad] or [m]
        Least and greatest value; no stop on a side that is not given. Equal ones lock the coordinate there: the force
        is that of a lock, in either direction.
    restitution : number [1]
        Of a rigid stop, from 0 (no rebound; the default) to 1 (no energy lost).
    stiffness : number [N/m] or [N m/rad]
        Stiffness of the stops; makes them elastic.
    damping : number [N s/m] or [N m s/rad]
        Of elastic stops.

    Notes
    -----
    A result contains ``value``, ``rate``, the ``force`` along the coordinate (positive towards larger values),
    and ``closed``: 1 at the lower stop, -1 at the upper, 0 between. ``run.events`` lists each hit.
    """

    coordinate: Coordinates = field(kw_only=False)
    lower: Annotated[Number | None, Unit(None)] = None
    upper: Annotated[Number | None, Unit(None)] = None
    restitution: Ratio | None = None
    stiffness: Annotated[Number | None, Unit(None)] = None
    damping: Annotated[Number, Unit(None)] = 0.0
    weights: Annotated[Numbers | None, Unit(None)] = None

    kind: ClassVar[int] = KIND
    effort: ClassVar = staticmethod(effort)
    energy: ClassVar = staticmethod(energy)
    dimensions: ClassVar = Unilateral.dimensions | {"lower": ("m", "rad"), "upper": ("m", "rad")}

    def check(self, n: SimpleNamespace) -> None:
        """Require at least one stop, rigid or elastic."""
        self.check_weights_given(n)
        check_restitution(self, n)
        check_elastic(self, n)
        if self.lower is None and self.upper is None:
            raise ModelError(f"{self.title}: it stops nothing; give lower=..., upper=... or both")

    def check_range(self, n: SimpleNamespace, unit: str) -> None:
        """Require that the lower stop is not above the upper one."""
        if n.lower is not None and n.upper is not None and not n.lower.real <= n.upper.real:
            raise ModelError(
                f"{self.title}: lower is {n.lower:g} {unit}; it must not be greater than upper, {n.upper:g} {unit}"
            )

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        return stop_parameters(n, n.lower, n.upper)

    def switches(self) -> tuple[Switch, ...]:
        """Return one switch along the coordinate or sum."""
        kind = ELASTIC if self.acts() else STOP
        return (Switch(kind, along=self.along(), slides=self.acts(), weighted=self.is_weighted()),)

    def switched(self, n: SimpleNamespace, label: str, separation: float) -> tuple[float, ...]:
        """Return the bounds, and the properties of the stops."""
        return stop_switch_numbers(n, n.lower, n.upper)
