"""Formulas one under another, with names for what recurs, where they are short enough to be read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..graph.node import Node
from ..graph.printers import text
from ..graph.simplify.brief import brief
from ..graph.simplify.cost import length
from ..graph.values import reached

LETTERS = 6000  # that are printed
LINE = 100  # letters of a line
MOST = 4000  # operations from which on nothing is tried
TOO_LONG = "too long to read: {} operations; .at(values) evaluates it, and export() of the equations writes code"


def count(nodes: Sequence[Any]) -> int:
    """Operations, each once."""
    return sum(bool(x.args) for x in reached(nodes))


def listed(rows: Sequence[tuple[str, Any]], units: Sequence[Sequence[Node]] = ()) -> list[str]:
    """Lines ``name = formula``, and what stands for what under ``where``; none if they are too long to be read."""
    if count([x for _, x in rows]) > MOST:
        return []
    rest, definitions = brief([x for _, x in rows], units)
    if length([*rest, *(y for _, y in definitions)]) > LETTERS / 2:
        return []
    lines = [f"{name} = {text.text(x)}" if name else text.text(x) for (name, _), x in zip(rows, rest, strict=True)]
    lines += ["where", *(f"{text.text(w)} = {text.text(y)}" for w, y in definitions)] if definitions else []
    found = [line for whole in lines for line in _broken(whole)]
    return found if sum(map(len, found)) <= LETTERS else []


def _broken(line: str) -> list[str]:
    first, *others = text.broken(line, LINE)
    return [first, *(f"    {x}" for x in others)]
