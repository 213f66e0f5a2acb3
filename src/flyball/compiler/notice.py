"""Word of compilation that takes long, before it begins; and how long it took."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

from ..errors import PerformanceNotice, warn

BEGINS = "compiling for this machine, once: "
IMPORT = 0.25
"""Seconds that importing Numba takes the machine on which `COSTS` were measured."""
COSTS: dict[str, tuple[str, float]] = {
    "engine": ("the equations of motion", 22.0),
    "stepped": ("the derivatives of the equations", 15.0),
    "radau_steps": ("the Radau method", 9.5),
    "alpha_steps": ("the generalised-alpha method", 6.0),
    "variational_steps": ("the variational method", 4.0),
    "watched_kernel": ("the search for events", 8.7),
    "instant": ("what happens at events", 3.2),
    "explicit_steps": ("explicit methods", 2.1),
    "variation_kernel": ("sensitivities of motions", 4.5),
    "between": ("contact of all shapes", 9.0),
    "between_convex": ("contact of convex shapes", 2.3),
    "between_planar": ("contact in the plane", 1.3),
    "search": ("the search for contacts", 5.6),
    "march_kernel": ("time stepping with contact", 7.7),
    "joined": ("mechanisms in time stepping", 7.9),
    "newton": ("the contact solver", 5.8),
    "gauss_seidel": ("the contact solver by sweeps", 3.5),
    "admm": ("the contact solver admm", 7.7),
    "apgd": ("the contact solver apgd", 6.4),
    "barzilai_borwein": ("the contact solver barzilai-borwein", 2.7),
    "jacobi": ("the contact solver jacobi", 2.9),
    "lean": ("the contact solver apgd-lean", 2.8),
    "settle_kernel": ("contact forces at rest", 3.8),
    "auto": ("the choice of contact solvers", 1.8),
    "shares": ("forces that are shared", 2.1),
    "margin_kernel": ("forces that are shared", 1.7),
    "shared_kernel": ("forces that are shared", 2.1),
    "dependencies_kernel": ("dependent constraints", 1.6),
    "sampled_kernel": ("sampled controllers", 1.2),
    "sampled_steps_kernel": ("sampled controllers", 1.5),
    "best_kernel": ("forces that are shared", 1.3),
    "pyramid": ("the contact solver of pyramids", 1.7),
}
"""What a kernel is, in words, and the seconds that compiling it took that machine, Numba's import apart."""
DEFAULT = ("part of the numerics", 0.5)

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
