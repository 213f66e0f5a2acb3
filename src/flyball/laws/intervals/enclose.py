"""Steps of a law over intervals of time: ranges of values and slopes; and at points of time: values and slopes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from ...math.scalar import integer_power
from ...math.spline import spline
from ..evaluation import combined, power_slopes, slopes, value
from ..opcodes import (
    ABS,
    ADD,
    ATAN2,
    CALL,
    CONSTANT,
    DIVIDE,
    FREEZE,
    INPUT,
    LESS,
    LESS_EQUAL,
    MAXIMUM,
    MINIMUM,
    MULTIPLY,
    NOT,
    POWER,
    SIGN,
    SUBTRACT,
    TABLE,
    WHERE,
    WHOLE_POWER,
)
from .curve import Curve
from .ranges import (
    Range,
    angle,
    broken_power,
    function,
    hull,
    minus,
    over,
    plus,
    times,
    whole_power,
)
from .steps import NOTHING, Step

Jet = tuple[Range, Range]
NONE: Range = (0.0, 0.0)
Signs = Mapping[int, Any]
NOT_TOLD: Signs = MappingProxyType({})


class Law:
    """The steps of a law, and the constants and tables that they name."""

    def __init__(self, steps: Sequence[Step], const: np.ndarray) -> None:
        self.steps, self.const = steps, np.asarray(const, float)
        self.curves = {s.operand: Curve(self.const, s.operand) for s in steps if s.operation == TABLE}
        self.fixed: dict[int, float] = {}  # values of what depends on nothing
        for k, s in enumerate(steps):
            if s.on == NOTHING:
                self.fixed[k] = float(self._point(s, self.fixed, np.zeros(1)))

    def points(
        self, wanted: Sequence[int], t: np.ndarray, signs: Signs = NOT_TOLD
    ) -> tuple[dict[int, Any], dict[int, Any]]:
        """Values and slopes of steps at times; ``signs`` as in `enclose`, for times at which a step jumps."""
        v: dict[int, Any] = {}
        d: dict[int, Any] = {}
        for k in wanted:
            s = self.steps[k]
            if s.on == NOTHING:
                v[k], d[k] = self.fixed[k], 0.0
            else:
                v[k] = _on_side(s, [v[n] for n in s.args], signs[k]) if k in signs else None
                v[k] = self._point(s, v, t) if v[k] is None else v[k]
                d[k] = self._slope(s, v, d, v[k])
        return v, d

    def _point(self, s: Step, v: Mapping[int, Any], t: np.ndarray) -> Any:
        a = [v[k] for k in s.args]
        if s.operation == CONSTANT:
            return self.const[s.operand]
        if s.operation == INPUT:
            return t
        if s.operation == CALL:
            return value(s.operand, a[0])
        if s.operation == WHOLE_POWER:
            return integer_power(a[0], s.operand)
        if s.operation == TABLE:
            return spline(self.const, s.operand, a[0])[0]
        if s.operation == WHERE:
            return np.where(np.asarray(a[0]) > 0.5, a[1], a[2])
        return a[0] if s.operation == FREEZE else np.asarray(combined(s.operation, a[0], a[1]))

    def _slope(self, s: Step, v: Mapping[int, Any], d: Mapping[int, Any], f: Any) -> Any:
        a, b = [v[k] for k in s.args], [d[k] for k in s.args]
        o = s.operation
        if o == INPUT:
            return 1.0
        if o == CALL:
            return slopes(s.operand, a[0], f)[0] * b[0]
        if o == WHOLE_POWER:
            return power_slopes(a[0], s.operand)[0] * b[0]
        if o == TABLE:
            return spline(self.const, s.operand, a[0])[1] * b[0]
        if o == WHERE:
            return np.where(np.asarray(a[0]) > 0.5, b[1], b[2])
        if o in (ADD, SUBTRACT):
            return b[0] + b[1] if o == ADD else b[0] - b[1]
        if o == MULTIPLY:
            return b[0] * a[1] + a[0] * b[1]
        if o == DIVIDE:
            return (b[0] - f * b[1]) / a[1]
        if o == POWER:
            return power_slopes(a[0], a[1])[0] * b[0]
        if o == ATAN2:
            return (a[1] * b[0] - a[0] * b[1]) / (a[0] * a[0] + a[1] * a[1])
        if o in (MINIMUM, MAXIMUM) and len(a) == 3:
            return np.where(np.asarray(a[2]) > 0.0, b[o == MINIMUM], b[o == MAXIMUM])
        return b[0] if o == FREEZE else 0.0

    def enclose(self, wanted: Sequence[int], t: Range, signs: Signs) -> dict[int, Jet]:
        """Ranges of steps and of their slopes over intervals of time.

        ``signs`` are the signs, in each interval, of what decides at a step with a corner.
        """
        out: dict[int, Jet] = {}
        for k in wanted:
            s = self.steps[k]
            if s.on == NOTHING:
                out[k] = (self.fixed[k], self.fixed[k]), NONE
            elif s.operation == INPUT:
                out[k] = t, (1.0, 1.0)
            else:
                out[k] = self._range(s, [out[n] for n in s.args], signs.get(k))
        return out

    def _range(self, s: Step, a: list[Jet], sign: Any) -> Jet:
        o = s.operation
        f, d = a[0]
        if o == FREEZE:
            return f, d
        if o == TABLE:
            g, slope = self.curves[s.operand].ranges(f)
            return g, times(slope, d)
        if o == WHOLE_POWER:
            n = s.operand
            slope = times((float(n), float(n)), whole_power(f, n - 1)) if n != 0 else NONE
            return whole_power(f, n), times(slope, d)
        if o == CALL:
            return _called(s.operand, f, d, sign)
        if o == WHERE:
            yes, no = f[0] > 0.5, f[1] < 0.5
            return _chosen(yes, no, a[1][0], a[2][0]), _chosen(yes, no, a[1][1], a[2][1])
        if o in (LESS, LESS_EQUAL):
            return ((0.0, 1.0) if sign is None else (np.where(sign > 0, 1.0, 0.0),) * 2), NONE
        if o in (MINIMUM, MAXIMUM):
            return _extreme(o, a, sign)
        return _arithmetic(o, a, sign)


def _on_side(s: Step, a: list[Any], sign: Any) -> Any:
    """Value of a step with a corner, on the side of it that a sign says; None where that makes no difference."""
    if s.operation == CALL and s.operand in (ABS, SIGN):
        return sign * a[0] if s.operand == ABS else sign
    if s.operation in (LESS, LESS_EQUAL):
        return np.where(sign > 0, 1.0, 0.0)
    if s.operation in (MINIMUM, MAXIMUM):
        return np.where((sign > 0) == (s.operation == MAXIMUM), a[0], a[1])
    if s.operation == ATAN2:
        return np.arctan2(np.where(a[0] * sign <= 0.0, np.copysign(0.0, sign), a[0]), a[1])
    return None


def _chosen(yes: Any, no: Any, a: Range, b: Range) -> Range:
    """The range a, b, or both."""
    lo, hi = np.minimum(a[0], b[0]), np.maximum(a[1], b[1])
    return np.where(yes, a[0], np.where(no, b[0], lo)), np.where(yes, a[1], np.where(no, b[1], hi))


def _called(number: int, f: Range, d: Range, sign: Any) -> Jet:
    if number in (ABS, SIGN) and sign is not None:
        s = (sign, sign)
        if number == SIGN:
            return s, NONE
        lo, hi = times(s, f)
        return (np.maximum(lo, 0.0), hi), times(s, d)
    if number == NOT:
        return (1.0 - f[1], 1.0 - f[0]), NONE
    g, slope = function(number, f)
    return g, times(slope, d)


def _extreme(o: int, a: list[Jet], sign: Any) -> Jet:
    """The lesser or greater of two; of truths, whether both or one holds."""
    pick = np.minimum if o == MINIMUM else np.maximum
    (f, d), (g, e) = a[0], a[1]
    if len(a) == 2 or sign is None:
        return (pick(f[0], g[0]), pick(f[1], g[1])), hull([*d, *e])
    first = (sign > 0) == (o == MAXIMUM)
    return _chosen(first, ~first, f, g), _chosen(first, ~first, d, e)


def _arithmetic(o: int, a: list[Jet], sign: Any) -> Jet:
    (f, d), (g, e) = a[0], a[1]
    if o == ADD:
        return plus(f, g), plus(d, e)
    if o == SUBTRACT:
        return minus(f, g), minus(d, e)
    if o == MULTIPLY:
        return times(f, g), plus(times(d, g), times(f, e))
    if o == DIVIDE:
        if sign is not None:
            g = np.where(sign > 0, np.maximum(g[0], 0.0), g[0]), np.where(sign > 0, g[1], np.minimum(g[1], 0.0))
        q = times(f, over(g))
        return q, times(minus(d, times(q, e)), over(g))
    if o == POWER:
        p, slope = broken_power(f, g[0])
        return p, times(slope, d)
    if o == ATAN2:
        if sign is not None:
            up, down = (sign > 0) & (f[0] <= 0.0), (sign < 0) & (f[1] >= 0.0)
            f = np.where(up, 0.0, f[0]), np.where(down, -0.0, f[1])
        p, by_y, by_x = angle(f, g)
        return p, plus(times(by_y, d), times(by_x, e))
    return (-np.inf, np.inf), (-np.inf, np.inf)
