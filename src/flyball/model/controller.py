"""What every controller declares: states of its own, signals that laws may name, and what it is given.

A controller is described by formulas in the language of the laws, whose names are those of its own states, of its own
signals and of what it is given. A state of a continuous controller has a rate, one of a sampled controller a next
value. A sampled controller holds its signals from one instant to the next: to laws they are states, too.
"""

from __future__ import annotations

import keyword
from abc import ABC, abstractmethod
from dataclasses import KW_ONLY, dataclass
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, NamedTuple

from ..errors import ModelError
from .element import Element, Number, Unit, positive

OUTPUT = "output"
"""The signal that the bare name of a controller stands for, if it has one of that name."""


class ControlState(NamedTuple):
    """One number that a controller keeps.

    Attributes
    ----------
    name : str
    law : str
        Formula of its rate; of a sampled controller, of the value from the next sample on.
    initial : float
        What it begins with, a number in ``n`` of `Controller.states`.
    """

    name: str
    law: str
    initial: Any = 0.0


@dataclass(frozen=True)
class Controller(Element, ABC):
    """A controller: what laws of forces and motors, and expressions of events, may name.

    ``pid`` is the output of the controller of that name, ``pid.error`` another signal, ``pid.integral`` a state.
    """

    _: KW_ONLY

    period: Annotated[Number | None, Unit("s")] = None
    offset: Annotated[Number, Unit("s")] = 0.0

    category: ClassVar[str] = "controllers"

    @property
    def sampled(self) -> bool:
        """Whether it acts at instants: offset, offset + period, offset + 2 period, ..."""
        return self.period is not None

    @property
    def holds(self) -> bool:
        """Whether it holds its signals from one instant to the next; if not they follow from its states."""
        return self.sampled

    def ends(self) -> dict[str, str]:
        """It has no frame."""
        return {}

    def check(self, n: SimpleNamespace) -> None:
        """Refuse instants that are none."""
        positive(self, n, "period")
        if n.period is None and n.offset != 0.0:
            raise ModelError(f"{self.title}: offset does nothing without period; leave it out")

    def ordered(self) -> tuple[str, str] | None:
        """Two of what it is given of which the first must not exceed the second; it has no output where it does."""
        return None

    @abstractmethod
    def given(self) -> dict[str, Any]:
        """Laws of the user's by the names that formulas know them by: inputs, gains, limits."""

    @abstractmethod
    def signals(self) -> dict[str, str]:
        """Name of each signal -> its formula, outputs first."""

    @abstractmethod
    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Its states; ``n`` holds the resolved fields."""


def numbered(letter: str, count: int) -> tuple[str, ...]:
    """Names of so many states or signals: x1, x2; of one only the letter."""
    return (letter,) if count == 1 else tuple(f"{letter}{k + 1}" for k in range(count))


def naming(e: Controller, name: str) -> str:
    """What messages call something of a controller by the name that its formulas have for it: what it is given, a
    signal or a state.
    """
    letter, _, place = name.partition("_")
    if name == "of":
        name = "input"
    elif letter == "u" and place.isdigit():
        name = f"input {int(place) + 1}"
    elif len(letter) == 1 and (places := place.split("_")) and all(x.isdigit() for x in places):
        name = f"{letter}[{', '.join(places)}]"
    elif letter in ("num", "den") and place.isdigit():
        name = f"{letter}[{place}]"
    return f"{name} of {e.title}"


def refuse_equal(e: Controller, names: Any) -> None:
    """Refuse states and signals of one name, and names that are no plain words."""
    seen: set[str] = set()
    for name in names:
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
            raise ModelError(f"{e.title}: {name!r} is no plain name for a signal; use letters, digits and _")
        if name in seen:
            raise ModelError(f"{e.title}: two of its signals or states are called {name!r}; name them differently")
        seen.add(name)
