"""Sensors and the base class of controllers: states, signals that laws may name, and inputs.

A controller is described by formulas in the language of laws, whose names are those of its own states, its own signals
and its inputs. A state of a continuous controller has a rate, one of a sampled controller a next value. The signals of
a sampled controller are constant between instants: laws treat them as states, too.
"""

from __future__ import annotations

import keyword
from dataclasses import KW_ONLY, dataclass, field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

from ..errors import ModelError
from .element import Element, Number, Unit, element, positive

if TYPE_CHECKING:
    from .expression_parser import SyntaxNode
    from .model import Model


@element
class Sensor(Element):
    """A measured quantity with a name of its own.

    Positions, angles, lengths and their rates may be named in the laws of forces; positions, angles and lengths in
    those of drivers too. Quantities that depend on accelerations (reactions, accelerations themselves) are outputs
    only. Sensors never limit the integrator's steps.

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
    """An inertial measurement unit fixed on a body: the readings of accelerometers and gyroscopes.

    Its curves are the specific force ``fx``, ``fy``, ``fz`` [m/s^2] (acceleration of its origin minus gravity) and the
    angular velocity ``wx``, ``wy``, ``wz`` [rad/s], both along its own axes. In the plane: ``fx``, ``fy``, ``w``.

    Parameters
    ----------
    name : str
    frame : str
        Body or frame to which it is fixed, with the frame's origin and axes.
    """

    frame: str = field(kw_only=False)

    category: ClassVar[str] = "sensors"

    def ends(self) -> dict[str, str]:
        """At the frame."""
        return {"M": self.frame}


class FunctionWithMemory:
    """Function in laws of controllers that depends on its earlier calls in a motion; it is called back, never compiled.

    Attributes
    ----------
    memory : object
        ``memory.motion()`` is a context manager in which one motion is computed. Functions with equal memories share
        it.
    """

    memory: Any


OUTPUT = "output"
"""Default name of a single output."""


class ControlState(NamedTuple):
    """One state variable of a controller.

    Attributes
    ----------
    name : str
    law : str
        Formula of its rate; of a sampled controller, of the value from the next sample on.
    initial : float
        Initial value, from the fields ``n`` of `Controller.states`.
    """

    name: str
    law: str
    initial: Any = 0.0


@dataclass(frozen=True)
class Controller(Element):
    """Base class of controllers, whose signals laws of forces and motors, and expressions of events, may name.

    ``pid`` is the output of the controller of that name, ``pid.error`` another signal, ``pid.integral`` a state.
    """

    _: KW_ONLY

    period: Annotated[Number | None, Unit("s")] = None
    offset: Annotated[Number, Unit("s")] = 0.0

    category: ClassVar[str] = "controllers"
    compared: ClassVar[tuple[str, ...]] = ()
    """Signals that plots show together: reference and response."""

    @property
    def sampled(self) -> bool:
        """Return whether it is sampled: it then acts at offset, offset + period, offset + 2 period, ..."""
        return self.period is not None

    @property
    def output_names(self) -> tuple[str, ...]:
        """Return the names of its output signals."""
        return (OUTPUT,)

    @property
    def bare(self) -> str:
        """Return the signal that the controller's bare name means: its output; empty if there are several."""
        return self.output_names[0] if len(self.output_names) == 1 else ""

    @property
    def holds(self) -> bool:
        """Return whether its signals are constant between instants; otherwise they follow from its states."""
        return self.sampled

    def ends(self) -> dict[str, str]:
        """It has no frame."""
        return {}

    def check(self, n: SimpleNamespace) -> None:
        """Refuse invalid sampling instants."""
        positive(self, n, "period")
        if n.period is None and n.offset != 0.0:
            raise ModelError(f"{self.title}: offset does nothing without period; leave it out")

    def ordered(self) -> tuple[str, str] | None:
        """Return two of its inputs, the first of which must not exceed the second; otherwise there is no output."""
        return None

    def unlimited(self) -> Controller:
        """Return the controller without limits of its output; itself if it has none."""
        return self

    def examine(self, model: Model) -> None:
        """Refuse parts of the mechanism that it needs and that do not exist."""

    def smoother(self, state: str) -> str:
        """Return the remedy if the controller itself makes the rate of a state jump; empty if only user laws can."""
        return ""

    def given(self) -> dict[str, Any]:
        """Return the user's laws by the names that the formulas use: inputs, gains, limits."""
        raise NotImplementedError

    def derived(self, name: str, wiring: Any) -> SyntaxNode | None:
        """Return what a name of its formulas means that is neither an input nor a signal; None: a name of laws.

        ``wiring`` substitutes formulas: ``wiring.template(self, text)``, for the mechanism ``wiring.model``.
        """
        return None

    def called(self, given: str) -> str:
        """Return the name of an input for messages."""
        return "input" if given == "of" else given

    def signal_units(self) -> dict[str, str]:
        """Return the SI units of those signals and states whose units are known."""
        return {}

    def signals(self) -> dict[str, str]:
        """Return the formulas of the signals by name, outputs first."""
        raise NotImplementedError

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Return its states; ``n`` contains the resolved fields."""
        raise NotImplementedError


def numbered_names(letter: str, count: int) -> tuple[str, ...]:
    """Return names of states or signals: x1, x2, ...; for a single one only the letter."""
    return (letter,) if count == 1 else tuple(f"{letter}{k + 1}" for k in range(count))


def refuse_equal(e: Controller, names: Any) -> None:
    """Refuse states and signals of equal names, and names that are not plain words."""
    seen: set[str] = set()
    for name in names:
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
            raise ModelError(f"{e.title}: {name!r} is no plain name for a signal; use letters, digits and _")
        if name in seen:
            raise ModelError(f"{e.title}: two of its signals or states are called {name!r}; name them differently")
        seen.add(name)
