"""A law's program as a list of steps, each with its arguments, and what each depends on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...math.spline import BREAKS, PIECE
from ..manner import LOW
from ..opcodes import (
    ABS,
    ACOS,
    ADD,
    ASIN,
    ATAN2,
    BLEND,
    CALL,
    CONSTANT,
    COS,
    COUNT,
    DIVIDE,
    FREEZE,
    FUNCTION,
    INPUT,
    LESS,
    LESS_EQUAL,
    LOG,
    MAXIMUM,
    MINIMUM,
    MULTIPLY,
    NEGATE,
    NOT,
    POWER,
    SENSOR,
    SIGN,
    SIN,
    SQRT,
    SUBTRACT,
    TABLE,
    TAN,
    WHERE,
    WHOLE_POWER,
)

NOTHING, TIME, STATE = range(3)  # what a step depends on
SEAM = 1e-9  # part of their size by which pieces of a table may differ where they meet


class Step(NamedTuple):
    """One operation: on which earlier steps, what it depends on, whether it is true or false rather than a number."""

    operation: int
    operand: int
    args: tuple[int, ...]
    on: int
    logical: bool = False


class Corner(NamedTuple):
    """Step ``at`` has a corner or jumps where step ``of`` reaches one of ``levels`` (repeated with ``period``).

    ``touched``: also where the argument only touches the level.
    """

    at: int
    of: int
    levels: np.ndarray
    period: float = 0.0
    touched: bool = False


def read(code: Sequence[int], at: int) -> list[Step]:
    """The steps of the law that starts at ``at``; comparisons have the difference that decides as a third argument."""
    out: list[Step] = []
    stack: list[int] = []
    for i in range(at + 2, at + 2 + 2 * int(code[at]), 2):
        operation, operand = int(code[i]), int(code[i + 1])
        if operation in (CONSTANT, INPUT, SENSOR):
            on = NOTHING if operation == CONSTANT else TIME if operation == INPUT and operand == 0 else STATE
            out.append(Step(operation, operand, (), on))
        else:
            count = int(code[operand + COUNT]) if operation == FUNCTION else _taken(operation)
            args = tuple(stack[len(stack) - count :])
            del stack[len(stack) - count :]
            out += _on(out, operation, operand, args)
        stack.append(len(out) - 1)
    return out


def _taken(operation: int) -> int:
    return 3 if operation in (WHERE, BLEND) else 2 if operation >= ADD else 1


def _on(before: list[Step], operation: int, operand: int, args: tuple[int, ...]) -> list[Step]:
    """A step, after the difference that decides where it compares."""
    on = STATE if operation == FUNCTION else max(before[k].on for k in args)
    logical = operation == CALL and operand == NOT
    if operation in (LESS, LESS_EQUAL, MINIMUM, MAXIMUM):
        logical = operation in (LESS, LESS_EQUAL) or before[args[0]].logical
        if operation in (LESS, LESS_EQUAL) or not logical:
            a, b = args if operation in (MINIMUM, MAXIMUM) else args[::-1]
            difference = Step(SUBTRACT, 0, (a, b), on)
            return [difference, Step(operation, operand, (*args, len(before)), on, logical)]
    return [Step(operation, operand, args, on, logical)]


def brief(step: Step, steps: Sequence[Step]) -> bool:
    """Whether a step can do much within a short time, or a short way: see ``manner.brief``."""
    if step.operation == CALL:
        return step.operand not in (SIN, COS, NEGATE)
    if step.operation == WHOLE_POWER:
        return not 0 <= step.operand <= LOW
    if step.operation == DIVIDE:
        return steps[step.args[1]].on != NOTHING
    return not (step.operation <= SENSOR or step.operation in (FREEZE, BLEND) or ADD <= step.operation <= MULTIPLY)


def needed(steps: Sequence[Step], targets: Sequence[int]) -> list[int]:
    """The steps that some steps are made from, these included, in order."""
    found = set(targets)
    for k in range(len(steps) - 1, -1, -1):
        if k in found:
            found.update(steps[k].args)
    return sorted(found)


def corners(steps: Sequence[Step], const: np.ndarray) -> list[Corner]:
    """Where steps of time alone may have corners or jump, or an end of their domain; inner ones first."""
    out = []
    zero = np.zeros(1)
    for k, s in enumerate(steps):
        if s.on != TIME:
            continue
        if s.operation == CALL and s.operand in (SIGN, ABS, LOG):
            out.append(Corner(k, s.args[0], zero))
        elif (s.operation == CALL and s.operand == SQRT) or s.operation == POWER:
            out.append(Corner(k, s.args[0], zero, touched=True))
        elif s.operation == CALL and s.operand in (ASIN, ACOS):
            out.append(Corner(k, s.args[0], np.array([-1.0, 1.0]), touched=True))
        elif s.operation == CALL and s.operand == TAN:
            out.append(Corner(k, s.args[0], np.array([0.5 * np.pi]), np.pi))
        elif s.operation in (DIVIDE, ATAN2) and steps[s.args[s.operation == DIVIDE]].on == TIME:
            out.append(Corner(k, s.args[s.operation == DIVIDE], zero))
        elif s.operation == WHOLE_POWER and s.operand < 0:
            out.append(Corner(k, s.args[0], zero))
        elif s.operation == TABLE and len(levels := bent(const, s.operand)):
            out.append(Corner(k, s.args[0], levels, float(const[s.operand])))
        elif len(s.args) == 3 and s.operation not in (WHERE, BLEND):
            out.append(Corner(k, s.args[2], zero))
    return out


def bent(const: np.ndarray, at: int) -> np.ndarray:
    """Breaks of a table at which its slope or its curvature jumps."""
    count = int(const[at + 1])
    x = np.asarray(const[at + BREAKS : at + BREAKS + count], float)
    first = at + BREAKS + count
    c = np.asarray(const[first : first + PIECE * (count + 1)], float).reshape(count + 1, PIECE)
    width = np.r_[0.0, np.diff(x)]  # what the piece before each break counts from its own origin
    before, after = c[:-1], c[1:]
    if const[at] > 0.0:  # the last break is the first again
        before, after, x = np.vstack([c[count - 1], c[1 : count - 1]]), c[1:count], x[:-1]
        width = np.r_[width[-1], width[1:-1]]
    w = np.maximum(width, np.r_[width[1:], width[-1]])
    slope = before[:, 1] + width * (2.0 * before[:, 2] + 3.0 * width * before[:, 3])
    curve = 2.0 * before[:, 2] + 6.0 * width * before[:, 3]
    size = sum((np.abs(before[:, k]) + np.abs(after[:, k])) * w**k for k in (1, 2, 3))
    gap = np.abs(after[:, 1] - slope) * w + np.abs(2.0 * after[:, 2] - curve) * w * w
    return x[~(gap <= SEAM * size)]
