"""Integrator: the integral of a signal over time."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any

from ..model.controller import Controller, ControlState
from ..model.element import Law, Number, Unit, element


@element
class Integrator(Controller):
    """The integral of a signal over time, y' = gain u.

    Parameters
    ----------
    name : str
    of : expression
        The signal u: an expression of ``t``, parameters, sensors, curves such as ``A.angle``, and controllers.
    gain : expression
    initial : number
        Initial value of the integral.
    period, offset : number [s], optional
        It is sampled at offset, offset + period, ...: y + period gain u from the next instant on (Euler's rule).
    """

    of: Law
    gain: Law = 1.0
    initial: Annotated[Number, Unit(None)] = 0.0

    def given(self) -> dict[str, Any]:
        """Return input and gain."""
        return {"of": self.of, "gain": self.gain, "period": self.period}

    def signals(self) -> dict[str, str]:
        """Return the integral, and the integrand."""
        return {"output": "value", "input": "of"}

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Return the integral."""
        law = "value + period*gain*input" if self.sampled else "gain*input"
        return (ControlState("value", law, n.initial),)
