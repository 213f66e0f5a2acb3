"""Word of compilation that takes long, before it begins: what is compiled, and for about how long."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from ..errors import PerformanceNotice, warn

BEGINS = "compiling for this machine, once: "
_said: set[str] = set()
_there: set[str] = set()  # what this process has, or finds in the cache


class Part(NamedTuple):
    """What is compiled at one time: in words, the seconds that it takes a machine with nothing else to do, and what
    it is (kernels and doors).
    """

    what: str
    seconds: float
    code: tuple[Any, ...]


def announce(parts: Iterable[Part]) -> None:
    """Say what of these has to be compiled first; of each once a process."""
    cold = [p for p in parts if missing(p)]
    if cold:
        _said.update(p.what for p in cold)
        seconds = 5 * max(1, round(sum(p.seconds for p in cold) / 5))
        warn(f"{BEGINS}{' and '.join(p.what for p in cold)}, about {seconds} s", PerformanceNotice)


def missing(part: Part) -> bool:
    """Whether it has to be compiled first, and nothing was said of that."""
    if part.what in _said or part.what in _there:
        return False
    if any(x.cold for x in part.code):
        return True
    _there.add(part.what)
    return False


def forget() -> None:
    """As if nothing had been said."""
    _said.clear()
    _there.clear()
