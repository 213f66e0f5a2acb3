"""What a motion compiles first, and about how long that takes."""

from __future__ import annotations

from ...compiler.notice import Part, announce
from ...equations.engine import engine
from ...equations.instant import instant
from ...equations.watched import watched_kernel
from ...model.model import Model
from ...tables.switches import declared

ENGINE = Part("the equations of motion", 22.0, (engine,))
EVENTS = Part("what finds events and decides what happens there", 15.0, (watched_kernel, instant))


def announce_motion(model: Model, integrated: bool) -> None:
    """Say what a motion of the model has to compile first, if it has to: the first on a machine does."""
    eventful = integrated and bool(model.events or model.contacts or declared(model))
    announce((ENGINE, EVENTS) if eventful else (ENGINE,))
