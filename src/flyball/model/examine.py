"""Questions that a model asks about what its parts name: which curves a part has, and in which units.

What only a result can compute is known by name already when a part is described, so that a wrong name is refused then.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import permutations
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import ModelError, UnitError
from .body import GROUND, Body, Frame
from .controller import Controller
from .coupling import Coupling
from .element import Element, LawOf, Unit, fields_with
from .expressions import law_expression, number
from .force import CoordinateForce, TwoPointForce
from .joint import Joint
from .quantities import ENERGY, components, quantities
from .sensor import Sensor
from .units import split_quantity
from .words import listing, suggest

if TYPE_CHECKING:
    from .model import Model


class Curve(NamedTuple):
    """A curve such as A.angle where nobody has given it a name, and what asks for it."""

    title: str
    of: str


def measured(model: Model, e: Sensor | Curve) -> tuple[str, str, int] | None:
    """What a sensor measures; see `Model.measured`."""
    owner, _, what = e.of.partition(".")
    found = model.find(owner)
    if found is None and owner != ENERGY:
        known = model.names()
        raise ModelError(
            f"{e.title}: {e.of!r} is no curve of a part; write part.curve, for instance 'A.angle'. There is no "
            f"part named {owner!r}{suggest(owner, known)}; {listing(known)}"
        )
    table = quantities(model, owner)
    if what not in table:
        has = [k for k, x in table.items() if x.curve]
        whose = ENERGY if found is None else found.title
        raise ModelError(
            f"{e.title}: {e.of!r} is no curve; {whose} has {', '.join(f'{owner}.{c}' for c in has) or 'none'}"
            f"{suggest(what, table)}"
        )
    x = table[what]
    if x.width:
        parts = " or ".join(f"{owner}.{k}" for k in components(table, what))
        raise ModelError(
            f"{e.title}: {e.of!r} has {x.width} numbers, and a sensor measures one"
            + (f"; measure {parts}" if parts else "")
        )
    if isinstance(found, (Body, Frame)):
        return _of_point(owner, x.of or what, x.component, model.planar)
    if isinstance(found, Joint):
        own, name = found.measured(model.planar), x.of or what
        if name in own:
            return "coordinate", f"{owner}.{name}", 0
        name = name.removesuffix("_rate")
        return ("coordinate", f"{owner}.{name}", 1) if name in own else None
    if isinstance(found, (TwoPointForce, CoordinateForce)) and what in found.outputs:
        order = list(found.outputs).index(what)
        return ("force", owner, order) if order < 2 else None
    return None


def _of_point(owner: str, whole: str, component: int | None, planar: bool) -> tuple[str, str, int] | None:
    """What laws may use of a body or frame: places, angles, and their rates."""
    if whole in ("position", "velocity") and component is not None:
        return "coordinate", f"{owner}.{'xyz'[component]}", int(whole == "velocity")
    if planar and whole in ("angle", "angular_velocity"):
        return "coordinate", f"{owner}.angle", int(whole == "angular_velocity")
    spin = whole == "angular_velocity" and component is not None
    return ("spin", f"{owner}.{'xyz'[component or 0]}", 1) if spin else None


def carriers(model: Model) -> list[str]:
    """Names of what can carry something: bodies, frames, ground."""
    return [*(b.name for b in model.bodies), *(f.name for f in model.frames), GROUND]


def but_is(model: Model, name: str, wanted: str) -> str:
    """'; 'A' is a Revolute' where a name means something else than was wanted."""
    found = model.find(name)
    return "" if found is None else f" ({name!r} is a {type(found).__name__}, no {wanted})"


def check_units(model: Model, e: Element, env: Mapping[str, float]) -> None:
    """Refuse units that do not fit the coordinate that an element acts along or couples, or what it compares."""
    if isinstance(e, Controller):
        _check_compared(model, e)
    if isinstance(e, CoordinateForce) and e.along():
        turning = model.unit(e.along()[0], e) == "rad"
        for name, pair in e.dimensions.items():
            value = getattr(e, name, None)
            if value is not None and name in fields_with(e.__class__, Unit):
                number(value, env, pair[turning], f"{name} of {e.title}")
            elif value is not None and name in fields_with(e.__class__, LawOf):
                tables = {x.name: x for x in model.tables}
                names = model.names_in_laws(fields_with(e.__class__, LawOf)[name])
                where = f"{name} of {e.title}"
                law = law_expression(value, pair[turning], where, tables, names, any("." in k for k in names))
                if name in e.not_negative and law.names <= set(env) and not law.tables and law.function is None:
                    given = law.evaluate(env)
                    if not given.real >= 0.0:
                        raise ModelError(f"{where} is {given:g} {pair[turning]}; it must be zero or greater")
    for name, kinds in (e.dimensions if isinstance(e, Coupling) else getattr(e, "kinds", {})).items():
        value = getattr(e, name)
        for x in value if isinstance(value, tuple) else (value,):
            _one_of(x, kinds, env, f"{name} of {e.title}")


def _check_compared(model: Model, e: Controller) -> None:
    """Refuse a set point of another kind than the curve that is to follow it; what is no plain curve says no unit."""
    given = {k: x for k in e.compared if isinstance(x := getattr(e, k), str)}
    for (name, told), (_, curve) in permutations(given.items(), 2):
        owner, _, what = curve.partition(".")
        table = quantities(model, owner) if model.find(owner) is not None else {}
        if what in table and table[what].unit and split_quantity(told) is not None:
            number(told, {}, table[what].unit, f"{name} of {e.title}")


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
