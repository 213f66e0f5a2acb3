"""The instant that an analysis is about: where the mechanism is drawn, an equilibrium, or the end of a motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ...errors import ModelError
from ...model.expressions import number
from ...model.model import Model
from ...results.equilibrium import Equilibrium
from ...results.result import Result
from ..assemble import assemble
from ..assembly.start import Assembly
from ..compiled import compiled
from ..motion.layer import in_coordinates
from ..motion.start import begin
from .derivatives import State

Many = Callable[[int, int], bool]
SPARSE = "absolute: of so many velocities the equations are sparse there"


def instant(
    model: Model,
    about: Any = None,
    *,
    t: float | str = 0.0,
    parameters: Mapping[str, float] | None = None,
    coordinates: str = "auto",
    many: Many | None = None,
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
        Values in SI units in place of the model's, and of those that an equilibrium was found with.
    coordinates : str
        ``"auto"``, ``"absolute"`` or ``"joint"``.
    many : callable, optional
        Whether absolute coordinates are taken, in which large mechanisms are sparse, by numbers of velocities and rows.

    Raises
    ------
    AssemblyError
        If the mechanism cannot be assembled there.
    ModelError
        If ``about`` is none of these.
    """
    if isinstance(about, Result):
        start = begin(model, about.final[0], parameters, about, coordinates)
        base, a, why = start.base, start.assembly, start.coordinates
    elif isinstance(about, Equilibrium):
        told = {**about.parameters, **(parameters or {})}
        base = _there(model, about, told)
        a, why = _chosen(base, coordinates, told, many)
    elif about is None:
        base = assemble(model, t=number(t, {}, "s", "t"), parameters=parameters)
        a, why = _chosen(base, coordinates, parameters, many)
    else:
        raise ModelError(f"about must be a result or an equilibrium, got {type(about).__name__}")
    s = a.compiled.structure
    if many is not None and many(s.nv, len(s.rows)):
        a, why = base, SPARSE
    return State.moving(a.compiled, a.t, a.q, a.v), why


def _chosen(
    base: Assembly,
    coordinates: str,
    parameters: Mapping[str, float] | None,
    many: Many | None,
) -> tuple[Assembly, str]:
    """The assembly in the coordinates asked for; where none have few velocities, these are not made."""
    s = base.compiled.structure
    if many is not None and coordinates == "auto" and many(s.nv - len(s.rows), 0):
        return base, SPARSE
    return in_coordinates(base, coordinates, parameters)


def _there(model: Model, about: Equilibrium, parameters: Mapping[str, float]) -> Assembly:
    """The mechanism where an equilibrium found it; whether it rests there now is for others to see.

    Raises
    ------
    ModelError
        If the equilibrium is of another mechanism, or a preload of one that has been changed.
    """
    old = about.assembly.compiled
    if about.preload:
        own = old.structure.model
        loaded = {name.partition(".")[0] for name in about.preload}
        parts, others = ([e for e in m.elements() if e.name not in loaded] for m in (model, own))
        if parts != others:
            raise ModelError(f"{model.name!r} is not what it was when its preload was found; find it again")
        model = own
    if [b.name for b in model.bodies] != [b.name for b in old.structure.model.bodies]:
        raise ModelError(f"about is an equilibrium of {old.structure.model.name!r}, which has other bodies")
    c = compiled(model.snapshot(), parameters=parameters)
    t, q, v = about.assembly.t, about.assembly.q, about.assembly.v
    q, v = c.take(old, t, q, v)
    return Assembly(c, t, q, v)
