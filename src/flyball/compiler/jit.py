"""The two compile decorators, ``@formula`` and ``@kernel``.

``@formula`` marks plain Python code that compiled code may call. The function itself stays plain Python, so the same
source runs on floats, complex numbers, arrays over time and symbols. ``@kernel`` marks an entry point that is compiled
and cached on disk. Numba is imported when the first kernel is called, never before: describing and checking a
mechanism does not pay for a compiler.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import update_wrapper
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS = {"error_model": "numpy", "_nrt": False}  # how formulas and kernels are compiled
INSIDE: Any = {**OPTIONS, "no_cfunc_wrapper": True}  # what only compiled code calls
KERNELS: list[Any] = []
LOCK = threading.RLock()
_pending: list[Callable[[], None]] = []
_started = False


def on_numba(callback: Callable[[], None]) -> Callable[[], None]:
    """Run ``callback`` once when Numba is first needed (at once if it already is), before anything compiles."""
    if _started:
        callback()
    else:
        _pending.append(callback)
    return callback


def formula(function: F) -> F:
    """Let compiled code call ``function``; the function itself stays plain Python and can be run on any numbers."""

    def register() -> None:
        from numba.extending import register_jitable

        register_jitable(**INSIDE)(function)

    on_numba(register)
    return function


def kernel(function: F) -> F:
    """Make ``function`` a compiled entry point, cached on disk, that releases the interpreter lock."""
    made = Kernel(function)
    KERNELS.append(made)
    return made  # type: ignore[return-value]


class Kernel:
    """A compiled entry point. Compiles at the first call (or finds itself in the cache)."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function
        self._dispatcher: Callable[..., Any] | None = None
        update_wrapper(self, function)

    @property
    def dispatcher(self) -> Any:
        """Numba's dispatcher; made, not yet compiled, when first asked for."""
        if self._dispatcher is None:
            start_numba()
            from numba import config, njit

            made = njit(**OPTIONS, nogil=True, no_cfunc_wrapper=True)(self.function)
            if not config.DISABLE_JIT:
                from .cache import cache_of

                made._cache = cache_of(self.function)
                made._compile_for_args = self._compiling(made._compile_for_args)
            self._dispatcher = made
        return self._dispatcher

    def _compiling(self, compile_for: Callable[..., Any]) -> Callable[..., Any]:
        """Numba's compilation for new types of arguments, done our way, one at a time."""
        from .turns import in_turn
        from .ways import optimise_once

        def compile_once(*args: Any, **options: Any) -> Any:
            with LOCK, in_turn(self.dispatcher._cache), optimise_once(self.function.__qualname__):
                return compile_for(*args, **options)

        return compile_once

    def prepare(self, *args: Any) -> None:
        """Compile it for arguments of these types, or find it in the cache; it is not run."""
        from numba import typeof

        from .turns import in_turn
        from .ways import optimise_once

        dispatcher = self.dispatcher
        with LOCK, in_turn(dispatcher._cache), optimise_once(self.function.__qualname__):
            dispatcher.compile(tuple(typeof(x) for x in args))

    @property
    def used(self) -> bool:
        """Whether this process has asked for it."""
        return self._dispatcher is not None

    @property
    def from_cache(self) -> tuple[int, int]:
        """How often it was found in the cache, and how often compiled, in this process."""
        stats = self.dispatcher.stats
        return sum(stats.cache_hits.values()), sum(stats.cache_misses.values())

    @property
    def cold(self) -> bool:
        """Whether a call compiles first: nothing of this version is in memory or in the cache."""
        return not self.dispatcher.overloads and getattr(self.dispatcher._cache, "empty", False)

    def __call__(self, *args: Any) -> Any:
        """Run it, compiled."""
        return (self._dispatcher or self.dispatcher)(*args)


def start_numba() -> None:
    """Import Numba and register every formula defined so far."""
    global _started
    with LOCK:
        if _started:
            return
        import numba  # noqa: F401

        _started = True
        for callback in _pending:
            callback()
        _pending.clear()
