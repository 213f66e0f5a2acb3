"""Laws of time and measured quantities: expressions as bytecode, evaluated inside compiled loops.

A program is ``[count, depth, operation, operand, operation, operand, ...]`` in a shared list of integers, run on a
stack of numbers. Its constants are slots of one table, parameters first, so that a new value of a parameter is a new
number in the table and nothing is compiled again. There are two readers of the same program: `evaluate` gives the
value, `evaluate_jet` the value and its first two derivatives. Each carries the row of one derivative order
through the operations by the chain rule; what a function's value and slopes are is said once, in `value` and `slopes`.
"""

from __future__ import annotations

import math

from ..compiler.formulas import formula
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
from .call import called, note_missed
from .opcodes import (
    ABS,
    ACOS,
    ADD,
    ASIN,
    ATAN,
    ATAN2,
    BLEND,
    BY_MOTION,
    CALL,
    CONSTANT,
    COS,
    COSH,
    COUNT,
    CUBIC,
    DIVIDE,
    EXP,
    FREEZE,
    FUNCTION,
    INPUT,
    LESS,
    LOG,
    MAXIMUM,
    MINIMUM,
    MULTIPLY,
    NEGATE,
    NOT,
    POWER,
    QUINTIC,
    SENSOR,
    SIGN,
    SIN,
    SINH,
    SQRT,
    SUBTRACT,
    TABLE,
    TAN,
    TANH,
    WHERE,
    WHOLE_POWER,
)


@formula
def evaluate(code, const, at, stack, x, sensed):
    """Value of the law that starts at `at`; `stack` is scratch.

    The inputs x = (t, ...) are all of one type, and `sensed` holds the values of the sensors in its first row. A table
    without a value that leaves the law without one is noted in the stack.
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
        elif operation == CALL:
            stack[top, 0] = value(operand, stack[top, 0])
        elif operation == WHOLE_POWER:
            stack[top, 0] = integer_power(stack[top, 0], operand)
        elif operation == TABLE:
            place = stack[top, 0]
            stack[top, 0] = spline(const, operand, place)[0]
            if stack[top, 0] - stack[top, 0] != 0.0 and place - place == 0.0:
                missed, beyond = operand, place
        elif operation == FUNCTION:
            top += 1 - code[operand + COUNT]
            stack[top, 0] = called(code, operand, stack, top)
        elif operation == WHERE:
            top -= 2
            stack[top, 0] = choose(stack[top, 0] - 0.5, stack[top + 1, 0], stack[top + 2, 0])
        elif operation == BLEND:
            top -= 2
            stack[top, 0] = blend(stack[top, 0], stack[top + 1, 0], stack[top + 2, 0])
        elif operation >= ADD:
            top -= 1
            stack[top, 0] = combined(operation, stack[top, 0], stack[top + 1, 0])
    if missed >= 0 and stack[0, 0] - stack[0, 0] != 0.0:
        note_missed(stack, at, missed, beyond, x[0])
    return stack[0, 0]


@formula
def evaluate_jet(code, const, at, stack, t, sensed, seed):
    """Value, first and second derivative of a law of time and sensors; `stack` is scratch of 3 columns.

    The rows of `sensed` are the sensors' values and their first two time derivatives. `seed` says by what to derive:
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
            put(stack, top, const[operand], 0.0, 0.0)
        elif operation == INPUT:
            top += 1
            put(stack, top, t, 1.0 if seed < 0 else 0.0, 0.0)
        elif operation == SENSOR:
            top += 1
            if seed == BY_MOTION:
                put(stack, top, sensed[0, operand], sensed[1, operand], sensed[2, operand])
            else:
                put(stack, top, sensed[0, operand], 1.0 if seed == operand else 0.0, 0.0)
        elif operation == CALL or operation == WHOLE_POWER or operation == TABLE:
            v = stack[top, 0]
            if operation == TABLE:
                f, f1, f2 = spline(const, operand, v)
                if f - f != 0.0 and v - v == 0.0:
                    missed, beyond = operand, v
            elif operation == CALL:
                f = value(operand, v)
                f1, f2 = slopes(operand, v, f)
            else:
                f = integer_power(v, operand)
                f1, f2 = integer_power_slopes(v, operand)
            put_chain(stack, top, f, f1, f2)
        elif operation == WHERE:
            top -= 2
            yes = stack[top, 0] - 0.5
            for k in range(3):
                stack[top, k] = choose(yes, stack[top + 1, k], stack[top + 2, k])
        elif operation == BLEND:
            top -= 2
            way = stack[top, 0]
            for k in range(3):
                stack[top, k] = blend(way, stack[top + 1, k], stack[top + 2, k])
        elif operation == FREEZE:
            put(stack, top, stack[top, 0], 0.0, 0.0)
        elif operation == FUNCTION:  # its derivatives are not known
            top += 1 - code[operand + COUNT]
            put(stack, top, math.nan, math.nan, math.nan)
        else:
            top -= 1
            combine_jets(operation, stack, top)
    if missed >= 0 and stack[0, 0] - stack[0, 0] != 0.0:
        note_missed(stack, at, missed, beyond, t)
    return stack[0, 0], stack[0, 1], stack[0, 2]


@formula
def blend(way, a, b):
    """A on the one side of a corner (way 1), b on the other (-1); while sliding along it, what is between.

    Beyond them it goes on as between: the motion is to leave there, but the side that would hold it has to be found.
    """
    if way.real == 1.0:  # b may be no number there
        return a
    if way.real == -1.0:
        return b
    return b + 0.5 * (1.0 + way) * (a - b)


@formula
def put(stack, k, f, f1, f2):
    """Write one row of the stack."""
    stack[k, 0] = f
    stack[k, 1] = f1
    stack[k, 2] = f2


@formula
def put_chain(stack, k, f, f1, f2):
    """Write in row k, which holds an argument, a function of it with the value f and the slopes f1 and f2."""
    u1, u2 = stack[k, 1], stack[k, 2]
    put(stack, k, f, times(f1, u1), times(f2, u1 * u1) + times(f1, u2))


@formula
def times(slope, rate):
    """Slope times rate; an argument that rests has no effect, though the slope there may be infinite."""
    if rate == 0.0:
        return rate
    return slope * rate


@formula
def over(rate, size):
    """Rate over size; of arguments that rest 0, though the size may be 0."""
    if rate == 0.0:
        return rate
    return divide(rate, size)


@formula
def value(function, x):
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
def slopes(function, x, f):
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
    """First and second derivative of x ** b by x; a derivative that is zero everywhere is so at x = 0 too."""
    f1 = 0.0 * x
    f2 = 0.0 * x
    if b != 0.0:
        f1 = b * power(x, b - 1.0)
        if b != 1.0:
            f2 = b * (b - 1.0) * power(x, b - 2.0)
    return f1, f2


@formula
def integer_power_slopes(x, n):
    """First and second derivative of x ** n by x."""
    f1 = 0.0 * x
    f2 = 0.0 * x
    if n != 0:
        f1 = integer_power(x, n - 1) * n
        if n != 1:
            f2 = integer_power(x, n - 2) * (n * (n - 1))
    return f1, f2


@formula
def combined(operation, a, b):
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
    """Put the operation's value and derivatives, of rows k and k + 1, in row k."""
    a, a1, a2 = stack[k, 0], stack[k, 1], stack[k, 2]
    b, b1, b2 = stack[k + 1, 0], stack[k + 1, 1], stack[k + 1, 2]
    f = combined(operation, a, b)
    if operation == ADD:
        put(stack, k, f, a1 + b1, a2 + b2)
    elif operation == SUBTRACT:
        put(stack, k, f, a1 - b1, a2 - b2)
    elif operation == MULTIPLY:
        f1 = times(b, a1) + times(a, b1)
        put(stack, k, f, f1, times(b, a2) + 2.0 * times(a1, b1) + times(a, b2))
    elif operation == DIVIDE:
        f1 = divide(a1 - f * b1, b)
        put(stack, k, f, f1, divide(a2 - 2.0 * f1 * b1 - f * b2, b))
    elif operation == POWER:  # the exponent does not depend on time
        f1, f2 = power_slopes(a, b)
        put_chain(stack, k, f, f1, f2)
    elif operation == ATAN2:
        r = a * a + b * b
        f1 = over(b * a1 - a * b1, r)
        put(stack, k, f, f1, over(b * a2 - a * b2 - 2.0 * (a * a1 + b * b1) * f1, r))
    elif operation == MINIMUM or operation == MAXIMUM:
        second = a - b if operation == MINIMUM else b - a
        put(stack, k, f, choose(second, b1, a1), choose(second, b2, a2))
    else:
        put(stack, k, f, 0.0, 0.0)
