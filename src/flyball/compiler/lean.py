"""Leaner code from Numba while a kernel of ours compiles: without what it writes out of caution only.

Hardly a formula can fail (`handed` knows which), and none owns memory. So a call of one that cannot needs no look at
how it ended, a variable no zeros before it is set and no look at what it was; and what was just put together need not
be taken apart. The optimiser takes all this out again: it was two fifths of all code before it, and the code that comes
out is the same in kind. Like `link` this leans on internals of Numba and is used where they
are as expected (`ways.ours`).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from .handed import called, declared, decoded, noted, parted, remembered, room
from .operations import added, chosen, compared, multiplied, selected, widened
from .patched import patched


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
            (callconv.CPUCallConv, "_return_errcode_raw", noted),
            (lowering.BaseLower, "lower_normal_function", _translated),
            (lowering.Lower, "storevar", _stored),
            (lowering.Lower, "alloca_lltype", _made_room),
            (lowering.Lower, "_find_singly_assigned_variable", _found),
            (cgutils, "alloca_once", _zeroed_once),
            (base, "user_function", called),
            (base.BaseContext, "declare_function", declared),
            (callconv.BaseCallConv, "decode_arguments", decoded),
            (base.BaseContext, "get_function", chosen),
            (base.BaseContext, "cast", widened),
            (IRBuilder, "insert_value", _put_together),
            (IRBuilder, "extract_value", _taken_apart),
            (IRBuilder, "icmp_signed", compared),
            (IRBuilder, "select", selected),
            (IRBuilder, "add", added),
            (IRBuilder, "mul", multiplied),
            (base.BaseContext, "pair_first", _first),
            (base.BaseContext, "pair_second", _second),
        ]
    ):
        yield


def _translated(original: Any) -> Any:
    """``lower_normal_function``: without what nobody asks for."""
    lower_known = remembered(original)

    def lower(self: Any, fndesc: Any) -> None:
        lower_known(self, fndesc)
        _without_unused(self.function)

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
    parted(function, uses)


def _put_together(original: Any) -> Any:
    """``insert_value``: what a value was put together of is known to those who take it apart."""

    def insert_value(self: Any, agg: Any, value: Any, idx: Any, name: str = "") -> Any:
        made = original(self, agg, value, idx, name)
        k = idx if type(idx) is int else idx[0] if len(idx) == 1 else None
        if k is not None:
            made.members = {**getattr(agg, "members", {}), k: value}
        return made

    return insert_value


def _taken_apart(original: Any) -> Any:
    """``extract_value``: of what is known, what it was put together of; else once in a block, of arguments once."""
    from llvmlite.ir.instructions import ExtractValue

    def extract_value(self: Any, agg: Any, idx: Any, name: str = "") -> Any:
        k = idx if type(idx) is int else idx[0] if len(idx) == 1 else None
        if k is None:
            return original(self, agg, idx, name)
        known = getattr(agg, "members", {}).get(k)
        if known is not None:
            return known
        taken = vars(agg).setdefault("taken", {})
        before = taken.get(k)
        from_argument = getattr(agg, "from_argument", False)
        if before is not None and (from_argument or before.parent is self.block):
            return before
        entry = self.function.blocks[0]
        if from_argument and entry.is_terminated:
            from_argument = False
        if from_argument and self.block is not entry:
            made = ExtractValue(entry, agg, [k], name=name)
            entry.instructions.append(made)
        else:
            made = original(self, agg, k, name)
        made.from_argument = from_argument
        taken[k] = made
        return made

    return extract_value


def _zeroed_once(original: Any) -> Any:
    """``cgutils.alloca_once``: not with zeros twice."""

    def alloca_once(builder: Any, ty: Any, size: Any = None, name: str = "", zfill: bool = False) -> Any:
        if not zfill or size is not None:
            return original(builder, ty, size=size, name=name, zfill=zfill)
        place = room(builder, ty, name)
        builder.store(ty(None), place)
        return place

    return alloca_once


def _found(original: Any) -> Any:
    """``_find_singly_assigned_variable``: what is set once, before all that asks for it, needs no place in memory."""
    from numba.core.analysis import compute_cfg_from_blocks

    def find(self: Any) -> None:
        if self.context.enable_nrt or self.func_ir.func_id.is_generator:
            original(self)
            return
        blocks = self.func_ir.blocks
        set_in, asked_in = _set_and_asked(blocks)
        once = {name: places[0] for name, places in set_in.items() if len(places) == 1}
        if any(asked_in.get(name) for name in once):
            dominators = compute_cfg_from_blocks(blocks).dominators()
            for name in [x for x in once if x in asked_in]:
                at = once[name]
                if not all(at < k and at in dominators.get(k, ()) for k in asked_in[name]):
                    del once[name]
        self._singly_assigned_vars, self._blk_local_varmap = set(once), {}

    return find


def _set_and_asked(blocks: Any) -> tuple[dict[str, list[int]], dict[str, set[int]]]:
    """In which blocks each variable is set, and in which it is asked for without having been set there before."""
    from numba.core.ir import Assign, Inst, Var

    set_in: dict[str, list[int]] = {}
    asked_in: dict[str, set[int]] = {}
    for k, block in blocks.items():
        here: set[str] = set()
        for x in block.body:
            value = x.value if isinstance(x, Assign) else x
            asked = [value] if isinstance(value, Var) else value.list_vars() if isinstance(value, Inst) else []
            for y in asked:
                if y.name not in here:
                    asked_in.setdefault(y.name, set()).add(k)
            if value is not x:
                set_in.setdefault(x.target.name, []).append(k)
                here.add(x.target.name)
    return set_in, asked_in


def _made_room(original: Any) -> Any:
    """``alloca_lltype``: room for a variable; no zeros, where nobody counts who holds it."""

    def alloca_lltype(self: Any, name: str, lltype: Any, datamodel: Any = None) -> Any:
        if self.context.enable_nrt:
            return original(self, name, lltype, datamodel)
        return room(self.builder, lltype, name)

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


def _first(original: Any) -> Any:
    return lambda self, builder, val, ty: builder.extract_value(val, 0)


def _second(original: Any) -> Any:
    return lambda self, builder, val, ty: builder.extract_value(val, 1)
