"""What may be expected of a law, from its program: whether it is smooth, whether it can act briefly."""

from __future__ import annotations

from ..compiler.formulas import formula
from .opcodes import (
    ADD,
    ATAN,
    CALL,
    CONSTANT,
    COS,
    COSH,
    DIVIDE,
    EXP,
    FREEZE,
    INPUT,
    MULTIPLY,
    NEGATE,
    SENSOR,
    SIN,
    SINH,
    TANH,
    WHOLE_POWER,
)

LOW = 8  # powers up to this are no pulses


@formula
def entire(code, at):
    """Whether a law is made of functions of time alone that have derivatives of every order everywhere.

    Sums, products, quotients by constants, whole powers, sines and the like: it can neither jump nor have a kink.
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
        elif not (operation <= INPUT or operation == FREEZE or ADD <= operation <= MULTIPLY):
            return False
    return True


@formula
def brief(code, at):
    """Whether a law can do much within a short time, or a short way.

    Sums, products, low powers, sines and cosines cannot: a change of theirs is one that the error of a step shows.
    """
    for i in range(at + 2, at + 2 + 2 * code[at], 2):
        operation = code[i]
        operand = code[i + 1]
        if operation == CALL:
            if not (operand == SIN or operand == COS or operand == NEGATE):
                return True
        elif operation == WHOLE_POWER:
            if not 0 <= operand <= LOW:
                return True
        elif operation == DIVIDE:
            if code[i - 2] != CONSTANT:
                return True
        elif not (operation <= SENSOR or FREEZE <= operation <= MULTIPLY):
            return True
    return False
