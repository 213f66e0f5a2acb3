"""Laws that are Python functions: compiled or called back, they give the numbers of the same expression."""

import functools
import gc
import math
import os
import pickle
import signal
import warnings
import weakref
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import flyball as fb
from flyball.errors import ExpressionError, PerformanceNotice
from flyball.laws.bytecode import STACK_RESERVE, evaluate
from flyball.laws.compilation import compile_law
from flyball.laws.python_functions import clear_faults, compile_function, deferred_interrupts, function_fault
from flyball.model.expression_parser import FunctionCall
from flyball.model.expressions import Expression, law_expression
from tests.compiled import compiled

PARAMETERS = {"k": 3.0}
INPUTS = ("t", "length", "rate")
SENSORS = {"speed": 1}
X = (0.3, 0.8, -1.7)
SPEED = 0.45
VALUES = {"t": X[0], "length": X[1], "rate": X[2], "speed": SPEED, **PARAMETERS}
GAIN = 2.0
LIST = [1.0]


@compiled
def compiled_value(code, const, at, stack, x, sensed):
    return evaluate(code, const, at, stack, x, sensed)


@compiled
def compiled_sum(code, const, at, stack, x, sensed, n):
    s = 0.0
    for i in range(n):
        s += evaluate(code, const, at, stack, (x[0] + i, x[1], x[2]), sensed)
    return s


class Law:
    """A law and the tables that it is compiled into."""

    def __init__(self, law, sensors=SENSORS):
        self.formula = law_expression(law, "N", "torque of Motor 'm'")
        code, const, self.functions = [7, 7], list(PARAMETERS.values()), []
        self.at, depth = compile_law(
            self.formula, INPUTS, list(PARAMETERS), code, const, sensors=sensors, functions=self.functions
        )
        self.code, self.const = np.array(code), np.array(const)
        self.stack = np.zeros((depth + STACK_RESERVE, 3))

    def value(self, *x, how=compiled_value):
        return how(self.code, self.const, self.at, self.stack, tuple(x or X), np.full((3, 2), SPEED))

    @property
    def native(self):
        return self.functions[0].native

    def fault(self):
        return function_fault(self.stack, self.functions)


@pytest.fixture
def _quiet():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PerformanceNotice)
        yield


def in_python(function):
    """The same function in a form that cannot be compiled."""
    return functools.partial(function)


def helper(x):
    return GAIN * math.exp(-x)


def constant():
    return 4.5


def pull(t, length, k):
    return k * (length - 0.3) + helper(t)


def of_all(rate, t, speed, k, length):
    return rate * abs(rate) + np.sin(t) * speed - k / length


def branches(length):
    if length > 0.5:
        return 1
    return -length


def with_loop(t, length):
    s = 0.0
    for i in range(5):
        s += math.cos(i * t) * length**i
    return s


def with_array(length):
    return np.interp(length, POINTS, 2.0 * POINTS)


POINTS = np.array([0.0, 0.5, 1.0])
SAME = [
    (constant, "4.5"),
    (pull, "k*(length - 0.3) + 2*exp(-t)"),
    (of_all, "rate*abs(rate) + sin(t)*speed - k/length"),
    (branches, "where(length > 0.5, 1, -length)"),
    (with_loop, "1 + cos(t)*length + cos(2*t)*length**2 + cos(3*t)*length**3 + cos(4*t)*length**4"),
    (with_array, "2*length"),
    (lambda t, k=7.0: k * t, "k*t"),
    (lambda t, factor=7.0: factor * t, "7*t"),
    (lambda factor=7, t=0.0: factor * t, "7*t"),
    (lambda t, *, factor=7: factor * t, "7*t"),
]


@pytest.mark.usefixtures("_quiet")
@pytest.mark.parametrize(("function", "text"), SAME)
def test_the_numbers_are_those_of_the_expression(function, text):
    expected = Expression.parse(text).evaluate(VALUES)
    compiled, back = Law(function), Law(in_python(function))
    assert compiled.native.reason == ""
    assert "no plain function" in back.native.reason
    for law in (compiled, back, Law(text)):
        assert law.value() == pytest.approx(expected, rel=1e-14)
        assert law.value(how=evaluate) == pytest.approx(expected, rel=1e-14)
        assert law.formula.evaluate(VALUES) == pytest.approx(expected, rel=1e-14)
        assert law.fault() is None


@pytest.mark.usefixtures("_quiet")
def test_functions_and_expressions_share_the_tables():
    code, const, functions = [], list(PARAMETERS.values()), []
    laws = [pull, "2*k*t", in_python(pull), "length/5", pull]
    places = [compile_law(law_expression(f, "N", "x"), INPUTS, ["k"], code, const, functions=functions) for f in laws]
    stack = np.zeros((max(depth for _, depth in places) + STACK_RESERVE, 3))
    found = [compiled_value(np.array(code), np.array(const), at, stack, X, np.zeros((3, 0))) for at, _ in places]
    p = pull(X[0], X[1], 3.0)
    assert found == pytest.approx([p, 6 * X[0], p, X[1] / 5, p], rel=1e-14)
    assert len(functions) == 3
    assert functions[0].native is functions[2].native


def test_methods_and_objects_are_called_as_they_are_now():
    class Spring:
        stiffness = 2.0

        def force(self, length):
            return self.stiffness * length

        def __call__(self, t):
            return self.stiffness * t

    spring = Spring()
    with pytest.warns(PerformanceNotice, match="'force' cannot be compiled .it is no plain function but a method"):
        law = Law(spring.force)
    with pytest.warns(PerformanceNotice, match="'Spring' cannot be compiled"):
        other = Law(spring)
    assert law.value() == pytest.approx(2 * X[1])
    spring.stiffness = 5.0
    assert law.value() == pytest.approx(5 * X[1])
    assert other.value() == pytest.approx(5 * X[0])


def test_functions_that_numba_has_compiled():
    from numba import njit

    assert Law(njit(branches)).value() == 1.0


@pytest.mark.usefixtures("_quiet")
@pytest.mark.parametrize("how", [lambda f: f, in_python])
def test_an_exception_comes_back(how):
    class Broken(Exception):
        pass

    def check(t):
        if t > 0.2:
            raise ValueError("too late")
        return t

    def divide(t, length):
        return length / (t - 0.3)

    def root(length, t):
        return math.sqrt(t - length)

    def own(t):
        raise Broken(f"at {t}")

    for function, kind, text in (
        (check, ValueError, "too late"),
        (divide, ZeroDivisionError, "division by zero"),
        (root, ValueError, "math domain error"),
        (own, Broken, "at 0.3"),
    ):
        law = Law(how(function))
        assert math.isnan(law.value())
        found = law.fault()
        assert type(found.exception) is kind
        assert text in str(found.exception)
        assert found.arguments[0] == {"root": 0.8}.get(function.__name__, 0.3)
        assert found.function.where == "torque of Motor 'm'"
        shown = f"torque of Motor 'm': the Python function <{function.__name__}("
        assert found.message.startswith(shown)
        assert f" raises {kind.__name__} for " in found.message
        assert "t = 0.3" in found.message
        with pytest.raises(kind, match=text):
            law.value(how=evaluate)
        with pytest.raises(kind, match=text):
            law.formula.evaluate(VALUES)


@pytest.mark.usefixtures("_quiet")
@pytest.mark.parametrize("how", [lambda f: f, in_python])
@pytest.mark.parametrize("given", [math.nan, math.inf])
def test_a_value_that_is_not_finite_is_noted(how, given):
    law = Law(how(lambda t, rate, zz=2.0: given if t > 0 else rate))
    assert law.value(-1.0, 0.0, 2.5) == 2.5
    assert law.fault() is None
    assert law.value(4.0, 0.0, 2.5) == pytest.approx(given, nan_ok=True)
    assert law.fault().exception is None
    assert law.fault().arguments == (4.0, 2.5)
    assert f"gives {given} for t = 4, rate = 2.5; it must give a finite number" in law.fault().message
    clear_faults(law.stack)
    assert law.fault() is None
    law.value(4.0, 0.0, math.nan)  # not the function's fault
    assert law.fault() is None


@pytest.mark.usefixtures("_quiet")
def test_what_is_no_number_is_a_fault():
    law = Law(lambda t: None)
    assert math.isnan(law.value())
    assert isinstance(law.fault().exception, ExpressionError)
    assert "it returned None (NoneType); a law returns a number" in law.fault().message


def test_the_notice_appears_once():
    def listed(t, length):
        return sum(LIST) * t * length

    with pytest.warns(PerformanceNotice) as seen:
        first = Law(listed)
    assert len(seen) == 1
    text = str(seen[0].message)
    assert text.startswith("torque of Motor 'm': the Python function 'listed' cannot be compiled ('LIST' is a list, ")
    assert "called back in Python" in text
    assert "an expression or a Table" in text
    assert seen[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        second = Law(listed)
    LIST[0] = 3.0
    try:
        assert first.value() == second.value() == pytest.approx(3 * X[0] * X[1])
    finally:
        LIST[0] = 1.0


def test_code_is_made_once_and_goes_with_its_function():
    def made(t):
        return 2 * t

    first, second = Law(made), Law(made)
    assert first.native is second.native
    gone = weakref.ref(first.native)
    del first, second
    gc.collect()
    assert gone() is not None
    again = Law(made)
    assert again.native is gone()
    del made
    gc.collect()
    assert again.value() == pytest.approx(2 * X[0])
    del again
    gc.collect()
    assert gone() is None


def test_changed_surroundings_are_seen(monkeypatch):
    factor, points = 3.0, np.array([1.0, 2.0])

    def inner(t):
        return factor * t

    def outer(t):
        return inner(t) + GAIN + points[1]

    assert Law(outer).value() == pytest.approx(3 * X[0] + 4)
    factor = 5.0
    assert Law(outer).value() == pytest.approx(5 * X[0] + 4)
    points[1] = 7.0
    assert Law(outer).value() == pytest.approx(5 * X[0] + 9)
    monkeypatch.setitem(globals(), "GAIN", 0.0)
    assert Law(outer).value() == pytest.approx(5 * X[0] + 7)
    assert Law(pull).value() == pytest.approx(3 * (X[1] - 0.3))


def test_expressions_of_functions_are_values():
    a, b = (law_expression(f, "N", "x") for f in (pull, lambda t, length, k: 0.0))
    assert a == law_expression(pull, "N", "y")
    assert hash(a) == hash(law_expression(pull, "N", "y"))
    assert a != b
    assert str(a) == "<pull(t, length, k)>"
    assert a.names == {"t", "length", "k"}
    over = a.evaluate({"t": np.array([0.1, 0.2]), "length": np.array([[1.0], [2.0]]), "k": 1})
    assert over.shape == (2, 2)
    assert over[1, 0] == pytest.approx(pull(0.1, 2.0, 1.0))
    with pytest.raises(ExpressionError, match=r"(?s)unknown name 'k'.*<pull\(t, length, k\)>\n +\^\n"):
        a.evaluate({"t": 0, "length": 1})


@pytest.mark.usefixtures("_quiet")
def test_several_threads_may_call_back():
    laws = [Law(in_python(lambda t, n=n: n * t)) for n in (1.0, 2.0, 3.0)]

    def run(law):
        return compiled_sum(law.code, law.const, law.at, law.stack, (0.0, 0.0, 0.0), np.zeros((3, 2)), 2001)

    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(run, laws)) == pytest.approx([2001e3, 4002e3, 6003e3])


@pytest.mark.usefixtures("_quiet")
def test_an_interrupt_waits_for_compiled_code():
    """Ctrl-C during a callback would be swallowed there: it comes out when the compiled code is back."""

    def stop(t):
        if t == 5.0:
            os.kill(os.getpid(), signal.SIGINT)
        return t

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # the shell of a background job ignores it
    law, value = Law(in_python(stop)), None
    try:
        with pytest.raises(KeyboardInterrupt), deferred_interrupts(law.functions):
            value = compiled_sum(law.code, law.const, law.at, law.stack, (0.0, 0.0, 0.0), np.zeros((3, 2)), 11)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert value == 55.0
    assert law.fault() is None
    with deferred_interrupts(law.functions):
        law.value()


def test_addresses_stay_in_their_process():
    with pytest.raises(TypeError, match="'pull' is at an address of this process"):
        pickle.dumps(Law(pull).functions)


def test_elements_take_functions_where_laws_stand():
    motor = fb.Motor("m", "A", torque=pull)
    assert motor.torque is pull
    assert fb.SpringDamper("s", "a", "b", force=pull).force is pull


def test_equal_functions_are_compiled_once():
    """Each by what decides its code: operations, constants, enclosed numbers with their types; not by its place."""

    def made(c):
        return lambda t: c * t

    functions = [made(2.0), made(2.0), made(3.0), made(2), made(-0.0), made(0.0)]
    codes = [compile_function(FunctionCall(f, ("t",), "", "")) for f in functions]
    assert codes[0].address == codes[1].address
    assert len({x.address for x in codes}) == 5
    for f, x in zip(functions, codes, strict=True):
        assert x.python(1.5) == f(1.5)


def test_functions_with_other_surroundings_are_compiled_by_themselves():
    """Built-in functions, modules and the types of numbers in a tuple decide what a function computes."""

    def of(f):
        return lambda t: f(t)

    def by(module):
        return lambda t: module.sqrt(t - 1.0)

    def from_tuple(c):
        return lambda t: c[0] / 3 * t + math.atan2(c[1], -1.0)

    functions = [of(math.sin), of(math.cos), by(math), by(np), from_tuple((1, 0.0)), from_tuple((1, -0.0))]
    codes = [compile_function(FunctionCall(f, ("t",), "", "")) for f in functions]
    assert len({x.address for x in codes}) == 6
    values = [float(integrated(f)) for f in functions[:2]]
    assert values == pytest.approx([1.0 - math.sin(1.0), 1.0 - math.cos(1.0)], abs=1e-9)


def integrated(law):
    """Where a mass of 1 kg is after 1 s, from rest, under a force by time."""
    m = fb.Mechanism(planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("k", "x.displacement", force=law))
    return m.simulate(1, rtol=1e-9)["x.displacement"][-1]
