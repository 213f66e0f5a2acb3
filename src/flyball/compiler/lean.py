"""Leaner code from Numba while a kernel of ours compiles: without what it writes out of caution only.

Formulas raise nothing, own no memory and count by ones. So a call of one that cannot fail needs no look at how it
ended, a variable no zeros before it is set and no look at what it was, a loop over a range no division; and what was
just put together need not be taken apart. The optimiser takes all this out again: it was two fifths of all code before
it, and the code that comes out is the same in kind. Like `link` this leans on internals of Numba and is used where they
are as expected (`ways.ours`).
"""

from __future__ import annotations

import operator
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from .patched import patched

_SOUND: set[str] = set()  # functions, by their names in LLVM, that were translated here and return no error
_FAILING: set[str] = set()  # those that may


@contextmanager
def leanly() -> Iterator[None]:
    """Have Numba write less.

    Raises
    ------
    AttributeError
        If Numba's internals are others.
    """
    from llvmlite.ir import IRBuilder
    from numba.core import base, callconv, cgutils, lowering

    with patched(
        [
            (callconv.CPUCallConv, "_return_errcode_raw", _noted),
            (lowering.BaseLower, "lower_normal_function", _remembered),
            (lowering.Lower, "storevar", _stored),
            (lowering.Lower, "alloca_lltype", _made_room),
            (cgutils, "alloca_once", _zeroed_once),
            (base, "user_function", _called),
            (base.BaseContext, "get_function", _counted),
            (base.BaseContext, "cast", _widened),
            (IRBuilder, "insert_value", _put_together),
            (IRBuilder, "extract_value", _taken_apart),
            (base.BaseContext, "pair_first", _first),
            (base.BaseContext, "pair_second", _second),
        ]
    ):
        yield


def _noted(original: Any) -> Any:
    """``_return_errcode_raw``: which functions may end in an error."""
    from numba.core import callconv

    fine = callconv.RETCODE_OK, callconv.RETCODE_NONE

    def end(self: Any, builder: Any, code: Any) -> None:
        if not any(code is x for x in fine):
            _FAILING.add(builder.function.name)
        original(self, builder, code)

    return end


def _remembered(original: Any) -> Any:
    """``lower_normal_function``: without what nobody asks for; which functions cannot end so."""

    def lower(self: Any, fndesc: Any) -> None:
        original(self, fndesc)
        _without_unused(self.function)
        if self.function.name not in _FAILING:
            _SOUND.add(self.function.name)

    return lower


PURE = frozenset(
    ("insertvalue", "extractvalue", "load", "getelementptr", "bitcast", "icmp", "add", "sub", "mul", "select", "alloca")
)


def _without_unused(function: Any) -> None:
    """Take out what is worked out and used by nothing."""
    uses: dict[int, int] = {}
    for block in function.blocks:
        for x in block.instructions:
            for y in (*x.operands, *(y for y, _ in getattr(x, "incomings", ()))):
                uses[id(y)] = uses.get(id(y), 0) + 1
    for block in reversed(function.blocks):
        kept = []
        for x in reversed(block.instructions):
            if x.opname in PURE and not uses.get(id(x)):
                for y in x.operands:
                    uses[id(y)] -= 1
            else:
                kept.append(x)
        block.instructions[:] = reversed(kept)


def _put_together(original: Any) -> Any:
    """``insert_value``: what a value was put together of is known to those who take it apart."""

    def insert_value(self: Any, agg: Any, value: Any, idx: Any, name: str = "") -> Any:
        made = original(self, agg, value, idx, name)
        if type(idx) is int:
            made.members = {**getattr(agg, "members", {}), idx: value}
        return made

    return insert_value


def _taken_apart(original: Any) -> Any:
    """``extract_value``."""

    def extract_value(self: Any, agg: Any, idx: Any, name: str = "") -> Any:
        if type(idx) is int:
            known = getattr(agg, "members", {}).get(idx)
            if known is not None:
                return known
        return original(self, agg, idx, name)

    return extract_value


def _called(original: Any) -> Any:
    """``user_function``: a call; how it ended is looked at where it may have failed."""
    from numba.core import types

    def user_function(fndesc: Any, libs: Any) -> Any:
        usual = original(fndesc, libs)

        def imp(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            function = context.declare_function(builder.module, fndesc)
            if function.name not in _SOUND or isinstance(fndesc.restype, types.Optional):
                return usual(context, builder, sig, args)
            packed = context.call_conv._get_arg_packer(fndesc.argtypes).as_arguments(builder, args)
            place, error = function.args[0].type, function.args[1].type
            found = _room(builder, place.pointee)
            builder.call(function, [found, error(None), *packed])
            return context.get_returned_value(builder, fndesc.restype, builder.load(found))

        imp.signature, imp.libs = usual.signature, usual.libs
        return imp

    return user_function


def _room(builder: Any, of: Any, name: str = "") -> Any:
    """Room on the stack, with nothing in it."""
    with builder.goto_entry_block():
        return builder.alloca(of, name=name)


def _zeroed_once(original: Any) -> Any:
    """``cgutils.alloca_once``: not with zeros twice."""

    def alloca_once(builder: Any, ty: Any, size: Any = None, name: str = "", zfill: bool = False) -> Any:
        if not zfill or size is not None:
            return original(builder, ty, size=size, name=name, zfill=zfill)
        place = _room(builder, ty, name)
        builder.store(ty(None), place)
        return place

    return alloca_once


def _made_room(original: Any) -> Any:
    """``alloca_lltype``: room for a variable; no zeros, where nobody counts who holds it."""

    def alloca_lltype(self: Any, name: str, lltype: Any, datamodel: Any = None) -> Any:
        if self.context.enable_nrt:
            return original(self, name, lltype, datamodel)
        return _room(self.builder, lltype, name)

    return alloca_lltype


def _stored(original: Any) -> Any:
    """``storevar``: what a variable was is not looked at, where nobody counts who holds it."""

    def storevar(self: Any, value: Any, name: str, argidx: Any = None) -> None:
        if self.context.enable_nrt or argidx is not None:
            original(self, value, name, argidx)
            return
        self._alloca_var(name, self.typeof(name))
        if name in self._singly_assigned_vars and not self._disable_sroa_like_opt:
            self._blk_local_varmap[name] = value
        else:
            self.builder.store(value, self.getvar(name))

    return storevar


def _counted(original: Any) -> Any:
    """``get_function``: ranges that count by ones."""
    from numba.core import types

    def get_function(self: Any, fn: Any, sig: Any, **more: Any) -> Any:
        if fn == "iternext" and sig.args[0] == types.range_iter64_type:
            return lambda builder, args, *_: _next(self, builder, sig, args[0])
        if fn == "getiter" and sig.args[0] == types.range_state64_type:
            usual = original(self, fn, sig, **more)
            return lambda builder, args, *_: _begun(self, builder, sig, args[0], usual)
        simple = SIMPLE.get(getattr(fn, "typing_key", None))
        if simple and isinstance(sig.return_type, types.Complex) and sig.return_type == sig.args[0] == sig.args[-1]:
            return lambda builder, args, *_: _of_both(self, builder, sig, args, simple)
        if sig.return_type == types.range_state64_type and len(sig.args) < 3 and _is_range(fn):
            return lambda builder, args, *_: _range(self, builder, sig, args)
        return original(self, fn, sig, **more)

    return get_function


SIMPLE = {
    operator.add: "fadd",
    operator.iadd: "fadd",
    operator.sub: "fsub",
    operator.isub: "fsub",
    operator.neg: "fneg",
}


def _of_both(context: Any, builder: Any, sig: Any, args: Any, name: str) -> Any:
    """Sum, difference, negative of complex numbers."""
    pairs = zip(*([builder.extract_value(x, k) for k in range(2)] for x in args), strict=True)
    return struct(context, builder, sig.return_type, [getattr(builder, name)(*x) for x in pairs])


def _widened(original: Any) -> Any:
    """``cast``: real numbers to complex ones."""
    from numba.core import types

    def cast(self: Any, builder: Any, val: Any, fromty: Any, toty: Any) -> Any:
        if not (isinstance(toty, types.Complex) and isinstance(fromty, types.Float)):
            return original(self, builder, val, fromty, toty)
        real = original(self, builder, val, fromty, toty.underlying_float)
        return struct(self, builder, toty, (real, real.type(0.0)))

    return cast


def _is_range(fn: Any) -> bool:
    return getattr(fn, "typing_key", None) is range


def struct(context: Any, builder: Any, of: Any, values: Any) -> Any:
    """A value of Numba's type ``of`` put together of its members."""
    from llvmlite import ir

    made = ir.Constant(context.get_value_type(of), ir.Undefined)
    for k, x in enumerate(values):
        made = builder.insert_value(made, x, k)
    return made


def _range(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """``range(stop)``, ``range(start, stop)``: start, stop, step."""
    number = args[0].type
    start, stop = args if len(args) == 2 else (number(0), args[0])
    made = struct(context, builder, sig.return_type, (start, stop, number(1)))
    made.by_ones = start, stop  # for the loop that begins with it
    return made


def _begun(context: Any, builder: Any, sig: Any, state: Any, usual: Any) -> Any:
    """``iter(range)``: the place of the next number, stop, step, the place of how many are left."""
    by_ones = getattr(state, "by_ones", None)
    if by_ones is None:  # not known here
        return usual(builder, (state,))
    start, stop = by_ones
    at, left = _room(builder, start.type), _room(builder, start.type)
    builder.store(start, at)
    builder.store(builder.sub(stop, start), left)
    return struct(context, builder, sig.return_type, (at, stop, start.type(1), left))


def _next(context: Any, builder: Any, sig: Any, iterator: Any) -> Any:
    """The next number, and whether there is one."""
    at, step, left = (builder.extract_value(iterator, k) for k in (0, 2, 3))
    count, value = builder.load(left), builder.load(at)
    more = builder.icmp_signed(">", count, count.type(0))
    with builder.if_then(more):
        builder.store(builder.sub(count, count.type(1), flags=["nsw"]), left)
        builder.store(builder.add(value, step), at)
    return struct(context, builder, sig.return_type, (value, more))


def _first(original: Any) -> Any:
    return lambda self, builder, val, ty: builder.extract_value(val, 0)


def _second(original: Any) -> Any:
    return lambda self, builder, val, ty: builder.extract_value(val, 1)
