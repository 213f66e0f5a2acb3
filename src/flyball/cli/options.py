"""Arguments of methods as command-line options: help from docstrings, and conversion of option texts to values.

NumPy-style docstrings give the help, the unit and the choices of an argument; its type determines typer's type.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from ..docstrings import ArgumentHelp
from ..errors import ModelError

RANGE_SEPARATOR = ":"  # in "0:10:21": 21 values from 0 to 10


@dataclass(frozen=True)
class OptionOverride:
    """Properties of an option that its type does not determine.

    ``default`` is the default of the command, ``default_text`` its description in the help; ``names`` are those of the
    option, ``many`` allows the option to be repeated, ``read`` converts the text to the method's value.
    """

    default: Any = None
    default_text: str | None = None
    names: tuple[str, ...] = ()
    help: str | None = None
    type: Any = None
    read: Callable[[Any, str, str], Any] | None = None
    argument: bool = False


def _unchanged(value: Any, unit: str, flag: str) -> Any:
    return value


def read_quantity(text: str, unit: str, flag: str) -> float:
    """Parse a number, or a quantity with the unit."""
    from ..model.expressions import number

    try:
        return float(text)
    except ValueError:
        return float(number(text.strip(), {}, unit or None, flag))


def read_values(text: str, unit: str, flag: str) -> list[float]:
    """Parse values written as ``0,0.5,1`` or ``first:last:count``."""
    if RANGE_SEPARATOR not in text:
        return [read_quantity(x, unit, flag) for x in text.split(",")]
    import numpy as np

    parts = text.split(RANGE_SEPARATOR)
    if len(parts) != 3 or not parts[2].strip().isdecimal() or int(parts[2]) < 2:
        raise ModelError(f"{flag} {text!r}: write values as 0,0.5,1 or as first:last:how many, for instance 0:10:21")
    return np.linspace(read_quantity(parts[0], unit, flag), read_quantity(parts[1], unit, flag), int(parts[2])).tolist()


def read_count_or_values(text: str, unit: str, flag: str) -> int | list[float]:
    """Parse a number of values, or the values."""
    if text.strip().lstrip("+-").isdecimal():
        return int(text)
    return read_values(text, unit, flag)


def read_steps(text: str, unit: str, flag: str) -> str | int | tuple[float, ...]:
    """Parse a choice of steps: ``all``, a number n for every n-th, or a range of time, as ``0.5,0.6``."""
    if text.isdecimal():
        return int(text)
    return text if text.isalpha() else tuple(read_quantity(x, unit, flag) for x in text.split(","))


def read_result_file(path: Path, unit: str, flag: str) -> Any:
    """Load the result in a file."""
    from ..mechanism import load_result

    return load_result(path)


def refuse_duplicate(out: Mapping[str, Any], name: str, flag: str, text: str) -> None:
    """Refuse a name that is given twice, since only one of both values would count."""
    if name in out:
        raise ModelError(f"{flag} {text!r}: {name!r} is given twice; give it once")


def read_assignments(texts: list[str], unit: str, flag: str) -> dict[str, str]:
    """Parse names and their values, each written as ``name=text``."""
    out: dict[str, str] = {}
    for text in texts:
        name, equals, value = (x.strip() for x in text.partition("="))
        if not equals or not value:
            raise ModelError(f'{flag} {text!r}: write name=value, for instance {flag} "A.angle=0.3*sin(2*t)"')
        refuse_duplicate(out, name, flag, text)
        out[name] = value
    return out


OPTION_TYPES: dict[
    str, tuple[Any, Callable[[Any, str, str], Any]]
] = {  # annotation -> (typer's type, conversion to a value)
    "str": (str, _unchanged),
    "int": (int, _unchanged),
    "float": (float, _unchanged),
    "bool": (bool, _unchanged),
    "str | Stepping": (str, _unchanged),
    "bool | str": (bool, _unchanged),
    "float | str": (str, read_quantity),
    "Sequence[str]": (list[str], _unchanged),
    "Sequence[float]": (str, read_values),
    "int | Sequence[float]": (str, read_count_or_values),
    "Result": (Path, read_result_file),
    "Result | Equilibrium": (Path, read_result_file),
}
FORMAT_HINTS = {
    "Sequence[str]": "may be repeated",
    "Sequence[float]": "as 0,0.5,1 or as first:last:how many",
    "int | Sequence[float]": "a number, or values as 0,0.5,1",
    "Result": "a result file (.nc)",
    "Result | Equilibrium": "a result file (.nc)",
}


@dataclass(frozen=True)
class Option:
    """An argument of a method as a typer option."""

    name: str
    flag: str
    parameter: inspect.Parameter
    unit: str
    make: Callable[[Any, str, str], Any]

    def read(self, value: Any) -> Any:
        """Convert typer's value to the method's value."""
        return self.make(value, self.unit, self.flag)


def make_option(p: inspect.Parameter, described: ArgumentHelp, override: OptionOverride | None) -> Option:
    """Make a command-line option from an argument of a method.

    Raises
    ------
    TypeError
        If no conversion is defined for its type.
    """
    override = override or OptionOverride()
    required = p.default is p.empty and override.default is None
    kind = str(p.annotation).removesuffix(" | None")
    if kind not in OPTION_TYPES and override.type is None:
        raise TypeError(f"argument {p.name!r} is a {p.annotation}: declare its command-line option, or leave it out")
    reads, make = OPTION_TYPES.get(kind, (override.type, _unchanged))
    reads, make = override.type or reads, override.read or make
    flag = f"--{p.name.replace('_', '-')}"
    names = override.names or (f"{flag}/--no-{flag[2:]}" if kind == "bool | str" else flag,)
    text = override.help or _option_help(p, described, override, FORMAT_HINTS.get(kind, ""))
    if override.argument or (required and kind == "str"):
        info: Any = typer.Argument(help=text)
        names = (p.name.upper(),)
    else:
        info = typer.Option(*names, help=text, show_default=False)
    default = inspect.Parameter.empty if required else override.default
    if kind == "bool":
        default = False
    elif not required and default is None:
        reads = reads | None
    parameter = inspect.Parameter(
        p.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[reads, info]
    )
    return Option(p.name, names[0], parameter, described.unit, make)


def _option_help(p: inspect.Parameter, described: ArgumentHelp, override: OptionOverride, hint: str) -> str:
    """Return the help of an option: description, format, choices and default."""
    usual = (
        override.default_text
        if override.default_text is not None
        else override.default
        if override.default is not None
        else p.default
    )
    notes = [hint, ", ".join(described.choices)]
    if isinstance(usual, (int, float, str)) and not isinstance(usual, bool) and p.default is not None:
        notes.append(f"{usual} if not given")
    notes = [x for x in notes if x]
    return f"{described.text} [{'; '.join(notes)}]" if notes else described.text


def make_options(
    arguments: Mapping[str, inspect.Parameter],
    described: Mapping[str, ArgumentHelp],
    overrides: Mapping[str, OptionOverride],
) -> list[Option]:
    """Return the options of a command, in the order of the method's arguments."""
    return [make_option(p, described.get(name, ArgumentHelp()), overrides.get(name)) for name, p in arguments.items()]
