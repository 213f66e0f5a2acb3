"""What a motion compiles first, and about how long that takes."""

from __future__ import annotations

from ...compiler.notice import Part, announce
from ...equations.alpha import alpha_steps
from ...equations.engine import engine
from ...equations.explicit import explicit_steps
from ...equations.implicit import radau_steps
from ...equations.instant import instant
from ...equations.residual import stepped
from ...equations.unwatched import unwatched
from ...equations.variational import variational_steps
from ...equations.watched import watched_kernel
from ...model.model import Model
from ...tables.switches import declared
from .implicit.suited import ALPHA, RADAU, VARIATIONAL

ENGINE = Part("the equations of motion", 18.0, (engine,))
EVENTS = Part("what finds events and decides what happens there", 13.0, (watched_kernel, explicit_steps, instant))
DERIVATIVES = Part("the derivatives of the equations", 9.5, (stepped,))
LOOP = Part("the loop of implicit methods", 2.0, (unwatched,))
STAGES = {
    RADAU: (DERIVATIVES, LOOP, Part("the implicit method", 4.5, (radau_steps,))),
    ALPHA: (DERIVATIVES, LOOP, Part("the generalised-alpha method", 4.0, (alpha_steps,))),
    VARIATIONAL: (LOOP, Part("the variational method", 3.5, (variational_steps,))),
}


def announce_motion(model: Model, integrated: bool, method: object = "") -> None:
    """Say what a motion of the model has to compile first, if it has to: the first on a machine does."""
    stages = STAGES.get(method, ()) if isinstance(method, str) else ()
    eventful = integrated and model.snapshot().kept.get("eventful", None, 1, lambda: _eventful(model))
    announce((ENGINE, *((EVENTS,) if eventful else ()), *stages))


def _eventful(model: Model) -> bool:
    """Whether something may happen at an instant."""
    return bool(model.events or model.contacts or declared(model))
