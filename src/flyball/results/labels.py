"""What every part of a result is called in files and datasets: name, dimensions, unit, values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..model.force import BodyForce, TwoFrameForce
from .views import View
from .views.forces import ForceView
from .views.joints import JointView
from .views.points import PointView

if TYPE_CHECKING:
    from .result import Result

TIME, AXIS, QUATERNION = "time", "component", "quaternion_component"
ENERGIES = ("kinetic", "gravity", "elastic", "potential", "total", "balance")
POINT = {
    "position": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "angle": "rad",
    "quaternion": "1",
    "angular_velocity": "rad/s",
    "angular_acceleration": "rad/s^2",
}


class Labelled(NamedTuple):
    """One quantity over time."""

    name: str
    dims: tuple[str, ...]
    unit: str
    values: np.ndarray
    note: str = ""


def coordinates(result: Result) -> dict[str, list[str]]:
    """Labels of the dimensions other than time."""
    axes = {AXIS: list("xy" if result.planar else "xyz")}
    return axes if result.planar else axes | {QUATERNION: list("wxyz")}


def labelled(result: Result, most: float = np.inf) -> Iterator[Labelled]:
    """Every quantity of the result: ``"crank.position"``, ``"A.force"``, ``"energy.total"`` and so on.

    Energies only, where the mechanism has so many parts that there would be more than ``most`` quantities.
    """
    parts = [e for e in result.model.elements() if e.category not in ("initial", "tables")]
    for e in parts if len(POINT) * len(parts) <= most else ():
        for what, unit, values, note in _of(result[e.name], result.planar):
            yield Labelled(f"{e.name}.{what}", _dims(what, values), unit, values, note)
    for what in ENERGIES:
        yield Labelled(f"energy.{what}", (TIME,), "J", getattr(result.energy, what))


def _dims(what: str, values: np.ndarray) -> tuple[str, ...]:
    if values.ndim == 1:
        return (TIME,)
    return (TIME, QUATERNION if what == "quaternion" else AXIS)


Quantity = tuple[str, str, np.ndarray, str]


def _of(view: View, planar: bool) -> Iterator[Quantity]:
    if isinstance(view, PointView):
        for what in (k for k in POINT if k != ("quaternion" if planar else "angle")):
            yield what, POINT[what], getattr(view, what), ""
    elif isinstance(view, JointView):
        yield from _joint(view, planar)
    elif isinstance(view, ForceView):
        yield from _force(view, planar)
    else:
        for what, (unit, values) in view.channels().items():
            yield what, unit, values, ""


def _joint(view: JointView, planar: bool) -> Iterator[Quantity]:
    for what, c in view.element.measured(planar).items():
        yield what, c.unit, getattr(view, what), ""
        yield f"{what}_rate", f"{c.unit}/s", getattr(view, f"{what}_rate"), ""
        yield f"{what}_acceleration", f"{c.unit}/s^2", getattr(view, f"{what}_acceleration"), ""
    free = view.undetermined
    note = f"redundancy leaves undetermined: {', '.join(free)}" if free else ""
    on = f"on {view.element.body_j}"
    for what, unit in (("force", "N"), ("torque", "N*m")):
        yield what, unit, getattr(view, what), "; ".join(x for x in (f"reaction {what} {on}, world axes", note) if x)


def _force(view: ForceView, planar: bool) -> Iterator[Quantity]:
    e = view.element
    if isinstance(e, (BodyForce, TwoFrameForce)):
        force, torque = view.wrench
        on = f"on {e.ends()['M']}, world axes"
        yield "force", "N", force[:, :2] if planar else force, on
        yield "torque", "N*m", torque[:, 2] if planar else torque, on
    for what in e.outputs:
        yield what, view.unit(what), getattr(view, what), ""
    for what, unit in (("energy", "J"), ("power", "W"), ("work", "J")):
        yield what, unit, getattr(view, what), ""
