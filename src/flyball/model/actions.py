"""What is done at an event: one class for each kind of action."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator

from ..errors import ModelError
from .element import Law, Laws, Name, Number, Point, Unit, Vector, element
from .words import suggest


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
        return tuple((k, x) for k, given in pairs for x in listed(given))


def listed(given: Any) -> tuple[Any, ...]:
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
