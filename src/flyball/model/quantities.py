"""The quantities of a result for each part: names, units and components, in one table.

Names are known before anything is computed, so that a wrong one is refused when a part is added. Results, their curves,
data sets, sensors and outputs of analyses all read this table. Forces that joints, force elements and drivers transmit
are known only with the accelerations: events may name them, laws may not.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from itertools import permutations
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import ModelError, UnitError
from .body import GROUND, Body, Driver, Frame
from .controller import IMU, Controller, Sensor
from .controller_signals import controller_names
from .element import Element, LawOf, Unit, fields_with
from .event import Lock
from .expressions import law_expression, number
from .force import BodyForce, CoordinateForce, Force, PathForce, TwoFrameForce, TwoPointForce
from .joint import ORIENTATION_ANGLES, Coupling, Joint
from .messages import listing, suggest
from .names import curve_parts, is_curve
from .units import powers_in_si, split_quantity

if TYPE_CHECKING:
    from .model import Model


ENERGY = "energy"  # the name of the total energies in a result
MOST = 256  # number of parts whose tables are cached
MEMBER = re.compile(r"(.*)\[(\d+)\]")  # member of a set of bodies: "balls[17]"


class Quantity(NamedTuple):
    """One quantity of a part, over time.

    Attributes
    ----------
    unit : str
    of : str
        The quantity of which this is a component or another name; itself, if empty.
    component : int or None
        Index of the component.
    curve : bool
        Whether it is a curve: a column of tables, a line in plots of a whole part.
    array : bool
        Whether datasets contain it.
    width : int
        Number of components at one time; 0 for a scalar.
    """

    unit: str
    of: str = ""
    component: int | None = None
    curve: bool = False
    array: bool = False
    width: int = 0


Table = dict[str, Quantity]


def quantities(model: Model, name: str) -> Table:
    """Return all quantities of a part (or of ``"energy"``) by name; not to be changed."""
    cache = getattr(model, "cache", None)  # of a snapshot
    return (
        _quantity_table(model, name)
        if cache is None
        else cache.get("quantities", name, MOST, lambda: _quantity_table(model, name))
    )


def _quantity_table(model: Model, name: str) -> Table:
    axes = "xy" if model.planar else "xyz"
    touching = bool(getattr(model, "contacts", ()))
    if name == ENERGY:
        return _of_energy(touching, has_switches(model))
    member = MEMBER.fullmatch(name)
    if member and member[1] in model.by_name and model[member[1]].category == "bulk":
        return _of_member(axes)
    e = model[name]
    if isinstance(e, Body):
        return _of_frame(axes) | (_of_contact(axes) if touching else {}) | _of_locks(model, e)
    if isinstance(e, Frame):
        return _of_frame(axes)
    if e.category == "bulk":
        return body_set_quantities(axes)
    if isinstance(e, Joint):
        return _of_joint(e, axes) | ({} if e.blocks else _of_locks(model, e))
    if isinstance(e, Force):
        return _of_force(model, e, axes)
    if isinstance(e, Coupling):
        units = {f"effort_{k}": _effort(model.unit(text, e)) for k, text in enumerate(e.coupled(), 1)}
        equation = e.equation(model)
        units |= {"work": "J"} if equation is not None and "t" in equation.names else {}
        return {k: Quantity(unit, curve=True, array=True) for k, unit in units.items()}
    if isinstance(e, Driver):
        effort = Quantity(_effort(model.unit(e.coordinate, e)), curve=True, array=True)
        return {"effort": effort, "work": Quantity("J", curve=True, array=True)}
    if isinstance(e, IMU):
        return _of_imu(axes)
    if isinstance(e, Controller):
        units = e.signal_units()
        return {k: Quantity(units.get(k, ""), curve=True, array=True) for k in controller_names(model, e)}
    return {"value": Quantity(_unit_of(model, e.of), curve=True, array=True)} if isinstance(e, Sensor) else {}


def unknown_quantity(owner: str, what: str, table: Mapping[str, Quantity]) -> str:
    """Return the message on an unknown quantity of a part."""
    curves = [k for k, x in table.items() if x.curve]
    rest = [k for k, x in table.items() if not x.curve]
    has = ", ".join(curves) + (f"; as wholes or by other names: {', '.join(rest)}" if rest else "")
    return f"{owner} has no curve {what!r}{suggest(what, table)}; it has {has or 'none'}"


def component_names(table: Mapping[str, Quantity], name: str) -> list[str]:
    """Names of the components of a vector, in order."""
    own = [(x.component, k) for k, x in table.items() if x.of == name and x.component is not None]
    return [k for _, k in sorted(own)]


def single_quantity(model: Model, name: str) -> Quantity:
    """Return the scalar quantity of a name such as ``"slider.x"``, or of a sensor's name.

    Raises
    ------
    ModelError
        If there is none of that name, or it has several components; the message names similar ones.
    """
    owner, what = curve_parts(name, model) if isinstance(name, str) else ("", "")
    if not owner:
        raise ModelError(f"a quantity is named by a text, such as 'slider.x' or the name of a sensor, not {name!r}")
    table = quantities(model, owner)
    x = table.get(what or "value")
    if x is None and not what:
        listed = ", ".join(f"{owner}.{k}" for k, q in table.items() if not q.width)
        raise ModelError(f"{name!r} is a whole part ({model[owner].title}); name one of {listed or 'another part'}")
    if x is None:
        raise ModelError(unknown_quantity(model[owner].title if owner != ENERGY else ENERGY, what, table))
    if x.width:
        own = ", ".join(f"{owner}.{k}" for k in component_names(table, what))
        raise ModelError(f"{name!r} has {x.width} components" + (f"; name one: {own}" if own else ""))
    return x


def _effort(unit: str) -> str:
    return "N*m" if unit.startswith("rad") else "N"


def _unit_of(model: Model, text: str) -> str:
    owner, what = curve_parts(text, model)
    return quantities(model, owner)[what].unit


def has_switches(model: Model) -> bool:
    """Return whether there are switching elements or events."""
    return bool(getattr(model, "events", ())) or any(e.switches() for e in model.elements())


def _of_energy(touching: bool, switches: bool) -> Table:
    listed = ["kinetic", "potential", "total", "balance"]
    losses = ["friction_loss", "impact_loss", "numerical_loss"]
    listed += [*losses, "surface_work", "contact_elastic"] if touching else []
    listed += ["impact_loss"] if switches and not touching else []
    listed += ["event_work"] if switches else []
    return {k: Quantity("J", curve=k in listed, array=True) for k in (*listed, "gravity", "elastic")}


def _split(names: Iterable[str], unit: str, of: str, curve: bool = True) -> Table:
    """Return the components of a vector."""
    return {name: Quantity(unit, of, k, curve=curve) for k, name in enumerate(names)}


def _of_point(axes: str) -> Table:
    planar, n = len(axes) == 2, len(axes)
    out = _split(axes, "m", "position")
    if planar:
        out["angle"] = Quantity("rad", curve=True, array=True)
    out |= _split((f"v{a}" for a in axes), "m/s", "velocity") | _split((f"a{a}" for a in axes), "m/s^2", "acceleration")
    turning, turned = ("angular_velocity", "rad/s"), ("angular_acceleration", "rad/s^2")
    if planar:
        out |= {"omega": Quantity(turning[1], turning[0], curve=True), "alpha": Quantity(turned[1], turned[0])}
    else:
        out |= _split((f"omega_{a}" for a in axes), turning[1], turning[0])
        out |= _split((f"alpha_{a}" for a in axes), turned[1], turned[0], curve=False)
    for name, unit in (("position", "m"), ("velocity", "m/s"), ("acceleration", "m/s^2")):
        out[name] = Quantity(unit, array=True, width=n)
    for name, unit in (turning, turned):
        out[name] = Quantity(unit, array=True, width=0 if planar else n)
    return out | {"quaternion": Quantity("1", array=not planar, width=4), "rotation": Quantity("1", width=9)}


def _of_frame(axes: str) -> Table:
    """Return the quantities of a body or frame, in space with its angles of orientation, computed on demand."""
    out = _of_point(axes)
    for k in ORIENTATION_ANGLES if len(axes) == 3 else ():
        out |= {k: Quantity("rad"), f"{k}_rate": Quantity("rad/s")}
    return out


def _of_locks(model: Model, e: Body | Joint) -> Table:
    """Return the lock efforts of coordinates that events lock, one for each."""
    locked = {a.what for x in model.events for a in x.do if isinstance(a, Lock)}
    own = [
        k for k in e.measured(model.planar) if f"{e.name}.{k}" in locked or (e.name in locked and isinstance(e, Joint))
    ]
    units = {what: _effort(e.coordinates[what].unit) for what in own}
    return {f"{what}_effort": Quantity(unit, curve=True, array=True) for what, unit in units.items()}


def _of_contact(axes: str) -> Table:
    """Return the contact quantity of a body that may touch others: the sum of its contact forces."""
    out = _split((f"contact_f{a}" for a in axes), "N", "contact_force")
    return out | {"contact_force": Quantity("N", array=True, width=len(axes))}


def _of_member(axes: str) -> Table:
    """Return the quantities of a member of a set of bodies: those of a body without accelerations."""
    own = {k: x for k, x in _of_point(axes).items() if not x.unit.endswith("/s^2")}
    return own | _of_contact(axes)


def body_set_quantities(axes: str) -> Table:
    """Return the quantities of a whole set of bodies: arrays over time and bodies."""
    wholes = ("position", "angle", "velocity", "angular_velocity", "quaternion", "contact_force")
    return {k: x._replace(curve=False) for k, x in _of_member(axes).items() if k in wholes}


def _of_joint(e: Joint, axes: str) -> Table:
    planar = len(axes) == 2
    own = e.measured(planar)
    out: Table = {}
    for what, c in own.items():
        always = not c.singular  # other coordinates are computed on demand
        out[what] = Quantity(c.unit, curve=always, array=always)
        rate, second = (Quantity(c.unit + per, array=always) for per in ("/s", "/s^2"))
        if len(own) == 1:
            out |= {"rate": Quantity(rate.unit, f"{what}_rate", curve=True)}
            out |= {"acceleration": Quantity(second.unit, f"{what}_acceleration")}
        out |= {f"{what}_rate": rate._replace(curve=always and len(own) > 1), f"{what}_acceleration": second}
    if hasattr(e, "nearest") and "position" not in own:
        out["place"] = Quantity(e.place_unit, curve=True)
    if not e.blocks:  # what acts along its coordinates has efforts of its own
        return out
    return out | _of_wrench(axes) | ({"torque": Quantity("N*m", curve=True, array=True)} if planar else {})


def _of_wrench(axes: str) -> Table:
    """Return the quantities of a force and torque on a body: components, and vectors."""
    out = _split((f"f{a}" for a in axes), "N", "force")
    if len(axes) == 3:
        out |= _split((f"t{a}" for a in axes), "N*m", "torque")
    wide = len(axes) if len(axes) == 3 else 0
    return out | {
        "force": Quantity("N", array=True, width=len(axes)),
        "torque": Quantity("N*m", array=True, width=wide),
    }


def _of_force(model: Model, e: Force, axes: str) -> Table:
    units = {k: _output(model, e, unit) for k, unit in e.outputs.items()}
    out = {k: Quantity(unit, curve=True, array=True) for k, unit in units.items()}
    if isinstance(e, PathForce):
        inner = range(1, len(e.bodies) - 1)
        out |= {f"load_{k + 1}": Quantity("N", curve=k in inner, array=True) for k in range(len(e.bodies))}
        if getattr(e, "friction", None) is not None:
            out |= {f"tension_{k}": Quantity("N", curve=True, array=True) for k in range(1, len(e.bodies))}
        for k, radius in enumerate(getattr(e, "radii", None) or ()):
            if radius != 0.0:
                out[f"wrap_{k + 1}"] = Quantity("rad", curve=True, array=True)
    if isinstance(e, (BodyForce, TwoFrameForce)):
        out = _of_wrench(axes) | ({"tz": Quantity("N*m", "torque", curve=True)} if len(axes) == 2 else {}) | out
    return out | {k: Quantity(unit, array=True) for k, unit in (("energy", "J"), ("power", "W"), ("work", "J"))}


def _output(model: Model, e: Force, unit: str) -> str:
    """Return the unit of a force's output if it follows from the coordinate along which it acts."""
    if not isinstance(e, CoordinateForce) or unit not in ("", "/s", "effort"):
        return unit
    base = model.unit(e.along()[0], e)
    return {"": base, "/s": f"{base}/s", "effort": _effort(base)}[unit]


def _of_imu(axes: str) -> Table:
    f = {k: x._replace(array=True) for k, x in _split((f"f{a}" for a in axes), "m/s^2", "specific_force").items()}
    wholes = {"specific_force": Quantity("m/s^2", width=3), "angular_velocity": Quantity("rad/s", width=3)}
    if len(axes) == 2:
        return f | {"w": Quantity("rad/s", "angular_velocity", 2, curve=True, array=True)} | wholes
    w = {k: x._replace(array=True) for k, x in _split((f"w{a}" for a in axes), "rad/s", "angular_velocity").items()}
    return f | w | wholes


WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz", "force", "torque")
"""Components of a joint's reaction; the last two are magnitudes."""
EFFORTS = ("effort", "reversed")
"""Quantities of a force along a coordinate, and of a driver: the effort, and its reverse."""
SPIN = 5  # in the plane the torque is a scalar with sign


class TransmittedForce(NamedTuple):
    """A force or torque by name: its part, and which of `WRENCH` or `EFFORTS`."""

    element: Element
    column: int


def transmitted_force(model: Model, name: str) -> TransmittedForce | None:
    """Return the transmitted force of a name such as ``"A.fx"`` or ``"rope.tension"``; None if it is something else.

    ``"A.force"`` is the magnitude of a joint's force; in space ``"A.torque"`` that of its torque.
    """
    owner, what = curve_parts(name, model)
    e = model.find(owner)
    if isinstance(e, Joint) and e.blocks:
        if model.planar and what in ("fx", "fy", "force", "torque"):
            return TransmittedForce(e, SPIN if what == "torque" else WRENCH.index(what))
        return TransmittedForce(e, WRENCH.index(what)) if what in WRENCH and not model.planar else None
    if isinstance(e, CoordinateForce) and what in list(e.outputs)[2:3] and not _has_signals(model, e):
        if other := e.transmitted():
            return transmitted_force(model, other)
        way = getattr(e, "direction", 1.0)  # as results tell it
        return None if isinstance(way, str) else TransmittedForce(e, 0 if e.sign * way > 0.0 else 1)
    return TransmittedForce(e, 0) if isinstance(e, Driver) and what == "effort" else None


def _has_signals(model: Model, e: CoordinateForce) -> bool:
    """Return whether a controller that belongs to a force has what laws may read of it: of a rope with friction."""
    return isinstance(model.find(e.measured_with()), Controller)


class Curve(NamedTuple):
    """A curve such as A.angle without a sensor, and the element that uses it."""

    title: str
    of: str


def measured_quantity(model: Model, e: Sensor | Curve) -> tuple[str, str, int] | None:
    """Return what a sensor measures; see `Model.measured`."""
    owner, what = curve_parts(e.of, model)
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
        parts = " or ".join(f"{owner}.{k}" for k in component_names(table, what))
        raise ModelError(
            f"{e.title}: {e.of!r} has {x.width} numbers, and a sensor measures one"
            + (f"; measure {parts}" if parts else "")
        )
    if isinstance(found, (Body, Frame)):
        return _point_curves(owner, x.of or what, x.component, model.planar)
    if isinstance(found, Joint):
        own, name = found.measured(model.planar), x.of or what
        if name in own:
            return "coordinate", f"{owner}.{name}", 0
        name = name.removesuffix("_rate")
        return ("coordinate", f"{owner}.{name}", 1) if name in own else None
    if isinstance(found, CoordinateForce) and _has_signals(model, found):
        return None
    if isinstance(found, (TwoPointForce, CoordinateForce)) and what in found.outputs:
        order = list(found.outputs).index(what)
        return ("force", owner, order) if order < 2 else None
    return None


def _point_curves(owner: str, whole: str, component: int | None, planar: bool) -> tuple[str, str, int] | None:
    """Return the curves of a body or frame that laws may use: positions, angles, and their rates."""
    if whole in ("position", "velocity") and component is not None:
        return "coordinate", f"{owner}.{'xyz'[component]}", int(whole == "velocity")
    if planar and whole in ("angle", "angular_velocity"):
        return "coordinate", f"{owner}.angle", int(whole == "angular_velocity")
    angle = whole.removesuffix("_rate")
    if angle in ORIENTATION_ANGLES:
        return "coordinate", f"{owner}.{angle}", int(angle != whole)
    spin = whole == "angular_velocity" and component is not None
    return ("spin", f"{owner}.{'xyz'[component or 0]}", 1) if spin else None


def carrier_names(model: Model) -> list[str]:
    """Return the names of everything that can carry an element: bodies, frames, ground."""
    return [*(b.name for b in model.bodies), *(f.name for f in model.frames), GROUND]


def actual_kind(model: Model, name: str, requested: str) -> str:
    """Return '; 'A' is a Revolute' if a name means something else than expected."""
    found = model.find(name)
    return "" if found is None else f" ({name!r} is a {type(found).__name__}, no {requested})"


def check_units(model: Model, e: Element, env: Mapping[str, float]) -> None:
    """Refuse units that do not fit the coordinate or comparison of an element."""
    if isinstance(e, Controller):
        _check_set_point(model, e)
    if isinstance(e, CoordinateForce) and e.along():
        turning = model.unit(e.along()[0], e) == "rad"
        for name, pair in e.dimensions.items():
            value = getattr(e, name, None)
            if value is not None and name in fields_with(e.__class__, Unit):
                for x in value if isinstance(value, tuple) else (value,):
                    number(x, env, pair[turning], f"{name} of {e.title}")
            elif value is not None and name in fields_with(e.__class__, LawOf):
                tables = {x.name: x for x in model.tables}
                names = model.names_in_laws(fields_with(e.__class__, LawOf)[name])
                where = f"{e.words.get(name, name)} of {e.title}"
                law = law_expression(value, pair[turning], where, tables, names, any(is_curve(model, k) for k in names))
                if name in e.not_negative and law.names <= set(env) and not law.tables and law.function is None:
                    given = law.evaluate(env)
                    if not given.real >= 0.0:
                        raise ModelError(f"{where} is {given:g} {pair[turning]}; it must be zero or greater")
    for name, kinds in (e.dimensions if isinstance(e, Coupling) else getattr(e, "kinds", {})).items():
        value = getattr(e, name)
        for x in value if isinstance(value, tuple) else (value,):
            _value_in_units(x, kinds, env, f"{name} of {e.title}")


def _check_set_point(model: Model, e: Controller) -> None:
    """Refuse a set point of another kind than the measured curve; expressions have no known unit."""
    given = {k: x for k in e.compared if isinstance(x := getattr(e, k), str)}
    for (name, told), (_, curve) in permutations(given.items(), 2):
        owner, what = curve_parts(curve, model)
        table = quantities(model, owner) if model.find(owner) is not None else {}
        if what in table and table[what].unit and split_quantity(told) is not None:
            number(told, {}, table[what].unit, f"{name} of {e.title}")


def refuse_other_unit(model: Model, law: Any, unit: str, where: str) -> None:
    """Refuse a law that is a single curve of another kind than the unit; other expressions have no known unit."""
    if not isinstance(law, str) or not unit:
        return
    owner, what = curve_parts(law, model)
    table = quantities(model, owner) if model.find(owner) is not None else {}
    found = table[what or "value"].unit if (what or "value") in table else ""
    if found and powers_in_si(found) != powers_in_si(unit):
        raise ModelError(f"{where} is {law!r}, in {found}; it must be in {unit}")


def _value_in_units(value: Any, kinds: tuple[str, ...], env: Mapping[str, float], where: str) -> None:
    """Require that the value has one of these units."""
    problem: ModelError | None = None
    for kind in kinds if value is not None else ():
        try:
            number(value, env, kind, where)
            return
        except UnitError as error:
            problem = problem or error
    if problem is not None:
        raise problem
