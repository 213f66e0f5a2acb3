"""Expressions in the fewest symbols that a reader has to meet, however large they are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..node import Node
from ..values import reached
from .cost import length
from .shared import Definitions, shared
from .simplify import simplified

SMALL = 600  # operations up to which all is simplified before parts get names
READABLE = 2500.0  # symbols of all expressions together up to which that is kept


def brief(nodes: Sequence[Any], units: Sequence[Sequence[Node]] = ()) -> tuple[list[Any], Definitions]:
    """Expressions of the same value, short, with symbols for what recurs, and what these stand for.

    Small ones are simplified as a whole. In large ones what recurs has a name first, and each piece is simplified by
    itself: that takes time in proportion to the operations, and cannot swell.

    Parameters
    ----------
    nodes : sequence of Node or number
    units : sequence of sequences of Node
        As for `simplified`.

    Returns
    -------
    list, list of (Node, Node)
        The expressions, and symbols with what they stand for, in an order of evaluation.
    """
    if len(reached(nodes)) <= SMALL:
        found = simplified(nodes, units)
        if length(found) <= READABLE:
            return shared(found)
    rest, definitions = shared(nodes)
    short = simplified([*rest, *(y for _, y in definitions)], units)
    count = len(rest)
    return short[:count], [(x, y) for (x, _), y in zip(definitions, short[count:], strict=True)]
