"""The instant that an analysis is about: where the mechanism is drawn, an equilibrium, or the end of a motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...errors import ModelError
from ...model.expressions import number
from ...model.model import Model
from ...results.result import Result
from ..assemble import Assembly, assemble
from ..motion.layer import in_coordinates
from ..motion.start import begin
from .derivatives import State


def instant(
    model: Model,
    about: Any = None,
    *,
    t: float | str = 0.0,
    parameters: Mapping[str, float] | None = None,
    coordinates: str = "auto",
) -> tuple[State, str]:
    """State of a mechanism, and the coordinates that it is in and why.

    Parameters
    ----------
    model : Model
    about : None, Result or Equilibrium
        Where: as described and assembled at ``t``, where a motion ended, or an equilibrium.
    t : float [s]
        Time, where ``about`` does not tell it.
    parameters : mapping, optional
        Values in SI units in place of the model's; those of an equilibrium are its own.
    coordinates : str
        ``"auto"``, ``"absolute"`` or ``"joint"``.

    Raises
    ------
    AssemblyError
        If the mechanism cannot be assembled there.
    ModelError
        If ``about`` is none of these.
    """
    if isinstance(about, Result):
        start = begin(model, about.final[0], parameters, about, coordinates)
        a, why = start.assembly, start.coordinates
    elif isinstance(getattr(about, "assembly", None), Assembly):
        a, why = in_coordinates(about.assembly, coordinates, about.parameters)  # type: ignore[union-attr]
    elif about is None:
        base = assemble(model, t=number(t, {}, "s", "t"), parameters=parameters)
        a, why = in_coordinates(base, coordinates, parameters)
    else:
        raise ModelError(f"about must be a result or an equilibrium, got {type(about).__name__}")
    return State.moving(a.compiled, a.t, a.q, a.v), why
