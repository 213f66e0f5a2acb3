"""State: a number with a differential equation of its own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any

from ..model.controller import Controller, ControlState
from ..model.element import Law, Number, Unit, element


@element
class State(Controller):
    """A number x with a differential equation: x' = rate.

    Laws name it by its own name; `State` and others may depend on each other in any way.

    Parameters
    ----------
    name : str
    rate : expression
        Of ``t``, parameters, sensors, curves such as ``A.angle``, controllers, and of itself:
        ``"-x/T + sin(A.angle)"``.
    initial : number
        What it begins with.
    """

    rate: Law
    initial: Annotated[Number, Unit(None)] = 0.0

    def given(self) -> dict[str, Any]:
        """The rate."""
        return {"rate": self.rate}

    def signals(self) -> dict[str, str]:
        """Itself."""
        return {"output": "value"}

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Itself."""
        return (ControlState("value", "rate", n.initial),)
