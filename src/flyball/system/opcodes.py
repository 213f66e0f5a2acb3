"""Operations of the bytecode that laws are written in."""

from __future__ import annotations

CONSTANT, INPUT, CALL, WHOLE_POWER, WHERE, FREEZE, ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER = range(11)
ATAN2, MINIMUM, MAXIMUM, LESS, LESS_EQUAL = range(11, 16)
NEGATE, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, EXP, LOG, SQRT, ABS, SIGN, CUBIC, QUINTIC, NOT = range(18)
