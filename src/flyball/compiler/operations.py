"""Operations of formulas in as few instructions as they take.

Formulas divide as C does and mostly count by ones, and members of a tuple whose number is only known while running are
there. So a loop over a range needs no division, a quotient no look at what it divides by, a member no ladder of
branches; the numbers are those of Numba's own code.
"""

from __future__ import annotations

import operator
from typing import Any

from .handed import room


def chosen(original: Any) -> Any:
    """``get_function``: the code of an operation on values of some types."""
    from numba.core import types

    def get_function(self: Any, fn: Any, sig: Any, **more: Any) -> Any:
        known = getattr(fn, "typing_key", fn)
        if known == "iternext" and sig.args[0] == types.range_iter64_type:
            return lambda builder, args, *_: _next(self, builder, sig, args[0])
        if known == "getiter" and sig.args[0] == types.range_state64_type:
            usual = original(self, fn, sig, **more)
            return lambda builder, args, *_: _begun(self, builder, sig, args[0], usual)
        if known is range and sig.return_type == types.range_state64_type:
            usual = original(self, fn, sig, **more)
            return lambda builder, args, *_: _range(self, builder, sig, args, usual)
        if known is operator.getitem and _has_members(types, sig):
            return lambda builder, args, *_: _member(self, builder, sig, args)
        made = _of_complex(self, types, known, sig)
        if made:
            return lambda builder, args, *_: struct(self, builder, sig.return_type, made(builder, args))
        return original(self, fn, sig, **more)

    return get_function


def _has_members(types: Any, sig: Any) -> bool:
    """Whether a tuple of members of one type is asked for one."""
    return isinstance(sig.args[0], types.UniTuple) and isinstance(sig.args[1], types.Integer) and len(sig.args[0]) > 0


def _member(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """A member of a tuple whose number is known while running, counted from the end where negative."""
    from numba.core import types

    k = context.cast(builder, args[1], sig.args[1], types.intp)
    if sig.args[1].signed:
        k = builder.select(builder.icmp_signed("<", k, k.type(0)), builder.add(k, k.type(len(sig.args[0]))), k)
    return builder.load(builder.gep(_placed(builder, args[0]), [k.type(0), k], inbounds=True))


def _placed(builder: Any, value: Any) -> Any:
    """Where a tuple is in memory: numbers once, else put there where it is made, not where it is read."""
    from llvmlite import ir
    from numba.core import cgutils

    if not hasattr(value, "placed"):
        members = getattr(value, "members", {})
        known = [members.get(k) for k in range(value.type.count)]
        if all(isinstance(x, ir.Constant) for x in known):
            value.placed = cgutils.global_constant(builder, "numbers", ir.Constant(value.type, known))
            return value.placed
        value.placed = room(builder, value.type)
        made_in = value.parent if isinstance(value, ir.Instruction) else builder.function.blocks[0]
        if made_in is builder.block:
            builder.store(value, value.placed)
        else:
            with builder.goto_block(made_in):
                builder.store(value, value.placed)
    return value.placed


SIMPLE = {
    operator.add: "fadd",
    operator.iadd: "fadd",
    operator.sub: "fsub",
    operator.isub: "fsub",
    operator.neg: "fneg",
}


def _of_complex(context: Any, types: Any, known: Any, sig: Any) -> Any:
    """What makes the two parts of an operation on complex numbers; None for another operation."""
    if not isinstance(sig.return_type, types.Complex) or any(x != sig.return_type for x in sig.args):
        return None
    if known in SIMPLE:
        return lambda builder, args: [
            getattr(builder, SIMPLE[known])(*x) for x in zip(*_parts(builder, args), strict=True)
        ]
    if known in (operator.mul, operator.imul):
        return _product
    if known in (operator.truediv, operator.itruediv) and not context.error_model.raise_on_fp_zero_division:
        return _quotient
    return None


def _parts(builder: Any, args: Any) -> list[Any]:
    """Real and imaginary parts of complex numbers."""
    return [[builder.extract_value(x, k) for k in range(2)] for x in args]


def _product(builder: Any, args: Any) -> Any:
    (a, b), (c, d) = _parts(builder, args)
    real = builder.fsub(builder.fmul(a, c), builder.fmul(b, d))
    return real, builder.fadd(builder.fmul(a, d), builder.fmul(b, c))


def _quotient(builder: Any, args: Any) -> Any:
    """As C and Python divide (Smith, 1962): by the larger part."""
    (a, b), (c, d) = _parts(builder, args)
    size = [builder.select(builder.fcmp_ordered("<", x, x.type(0.0)), builder.fneg(x), x) for x in (c, d)]
    real = builder.fcmp_ordered(">=", *size)

    def by(x: Any, y: Any) -> Any:
        return builder.select(real, x, y)

    large, small = by(c, d), by(d, c)
    ratio = builder.fdiv(small, large)
    whole = builder.fadd(large, builder.fmul(small, ratio))
    first = builder.fadd(by(a, b), builder.fmul(by(b, a), ratio))
    crossed = builder.fmul(by(a, b), ratio)
    second = builder.fsub(by(b, crossed), by(crossed, a))
    return builder.fdiv(first, whole), builder.fdiv(second, whole)


def widened(original: Any) -> Any:
    """``cast``: real numbers to complex ones."""
    from numba.core import types

    def cast(self: Any, builder: Any, val: Any, fromty: Any, toty: Any) -> Any:
        if not (isinstance(toty, types.Complex) and isinstance(fromty, types.Float)):
            return original(self, builder, val, fromty, toty)
        real = original(self, builder, val, fromty, toty.underlying_float)
        return struct(self, builder, toty, (real, real.type(0.0)))

    return cast


def struct(context: Any, builder: Any, of: Any, values: Any) -> Any:
    """A value of Numba's type ``of`` put together of its members."""
    from llvmlite import ir

    made = ir.Constant(context.get_value_type(of), ir.Undefined)
    for k, x in enumerate(values):
        made = builder.insert_value(made, x, k)
    return made


def _range(context: Any, builder: Any, sig: Any, args: Any, usual: Any) -> Any:
    """``range(stop)``, ``range(start, stop)``, ``range(start, stop, step)`` with a step that is known here."""
    number = args[0].type
    start, stop, step = (number(0), args[0], number(1)) if len(args) == 1 else (*args, number(1))[:3]
    by = getattr(step, "constant", None)
    if not isinstance(by, int) or by == 0:
        return usual(builder, args)
    made = struct(context, builder, sig.return_type, (start, stop, step))
    made.counted = start, stop, by  # for the loop that begins with it
    return made


def _begun(context: Any, builder: Any, sig: Any, state: Any, usual: Any) -> Any:
    """``iter(range)``: the place of the next number, stop, step, the place of how many are left."""
    counted = getattr(state, "counted", None)
    if counted is None:  # not known here
        return usual(builder, (state,))
    start, stop, by = counted
    at, left = room(builder, start.type), room(builder, start.type)
    count = builder.sub(stop, start) if by > 0 else builder.sub(start, stop)
    if abs(by) > 1:
        count = builder.sdiv(builder.add(count, start.type(abs(by) - 1)), start.type(abs(by)))
    builder.store(start, at)
    builder.store(count, left)
    return struct(context, builder, sig.return_type, (at, stop, start.type(by), left))


def _next(context: Any, builder: Any, sig: Any, iterator: Any) -> Any:
    """The next number, and whether there is one."""
    at, step, left = (builder.extract_value(iterator, k) for k in (0, 2, 3))
    count, value = builder.load(left), builder.load(at)
    more = builder.icmp_signed(">", count, count.type(0))
    builder.store(builder.sub(count, count.type(1), flags=["nsw"]), left)
    builder.store(builder.add(value, step), at)
    return struct(context, builder, sig.return_type, (value, more))


def _number(x: Any) -> int | None:
    """An integer that is known here."""
    known = getattr(x, "constant", None)
    return known if type(known) is int else None


COMPARED = {
    "<": operator.lt,
    "<=": operator.le,
    "==": operator.eq,
    "!=": operator.ne,
    ">=": operator.ge,
    ">": operator.gt,
}


def compared(original: Any) -> Any:
    """``icmp_signed``: of known numbers, as of an index that may count from the end."""
    from llvmlite.ir import IntType

    def icmp_signed(self: Any, cmpop: str, lhs: Any, rhs: Any, name: str = "") -> Any:
        a, b = _number(lhs), _number(rhs)
        if a is None or b is None or max(abs(a), abs(b)) >= 2 ** (lhs.type.width - 1):  # of which some are negative
            return original(self, cmpop, lhs, rhs, name)
        return IntType(1)(int(COMPARED[cmpop](a, b)))

    return icmp_signed


def selected(original: Any) -> Any:
    """``select``."""

    def select(self: Any, cond: Any, lhs: Any, rhs: Any, *args: Any, **more: Any) -> Any:
        known = _number(cond)
        return original(self, cond, lhs, rhs, *args, **more) if known is None else lhs if known else rhs

    return select


def added(original: Any) -> Any:
    """``add``."""

    def add(self: Any, lhs: Any, rhs: Any, *args: Any, **more: Any) -> Any:
        return rhs if _number(lhs) == 0 else lhs if _number(rhs) == 0 else original(self, lhs, rhs, *args, **more)

    return add


def multiplied(original: Any) -> Any:
    """``mul``."""

    def mul(self: Any, lhs: Any, rhs: Any, *args: Any, **more: Any) -> Any:
        if _number(lhs) in (0, 1):
            return lhs if _number(lhs) == 0 else rhs
        return rhs if _number(rhs) == 0 else lhs if _number(rhs) == 1 else original(self, lhs, rhs, *args, **more)

    return mul
