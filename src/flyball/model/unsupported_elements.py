"""Elements that an analysis does not support (contacts, events, controllers, locks): refused by name.

Each analysis lists the kinds that it supports, in their state at the operating point; it refuses other elements
(`docs/events.md` has the table; `tests/events/test_every_analysis.py` tests every analysis with every element).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ..constraints.switches.switch_kind import SwitchKind
from ..errors import ModelError
from .element import Element
from .model import Model

Supported = Callable[[SwitchKind], bool]
"""Whether an analysis supports a kind of switch."""


def nothing_else(kind: SwitchKind) -> bool:
    """Whether an analysis without modes supports a kind of switch."""
    return False


def acts_while_sliding(kind: SwitchKind) -> bool:
    """Whether switches of a kind are forces while they slide: without modes, by the sign of the rate."""
    return kind.kinetic


CONTACT_CATEGORIES = ("contacts", "limits", "bulk")
REPLACEMENT_OPTIONS = {"stick_speed": "regularised", "stiffness": "elastic"}
"""Fields that turn an element into a plain force, and the description of that force."""


def unsupported_elements(model: Model, supports: Supported = nothing_else) -> Iterator[Element]:
    """Return parts that only motions support: contacts, sets of bodies, events, and switching elements.

    Elastic elements are forces in every analysis; ``supports`` returns whether the analysis supports another kind of
    switch.
    """
    yield from (*model.contacts, *model.bulk)
    for e in model.elements():
        if e.category == "events" or any(not (w.kind.elastic or supports(w.kind)) for w in e.switches()):
            yield e


def refuse_unsupported(
    model: Model,
    analysis: str,
    supports: Supported = nothing_else,
    *,
    controlled: bool = False,
) -> None:
    """Refuse a mechanism with unsupported parts, rather than ignore them.

    Raises
    ------
    ModelError
        If the mechanism has a contact, a set of bodies, an event, or a switching element that is not supported; or
        a controller, unless ``controlled`` says that the analysis supports or may ignore controllers.
    """
    if not controlled:
        refuse_controllers(model, analysis)
    parts = list(unsupported_elements(model, supports))
    if not parts:
        return
    without = ", ".join(f"{e.name!r}: None" for e in parts)
    raise ModelError(
        f"{model.name!r} has {', '.join(e.title for e in parts)}, and {analysis} supports "
        f"{_unsupported_in_words(parts)}; simulate does. Without them: "
        f"m.changed({{{without}}}).{analysis}(...){_replacement_hint(parts)}"
    )


def refuse_controllers(model: Model, analysis: str) -> None:
    """Refuse a mechanism with controllers, whose states the analysis does not support.

    Raises
    ------
    ModelError
        If the mechanism has a controller.
    """
    if parts := model.with_states():
        titles = ", ".join(e.title for e in parts)
        raise ModelError(
            f"{model.name!r} has {titles}, and {analysis} does not support controllers and forces with states; "
            "simulate and linearize do (with drivers of all motions, simulate gives their efforts too). Use a copy of "
            "the mechanism without them, or whose laws have formulas in their place"
        )


def refuse_sampled_controllers(model: Model, analysis: str) -> None:
    """Refuse sampled controllers, whose signals are constant between sampling instants.

    Raises
    ------
    ModelError
        With their names.
    """
    held = [e.title for e in model.controllers if e.sampled]
    if held:
        raise ModelError(
            f"{model.name!r} has {', '.join(held)}, sampled, and {analysis} is about continuous time; linearize gives "
            f"the equations from one instant to the next, and their eigenvalues"
        )


def _unsupported_in_words(parts: list[Element]) -> str:
    """Describe the unsupported parts."""
    kinds = {e.category for e in parts}
    said = ["no contact, limits or Bodies"] if kinds & set(CONTACT_CATEGORIES) else []
    said += ["no elements with modes (stick friction, locks, ropes)"] if kinds - {*CONTACT_CATEGORIES, "events"} else []
    said += ["no events"] if "events" in kinds else []
    return ", and ".join(said)


def _replacement_hint(parts: list[Element]) -> str:
    """Describe possible replacements."""
    out = []
    for name, becomes in REPLACEMENT_OPTIONS.items():
        able = [e.title for e in parts if hasattr(e, name)]
        if able:
            they = "it is" if len(able) == 1 else "they are"
            out.append(f"; or give {', '.join(able)} a {name}: {they} {becomes} then")
    return "".join(out)


def ignored_elements(model: Model) -> str:
    """Describe the elements that the count of degrees of freedom ignores; empty if there are none."""
    parts = [e.title for e in unsupported_elements(model) if e.category != "bulk"]
    out = f"{', '.join(parts)}: freedoms and the start are those without" if parts else ""
    bulk = [f"the {e.count} bodies of {e.title}" for e in model.bulk]
    return "; ".join(x for x in (out, f"{', '.join(bulk)}: not counted in freedoms" if bulk else "") if x)
