"""Events: a condition (a quantity that crosses zero) and the actions taken at that instant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator

from ..errors import ModelError
from .element import Element, Law, LawOf, Laws, Name, Number, Point, Unit, Vector, element, python_data
from .messages import suggest


@dataclass(frozen=True)
class Action:
    """Something that an `Event` does at its instant."""

    registry: ClassVar[dict[str, type[Action]]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        Action.registry[cls.__name__] = cls

    @property
    def title(self) -> str:
        """Its kind, and what it is about, for messages."""
        about = self.about()
        return f"{type(self).__name__} of {about!r}" if about else type(self).__name__

    def about(self) -> str:
        """What it acts on: a parameter, joint, coordinate, element or body; nothing if empty."""
        return ""

    @property
    def told(self) -> str:
        """What it does, in words."""
        return f"{type(self).__name__} {self.about()}".strip()

    def laws(self) -> tuple[tuple[str, Law], ...]:
        """Its expressions, evaluated at the instant: (field, what was written)."""
        return ()


@element
class Stop(Action):
    """The motion ends there, with success: ``do=[fb.Stop()]``."""


@element
class Note(Action):
    """A text to go with the event in the list of what happened; nothing is done.

    Parameters
    ----------
    text : str
    """

    text: Name = field(kw_only=False)


@element
class Set(Action):
    """A parameter has another value from then on, and all that is written with it; or a state of a controller has.

    It may change forces, laws and masses, but not where anything is: a length that bodies hang on cannot jump.

    Parameters
    ----------
    parameter : str
        Or a state of a controller, which goes on from that value: ``"pid.integral"``.
    value : number, or an expression of parameters, ``t``, sensors and curves such as ``A.angle``
        Its value from then on, reckoned at the instant, all parameters as they were before: ``"2*k"`` doubles k.
    """

    parameter: Name = field(kw_only=False)
    value: Number = field(kw_only=False)

    def about(self) -> str:
        """The parameter."""
        return self.parameter

    def laws(self) -> tuple[tuple[str, Law], ...]:
        """The value."""
        return (("value", self.value),)


@element
class Lock(Action):
    """A joint or coordinate holds where it is then; its velocity is taken away by an impulse.

    Parameters
    ----------
    what : str
        A joint (all its coordinates), or one coordinate, ``"A.angle"`` or ``"slider.x"``. Also a joint, limit or rope
        that was released: it holds again.
    """

    what: Name = field(kw_only=False)

    def about(self) -> str:
        """The joint or coordinate."""
        return self.what


@element
class Release(Action):
    """What was locked moves freely again; a joint that no event locks, a limit or a rope lets go.

    Parameters
    ----------
    what : str
        A joint or coordinate that some event locks; a joint that none does, whose bodies part; a limit; a rope.
    """

    what: Name = field(kw_only=False)

    def about(self) -> str:
        """What is let go."""
        return self.what


@element
class Impulse(Action):
    """A blow: velocities change at once, through all constraints.

    Parameters
    ----------
    on : str
        A body, a frame fixed on one, at whose origin it acts, or a coordinate such as ``"A.angle"``.
    impulse : two or three numbers [N s], or one along a coordinate [N s] or [N m s]
        Numbers, or expressions of parameters, ``t``, sensors and curves, reckoned at the instant.
    at : point [m]
        Of the body, where it acts, in world coordinates of the drawn configuration; the centre of mass if not given.
    torque : number, or three numbers [N m s]
        Impulse of a torque on the body: about the normal in a planar mechanism.
    axes : ``"world"`` or ``"body"``
        Whose axes the components are along.
    """

    on: Name = field(kw_only=False)
    impulse: Law | Laws | None = field(default=None, kw_only=False)
    at: Annotated[Point | None, Unit("m"), Vector()] = None
    torque: Law | Laws | None = None
    axes: Literal["world", "body"] = "world"

    hints: ClassVar[dict[str, str]] = {
        k: "an Impulse is a blow at an event; choices of steps by impulses are fb.Stepping(step=...)"
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
        """The body or coordinate."""
        return self.on

    def laws(self) -> tuple[tuple[str, Law], ...]:
        """All components."""
        pairs = (("impulse", self.impulse), ("torque", self.torque))
        return tuple((k, x) for k, given in pairs for x in component_list(given))


def component_list(given: Any) -> tuple[Any, ...]:
    """Components of a vector; one of a number; none of nothing."""
    return () if given is None else given if isinstance(given, tuple) else (given,)


def _actions(value: Any) -> Any:
    """Actions, or plain data of a model file that says their type."""
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


Actions = Annotated[tuple[Action, ...], BeforeValidator(_tuple)]


START = "start"
"""In place of an expression: at the start of the motion."""
OPENING, CLOSING = "([{", ")]}"


def _count(value: Any) -> Any:
    """A whole number from 1."""
    value = python_data(value)
    if value is not None and (not isinstance(value, int) or value < 1):
        raise ValueError("give a whole number from 1")
    return value


@element
class Event(Element):
    """Something happens when a quantity passes zero: it is noted in ``run.events``, and what ``do`` says is done.

    The instant is found to the tolerance of the motion. Names are those that laws know (``t``, parameters, sensors,
    tables), curves of positions and velocities: ``A.angle``, ``A.angle_rate``, ``slider.vx``, ``spring.length``, and
    what joints, ropes, stops, friction, springs along coordinates and drivers carry: ``A.fx``, ``A.force`` (its size),
    ``rope.tension``, ``D.effort``.

    Parameters
    ----------
    name : str
    when : expression, or Python function
        The event is where it passes zero, or becomes true: ``"A.angle - pi/2"`` and ``"A.angle > pi/2"`` are the same.
        ``"start"``: at the start of the motion, before all else.
    direction : {"rising", "falling", "either"}
        Which way it passes zero.
    do : list of actions
        `Stop`, `Set`, `Lock`, `Release`, `Impulse`, `Note`; all at once. Only noted if there is none.
    times : int
        How often it happens at most; however often if not given. A motion that goes on from a result counts on.
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
        """Whether it happens at the start of the motion."""
        return self.when == START

    @cached_property
    def law(self) -> Law:
        """What passes zero: of a comparison the difference of its sides."""
        return comparison_difference(self.when, self) if isinstance(self.when, str) else self.when

    @property
    def of(self) -> LawOf:
        """What its expressions may use."""
        return LawOf(None, curves=True, forces=True)

    @property
    def told(self) -> str:
        """When it is, and what it does, in words."""
        way = "" if self.at_start or self.direction == "rising" else f" ({self.direction})"
        often = "" if self.times is None else f", at most {self.times} times" if self.times > 1 else ", once"
        return f"{self.when}{way}{often}: {', '.join(a.told for a in self.do) or 'noted'}"

    def laws(self) -> tuple[tuple[str, Law], ...]:
        """All its expressions: where each stands, and what was written."""
        own = () if self.at_start else ((f"when of {self.title}", self.law),)
        return own + tuple((f"{k} of {a.title} in {self.title}", x) for a in self.do for k, x in a.laws())

    def check(self, n: SimpleNamespace) -> None:
        """Refuse what means nothing at the start."""
        if not self.at_start:
            return
        for name, usual in (("direction", "rising"), ("times", None)):
            if getattr(self, name) != usual:
                raise ModelError(f"{self.title}: {name} has no effect at the start; leave it out")
        if not self.do:
            raise ModelError(f"{self.title}: nothing is done at the start; give do=[...]")


def comparison_difference(text: str, e: Event) -> str:
    """An expression whose rise through zero is where a comparison becomes true; what is none is itself.

    Raises
    ------
    ModelError
        If there are several comparisons, or words between them.
    """
    sides = comparison_sides(text, e)
    if sides is None:
        return text
    small, large = sides
    return large if small in ("0", "0.0") else f"({large}) - ({small})"


def comparison_sides(text: str, e: Event) -> tuple[str, str] | None:
    """Both sides of a comparison, first the one that is to be less; None if it is none. See `comparison_difference`."""
    depth, found = 0, []
    for k, c in enumerate(text):
        depth += (c in OPENING) - (c in CLOSING)
        if depth == 0 and c in "<>":
            found.append(k)
        if depth == 0 and c == "=" and text[k - 1 : k] not in ("<", ">"):
            raise ModelError(
                f"when of {e.title}: {text!r} asks for equality; write the difference, as in 'A.angle - 1', and "
                f"direction='either'"
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
