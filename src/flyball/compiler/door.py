"""A door: compiled code that any other compiled loop calls by its address, on tuples of arrays where they stand.

The right-hand side is nearly all of the compile time. A loop that contained it would compile for as long again; one
that goes through the door compiles in half a second, and an edit of the loop leaves what is behind the door in the
cache. The door has C's calling convention (Numba's `cfunc`, whose address is public) and takes addresses and integers
only, so that a call costs some nanoseconds.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

from .jit import INSIDE, KERNELS, LOCK, OPTIONS, on_numba, start_numba


class Door:
    """A function ``f(A, B, C, D, E, task) -> integer`` behind an address.

    ``A`` to ``E`` are tuples of arrays, handed over as ``held`` hands them. Compiled when its address is first asked
    for, for the types of the tuples given then, and no others.
    """

    def __init__(self, function: Callable[..., Any], stepped: bool = False) -> None:
        self.function = function
        self.stepped = stepped  # whether its complex numbers carry complex steps
        self._made: Any = None
        self._types: tuple[Any, ...] = ()
        self.__doc__, self.__qualname__ = function.__doc__, function.__qualname__
        KERNELS.append(self)

    def address(self, *tuples: Any) -> int:
        """Where it is; ``tuples`` are some of the kind that it will be called with."""
        if self._made is None:
            with LOCK:
                if self._made is None:
                    self._make(tuples)
        return self._made.address

    def prepare(self, *tuples: Any) -> None:
        """Compile it for tuples of these types, or find it in the cache."""
        self.address(*tuples)

    def expects(self, *tuples: Any) -> None:
        """Say what it is for before it is made: loops that may never go through compile without it."""
        with LOCK:
            if not self._types:
                start_numba()
                from numba import typeof

                from .held import held_type

                self._types = tuple(held_type(typeof(x)) for x in tuples)

    def _make(self, tuples: tuple[Any, ...]) -> None:
        start_numba()
        from numba import typeof, types
        from numba.core.ccallback import CFunc

        from .cache import cache_of
        from .held import held_type
        from .steps import products_of_first_order
        from .turns import in_turn
        from .ways import optimise_once, ours

        self._types = tuple(held_type(typeof(x)) for x in tuples)
        made = CFunc(self.function, ((*self._types, types.int64), types.int64), {}, dict(OPTIONS))
        made._cache = cache_of(self.function)
        steps = products_of_first_order() if self.stepped and ours() else nullcontext()
        with in_turn(made._cache), optimise_once(self.function.__qualname__), steps:
            made.compile()
        self._made = made

    @property
    def used(self) -> bool:
        """Whether this process has asked for it."""
        return self._made is not None

    @property
    def from_cache(self) -> tuple[int, int]:
        """How often it was found in the cache, and how often compiled, in this process."""
        hits = self._made.cache_hits if self._made is not None else 0
        return hits, int(self._made is not None) - hits

    @property
    def cold(self) -> bool:
        """Whether asking for its address compiles: nothing of this version is in memory or in the cache."""
        if self._made is not None:
            return False
        start_numba()
        from .cache import cache_of

        return cache_of(self.function).empty

    def fits(self, types: tuple[Any, ...]) -> bool:
        """Whether it was made for tuples of these types; a door never opened yet fits nothing."""
        return types == self._types


def door(function: Callable[..., Any]) -> Door:
    """Make ``function`` a `Door`."""
    return Door(function)


def stepped_door(function: Callable[..., Any]) -> Door:
    """Make ``function`` a `Door` for complex numbers that carry complex steps: see ``steps``."""
    return Door(function, stepped=True)


def enter(address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
    """Go through the door at ``address`` with five held tuples and a task; in compiled code only."""
    raise NotImplementedError("doors are for compiled code")


def ask(places, task):  # type: ignore[no-untyped-def]
    """Go through a door with tuples written down beforehand (``bound.Bound.asked``); in compiled code only.

    ``places`` are the door's address and those of its five tuples, of types that the caller need not know.
    """
    raise NotImplementedError("doors are for compiled code")


@on_numba
def _register() -> None:
    from llvmlite import ir
    from numba import types
    from numba.core.errors import TypingError
    from numba.extending import intrinsic, overload

    @intrinsic
    def leap(typing, address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            of = ir.FunctionType(ir.IntType(64), [ir.IntType(64)] * 6)
            return builder.call(builder.inttoptr(args[0], of.as_pointer()), list(args[1:]))

        return types.int64(*[types.int64] * 7), generate

    @overload(ask, jit_options=INSIDE)
    def call(places, task):  # type: ignore[no-untyped-def]
        return lambda places, task: leap(
            places[0], places[1], places[2], places[3], places[4], places[5], types.int64(task)
        )

    @intrinsic
    def jump(typing, address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
        given = (A, B, C, D, E)
        if not any(isinstance(k, Door) and k.fits(given) for k in KERNELS):
            raise TypingError(f"no door was made for {given}; tables are tuples of ordinary arrays of floats")

        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            of = ir.FunctionType(ir.IntType(64), [x.type for x in args[1:]])
            return builder.call(builder.inttoptr(args[0], of.as_pointer()), list(args[1:]))

        return types.int64(types.int64, *given, types.int64), generate

    @overload(enter, jit_options=INSIDE)
    def choose(address, A, B, C, D, E, task):  # type: ignore[no-untyped-def]
        return lambda address, A, B, C, D, E, task: jump(address, A, B, C, D, E, task)
