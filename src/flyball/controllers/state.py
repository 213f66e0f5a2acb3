"""State: a number with a differential equation of its own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any

from ..errors import ModelError
from ..model.controller import Controller, ControlState
from ..model.element import Law, Number, Unit, element


@element
class State(Controller):
    """A number x with a differential equation, x' = rate; or sampled, x = next from each instant on.

    Laws name it by its own name; `State` and others may depend on each other in any way. At an instant all sampled
    states step at once: another controller that is sampled there too reads what it was before, and the new value at its
    own next instant, a period later. What has to be known at once is a signal, such as the output of a `StateSpace`
    with ``D``.

    Parameters
    ----------
    name : str
    rate : expression
        Of ``t``, parameters, sensors, curves such as ``A.angle``, controllers, and of itself:
        ``"-x/T + sin(A.angle)"``.
    next : expression
        In place of a rate, with a ``period``: what it is from an instant on, of the same names and what it was before.
    initial : number
        What it begins with.
    period, offset : number [s], optional
        It is sampled at offset, offset + period, ...
    """

    rate: Law | None = None
    next: Law | None = None
    initial: Annotated[Number, Unit(None)] = 0.0

    def check(self, n: SimpleNamespace) -> None:
        """A rate, or a period and what is next."""
        super().check(n)
        wanted, other = ("next", "rate") if self.sampled else ("rate", "next")
        if getattr(self, wanted) is None or getattr(self, other) is not None:
            raise ModelError(f"{self.title}: with a period give next=, without one rate=, and not the other")

    def given(self) -> dict[str, Any]:
        """The rate, or what is next."""
        return {"next": self.next} if self.sampled else {"rate": self.rate}

    def signals(self) -> dict[str, str]:
        """Itself."""
        return {"output": "value"}

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Itself."""
        return (ControlState("value", "next" if self.sampled else "rate", n.initial),)

    @property
    def holds(self) -> bool:
        """It is what it is at instants; several take their next values at once."""
        return False
