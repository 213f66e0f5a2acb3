"""Word of compilation that takes long, before it begins; and how long it took."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

from ..errors import PerformanceNotice, warn

BEGINS = "compiling for this machine, once: "
IMPORT = 0.55
"""Seconds that importing Numba takes the machine on which `COSTS` were measured."""
COSTS: dict[str, tuple[str, float]] = {}
"""What a kernel is, in words, and the seconds that compiling it took that machine, Numba's import apart."""
DEFAULT = ("part of the numerics", 2.0)

_spans: list[tuple[float, float]] = []
_lock = Lock()
_scale: list[float] = []  # seconds that compiling takes here, for one of that machine


@contextmanager
def announce(kernel: Any) -> Iterator[None]:
    """Say that a kernel is compiled, and for about how long, by what this machine has taken so far; keep the time."""
    began = time.perf_counter()
    if not _scale:
        from .emit import start_compiler

        start_compiler()
        _scale.append((time.perf_counter() - began) / IMPORT)
    what, seconds = COSTS.get(kernel.__qualname__, DEFAULT)
    if seconds * _scale[-1] >= 1.0:
        warn(f"{BEGINS}{what}, about {_rounded(seconds * _scale[-1])} s", PerformanceNotice)
    try:
        yield
    finally:
        with _lock:
            _spans.append((began, time.perf_counter()))
        took = time.perf_counter() - began
        if seconds >= 1.0:
            _scale.append(took / seconds)


def note_compiled(kernel: Any, seconds: float) -> None:
    """Note the processor time that a kernel took, for ``flyball compile``."""
    TIMES[kernel.name] = seconds


TIMES: dict[str, float] = {}


def compiled_since(begin: float) -> float:
    """Seconds since ``begin`` (by `time.perf_counter`) during which this process compiled."""
    with _lock:
        return sum(max(0.0, b - max(a, begin)) for a, b in _spans if b > begin)


def _rounded(seconds: float) -> int:
    return 5 * max(1, round(seconds / 5)) if seconds > 7.5 else max(1, round(seconds))
