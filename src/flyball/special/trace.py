"""From a mechanism to the text of its code; and what it is about a mechanism that forbids it."""

from __future__ import annotations

from dataclasses import dataclass

from ..graph.node import Undecided
from ..graph.printers.llvm import Unprintable
from ..graph.printers.llvm_order import operations
from ..graph.values import reached
from ..tables.specs import Structure
from ..tables.system import System
from .linked import Linked
from .machine import module_of
from .stages import Stages

Entry = tuple[str, int]
"""A table, and the number of an entry in it."""


class Refused(Exception):
    """No code is made for a mechanism; the reason in words."""


@dataclass(frozen=True)
class Text:
    """The code as text.

    Attributes
    ----------
    text : str
    known : list of Entry
        Entries of the tables whose very values are in it, since a formula decides by them.
    scratch, constants, operations, laws
        As in `Made`.
    """

    text: str
    known: list[Entry]
    scratch: int
    constants: int
    operations: int
    laws: list[str]


def traced(s: Structure, S: System) -> Text:
    """Run the engine's loops on expressions, and write down what they do.

    Raises
    ------
    Refused
        If something cannot be written so.
    """
    known: set[Entry] = set()
    try:
        while True:
            stages = Stages(s, S, sorted(known))
            more = _decided(stages)
            if not more:
                break
            known |= more
        linked = Linked(stages)
        count = sum(len(operations(p.results, p.reads)) for p in linked.procedures)
        return Text(module_of(linked), sorted(known), linked.scratch, linked.constants, count, linked.laws)
    except Undecided as error:
        raise Refused(f"a formula of it decides by where it is ({error})") from error
    except Unprintable as error:
        raise Refused(f"it calls {error}, a Python function") from error


def _decided(stages: Stages) -> set[Entry]:
    """Entries that formulas have decided by."""
    nodes = [x for x in stages.graph if x.index in stages.graph.decided]
    found = (stages.constants.get(x.index) for x in reached(nodes))
    return {(base.removeprefix("C_"), k) for base, k in filter(None, found)}
