"""Scalar functions for every kind of number in formulas.

The same call works on floats, complex numbers, NumPy arrays (a formula over time), expressions (any object with a
method ``apply(name, *args)``: nodes of `expression_graph`; else SymPy's) and, through overloads, inside compiled code
for real and complex numbers.

Outside its domain a real function gives nan or inf, as in C, and never raises: a solver checks its state once a step
and reports it. Complex numbers follow the principal branches of `cmath`; functions that are not analytic (`atan2`,
`absolute`, `sign`, `rounded`, `minimum`, `maximum`) decide on the real parts and carry the derivative in the imaginary
part, so that a complex step gives their exact derivative.
"""

from __future__ import annotations

import cmath
import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np

from ..compiler.formulas import formula, when_compiling

Function = Callable[..., Any]

_NUMBERS = (float, int, complex)
_ANALYTIC: dict[Function, str] = {}


def real_parts(x: Any) -> np.ndarray:
    """Real parts as floats, for decisions: of complex numbers, and of constant expressions."""
    x = np.asarray(x)
    return np.frompyfunc(lambda e: e.real, 1, 1)(x).astype(float) if x.dtype == object else x.real


def _quietly(ufunc: Function, *args: Any) -> Any:
    """Value of a ufunc without warnings; a Python number for numbers."""
    with np.errstate(all="ignore"):
        value = ufunc(*args)
    return value.item() if isinstance(value, np.generic) else value


def _on_array(function: Function, ufunc: Function, *args: Any) -> Any:
    """Value on arrays; arrays of objects (symbols) go element by element."""
    if any(np.asarray(a).dtype == object for a in args):
        return _quietly(np.frompyfunc(function, len(args), 1), *args)
    return _quietly(ufunc, *args)


def _has_array(*args: Any) -> bool:
    return any(isinstance(a, np.ndarray | np.generic) for a in args)


def _on_expressions(name: str, *args: Any) -> Any:
    """Function of expressions, by its name in this module."""
    for x in args:
        if hasattr(x, "apply"):
            return x.apply(name, *args)
    import sympy

    known = {
        "absolute": sympy.Abs,
        "rounded": lambda x: sympy.floor(x + sympy.Rational(1, 2)),
        "minimum": sympy.Min,
        "maximum": sympy.Max,
        "choose": lambda x, a, b: sympy.Piecewise((a, x > 0), (b, True)),
    }
    return known.get(name, getattr(sympy, name, None))(*args)


def _analytic(name: str, ufunc: Function, meaning: str) -> Function:
    """One analytic function of one argument, by its name in `math`, `cmath` and SymPy."""
    real, complex_ = getattr(math, name), getattr(cmath, name)

    def function(x):
        try:
            if isinstance(x, float | int):
                return real(x)
            if isinstance(x, complex):
                return complex_(x)
        except (ValueError, OverflowError):
            return _quietly(ufunc, x)
        if _has_array(x):
            return _on_array(function, ufunc, x)
        return _on_expressions(name, x)

    function.__name__ = function.__qualname__ = name
    function.__doc__ = meaning
    _ANALYTIC[function] = name
    return function


sqrt = _analytic("sqrt", np.sqrt, "Square root; nan for a negative real.")
sin = _analytic("sin", np.sin, "Sine of an angle [rad].")
cos = _analytic("cos", np.cos, "Cosine of an angle [rad].")
tan = _analytic("tan", np.tan, "Tangent of an angle [rad].")
asin = _analytic("asin", np.arcsin, "Angle [rad] in [-pi/2, pi/2] of a sine; nan for a real outside [-1, 1].")
acos = _analytic("acos", np.arccos, "Angle [rad] in [0, pi] of a cosine; nan for a real outside [-1, 1].")
atan = _analytic("atan", np.arctan, "Angle [rad] in (-pi/2, pi/2) of a tangent.")
exp = _analytic("exp", np.exp, "Exponential; inf on overflow.")
log = _analytic("log", np.log, "Natural logarithm; -inf at zero, nan for a negative real.")
sinh = _analytic("sinh", np.sinh, "Hyperbolic sine.")
cosh = _analytic("cosh", np.cosh, "Hyperbolic cosine.")
tanh = _analytic("tanh", np.tanh, "Hyperbolic tangent.")


def atan2(y, x):
    """Angle [rad] in (-pi, pi] of the point (x, y); complex numbers carry its first derivative."""
    if isinstance(y, float | int) and isinstance(x, float | int):
        return math.atan2(y, x)
    if isinstance(y, _NUMBERS) and isinstance(x, _NUMBERS):
        turned, square = x.real * y.imag - y.real * x.imag, x.real * x.real + y.real * y.real
        return complex(math.atan2(y.real, x.real), divide(turned, square) if turned else 0.0)
    if _has_array(y, x):
        if np.iscomplexobj(y) or np.iscomplexobj(x):
            return np.vectorize(atan2, otypes=[complex])(y, x)
        return _on_array(atan2, np.arctan2, y, x)
    return _on_expressions("atan2", y, x)


def absolute(x):
    """Absolute value: x or -x by the sign of its real part."""
    if isinstance(x, _NUMBERS):
        return -x if x.real < 0 else x
    if _has_array(x):
        return _on_array(absolute, lambda x: np.where(x.real < 0, -x, x)[()], x)
    return _on_expressions("absolute", x)


def sign(x):
    """-1, 0 or 1 by the real part; nan for nan."""
    if isinstance(x, float | int):
        return x if x != x else float(x > 0) - float(x < 0)
    if isinstance(x, complex):
        return complex(sign(x.real))
    if _has_array(x):
        return _on_array(sign, lambda x: np.sign(x.real) + 0 * x, x)
    return _on_expressions("sign", x)


def rounded(x):
    """The whole number nearest to the real part (upwards from halves), without a derivative."""
    if isinstance(x, float | int):
        return math.floor(x + 0.5) * 1.0 if math.isfinite(x) else x * 1.0
    if isinstance(x, complex):
        return complex(rounded(x.real))
    if _has_array(x):
        return _on_array(rounded, lambda x: np.floor(x.real + 0.5) + 0 * x, x)
    return _on_expressions("rounded", x)


def minimum(a, b):
    """The argument with the smaller real part (the first of equals); nan if either is nan."""
    if isinstance(a, _NUMBERS) and isinstance(b, _NUMBERS):
        return a if a.real <= b.real or a != a else b
    if _has_array(a, b):
        return _on_array(minimum, lambda a, b: np.where((np.real(a) <= np.real(b)) | (a != a), a, b)[()], a, b)
    return _on_expressions("minimum", a, b)


def maximum(a, b):
    """The argument with the larger real part (the first of equals); nan if either is nan."""
    if isinstance(a, _NUMBERS) and isinstance(b, _NUMBERS):
        return a if a.real >= b.real or a != a else b
    if _has_array(a, b):
        return _on_array(maximum, lambda a, b: np.where((np.real(a) >= np.real(b)) | (a != a), a, b)[()], a, b)
    return _on_expressions("maximum", a, b)


def choose(x, a, b):
    """A where the real part of x is greater than zero, else b; both are computed."""
    if isinstance(x, _NUMBERS):
        return a if x.real > 0 else b
    if _has_array(x):
        return _on_array(choose, lambda x, a, b: np.where(np.real(x) > 0, a, b), x, a, b)
    return _on_expressions("choose", x, a, b)


def unless_zero(x, a, b):
    """A where the real part of x is not zero, else b; both are computed. For an expression, x != 0 is assumed."""
    if _has_array(x):
        return _on_array(unless_zero, lambda x, a, b: np.where(np.real(x) != 0, a, b), x, a, b)
    return a if nonzero(x) else b


def magnitude(x):
    """|Re x|: sizes are for decisions and carry no derivative."""
    return x.apply("absolute", x) if hasattr(x, "apply") else x.real if x.real > 0.0 else -x.real


def larger(a, b):
    """The larger of two sizes, for decisions: b where either is nan."""
    if hasattr(a, "apply") or hasattr(b, "apply"):
        return _on_expressions("choose", a - b, a, b)
    return a if a > b else b


def nonzero(x):
    """Whether a pivot is a number other than zero; for an expression that is assumed, and recorded."""
    return x.granted("nonzero") if hasattr(x, "granted") else not (x.real == 0.0 or x.real != x.real)


def positive(x):
    """Whether the real part is greater than zero; for an expression that is assumed, and recorded."""
    return x.granted("positive") if hasattr(x, "granted") else x.real > 0.0


def nonpositive(x):
    """Whether a number is zero or less, for a shorter way to the same result; False for arrays and expressions."""
    return isinstance(x, _NUMBERS) and x.real <= 0.0


def divide(a, b):
    """A / b; inf or nan where b is zero, as in C."""
    if isinstance(b, _NUMBERS):
        if b != 0 or not isinstance(a, _NUMBERS):
            return a / b
        return _quietly(np.divide, a, b)
    if _has_array(a, b):
        return _on_array(operator.truediv, np.divide, a, b)
    return a / b


def power(a, b):
    """A ** b; nan for a negative base with a non-integer exponent, inf for zero with a negative one, as in C."""
    if isinstance(a, float | int) and isinstance(b, float | int):
        try:
            return math.pow(a, b)
        except (ValueError, OverflowError):
            return _quietly(np.power, float(a), float(b))
    if isinstance(a, _NUMBERS) and isinstance(b, _NUMBERS):
        return _complex_power(complex(a), complex(b))
    if _has_array(a, b):
        if np.iscomplexobj(a) or np.iscomplexobj(b):
            return np.vectorize(power, otypes=[complex])(a, b)
        return _on_array(power, lambda a, b: np.power(a + 0.0, b), a, b)
    return a**b


@formula
def integer_power(x, n):
    """X ** n for an integer n, by repeated squaring: the same products for every kind of number."""
    m = n if n >= 0 else -n
    value, square = 1, x
    while m > 0:
        if m % 2 == 1:
            value = value * square
        square = square * square
        m = m // 2
    return value if n >= 0 else divide(1, value)


@formula
def _complex_power(a, b):
    """A ** b for complex numbers near the real axis: the value of the real function and its derivative."""
    if b.imag == 0 and b.real == math.floor(b.real) and -64 <= b.real <= 64:
        return integer_power(a, int(b.real))
    if a.real < 0:
        return complex(math.nan, math.nan)
    if a == 0:
        return complex(power(0.0, b.real), 0.0)
    return exp(b * log(a))


@formula
def cubic_rise(s):
    """Rise from 0 (s = 0) to 1 (s = 1) with zero slope at both ends: s^2 (3 - 2 s)."""
    return s * s * (3.0 - 2.0 * s)


@formula
def quintic_rise(s):
    """Rise from 0 (s = 0) to 1 (s = 1) with zero slope and curvature at both ends: s^3 (10 - 15 s + 6 s^2)."""
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))


@when_compiling
def _register() -> None:
    """Register the compiled versions of these functions for real and complex numbers."""
    _register_analytic_functions()
    _register_choices()
    _register_functions_of_two_numbers()


def _overload_analytic(function: Function, name: str) -> None:
    from numba import types

    from ..compiler.numba_target import overload

    real, complex_ = getattr(math, name), getattr(cmath, name)

    @overload(function)
    def choose(x):
        return (lambda x: complex_(x)) if isinstance(x, types.Complex) else (lambda x: real(x))


def _overload_stepped(function: Function, real: Function, complex_: Function) -> None:
    """Overload a function whose complex argument carries a first-order step."""
    from numba import types

    from ..compiler.numba_target import overload

    @overload(function)
    def choose(x):
        return complex_ if isinstance(x, types.Complex) else real


def _overload_either(function: Function, real: Function, complex_: Function) -> None:
    """Overload a function of two numbers, of which one or both may be complex."""
    from numba import types

    from ..compiler.numba_target import overload

    @overload(function)
    def choose(a, b):
        return complex_ if isinstance(a, types.Complex) or isinstance(b, types.Complex) else real


def _register_analytic_functions() -> None:
    for function, name in _ANALYTIC.items():
        if function not in (sin, cos, tan, atan, tanh, sqrt):
            _overload_analytic(function, name)

    def complex_sqrt(x):
        if not x.real > 0.0:
            return cmath.sqrt(x)
        root = math.sqrt(x.real)
        return complex(root, 0.5 * x.imag / root)

    def complex_tan(x):
        t = math.tan(x.real)
        return complex(t, x.imag * (1.0 + t * t))

    def complex_tanh(x):
        c = math.cosh(x.real)
        return complex(math.tanh(x.real), x.imag / (c * c))

    stepped = _overload_stepped
    stepped(sin, lambda x: math.sin(x), lambda x: complex(math.sin(x.real), x.imag * math.cos(x.real)))
    stepped(cos, lambda x: math.cos(x), lambda x: complex(math.cos(x.real), -x.imag * math.sin(x.real)))
    stepped(sqrt, lambda x: math.sqrt(x), complex_sqrt)
    stepped(tan, lambda x: math.tan(x), complex_tan)
    stepped(tanh, lambda x: math.tanh(x), complex_tanh)
    stepped(atan, lambda x: math.atan(x), lambda x: complex(math.atan(x.real), x.imag / (1.0 + x.real * x.real)))


def _register_choices() -> None:
    """Register the functions that compare, round and choose, by real parts."""
    from numba import types

    from ..compiler.numba_target import overload

    @overload(absolute)
    def choose_absolute(x):
        return lambda x: -x if x.real < 0 else x

    @overload(sign)
    def choose_sign(x):
        if isinstance(x, types.Complex):
            return lambda x: complex(sign(x.real), 0.0)
        return lambda x: x * 1.0 if x != x else float((x > 0) - (x < 0))

    @overload(rounded)
    def choose_rounded(x):
        if isinstance(x, types.Complex):
            return lambda x: complex(np.floor(x.real + 0.5), 0.0)
        return lambda x: np.floor(x + 0.5)

    @overload(magnitude)
    def choose_magnitude(x):
        return lambda x: x.real if x.real > 0.0 else -x.real

    @overload(larger)
    def choose_larger(a, b):
        return lambda a, b: a if a > b else b

    @overload(nonzero)
    def choose_nonzero(x):
        return lambda x: not (x.real == 0.0 or x.real != x.real)

    @overload(positive)
    def choose_positive(x):
        return lambda x: x.real > 0.0

    @overload(nonpositive)
    def choose_nonpositive(x):
        return lambda x: x.real <= 0.0

    @overload(choose)
    def choose_choose(x, a, b):
        return lambda x, a, b: a if x.real > 0 else b

    @overload(unless_zero)
    def choose_unless_zero(x, a, b):
        return lambda x, a, b: a if x.real != 0.0 else b


def _register_functions_of_two_numbers() -> None:
    def complex_atan2(a, b):
        turned, square = b.real * a.imag - a.real * b.imag, b.real * b.real + a.real * a.real
        return complex(math.atan2(a.real, b.real), turned / square if turned != 0.0 else 0.0)

    def least(a, b):
        return a if a.real <= b.real or a != a else b

    def most(a, b):
        return a if a.real >= b.real or a != a else b

    def quotient(a, b):
        return a / b

    def complex_quotient(a, b):  # Numba's own raises where b is zero, and takes three divisions
        f = a.real / b.real
        return complex(f, (a.imag - f * b.imag) / b.real)

    _overload_either(atan2, lambda a, b: math.atan2(a, b), complex_atan2)
    _overload_either(minimum, least, least)
    _overload_either(maximum, most, most)
    _overload_either(divide, quotient, complex_quotient)
    _overload_either(power, lambda a, b: math.pow(a, b), lambda a, b: _complex_power(complex(a), complex(b)))
