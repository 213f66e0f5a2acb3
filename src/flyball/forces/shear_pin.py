"""ShearPin: a connection along a coordinate that breaks when its force exceeds its strength."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, ClassVar

from ..constraints.switches.switch_kind import G_HOLDS, INTERVAL, Instant, ProblemRow, SwitchKind
from ..model.element import Number, Unit, element, positive
from ..model.force import Switch, Unilateral, check_same_kind
from ..numerics.complementarity.dense_problem import AT_REST, FRICTION_LINE

if TYPE_CHECKING:
    from ..model.model import Model


class PinConnection(SwitchKind):
    """A row that holds its quantity up to a force, and never again after that."""

    def acceleration_rows(self, n: Instant, s: int, at: tuple[float, ...], still: bool) -> list[ProblemRow]:
        """Return its row if the quantity is at rest; impulses have none, so an impact across the pin breaks it."""
        strength = float(n.S.switch_numbers.strength[s])
        return [ProblemRow(s, FRICTION_LINE, const=strength, state=AT_REST)] if still else []

    def start_violation(self, n: Instant, s: int) -> float:
        """Return the speed across the pin, as a displacement at the mechanism's own rate."""
        return float(abs(n.rate[s]) / n.characteristic_rate)

    def push_direction(self, x: float, bounds: tuple[float, float], near: float) -> float:
        """Return 0: it holds either way."""
        return 0.0


SHEAR_PIN = PinConnection(
    guards=(G_HOLDS,), forces=INTERVAL, permanent=True, numbers=("strength",), role="is pinned",
    opening=("break", "breaks"), states=("intact", "broken"),
)  # fmt: skip


@element
class ShearPin(Unilateral):
    """A shear pin, a breakaway bolt, a mechanical fuse: it holds a coordinate until it breaks, and then does nothing.

    It keeps the coordinate, or its difference from another one, at its value at the start. It breaks when the force
    along it exceeds the strength, and stays broken. A rigid pin cannot carry an impulse: it breaks in an impact that
    changes the velocity across it.

    Parameters
    ----------
    name : str
    coordinate : str
        ``"joint.coordinate"``, or a world coordinate of a body's or frame's origin.
    relative_to : str
        Another coordinate of the same kind: the pin connects the two. The hub and the shaft of a propeller:
        ``ShearPin("pin", "hub.angle", relative_to="shaft.angle", strength=40)``.
    strength : number [N] or [N m]
        Largest force along the coordinate that it carries, in either direction.

    Raises
    ------
    ModelError
        If a motion starts with a velocity across it.

    Notes
    -----
    A result contains ``value`` and ``rate`` of the coordinate (minus the other), the ``force`` along it, and
    ``intact``: 1, or 0 once it is broken. An event ``Lock`` on it inserts a new pin, ``Release`` removes it.
    """

    coordinate: str = field(kw_only=False)
    relative_to: str | None = None
    strength: Annotated[Number, Unit(None)]

    odd: ClassVar[tuple[str, ...]] = ()
    dimensions: ClassVar = Unilateral.dimensions | {"strength": ("N", "N*m")}
    outputs: ClassVar[dict[str, str]] = {"value": "", "rate": "/s", "force": "effort", "intact": "1"}

    def along(self) -> tuple[str, ...]:
        """Return the coordinate, and the one it is relative to."""
        return (self.coordinate,) if self.relative_to is None else (self.coordinate, self.relative_to)

    def switch_weights(self, n: SimpleNamespace, label: str) -> tuple[float, ...]:
        """Return the weights of a difference."""
        return (1.0, -1.0)[: len(self.along())]

    def check(self, n: SimpleNamespace) -> None:
        """Require a positive strength."""
        positive(self, n, "strength")

    def examine(self, model: Model) -> None:
        """Require existing coordinates of one kind."""
        for text in self.along():
            model.coordinate(text, self)
        if self.relative_to is not None:
            check_same_kind(self, model, *self.along())

    def switches(self) -> tuple[Switch, ...]:
        """Return one switch along the coordinate or the difference."""
        return (Switch(SHEAR_PIN, along=self.along(), weighted=True),)

    def switched(self, n: SimpleNamespace, label: str, separation: float) -> tuple[float, ...]:
        """Return the strength."""
        return (n.strength,)
