"""What analyses say of a mechanism that touches, when they know no contact."""

from __future__ import annotations

from collections.abc import Iterator

from ..errors import ModelError
from ..model.element import Element
from ..model.model import Model


def touching_parts(model: Model) -> Iterator[Element]:
    """Parts that only a motion by impulses knows: contacts, limits, many bodies."""
    yield from (*model.contacts, *(e for e in model.limits if not e.acts()), *model.bulk)


def refuse_contact(model: Model, analysis: str) -> None:
    """Refuse to answer as if parts were not there.

    Raises
    ------
    ModelError
        If the mechanism has a contact, a limit or many bodies.
    """
    parts = list(touching_parts(model))
    if parts:
        without = ", ".join(f"{e.name!r}: None" for e in parts)
        raise ModelError(
            f"{model.name!r} has {', '.join(e.title for e in parts)}, and {analysis} knows no contact, limits or "
            f"Bodies; simulate does. Without them: m.changed({{{without}}}).{analysis}(...)"
        )


def left_out(model: Model) -> str:
    """What freedoms are counted without, as a sentence; empty if that is nothing."""
    parts = [e.title for e in (*model.contacts, *model.limits) if not (e in model.limits and e.acts())]
    out = f"{', '.join(parts)}: freedoms and the start are those without" if parts else ""
    bulk = [f"the {e.count} bodies of {e.title}" for e in model.bulk]
    return "; ".join(x for x in (out, f"{', '.join(bulk)}: not counted in freedoms" if bulk else "") if x)
