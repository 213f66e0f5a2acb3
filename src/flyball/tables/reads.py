"""Forces that events name: their columns among what is sensed, behind the loads of joints, and what they are made of.

A joint has eight columns (`carried.WRENCH`), anything else two: its effort, and that the other way round. They are
filled in `equations.readings` from the rows of `LoadTerms` that begin with the first of them. What follows is a term
of the joint's rows, that plus the number of terms where it is seen from the joint's other side, or below -1 what adds
to an effort: a row, a force along a quantity, a velocity that a driver prescribes.
"""

from __future__ import annotations

from ..model.body import Driver
from ..model.carried import ALONG, WRENCH, Carried, carried
from ..model.element import Element
from ..model.joint import Joint
from ..model.model import Model
from .events import names
from .specs import Structure
from .terms import on_second

READS = -2_000_000_000
"""Place of the first column until it is known; below those of controllers' states."""


def read(model: Model) -> dict[str, Carried]:
    """Every name in expressions of events that is one of a force, and what it means."""
    found = {name: carried(model, name) for name in names(model) if "." in name}
    return {name: x for name, x in sorted(found.items()) if x is not None}


def quantities(s: Structure) -> None:
    """Number the columns."""
    for name, x in read(s.model).items():
        first = s.reads.setdefault(x.element.name, width(s))
        s.slots[name] = READS - first - x.column


def width(s: Structure) -> int:
    """How many columns there are."""
    return sum(len(WRENCH if isinstance(s.model[name], Joint) else ALONG) for name in s.reads)


def entries(s: Structure) -> list[tuple[int, int]]:
    """What each is made of: (column, term or other)."""
    first = 2 * len(s.measured) + len(s.loads)
    return [(first + at, what) for name, at in s.reads.items() for what in _made_of(s, s.model[name])]


def _made_of(s: Structure, e: Element) -> list[int]:
    rows, forces = len(s.rows), len(s.forces)
    if isinstance(e, Joint):
        return [on_second(s, k) for k in s.terms_of.get(e.name, ())]
    if isinstance(e, Driver):
        if e.name in s.prescribed:
            return [-2 - rows - forces - int(s.tables["tree"].v[s.prescribed[e.name]])]
        return [-2 - s.slices[e.name].start]
    own = [-2 - x.row for x in s.switches if x.element is e and x.row >= 0]
    return own + [-2 - rows - k for k, f in enumerate(s.forces) if f is e]
