"""Laws that jump where the motion comes to a place: what the variational equations say nothing of.

A motion that meets a jump of a force at an instant that depends on its course changes by a further term there (the
saltation matrix: Aizerman and Gantmakher 1958). It is not followed: such laws are refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from ...errors import ModelError
from ...model.element import LawOf, fields_with
from ...model.expressions import Expression
from ...model.model import Model
from ...model.wiring import wired

DECIDING = ("<", "<=", "sign")
SMOOTH = (
    "Write what is smooth, for instance step(x, x0, y0, x1, y1) or tanh(x/width), "
    "and max(0, x) for a force that sets in"
)


def refuse_jumps(model: Model, to: Sequence[str]) -> None:
    """Refuse laws that decide by the motion, or at a time that is one of the parameters asked for.

    Raises
    ------
    ModelError
        Naming the element and what its law decides by.
    """
    for title, law in laws(model):
        if by := _decides(law, model, to):
            raise ModelError(
                f"{title}: its law {law.text!r} decides by {by!r}, so it may jump at an instant that the parameters "
                f"shift, and the sensitivity of a motion does not follow jumps. {SMOOTH}"
            )


def refuse_switching(model: Model, to: Sequence[str]) -> None:
    """The same of the rates of controllers' states."""
    for x in wired(model):
        if by := _decides(x.law, model, to):
            instead = x.controller.smoother(x.state) or SMOOTH
            raise ModelError(
                f"{x.controller.title}: the rate of {x.name!r} decides by {by!r}, so it may jump at an instant that "
                f"the parameters shift, and the sensitivity of a motion does not follow jumps. {instead}"
            )


def _decides(law: Expression, model: Model, to: Sequence[str]) -> str:
    """What a law decides by at instants that parameters shift; empty if it does not."""
    for node in law.tree.walk():
        if node.kind in DECIDING:
            names = {n.value for n in node.walk() if n.kind == "name"}
            state = sorted(names - {"t"} - set(model.parameters))
            moved = sorted(names & set(to)) if "t" in names else []
            if state or moved:
                return str((state or moved)[0])
    return ""


def laws(model: Model) -> Iterator[tuple[str, Expression]]:
    """Titles of forces and drivers with their laws."""
    given: list[tuple[Any, Any, LawOf]] = [(d, d.law, LawOf(model.unit(d.coordinate, d))) for d in model.drivers]
    for e in model.forces:
        for field, of in fields_with(e.__class__, LawOf).items():
            value = getattr(e, field)
            given += [(e, law, of) for law in (value if isinstance(value, tuple) else (value,)) if law is not None]
    for e, law, of in given:
        if (found := model.law(law, of, e.title)) is not None:
            yield e.title, found
