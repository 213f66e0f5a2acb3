"""Docstrings in the style of NumPy as data: help of arguments for the command line and the schema of model files."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import NamedTuple

ARGUMENT_LINE = re.compile(r"^(?P<names>\w+(?:, \w+)*) : (?P<type>.*)$")
CHOICE_PATTERN = re.compile(r'"([^"]+)"')
UNIT_PATTERN = re.compile(r"\[([^\],]+)\]")


class ArgumentHelp(NamedTuple):
    """Help of an argument: its type, the unit of its number ("" for none), the choices, and the description."""

    type: str = ""
    unit: str = ""
    choices: tuple[str, ...] = ()
    text: str = ""


def first_doc_line(documented: Callable) -> str:
    """Return the first line of the docstring."""
    return without_code_marks((inspect.getdoc(documented) or "").partition("\n")[0])


def argument_help(documented: Callable) -> dict[str, ArgumentHelp]:
    """Return the entries of the section Parameters of a function or class by argument name."""
    text = inspect.getdoc(documented) or ""
    _, _, section = text.partition("Parameters\n----------\n")
    section = re.split(r"\n[\w ]+\n-{3,}\n", section)[0]
    found: dict[str, ArgumentHelp] = {}
    for head, *body in (block.split("\n") for block in re.split(r"\n(?=\S)", section) if block.strip()):
        match = ARGUMENT_LINE.match(head)
        if match is None:
            raise ValueError(f"{documented.__qualname__}: the docstring line {head!r} is not 'name : type'")
        unit = UNIT_PATTERN.search(match["type"])
        choices = tuple(CHOICE_PATTERN.findall(match["type"])) if match["type"].startswith("{") else ()
        told = without_code_marks(" ".join(line.strip() for line in body)).strip()
        for name in match["names"].split(", "):
            found[name] = ArgumentHelp(without_code_marks(match["type"]), unit[1] if unit else "", choices, told)
    return found


def without_code_marks(text: str) -> str:
    """Remove reST code marks from a text."""
    return re.sub(r"`+", "", text)
