"""Sensors, and what every controller declares: states of its own, signals that laws may name, and its inputs.

A controller is described by formulas in the language of laws, whose names are those of its own states, its own
signals and its inputs. A state of a continuous controller has a rate, one of a sampled controller a next value. A
sampled controller holds its signals from one instant to the next: to laws they are states, too.
"""

from __future__ import annotations

import keyword
from abc import ABC, abstractmethod
from dataclasses import KW_ONLY, dataclass, field
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, NamedTuple

from ..errors import ModelError
from .element import Element, Number, Unit, element, positive


@element
class Sensor(Element):
    """A measured quantity with a name of its own.

    Positions, angles, lengths and their rates may be named in the laws of forces; positions, angles and lengths in
    those of drivers too. Whatever depends on accelerations (reactions, accelerations themselves) is an output only.
    Sampling never forces the integrator to a step.

    Parameters
    ----------
    name : str
        Its name in results and in laws.
    of : str
        What it measures, a curve of the result: ``"A.angle"``, ``"A.rate"``, ``"tip.y"``, ``"tip.vy"``,
        ``"spring.length"``, ``"A.fx"``, ``"energy.kinetic"``.
    """

    of: str = field(kw_only=False)

    category: ClassVar[str] = "sensors"

    def ends(self) -> dict[str, str]:
        """It has no frame of its own."""
        return {}


@element
class IMU(Element):
    """An inertial measurement unit fixed on a body: what accelerometers and gyroscopes in it would show.

    Its curves are the specific force ``fx``, ``fy``, ``fz`` [m/s^2] (acceleration of its origin less gravity) and the
    angular velocity ``wx``, ``wy``, ``wz`` [rad/s], both along its own axes. In the plane: ``fx``, ``fy``, ``w``.

    Parameters
    ----------
    name : str
    frame : str
        Body or frame that it is fixed to; it has its origin and axes.
    """

    frame: str = field(kw_only=False)

    category: ClassVar[str] = "sensors"

    def ends(self) -> dict[str, str]:
        """At the frame."""
        return {"M": self.frame}


OUTPUT = "output"
"""What a single output is called if nobody names it."""


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
    compared: ClassVar[tuple[str, ...]] = ()
    """Signals that pictures show beside one another: what is to be followed, and what follows."""

    @property
    def sampled(self) -> bool:
        """Whether it acts at instants: offset, offset + period, offset + 2 period, ..."""
        return self.period is not None

    @property
    def output_names(self) -> tuple[str, ...]:
        """Those of its signals that it is there for."""
        return (OUTPUT,)

    @property
    def bare(self) -> str:
        """The signal that the bare name stands for: its output; none where there are several."""
        return self.output_names[0] if len(self.output_names) == 1 else ""

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

    def unlimited(self) -> Controller:
        """The same without limits of its output; itself where it has none."""
        return self

    def smoother(self, state: str) -> str:
        """What to give instead where the rate of a state jumps by what this controller is; empty: laws of the user."""
        return ""

    @abstractmethod
    def given(self) -> dict[str, Any]:
        """Laws of the user's by the names that formulas know them by: inputs, gains, limits."""

    def called(self, given: str) -> str:
        """What messages call something that it is given."""
        return "input" if given == "of" else given

    @abstractmethod
    def signals(self) -> dict[str, str]:
        """Name of each signal -> its formula, outputs first."""

    @abstractmethod
    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Its states; ``n`` holds the resolved fields."""


def numbered_names(letter: str, count: int) -> tuple[str, ...]:
    """Names of so many states or signals: x1, x2; of one only the letter."""
    return (letter,) if count == 1 else tuple(f"{letter}{k + 1}" for k in range(count))


def refuse_equal(e: Controller, names: Any) -> None:
    """Refuse states and signals of one name, and names that are no plain words."""
    seen: set[str] = set()
    for name in names:
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
            raise ModelError(f"{e.title}: {name!r} is no plain name for a signal; use letters, digits and _")
        if name in seen:
            raise ModelError(f"{e.title}: two of its signals or states are called {name!r}; name them differently")
        seen.add(name)
