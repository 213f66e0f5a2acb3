"""A contact point of two bodies in event-driven integration: a gap and, with friction, slip rows."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import ClassVar

import numpy as np

from ..constraints import corner_on_box, displacement
from ..constraints.blocks import Row
from ..constraints.switches.contact_slip import EDGE, SLIP
from ..constraints.switches.stop import STOP
from .element import element
from .force import Switch, TwoFrameForce
from .joint import WorldFrame

GAP = replace(STOP, closing=("touch", "touches"), opening=("part", "parts"), states=("touches", "apart"))
"""The gap of a contact point."""
Term = tuple[float, ...]  # the kind of a row and its eight parameters


@element
class Touch(TwoFrameForce):
    """A contact point of a `Contact`: a gap row and, with friction, slip rows.

    Contact points are created from the shapes when a motion begins, not by the user.

    Parameters
    ----------
    name : str
        ``"ball-floor"``, with a number if two bodies have several.
    body_i, body_j : str
        Bodies of F and M; ``"ground"`` is the world.
    frames : two tuples of 12 numbers
        F and M in the world in the reference configuration: origin, rotation row by row.
    gap : tuple of 9 numbers
        The row of the distance between the sides: its kind, its parameters.
    measured : tuple of 9 numbers
        The row that is monitored while the contact is open, if it is a different one.
    slips : tuples of 9 numbers
        The rows of the sliding velocities, one in the plane and two in space; none without friction.
    friction : two numbers
        Coefficients of static and sliding friction.
    restitution : number
    """

    frames: tuple[tuple[float, ...], tuple[float, ...]]
    gap: Term
    measured: Term | None = None
    slips: tuple[Term, ...] = ()
    friction: tuple[float, float] = (0.0, 0.0)
    restitution: float = 0.0

    kind: ClassVar[int] = 1000  # behind all other kinds; no formula of its own: it acts by its switches
    outputs: ClassVar[dict[str, str]] = {"gap": "m", "normal": "N", "friction": "N", "slip": "m/s"}
    sliding: ClassVar[bool] = True

    @property
    def radius(self) -> float:
        """Return the radius of the ball about M's origin; 0 for a corner."""
        return self.gap[7] if int(self.gap[0]) == displacement.KIND else self.gap[4]

    def placed(self, n: SimpleNamespace, planar: bool) -> dict[str, WorldFrame]:
        """Return its frames."""
        F, M = ((np.array(x[:3]), np.array(x[3:]).reshape(3, 3)) for x in self.frames)
        return {"F": F, "M": M}

    def acts(self) -> bool:
        """Return whether there is friction."""
        return bool(self.slips)

    def conservative(self) -> bool:
        """Return whether it is frictionless and so dissipates nothing."""
        return not self.slips

    def nearest(self, n: SimpleNamespace, F: WorldFrame, M: WorldFrame) -> tuple[float, float]:
        """Return the face on which its corner is, and 0."""
        f, m = ((tuple(p), tuple(R.ravel())) for p, R in (F, M))
        return corner_on_box.foot(self.gap[1:], f, m, 0.0, None), 0.0

    def switches(self) -> tuple[Switch, ...]:
        """Return the gap switch, and a slip switch for each tangent."""
        seen = () if self.measured is None else (("F", "M", _row(self.measured)),)
        out = [Switch(GAP, "gap", path=(("F", "M", _row(self.gap)),), measured=seen)]
        for k, slip in enumerate(self.slips):
            path = (("F", "M", _row(slip, holonomic=False)),)
            out.append(Switch(SLIP, f"slip_{k + 1}", path=path, slides=k == 0, other="gap"))
        if self.measured is not None:
            margin = (corner_on_box.KIND_MARGIN, *self.gap[1:])
            out.append(Switch(EDGE, "edge", path=(("F", "M", _row(margin)),), other="gap"))
        return tuple(out)

    def switched(self, n: SimpleNamespace, label: str, separation: float) -> tuple[float, ...]:
        """Return, for the gap, its least value and the restitution; for a slip both coefficients."""
        return (0.0, np.inf, self.restitution) if label == "gap" else () if label == "edge" else self.friction


def _row(term: Term, holonomic: bool = True) -> Row:
    return Row(int(term[0]), tuple(term[1:]), holonomic=holonomic)
