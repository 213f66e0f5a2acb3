"""What the docstring of a method says about its arguments: NumPy style, read as it stands."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import NamedTuple

HEAD = re.compile(r"^(?P<names>\w+(?:, \w+)*) : (?P<type>.*)$")
CHOICE = re.compile(r'"([^"]+)"')
UNIT = re.compile(r"\[([^\],]+)\]")


class Described(NamedTuple):
    """An argument: the unit of its number ("" for none), what can be chosen, and what is said about it."""

    unit: str = ""
    choices: tuple[str, ...] = ()
    text: str = ""


def summary(method: Callable) -> str:
    """The first line of the docstring."""
    return plain((inspect.getdoc(method) or "").partition("\n")[0])


def described(method: Callable) -> dict[str, Described]:
    """The section Parameters, by name."""
    text = inspect.getdoc(method) or ""
    _, _, section = text.partition("Parameters\n----------\n")
    section = re.split(r"\n\w+\n-{3,}\n", section)[0]
    found: dict[str, Described] = {}
    for head, *body in (block.split("\n") for block in re.split(r"\n(?=\S)", section) if block.strip()):
        match = HEAD.match(head)
        if match is None:
            raise ValueError(f"{method.__qualname__}: the docstring line {head!r} is not 'name : type'")
        unit = UNIT.search(match["type"])
        choices = tuple(CHOICE.findall(match["type"])) if match["type"].startswith("{") else ()
        told = plain(" ".join(line.strip() for line in body)).strip()
        for name in match["names"].split(", "):
            found[name] = Described(unit[1] if unit else "", choices, told)
    return found


def plain(text: str) -> str:
    """Without the marks of code."""
    return re.sub(r"`+", "", text)
