"""Forces that an event may name: what joints carry, what acts along coordinates, what drivers do.

They are known only with the accelerations, so no force, controller or driver may follow them; an event may.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from .body import Driver
from .element import Element
from .force import CoordinateForce
from .joint import Joint

if TYPE_CHECKING:
    from .model import Model

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz", "force", "torque")
"""What is told of a joint, the last two being sizes."""
ALONG = ("effort", "reversed")
"""What is told of a force along a coordinate, and of a driver: the effort, and that the other way round."""
SPIN = 5  # in the plane the torque, which has a sign


class Carried(NamedTuple):
    """A force or torque by name: whose it is, and which of `WRENCH` or `ALONG`."""

    element: Element
    column: int


def carried(model: Model, name: str) -> Carried | None:
    """What a name such as ``"A.fx"`` or ``"rope.tension"`` says of what a part carries; None if it is something else.

    ``"A.force"`` is the size of a joint's force; in space ``"A.torque"`` that of its torque.
    """
    owner, _, what = name.partition(".")
    e = model.find(owner)
    if isinstance(e, Joint):
        if model.planar and what in ("fx", "fy", "force", "torque"):
            return Carried(e, SPIN if what == "torque" else WRENCH.index(what))
        return Carried(e, WRENCH.index(what)) if what in WRENCH and not model.planar else None
    if isinstance(e, CoordinateForce) and what in list(e.outputs)[2:3]:
        way = getattr(e, "direction", 1.0)  # as results tell it
        return None if isinstance(way, str) else Carried(e, 0 if e.sign * way > 0.0 else 1)
    return Carried(e, 0) if isinstance(e, Driver) and what == "effort" else None
