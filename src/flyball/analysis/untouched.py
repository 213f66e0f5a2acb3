"""What analyses say of parts that hold at times and let go at others, where they do not know them.

Each analysis names the parts that it knows (`docs/events.md` has the table, `tests/events/test_every_analysis.py` asks
every one for every part): it answers for what holds at the place that it is asked about, or refuses the part by name.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

from ..constraints.modes import FRICTION
from ..errors import ModelError
from ..model.element import Element
from ..model.model import Model

FRICTIONS = frozenset({FRICTION})
"""Kinds of switches that are forces while they slip: an analysis that knows which way knows them."""


def switching_parts(model: Model) -> Iterator[Element]:
    """Parts that hold at times: what sticks, stops, locks, latches, goes taut; and events."""
    seen = {e.name for e in (*model.contacts, *model.limits, *model.bulk)}
    yield from (e for e in model.elements() if e.name not in seen and (e.switches() or e.category == "events"))


def touching_parts(model: Model, knows: Collection[int] = ()) -> Iterator[Element]:
    """Parts that only a motion knows: contacts, limits, many bodies, and what else holds at times.

    ``knows`` are kinds of switches (`constraints.modes`): parts with no others are left out.
    """
    for e in (*model.contacts, *model.limits, *model.bulk, *switching_parts(model)):
        kinds = {w.kind for w in e.switches()}
        if not kinds or not kinds <= set(knows):
            yield e


def refuse_contact(model: Model, analysis: str, knows: Collection[int] = ()) -> None:
    """Refuse to answer as if parts were not there.

    Raises
    ------
    ModelError
        If the mechanism has a contact, a limit, many bodies, or another part that holds at times, of no kind that the
        analysis ``knows``.
    """
    parts = list(touching_parts(model, knows))
    if not parts:
        return
    without = ", ".join(f"{e.name!r}: None" for e in parts)
    raise ModelError(
        f"{model.name!r} has {', '.join(e.title for e in parts)}, and {analysis} knows {_unknown(parts)}; simulate "
        f"does. Without them: m.changed({{{without}}}).{analysis}(...){_instead(parts)}"
    )


def _unknown(parts: list[Element]) -> str:
    """What is not known, in words."""
    kinds = {e.category for e in parts}
    said = ["no contact, limits or Bodies"] if kinds & {"contacts", "limits", "bulk"} else []
    said += ["nothing that sticks, locks or goes taut"] if kinds - {"contacts", "limits", "bulk", "events"} else []
    said += ["no events"] if "events" in kinds else []
    return ", and ".join(said)


def _instead(parts: list[Element]) -> str:
    """What could be given in its place."""
    smooth = {"stick_speed": "regularised", "stiffness": "elastic"}
    out = []
    for name, becomes in smooth.items():
        able = [e.title for e in parts if e.switches() and getattr(e, name, 0.0) is None]
        if able:
            out.append(
                f"; or give {', '.join(able)} a {name}, which makes {'it' if len(able) == 1 else 'them'} {becomes}"
            )
    return "".join(out)


def left_out(model: Model) -> str:
    """What freedoms are counted without, as a sentence; empty if that is nothing."""
    parts = [e.title for e in (*model.contacts, *model.limits, *switching_parts(model))]
    out = f"{', '.join(parts)}: freedoms and the start are those without" if parts else ""
    bulk = [f"the {e.count} bodies of {e.title}" for e in model.bulk]
    return "; ".join(x for x in (out, f"{', '.join(bulk)}: not counted in freedoms" if bulk else "") if x)
