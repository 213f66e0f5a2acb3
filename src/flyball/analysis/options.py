"""What an analysis is asked: the frozen object of its options, made by the method of `Mechanism` and checked here.

An analysis declares the fields of its own class, one for each argument of its method. Defaults and meanings stand with
the method alone (`flyball.methods`); ``tests/program/test_options.py`` holds the two together.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from numbers import Number
from typing import Any, Self

import numpy as np

from ..errors import ModelError
from ..model.expressions import number

TIMES = ("t", "t_start", "t_end")
_LISTS = (list, tuple, np.ndarray)


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of an analysis. Times are numbers [s], lists of names are tuples, whatever they were given as."""

    @classmethod
    def asked(cls, given: Mapping[str, Any]) -> Self:
        """From the arguments of a method: its ``locals()``."""
        return cls(**{f.name: given[f.name] for f in fields(cls)})

    def known(self, **values: Any) -> Self:
        """The same with values that need no check."""
        out = copy.copy(self)
        for name, value in values.items():
            object.__setattr__(out, name, value)
        return out

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if f.name in TIMES and (value is not None or f.type == "float"):
                value = seconds(value, f.name)
            elif f.type == "tuple[str, ...]" or (f.type == "tuple[str, ...] | None" and value is not None):
                value = names(value, f.name)
            elif f.type == "str" and not isinstance(value, str):
                raise ModelError(f"{f.name} is a text, not a {type(value).__name__}")
            elif f.name == "values":
                value = numbers(value, f.name)
            elif f.type == "Sequence[float | str]" and (isinstance(value, str) or not isinstance(value, _LISTS)):
                raise ModelError(f"{f.name} is a list of numbers or quantities, not {value!r}")
            elif (
                str(f.type).startswith("Callable") and not callable(value) and not (value is None and "None" in f.type)
            ):
                raise ModelError(f"{f.name} is a function, not {value!r}")
            elif f.type == "bool" and not isinstance(value, bool):
                raise ModelError(f"{f.name} is True or False, not {value!r}")
            elif f.name == "parameters" and value is not None:
                _check_parameters(value)
                continue
            elif f.name != "parameters" and str(f.type).startswith("Mapping") and not isinstance(value, Mapping | None):
                raise ModelError(f"{f.name} maps names to what is given for each, not {value!r}")
            elif f.name == "progress" and not (isinstance(value, bool) or callable(value)):
                raise ModelError(f"progress is True, False or a function of the fraction done, not {value!r}")
            else:
                continue
            object.__setattr__(self, f.name, value)


def _check_parameters(value: Any) -> None:
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value):
        raise ModelError(f"parameters maps names to values, for instance {{'mass': 2}}; {value!r} does not")
    for name, x in value.items():
        if isinstance(x, complex):
            raise ModelError(f"parameter {name!r}: {x!r} is complex; a real number is wanted")


@dataclass(frozen=True, kw_only=True)
class AssembleOptions(Options):
    """What `Mechanism.assemble` is asked."""

    t: float
    parameters: Mapping[str, float] | None


@dataclass(frozen=True, kw_only=True)
class MobilityOptions(AssembleOptions):
    """What `Mechanism.mobility` is asked."""

    inertia: bool


def seconds(value: Any, name: str) -> float:
    """A time from a number or a quantity such as ``"5 ms"``.

    Raises
    ------
    ModelError
        If it is none.
    """
    found = number(value, {}, "s", name)
    if isinstance(found, complex) or not isinstance(found, Number):
        raise ModelError(f"{name} is a time [s], not {value!r}")
    return float(found)  # type: ignore[arg-type]


def names(value: Any, name: str) -> tuple[str, ...]:
    """A sequence of names; a single text is refused, which Python would take letter by letter.

    Raises
    ------
    ModelError
        If it is none.
    """
    if not isinstance(value, (str, bytes)) and isinstance(value, (Sequence, Mapping, set)):
        found = tuple(value)
        if all(isinstance(x, str) for x in found):
            return found
    raise ModelError(f"{name} is a list of names, for instance {name}=['slider.x'], not {value!r}")


def numbers(value: Any, name: str) -> np.ndarray:
    """A sequence of finite numbers as an array; which there must be, the analysis says.

    Raises
    ------
    ModelError
        If it is none.
    """
    try:
        found = np.array(np.nan) if np.iscomplexobj(value) else np.array(value, float)
    except (TypeError, ValueError):
        found = np.array(np.nan)
    if found.ndim != 1 or not np.isfinite(found).all():
        raise ModelError(f"{name} are finite numbers, for instance {name}=[1.0, 2.0], not {value!r}")
    return found


def positive(value: Any, name: str) -> None:
    """Refuse what is no number greater than 0.

    Raises
    ------
    ModelError
        If it is none.
    """
    if isinstance(value, bool) or not isinstance(value, Number) or isinstance(value, complex) or not value > 0:  # type: ignore[operator]
        raise ModelError(f"{name} must be greater than 0, got {value!r}")


def count(value: Any, name: str, least: int = 1) -> None:
    """Refuse what is no whole number of at least ``least``.

    Raises
    ------
    ModelError
        If it is none.
    """
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise ModelError(f"{name} must be a whole number, not {value!r}")
    if value < least:
        raise ModelError(f"{name} must be at least {least}, got {value!r}")
