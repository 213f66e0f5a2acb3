"""Which way kernels compile: linked as a whole where Numba's internals are as `link` expects, else the usual way."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

from ..errors import PerformanceNotice
from .lean import leanly
from .link import linked_as_a_whole
from .quick import quickly

TRIED = ("0.62", "0.63", "0.64", "0.65", "0.66", "0.67", "0.68")
"""Versions of Numba that the tests have passed with, or that lie between two such."""


@contextmanager
def optimise_once(top: str) -> Iterator[None]:
    """While the kernel with the (unique) name ``top`` compiles, do it our way, where that is possible."""
    if not ours():
        yield
        return
    from numba.core.compiler_lock import global_compiler_lock

    with global_compiler_lock, linked_as_a_whole(top), quickly(), leanly():  # nobody else's code is compiled so
        yield


@lru_cache(maxsize=1)
def ours() -> bool:
    """Whether kernels may be linked our way; other versions of Numba are probed once in every process."""
    import numba

    if ".".join(numba.__version__.split(".")[:2]) in TRIED:
        return True
    try:
        good = _probe() == 7.0
    except Exception:
        good = False
    if not good:
        warnings.warn(
            f"Numba {numba.__version__} differs inside from those that flyball was tried with ({TRIED[0]} to "
            f"{TRIED[-1]}): compiling takes the usual way, several times longer",
            PerformanceNotice,
            stacklevel=2,
        )
    return good


def _probe() -> float:
    """7, by a kernel of its own that calls functions of its own, linked our way: one in a loop, one that fails."""
    from numba import njit
    from numba.core.compiler_lock import global_compiler_lock
    from numba.extending import register_jitable

    @register_jitable
    def more(x: Any, pair: Any) -> Any:
        return x + pair[1]

    @register_jitable
    def root(x: Any) -> Any:
        if x < 0.0:
            raise ValueError
        return x**0.5

    def probe_kernel(a: Any, n: Any) -> Any:
        total = 0j
        for i in range(1, n):
            total = more(total + a * i, (i, 1.0)) - 1j
        return root(total.real + 1.0) + (total + 1j).imag  # 5 - 3

    with global_compiler_lock, linked_as_a_whole(probe_kernel.__qualname__), quickly(), leanly():
        kernel = njit(probe_kernel)
        found = kernel(2.0, 5)  # 2 (1 + 2 + 3 + 4) + 4 - 4 i
        try:
            kernel(-2.0, 5)
        except ValueError:
            return found + 5.0
    return 0.0
