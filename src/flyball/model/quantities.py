"""What a result says of each part: names, units, and which component of what. The one table of such names.

What only a result can compute is known by name already when a part is described, so that a wrong name is refused then;
views of a result, its curves, data sets, sensors and outputs of analyses all read this table.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, NamedTuple

from ..errors import ModelError
from .actions import Lock
from .body import Body, Driver, Frame
from .controller import Controller
from .coupling import Coupling
from .force import BodyForce, CoordinateForce, Force, TwoFrameForce
from .joint import Joint
from .sensor import IMU, Sensor
from .wiring import wiring_of
from .words import suggest

if TYPE_CHECKING:
    from .model import Model

ENERGY = "energy"  # the name under which a result has the energies of all
MOST = 256  # parts whose tables are kept
MEMBER = re.compile(r"(.*)\[(\d+)\]")  # of a set of bodies: "balls[17]"


class Quantity(NamedTuple):
    """One thing that a result says of a part, over time.

    Attributes
    ----------
    unit : str
    of : str
        The quantity that this is a component of, or is another name of; itself, if empty.
    component : int or None
        Which component of that.
    curve : bool
        Whether it is listed among the curves: columns of tables, plots of a whole part.
    array : bool
        Whether it stands in data sets.
    width : int
        How many numbers it has at one time; 0 for one plain number.
    """

    unit: str
    of: str = ""
    component: int | None = None
    curve: bool = False
    array: bool = False
    width: int = 0


Table = dict[str, Quantity]


def quantities(model: Model, name: str) -> Table:
    """Everything that a result says of a part (or of ``"energy"``), by name; not to be changed."""
    kept = getattr(model, "kept", None)  # of a snapshot
    return _told(model, name) if kept is None else kept.get("quantities", name, MOST, lambda: _told(model, name))


def _told(model: Model, name: str) -> Table:
    axes = "xy" if model.planar else "xyz"
    touching = bool(getattr(model, "contacts", ()))
    if name == ENERGY:
        return _of_energy(touching, switching(model))
    member = MEMBER.fullmatch(name)
    if member and member[1] in model.by_name and model[member[1]].category == "bulk":
        return _of_member(axes)
    e = model[name]
    if isinstance(e, Body):
        return _of_point(axes) | (_of_contact(axes) if touching else {}) | _of_locks(model, e)
    if isinstance(e, Frame):
        return _of_point(axes)
    if e.category == "bulk":
        return of_set(axes)
    if isinstance(e, Joint):
        return _of_joint(e, axes)
    if isinstance(e, Force):
        return _of_force(model, e, axes)
    if isinstance(e, Coupling):
        units = [_effort(model.unit(text, e)) for text in e.coupled()]
        return {f"effort_{k}": Quantity(unit, curve=True, array=True) for k, unit in enumerate(units, 1)}
    if isinstance(e, Driver):
        effort = Quantity(_effort(model.unit(e.coordinate, e)), curve=True, array=True)
        return {"effort": effort, "work": Quantity("J", curve=True, array=True)}
    if isinstance(e, IMU):
        return _of_imu(axes)
    if isinstance(e, Controller):
        return {k: Quantity("", curve=True, array=True) for k in wiring_of(model, e)}
    return {"value": Quantity(_unit_of(model, e.of), curve=True, array=True)} if isinstance(e, Sensor) else {}


def unknown(owner: str, what: str, table: Mapping[str, Quantity]) -> str:
    """What to say of a name that a part has not."""
    curves = [k for k, x in table.items() if x.curve]
    rest = [k for k, x in table.items() if not x.curve]
    has = ", ".join(curves) + (f"; as wholes or by other names: {', '.join(rest)}" if rest else "")
    return f"{owner} has no curve {what!r}{suggest(what, table)}; it has {has or 'none'}"


def components(table: Mapping[str, Quantity], name: str) -> list[str]:
    """Names of the components of a vector, in order."""
    own = [(x.component, k) for k, x in table.items() if x.of == name and x.component is not None]
    return [k for _, k in sorted(own)]


def one(model: Model, name: str) -> Quantity:
    """The quantity of a name such as ``"slider.x"``, or of a sensor's name: one number at a time.

    Raises
    ------
    ModelError
        If there is none of that name, or it has several components; the message names what comes near.
    """
    owner, dot, what = name.partition(".") if isinstance(name, str) else ("", "", "")
    if not owner:
        raise ModelError(f"a quantity is named by a text, such as 'slider.x' or the name of a sensor, not {name!r}")
    table = quantities(model, owner)
    x = table.get(what if dot else "value")
    if x is None and not dot:
        listed = ", ".join(f"{owner}.{k}" for k, q in table.items() if not q.width)
        raise ModelError(f"{name!r} is a whole part ({model[owner].title}); name one of {listed or 'another part'}")
    if x is None:
        raise ModelError(unknown(model[owner].title if owner != ENERGY else ENERGY, what, table))
    if x.width:
        own = ", ".join(f"{owner}.{k}" for k in components(table, what))
        raise ModelError(f"{name!r} has {x.width} components" + (f"; name one: {own}" if own else ""))
    return x


def _effort(unit: str) -> str:
    return "N*m" if unit == "rad" else "N"


def _unit_of(model: Model, text: str) -> str:
    owner, _, what = text.partition(".")
    return quantities(model, owner)[what].unit


def switching(model: Model) -> bool:
    """Whether there is something that holds at times and lets go at others, or events."""
    return bool(getattr(model, "events", ())) or any(e.switches() for e in model.elements())


def _of_energy(touching: bool, switches: bool) -> Table:
    listed = ["kinetic", "potential", "total", "balance"]
    losses = ["friction_loss", "impact_loss", "numerical_loss"]
    listed += [*losses, "surface_work", "contact_elastic"] if touching else []
    listed += ["impact_loss"] if switches and not touching else []
    listed += ["event_work"] if switches else []
    return {k: Quantity("J", curve=k in listed, array=True) for k in (*listed, "gravity", "elastic")}


def _split(names: Iterable[str], unit: str, of: str, curve: bool = True) -> Table:
    """The components of a vector."""
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


def _of_locks(model: Model, body: Body) -> Table:
    """Of a body with coordinates that events lock: what holds them, along each."""
    locked = [a.what for e in model.events for a in e.do if isinstance(a, Lock)]
    own = dict.fromkeys(what for owner, _, what in (x.rpartition(".") for x in locked) if owner == body.name)
    units = {what: _effort("rad" if what == "angle" else "m") for what in own}
    return {f"{what}_effort": Quantity(unit, curve=True, array=True) for what, unit in units.items()}


def _of_contact(axes: str) -> Table:
    """Of a body that may touch others: the sum of its contact forces."""
    out = _split((f"contact_f{a}" for a in axes), "N", "contact_force")
    return out | {"contact_force": Quantity("N", array=True, width=len(axes))}


def _of_member(axes: str) -> Table:
    """Of one of a set of bodies: as of any other, but for accelerations."""
    own = {k: x for k, x in _of_point(axes).items() if not x.unit.endswith("/s^2")}
    return own | _of_contact(axes)


def of_set(axes: str) -> Table:
    """Of a whole set of bodies: arrays over time and bodies."""
    wholes = ("position", "angle", "velocity", "angular_velocity", "quaternion", "contact_force")
    return {k: x._replace(curve=False) for k, x in _of_member(axes).items() if k in wholes}


def _of_joint(e: Joint, axes: str) -> Table:
    planar = len(axes) == 2
    own = e.measured(planar)
    out: Table = {}
    for what, c in own.items():
        out[what] = Quantity(c.unit, curve=True, array=True)
        rate, second = (Quantity(c.unit + per, array=True) for per in ("/s", "/s^2"))
        if len(own) == 1:
            out |= {"rate": Quantity(rate.unit, f"{what}_rate", curve=True)}
            out |= {"acceleration": Quantity(second.unit, f"{what}_acceleration")}
        out |= {f"{what}_rate": rate._replace(curve=len(own) > 1), f"{what}_acceleration": second}
    if hasattr(e, "nearest"):
        out["place"] = Quantity("m", curve=True)
    return out | _of_wrench(axes) | ({"torque": Quantity("N*m", curve=True, array=True)} if planar else {})


def _of_wrench(axes: str) -> Table:
    """Of a force and torque on a body: components, and wholes."""
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
    if isinstance(e, (BodyForce, TwoFrameForce)):
        out = _of_wrench(axes) | ({"tz": Quantity("N*m", "torque", curve=True)} if len(axes) == 2 else {}) | out
    return out | {k: Quantity(unit, array=True) for k, unit in (("energy", "J"), ("power", "W"), ("work", "J"))}


def _output(model: Model, e: Force, unit: str) -> str:
    """Unit of one of a force's outputs, where it follows from the coordinate that it acts along."""
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
