"""Evaluation of a law's program at many times at once, and over intervals of time: ranges of values and slopes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ..math.scalar import choose, integer_power
from ..math.spline import BREAKS, PIECE, spline
from . import bytecode
from .bytecode import blend_branches, combine_values, function_slopes, function_value, power_slopes
from .interval_arithmetic import (
    Range,
    TableRanges,
    atan2_ranges,
    function_ranges,
    integer_power_range,
    range_difference,
    range_hull,
    range_product,
    range_reciprocal,
    range_sum,
    real_power_ranges,
)

CONSTANT_IN_TIME, TIME_ONLY, STATE_DEPENDENT = range(3)  # what a step depends on
SLOPE_JUMP_TOLERANCE = 1e-9  # relative to their size: accepted difference of a table's pieces where they meet


class Step(NamedTuple):
    """One operation: the earlier steps it uses, what it depends on, whether it is a truth value."""

    operation: int
    operand: int
    args: tuple[int, ...]
    on: int
    logical: bool = False


class CornerLevels(NamedTuple):
    """Corner: step ``at`` has a corner or jumps where step ``of`` reaches one of ``levels`` (repeated with ``period``).

    ``touched``: also where the argument only touches the level.
    """

    at: int
    of: int
    levels: np.ndarray
    period: float = 0.0
    touched: bool = False


def read_steps(code: Sequence[int] | np.ndarray, at: int) -> list[Step]:
    """Steps of the law that starts at ``at``; comparisons have the deciding difference as a third argument.

    A step that occurs several times is one: corners of a law are not searched twice.
    """
    out: list[Step] = []
    stack: list[int] = []
    known: dict[Step, int] = {}

    def place(step: Step) -> int:
        if step not in known:
            known[step] = len(out)
            out.append(step)
        return known[step]

    for i in range(at + 2, at + 2 + 2 * int(code[at]), 2):
        operation, operand = int(code[i]), int(code[i + 1])
        if operation == bytecode.COPY:
            stack.append(stack[operand])
            continue
        if operation == bytecode.KEEP:
            del stack[len(stack) - 1 - operand : len(stack) - 1]
            continue
        if operation in (bytecode.CONSTANT, bytecode.INPUT, bytecode.SENSOR):
            on = (
                CONSTANT_IN_TIME
                if operation == bytecode.CONSTANT
                else TIME_ONLY
                if operation == bytecode.INPUT and operand == 0
                else STATE_DEPENDENT
            )
            stack.append(place(Step(operation, operand, (), on)))
        else:
            count = int(code[operand + bytecode.COUNT]) if operation == bytecode.FUNCTION else _operand_count(operation)
            args = tuple(stack[len(stack) - count :])
            del stack[len(stack) - count :]
            *difference, on_arguments = _on(out, operation, operand, args)
            for step in difference:
                on_arguments = on_arguments._replace(args=(*args, place(step)))
            stack.append(place(on_arguments))
    # the last step is the law's value
    return out if not stack or stack[-1] == len(out) - 1 else [*out, out[stack[-1]]]


def _operand_count(operation: int) -> int:
    return 3 if operation in (bytecode.WHERE, bytecode.BLEND) else 2 if operation >= bytecode.ADD else 1


def _on(before: list[Step], operation: int, operand: int, args: tuple[int, ...]) -> list[Step]:
    """A step; before a comparison, a step for the deciding difference is added."""
    on = STATE_DEPENDENT if operation == bytecode.FUNCTION else max(before[k].on for k in args)
    logical = operation == bytecode.CALL and operand == bytecode.NOT
    if operation in (bytecode.LESS, bytecode.LESS_EQUAL, bytecode.MINIMUM, bytecode.MAXIMUM):
        logical = operation in (bytecode.LESS, bytecode.LESS_EQUAL) or before[args[0]].logical
        if operation in (bytecode.LESS, bytecode.LESS_EQUAL) or not logical:
            a, b = args if operation in (bytecode.MINIMUM, bytecode.MAXIMUM) else args[::-1]
            difference = Step(bytecode.SUBTRACT, 0, (a, b), on)
            return [difference, Step(operation, operand, (*args, len(before)), on, logical)]
    return [Step(operation, operand, args, on, logical)]


def takes_arrays(code: np.ndarray, at: int) -> bool:
    """Whether the law that starts at ``at`` can be evaluated on arrays: it calls no Python function."""
    return not (_operations(code, at) == bytecode.FUNCTION).any()


def evaluate_over_time(
    steps: list[Step], const: np.ndarray, x: tuple[np.ndarray, ...], sensed: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Values of a law at many times, (n,).

    Parameters
    ----------
    steps : list of Step
    const : ndarray
        Of the tables; constants may be arrays over time, (n,).
    x : tuple of ndarray (n,)
        Time and the other inputs of the law.
    sensed : pair of ndarray (slots, n)
        Values of sensors; and the sides of corners: where the law has corners, times on the same sides are
        evaluated together.
    """
    out = np.empty(x[0].shape)
    values, sides = sensed
    corners = any(s.operation == bytecode.BLEND for s in steps)
    for some in _equal_branches(sides, len(out)) if corners else (slice(None),):
        row = [*values[:, some], *(sides[:, some][:, 0] if corners else sides)]
        with np.errstate(all="ignore"):
            out[some] = _values_of_steps(steps, _part(const, some), [a[some] for a in x], row)
    return out


def _values_of_steps(steps: list[Step], const: np.ndarray, x: Sequence[Any], sensed: Sequence[Any]) -> Any:
    """Value of the last step, for inputs and sensors that are arrays."""
    v: list[Any] = []
    for operation, operand, args, *_ in steps:
        a = [v[k] for k in args]
        if operation == bytecode.CONSTANT:
            v.append(const[operand])
        elif operation == bytecode.INPUT:
            v.append(x[operand])
        elif operation == bytecode.SENSOR:
            v.append(sensed[operand])
        elif operation == bytecode.CALL:
            v.append(function_value(operand, a[0]))
        elif operation == bytecode.WHOLE_POWER:
            v.append(integer_power(a[0], operand))
        elif operation == bytecode.TABLE:
            v.append(spline(const, operand, a[0])[0])
        elif operation == bytecode.WHERE:
            v.append(choose(a[0] - 0.5, a[1], a[2]))
        elif operation == bytecode.BLEND:
            v.append(blend_branches(*a))
        else:
            v.append(a[0] if operation == bytecode.FREEZE else combine_values(operation, a[0], a[1]))
    return v[-1]


def _operations(code: np.ndarray, at: int) -> np.ndarray:
    return code[at + 2 : at + 2 + 2 * code[at] : 2]


def _equal_branches(side_values: np.ndarray, n: int) -> Iterator[np.ndarray]:
    """Groups of times at which all sides are the same."""
    _, which = np.unique(side_values, axis=1, return_inverse=True) if len(side_values) else (None, np.zeros(n, int))
    for k in range(int(which.max(initial=-1)) + 1):
        yield np.flatnonzero(which == k)


def _part(const: np.ndarray, some: slice | np.ndarray) -> np.ndarray:
    """Constants at some of the times."""
    if const.dtype != object or isinstance(some, slice):
        return const
    out = const.copy()
    for k, a in enumerate(const):
        out[k] = a[some] if isinstance(a, np.ndarray) else a
    return out


def step_may_be_brief(step: Step, steps: Sequence[Step]) -> bool:
    """Whether a step can change much within a short time or distance: see `bytecode.may_be_brief`."""
    if step.operation == bytecode.CALL:
        return step.operand not in (bytecode.SIN, bytecode.COS, bytecode.NEGATE)
    if step.operation == bytecode.WHOLE_POWER:
        return not 0 <= step.operand <= bytecode.LOW_DEGREE
    if step.operation == bytecode.DIVIDE:
        return steps[step.args[1]].on != CONSTANT_IN_TIME
    return not (
        step.operation <= bytecode.SENSOR
        or step.operation in (bytecode.FREEZE, bytecode.BLEND)
        or bytecode.ADD <= step.operation <= bytecode.MULTIPLY
    )


def required_steps(steps: Sequence[Step], targets: Sequence[int]) -> list[int]:
    """Steps that the targets depend on, including these, in order."""
    found = set(targets)
    for k in range(len(steps) - 1, -1, -1):
        if k in found:
            found.update(steps[k].args)
    return sorted(found)


def find_corners(steps: Sequence[Step], const: np.ndarray) -> list[CornerLevels]:
    """Find where steps of time alone may have corners, jumps, or ends of their domain; inner ones first."""
    out = []
    zero = np.zeros(1)
    for k, s in enumerate(steps):
        if s.on != TIME_ONLY:
            continue
        if s.operation == bytecode.CALL and s.operand in (bytecode.SIGN, bytecode.ABS, bytecode.LOG):
            out.append(CornerLevels(k, s.args[0], zero))
        elif (s.operation == bytecode.CALL and s.operand == bytecode.SQRT) or s.operation == bytecode.POWER:
            out.append(CornerLevels(k, s.args[0], zero, touched=True))
        elif s.operation == bytecode.CALL and s.operand in (bytecode.ASIN, bytecode.ACOS):
            out.append(CornerLevels(k, s.args[0], np.array([-1.0, 1.0]), touched=True))
        elif s.operation == bytecode.CALL and s.operand == bytecode.TAN:
            out.append(CornerLevels(k, s.args[0], np.array([0.5 * np.pi]), np.pi))
        elif (
            s.operation in (bytecode.DIVIDE, bytecode.ATAN2)
            and steps[s.args[s.operation == bytecode.DIVIDE]].on == TIME_ONLY
        ):
            out.append(CornerLevels(k, s.args[s.operation == bytecode.DIVIDE], zero))
        elif s.operation == bytecode.WHOLE_POWER and s.operand < 0:
            out.append(CornerLevels(k, s.args[0], zero))
        elif s.operation == bytecode.TABLE and len(levels := table_corners(const, s.operand)):
            out.append(CornerLevels(k, s.args[0], levels, float(const[s.operand])))
        elif len(s.args) == 3 and s.operation not in (bytecode.WHERE, bytecode.BLEND):
            out.append(CornerLevels(k, s.args[2], zero))
    return out


def table_corners(const: np.ndarray, at: int) -> np.ndarray:
    """Breaks of a table at which its slope or its curvature jumps."""
    count = int(const[at + 1])
    x = np.asarray(const[at + BREAKS : at + BREAKS + count], float)
    first = at + BREAKS + count
    c = np.asarray(const[first : first + PIECE * (count + 1)], float).reshape(count + 1, PIECE)
    width = np.r_[0.0, np.diff(x)]  # each break relative to the origin of the piece before it
    before, after = c[:-1], c[1:]
    if const[at] > 0.0:  # periodic: the last break equals the first
        before, after, x = np.vstack([c[count - 1], c[1 : count - 1]]), c[1:count], x[:-1]
        width = np.r_[width[-1], width[1:-1]]
    w = np.maximum(width, np.r_[width[1:], width[-1]])
    slope = before[:, 1] + width * (2.0 * before[:, 2] + 3.0 * width * before[:, 3])
    curve = 2.0 * before[:, 2] + 6.0 * width * before[:, 3]
    size = sum((np.abs(before[:, k]) + np.abs(after[:, k])) * w**k for k in (1, 2, 3))
    gap = np.abs(after[:, 1] - slope) * w + np.abs(2.0 * after[:, 2] - curve) * w * w
    return x[~(gap <= SLOPE_JUMP_TOLERANCE * size)]


JetRange = tuple[Range, Range]
ZERO_RANGE: Range = (0.0, 0.0)
Signs = Mapping[int, Any]
NO_SIGNS: Signs = MappingProxyType({})


class IntervalLaw:
    """Steps of a law, with its constants and tables."""

    def __init__(self, steps: Sequence[Step], const: np.ndarray) -> None:
        self.steps, self.const = steps, np.asarray(const, float)
        self.curves = {s.operand: TableRanges(self.const, s.operand) for s in steps if s.operation == bytecode.TABLE}
        self.fixed: dict[int, float] = {}  # values of constant steps
        for k, s in enumerate(steps):
            if s.on == CONSTANT_IN_TIME:
                self.fixed[k] = float(self._point(s, self.fixed, np.zeros(1)))

    def points(
        self, requested: Sequence[int], t: np.ndarray, signs: Signs = NO_SIGNS
    ) -> tuple[dict[int, Any], dict[int, Any]]:
        """Values and slopes of steps at times; ``signs`` as in `enclose`, for times at which a step jumps."""
        v: dict[int, Any] = {}
        d: dict[int, Any] = {}
        for k in requested:
            s = self.steps[k]
            if s.on == CONSTANT_IN_TIME:
                v[k], d[k] = self.fixed[k], 0.0
            else:
                v[k] = _on_side(s, [v[n] for n in s.args], signs[k]) if k in signs else None
                v[k] = self._point(s, v, t) if v[k] is None else v[k]
                d[k] = self._slope(s, v, d, v[k])
        return v, d

    def _point(self, s: Step, v: Mapping[int, Any], t: np.ndarray) -> Any:
        a = [v[k] for k in s.args]
        if s.operation == bytecode.CONSTANT:
            return self.const[s.operand]
        if s.operation == bytecode.INPUT:
            return t
        if s.operation == bytecode.CALL:
            return function_value(s.operand, a[0])
        if s.operation == bytecode.WHOLE_POWER:
            return integer_power(a[0], s.operand)
        if s.operation == bytecode.TABLE:
            return spline(self.const, s.operand, a[0])[0]
        if s.operation == bytecode.WHERE:
            return np.where(np.asarray(a[0]) > 0.5, a[1], a[2])
        return a[0] if s.operation == bytecode.FREEZE else np.asarray(combine_values(s.operation, a[0], a[1]))

    def _slope(self, s: Step, v: Mapping[int, Any], d: Mapping[int, Any], f: Any) -> Any:
        a, b = [v[k] for k in s.args], [d[k] for k in s.args]
        o = s.operation
        if o == bytecode.INPUT:
            return 1.0
        if o == bytecode.CALL:
            return function_slopes(s.operand, a[0], f)[0] * b[0]
        if o == bytecode.WHOLE_POWER:
            return power_slopes(a[0], s.operand)[0] * b[0]
        if o == bytecode.TABLE:
            return spline(self.const, s.operand, a[0])[1] * b[0]
        if o == bytecode.WHERE:
            return np.where(np.asarray(a[0]) > 0.5, b[1], b[2])
        if o in (bytecode.ADD, bytecode.SUBTRACT):
            return b[0] + b[1] if o == bytecode.ADD else b[0] - b[1]
        if o == bytecode.MULTIPLY:
            return b[0] * a[1] + a[0] * b[1]
        if o == bytecode.DIVIDE:
            return (b[0] - f * b[1]) / a[1]
        if o == bytecode.POWER:
            return power_slopes(a[0], a[1])[0] * b[0]
        if o == bytecode.ATAN2:
            return (a[1] * b[0] - a[0] * b[1]) / (a[0] * a[0] + a[1] * a[1])
        if o in (bytecode.MINIMUM, bytecode.MAXIMUM) and len(a) == 3:
            return np.where(np.asarray(a[2]) > 0.0, b[o == bytecode.MINIMUM], b[o == bytecode.MAXIMUM])
        return b[0] if o == bytecode.FREEZE else 0.0

    def enclose(self, requested: Sequence[int], t: Range, signs: Signs) -> dict[int, JetRange]:
        """Ranges of steps and of their slopes over intervals of time.

        ``signs`` are the signs, in each interval, that decide at a step with a corner.
        """
        out: dict[int, JetRange] = {}
        for k in requested:
            s = self.steps[k]
            if s.on == CONSTANT_IN_TIME:
                out[k] = (self.fixed[k], self.fixed[k]), ZERO_RANGE
            elif s.operation == bytecode.INPUT:
                out[k] = t, (1.0, 1.0)
            else:
                out[k] = self._range(s, [out[n] for n in s.args], signs.get(k))
        return out

    def _range(self, s: Step, a: list[JetRange], sign: Any) -> JetRange:
        o = s.operation
        f, d = a[0]
        if o == bytecode.FREEZE:
            return f, d
        if o == bytecode.TABLE:
            g, slope = self.curves[s.operand].ranges(f)
            return g, range_product(slope, d)
        if o == bytecode.WHOLE_POWER:
            n = s.operand
            slope = range_product((float(n), float(n)), integer_power_range(f, n - 1)) if n != 0 else ZERO_RANGE
            return integer_power_range(f, n), range_product(slope, d)
        if o == bytecode.CALL:
            return _function_on_side(s.operand, f, d, sign)
        if o == bytecode.WHERE:
            yes, no = f[0] > 0.5, f[1] < 0.5
            return _condition_range(yes, no, a[1][0], a[2][0]), _condition_range(yes, no, a[1][1], a[2][1])
        if o in (bytecode.LESS, bytecode.LESS_EQUAL):
            return ((0.0, 1.0) if sign is None else (np.where(sign > 0, 1.0, 0.0),) * 2), ZERO_RANGE
        if o in (bytecode.MINIMUM, bytecode.MAXIMUM):
            return _extreme(o, a, sign)
        return _arithmetic(o, a, sign)


def _on_side(s: Step, a: list[Any], sign: Any) -> Any:
    """Value of a step with a corner, on the side given by a sign; None where that makes no difference."""
    if s.operation == bytecode.CALL and s.operand in (bytecode.ABS, bytecode.SIGN):
        return sign * a[0] if s.operand == bytecode.ABS else sign
    if s.operation in (bytecode.LESS, bytecode.LESS_EQUAL):
        return np.where(sign > 0, 1.0, 0.0)
    if s.operation in (bytecode.MINIMUM, bytecode.MAXIMUM):
        return np.where((sign > 0) == (s.operation == bytecode.MAXIMUM), a[0], a[1])
    if s.operation == bytecode.ATAN2:
        return np.arctan2(np.where(a[0] * sign <= 0.0, np.copysign(0.0, sign), a[0]), a[1])
    return None


def _condition_range(yes: Any, no: Any, a: Range, b: Range) -> Range:
    """Range a, b, or their union."""
    lo, hi = np.minimum(a[0], b[0]), np.maximum(a[1], b[1])
    return np.where(yes, a[0], np.where(no, b[0], lo)), np.where(yes, a[1], np.where(no, b[1], hi))


def _function_on_side(number: int, f: Range, d: Range, sign: Any) -> JetRange:
    if number in (bytecode.ABS, bytecode.SIGN) and sign is not None:
        s = (sign, sign)
        if number == bytecode.SIGN:
            return s, ZERO_RANGE
        lo, hi = range_product(s, f)
        return (np.maximum(lo, 0.0), hi), range_product(s, d)
    if number == bytecode.NOT:
        return (1.0 - f[1], 1.0 - f[0]), ZERO_RANGE
    g, slope = function_ranges(number, f)
    return g, range_product(slope, d)


def _extreme(o: int, a: list[JetRange], sign: Any) -> JetRange:
    """Minimum or maximum of two; of truth values, whether both or one holds."""
    pick = np.minimum if o == bytecode.MINIMUM else np.maximum
    (f, d), (g, e) = a[0], a[1]
    if len(a) == 2 or sign is None:
        return (pick(f[0], g[0]), pick(f[1], g[1])), range_hull([*d, *e])
    first = (sign > 0) == (o == bytecode.MAXIMUM)
    return _condition_range(first, ~first, f, g), _condition_range(first, ~first, d, e)


def _arithmetic(o: int, a: list[JetRange], sign: Any) -> JetRange:
    (f, d), (g, e) = a[0], a[1]
    if o == bytecode.ADD:
        return range_sum(f, g), range_sum(d, e)
    if o == bytecode.SUBTRACT:
        return range_difference(f, g), range_difference(d, e)
    if o == bytecode.MULTIPLY:
        return range_product(f, g), range_sum(range_product(d, g), range_product(f, e))
    if o == bytecode.DIVIDE:
        if sign is not None:
            g = np.where(sign > 0, np.maximum(g[0], 0.0), g[0]), np.where(sign > 0, g[1], np.minimum(g[1], 0.0))
        q = range_product(f, range_reciprocal(g))
        return q, range_product(range_difference(d, range_product(q, e)), range_reciprocal(g))
    if o == bytecode.POWER:
        p, slope = real_power_ranges(f, g[0])
        return p, range_product(slope, d)
    if o == bytecode.ATAN2:
        if sign is not None:
            up, down = (sign > 0) & (f[0] <= 0.0), (sign < 0) & (f[1] >= 0.0)
            f = np.where(up, 0.0, f[0]), np.where(down, -0.0, f[1])
        p, by_y, by_x = atan2_ranges(f, g)
        return p, range_sum(range_product(by_y, d), range_product(by_x, e))
    return (-np.inf, np.inf), (-np.inf, np.inf)
