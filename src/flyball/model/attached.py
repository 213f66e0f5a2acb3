"""Names in the text of a unit that mean something else there: never silently a unit.

In the law ``"2 m/s^2*t"`` the t is time, and also the symbol of the tonne: read as a unit, it makes a constant force of
2000 N. So a symbol that is a name where it stands (t in laws, inputs, sensors, parameters, pi and e) is a unit only
where the usual way of writing such a quantity has it: "250 g" and "5 N*m" stay what they are beside parameters g and m.
"""

from __future__ import annotations

import re
from collections.abc import Collection

from ..errors import UnitError
from .units import KINDS, SYMBOLS, powers_as_written, powers_in_si, to_si, unit_name

_SYMBOL = re.compile(r"[^\W\d]\w*")
_FORMULA = re.compile(r"[*/+-]\s*[\d(]")  # what no unit has in it
_JOIN = re.compile(r"[\s*/·+-]*\(*$")


def refuse_attached(number: str, unit: str, names: Collection[str], dimension: str | None) -> None:
    """Raise `UnitError` if a symbol of a unit could be meant as one of these names, or is called like a function.

    Where time is no name, "t" behind a unit is refused too: "60 rpm*t" is meant as a law, and would be read in tonnes.
    """
    found = _doubtful(unit, names, dimension)
    if not found:
        return
    match = found[0]
    for later in found:  # as much of the text as can be is left to the quantity
        if not _doubtful(_head(unit, later.start()), names, None):
            match = later
    symbol, long = match[0], unit_name(match[0])
    text = f"{number} {unit}"
    as_unit = f"; for the unit '{number} {unit[: match.start()]}{long}{unit[match.end() :]}'"
    if symbol == "t" and "t" not in names:
        raise UnitError(
            f"'{text}': 't' stands for time behind a unit, and time is known only in laws of drivers and forces; write "
            f"'{product(number, unit, match.start())}' there{as_unit}"
        )
    raise UnitError(
        f"'{text}': '{symbol}' is a name here, and so no part of a unit; for the product write "
        f"'{product(number, unit, match.start())}'{as_unit if long != symbol and _fits(text, dimension) else ''}"
    )


def _fits(text: str, dimension: str | None) -> bool:
    """Whether a text is a quantity of this dimension."""
    try:
        to_si(text, dimension)
    except UnitError:
        return False
    return True


def _doubtful(unit: str, names: Collection[str], dimension: str | None) -> list[re.Match[str]]:
    out = []
    for m in _SYMBOL.finditer(unit):
        called = unit[m.end() :].lstrip().startswith("(")
        alone = not _head(unit, m.start()).strip("1")
        if m[0] == "t" and "t" not in names:
            doubtful = not (alone and _of_known_kind(unit, dimension))
        else:
            doubtful = m[0] in names and not _customary(m[0], unit, dimension, alone)
        if called or doubtful:
            out.append(m)
        if called:
            break
    return out


def remedy(number: str, unit: str) -> str:
    """How to write a text that is no unit as a whole, if it is a product or a sum that begins with a quantity."""
    for match in _SYMBOL.finditer(unit):
        if not unit_name(match[0]) and match.start() > 0:
            return f"; if you mean a product, write '{product(number, unit, match.start())}'"
    return "; in a formula a quantity stands in parentheses, as in '(60 rpm)*t'" if _FORMULA.search(unit) else ""


def product(number: str, unit: str, start: int) -> str:
    """The text as a product: the quantity that ends before ``start`` in parentheses, then the rest."""
    head = _head(unit, start)
    if not head:
        return f"{number}*{unit}"
    rest = unit[len(head) :].strip()
    return f"({number} {head}){rest if rest[0] in '*/+-' else '*' + rest}"


def _head(unit: str, start: int) -> str:
    """What stands before a place in a unit, without the operator between."""
    return _JOIN.sub("", unit[:start])


def _of_known_kind(unit: str, dimension: str | None) -> bool:
    """Whether a unit measures what is wanted, or something that has a name: "t" a mass, "t/m^3" a density."""
    try:
        return powers_in_si(unit) in [powers_in_si(k) for k in (*KINDS, dimension or "1") if k not in ("", "1")]
    except UnitError:
        return False


def _customary(symbol: str, unit: str, dimension: str | None, alone: bool) -> bool:
    """Whether a symbol belongs to the usual way of writing a quantity: behind the number, or as in its SI unit."""
    if alone and symbol in SYMBOLS:
        return True
    try:
        written, si = powers_as_written(unit), powers_in_si(unit)
    except UnitError:
        return False
    kinds = [dimension] if dimension else [k for k in KINDS if k != "1" and powers_in_si(k) == si]
    ways = [powers_as_written(k) for k in kinds if k != "1"]
    name = unit_name(symbol)
    return any(name in way and way[name] == written.get(name) for way in (*ways, *([si] if ways else [])))
