"""What results say of a motion, as expressions: the results' own formulas, run on one instant of symbols."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import AnalysisError, ModelError
from ..graph.arrays import objects
from ..graph.node import Undecided
from ..model.quantities import ENERGY
from ..results.result import Result
from ..tables.system import FREE
from .expressions import Expressions

if TYPE_CHECKING:
    from .equations import Equations


class Quantities:
    """A motion at one instant, of symbols."""

    def __init__(self, equations: Equations) -> None:
        self.equations = equations
        x = equations.formulated
        T = x.traced
        rows = [_row(a) for a in ([T.t], x.own_q, T.v, T.z, x.vdot, T.lam)]
        t, q, v, z, vdot, lam = rows
        self.result = Result(equations.model, x.values, t[0], q, v, z, vdot, lam, health=None)  # type: ignore[arg-type]

    def quantity(self, name: str) -> Expressions:
        """A quantity of a part, by its name in results."""
        owner, dot, what = name.partition(".")
        if not dot:
            what = "value"
        self._refuse(owner, what)
        if what == "quaternion":
            return self._quaternion(owner)
        if what == "power" and (found := self._power(owner)) is not None:
            return found
        try:
            with np.errstate(invalid="ignore"):  # formulas say nan where something has no value, and mean it
                unit, values = self.result.channel(f"{owner}.{what}")
        except Undecided as error:
            raise AnalysisError(f"{name!r} has no expression: {error}") from error
        return self._of(values, unit)

    def reaction(self, joint: str, axes: str, on: str | None) -> tuple[Expressions, Expressions]:
        """Force and torque of a joint."""
        with np.errstate(invalid="ignore"):  # formulas say nan where something has no value, and mean it
            force, torque = self.result[joint].reaction(axes=axes, on=on)
        return self._of(force, "N"), self._of(torque, "N*m")

    def _of(self, values: Any, unit: str) -> Expressions:
        cleaned = self.equations.formulated.cleaned(np.asarray(values, object))
        one = cleaned[0] if cleaned.ndim else cleaned[()]
        return Expressions(self.equations, one, unit=unit)

    def _refuse(self, owner: str, what: str) -> None:
        if what == "work":
            raise ModelError(f"'{owner}.work' is an integral along the motion, no function of the state")
        if owner == ENERGY and what == "balance":
            raise ModelError("'energy.balance' compares with the start of a motion; it is no function of the state")

    def _quaternion(self, owner: str) -> Expressions:
        """Of a body that hangs freely: its coordinates."""
        x = self.equations.formulated
        b = x.values.structure.place.get(owner, -1)
        S = x.values.system
        if b < 0 or S.tree.joint[b] != FREE:
            instead = f"{owner}.angle" if x.values.structure.model.planar else f"{owner}.rotation"
            more = "" if x.values.structure.model.planar or b < 0 else ", or coordinates='absolute'"
            raise ModelError(f"the quaternion of {owner!r} is no coordinate here: take {instead!r}{more}")
        e = [x.named[f"{owner}.e{k}"] for k in range(4)]
        return Expressions(self.equations, objects(e), [n.data.name for n in e], unit="1")

    def _power(self, owner: str) -> Expressions | None:
        """Of a driver: its effort times the rate that it asks for."""
        x = self.equations.formulated
        s, T = x.values.structure, x.traced
        if owner not in {d.name for d in s.model.drivers}:
            return None
        k = s.slices[owner].start
        return self._of(np.array([T.lam[k] * T.nu[k]], object), "W")


def _row(x: list[Any]) -> np.ndarray:
    """One instant, an array (1, n) of objects."""
    out = np.empty((1, len(x)), object)
    out[0, :] = x
    return out
