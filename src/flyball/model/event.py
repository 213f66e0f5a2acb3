"""Events: a condition (a quantity that crosses zero) and the actions taken at that instant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator

from ..errors import ModelError
from .element import Element, ElementType, Law, LawOf, Laws, Name, Number, Point, Unit, Vector, element, python_data
from .messages import suggest


@dataclass(frozen=True)
class Action(metaclass=ElementType):
    """An action of an `Event` at its instant."""

    registry: ClassVar[dict[str, type[Action]]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        Action.registry[cls.__name__] = cls

    @property
    def title(self) -> str:
        """Return its kind and its target, for messages."""
        about = self.about()
        return f"{type(self).__name__} of {about!r}" if about else type(self).__name__

    def about(self) -> str:
        """Return its target: a parameter, joint, coordinate, element or body; empty if none."""
        return ""

    @property
    def description(self) -> str:
        """Return a description of what it does."""
        return f"{type(self).__name__} {self.about()}".strip()

    def laws(self) -> tuple[tuple[str, Law], ...]:
        """Return its expressions, evaluated at the instant: (field, as written)."""
        return ()


@element
class Stop(Action):
    """End the motion successfully: ``do=[fb.Stop()]``."""


@element
class Note(Action):
    """A text for the event's entry in the event list; it has no other effect.

    Parameters
    ----------
    text : str
    """

    text: Name = field(kw_only=False)


@element
class Set(Action):
    """Set a parameter, and everything that depends on it, or a state of a controller to a new value.

    It may change forces, laws and masses, but not positions: a length that determines positions cannot jump.

    Parameters
    ----------
    parameter : str
        Or a state of a controller, which continues from that value: ``"pid.integral"``.
    value : number, or an expression of parameters, ``t``, sensors and curves such as ``A.angle``
        The new value, evaluated at the instant with the old parameters: ``"2*k"`` doubles k.
    """

    parameter: Name = field(kw_only=False)
    value: Number = field(kw_only=False)

    def about(self) -> str:
        """Return the parameter."""
        return self.parameter

    def laws(self) -> tuple[tuple[str, Law], ...]:
        """Return the value."""
        return (("value", self.value),)


@element
class Lock(Action):
    """Lock a joint or coordinate at its current value; an impulse removes its velocity.

    Parameters
    ----------
    what : str
        A joint (all its coordinates), or one coordinate, ``"A.angle"`` or ``"slider.x"``. Also a joint, limit or rope
        that was released: it becomes active again. Or a driver that was released: it prescribes its coordinate again,
        by the changes of its law from the value at that instant, q = q0 + law(t) - law(t0), and an impulse gives the
        prescribed rate.
    """

    what: Name = field(kw_only=False)

    def about(self) -> str:
        """Return the joint or coordinate."""
        return self.what


@element
class Release(Action):
    """Unlock what was locked; or deactivate a joint that no event locks, a driver, a limit or a rope.

    Parameters
    ----------
    what : str
        A joint or coordinate that some event locks; another joint, whose bodies then separate; a limit; a rope; a
        driver, or a motor or actuator of given speed, which then neither prescribes its coordinate nor has an effort.
    """

    what: Name = field(kw_only=False)

    def about(self) -> str:
        """Return what is released."""
        return self.what


@element
class Impulse(Action):
    """An impulse: velocities change instantaneously, consistent with all constraints.

    Parameters
    ----------
    on : str
        A body, a frame fixed on one (the impulse acts at its origin), or a coordinate such as ``"A.angle"``.
    impulse : two or three numbers [N s], or one along a coordinate [N s] or [N m s]
        Numbers, or expressions of parameters, ``t``, sensors and curves, evaluated at the instant.
    at : point [m]
        Point of action on the body, in world coordinates of the drawn configuration; the centre of mass if not given.
    torque : number, or three numbers [N m s]
        Angular impulse on the body: about the normal in a planar mechanism.
    axes : ``"world"`` or ``"body"``
        Axes of the components.
    """

    on: Name = field(kw_only=False)
    impulse: Law | Laws | None = field(default=None, kw_only=False)
    at: Annotated[Point | None, Unit("m"), Vector()] = None
    torque: Law | Laws | None = None
    axes: Literal["world", "body"] = "world"

    hints: ClassVar[dict[str, str]] = {
        k: "an Impulse is an action of an event; options of impulse time stepping are fb.Stepping(step=...)"
        for k in (
            "step",
            "solver",
            "iterations",
            "position_iterations",
            "tolerance",
            "coulomb",
            "restitution",
            "impacts",
        )
    }

    def about(self) -> str:
        """Return the body or coordinate."""
        return self.on

    def laws(self) -> tuple[tuple[str, Law], ...]:
        """Return all components."""
        pairs = (("impulse", self.impulse), ("torque", self.torque))
        return tuple((k, x) for k, given in pairs for x in component_list(given))


def component_list(given: Any) -> tuple[Any, ...]:
    """Return the components of a vector; a number as one; none for None."""
    return () if given is None else given if isinstance(given, tuple) else (given,)


def _actions(value: Any) -> Any:
    """Convert plain data of a model file with a type to actions."""
    if isinstance(value, Mapping):
        fields = dict(value)
        kind, known = fields.pop("type", None), sorted(Action.registry)
        if kind not in Action.registry:
            problem = "an action has no type" if kind is None else f"unknown action {kind!r}{suggest(str(kind), known)}"
            raise ModelError(f"{problem}; actions are {', '.join(known)}")
        return Action.registry[kind](**fields)
    if isinstance(value, (list, tuple)):
        return tuple(_actions(v) for v in value)
    if isinstance(value, type) and issubclass(value, Action):
        raise ValueError(f"give {value.__name__}(...) with parentheses")
    if not isinstance(value, Action):
        raise ValueError(f"give actions such as {', '.join(f'fb.{k}(...)' for k in sorted(Action.registry))}")
    return value


def _tuple(value: Any) -> Any:
    made = _actions(value)
    return made if isinstance(made, tuple) else (made,)


Actions = Annotated[tuple[Action, ...], BeforeValidator(_tuple, json_schema_input_type=Action | tuple[Action, ...])]


START = "start"
"""In place of an expression: at the start of the motion."""
OPENING, CLOSING = "([{", ")]}"


def _count(value: Any) -> Any:
    """Convert to a whole number of at least 1."""
    value = python_data(value)
    if value is not None and (not isinstance(value, int) or value < 1):
        raise ValueError("give a whole number from 1")
    return value


@element
class Event(Element):
    """An event at the zero crossing of a quantity: recorded in ``run.events``, with the actions ``do`` executed.

    The instant is located to the tolerance of the motion. Names are those of laws (``t``, parameters, sensors, tables),
    curves of positions and velocities: ``A.angle``, ``A.angle_rate``, ``slider.vx``, ``spring.length``, and forces of
    joints, ropes, stops, friction, springs along coordinates and drivers: ``A.fx``, ``A.force`` (magnitude),
    ``rope.tension``, ``D.effort``.

    Parameters
    ----------
    name : str
    when : expression, or Python function
        The event occurs when it crosses zero, or becomes true: ``"A.angle - pi/2"`` and ``"A.angle > pi/2"`` are the
        same. ``"start"``: at the start of the motion, before everything else.
    direction : {"rising", "falling", "either"}
        Direction of the zero crossing.
    do : list of actions
        `Stop`, `Set`, `Lock`, `Release`, `Impulse`, `Note`; all simultaneous. If there is none, the event is only
        recorded.
    times : int
        Largest number of occurrences; unlimited if not given. A motion that continues from a result continues the
        count.
    """

    when: Law = field(kw_only=False)
    direction: Literal["rising", "falling", "either"] = "rising"
    do: Actions = ()
    times: Annotated[int | None, BeforeValidator(_count)] = None

    category: ClassVar[str] = "events"
    hints: ClassVar[dict[str, str]] = {
        "once": "it is called times, here times=1",
        "terminal": "it is called do, here do=[fb.Stop()]",
        "action": "it is called do",
        "actions": "it is called do",
        "condition": "it is called when",
    }

    @property
    def at_start(self) -> bool:
        """Return whether it occurs at the start of the motion."""
        return self.when == START

    @cached_property
    def law(self) -> Law:
        """Return the event function; for a comparison the difference of its sides."""
        return comparison_difference(self.when, self) if isinstance(self.when, str) else self.when

    @property
    def of(self) -> LawOf:
        """Return what its expressions may use."""
        return LawOf(None, curves=True, forces=True)

    @property
    def description(self) -> str:
        """Return a description of its condition and actions."""
        way = "" if self.at_start or self.direction == "rising" else f" ({self.direction})"
        often = "" if self.times is None else f", at most {self.times} times" if self.times > 1 else ", once"
        return f"{self.when}{way}{often}: {', '.join(a.description for a in self.do) or 'noted'}"

    def laws(self) -> tuple[tuple[str, Law], ...]:
        """Return all its expressions: location, and text as written."""
        own = () if self.at_start else ((f"when of {self.title}", self.law),)
        return own + tuple((f"{k} of {a.title} in {self.title}", x) for a in self.do for k, x in a.laws())

    def check(self, n: SimpleNamespace) -> None:
        """Refuse fields that have no meaning at the start."""
        if not self.at_start:
            return
        for name, usual in (("direction", "rising"), ("times", None)):
            if getattr(self, name) != usual:
                raise ModelError(f"{self.title}: {name} has no effect at the start; leave it out")
        if not self.do:
            raise ModelError(f"{self.title}: nothing is done at the start; give do=[...]")


def comparison_difference(text: str, e: Event) -> str:
    """Return an expression that rises through zero when a comparison becomes true; other expressions are unchanged.

    Raises
    ------
    ModelError
        If there are several comparisons, or logical operators.
    """
    sides = comparison_sides(text, e)
    if sides is None:
        return text
    small, large = sides
    return large if small in ("0", "0.0") else f"({large}) - ({small})"


def comparison_sides(text: str, e: Event) -> tuple[str, str] | None:
    """Return both sides of a comparison, the smaller one first; None if it is none. See `comparison_difference`."""
    depth, found = 0, []
    for k, c in enumerate(text):
        depth += (c in OPENING) - (c in CLOSING)
        if depth == 0 and c in "<>":
            found.append(k)
        if depth == 0 and c == "=" and text[k - 1 : k] not in ("<", ">"):
            raise ModelError(
                f"when of {e.title}: {text!r} is an equality; write the difference, as in 'A.angle - 1', and "
                "direction='either'"
            )
    if not found:
        return None
    if len(found) > 1:
        raise ModelError(
            f"when of {e.title}: {text!r} has {len(found)} comparisons; write one: both of two are true where "
            f"min(a, b) > 0, one of them where max(a, b) > 0"
        )
    at = found[0]
    left, right = text[:at].strip(), text[at + 1 :].removeprefix("=").strip()
    return (right, left) if text[at] == ">" else (left, right)
