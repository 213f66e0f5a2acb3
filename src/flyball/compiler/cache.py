"""Compiled code on disk: Numba's cache with our stamp, and with patience for damaged files."""

from __future__ import annotations

import contextlib
import pickle
import warnings
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar

from ..errors import PerformanceNotice
from .stamp import source_stamp
from .turns import Turn

_UNPICKLING = (pickle.UnpicklingError, EOFError, ImportError, AttributeError, LookupError, TypeError, ValueError)
DAMAGE = (*_UNPICKLING, RuntimeError)
"""What says that a file is damaged: all that unpickling makes of wrong bytes, and LLVM of wrong code."""


def cache_of(function: Any) -> Any:
    """The cache of one kernel; where Numba's internals are others, none: an outdated one would be served in silence."""
    try:
        return _cache_class()(function)
    except (AttributeError, TypeError) as error:
        from numba.core.caching import NullCache

        warnings.warn(
            f"compiled code cannot be kept with this version of Numba ({error}): every process compiles",
            PerformanceNotice,
            stacklevel=3,
        )
        return NullCache()


@lru_cache(maxsize=1)
def _cache_class() -> Any:
    from numba.core import caching

    class Stamped:
        """Says what the sources are, in place of Numba's look at one file's date."""

        @classmethod
        def from_function(cls, function: Any, file: str) -> Any:
            made = super().from_function(function, file)  # type: ignore[misc]
            if made is not None:
                made.file = Path(function.__code__.co_filename)
            return made

        def get_source_stamp(self) -> str:
            return source_stamp(self.file)  # type: ignore[attr-defined]

    bases = caching.CompileResultCacheImpl._locator_classes

    class Implementation(caching.CompileResultCacheImpl):
        _locator_classes: ClassVar = [type(base.__name__, (Stamped, base), {}) for base in bases]

    class Cache(caching.FunctionCache):
        _impl_class = Implementation

        def __init__(self, function: Any) -> None:
            super().__init__(function)
            self.turn = Turn(Path(f"{self._cache_file._index_path}.turn"))

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            """What is kept for these types, where another process is compiling it when it has ended; else None.

            With None this process compiles: in its turn, which `turns.in_turn` ends, or, after one that left nothing,
            beside all who waited for that. Numba would first import all that it can compile: what is compiled needs
            its runtime only.
            """
            from numba.core.runtime import rtsys

            rtsys.initialize(target_context)
            found = self._loaded(sig, target_context)
            if found is None and self.kept:
                waited = self.turn.take()
                found = self._loaded(sig, target_context)
                if waited and found is None:
                    self.turn.give()
            return found

        def _loaded(self, sig: Any, target_context: Any) -> Any:
            """What is there now; nothing where the files are damaged, which are then written anew."""
            try:
                return self._load_overload(sig, target_context)
            except DAMAGE:
                with contextlib.suppress(OSError):
                    self.flush()
            except OSError:  # says nothing of what is in the files: others may read them
                pass
            return None

        def save_overload(self, sig: Any, data: Any) -> None:
            """Keep what was compiled, where it can be kept."""
            try:
                super().save_overload(sig, data)
            except OSError as error:
                warnings.warn(f"compiled code cannot be kept: {error}", PerformanceNotice, stacklevel=2)

        @property
        def kept(self) -> bool:
            """Whether what is compiled can be written to where other processes look for it."""
            return self.folder is not None

        @property
        def folder(self) -> Path | None:
            """Where it is kept; None if it cannot be written there."""
            try:
                self._impl.locator.ensure_cache_path()
            except OSError:
                return None
            return Path(self._impl.locator.get_cache_path())

        @property
        def empty(self) -> bool:
            """Whether nothing of this version is kept."""
            try:
                return not self._cache_file._load_index()
            except (OSError, *DAMAGE):
                return True

    return Cache
