"""Checks of events: names exist, and actions are consistent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..errors import ModelError
from .body import GROUND, Body, Driver, Frame
from .controller_signals import controller_states
from .element import LawOf, si_numbers
from .event import START, Action, Event, Impulse, Lock, Release, Set, Stop, comparison_sides, component_list
from .expressions import is_number_text
from .force import Force
from .joint import Joint
from .messages import listing, suggest
from .names import curve_parts, is_curve
from .quantities import quantities
from .units import same_kind

if TYPE_CHECKING:
    from .model import Model


@dataclass(frozen=True)
class LockTarget:
    """What an action locks or releases.

    Attributes
    ----------
    coordinates : tuple of str
        Locked coordinates, each with its own row: ``"A.angle"``.
    joint : str
        Or the joint whose own rows are switched on or off.
    driver : str
        Or the driver that is switched on or off.
    element : str
        Or the limit or rope that is switched on or off.
    """

    coordinates: tuple[str, ...] = ()
    joint: str = ""
    driver: str = ""
    element: str = ""

    def keys(self) -> tuple[str, ...]:
        """Return what must not be locked and released at the same instant."""
        return self.coordinates or (self.joint or self.driver or self.element,)


def lock_target(model: Model, e: Event, a: Lock | Release) -> LockTarget:
    """Return what the action ``a`` locks or releases.

    Raises
    ------
    ModelError
        If there is no such part, or it cannot be locked or released.
    """
    what = f"{e.title}: {a.title}"
    if is_curve(model, a.what):
        model.coordinate(a.what, e)
        return LockTarget((a.what,))
    found = model.find(a.what)
    if isinstance(found, Joint):
        own = tuple(f"{a.what}.{k}" for k in found.locked(model.planar))
        if isinstance(a, Release):
            every = (f"{a.what}.{k}" for k in found.measured(model.planar))
            own += tuple(x for x in every if x not in own and _locked_somewhere(model, e, {x}))
        if own and (isinstance(a, Lock) or _locked_somewhere(model, e, {a.what, *own})):
            return LockTarget(own)
        if not found.rows(model.planar):
            raise ModelError(f"{what}: {found.title} has nothing that can be released")
        return LockTarget(joint=a.what)
    if found is not None and (found.category == "limits" or getattr(found, "single", "") == "rope"):
        parts = [p.name for p in found.parts(model) if p.category == "limits"]
        if not parts and not found.switches():
            raise ModelError(
                f"{what}: {found.title} has friction, and forces in place of a limit; set a parameter in its stiffness "
                "and damping with fb.Set, or give it no friction"
            )
        return LockTarget(element=parts[0] if parts else a.what)
    if driver := _driver_of(model, found):
        _refuse_sensors(model, what, driver)
        return LockTarget(driver=driver.name)
    if found is None:
        known = [*(j.name for j in model.joints), *(d.name for d in model.drivers), *(x.name for x in model.limits)]
        raise ModelError(
            f"{what}: there is no part named {a.what!r}{suggest(a.what, known)}; "
            f"name a joint, a coordinate such as 'A.angle', a driver, a limit or a rope"
        )
    if isinstance(found, (Body, Frame)):
        own = tuple(found.measured(model.planar))
        raise ModelError(
            f"{what}: {found.title} has the coordinates {', '.join(own)}; name one, as in '{a.what}.x', or fix it "
            "with a Fixed joint that another event releases"
        )
    raise ModelError(
        f"{what}: {found.title} is no joint, coordinate, driver, limit or rope; a force is switched off by fb.Set of a "
        f"parameter in its numbers or laws"
    )


def _driver_of(model: Model, found: Any) -> Driver | None:
    """Return a driver, or that of an element which consists of one and other parts, such as a motor of given speed."""
    if isinstance(found, Driver):
        return found
    parts = found.parts(model) if isinstance(found, Force) else ()
    return next((p for p in parts if isinstance(p, Driver)), None)


def _refuse_sensors(model: Model, what: str, driver: Driver) -> None:
    """Refuse a driver of a position whose law reads sensors: its row depends on what they measure."""
    law = model.law(driver.law, LawOf(model.unit(driver.coordinate, driver)), f"law of {driver.title}", driver=True)
    sensors = sorted(law.names & {x.name for x in model.sensors}) if law is not None else []
    if sensors and not driver.of_rate:
        raise ModelError(
            f"{what}: the law of {driver.title} reads {', '.join(sensors)}, and events switch drivers of positions "
            "only where the law is one of time; prescribe the rate, or use an Actuator or a Motor"
        )


def _locked_somewhere(model: Model, e: Event, names: set[str]) -> bool:
    """Return whether an event locks one of these."""
    every = (*(x for x in model.events if x.name != e.name), e)
    return any(isinstance(a, Lock) and a.what in names for x in every for a in x.do)


VALUE_LAW = LawOf(None, curves=True)
"""Names that the values of event actions may use."""


def check_event(model: Model, e: Event) -> None:
    """Refuse unknown names, expressions that never change, and contradictory actions.

    Raises
    ------
    ModelError
        Naming the event, the action, the value, the rule and a remedy.
    """
    if e.at_start:
        if START in {*model.parameters, *(x.name for x in model.sensors)}:
            raise ModelError(
                f"{e.title}: when is {START!r}, the start of the motion, and {model.name!r} has a parameter or "
                f"sensor of that name; rename that, or write an expression"
            )
    else:
        _check_when(model, e)
    for a in e.do:
        _check_action(model, e, a)
    _refuse_contradictions(model, e)


def _check_when(model: Model, e: Event) -> None:
    """Require that the condition depends on something that changes during a motion."""
    law = model.law(e.law, e.of, f"when of {e.title}")
    set_anywhere = {a.parameter for x in (*model.events, e) for a in x.do if isinstance(a, Set)}
    _refuse_unlike(model, e)
    if law is not None and law.function is None and law.names <= {*model.parameters} - set_anywhere:
        raise ModelError(
            f"{e.title}: when is {e.when!r}, which never changes; name t, a sensor, or a curve such as 'A.angle' in it"
        )


def _refuse_unlike(model: Model, e: Event) -> None:
    """Require that a curve is compared with a quantity of its own kind: not a length with an angle."""
    if not isinstance(e.when, str) or (sides := comparison_sides(e.when, e)) is None:
        return
    for curve, quantity in (sides, sides[::-1]):
        name, what = curve_parts(curve, model)
        if what and model.find(name) is not None and is_number_text(quantity):
            known = quantities(model, name).get(what)
            if known is not None and known.unit:
                same_kind(f"1 {known.unit}", quantity, f"{e.title}: in {e.when!r} {curve}")


def _check_action(model: Model, e: Event, a: Action) -> None:
    if isinstance(a, Set):
        states = [x.name for x in controller_states(model) if not x.signal] if model.with_states() else []
        if a.parameter in states:
            model.law(a.value, VALUE_LAW, f"value of {a.title} in {e.title}")
            return
        if a.parameter not in model.parameters:
            known = [*model.parameters, *states]
            raise ModelError(
                f"{e.title}: {a.title}: {model.name!r} has no parameter {a.parameter!r}"
                f"{suggest(a.parameter, known)}; {listing(known)}"
            )
        where = f"value of {a.title} in {e.title}"
        model.law(a.value, VALUE_LAW, where)
        old = model.parameters[a.parameter]
        if isinstance(a.value, str) and isinstance(old, str) and is_number_text(a.value) and is_number_text(old):
            same_kind(old, a.value, where)
    elif isinstance(a, (Lock, Release)):
        for text in lock_target(model, e, a).coordinates:
            for d in model.drivers:
                _refuse_driven(e, a, d, text)
    elif isinstance(a, Impulse):
        _check_impulse(model, e, a)


def _refuse_driven(e: Event, a: Action, d: Driver, text: str) -> None:
    if d.moved == text:
        raise ModelError(
            f"{e.title}: {a.title}: {d.title} prescribes {text!r}, so nothing can be locked there; use an Actuator or "
            "a Motor, or a law that becomes constant: where(t < 1, t, 1)"
        )


def _check_impulse(model: Model, e: Event, a: Impulse) -> None:
    """Require two or three components on a body, one along a coordinate."""
    what = f"{e.title}: {a.title}"
    if a.impulse is None and a.torque is None:
        raise ModelError(f"{what}: it is none; give impulse=..., such as fb.Impulse('ball', (1, 0))")
    found = model.find(a.on)
    if isinstance(found, (Body, Frame)) or a.on == GROUND:
        if model.carrier(a.on, e) == GROUND:
            raise ModelError(f"{what}: an impulse on ground has no effect; name a body")
        n = 2 if model.planar else 3
        _components(what, "impulse", a.impulse, n, "(0, 1)" if model.planar else "(0, 0, 1)")
        _components(what, "torque", a.torque, 1 if model.planar else 3, "0.5" if model.planar else "(0, 0, 0.5)")
        if a.at is not None and len(a.at) not in (n, 3):
            raise ModelError(f"{what}: at needs {n} components, got {a.at}")
        si_numbers(a.at, model.environment(), "m", f"at of {a.title} in {e.title}")
        if a.at is not None and a.impulse is None:
            raise ModelError(f"{what}: at has no effect on the impulse of a torque alone; leave it out")
        units = {"impulse": "N*s", "torque": "N*m*s"}
    else:
        text = coordinate_of(model, e, a)
        for name, usual in (("torque", None), ("at", None), ("axes", "world")):
            if getattr(a, name) != usual:
                raise ModelError(f"{what}: {name} is of a body; along a coordinate give one number: impulse=...")
        _components(what, "impulse", a.impulse, 1, "0.5")
        units = {"impulse": "N*m*s" if model.unit(text, e) == "rad" else "N*s"}
    for name, law in a.laws():
        model.law(law, LawOf(units[name], curves=True), f"{name} of {a.title} in {e.title}")


def coordinate_of(model: Model, e: Event, a: Impulse) -> str:
    """Return the coordinate along which an impulse acts: one that is named, or the only one of a joint."""
    found = model.find(a.on)
    if is_curve(model, a.on):
        model.coordinate(a.on, e)
        return a.on
    if not isinstance(found, Joint):
        known = [*(b.name for b in model.bodies), *(f.name for f in model.frames), *(j.name for j in model.joints)]
        raise ModelError(
            f"{e.title}: {a.title}: there is no body, frame or joint named {a.on!r}{suggest(a.on, known)}; "
            f"{listing(known)}"
        )
    own = list(found.measured(model.planar))
    if len(own) != 1:
        raise ModelError(
            f"{e.title}: {a.title}: {found.title} has {len(own)} coordinates"
            + (f"; name one: {', '.join(f'{a.on}.{k}' for k in own)}" if own else "; name a body")
        )
    return f"{a.on}.{own[0]}"


def _components(what: str, name: str, given: Any, n: int, example: str) -> None:
    if given is not None and len(component_list(given)) != n:
        raise ModelError(f"{what}: {name} needs {n} component{'s' if n > 1 else ''}, such as {example}, got {given!r}")


def _refuse_contradictions(model: Model, e: Event) -> None:
    """Require that there is one action for each target, and that nothing is locked and released at the same instant."""
    done: dict[str, Action] = {}
    for a in e.do:
        if isinstance(a, (Lock, Release)):
            keys = lock_target(model, e, a).keys()
        else:
            keys = (f"parameter {a.about()}",) if isinstance(a, Set) else ("the end",) if isinstance(a, Stop) else ()
        for key in keys:
            if key in done:
                first = done[key]
                rule = "each may be given once" if type(first) is type(a) else "they contradict each other"
                raise ModelError(f"{e.title}: {first.title} and {a.title} are both in do, and {rule}; leave one out")
            done[key] = a
