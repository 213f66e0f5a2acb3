"""Formulas whose source is put together at import: the lists of kinds that compiled loops choose from.

A registry knows the kinds; compiled code wants ``if kind == 0: ... if kind == 1: ...``. The text is kept where
tracebacks look for it, and is part of the stamp of every kernel that takes in the file it was made in.
"""

from __future__ import annotations

import linecache
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from .jit import formula
from .stamp import TEXTS


def written(home: str, name: str, arguments: str, lines: Sequence[str], names: Mapping[str, Any]) -> Any:
    """A formula with these lines.

    Parameters
    ----------
    home : str
        The module that it belongs to: ``__name__``.
    name, arguments : str
        As in ``def name(arguments)``.
    lines : sequence of str
        The body, without indentation of its own.
    names : mapping
        What the body calls.
    """
    text = "".join([f"def {name}({arguments}):\n", *(f"    {line}\n" for line in lines)])
    file = f"<{home}.{name}>"
    made = dict(names)
    exec(compile(text, file, "exec"), made)
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
    TEXTS[f"{home}.{name}"] = text
    return formula(made[name])


def ladder(home: str, name: str, arguments: str, cases: Mapping[int, Callable], otherwise: str) -> Any:
    """A formula ``name(kind, arguments)`` that hands on to the one of that kind.

    ``otherwise`` is what an unknown kind answers: nan, so that no element is ever answered by another one's formula.
    """
    names: dict[str, Any] = {f"{_plain(f)}_{kind}": f for kind, f in sorted(cases.items())}
    lines = []
    for called, kind in zip(names, sorted(cases), strict=True):
        lines += [f"if kind == {kind}:", f"    return {called}({arguments})"]
    return written(home, name, f"kind, {arguments}", [*lines, f"return {otherwise}"], names | {"nan": math.nan})


def _plain(f: Callable) -> str:
    return f"{f.__module__.rpartition('.')[2]}_{f.__name__}"
