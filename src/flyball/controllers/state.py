"""State: a number with a user-defined differential or difference equation."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any

from ..errors import ModelError
from ..model.controller import Controller, ControlState
from ..model.element import Law, Number, Unit, element


@element
class State(Controller):
    """A number x with a differential equation, x' = rate; or sampled, x = next from each instant on.

    Laws refer to it by its name; states may depend on each other and on other controllers in any way. At a sampling
    instant all sampled states are updated simultaneously: another controller that is sampled at the same instant reads
    the old value, and the new one at its own next instant, a period later. A value that must be available immediately
    is a signal, such as the output of a `StateSpace` with ``D``.

    Parameters
    ----------
    name : str
    rate : expression
        An expression of ``t``, parameters, sensors, curves such as ``A.angle``, controllers, and of itself: ``"-x/T +
        sin(A.angle)"``.
    next : expression
        In place of a rate, with a ``period``: its value from an instant on, an expression of the same names and of its
        old value.
    initial : number
        Initial value.
    period, offset : number [s], optional
        It is sampled at offset, offset + period, ...
    """

    rate: Law | None = None
    next: Law | None = None
    initial: Annotated[Number, Unit(None)] = 0.0

    def check(self, n: SimpleNamespace) -> None:
        """Require either a rate, or a period and ``next``."""
        super().check(n)
        wanted, other = ("next", "rate") if self.sampled else ("rate", "next")
        if getattr(self, wanted) is None or getattr(self, other) is not None:
            raise ModelError(f"{self.title}: with a period give next=, without one rate=, and not the other")

    def given(self) -> dict[str, Any]:
        """Return the rate or the next value."""
        return {"next": self.next} if self.sampled else {"rate": self.rate}

    def signals(self) -> dict[str, str]:
        """Return the state itself."""
        return {"output": "value"}

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Return the state itself."""
        return (ControlState("value", "next" if self.sampled else "rate", n.initial),)

    @property
    def holds(self) -> bool:
        """It is updated only at sampling instants, where several states take their next values simultaneously."""
        return False
