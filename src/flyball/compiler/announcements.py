"""Announcement of long compilations, with the duration that is expected on this machine under its present load."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

from ..errors import PerformanceNotice, warn_user
from .object_code import start_compiler

NOTICE_PREFIX = "compiling for this machine, once: "
NUMBA_IMPORT_SECONDS = 0.25
"""Seconds to import Numba on the machine on which `COSTS` were measured."""
COSTS: dict[str, tuple[str, float]] = {
    "engine": ("the equations of motion", 26.6),
    "residuals_kernel": ("the derivatives of the equations", 15.0),
    "radau_steps": ("the Radau method", 9.5),
    "alpha_steps": ("the generalised-alpha method", 6.0),
    "variational_steps": ("the variational method", 4.0),
    "event_loop_kernel": ("the search for events", 8.7),
    "mode_kernel": ("what happens at events", 3.2),
    "explicit_steps": ("explicit methods", 2.1),
    "variation_kernel": ("sensitivities of motions", 4.5),
    "record_motion_kernel": ("energies and errors of motions", 1.1),
    "batch_kernel": ("recursive dynamics", 5.0),
    "between": ("contact of all shapes", 9.0),
    "between_convex": ("contact of convex shapes", 2.3),
    "between_planar": ("contact in the plane", 1.3),
    "search": ("the search for contacts", 5.6),
    "step_loop_kernel": ("time stepping with contact", 7.7),
    "mechanism_kernel": ("mechanisms in time stepping", 7.9),
    "newton": ("the contact solver", 5.8),
    "gauss_seidel": ("the contact solver by sweeps", 3.5),
    "admm": ("the contact solver admm", 7.7),
    "apgd": ("the contact solver apgd", 6.4),
    "barzilai_borwein": ("the contact solver barzilai-borwein", 2.7),
    "jacobi": ("the contact solver jacobi", 2.9),
    "scaled_apgd": ("the contact solver apgd-lean", 2.8),
    "solve_dense_kernel": ("contact forces at rest", 3.8),
    "auto": ("the choice of contact solvers", 1.8),
    "group_guard_kernel": ("forces that are shared", 2.1),
    "margin_kernel": ("forces that are shared", 1.7),
    "distribute_forces_kernel": ("forces that are shared", 2.1),
    "dependencies_kernel": ("dependent constraints", 1.6),
    "sampled_kernel": ("sampled controllers", 1.2),
    "sampled_steps_kernel": ("sampled controllers", 1.5),
    "largest_margin_kernel": ("forces that are shared", 1.3),
    "pyramid": ("the contact solver of pyramids", 1.7),
}
"""Description of each kernel, and the seconds of its compilation on that machine, without the import of Numba."""
DEFAULT_COST = ("part of the numerics", 0.5)

_compile_spans: list[tuple[float, float]] = []
_spans_lock = Lock()
_scale: list[float] = []  # processor time of compilation here, relative to the reference machine


@contextmanager
def announce_compilation(kernel: Any) -> Iterator[None]:
    """Announce the compilation of a kernel and its expected duration, from previous ones; record the time."""
    began = time.perf_counter()
    if not _scale:
        start_compiler()
        _scale.append((time.perf_counter() - began) / NUMBA_IMPORT_SECONDS)
    what, seconds = COSTS.get(kernel.__qualname__, DEFAULT_COST)
    if seconds * _scale[-1] >= 1.0:
        warn_user(f"{NOTICE_PREFIX}{what}, about {_rounded_seconds(seconds * _scale[-1])} s", PerformanceNotice)
    try:
        yield
    finally:
        with _spans_lock:
            _compile_spans.append((began, time.perf_counter()))
        took = time.perf_counter() - began
        if seconds >= 1.0:
            _scale.append(took / seconds)


def compiled_since(begin: float) -> float:
    """Seconds since ``begin`` (of `time.perf_counter`) during which this process compiled."""
    with _spans_lock:
        return sum(max(0.0, b - max(a, begin)) for a, b in _compile_spans if b > begin)


def _rounded_seconds(seconds: float) -> int:
    return 5 * max(1, round(seconds / 5)) if seconds > 7.5 else max(1, round(seconds))
