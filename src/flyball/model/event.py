"""Events: what is to happen when a quantity passes zero."""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator

from ..errors import ModelError
from .actions import Actions
from .element import Element, Law, LawOf, element, plain

START = "start"
"""In place of an expression: at the start of the motion."""
OPENING, CLOSING = "([{", ")]}"


def _count(value: Any) -> Any:
    """A whole number from 1."""
    value = plain(value)
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
        return difference(self.when, self) if isinstance(self.when, str) else self.when

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


def difference(text: str, e: Event) -> str:
    """An expression whose rise through zero is where a comparison becomes true; what is none is itself.

    Raises
    ------
    ModelError
        If there are several comparisons, or words between them.
    """
    sides = compared(text, e)
    if sides is None:
        return text
    small, large = sides
    return large if small in ("0", "0.0") else f"({large}) - ({small})"


def compared(text: str, e: Event) -> tuple[str, str] | None:
    """Both sides of a comparison, first the one that is to be less; None if it is none. See `difference`."""
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
