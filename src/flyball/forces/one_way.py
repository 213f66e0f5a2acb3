"""OneWay and Ratchet: what moves one way only."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from ..constraints.switch_kinds import ONE_WAY, RATCHET
from ..errors import ModelError
from ..model.contact import check_restitution
from ..model.element import Number, Ratio, Unit, element, nonnegative, positive
from ..model.force import Latch, Switch, check_direction

if TYPE_CHECKING:
    from ..model.model import Model


@element
class OneWay(Latch):
    """A freewheel, a sprag or overrunning clutch, a check valve: a coordinate goes one way only.

    It overruns freely in its direction and holds without any play against it. The holding force pushes in the
    direction only; it is told as ``force``. Where something turns it back suddenly it stops dead.

    Parameters
    ----------
    name : str
    coordinate : str
        ``"joint.coordinate"``, or a world coordinate of a body's or frame's origin.
    relative_to : str
        Another coordinate of the same kind: then it is the first less this one that goes one way. A bicycle's
        freewheel: ``OneWay("freewheel", "wheel.angle", relative_to="sprocket.angle")``.
    direction : 1 or -1
        Whether it may grow or fall.

    Notes
    -----
    A result tells ``value`` and ``rate`` of the coordinate (less the other), the ``force`` along it, and ``closed``: 1
    where it holds, 0 where it overruns.
    """

    coordinate: str = field(kw_only=False)
    relative_to: str | None = None
    direction: Annotated[Number, Unit("1")] = 1.0

    def check(self, n: SimpleNamespace) -> None:
        """A direction."""
        check_direction(self, n.direction.real)

    def switches(self) -> tuple[Switch, ...]:
        """One along the coordinate or the difference."""
        return (Switch(ONE_WAY, along=self.along(), weighted=True),)


@element
class Ratchet(Latch):
    """A ratchet and its pawl: a coordinate goes one way freely, and back to the last tooth that was passed.

    The teeth stand at ``tooth`` and every ``pitch`` from there. Going back, it has a play of up to one pitch; the pawl
    stops it at the last tooth in its way, with a restitution. The pawl itself weighs nothing and falls at once.

    Parameters
    ----------
    name : str
    coordinate : str
        ``"joint.coordinate"``, or a world coordinate of a body's or frame's origin.
    pitch : number [rad] or [m]
        From tooth to tooth; or give ``teeth``.
    teeth : number
        How many stand around the wheel: the pitch is a whole turn by it.
    tooth : number [rad] or [m]
        Value of the coordinate at which one tooth rests on the pawl.
    relative_to : str
        Another coordinate of the same kind: then it is the first less this one that latches.
    direction : 1 or -1
        Whether it goes freely where the value grows or where it falls.
    restitution : number [1]
        From 0 (dead) to 1 (no energy lost).

    Notes
    -----
    A result tells ``value`` and ``rate`` of the coordinate (less the other), the ``force`` along it, and ``closed``: 1
    where the pawl holds, 0 where it does not.
    """

    coordinate: str = field(kw_only=False)
    pitch: Annotated[Number | None, Unit(None)] = None
    teeth: Annotated[Number | None, Unit("1")] = None
    tooth: Annotated[Number, Unit(None)] = 0.0
    relative_to: str | None = None
    direction: Annotated[Number, Unit("1")] = 1.0
    restitution: Ratio = 0.0

    dimensions: ClassVar = Latch.dimensions | {"pitch": ("m", "rad"), "tooth": ("m", "rad")}

    def examine(self, model: Model) -> None:
        """Teeth are counted around what turns."""
        super().examine(model)
        if self.teeth is not None and model.unit(self.coordinate, self) != "rad":
            raise ModelError(f"{self.title}: {self.coordinate!r} does not turn; give pitch= in place of teeth=")

    def check(self, n: SimpleNamespace) -> None:
        """A direction, and teeth a pitch apart."""
        check_direction(self, n.direction.real)
        check_restitution(self, n)
        nonnegative(self, n, "restitution")
        positive(self, n, "pitch", "teeth")
        if (n.pitch is None) == (n.teeth is None):
            raise ModelError(f"{self.title}: give pitch= or teeth=, one of them")
        if n.teeth is not None and n.teeth.real != round(n.teeth.real):
            raise ModelError(f"{self.title}: teeth is {n.teeth:g}; a wheel has a whole number of them")

    def pitch_of(self, n: SimpleNamespace) -> Any:
        """From tooth to tooth [rad] or [m]."""
        return n.pitch if n.teeth is None else 2.0 * np.pi / n.teeth

    def switches(self) -> tuple[Switch, ...]:
        """One along the coordinate or the difference."""
        return (Switch(RATCHET, along=self.along(), weighted=True),)

    def switched(self, n: SimpleNamespace, label: str, separation: float) -> tuple[float, ...]:
        """A tooth, the pitch, the restitution."""
        return n.direction * n.tooth, self.pitch_of(n), n.restitution
