"""For which parameters equations about a point hold: there the loops close, and the forces balance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...errors import ModelError
from ...graph.node import Node
from .balance import BALANCED
from .size import sizes

CLOSED = 1e-7  # of the terms of a constraint: what may be left of it


@dataclass(frozen=True)
class Validity:
    """What has to vanish at a point, as expressions of the parameters.

    Attributes
    ----------
    forces : sequence of Node
        Forces along the free coordinates.
    loops : sequence of Node
        Constraints.
    """

    forces: Sequence[Node] = ()
    loops: Sequence[Node] = ()

    def refuse(self, name: str, values: Mapping[str, float]) -> None:
        """Refuse values of parameters for which the point is another one.

        Raises
        ------
        ModelError
            With what is left.
        """
        told = ", ".join(f"{k} = {x:g}" for k, x in values.items())
        remedy = (
            "give the others that go with it, or make the equations about the point that belongs to them: "
            "symbolic(parameters=...), linear(at=m.equilibrium(parameters=...))"
        )
        if _left(self.loops, values, CLOSED) is not None:
            raise ModelError(
                f"with {told} the loops of {name!r} do not close at the point that these equations are about, whose "
                f"coordinates are numbers; {remedy}"
            )
        left = _left(self.forces, values, BALANCED)
        if left is not None:
            raise ModelError(
                f"with {told} {name!r} is in no equilibrium at the point that these equations are about: {left:.6g} N "
                f"or N m are left; {remedy}, or name a parameter that balances: balanced_by=[...]"
            )


def _left(nodes: Sequence[Node], values: Mapping[str, float], part: float) -> float | None:
    """What does not vanish, beyond rounding and what is left with the parameters' own values."""
    if not values or not nodes:
        return None
    here, own = sizes(nodes, values), sizes(nodes)
    most = max(size for _, size in here)
    for (x, size), (before, _) in zip(here, own, strict=True):
        if not abs(x) <= part * (size + 1e-3 * most) + 2.0 * abs(before):
            return x
    return None
