"""What a result says of one part: arrays over time, named, in SI units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...errors import ModelError
from ...model.body import Body, Driver, Frame
from ...model.controller import Controller
from ...model.coupling import Coupling
from ...model.force import Force
from ...model.joint import Joint
from ...model.sensor import IMU, Sensor
from ...model.touch import Touch
from .base import View as View
from .controllers import ControllerView
from .drivers import CouplingView, DriverView
from .forces import ForceView
from .joints import JointView
from .points import PointView
from .sensors import IMUView, SensorView
from .touches import TouchView

if TYPE_CHECKING:
    from ..result import Result

VIEWS: tuple[tuple[type, type[View]], ...] = (
    (Body, PointView),
    (Frame, PointView),
    (Joint, JointView),
    (Coupling, CouplingView),
    (Touch, TouchView),
    (Force, ForceView),
    (Controller, ControllerView),
    (Driver, DriverView),
    (Sensor, SensorView),
    (IMU, IMUView),
)


def has_view(element: Any) -> bool:
    """Whether a result says something of a part."""
    return isinstance(element, tuple(kind for kind, _ in VIEWS))


def view(result: Result, element: Any) -> View:
    """The view of a part.

    Raises
    ------
    ModelError
        If a result says nothing of parts of its kind.
    """
    for kind, cls in VIEWS:
        if isinstance(element, kind):
            return cls(result, element)
    raise ModelError(f"a result says nothing of {element.title}: it is part of the description only")
