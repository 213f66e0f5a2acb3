"""How long Numba compiled in this process, or read compiled code: what a first call takes besides its computing."""

from __future__ import annotations

import time
from threading import Lock
from typing import Any

from ..compiler.jit import on_numba

_spans: list[tuple[float, float]] = []
_lock = Lock()
_open = [0, 0.0]  # compilations that are under way, and since when


def compiled_since(begin: float) -> float:
    """Seconds since ``begin`` (by `time.perf_counter`) during which some thread compiled or waited for that."""
    with _lock:
        return sum(max(0.0, b - max(a, begin)) for a, b in _spans if b > begin)


@on_numba
def _listen() -> None:
    from numba.core import event

    class Compiling(event.Listener):
        """Takes note of when Numba's compiler is busy."""

        def on_start(self, event: Any) -> None:
            with _lock:
                _open[0] += 1
                if _open[0] == 1:
                    _open[1] = time.perf_counter()

        def on_end(self, event: Any) -> None:
            with _lock:
                _open[0] -= 1
                if _open[0] == 0:
                    _spans.append((_open[1], time.perf_counter()))

    event.register("numba:compiler_lock", Compiling())
