"""Elements that an analysis does not support (contacts, events, controllers, locks): refused by name.

Each analysis names the kinds that it knows: it answers for what holds at the place that it is asked about, or
refuses the element (`docs/events.md` has the table; `tests/events/test_every_analysis.py` asks every one of every
element).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

from ..constraints.switch_kinds import ELASTIC, FRICTION
from ..errors import ModelError
from .element import Element
from .model import Model

SLIDING = frozenset({FRICTION})
"""Kinds that are forces while they slide: what has no modes takes them for sliding, by the sign of the rate."""
CONTACT_CATEGORIES = ("contacts", "limits", "bulk")
REPLACEMENT_OPTIONS = {"stick_speed": "regularised", "stiffness": "elastic"}
"""Numbers that make a part a plain force if they are given, and what it is then called."""


def unsupported_elements(model: Model, knows: Collection[int] = ()) -> Iterator[Element]:
    """Parts that only a motion knows: contacts, many bodies, events, and what holds at times.

    What is elastic is a force anywhere; ``knows`` are other kinds (`constraints.modes`) that are left out.
    """
    known = {ELASTIC, *knows}
    yield from (*model.contacts, *model.bulk)
    for e in model.elements():
        if e.category == "events" or any(w.kind not in known for w in e.switches()):
            yield e


def refuse_unsupported(model: Model, analysis: str, knows: Collection[int] = (), *, controlled: bool = False) -> None:
    """Refuse to answer as if parts were not there.

    Raises
    ------
    ModelError
        If the mechanism has a contact, many bodies, an event, or another part that holds at times, of no kind that the
        analysis ``knows``; or a controller, unless it knows those or they do not matter to it (``controlled``).
    """
    if not controlled:
        refuse_controllers(model, analysis)
    parts = list(unsupported_elements(model, knows))
    if not parts:
        return
    without = ", ".join(f"{e.name!r}: None" for e in parts)
    raise ModelError(
        f"{model.name!r} has {', '.join(e.title for e in parts)}, and {analysis} knows {_unsupported_in_words(parts)}; simulate "
        f"does. Without them: m.changed({{{without}}}).{analysis}(...){_replacement_hint(parts)}"
    )


def refuse_controllers(model: Model, analysis: str) -> None:
    """Refuse to answer as if controllers had no states.

    Raises
    ------
    ModelError
        If the mechanism has a controller.
    """
    if model.controllers:
        titles = ", ".join(e.title for e in model.controllers)
        raise ModelError(
            f"{model.name!r} has {titles}, and {analysis} knows no controllers; simulate and linearize do. Ask it of "
            f"a copy whose laws have formulas in their place"
        )


def _unsupported_in_words(parts: list[Element]) -> str:
    """What is not known, in words."""
    kinds = {e.category for e in parts}
    said = ["no contact, limits or Bodies"] if kinds & set(CONTACT_CATEGORIES) else []
    said += ["nothing that sticks, locks or goes taut"] if kinds - {*CONTACT_CATEGORIES, "events"} else []
    said += ["no events"] if "events" in kinds else []
    return ", and ".join(said)


def _replacement_hint(parts: list[Element]) -> str:
    """What could be given in its place."""
    out = []
    for name, becomes in REPLACEMENT_OPTIONS.items():
        able = [e.title for e in parts if hasattr(e, name)]
        if able:
            they = "it is" if len(able) == 1 else "they are"
            out.append(f"; or give {', '.join(able)} a {name}: {they} {becomes} then")
    return "".join(out)


def ignored_elements(model: Model) -> str:
    """What freedoms are counted without, as a sentence; empty if that is nothing."""
    parts = [e.title for e in unsupported_elements(model) if e.category != "bulk"]
    out = f"{', '.join(parts)}: freedoms and the start are those without" if parts else ""
    bulk = [f"the {e.count} bodies of {e.title}" for e in model.bulk]
    return "; ".join(x for x in (out, f"{', '.join(bulk)}: not counted in freedoms" if bulk else "") if x)
