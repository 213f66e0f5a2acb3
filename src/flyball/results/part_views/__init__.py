"""What a result says of one part: arrays over time, named, in SI units.

One view class for each kind of element, chosen by `view_of`. A view has attributes and curves by the names of
`flyball.model.quantities`; a new kind of element gets a class here and a line in `VIEWS`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...errors import ModelError
from ...model.body import Body, Driver, Frame
from ...model.contact_point import Touch
from ...model.controller import IMU, Controller, Sensor
from ...model.force import Force
from ...model.joint import Coupling, Joint
from .base import PartView as PartView
from .bodies import FrameView
from .forces import ContactPlaceView, ForceView
from .joints import ControllerView, CouplingView, DriverView, IMUView, JointView, SensorView

if TYPE_CHECKING:
    from ..result import Result

VIEWS: tuple[tuple[type, type[PartView]], ...] = (
    (Body, FrameView),
    (Frame, FrameView),
    (Joint, JointView),
    (Coupling, CouplingView),
    (Touch, ContactPlaceView),
    (Force, ForceView),
    (Controller, ControllerView),
    (Driver, DriverView),
    (Sensor, SensorView),
    (IMU, IMUView),
)


def has_view(element: Any) -> bool:
    """Return whether results contain quantities of a part."""
    return isinstance(element, tuple(kind for kind, _ in VIEWS))


def view_of(result: Result, element: Any) -> PartView:
    """Return the view of a part.

    Raises
    ------
    ModelError
        If results contain no quantities of parts of its kind.
    """
    for kind, cls in VIEWS:
        if isinstance(element, kind):
            return cls(result, element)
    raise ModelError(f"a result has no data of {element.title}, which is part of the description only")
