"""Tables (splines) and Python functions that routines call: what printers write for them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ...errors import ModelError
from ..function import Function
from .naming import Names
from .routine import Routine


@dataclass(frozen=True)
class Table:
    """A spline as it is printed: see `math/spline.py` for what its numbers are."""

    name: str
    data: tuple[float, ...]
    moved: tuple[int, ...]  # numbers that are given with each call


def tables(routines: Iterable[Routine], names: Names) -> dict[int, Table]:
    """Tables that routines call, by the identity of the function that is their value."""
    found: dict[int, Table] = {}
    for f in functions(routines):
        if "table" in f.told and id(f.told["value"]) not in found:
            name = names(f"table_{len(found) + 1}")
            found[id(f.told["value"])] = Table(name, tuple(f.told["table"]), tuple(f.told["moved"]))
    return found


def opaque(routines: Iterable[Routine], names: Names) -> dict[int, tuple[str, Function]]:
    """Python functions that routines call: by identity a name of its own, and the function."""
    found = {}
    for f in functions(routines):
        if "table" not in f.told and "constant" not in f.told:
            found[id(f)] = names(f.name), f
    return found


def functions(routines: Iterable[Routine]) -> list[Function]:
    """Functions that are known by name only, in the order in which they are first called."""
    return list({id(f): f for r in routines for f in r.used()}.values())


def refuse_opaque(routines: Sequence[Routine], language: str) -> None:
    """Refuse Python functions.

    Raises
    ------
    ModelError
        With the function's name and where it is called from.
    """
    for r in routines:
        for f in r.used():
            if "table" not in f.told and "constant" not in f.told:
                of = f.told.get("of")
                raise ModelError(
                    f"{of + ': ' if of else ''}{f.name!r} is a Python function, and {r.name} calls it: {language} "
                    "knows what is an expression or a table only. Write the law as an expression, give a table of "
                    "points in its place, or export to Python, where functions are handed over"
                )
