"""Other code's functions, replaced for a while."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

Change = tuple[Any, str, Callable[[Any], Any]]
"""A class or module, the name of what is its own there, and what is made of that to stand in its place."""


@contextmanager
def patched(changes: Iterable[Change]) -> Iterator[None]:
    """While it lasts, have what is made of each stand in its place; afterwards all is as it was.

    Raises
    ------
    KeyError
        If something is not there: then nothing is changed.
    """
    before = [(owner, name, vars(owner)[name], make) for owner, name, make in changes]
    try:
        for owner, name, _, make in before:
            setattr(owner, name, make(getattr(owner, name)))
        yield
    finally:
        for owner, name, original, _ in before:
            setattr(owner, name, original)
