"""Calls from laws: Python functions, as machine code reached by its address; and the record of what went wrong.

Such a code reads its arguments from the first column of the stack, one a row, and writes its value into the second
column of the first of these rows, where nan stands before: whatever fails inside leaves nan. The addresses stand in
the bytecode, so that a new function compiles nothing. `native` makes the code.
"""

from __future__ import annotations

import math
from typing import Any
from weakref import WeakValueDictionary

from ..compiler.formulas import formula, when_compiling
from .opcodes import ADDRESS, COUNT, INDEX

STACK_RESERVE = 3
"""Last rows of the stack, kept for a fault: (index + 1, arguments given, value), then up to six arguments.

Of a table that has no value: (start of the law + 1, -1, place of the table in const), then (argument, time).
"""

NATIVE: WeakValueDictionary[int, Any] = WeakValueDictionary()
"""What stands at an address, as long as it does: the `native.Native`."""


def call(address, stack, row):
    """Run the code at an address on the stack from a row on; in plain Python the function itself, errors included.

    Of expressions an expression: what their ``called(function, *args)`` says.
    """
    native = NATIVE.get(int(address))
    if native is None:
        raise RuntimeError("a law calls a Python function that is no longer kept")
    args = [stack[row + k, 0] for k in range(native.count)]
    expression = next((x for x in args if hasattr(x, "called")), None)
    if expression is not None:
        stack[row, 1] = expression.called(native.python, *args)
    else:
        stack[row, 1] = native.python(*(x.item() if hasattr(x, "item") else x for x in args))


@formula
def called(code, at, stack, row):
    """Value of the function whose address and number stand at code[at], for the arguments from ``row`` on.

    A value that is not finite is recorded, unless an argument is not finite either: then the cause lies elsewhere.
    """
    stack[row, 1] = math.nan
    call(code[at + ADDRESS], stack, row)
    value = stack[row, 1]
    if value - value != 0.0:
        count = code[at + COUNT]
        doubt = 0.0 * stack[row, 0]
        for k in range(count):
            doubt += stack[row + k, 0] - stack[row + k, 0]
        if doubt == 0.0:
            last = stack.shape[0] - STACK_RESERVE
            stack[last, 0] = code[at + INDEX] + 1.0
            stack[last, 1] = count
            stack[last, 2] = value
            for k in range(count):
                stack[last + 1 + k // 3, k % 3] = stack[row + k, 0]
    return value


@formula
def note_missed(stack, law, table, x, t):
    """Record that a law asked a table for its value at x, where it has none."""
    last = stack.shape[0] - STACK_RESERVE
    stack[last, 0] = law + 1.0
    stack[last, 1] = -1.0
    stack[last, 2] = table
    stack[last + 1, 0] = x
    stack[last + 1, 1] = t


@when_compiling
def _register() -> None:
    """In compiled code: a jump to the address; complex numbers are not for such code, their value stays nan."""
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    from ..compiler.target import overload

    @intrinsic
    def jump(typing, address, stack, row):
        def generate(context, builder, signature, args):
            array = context.make_array(signature.args[1])(context, builder, args[1])
            start = builder.gep(array.data, [builder.mul(args[2], args[2].type(3))])
            code = ir.FunctionType(ir.VoidType(), [start.type])
            builder.call(builder.inttoptr(args[0], code.as_pointer()), [start])
            return context.get_dummy_value()

        return types.void(types.int64, getattr(stack, "array", stack), types.int64), generate  # the whole array

    @overload(call)
    def choose(address, stack, row):
        if isinstance(stack.dtype, types.Complex):
            return lambda address, stack, row: None
        return lambda address, stack, row: jump(address, stack, row)  # type: ignore[call-arg]
