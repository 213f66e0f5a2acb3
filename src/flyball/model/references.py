"""Whether what an element names is there, and is what the element needs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import ModelError
from .body import GROUND, Body, Driver, Frame, Initial
from .bulk import Bodies
from .contact import Contact
from .coupling import Coupling
from .element import Element
from .event import Event
from .event_check import check_event
from .force import BodyForce, CoordinateForce, TwoFrameForce, TwoPointForce
from .ground import Ground
from .joint import Joint
from .material import MaterialPair
from .sensor import IMU, Sensor
from .touching import check_touching

if TYPE_CHECKING:
    from .model import Model


def check_references(model: Model, e: Element) -> None:
    """Refuse what names parts that are not there, or both times the same one."""
    if isinstance(e, (Body, Bodies, Ground, Contact, MaterialPair)):
        check_touching(model, e)
    if isinstance(e, (Joint, TwoPointForce, TwoFrameForce)):
        carriers = [model.carrier(name, e) for name in (e.body_i, e.body_j)]
        if carriers[0] == carriers[1]:
            raise ModelError(f"{e.title}: both its ends are on {carriers[0]!r}; it must join two different bodies")
    elif isinstance(e, Frame):
        if e.body != GROUND:
            model.body(e.body, e)
    elif isinstance(e, BodyForce):
        if model.carrier(e.body, e) == GROUND:
            raise ModelError(f"{e.title}: a force on ground moves nothing; name a body")
    elif isinstance(e, CoordinateForce):
        e.examine(model)
        _check_path(model, e)
    elif isinstance(e, Coupling):
        for text in e.coupled():
            model.coordinate(text, e)
        e.examine(model)
    elif isinstance(e, Sensor):
        model.measured(e)
    elif isinstance(e, Event):
        check_event(model, e)
    elif isinstance(e, IMU):
        if model.carrier(e.frame, e) == GROUND:
            raise ModelError(f"{e.title}: it is fixed on ground, which never moves; name a body or a frame on one")
    elif isinstance(e, (Driver, Initial)):
        model.coordinate(e.name if isinstance(e, Initial) else e.coordinate, e)


def _check_path(model: Model, e: CoordinateForce) -> None:
    """What it acts along exists, and can move."""
    for text in e.along() or ((e.coordinate,) if hasattr(e, "coordinate") else ()):
        model.coordinate(text, e)
    carriers = [model.carrier(name, e) for name in e.ends().values()]
    if len(carriers) > 1 and len(set(carriers)) == 1:
        raise ModelError(
            f"{e.title}: all its points are on {carriers[0]!r}, so that it never changes its length; name another body"
        )
