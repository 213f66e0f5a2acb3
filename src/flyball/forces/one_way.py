"""OneWay and Ratchet: elements that allow motion in one direction only."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from ..constraints.switches.latches import ONE_WAY, RATCHET
from ..errors import ModelError
from ..model.contact import check_restitution
from ..model.element import Number, Ratio, Unit, element, nonnegative, positive
from ..model.force import Latch, Switch, check_direction

if TYPE_CHECKING:
    from ..model.model import Model


@element
class OneWay(Latch):
    """A freewheel, a sprag or overrunning clutch, a check valve: a coordinate moves in one direction only.

    It overruns freely in its direction and locks without play against it. The locking force acts in this direction
    only; results contain it as ``force``. An impact against the direction has no rebound.

    Parameters
    ----------
    name : str
    coordinate : str
        ``"joint.coordinate"``, or a world coordinate of a body's or frame's origin.
    relative_to : str
        Another coordinate of the same kind: the first minus this one then moves in one direction only. A bicycle's
        freewheel: ``OneWay("freewheel", "wheel.angle", relative_to="sprocket.angle")``.
    direction : 1 or -1
        Whether the value may increase or decrease.

    Notes
    -----
    A result contains ``value`` and ``rate`` of the coordinate (minus the other), the ``force`` along it, and
    ``closed``: 1 while it locks, 0 while it overruns.
    """

    coordinate: str = field(kw_only=False)
    relative_to: str | None = None
    direction: Annotated[Number, Unit("1")] = 1.0

    odd: ClassVar[tuple[str, ...]] = ("direction",)

    def check(self, n: SimpleNamespace) -> None:
        """Require a valid direction."""
        check_direction(self, n.direction.real)

    def switches(self) -> tuple[Switch, ...]:
        """Return one switch along the coordinate or the difference."""
        return (Switch(ONE_WAY, along=self.along(), weighted=True),)


@element
class Ratchet(Latch):
    """A ratchet and its pawl: a coordinate moves freely one way, and back to the last tooth passed.

    The teeth are at ``tooth`` and at multiples of ``pitch`` from there. In reverse it has a play of up to one pitch;
    the pawl stops it at the last tooth passed, with a restitution. The pawl is massless and engages immediately.

    Parameters
    ----------
    name : str
    coordinate : str
        ``"joint.coordinate"``, or a world coordinate of a body's or frame's origin.
    pitch : number [rad] or [m]
        Distance between teeth; or give ``teeth``.
    teeth : number
        Number of teeth of the wheel: the pitch is a full turn divided by it.
    tooth : number [rad] or [m]
        Value of the coordinate at which one tooth rests on the pawl.
    relative_to : str
        Another coordinate of the same kind: the difference of the first and this one then latches.
    direction : 1 or -1
        Whether increasing or decreasing values are free.
    restitution : number [1]
        From 0 (no rebound) to 1 (no energy lost).

    Notes
    -----
    A result contains ``value`` and ``rate`` of the coordinate (minus the other), the ``force`` along it, and
    ``closed``: 1 while the pawl locks, 0 otherwise.
    """

    coordinate: str = field(kw_only=False)
    pitch: Annotated[Number | None, Unit(None)] = None
    teeth: Annotated[Number | None, Unit("1")] = None
    tooth: Annotated[Number, Unit(None)] = 0.0
    relative_to: str | None = None
    direction: Annotated[Number, Unit("1")] = 1.0
    restitution: Ratio = 0.0

    odd: ClassVar[tuple[str, ...]] = ("direction", "tooth")

    dimensions: ClassVar = Latch.dimensions | {"pitch": ("m", "rad"), "tooth": ("m", "rad")}

    def examine(self, model: Model) -> None:
        """Require an angle if ``teeth`` are given."""
        super().examine(model)
        if self.teeth is not None and model.unit(self.coordinate, self) != "rad":
            raise ModelError(f"{self.title}: {self.coordinate!r} does not turn; give pitch= in place of teeth=")

    def check(self, n: SimpleNamespace) -> None:
        """Require a direction and a pitch."""
        check_direction(self, n.direction.real)
        check_restitution(self, n)
        nonnegative(self, n, "restitution")
        positive(self, n, "pitch", "teeth")
        if (n.pitch is None) == (n.teeth is None):
            raise ModelError(f"{self.title}: give pitch= or teeth=, one of them")
        if n.teeth is not None and n.teeth.real != round(n.teeth.real):
            raise ModelError(f"{self.title}: teeth is {n.teeth:g}; a wheel has a whole number of them")

    def pitch_of(self, n: SimpleNamespace) -> Any:
        """Return the distance between teeth [rad] or [m]."""
        return n.pitch if n.teeth is None else 2.0 * np.pi / n.teeth

    def switches(self) -> tuple[Switch, ...]:
        """Return one switch along the coordinate or the difference."""
        return (Switch(RATCHET, along=self.along(), weighted=True),)

    def switched(self, n: SimpleNamespace, label: str, separation: float) -> tuple[float, ...]:
        """Return the position of a tooth, the pitch and the restitution."""
        return n.direction * n.tooth, self.pitch_of(n), n.restitution
