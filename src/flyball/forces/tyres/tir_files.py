"""Tyre property files (``.tir``): coefficients of the Magic Formula by name."""

from __future__ import annotations

import difflib
import os
import re
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from ...errors import ModelError, warn_user

_NAMES = """
FNOMIN LONGVL BREFF DREFF FREFF Q_V1 Q_V2 Q_RE0 Q_FZ1 Q_FZ2 Q_FZ3 PFZ1 LONGITUDINAL_STIFFNESS LATERAL_STIFFNESS
LFZO LCX LMUX LEX LKX LHX LVX LCY LMUY LEY LKY LHY LVY LKYC LTR LRES LKZC LXAL LYKA LVYKA LS
LSGKP LSGAL LMX LVMX LMY LGAX LGAY LGAZ
PCX1 PDX1 PDX2 PDX3 PEX1 PEX2 PEX3 PEX4 PKX1 PKX2 PKX3 PHX1 PHX2 PVX1 PVX2 PTX1 PTX2 PTX3
PPX1 PPX2 PPX3 PPX4 RBX1 RBX2 RBX3 RCX1 REX1 REX2 RHX1
PCY1 PDY1 PDY2 PDY3 PEY1 PEY2 PEY3 PEY4 PEY5 PKY1 PKY2 PKY3 PKY4 PKY5 PKY6 PKY7 PHY1 PHY2 PHY3
PVY1 PVY2 PVY3 PVY4 PTY1 PTY2 PPY1 PPY2 PPY3 PPY4 PPY5
RBY1 RBY2 RBY3 RBY4 RCY1 REY1 REY2 RHY1 RHY2 RVY1 RVY2 RVY3 RVY4 RVY5 RVY6
QBZ1 QBZ2 QBZ3 QBZ4 QBZ5 QBZ6 QBZ9 QBZ10 QCZ1 QDZ1 QDZ2 QDZ3 QDZ4 QDZ6 QDZ7 QDZ8 QDZ9 QDZ10 QDZ11
QEZ1 QEZ2 QEZ3 QEZ4 QEZ5 QHZ1 QHZ2 QHZ3 QHZ4 PPZ1 PPZ2 SSZ1 SSZ2 SSZ3 SSZ4
QSX1 QSX2 QSX3 QSX4 QSX5 QSX6 QSX7 QSX8 QSX9 QSX10 QSX11 PPMX1
QSY1 QSY2 QSY3 QSY4 QSY5 QSY6 QSY7 QSY8
"""
OWN_NAMES = tuple(_NAMES.split())
"""Names of the coefficients that the formulas use."""
OTHER_NAMES = frozenset({"UNLOADED_RADIUS", "VERTICAL_STIFFNESS", "VERTICAL_DAMPING", "NOMPRES", "INFLPRES"})
"""Names of the other numbers that are used."""
DEFAULTS = dict.fromkeys((x for x in OWN_NAMES if x.startswith("L") and "_" not in x), 1.0) | {
    "LONGVL": 16.7, "Q_RE0": 1.0, "PKY4": 2.0, "PTY2": 1.0, "QSY7": 1.0, "VERTICAL_DAMPING": 0.0,
}  # fmt: skip
"""Values of coefficients that a file may leave out, where they are not zero."""
REQUIRED = (
    "UNLOADED_RADIUS", "FNOMIN", "VERTICAL_STIFFNESS", "PCX1", "PDX1", "PKX1", "PCY1", "PDY1", "PKY1", "PKY2",
)  # fmt: skip
OTHER_SPELLINGS = {
    "IP": "INFLPRES", "IP_NOM": "NOMPRES", "QV1": "Q_V1", "QV2": "Q_V2", "QFZ1": "Q_FZ1", "QFZ2": "Q_FZ2",
    "LKYG": "LKYC", "LKZG": "LKZC", "LFZ0": "LFZO", "LMR": "LRES", "LKYA": "LKY", "LKXK": "LKX",
}  # fmt: skip
COEFFICIENT = re.compile(r"[PQRSL][A-Z_]{2,5}\d*$")
NOT_MODELLED = re.compile(
    r"(PD[XY]P|PK[XY]P|PECP|PE[XY]P|PHYP|QBRP|QCRP|QDRP|QDTP|QTZ|QPZ|LGYR|LMUV|LMP|LKZ$|LCZ|LCC|Q_?FC|PFC|PSX|PHX3"
    r"|QSX1[234]|QCZ2|QRZ|PTZ)"
)
"""Turn slip, gyroscopic moment of the belt, deflections by other forces: known, and left out."""
VERSIONS = {"5": 5.2, "6": 5.2, "21": 5.2, "51": 5.2, "52": 5.2, "60": 6.1, "61": 6.1, "62": 6.2, "63": 6.2}
UNITS = {"LENGTH": ("meter", "metre", "m"), "FORCE": ("newton", "n"), "ANGLE": ("radian", "radians", "rad"),
    "MASS": ("kg", "kilogram"), "TIME": ("second", "sec", "s")}  # fmt: skip
RANGES = {
    "load": ("FZMIN", "FZMAX"), "slip": ("KPUMIN", "KPUMAX"), "slip_angle": ("ALPMIN", "ALPMAX"),
    "camber": ("CAMMIN", "CAMMAX"),
}  # fmt: skip
RANGE_NAMES = frozenset(name for pair in RANGES.values() for name in pair)


class TyreData(NamedTuple):
    """What a file says: its numbers by name, whether it is of version 5.2, whether of a tyre on the right side."""

    numbers: MappingProxyType[str, float]
    legacy: bool
    right: bool


def read_tir(path: str, who: str) -> TyreData:
    """Read a tyre property file; cached while it does not change.

    Raises
    ------
    ModelError
        If there is no such file, or it is no tyre property file of the Magic Formula in SI units.
    """
    try:
        changed = os.stat(path).st_mtime_ns
    except OSError as error:
        raise ModelError(f"{who}: {path} cannot be read: {error.strerror}; is the path right?") from None
    return _read(path, changed, who)


@lru_cache(maxsize=32)
def _read(path: str, changed: int, who: str) -> TyreData:
    texts, numbers = dict[str, str](), dict[str, float]()
    for count, line in enumerate(Path(path).read_text(encoding="latin-1").splitlines(), 1):
        line = re.split(r"[$!]", line, maxsplit=1)[0].strip()
        name, equal, value = (x.strip() for x in line.partition("="))
        if not equal:
            continue  # a section, or a row of a table
        name, value = OTHER_SPELLINGS.get(name.upper(), name.upper()), value.split("{")[0].strip().strip("'\"").strip()
        texts[name] = value
        try:
            numbers[name] = float(value)
        except ValueError:
            if name in OWN_NAMES or name in OTHER_NAMES:
                raise ModelError(f"{who}: line {count} of {path}: {name} is {value!r}, which is no number") from None
    for name, known in UNITS.items():
        if texts.get(name, known[0]).lower() not in known:
            raise ModelError(
                f"{who}: {path} has {name} = {texts[name]!r}; only files in SI units are read. Convert its numbers to "
                f"{known[0]} and write that in its section [UNITS]"
            )
    kind = texts.get("PROPERTY_FILE_FORMAT", "").upper()
    version = VERSIONS.get(texts.get("FITTYP", "").split(".")[0], 5.2 if "PAC2002" in kind else 0.0)
    if not version:
        told = f"FITTYP = {texts['FITTYP']}" if "FITTYP" in texts else f"PROPERTY_FILE_FORMAT = {kind or 'nothing'}"
        raise ModelError(
            f"{who}: {path} has {told}; it must be of the Magic Formula, FITTYP = 5, 6, 21, 51, 52, 60, 61 or 62, or "
            f"PROPERTY_FILE_FORMAT = 'PAC2002'"
        )
    unknown = [x for x in numbers if COEFFICIENT.match(x) and numbers[x] and not _is_known(x)]
    if unknown:
        close = difflib.get_close_matches(unknown[0], OWN_NAMES, 1)
        hint = f" (is {unknown[0]} meant as {close[0]}?)" if close else ""
        warn_user(
            f"{who}: {path} has coefficients that the formulas do not use: {', '.join(unknown)}{hint}", UserWarning
        )
    return TyreData(MappingProxyType(numbers), version < 6.0, texts.get("TYRESIDE", "LEFT").upper() == "RIGHT")


def _is_known(name: str) -> bool:
    return name in OWN_NAMES or name in OTHER_NAMES or name in DEFAULTS or bool(NOT_MODELLED.match(name))


def completed(numbers: dict[str, Any], who: str) -> dict[str, Any]:
    """Return all coefficients, with defaults; refuse missing and unknown ones.

    Raises
    ------
    ModelError
        Naming them.
    """
    missing = [x for x in REQUIRED if x not in numbers]
    if missing:
        raise ModelError(f"{who}: {', '.join(missing)} missing; the file, or coefficients=, must give them")
    out = dict.fromkeys((*OWN_NAMES, *OTHER_NAMES), 0.0) | DEFAULTS | numbers
    if "Q_FZ1" not in numbers:
        ratio = out["VERTICAL_STIFFNESS"] * out["UNLOADED_RADIUS"] / out["FNOMIN"]
        square = ratio * ratio - 4.0 * out["Q_FZ2"]
        if not square > 0.0:
            raise ModelError(
                f"{who}: with VERTICAL_STIFFNESS {out['VERTICAL_STIFFNESS']:g} and Q_FZ2 {out['Q_FZ2']:g} the radial "
                "force has no slope at the nominal load; give Q_FZ1"
            )
        out["Q_FZ1"] = square**0.5  # so that the stiffness at the nominal load is that
    if "DREFF" not in numbers and "FREFF" not in numbers:
        out["FREFF"] = 1.0 / 3.0
    return out
