"""What a motion compiles first, and about how long that takes."""

from __future__ import annotations

from ...compiler.notice import Part, announce
from ...equations.engine import engine
from ...equations.explicit import explicit_steps
from ...equations.implicit import METHODS
from ...equations.instant import instant
from ...equations.residual import stepped
from ...equations.watched import unwatched_kernel, watched_kernel
from ...model.model import Model
from ...tables.switches import declared

ENGINE = Part("the equations of motion", 22.0, (engine,))
EVENTS = Part("what finds events and decides what happens there", 15.0, (watched_kernel, explicit_steps, instant))
DERIVATIVES = Part("the derivatives of the equations", 15.0, (stepped,))
STAGES = Part("the implicit method", 10.0, (*METHODS.values(), unwatched_kernel))


def announce_motion(model: Model, integrated: bool, implicit: bool = False) -> None:
    """Say what a motion of the model has to compile first, if it has to: the first on a machine does."""
    eventful = integrated and bool(model.events or model.contacts or declared(model))
    announce((ENGINE, *((EVENTS,) if eventful else ()), *((DERIVATIVES, STAGES) if implicit else ())))
