"""Lag: first order, with or without a lead."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any

from ..model.controller import Controller, ControlState
from ..model.element import Law, Number, Unit, element, nonnegative, positive


@element
class Lag(Controller):
    """A first-order lag: y / u = gain (1 + lead s) / (1 + time s).

    Without a lead it is a first-order low-pass filter; with a lead greater than the time constant, a lead element.

    Parameters
    ----------
    name : str
    of : expression
        The signal u: an expression of ``t``, parameters, sensors, curves such as ``A.angle``, and controllers.
    time : number [s]
        Time constant of the lag.
    lead : number [s]
        Time constant of the lead; none if 0.
    gain : expression
    initial : number
        Initial value of the lag alone, without gain and lead.
    period, offset : number [s], optional
        It is sampled at offset, offset + period, ...: exact for inputs that are constant between samples.

    Notes
    -----
    With x' = (u - x) / time the output is gain (x + lead/time (u - x)).
    """

    of: Law
    time: Annotated[Number, Unit("s")]
    lead: Annotated[Number, Unit("s")] = 0.0
    gain: Law = 1.0
    initial: Annotated[Number, Unit(None)] = 0.0

    def check(self, n: SimpleNamespace) -> None:
        """Refuse time constants of the wrong sign."""
        super().check(n)
        positive(self, n, "time", why="A signal without delay needs no Lag")
        nonnegative(self, n, "lead")

    def given(self) -> dict[str, Any]:
        """Return input, time constants and gain."""
        return {"of": self.of, "time": self.time, "lead": self.lead, "gain": self.gain, "period": self.period}

    def signals(self) -> dict[str, str]:
        """Return output and input."""
        leads = "" if self.lead == 0.0 else " + lead/time*(input - value)"
        return {"output": f"gain*(value{leads})", "input": "of"}

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Return the lagging state."""
        law = "value + (1 - exp(-period/time))*(input - value)" if self.sampled else "(input - value)/time"
        return (ControlState("value", law, n.initial),)
