"""Explicit equations as an engineer reads them: dependent coordinates, M and f, with names for what recurs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ...graph.node import Node
from ...graph.simplify.arctangents import Algebra, short, without_turns
from ...graph.simplify.cost import length
from ...graph.values import symbols
from ..listed import TOO_LONG, count, listed
from .definition import Definition

if TYPE_CHECKING:
    from .explicit import ExplicitEquations

READ = 300  # operations up to which all is put in the independent coordinates
SHORT = 40.0  # symbols up to which a coordinate is, though its formula by others is shorter
Row = tuple[str, Any]


def told(x: ExplicitEquations) -> str:
    """The equations as text, no longer than can be read."""
    s, units = x.solution, x.equations.units
    free = ", ".join(x.independent)
    lines = [
        f"explicit equations of {x.equations.model.name!r}: M a = f"
        + (f", a the accelerations of {free}" if free else ""),
        f"independent: {free or 'none, drivers leave no freedom'}",
        *(f"{name}: {in_words(how)}" for name, how in x.branches.items()),
        *x.notes,
        *(["angles are told up to whole turns"] if any(d.closed for d in s.positions) else []),
    ]
    algebra = Algebra([(w, y, d.radius) for d in s.definitions if d.closed for w, y in pairs(d)])
    places = coordinates(s.positions, algebra)
    motion = [(f"M[{a}, {b}]", s.M[i, j]) for (i, a), (j, b) in upper(x.independent)]
    motion += [(f"f[{a}]", y) for a, y in zip(x.independent, s.f, strict=True)]
    g = x.equations.graph
    motion = [(name, g.node(y)) for name, y in motion]
    body = best([places + put_in(motion, algebra), places + rates(motion, s.definitions, s.positions)], units)
    if not body:
        body = [
            line for row in places for line in listed([row], units) or [f"{row[0]}: {TOO_LONG.format(count([row[1]]))}"]
        ]
        body += [f"{k}: {TOO_LONG.format(getattr(x, k).operations)}" for k in ("M", "f")]
    size = {k: getattr(x, k).operations for k in ("M", "f")}
    return "\n".join([*lines, "", *body, "", f"operations: {', '.join(f'{k} {n}' for k, n in size.items())}"])


def in_words(how: str) -> str:
    """The form of an equation, without letters that stand for nothing here."""
    how = re.sub(r"A cos w \+ B sin w \+ C = 0, branch (.)", r"of the two solutions the drawn one (branch \1)", how)
    how = how.replace("A cos w + B sin w = 0", "the drawn one of two opposite directions")
    return re.sub(r"quadratic, branch (.)", r"of the two solutions the drawn one (branch \1)", how)


def pairs(d: Definition) -> list[tuple[Node, Any]]:
    """Symbols with their formulas."""
    return list(zip(d.symbols, d.values, strict=True))


def upper(names: Sequence[str]) -> list[tuple[tuple[int, str], tuple[int, str]]]:
    """Places of a symmetric matrix, each once."""
    told = list(enumerate(names))
    return [(a, b) for a in told for b in told if a[0] <= b[0]]


def coordinates(definitions: Sequence[Definition], algebra: Algebra) -> list[Row]:
    """Formulas of dependent coordinates: by the independent ones where that is short, else by others before them."""
    out = []
    for w, y in (pair for d in definitions if d.closed for pair in pairs(d)):
        y = without_turns(w.graph.node(y))
        by_free = algebra([w])
        put = short(by_free)[0]
        out.append((w.data.name, put if length([put]) <= max(SHORT, length([y])) else y))
    return out


def put_in(rows: Sequence[Row], algebra: Algebra) -> list[Row]:
    """The same in the independent coordinates."""
    return list(zip([name for name, _ in rows], algebra([y for _, y in rows]), strict=True))


def rates(rows: Sequence[Row], definitions: Sequence[Definition], places: Sequence[Definition]) -> list[Row]:
    """The same by dependent coordinates and their rates, after formulas of the rates that they hold."""
    by = {w.index: (w, y) for d in definitions[len(places) :] if d.closed for w, y in pairs(d)}
    wanted: dict[int, Row] = {}
    to_see = [y for _, y in rows]
    while to_see:
        for s in symbols([to_see.pop()]):
            if s.index in by and s.index not in wanted:
                w, y = by[s.index]
                wanted[s.index] = (w.data.name, w.graph.node(y))
                to_see.append(w.graph.node(y))
    return [*(wanted[k] for k in by if k in wanted), *rows]


def best(ways: Sequence[Sequence[Row]], units: Sequence[Sequence[Node]]) -> list[str]:
    """The first way in lines if it is small, else the shorter of both; nothing if none can be read."""
    first, second = ([y for _, y in rows] for rows in ways)
    lines = [listed(ways[0], units)] if count(first) <= READ else []
    if not (lines and lines[0]) or sum(map(len, lines[0])) > 2500 or count(second) < count(first) / 2:
        lines.append(listed(ways[1], units))
    return min((x for x in lines if x), key=lambda x: sum(map(len, x)), default=[])
