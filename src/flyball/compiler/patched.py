"""Other code's functions, replaced for a while."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

Change = tuple[Any, str, Callable[[Any], Any]]
"""A class or module, the name of something it has, own or inherited, and what is made of that to stand there."""


@contextmanager
def patched(changes: Iterable[Change]) -> Iterator[None]:
    """While it lasts, have what is made of each stand in its place; afterwards all is as it was.

    Raises
    ------
    AttributeError
        If something is not there: then nothing is changed.
    """
    made = [(owner, name, make(getattr(owner, name))) for owner, name, make in changes]
    own = [(owner, name, vars(owner)[name]) for owner, name, _ in made if name in vars(owner)]
    inherited = [(owner, name) for owner, name, _ in made if name not in vars(owner)]
    try:
        for owner, name, replacement in made:
            setattr(owner, name, replacement)
        yield
    finally:
        for owner, name, original in own:
            setattr(owner, name, original)
        for owner, name in inherited:
            delattr(owner, name)
