"""The two compile decorators, ``@formula`` and ``@kernel``, and the stamp that keeps compiled caches honest.

``@formula`` marks plain Python code that compiled code may call. The function itself stays plain Python, so the same
source runs on floats, complex numbers, arrays over time and symbols. ``@kernel`` marks an entry point that is compiled
and cached on disk. Numba is imported when the first kernel is called, never before: describing and checking a
mechanism does not pay for a compiler.

Numba's own cache looks at the file of the kernel only, and silently serves old code after an edit of a callee
elsewhere. Here every cache file carries a hash of all sources that compiled code is made of.
"""

from __future__ import annotations

import hashlib
import pathlib
import threading
from collections.abc import Callable
from functools import lru_cache, update_wrapper
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

PACKAGE = pathlib.Path(__file__).parent.parent
COMPILED = ("compiler", "constraints", "equations", "forces", "laws", "math", "numerics", "tables/system.py")
"""Files and folders that hold formulas and kernels, and all constants that these take from elsewhere."""
KERNELS: list[Kernel] = []
_pending: list[Callable[[], None]] = []
_started = False
LOCK = threading.RLock()


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

        register_jitable(error_model="numpy", _nrt=False, no_cfunc_wrapper=True)(function)

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

            made = njit(error_model="numpy", nogil=True, _nrt=False, no_cfunc_wrapper=True)(self.function)
            if not config.DISABLE_JIT:
                made._cache = _cache_class()(self.function)
                made._compile_for_args = self._compiling(made._compile_for_args)
            self._dispatcher = made
        return self._dispatcher

    def _compiling(self, compile_for: Callable[..., Any]) -> Callable[..., Any]:
        """Numba's compilation for new types of arguments, done our way, one at a time."""
        from .link import optimise_once

        def compile_once(*args: Any, **options: Any) -> Any:
            with LOCK, optimise_once(self.function.__qualname__):
                return compile_for(*args, **options)

        return compile_once

    @property
    def cold(self) -> bool:
        """Whether a call compiles first: nothing of this version is in memory or in the cache."""
        try:
            return not self.dispatcher.signatures and not self.dispatcher._cache._cache_file._load_index()
        except Exception:  # internals of Numba: where they differ, say nothing
            return False

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


def stamped() -> list[pathlib.Path]:
    """The source files of `COMPILED`."""
    files: set[pathlib.Path] = set()
    for pattern in COMPILED:
        for path in PACKAGE.glob(pattern):
            files |= set(path.rglob("*.py")) if path.is_dir() else {path}
    return sorted(files)


@lru_cache(maxsize=1)
def source_stamp() -> str:
    """Hash of every source file that compiled code is made of: what a cached kernel must agree with."""
    digest = hashlib.sha256()
    for path in stamped():
        digest.update(str(path.relative_to(PACKAGE)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


@lru_cache(maxsize=1)
def _cache_class() -> Any:
    """Numba's function cache with our stamp in place of a look at one file's date."""
    from numba.core import caching

    class Stamped:
        def get_source_stamp(self) -> str:
            return source_stamp()

    locators = [
        type(base.__name__, (Stamped, base), {})
        for base in (caching.UserProvidedCacheLocator, caching.InTreeCacheLocator, caching.UserWideCacheLocator)
    ]

    class Implementation(caching.CompileResultCacheImpl):
        _locator_classes = locators

    class Cache(caching.FunctionCache):
        _impl_class = Implementation

    return Cache
