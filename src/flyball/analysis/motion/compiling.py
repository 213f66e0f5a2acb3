"""What a motion compiles first, and about how long that takes."""

from __future__ import annotations

from ...compiler.notice import Part, announce
from ...equations.alpha import alpha_kernel
from ...equations.engine import engine
from ...equations.implicit import implicit_kernel
from ...equations.instant import instant
from ...equations.residual import stepped
from ...equations.variational import variational_kernel
from ...equations.watched import watched_kernel
from ...model.model import Model
from ...tables.switches import declared
from .implicit.suited import ALPHA, RADAU, VARIATIONAL

ENGINE = Part("the equations of motion", 22.0, (engine,))
EVENTS = Part("what finds events and decides what happens there", 15.0, (watched_kernel, instant))
DERIVATIVES = Part("the derivatives of the equations", 15.0, (stepped,))
STAGES = {
    RADAU: (DERIVATIVES, Part("the implicit method", 10.0, (implicit_kernel,))),
    ALPHA: (DERIVATIVES, Part("the generalised-alpha method", 6.0, (alpha_kernel,))),
    VARIATIONAL: (Part("the variational method", 4.0, (variational_kernel,)),),
}


def announce_motion(model: Model, integrated: bool, method: object = "") -> None:
    """Say what a motion of the model has to compile first, if it has to: the first on a machine does."""
    stages = STAGES.get(method, ()) if isinstance(method, str) else ()
    eventful = integrated and not stages and bool(model.events or model.contacts or declared(model))
    announce((ENGINE, *((EVENTS,) if eventful else ()), *stages))
