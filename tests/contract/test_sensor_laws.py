"""Laws that name sensors and tables: three readers of one law, and derivatives by whatever is asked for."""

import numpy as np
import pytest

from flyball.errors import ExpressionError
from flyball.laws.bytecode import BY_MOTION, BY_TIME, FREEZE, STACK_RESERVE, evaluate, evaluate_jet
from flyball.laws.compilation import compile_law
from flyball.math import scalar
from flyball.model.expressions import Expression, law_expression
from flyball.model.table import Table
from tests.compiled import compiled

PARAMETERS = {"a": 0.7, "b": 1.3}
SENSORS = {"speed": 2, "height": 0}  # column 1 is another law's
H = 1e-30
TABLES = {
    "curve": Table("curve", x=np.linspace(-2, 6, 17), y=np.sin(np.linspace(-2, 6, 17))),
    "ramp": Table("ramp", x=(0, 1, 3), y=(1, 2, 0.5), interpolation="linear", beyond="hold"),
    "wave": Table("wave", x=(0, 0.5, 1.5, 2), y=(0, 1, -1, 0), beyond="repeat", interpolation="monotone"),
}
LAWS = [
    "speed",
    "a*height - b*speed + t",
    "t*speed*height",
    "sin(speed*t)/(1 + height**2)",
    "speed**2.5 + height**-2",
    "height**speed",
    "speed**t + 2**height",
    "exp(-a*height)*atan2(speed, t)",
    "where(height > 0.5, speed**3, t)",
    "max(speed, height, t)",
    "step5(speed, 0, a, 3, b)*height",
    "curve(t)",
    "curve(speed*t) + a*curve(height)**2",
    "ramp(height)*t - ramp(2*speed)",
    "wave(t + curve(speed))",
    "wave(10*height)*speed",
]
AT = (0.9, (1.1, 0.61))  # time, (speed, height)


@compiled
def compiled_value(code, const, at, stack, x, sensed):
    return evaluate(code, const, at, stack, x, sensed)


@compiled
def compiled_jet(code, const, at, stack, t, sensed, seed):
    return evaluate_jet(code, const, at, stack, t, sensed, seed)


class Law:
    """One law in the shared tables, for numbers of one type."""

    def __init__(self, text, dtype=float):
        self.formula = law_expression(text, "N", "force of Actuator 'x'", TABLES)
        code, const, places = [], list(PARAMETERS.values()), {}
        for name, table in TABLES.items():
            places[name] = len(const)
            const += table.data()
        self.at, depth = compile_law(
            self.formula, ("t",), list(PARAMETERS), code, const, sensors=SENSORS, tables=places, derivatives=True
        )
        self.dtype, self.code, self.const = dtype, np.array(code), np.array(const, dtype)
        self.stack = np.zeros((depth, 3), dtype)

    def sensed(self, speed, height):
        sensed = np.full((3, 3), np.nan, self.dtype)
        sensed[:, SENSORS["speed"]], sensed[:, SENSORS["height"]] = speed, height
        return sensed

    def value(self, t, speed, height, how=compiled_value):
        x = (self.dtype(t),)
        return how(self.code, self.const, self.at, self.stack, x, self.sensed([speed, 0, 0], [height, 0, 0]))

    def jet(self, t, speed, height, seed, how=compiled_jet):
        return np.array(
            how(self.code, self.const, self.at, self.stack, self.dtype(t), self.sensed(speed, height), seed)
        )


@pytest.mark.parametrize("text", LAWS)
def test_three_readers_agree(text):
    t, (speed, height) = AT
    law = Law(text)
    for how, jet in ((compiled_value, compiled_jet), (evaluate, evaluate_jet)):
        value = law.value(t, speed, height, how)
        assert value == pytest.approx(
            law.formula.evaluate({"t": t, "speed": speed, "height": height, **PARAMETERS}, TABLES), rel=1e-14
        )
        for seed in (BY_MOTION, BY_TIME, 0, 1, 2):
            assert law.jet(t, [speed, 3, 4], [height, 5, 6], seed, jet)[0] == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("text", LAWS)
def test_expressions_run_on_arrays(text):
    formula = Law(text).formula
    over = {"t": np.linspace(0.2, 3, 7), "speed": np.linspace(2, 0.5, 7), "height": np.linspace(0.1, 0.8, 7)}
    expected = [formula.evaluate({k: float(v[i]) for k, v in over.items()} | PARAMETERS, TABLES) for i in range(7)]
    np.testing.assert_allclose(formula.evaluate(over | PARAMETERS, TABLES), expected, rtol=1e-13)


@pytest.mark.parametrize("text", LAWS)
def test_seeds_are_partial_derivatives(text):
    """A complex step in one argument at a time is the jet of that seed."""
    t, (speed, height) = AT
    law, stepped = Law(text), Law(text, complex)
    i = 1j * H
    for how, jet in ((compiled_value, compiled_jet), (evaluate, evaluate_jet)):
        for seed, args in (
            (BY_TIME, (t + i, speed, height)),
            (SENSORS["speed"], (t, speed + i, height)),
            (SENSORS["height"], (t, speed, height + i)),
            (1, (t, speed, height)),
        ):
            first = law.jet(t, [speed, 3, 4], [height, 5, 6], seed, jet)[1]
            assert stepped.value(*args, how).imag / H == pytest.approx(first, rel=1e-12, abs=1e-13), seed


def motion(t):
    """Time and the sensors as they move, and the sensors' first two derivatives at t = 0.9."""
    s = t - AT[0]
    now = {"t": t, "speed": 1.1 + scalar.sin(s) / 3, "height": 0.61 + s - s * s}
    return now, ([1.1, 1 / 3, 0], [0.61, 1, -2])


@pytest.mark.parametrize("text", LAWS)
def test_derivatives_along_a_motion(text):
    """The sensors move: the rate is that of f(t, speed(t), height(t)) by a complex step, the second its difference."""
    law, h = Law(text), 1e-4

    def stepped(t):
        z = law.formula.evaluate(motion(complex(t, H))[0] | PARAMETERS, TABLES)
        return np.array([z.real, z.imag / H])

    f, f1 = stepped(AT[0])
    f2 = (stepped(AT[0] + h) - stepped(AT[0] - h))[1] / (2 * h)
    for how in (compiled_jet, evaluate_jet):
        found = law.jet(AT[0], *motion(AT[0])[1], BY_MOTION, how)
        assert found[:2] == pytest.approx([f, f1], rel=1e-12, abs=1e-12)
        assert found[2] == pytest.approx(f2, rel=1e-5, abs=1e-5)


def test_a_part_with_a_sensor_is_not_constant():
    def program(text):
        code = []
        at, _ = compile_law(Expression.parse(text), ("t",), ["k"], code, [0.0], sensors={"level": 0})
        return code[at + 2 :: 2]

    assert FREEZE not in program("sqrt(level)")
    assert FREEZE in program("sqrt(k)*level")
    law = Law("sqrt(0*a)*height + 0**0.5")
    assert law.jet(0.3, [1, 1, 1], [0.5, 2, 3], BY_MOTION).tolist() == [0, 0, 0]


def test_a_sensor_by_its_second_derivative():
    law = Law("b*speed")
    assert law.jet(0.0, [2, 3, 5], [0, 0, 0], BY_MOTION) == pytest.approx([2.6, 3.9, 6.5])
    assert law.jet(0.0, [2, 3, 5], [0, 0, 0], BY_TIME) == pytest.approx([2.6, 0, 0])


@pytest.mark.parametrize(
    ("inputs", "parameters", "sensors", "says"),
    [
        (("t", "v"), ["v"], {}, "'v' is an input of this law and also a parameter; rename the parameter"),
        (("t", "v"), [], {"v": 0}, "'v' is an input of this law and also a sensor; rename the sensor"),
        (("t",), ["v"], {"v": 0}, "'v' is a parameter and also a sensor; rename the sensor"),
    ],
)
def test_names_that_mean_two_things(inputs, parameters, sensors, says):
    with pytest.raises(ExpressionError, match=says):
        compile_law(Expression.parse("2*v"), inputs, parameters, [], [1.0], sensors=sensors)


def test_sensors_are_among_the_known_names():
    with pytest.raises(
        ExpressionError, match=r"(?s)unknown name 'sped'.*known names: k, speed, t.*did you mean 'speed'"
    ):
        compile_law(Expression.parse("2*sped"), ("t",), ["k"], [], [1.0], sensors={"speed": 0})


def test_a_table_that_is_not_there():
    formula = Expression.parse("2*curve(t)", ["curve"])
    assert formula.tables == {"curve"}
    assert formula.names == {"t"}
    for use in (lambda: formula.evaluate({"t": 1.0}), lambda: compile_law(formula, ("t",), [], [], [])):
        with pytest.raises(ExpressionError, match="there is no table 'curve'; add the Table"):
            use()


def test_functions_with_complex_numbers():
    """Plain Python hands them to the function; compiled code for numbers has no derivative to offer and says nan."""
    code, functions = [], []
    law = law_expression(lambda t, speed: t * speed**2, "N", "x")
    at, depth = compile_law(law, ("t",), [], code, [], sensors={"speed": 0}, functions=functions)
    stack, sensed = np.zeros((depth + STACK_RESERVE, 3), complex), np.full((3, 1), 0.5 + 1j * H)
    args = np.array(code), np.zeros(1, complex), at, stack, (0.3 + 0j,), sensed
    assert evaluate(*args) == pytest.approx(0.075 + 0.3j * H)
    assert np.isnan(compiled_value(*args))
    assert np.isnan(evaluate_jet(*args[:4], 0.3, sensed, BY_MOTION)).all()  # derivatives must not be taken for known
