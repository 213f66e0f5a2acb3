"""The units that nearly every model is written in, as a table: "5 mm" needs no library of all the world's units.

What the table does not know, `units` asks of pint; a test compares the two.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import NamedTuple

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
    """A unit made of those of the table.

    Attributes
    ----------
    factor : float
        To SI.
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
    """The unit of a text such as "kN/m" or "kg*m^2", or None if there is another symbol or another spelling in it."""
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
