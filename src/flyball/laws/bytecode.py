"""Bytecode of laws: its operations, and its evaluation inside compiled loops.

A program is ``[count, depth, operation, operand, operation, operand, ...]`` in a shared list of integers, evaluated on
a stack of numbers. Its constants are entries of one table, parameters first, so that a new value of a parameter is a
new number in the table and nothing is compiled again. `evaluate` gives the value, `evaluate_jet` the value and its
first two derivatives by the chain rule; values and derivatives of elementary functions are defined once, in
`function_value` and `function_slopes`.

Parts that occur more than once are computed once: they stay on the stack below the rest of the law, which copies them
(`COPY`); `KEEP` then puts the result in the place of the first of them.

A Python function is machine code called by its address, which is in the bytecode. Its arguments are in the first column
of the stack, one for each row. It writes its value into the second column of the first of these rows, which is nan
before the call. A failure inside leaves nan, and the record of the fault is at the end of the stack. `python_functions`
makes the code.
"""

from __future__ import annotations

import math
from typing import Any
from weakref import WeakValueDictionary

from ..compiler.formulas import formula, when_compiling
from ..math.scalar import (
    absolute,
    acos,
    asin,
    atan,
    atan2,
    choose,
    cos,
    cosh,
    cubic_rise,
    divide,
    exp,
    integer_power,
    log,
    maximum,
    minimum,
    power,
    quintic_rise,
    sign,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
)
from ..math.spline import spline

CONSTANT, INPUT, SENSOR, CALL, WHOLE_POWER, TABLE, FUNCTION, WHERE, FREEZE, BLEND, COPY, KEEP = range(12)
ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, ATAN2, MINIMUM, MAXIMUM, LESS, LESS_EQUAL = range(12, 22)
NEGATE, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, EXP, LOG, SQRT, ABS, SIGN, CUBIC, QUINTIC, NOT = range(18)

# meaning of the FUNCTION operand, and of the code that it points to
ADDRESS, INDEX, COUNT = range(3)
# values of ``seed`` of `evaluate_jet`, if not the number of a sensor
BY_MOTION, BY_TIME = -1, -2


STACK_RESERVE = 3
"""Last rows of the stack, for the record of a fault: (index + 1, number of arguments, value), then up to six arguments.

Of a table out of range: (start of the law + 1, -1, place of the table in const), then (argument, time).
"""

COMPILED_FUNCTIONS: WeakValueDictionary[int, Any] = WeakValueDictionary()
"""The `python_functions.CompiledFunction` at an address, as long as it exists."""


def call_address(address, stack, row):
    """Run the code at an address on the stack from a row on; in plain Python call the function itself, which may raise.

    With expressions, the result is that of their method ``called(function, *args)``.
    """
    native = COMPILED_FUNCTIONS.get(int(address))
    if native is None:
        raise RuntimeError("a law calls a Python function that is no longer kept")
    args = [stack[row + k, 0] for k in range(native.count)]
    expression = next((x for x in args if hasattr(x, "called")), None)
    if expression is not None:
        stack[row, 1] = expression.called(native.python, *args)
    else:
        stack[row, 1] = native.python(*(x.item() if hasattr(x, "item") else x for x in args))


@formula
def call_function(code, at, stack, row):
    """Value of the function whose address and number are at code[at], for the arguments from ``row`` on.

    A value that is not finite is recorded, unless an argument is not finite either: then the cause lies elsewhere.
    """
    stack[row, 1] = math.nan
    call_address(code[at + ADDRESS], stack, row)
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
def record_out_of_range(stack, law, table, x, t):
    """Record that a law evaluated a table at x, outside its range."""
    last = stack.shape[0] - STACK_RESERVE
    stack[last, 0] = law + 1.0
    stack[last, 1] = -1.0
    stack[last, 2] = table
    stack[last + 1, 0] = x
    stack[last + 1, 1] = t


@when_compiling
def _register() -> None:
    """Register the compiled call by address; complex numbers, which such code does not take, give nan."""
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    from ..compiler.numba_target import overload

    @intrinsic
    def jump(typing, address, stack, row):
        def generate(context, builder, signature, args):
            array = context.make_array(signature.args[1])(context, builder, args[1])
            start = builder.gep(array.data, [builder.mul(args[2], args[2].type(3))])
            code = ir.FunctionType(ir.VoidType(), [start.type])
            builder.call(builder.inttoptr(args[0], code.as_pointer()), [start])
            return context.get_dummy_value()

        return types.void(types.int64, getattr(stack, "array", stack), types.int64), generate  # the whole array

    @overload(call_address)
    def choose(address, stack, row):
        if isinstance(stack.dtype, types.Complex):
            return lambda address, stack, row: None
        return lambda address, stack, row: jump(address, stack, row)  # type: ignore[call-arg]


@formula
def evaluate(code, const, at, stack, x, sensed):
    """Value of the law that starts at `at`; `stack` is scratch.

    The inputs x = (t, ...) are all of one type, and `sensed` holds the values of the sensors in its first row. If a
    table evaluated out of range makes the value nan, that is recorded in the stack.
    """
    top = -1
    missed = -1
    beyond = 0.0 * x[0]
    for i in range(at + 2, at + 2 + 2 * code[at], 2):
        operation = code[i]
        operand = code[i + 1]
        if operation == CONSTANT:
            top += 1
            stack[top, 0] = const[operand]
        elif operation == INPUT:
            top += 1
            stack[top, 0] = x[operand]
        elif operation == SENSOR:
            top += 1
            stack[top, 0] = sensed[0, operand]
        elif operation == COPY:
            top += 1
            stack[top, 0] = stack[operand, 0]
        elif operation == KEEP:
            stack[top - operand, 0] = stack[top, 0]
            top -= operand
        elif operation == CALL:
            stack[top, 0] = function_value(operand, stack[top, 0])
        elif operation == WHOLE_POWER:
            stack[top, 0] = integer_power(stack[top, 0], operand)
        elif operation == TABLE:
            place = stack[top, 0]
            stack[top, 0] = spline(const, operand, place)[0]
            if stack[top, 0] - stack[top, 0] != 0.0 and place - place == 0.0:
                missed, beyond = operand, place
        elif operation == FUNCTION:
            top += 1 - code[operand + COUNT]
            stack[top, 0] = call_function(code, operand, stack, top)
        elif operation == WHERE:
            top -= 2
            stack[top, 0] = choose(stack[top, 0] - 0.5, stack[top + 1, 0], stack[top + 2, 0])
        elif operation == BLEND:
            top -= 2
            stack[top, 0] = blend_branches(stack[top, 0], stack[top + 1, 0], stack[top + 2, 0])
        elif operation >= ADD:
            top -= 1
            stack[top, 0] = combine_values(operation, stack[top, 0], stack[top + 1, 0])
    if missed >= 0 and stack[0, 0] - stack[0, 0] != 0.0:
        record_out_of_range(stack, at, missed, beyond, x[0])
    return stack[0, 0]


@formula
def evaluate_jet(code, const, at, stack, t, sensed, seed):
    """Value, first and second derivative of a law of time and sensors; `stack` is scratch of 3 columns.

    The rows of `sensed` are the sensors' values and their first two time derivatives. `seed` selects the variable:
    BY_MOTION, time with the sensors moving along; BY_TIME, time with the sensors held; k >= 0, the value of sensor k
    alone.
    """
    top = -1
    missed = -1
    beyond = 0.0 * t
    for i in range(at + 2, at + 2 + 2 * code[at], 2):
        operation = code[i]
        operand = code[i + 1]
        if operation == CONSTANT:
            top += 1
            store_row(stack, top, const[operand], 0.0, 0.0)
        elif operation == INPUT:
            top += 1
            store_row(stack, top, t, 1.0 if seed < 0 else 0.0, 0.0)
        elif operation == SENSOR:
            top += 1
            if seed == BY_MOTION:
                store_row(stack, top, sensed[0, operand], sensed[1, operand], sensed[2, operand])
            else:
                store_row(stack, top, sensed[0, operand], 1.0 if seed == operand else 0.0, 0.0)
        elif operation == COPY:
            top += 1
            store_row(stack, top, stack[operand, 0], stack[operand, 1], stack[operand, 2])
        elif operation == KEEP:
            store_row(stack, top - operand, stack[top, 0], stack[top, 1], stack[top, 2])
            top -= operand
        elif operation == CALL or operation == WHOLE_POWER or operation == TABLE:
            v = stack[top, 0]
            if operation == TABLE:
                f, f1, f2 = spline(const, operand, v)
                if f - f != 0.0 and v - v == 0.0:
                    missed, beyond = operand, v
            else:
                f, f1, f2 = function_jet(operation, operand, v)
            store_chain(stack, top, f, f1, f2)
        elif operation == WHERE or operation == BLEND:
            top -= 2
            select_jet(operation, stack, top)
        elif operation == FREEZE:
            store_row(stack, top, stack[top, 0], 0.0, 0.0)
        elif operation == FUNCTION:  # its derivatives are not known
            top += 1 - code[operand + COUNT]
            store_row(stack, top, math.nan, math.nan, math.nan)
        else:
            top -= 1
            combine_jets(operation, stack, top)
    if missed >= 0 and stack[0, 0] - stack[0, 0] != 0.0:
        record_out_of_range(stack, at, missed, beyond, t)
    return stack[0, 0], stack[0, 1], stack[0, 2]


@formula
def function_jet(operation, operand, v):
    """Value, first and second derivative of a function or of a whole power at v."""
    if operation == CALL:
        f = function_value(operand, v)
        f1, f2 = function_slopes(operand, v, f)
    else:
        f = integer_power(v, operand)
        f1, f2 = integer_power_slopes(v, operand)
    return f, f1, f2


@formula
def select_jet(operation, stack, top):
    """Replace the condition in row `top` by the branch that it selects, of the two in the next rows."""
    way = stack[top, 0]
    for k in range(3):
        if operation == WHERE:
            stack[top, k] = choose(way - 0.5, stack[top + 1, k], stack[top + 2, k])
        else:
            stack[top, k] = blend_branches(way, stack[top + 1, k], stack[top + 2, k])


@formula
def blend_branches(way, a, b):
    """Value a on one side of a corner (way 1), b on the other (-1); interpolated while sliding along it.

    Beyond 1 and -1 it is extrapolated: the motion then leaves the corner, but the side that would hold it must be
    found.
    """
    if way.real == 1.0:  # b may be nan there
        return a
    if way.real == -1.0:
        return b
    return b + 0.5 * (1.0 + way) * (a - b)


@formula
def store_row(stack, k, f, f1, f2):
    """Write one row of the stack."""
    stack[k, 0] = f
    stack[k, 1] = f1
    stack[k, 2] = f2


@formula
def store_chain(stack, k, f, f1, f2):
    """Write in row k, which holds an argument, a function of it with the value f and the slopes f1 and f2."""
    u1, u2 = stack[k, 1], stack[k, 2]
    store_row(stack, k, f, slope_product(f1, u1), slope_product(f2, u1 * u1) + slope_product(f1, u2))


@formula
def slope_product(slope, rate):
    """Slope times rate; 0 for zero rate, even if the slope is infinite."""
    if rate == 0.0:
        return rate
    return slope * rate


@formula
def safe_ratio(rate, size):
    """Rate over size; 0 for zero rate, even if the size is 0."""
    if rate == 0.0:
        return rate
    return divide(rate, size)


@formula
def function_value(function, x):
    """f(x) of a function of one argument."""
    if function == NEGATE:
        return -x
    if function == SIN:
        return sin(x)
    if function == COS:
        return cos(x)
    if function == TAN:
        return tan(x)
    if function == ASIN:
        return asin(x)
    if function == ACOS:
        return acos(x)
    if function == ATAN:
        return atan(x)
    if function == SINH:
        return sinh(x)
    if function == COSH:
        return cosh(x)
    if function == TANH:
        return tanh(x)
    if function == EXP:
        return exp(x)
    if function == LOG:
        return log(x)
    if function == SQRT:
        return sqrt(x)
    if function == ABS:
        return absolute(x)
    if function == SIGN:
        return sign(x)
    if function == CUBIC:
        return cubic_rise(x)
    if function == QUINTIC:
        return quintic_rise(x)
    return 1.0 - x


@formula
def function_slopes(function, x, f):
    """f'(x) and f''(x), given f = f(x). At a kink the slopes are those of the branch that gives the value."""
    if function == NEGATE or function == NOT:
        return -1.0, 0.0
    if function == SIN:
        return cos(x), -f
    if function == COS:
        return -sin(x), -f
    if function == TAN:
        return 1.0 + f * f, 2.0 * f * (1.0 + f * f)
    if function == ASIN or function == ACOS:
        d = divide(1.0 if function == ASIN else -1.0, sqrt((1.0 - x) * (1.0 + x)))
        return d, x * d * d * d
    if function == ATAN:
        d = divide(1.0, 1.0 + x * x)
        return d, -2.0 * x * d * d
    if function == SINH:
        return cosh(x), f
    if function == COSH:
        return sinh(x), f
    if function == TANH:
        return 1.0 - f * f, -2.0 * f * (1.0 - f * f)
    if function == EXP:
        return f, f
    if function == LOG:
        d = divide(1.0, x)
        return d, -d * d
    if function == SQRT:
        d = divide(0.5, f)
        return d, divide(-0.5 * d, x)
    if function == ABS:
        return choose(-x, -1.0, 1.0), 0.0
    if function == CUBIC:
        return 6.0 * x * (1.0 - x), 6.0 - 12.0 * x
    if function == QUINTIC:
        y = x * (1.0 - x)
        return 30.0 * y * y, 60.0 * y * (1.0 - 2.0 * x)
    return 0.0, 0.0


@formula
def power_slopes(x, b):
    """First and second derivative of x ** b with respect to x; one that is zero everywhere is 0 at x = 0 too."""
    f1 = 0.0 * x
    f2 = 0.0 * x
    if b != 0.0:
        f1 = b * power(x, b - 1.0)
        if b != 1.0:
            f2 = b * (b - 1.0) * power(x, b - 2.0)
    return f1, f2


@formula
def integer_power_slopes(x, n):
    """First and second derivative of x ** n with respect to x."""
    f1 = 0.0 * x
    f2 = 0.0 * x
    if n != 0:
        f1 = integer_power(x, n - 1) * n
        if n != 1:
            f2 = integer_power(x, n - 2) * (n * (n - 1))
    return f1, f2


@formula
def combine_values(operation, a, b):
    """Value of an operation on two arguments."""
    if operation == ADD:
        return a + b
    if operation == SUBTRACT:
        return a - b
    if operation == MULTIPLY:
        return a * b
    if operation == DIVIDE:
        return divide(a, b)
    if operation == POWER:
        return power(a, b)
    if operation == ATAN2:
        return atan2(a, b)
    if operation == MINIMUM:
        return minimum(a, b)
    if operation == MAXIMUM:
        return maximum(a, b)
    if operation == LESS:
        return choose(b - a, 1.0, 0.0)
    return 1.0 - choose(a - b, 1.0, 0.0)


@formula
def combine_jets(operation, stack, k):
    """Store the operation's value and derivatives, for arguments in rows k and k + 1, in row k."""
    a, a1, a2 = stack[k, 0], stack[k, 1], stack[k, 2]
    b, b1, b2 = stack[k + 1, 0], stack[k + 1, 1], stack[k + 1, 2]
    f = combine_values(operation, a, b)
    if operation == ADD:
        store_row(stack, k, f, a1 + b1, a2 + b2)
    elif operation == SUBTRACT:
        store_row(stack, k, f, a1 - b1, a2 - b2)
    elif operation == MULTIPLY:
        f1 = slope_product(b, a1) + slope_product(a, b1)
        store_row(stack, k, f, f1, slope_product(b, a2) + 2.0 * slope_product(a1, b1) + slope_product(a, b2))
    elif operation == DIVIDE:
        f1 = divide(a1 - f * b1, b)
        store_row(stack, k, f, f1, divide(a2 - 2.0 * f1 * b1 - f * b2, b))
    elif operation == POWER:  # the exponent does not depend on time
        f1, f2 = power_slopes(a, b)
        store_chain(stack, k, f, f1, f2)
    elif operation == ATAN2:
        r = a * a + b * b
        f1 = safe_ratio(b * a1 - a * b1, r)
        store_row(stack, k, f, f1, safe_ratio(b * a2 - a * b2 - 2.0 * (a * a1 + b * b1) * f1, r))
    elif operation == MINIMUM or operation == MAXIMUM:
        second = a - b if operation == MINIMUM else b - a
        store_row(stack, k, f, choose(second, b1, a1), choose(second, b2, a2))
    else:
        store_row(stack, k, f, 0.0, 0.0)


LOW_DEGREE = 8  # powers up to this do not act briefly


@formula
def is_entire(code, at):
    """Whether a law consists of functions of time that have derivatives of every order everywhere.

    Sums, products, quotients by constants, integer powers, sines and the like: it can neither jump nor have a kink.
    """
    for i in range(at + 2, at + 2 + 2 * code[at], 2):
        operation = code[i]
        operand = code[i + 1]
        if operation == CALL:
            smooth = operand == SIN or operand == COS or operand == NEGATE or operand == EXP or operand == TANH
            if not (smooth or operand == SINH or operand == COSH or operand == ATAN):
                return False
        elif operation == WHOLE_POWER:
            if operand < 0:
                return False
        elif operation == DIVIDE:
            if code[i - 2] != CONSTANT:
                return False
        elif not (operation <= INPUT or operation == FREEZE or COPY <= operation <= MULTIPLY):
            return False
    return True


@formula
def may_be_brief(code, at):
    """Whether a law can change much within a short time or distance.

    Sums, products, low powers, sines and cosines cannot: a step's error estimate shows their changes.
    """
    for i in range(at + 2, at + 2 + 2 * code[at], 2):
        operation = code[i]
        operand = code[i + 1]
        if operation == CALL:
            if not (operand == SIN or operand == COS or operand == NEGATE):
                return True
        elif operation == WHOLE_POWER:
            if not 0 <= operand <= LOW_DEGREE:
                return True
        elif operation == DIVIDE:
            if code[i - 2] != CONSTANT:
                return True
        elif not (operation <= SENSOR or FREEZE <= operation <= MULTIPLY):
            return True
    return False
