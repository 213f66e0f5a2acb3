"""Rows with modes: what elements declare that hold at times and let go at others."""

from __future__ import annotations

from dataclasses import dataclass

from ..constraints.blocks import Row


@dataclass(frozen=True)
class Switch:
    """A row with a mode along one quantity: a weighted sum of coordinates, or of terms of the element's own.

    Attributes
    ----------
    kind : int
        STOP, FRICTION, ONE_WAY, LOCK, ELASTIC, RATCHET or SLIP of `constraints.modes`.
    label : str
        Which of the element's it is; empty if it has one.
    along : tuple of str
        Coordinates (``"A.angle"``, ``"block.x"``) whose sum is the quantity, with weights if there are several.
    path : tuple of (role, role, Row)
        Or terms between frames of the element's own, such as the parts of a rope.
    seen : tuple of (role, role, Row)
        What is measured in place of ``path``, where the row itself says less than that while it is off.
    other : str
        Label of the element's switch that it belongs to: of a slip, the gap.
    slides : bool
        Whether the element is a force along the same quantity that acts while the row is off (friction), or whose
        corners are watched (what is elastic).
    weighted : bool
        Whether a single coordinate has a weight too.
    """

    kind: int
    label: str = ""
    along: tuple[str, ...] = ()
    path: tuple[tuple[str, str, Row], ...] = ()
    seen: tuple[tuple[str, str, Row], ...] = ()
    other: str = ""
    slides: bool = False
    weighted: bool = False

    @property
    def summed(self) -> bool:
        """Whether the quantity is a sum with weights (`Element.switch_weights`), and so the element's own."""
        return self.weighted or len(self.along) > 1
