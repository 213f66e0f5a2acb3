"""Quantities that count from the start of a motion on: works and what is lost. A state says nothing of them."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import ModelError
from ...model.controller import Controller
from ...model.model import Model
from ...model.quantities import ENERGY, one
from ...model.sensor import Sensor
from ...results.booked import ADDED

OF_ENERGY = ("balance", *ADDED)
WORK = "work"


def refuse_counted(model: Model, names: Sequence[str]) -> None:
    """Refuse outputs of a linear model that integrals over the motion are.

    Raises
    ------
    ModelError
        Naming the first of them, or what does not exist.
    """
    for name in names:
        one(model, name)
        of = name
        while "." not in of and isinstance(e := model.find(of), Sensor):
            of = e.of
        owner, _, what = of.partition(".")
        if what in OF_ENERGY if owner == ENERGY else what == WORK and not isinstance(model.find(owner), Controller):
            instead = "energy.total" if owner == ENERGY else f"{owner}.power"
            raise ModelError(
                f"output {name!r} counts from the start of a motion on, so no state of a linear model tells it; ask "
                f"for {instead!r}"
            )
