"""Quantities that follow from positions and velocities of a motion alone, whatever forces made it."""

from __future__ import annotations

from ...errors import ModelError
from ...model.body import Body, Frame
from ...model.joint import Joint
from ...model.model import Model
from ...model.quantities import quantities
from ...model.sensor import Sensor

OF_POINTS = ("position", "velocity", "angle", "angular_velocity")


def of_states(model: Model, name: str) -> bool:
    """Whether a curve of a result, by its name, is such a quantity; False where that is not known."""
    owner, dot, what = name.partition(".")
    try:
        e = model[owner]
    except ModelError:
        return False
    if isinstance(e, Sensor) and what in ("", "value"):
        return isinstance(e.of, str) and e.of.partition(".")[0] != owner and of_states(model, e.of)
    if not dot or what not in (table := quantities(model, owner)):
        return False
    whole = table[what].of or what
    if isinstance(e, (Body, Frame)):
        return whole in OF_POINTS
    return isinstance(e, Joint) and whole.removesuffix("_rate") in e.coordinates
