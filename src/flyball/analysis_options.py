"""Options of analyses: frozen classes, created by the methods of `Mechanism`, whose values are checked here.

The options class of an analysis has one field for each argument of its method. Defaults and descriptions are given
only at the method (`flyball.mechanism_methods`); ``tests/program/test_options.py`` checks that both agree.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, dataclass, fields
from numbers import Number
from typing import Any, NamedTuple, Self

import numpy as np

from .errors import ModelError
from .model.expressions import number

LARGEST = np.iinfo(np.int64).max  # largest integer that compiled code can count to
TIMES = ("t", "t_start", "t_end")
_LISTS = (list, tuple, np.ndarray)


@dataclass(frozen=True, kw_only=True)
class AnalysisOptions:
    """Base class of the options of an analysis; times are converted to numbers [s], lists of names to tuples."""

    @classmethod
    def from_arguments(cls, given: Mapping[str, Any]) -> Self:
        """Create options from ``locals()`` of the method."""
        return cls(**{name: given[name] for name in names_of(cls)})

    def known(self, **values: Any) -> Self:
        """Create options from values that need no check."""
        out = object.__new__(type(self))
        vars(out).update(vars(self))
        vars(out).update(values)
        return out

    def __post_init__(self) -> None:
        own = vars(self)
        for name, check in _option_spec(type(self)).checks:
            own[name] = check(own[name], name)


Check = Callable[[Any, str], Any]
"""Check of an option: takes the given value and the option's name, returns the converted value or raises ModelError."""


class _OptionSpec(NamedTuple):
    """Checks of the fields of an options class."""

    names: tuple[str, ...]
    checks: tuple[tuple[str, Check], ...]  # fields that need a check besides being present


_OPTION_SPECS: dict[type, _OptionSpec] = {}


def _option_spec(cls: type[AnalysisOptions]) -> _OptionSpec:
    """Return the checks of an options class (cached)."""
    if cls not in _OPTION_SPECS:
        every = fields(cls)
        checks = ((f.name, _check_of_field(f)) for f in every)
        found = tuple((name, check) for name, check in checks if check is not None)
        _OPTION_SPECS[cls] = _OptionSpec(tuple(f.name for f in every), found)
    return _OPTION_SPECS[cls]


def names_of(cls: type[AnalysisOptions]) -> tuple[str, ...]:
    """Return the names of the options of a class."""
    return _option_spec(cls).names


def _check_of_field(f: Field[Any]) -> Check | None:
    """Return the check of a field."""
    kind = str(f.type)
    optional = "None" in kind
    if f.name in TIMES:
        return seconds if kind == "float" else _unless_none(seconds)
    if kind in ("tuple[str, ...]", "tuple[str, ...] | None"):
        return _unless_none(name_list) if optional else name_list
    if f.name == "values":
        return number_array
    if f.name == "parameters":
        return _unless_none(_parameters)
    if f.name == "progress":
        return _progress
    if kind.startswith("Callable"):
        return _unless_none(_function) if optional else _function
    return _unless_none(_mapping) if kind.startswith("Mapping") else _OF_TYPE.get(kind)


def _unless_none(check: Check) -> Check:
    return lambda value, name: None if value is None else check(value, name)


def _text(value: Any, name: str) -> str:
    if not isinstance(value, str):
        raise ModelError(f"{name} is a text, not a {type(value).__name__}")
    return value


def _list(value: Any, name: str) -> Any:
    if isinstance(value, str) or not isinstance(value, _LISTS):
        raise ModelError(f"{name} is a list of numbers or quantities, not {value!r}")
    return value


def _truth(value: Any, name: str) -> bool:
    if not isinstance(value, bool):
        raise ModelError(f"{name} is True or False, not {value!r}")
    return value


def _function(value: Any, name: str) -> Any:
    if not callable(value):
        raise ModelError(f"{name} is a function, not {value!r}")
    return value


def _mapping(value: Any, name: str) -> Any:
    if not isinstance(value, Mapping) or not all(isinstance(k, str) for k in value):
        raise ModelError(f"{name} maps names to what is given for each, not {value!r}")
    return value


def _progress(value: Any, name: str) -> Any:
    if not (isinstance(value, bool) or callable(value)):
        raise ModelError(f"{name} is True, False or a function of the fraction done, not {value!r}")
    return value


_OF_TYPE: dict[str, Check] = {"str": _text, "bool": _truth, "Sequence[float | str]": _list}


def _parameters(value: Any, _: str) -> Any:
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value):
        raise ModelError(f"parameters maps names to values, for instance {{'mass': 2}}; {value!r} does not")
    for name, x in value.items():
        if isinstance(x, complex):
            raise ModelError(f"parameter {name!r}: {x!r} is complex; a real number is wanted")
    return value


@dataclass(frozen=True, kw_only=True)
class AssembleOptions(AnalysisOptions):
    """Options of `Mechanism.assemble`."""

    t: float
    parameters: Mapping[str, float] | None


@dataclass(frozen=True, kw_only=True)
class MobilityOptions(AssembleOptions):
    """Options of `Mechanism.mobility`."""

    inertia: bool


def seconds(value: Any, name: str) -> float:
    """Convert a number or a quantity such as ``"5 ms"`` to a time in seconds.

    Raises
    ------
    ModelError
        If the value is not a time.
    """
    if type(value) is float and value - value == 0.0:
        return value
    found = number(value, {}, "s", name)
    if isinstance(found, complex) or not isinstance(found, Number):
        raise ModelError(f"{name} is a time [s], not {value!r}")
    return float(found)  # type: ignore[arg-type]


def name_list(value: Any, name: str) -> tuple[str, ...]:
    """Convert a sequence of names to a tuple; a single string is refused, since Python would iterate over its letters.

    Raises
    ------
    ModelError
        If the value is not a sequence of names.
    """
    if not isinstance(value, (str, bytes)) and isinstance(value, (Sequence, Mapping, set)):
        found = tuple(value)
        if all(isinstance(x, str) for x in found):
            return found
    raise ModelError(f"{name} is a list of names, for instance {name}=['slider.x'], not {value!r}")


def number_array(value: Any, name: str) -> np.ndarray:
    """Convert a sequence of finite numbers to an array; the analysis itself checks its length.

    Raises
    ------
    ModelError
        If the value is not a sequence of finite numbers.
    """
    try:
        found = np.array(np.nan) if np.iscomplexobj(value) else np.array(value, float)
    except (TypeError, ValueError, OverflowError):
        found = np.array(np.nan)
    if found.ndim != 1 or not np.isfinite(found).all():
        raise ModelError(f"{name} are finite numbers, for instance {name}=[1.0, 2.0], not {value!r}")
    return found


def require_positive(value: Any, name: str) -> None:
    """Refuse a value that is not a number greater than 0.

    Raises
    ------
    ModelError
        If it is not.
    """
    if type(value) is float and value > 0.0:
        return
    if isinstance(value, bool) or not isinstance(value, Number) or isinstance(value, complex) or not value > 0:  # type: ignore[operator]
        raise ModelError(f"{name} must be greater than 0, got {value!r}")
    number(value, {}, None, name)  # not too large


def require_count(value: Any, name: str, least: int = 1) -> None:
    """Refuse a value that is not a whole number of at least ``least``.

    Raises
    ------
    ModelError
        If it is not.
    """
    try:
        whole = operator.index(value)
    except TypeError:
        whole = None
    if isinstance(value, bool) or whole is None:
        raise ModelError(f"{name} must be a whole number, not {value!r}")
    if not least <= whole <= LARGEST:
        bound = f"at least {least}" if whole < least else f"at most {LARGEST}"
        raise ModelError(f"{name} must be {bound}, got {value!r}")
