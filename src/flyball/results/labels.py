"""What every part of a result is called in files and datasets: name, dimensions, unit, values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..model.quantities import ENERGY, quantities
from .views.forces import ForceView
from .views.joints import JointView

if TYPE_CHECKING:
    from .result import Result

TIME, AXIS, QUATERNION = "time", "component", "quaternion_component"


MEMBERS = 1_000_000  # members of a set times output times that are labelled


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


def labelled(result: Result, most: float = np.inf, forget: bool = False) -> Iterator[Labelled]:
    """Every quantity of the result: ``"crank.position"``, ``"A.force"``, ``"energy.total"`` and so on.

    Energies only, where the mechanism has so many parts that there would be more than ``most`` quantities. With
    ``forget`` the result does not keep what was worked out for a part: of all parts at once that is much memory.
    """
    tables = {name: quantities(result.model, name) for name in result.parts()}
    count = sum(x.array for table in tables.values() for x in table.values())
    for name in tables if count <= most else (ENERGY,):
        if name in result.bulk and len(result.t) * len(result.bulk[name]) > MEMBERS:
            continue  # its arrays are in the file once, for flyball
        view = result[name]
        for what, x in tables[name].items():
            if x.array:
                values = view.quantity(what)[1]
                dims = _of_members(name, what, values) if name in result.bulk else _dims(what, values)
                yield Labelled(f"{name}.{what}", dims, x.unit, values, _note(view, what))
                del values
        if forget:
            del view
            vars(result).pop("_views", None)
            if (records := vars(result).get("records")) is not None:
                records.forget()


def _dims(what: str, values: np.ndarray) -> tuple[str, ...]:
    if values.ndim == 1:
        return (TIME,)
    return (TIME, QUATERNION if what == "quaternion" else AXIS)


def _of_members(name: str, what: str, values: np.ndarray) -> tuple[str, ...]:
    """Of a set of bodies: times, members, and components if there are some."""
    own = (TIME, f"{name}_member")
    return own if values.ndim == 2 else (*own, *_dims(what, values[:, 0])[1:])


def _note(view: Any, what: str) -> str:
    """On which body a reaction or force acts, and what redundancy leaves of it undetermined."""
    if what not in ("force", "torque"):
        return ""
    if isinstance(view, JointView):
        free = ", ".join(view.undetermined)
        on = f"reaction {what} on {view.element.body_j}, world axes"
        return f"{on}; redundancy leaves undetermined: {free}" if free else on
    own = isinstance(view, ForceView) and not view.element.outputs
    return f"on {view.element.ends()['M']}, world axes" if own else ""
