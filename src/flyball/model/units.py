"""Conversion of quantities ("30 deg", "60 rpm", "2 kN/m") to numbers in SI units.

Common units are in a table; others are looked up in pint.

Angles are distinguished from plain numbers, which pint does not do: "5 deg" is not a length, and "50 Hz" (1/s) is not
an angular speed (rad/s), an error of 2 pi that is easily overlooked.

A unit symbol that is also a valid name in its context is refused. In the law ``"2 m/s^2*t"`` the t means time, but is
also the symbol of the tonne; as a unit it would make a constant force of 2000 N. Such a symbol is taken as a unit only
if the usual unit of the quantity contains it: "250 g" and "5 N*m" remain quantities beside parameters g and m.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from functools import lru_cache
from typing import Any, NamedTuple

from ..errors import UnitError

_LENGTH, _MASS, _TIME, _ANGLE = {"meter": 1}, {"kilogram": 1}, {"second": 1}, {"radian": 1}
_FORCE, _PRESSURE = {"kilogram": 1, "meter": 1, "second": -2}, {"kilogram": 1, "meter": -1, "second": -2}
_ENERGY, _POWER = {"kilogram": 1, "meter": 2, "second": -2}, {"kilogram": 1, "meter": 2, "second": -3}
COMMON: dict[str, tuple[str, float, dict[str, int]]] = {
    "m": ("meter", 1.0, _LENGTH),
    "mm": ("millimeter", 1e-3, _LENGTH),
    "cm": ("centimeter", 1e-2, _LENGTH),
    "km": ("kilometer", 1e3, _LENGTH),
    "g": ("gram", 1e-3, _MASS),
    "kg": ("kilogram", 1.0, _MASS),
    "s": ("second", 1.0, _TIME),
    "ms": ("millisecond", 1e-3, _TIME),
    "min": ("minute", 60.0, _TIME),
    "h": ("hour", 3600.0, _TIME),
    "rad": ("radian", 1.0, _ANGLE),
    "deg": ("degree", math.pi / 180, _ANGLE),
    "rev": ("turn", 2 * math.pi, _ANGLE),
    "turn": ("turn", 2 * math.pi, _ANGLE),
    "rpm": ("revolutions_per_minute", 2 * math.pi / 60, {"radian": 1, "second": -1}),
    "Hz": ("hertz", 1.0, {"second": -1}),
    "kHz": ("kilohertz", 1e3, {"second": -1}),
    "N": ("newton", 1.0, _FORCE),
    "mN": ("millinewton", 1e-3, _FORCE),
    "kN": ("kilonewton", 1e3, _FORCE),
    "MN": ("meganewton", 1e6, _FORCE),
    "Nm": ("newton_meter", 1.0, _ENERGY),
    "Pa": ("pascal", 1.0, _PRESSURE),
    "kPa": ("kilopascal", 1e3, _PRESSURE),
    "MPa": ("megapascal", 1e6, _PRESSURE),
    "GPa": ("gigapascal", 1e9, _PRESSURE),
    "J": ("joule", 1.0, _ENERGY),
    "kJ": ("kilojoule", 1e3, _ENERGY),
    "W": ("watt", 1.0, _POWER),
    "kW": ("kilowatt", 1e3, _POWER),
}
"""Symbol -> long name, factor to SI, powers of base units."""

_FACTOR = r"(?:[A-Za-z]+)(?:(?:\^|\*\*)-?\d)?"
_PRODUCT = re.compile(rf"(?:1/)?{_FACTOR}(?:\s*[*/]\s*{_FACTOR})*")
_PIECE = re.compile(r"([*/]?)\s*([A-Za-z]+)(?:(?:\^|\*\*)(-?\d))?")


class CommonUnit(NamedTuple):
    """A unit composed of those of the table.

    Attributes
    ----------
    factor : float
        Factor to SI.
    powers : tuple
        Base unit and its power, sorted by name.
    written : dict
        Long name of each symbol -> its power, as written.
    """

    factor: float
    powers: tuple[tuple[str, float], ...]
    written: dict[str, float]


@lru_cache(maxsize=512)
def common_unit(text: str) -> CommonUnit | None:
    """Return the unit of a text such as "kN/m" or "kg*m^2"; None if it contains other symbols or another spelling."""
    text = text.strip()
    if not _PRODUCT.fullmatch(text):
        return None
    factor, powers, written = 1.0, dict[str, float](), dict[str, float]()
    for join, symbol, exponent in _PIECE.findall(text.removeprefix("1")):
        if symbol not in COMMON:
            return None
        name, size, base = COMMON[symbol]
        power = (-1 if join == "/" else 1) * int(exponent or 1)
        factor *= size**power
        written[name] = written.get(name, 0) + power
        for unit, p in base.items():
            powers[unit] = powers.get(unit, 0) + p * power
    kept = {name: p for name, p in written.items() if p}
    return CommonUnit(factor, tuple(sorted((name, p) for name, p in powers.items() if p)), kept)


_NUMBER = r"[+-]?\s*(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(  # the exponent belongs to the number: "1e6*t" is a formula, not 1 of a unit "e6*t"
    rf"\s*(?P<number>{_NUMBER})(?![eE][+-]?\d)\s*(?P<unit>(?:1\s*/\s*)?[^\W\d_].*|[°%µ].*|)\s*", re.DOTALL
)
_UNIT = re.compile(r"[\w\s°%µ²³·*/^().-]{1,60}")
_NO_UNITS = ("speed_of_light", "elementary_charge", "pi", "e")
_TOWER = re.compile(r"\d{3,}|(?:\*\*|\^)[\s(+-]*[\d.]+[\s)]*(?:\*\*|\^)")

# For each SI unit: the name of the quantity, and an example as a user would write it.
KINDS = {
    "1": ("a plain number", "0.5"),
    "m": ("a length", "5 mm"),
    "rad": ("an angle", "30 deg"),
    "s": ("a time", "20 ms"),
    "kg": ("a mass", "250 g"),
    "m/s": ("a speed", "20 mm/s"),
    "rad/s": ("an angular speed", "120 rpm"),
    "m/s^2": ("an acceleration", "9.81 m/s^2"),
    "rad/s^2": ("an angular acceleration", "10 deg/s^2"),
    "kg*m^2": ("a moment of inertia", "3 kg*cm^2"),
    "kg/m^3": ("a density", "7.85 g/cm^3"),
    "N": ("a force", "2 kN"),
    "N*m": ("a torque", "3 N*m"),
    "N/m": ("a stiffness", "2 kN/m"),
    "N*m/rad": ("a torsional stiffness", "5 N*m/rad"),
    "N*s/m": ("a damping", "10 N*s/m"),
    "N*m*s/rad": ("a torsional damping", "0.1 N*m*s/rad"),
    "J": ("an energy", "2 kJ"),
    "W": ("a power", "2 kW"),
    "Pa": ("a pressure", "2 MPa"),
}

_SYMBOLS = "m mm cm km in ft g kg s ms min h deg rad rpm rev turn Hz kHz N mN kN MN Nm lbf Pa kPa MPa GPa J kJ W kW K"
SYMBOLS = frozenset(_SYMBOLS.split())


def split_quantity(text: str) -> tuple[str, str] | None:
    """Split a text such as "30 deg" into number and unit (unit "" for a plain number); None if it is something else."""
    match = _QUANTITY.fullmatch(text)
    return (match["number"].replace(" ", ""), match["unit"].strip()) if match else None


@lru_cache(maxsize=4096)
def to_si(text: str, dimension: str | None) -> float:
    """Return the value of a quantity in SI units.

    Parameters
    ----------
    text
        A number with a unit ("30 deg"), or without one ("0.5": taken as SI already).
    dimension
        The SI unit wanted, e.g. "m", "rad", "N*m/rad", "1" or "" for a plain number; None accepts any unit. "per
        radian" may be left out of a compound unit ("5 N*m" as a torsional stiffness), an angle itself may not ("50 Hz"
        for rad/s).

    Raises
    ------
    UnitError
        If the unit is unknown, of the wrong kind, or has an offset (temperatures in degC).
    """
    parts = split_quantity(text)
    if parts is None:
        raise UnitError(f"'{text}' is not a number with a unit; write {_example(dimension)}")
    number, unit = parts
    value = float(number)
    if unit:
        factor, found = _unit(text, unit, dimension)
        if dimension is not None:
            _check_kind(text, unit, found, dimension)
        value *= factor
    if value - value != 0.0:
        raise UnitError(f"'{text}' is not a finite number; write {_example(dimension)}")
    return value


def same_kind(old: str, new: str, where: str) -> None:
    """Refuse to replace a quantity by one of another kind; a number without unit is in SI and always accepted.

    Raises
    ------
    UnitError
        If their units measure different things.
    """
    was, now = split_quantity(old), split_quantity(new)
    if was is not None and now is not None and was[1] and now[1]:
        try:
            to_si(new, was[1])
        except UnitError as error:
            raise UnitError(f"{where} is {old!r}; {error}") from None


def is_unit(text: str) -> bool:
    """Return whether the text is a known unit ("mm", "kN/m")."""
    try:
        _unit(text, text, None)
    except UnitError:
        return False
    return True


def powers_as_written(unit: str) -> dict[str, float]:
    """Return long unit names -> powers: "N/mm" is newton 1, millimeter -1; `UnitError` if unknown."""
    if (common := common_unit(unit)) is not None:
        return dict(common.written)
    _unit(unit, unit, None)
    return dict(_registry().Quantity(1.0, unit).unit_items())


def powers_in_si(unit: str) -> dict[str, float]:
    """Return base units -> powers; `UnitError` if the unit is unknown."""
    return dict(_unit(unit, unit, None)[1])


def unit_name(symbol: str) -> str:
    """Return the long name of a single unit ("mm": "millimeter"); empty if it is unknown."""
    if symbol in COMMON:
        return COMMON[symbol][0]
    return str(_registry().get_name(symbol)) if is_unit(symbol) else ""


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry(autoconvert_offset_to_baseunit=True, on_redefinition="ignore")
    registry.define("@alias turn = rev")
    registry.define("@alias ohm = Ohm")
    # pint reads Nm as nanometre-like text; users mean a torque
    registry.define("newton_meter = newton * meter = Nm")
    return registry


@lru_cache(maxsize=512)
def _unit(text: str, unit: str, dimension: str | None) -> tuple[float, tuple[tuple[str, float], ...]]:
    """Return the SI factor of a unit and the sorted powers of its base units."""
    if (common := common_unit(unit)) is not None:
        return common.factor, common.powers
    import pint

    registry: Any = _registry()
    if not _UNIT.fullmatch(unit) or _TOWER.search(unit):
        raise UnitError(f"'{text}': '{unit}' is not a unit; write {_example(dimension)}")
    try:
        parsed = registry.parse_units(unit)
        if any(
            name.endswith("_constant") or name in _NO_UNITS for name, _ in registry.Quantity(1.0, parsed).unit_items()
        ):
            raise pint.UndefinedUnitError(unit)  # "2 k" must not be a multiple of Boltzmann's constant
        zero = registry.Quantity(0.0, parsed).to_base_units().magnitude
        base = registry.Quantity(1.0, parsed).to_base_units()
    except pint.UndefinedUnitError:
        raise UnitError(f"'{text}': unknown unit '{unit}'{_hint(unit)}; write {_example(dimension)}") from None
    except Exception as error:  # pint's parser raises many kinds of errors for text that is not a unit
        raise UnitError(f"'{text}': cannot read the unit '{unit}' ({error}); write {_example(dimension)}") from None
    if zero != 0.0:
        raise UnitError(
            f"'{text}': '{unit}' has an offset or a logarithmic scale, so its factor to SI is not defined; "
            f"convert it yourself (temperatures: to K) or write {_example(dimension)}"
        )
    powers = {name: power for name, power in base.unit_items() if power != 0}
    return float(base.magnitude), tuple(sorted(powers.items()))


def _check_kind(text: str, unit: str, found: tuple[tuple[str, float], ...], dimension: str) -> None:
    wanted = dict(_unit(dimension, dimension, None)[1]) if dimension not in ("", "1") else {}
    powers = dict(found)
    angle, wanted_angle = powers.pop("radian", 0), wanted.pop("radian", 0)
    if powers == wanted and (angle == wanted_angle or (angle == 0 and wanted_angle < 0)):
        return
    name = KINDS.get(dimension or "1", ("a quantity", ""))[0]
    units = "*".join(f"{n}^{p:g}" if p != 1 else n for n, p in found) or "no unit"
    remedy = ""
    if powers == wanted:
        turns = angle == 0 and wanted_angle > 0 and "second" in powers
        remedy = " (Hz and 1/s count no angle: write rpm or rev/s)" if turns else " (the angle does not fit)"
    raise UnitError(
        f"'{text}': expected {name} [{dimension or '1'}], found '{unit}' ({units}){remedy}; write {_example(dimension)}"
    )


def _example(dimension: str | None) -> str:
    if dimension is None:
        return "for example '5 mm' or '2 kN/m'"
    if dimension in ("", "1"):
        return "for example '0.5'"
    example = KINDS.get(dimension, ("", f"2 {dimension}"))[1]
    return f"for example '{example}', or a number in {dimension}"


def _hint(unit: str) -> str:
    """Return a suggestion for a unit whose only fault is its capitals ("KG", "RPM")."""
    right = {symbol.lower(): symbol for symbol in SYMBOLS}
    words = [right[w.lower()] for w in re.findall(r"[^\W\d]+", unit) if right.get(w.lower(), w) != w]
    return f" (did you mean {', '.join(repr(w) for w in words)}?)" if words else ""


_SYMBOL = re.compile(r"[^\W\d]\w*")
_FORMULA = re.compile(r"[*/+-]\s*[\d(]")  # characters that no unit contains
_JOIN = re.compile(r"[\s*/·+-]*\(*$")


def refuse_attached(number: str, unit: str, names: Collection[str], dimension: str | None) -> None:
    """Raise `UnitError` if a unit symbol could be meant as one of these names, or is followed by a function call.

    If time is not among the names, "t" behind a unit is refused too: "60 rpm*t" is meant as a law, and would be read in
    tonnes.
    """
    found = _doubtful(unit, names, dimension)
    if not found:
        return
    match = found[0]
    for later in found:  # as much of the text as possible belongs to the quantity
        if not _doubtful(_head(unit, later.start()), names, None):
            match = later
    symbol, long = match[0], unit_name(match[0])
    text = f"{number} {unit}"
    as_unit = f"; for the unit '{number} {unit[: match.start()]}{long}{unit[match.end() :]}'"
    if symbol == "t" and "t" not in names:
        raise UnitError(
            f"'{text}': 't' after a unit is time, and time is defined only in laws of drivers and forces; write "
            f"'{product_text(number, unit, match.start())}' there{as_unit}"
        )
    raise UnitError(
        f"'{text}': '{symbol}' is a name here, and so no part of a unit; for the product write "
        f"'{product_text(number, unit, match.start())}'{as_unit if long != symbol and _fits(text, dimension) else ''}"
    )


def _fits(text: str, dimension: str | None) -> bool:
    """Return whether a text is a quantity of this dimension."""
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


def quantity_remedy(number: str, unit: str) -> str:
    """Return how to write a text that is not a unit as a whole, if it is a product or sum starting with a quantity."""
    for match in _SYMBOL.finditer(unit):
        if not unit_name(match[0]) and match.start() > 0:
            return f"; if you mean a product, write '{product_text(number, unit, match.start())}'"
    return "; in a formula a quantity must be in parentheses, as in '(60 rpm)*t'" if _FORMULA.search(unit) else ""


def product_text(number: str, unit: str, start: int) -> str:
    """Return the text as a product: the quantity before ``start`` in parentheses, then the rest."""
    head = _head(unit, start)
    if not head:
        return f"{number}*{unit}"
    rest = unit[len(head) :].strip()
    return f"({number} {head}){rest if rest[0] in '*/+-' else '*' + rest}"


def _head(unit: str, start: int) -> str:
    """Return the text before a position in a unit, without the operator in between."""
    return _JOIN.sub("", unit[:start])


def _of_known_kind(unit: str, dimension: str | None) -> bool:
    """Return whether a unit measures the required or another named quantity: "t" a mass, "t/m^3" a density."""
    try:
        return powers_in_si(unit) in [powers_in_si(k) for k in (*KINDS, dimension or "1") if k not in ("", "1")]
    except UnitError:
        return False


def _customary(symbol: str, unit: str, dimension: str | None, single: bool) -> bool:
    """Return whether a symbol belongs to the usual unit of the quantity: after the number, or as in its SI unit."""
    if single and symbol in SYMBOLS:
        return True
    try:
        written, si = powers_as_written(unit), powers_in_si(unit)
    except UnitError:
        return False
    kinds = [dimension] if dimension else [k for k in KINDS if k != "1" and powers_in_si(k) == si]
    ways = [powers_as_written(k) for k in kinds if k != "1"]
    name = unit_name(symbol)
    return any(name in way and way[name] == written.get(name) for way in (*ways, *([si] if ways else [])))
