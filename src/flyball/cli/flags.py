"""Arguments of methods on the command line: what typer reads for each type, and what makes a value of it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import ModelError
from .docs import Described

MANY = ":"  # in "0:10:21", 21 values from 0 to 10


@dataclass(frozen=True)
class Flag:
    """How an argument stands on the command line, where its type does not say it all.

    ``default`` is what the command takes if it is not given, ``shown`` what its help says instead; ``names`` are the
    names of the option, ``many`` says that it may be repeated, ``read`` makes the method's value of it.
    """

    default: Any = None
    shown: str | None = None
    names: tuple[str, ...] = ()
    help: str | None = None
    type: Any = None
    read: Callable[[Any, str, str], Any] | None = None
    argument: bool = False


def _as_is(value: Any, unit: str, flag: str) -> Any:
    return value


def quantity(text: str, unit: str, flag: str) -> float:
    """A number, or a quantity that has the unit."""
    from ..model.expressions import number

    try:
        return float(text)
    except ValueError:
        return float(number(text.strip(), {}, unit or None, flag))


def values(text: str, unit: str, flag: str) -> list[float]:
    """Values from ``0,0.5,1`` or from ``first:last:how many``."""
    if MANY not in text:
        return [quantity(x, unit, flag) for x in text.split(",")]
    import numpy as np

    parts = text.split(MANY)
    if len(parts) != 3 or not parts[2].strip().isdecimal() or int(parts[2]) < 2:
        raise ModelError(f"{flag} {text!r}: write values as 0,0.5,1 or as first:last:how many, for instance 0:10:21")
    return np.linspace(quantity(parts[0], unit, flag), quantity(parts[1], unit, flag), int(parts[2])).tolist()


def number_or_values(text: str, unit: str, flag: str) -> int | list[float]:
    """A number of values, or the values."""
    if text.strip().lstrip("+-").isdecimal():
        return int(text)
    return values(text, unit, flag)


def result_file(path: Path, unit: str, flag: str) -> Any:
    """The result in a file."""
    from ..files import load_result

    return load_result(path)


def once(out: Mapping[str, Any], name: str, flag: str, text: str) -> None:
    """Refuse what is given twice: one of both would count."""
    if name in out:
        raise ModelError(f"{flag} {text!r}: {name!r} is given twice; give it once")


def assigned(texts: list[str], unit: str, flag: str) -> dict[str, str]:
    """Names and what they are given, each as ``name=text``."""
    out: dict[str, str] = {}
    for text in texts:
        name, equals, value = (x.strip() for x in text.partition("="))
        if not equals or not value:
            raise ModelError(f'{flag} {text!r}: write name=value, for instance {flag} "A.angle=0.3*sin(2*t)"')
        once(out, name, flag, text)
        out[name] = value
    return out


KINDS: dict[str, tuple[Any, Callable[[Any, str, str], Any]]] = {  # annotation -> (what typer reads, what makes a value)
    "str": (str, _as_is),
    "int": (int, _as_is),
    "float": (float, _as_is),
    "bool": (bool, _as_is),
    "str | Stepping": (str, _as_is),
    "bool | str": (bool, _as_is),
    "float | str": (str, quantity),
    "Sequence[str]": (list[str], _as_is),
    "Sequence[float]": (str, values),
    "int | Sequence[float]": (str, number_or_values),
    "Result": (Path, result_file),
    "Result | Equilibrium": (Path, result_file),
}
HINTS = {
    "Sequence[str]": "may be repeated",
    "Sequence[float]": "as 0,0.5,1 or as first:last:how many",
    "int | Sequence[float]": "a number, or values as 0,0.5,1",
    "Result": "a result file (.nc)",
    "Result | Equilibrium": "a result file (.nc)",
}


@dataclass(frozen=True)
class Option:
    """An argument of a method, ready for typer."""

    name: str
    flag: str
    parameter: inspect.Parameter
    unit: str
    make: Callable[[Any, str, str], Any]

    def read(self, value: Any) -> Any:
        """The method's value."""
        return self.make(value, self.unit, self.flag)


def option(p: inspect.Parameter, told: Described, own: Flag | None) -> Option:
    """An option of the command line from an argument of a method.

    Raises
    ------
    TypeError
        If nothing says how values of its type stand on a command line.
    """
    own = own or Flag()
    required = p.default is p.empty and own.default is None
    kind = str(p.annotation).removesuffix(" | None")
    if kind not in KINDS and own.type is None:
        raise TypeError(
            f"argument {p.name!r} is a {p.annotation}: say how it stands on the command line, or leave it out"
        )
    reads, make = KINDS.get(kind, (own.type, _as_is))
    reads, make = own.type or reads, own.read or make
    flag = f"--{p.name.replace('_', '-')}"
    names = own.names or (f"{flag}/--no-{flag[2:]}" if kind == "bool | str" else flag,)
    text = own.help or _help(p, told, own, HINTS.get(kind, ""))
    if own.argument or (required and kind == "str"):
        info: Any = typer.Argument(help=text)
        names = (p.name.upper(),)
    else:
        info = typer.Option(*names, help=text, show_default=False)
    default = inspect.Parameter.empty if required else own.default
    if kind == "bool":
        default = False
    elif not required and default is None:
        reads = reads | None
    parameter = inspect.Parameter(
        p.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[reads, info]
    )
    return Option(p.name, names[0], parameter, told.unit, make)


def _help(p: inspect.Parameter, told: Described, own: Flag, hint: str) -> str:
    """What the docstring says, how it is written, what can be chosen, and what it is if it is not given."""
    usual = own.shown if own.shown is not None else own.default if own.default is not None else p.default
    notes = [hint, ", ".join(told.choices)]
    if isinstance(usual, (int, float, str)) and not isinstance(usual, bool) and p.default is not None:
        notes.append(f"{usual} if not given")
    notes = [x for x in notes if x]
    return f"{told.text} [{'; '.join(notes)}]" if notes else told.text


def options(
    arguments: Mapping[str, inspect.Parameter], told: Mapping[str, Described], own: Mapping[str, Flag]
) -> list[Option]:
    """Options of a command, in the order of the method's arguments."""
    return [option(p, told.get(name, Described()), own.get(name)) for name, p in arguments.items()]
