"""Questions that a model asks about what its parts name: which curves a part has, and in which units.

What only a result can compute is known by name already when a part is described, so that a wrong name is refused then.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..errors import ModelError, UnitError
from .body import GROUND, Body, Driver, Frame
from .coupling import Coupling
from .element import Element, LawOf, Unit, fields_with
from .expressions import law_expression, number
from .force import CoordinateForce, Force, TwoPointForce
from .joint import Joint
from .sensor import IMU, Sensor
from .words import listing, suggest

if TYPE_CHECKING:
    from .model import Model

ENERGIES = ("kinetic", "potential", "total", "balance")


def curves(model: Model, name: str) -> list[str]:
    """Names of the curves that a result has of a part (or of ``"energy"``)."""
    if name == "energy":
        return list(ENERGIES)
    e, axes = model[name], "xy" if model.planar else "xyz"
    if isinstance(e, (Body, Frame)):
        turning = ["omega"] if model.planar else [f"omega_{a}" for a in axes]
        return [*axes, *(["angle"] if model.planar else []), *(k + a for k in "va" for a in axes), *turning]
    if isinstance(e, Joint):
        return _of_joint(e, axes)
    if isinstance(e, (TwoPointForce, CoordinateForce)):
        return list(e.outputs)
    if isinstance(e, Force):
        return [k + a for k in "ft" for a in "xyz"]
    if isinstance(e, Coupling):
        return [f"effort_{k}" for k in range(1, 1 + len(e.coupled()))]
    if isinstance(e, Driver):
        return ["effort", "work"]
    if isinstance(e, IMU):
        return ["fx", "fy", "w"] if model.planar else [k + a for k in "fw" for a in axes]
    return ["value"] if isinstance(e, Sensor) else []


def _of_joint(e: Joint, axes: str) -> list[str]:
    own = list(e.measured(len(axes) == 2))
    out = [x for what in own for x in (what, "rate" if len(own) == 1 else f"{what}_rate")]
    out += ["place"] if hasattr(e, "nearest") else []
    return [*out, *(f"f{a}" for a in axes), *(["torque"] if len(axes) == 2 else (f"t{a}" for a in axes))]


def measured(model: Model, e: Sensor) -> tuple[str, str, int] | None:
    """What a sensor measures; see `Model.measured`."""
    owner, _, what = e.of.partition(".")
    found = model.find(owner)
    if found is None and owner != "energy":
        known = model.names()
        raise ModelError(
            f"{e.title}: {e.of!r} is no curve of a part; write part.curve, for instance 'A.angle'. There is no "
            f"part named {owner!r}{suggest(owner, known)}; {listing(known)}"
        )
    has = curves(model, owner)
    only = isinstance(found, Joint) and "rate" in has and what.endswith("_rate") and what.removesuffix("_rate") in has
    if what not in has and not only:
        whose = "energy" if found is None else found.title
        raise ModelError(
            f"{e.title}: {e.of!r} is no curve; {whose} has {', '.join(f'{owner}.{c}' for c in has) or 'none'}"
            f"{suggest(what, has)}"
        )
    if isinstance(found, (Body, Frame)):
        return _of_point(owner, what, "xy" if model.planar else "xyz")
    if isinstance(found, Joint):
        own = found.measured(model.planar)
        if what in own:
            return "coordinate", f"{owner}.{what}", 0
        name = next(iter(own)) if what == "rate" and len(own) == 1 else what.removesuffix("_rate")
        return ("coordinate", f"{owner}.{name}", 1) if name in own else None
    if isinstance(found, (TwoPointForce, CoordinateForce)):
        order = list(found.outputs).index(what)
        return ("force", owner, order) if order < 2 else None
    return None


def _of_point(owner: str, what: str, axes: str) -> tuple[str, str, int] | None:
    planar = len(axes) == 2
    if what in tuple(axes) or (planar and what == "angle"):
        return "coordinate", f"{owner}.{what}", 0
    if len(what) == 2 and what[0] == "v":
        return "coordinate", f"{owner}.{what[1]}", 1
    if planar and what == "omega":
        return "coordinate", f"{owner}.angle", 1
    return ("spin", f"{owner}.{what[-1]}", 1) if what.startswith("omega_") else None


def carriers(model: Model) -> list[str]:
    """Names of what can carry something: bodies, frames, ground."""
    return [*(b.name for b in model.bodies), *(f.name for f in model.frames), GROUND]


def but_is(model: Model, name: str, wanted: str) -> str:
    """'; 'A' is a Revolute' where a name means something else than was wanted."""
    found = model.find(name)
    return "" if found is None else f" ({name!r} is a {type(found).__name__}, no {wanted})"


def check_units(model: Model, e: Element, env: Mapping[str, float]) -> None:
    """Refuse units that do not fit the coordinate that an element acts along or couples."""
    if isinstance(e, CoordinateForce) and e.coordinate_text():
        turning = model.unit(e.coordinate_text(), e) == "rad"
        for name, pair in e.dimensions.items():
            value = getattr(e, name, None)
            if value is not None and name in fields_with(e.__class__, Unit):
                number(value, env, pair[turning], f"{name} of {e.title}")
            elif value is not None and name in fields_with(e.__class__, LawOf):
                tables = {x.name: x for x in model.tables}
                law_expression(value, pair[turning], f"{name} of {e.title}", tables=tables)
    elif isinstance(e, Coupling):
        for name, kinds in e.dimensions.items():
            value = getattr(e, name)
            for x in value if isinstance(value, tuple) else (value,):
                _one_of(x, kinds, env, f"{name} of {e.title}")


def _one_of(value: Any, kinds: tuple[str, ...], env: Mapping[str, float], where: str) -> None:
    """The value is in one of these units."""
    problem: ModelError | None = None
    for kind in kinds if value is not None else ():
        try:
            number(value, env, kind, where)
            return
        except UnitError as error:
            problem = problem or error
    if problem is not None:
        raise problem
