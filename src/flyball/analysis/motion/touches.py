"""Contact in a motion that is integrated: the places where bodies may touch, as parts of a copy of the model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from ...errors import ModelError
from ...model.model import Model
from ...model.touch import Touch
from ...tables.contact.places import Places, places
from ...tables.numbers import numbers

FEW = 16  # places; with more, steps with all their rows cost far more than steps by impulses
CORNERS = 3  # of two bodies in space, by whose friction no two ways of sharing it are told apart
KEPT = 4  # copies of one model at other values of the parameters
IMPULSES = "leave method out, or give method='impulse'"


def found(model: Model, parameters: Mapping[str, float] | None) -> Places:
    """The places of a model at the values of the parameters."""
    given = numbers(model, parameters)
    return model.kept.get("places", given.key, KEPT, lambda: places(model, given))


def impossible(model: Model, parameters: Mapping[str, float] | None) -> str:
    """What of its contacts rows of constraint do not know; empty if they know all."""
    if not (model.contacts or model.bulk):
        return ""
    p = found(model, parameters)
    return f"{_several(p.why_not)}, which only steps by impulses know" if p.why_not else ""


def many(model: Model, parameters: Mapping[str, float] | None) -> str:
    """Whether there are so many places that steps by impulses are better; empty if not."""
    places = found(model, parameters).touches
    if len(places) > FEW:
        return f"bodies may touch at {len(places)} places, too many to go from touch to touch (most {FEW})"
    return "" if model.planar else _open(places)


def _open(places: Sequence[Touch]) -> str:
    """Bodies in space whose friction at many corners rigid bodies leave open; empty if there are none."""
    pairs = Counter((e.body_i, e.body_j) for e in places if e.slips)
    for (a, b), n in pairs.items():
        if n > CORNERS:
            return f"how {a!r} and {b!r} share friction among {n} corners is not determined"
    return ""


def with_places(model: Model, parameters: Mapping[str, float] | None) -> Model:
    """A copy of the model in which places of contact are parts.

    Raises
    ------
    ModelError
        If rows do not know all of them.
    """
    if not model.contacts or any(isinstance(e, Touch) for e in model.forces):
        return model
    p = found(model, parameters)
    if p.why_not:
        raise ModelError(
            f"{model.contacts[0].title}: a motion that is integrated knows contact of balls, corners and rounded ends "
            f"with planes, of balls with balls, boxes and capsules, and in the plane of rectangles and segments. Here "
            f"{_several(p.why_not)}; {IMPULSES}"
        )
    key = numbers(model, parameters).key
    return model.kept.get("with places", key, KEPT, lambda: _joined(model, p.touches))


def _joined(model: Model, touches: tuple[Touch, ...]) -> Model:
    out = model.copy()
    for e in touches:
        out.add(e)
    return out.snapshot()


def _several(texts: tuple[str, ...]) -> str:
    """The first, and how many there are."""
    return texts[0] + (f" (and {len(texts) - 1} more)" if len(texts) > 1 else "")
