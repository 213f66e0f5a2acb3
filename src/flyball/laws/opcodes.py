"""Operations of the bytecode that laws are written in."""

from __future__ import annotations

CONSTANT, INPUT, SENSOR, CALL, WHOLE_POWER, TABLE, FUNCTION, WHERE, FREEZE, BLEND = range(10)
ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, ATAN2, MINIMUM, MAXIMUM, LESS, LESS_EQUAL = range(10, 20)
NEGATE, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, EXP, LOG, SQRT, ABS, SIGN, CUBIC, QUINTIC, NOT = range(18)

# what the operand of FUNCTION points to, in the code too
ADDRESS, INDEX, COUNT = range(3)
# values of ``seed`` of `evaluate_jet` besides the number of a sensor
BY_MOTION, BY_TIME = -1, -2
