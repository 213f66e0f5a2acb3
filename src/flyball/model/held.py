"""What actions lock and release: coordinates, whole joints, limits and ropes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import ModelError
from .actions import Lock, Release
from .joint import Joint
from .words import suggest

if TYPE_CHECKING:
    from .event import Event
    from .model import Model


@dataclass(frozen=True)
class Held:
    """What an action holds or lets go.

    Attributes
    ----------
    coordinates : tuple of str
        Coordinates that are locked, each by a row of its own: ``"A.angle"``.
    joint : str
        Or the joint whose own rows hold or let go.
    element : str
        Or the limit or rope that is in force or not.
    """

    coordinates: tuple[str, ...] = ()
    joint: str = ""
    element: str = ""

    def keys(self) -> tuple[str, ...]:
        """What must not be locked and released at one instant."""
        return self.coordinates or (self.joint or self.element,)


def held_by(model: Model, e: Event, a: Lock | Release) -> Held:
    """What it is that ``a`` holds or lets go.

    Raises
    ------
    ModelError
        If there is no such part, or it has nothing to be locked or released.
    """
    what = f"{e.title}: {a.title}"
    if "." in a.what:
        model.coordinate(a.what, e)
        return Held((a.what,))
    found = model.find(a.what)
    if isinstance(found, Joint):
        own = tuple(f"{a.what}.{k}" for k in found.measured(model.planar))
        if own and (isinstance(a, Lock) or _locked_somewhere(model, e, {a.what, *own})):
            return Held(own)
        if not found.rows(model.planar):
            raise ModelError(f"{what}: {found.title} holds nothing that could be released")
        return Held(joint=a.what)
    if found is not None and (found.category == "limits" or getattr(found, "single", "") == "rope"):
        return Held(element=a.what)
    if found is None:
        known = [*(j.name for j in model.joints), *(x.name for x in model.limits)]
        raise ModelError(
            f"{what}: there is no part named {a.what!r}{suggest(a.what, known)}; "
            f"name a joint, a coordinate such as 'A.angle', a limit or a rope"
        )
    if found.category in ("bodies", "frames"):
        axes = "x, y, angle" if model.planar else "x, y, z"
        raise ModelError(
            f"{what}: {found.title} has the coordinates {axes}; name one, as in '{a.what}.x', or hold it by a Fixed "
            f"joint that another event releases"
        )
    raise ModelError(
        f"{what}: {found.title} is no joint, coordinate, limit or rope; a force is switched off by fb.Set of a "
        f"parameter in its numbers or laws"
    )


def _locked_somewhere(model: Model, e: Event, names: set[str]) -> bool:
    """Whether an event locks one of these."""
    every = (*(x for x in model.events if x.name != e.name), e)
    return any(isinstance(a, Lock) and a.what in names for x in every for a in x.do)
