"""What controllers cannot be, and who does not know them: refused by name."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

import flyball as fb
from tests.control.slide import slide


def test_rings_in_a_file_are_named_at_their_line(tmp_path):
    m = slide(fb.Lag("a", of="b", time=1), fb.Lag("b", of="a*a", time=1), force="a")
    m.save(tmp_path / "m.toml")
    text = (tmp_path / "m.toml").read_text().replace("time = 1.0", "time = 1.0\nlead = 0.5")
    (tmp_path / "m.toml").write_text(text)
    with pytest.raises(fb.ModelError, match=r"m\.toml: \[\[controllers\]\] 2 'b' \(line \d+\): Lag 'b'.*b\.output -> "):
        fb.load(tmp_path / "m.toml")


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"kp": 1, "filter": 0.1}, "filter does nothing without kd"),
        ({"kd": 1}, "a derivative needs a filter"),
        ({"kp": 1, "anti_windup": "clamping"}, "anti_windup does nothing without limits and ki"),
        ({"kp": 1, "ki": 1, "lower": 0, "anti_windup": "clamping", "tracking": 1}, "tracking does nothing without"),
        ({"kp": 1, "lower": 2, "upper": 1}, "lower must be less"),
        ({"kp": 1, "initial": 1}, "initial does nothing without ki"),
        ({"kp": 1, "initial_measured": 1}, "initial_measured does nothing without kd"),
        ({"ki": 1, "lower": 0}, "give tracking"),
        ({}, "it has no gains"),
        ({"kd": 1, "filter": 0}, "it must be greater than 0"),
    ],
)
def test_fields_of_a_pid(fields, said):
    with pytest.raises(fb.ModelError, match=said):
        slide(fb.PID("pid", setpoint="1", measured="A.displacement", **fields))


def test_names():
    lag = fb.Lag("lag", of="1", time=1)
    with pytest.raises(fb.ModelError, match=r"Lag 'lag' has no signal 'out'.*; it has output, input, value"):
        slide(lag, force="lag.out")
    two = fb.StateSpace("K", inputs=["1"], D=[[1], [2]])
    with pytest.raises(fb.ModelError, match=r"has several outputs; name one: K\.output1, K\.output2"):
        slide(two, force="K")
    with pytest.raises(fb.ModelError, match="unknown name 'lagg'"):
        slide(lag, force="lagg")
    with pytest.raises(fb.ModelError, match="laws use curves by sensors"):
        slide(lag, force="lag + A.displacement")
    with pytest.raises(fb.ModelError, match=r"'A\.reach' is no curve"):
        slide(fb.Lag("lag", of="A.reach", time=1))
    with pytest.raises(fb.ModelError, match="known only after the accelerations are"):
        slide(fb.Lag("lag", of="cart.ax", time=1))
    m = slide(lag, force="lag", k=1.0)
    with pytest.raises(fb.ModelError, match="a driver prescribes a motion"):
        m.add(fb.Driver("move", "A.displacement", "lag"))
    with pytest.raises(fb.ModelError, match="the name 'k' is a parameter's"):
        m.add(fb.Lag("k", of="1", time=1))
    with pytest.raises(fb.ModelError, match="D is 1 x 1; of 0 states, 2 inputs and 1 outputs it must be 1 x 2"):
        m.add(fb.StateSpace("K", inputs=["1", "t"], D=3))
    with pytest.raises(fb.ModelError, match="a transfer function that differentiates has no state-space form"):
        m.add(fb.Transfer("D", of="1", num=[1, 0], den=[1]))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("pi", "laws read 'pi' as the number 3.14159; rename it, 'lag_pi'"),
        ("e", "laws read 'e' as the number 2.71828"),
        ("sin", "laws read 'sin' as the function sin"),
        ("t", "the name 't' is reserved"),
        *((name, "laws name a controller by its name; use letters, digits and _") for name in ("2x", "my pid", "or")),
        ("\u00b5", "laws read '\u00b5' as '\u03bc', another letter"),
    ],
)
def test_names_that_laws_read_as_something_else(name, said):
    """A force "pi" was 3.14159 N beside a controller of that name, without a word."""
    with pytest.raises(fb.ModelError, match=said):
        slide(fb.Lag(name, of="1", time=1), force="0")


def test_names_that_laws_read_with_a_dot():
    """No constant has one; so bodies are free, and of sensors those that only results name."""
    m = slide(fb.Lag("lag", of="1", time=1), force="lag")
    m.add(fb.Body("pi", mass=1, inertia=1), fb.Body("post 0", mass=1, inertia=1))
    m.add(fb.Sensor("post 0 x", "post 0.x"), fb.Lag("far", of="pi.x + 1", time=1))
    assert m.simulate(0.1)["far.input"][0] == 1.0
    with pytest.raises(fb.ModelError, match="Sensor 'pi': laws read 'pi' as the number"):
        m.add(fb.Sensor("pi", "A.displacement"))
    with pytest.raises(fb.ModelError, match="'if' is no plain name for a signal"):
        m.add(fb.StateSpace("K", inputs=["t"], D=1, outputs=("if",)))


@pytest.mark.parametrize("x", [float("nan"), float("inf")])
def test_matrices_of_finite_numbers(x):
    with pytest.raises(
        fb.ModelError, match=f"row 2, column 2 of A of StateSpace 'K': the value is {x}, a finite number"
    ):
        slide(fb.StateSpace("K", inputs=["t"], A=[[0, 1], [0, x]], B=[[0], [1]], C=[[1, 0]]), force="K")


def test_values_of_parameters_that_make_no_sense():
    """Those of a single run are looked at as those of the model are."""
    m = slide(fb.Lag("lag", of="1", time="T"), fb.State("x", next="x", period="P"), force="lag + x", T=1.0, P=0.1)
    for name, value, said in (("T", -1.0, "Lag 'lag': time is -1 s"), ("P", 0.0, "State 'x': period is 0 s")):
        with pytest.raises(fb.ModelError, match=said):
            m.simulate(1, parameters={name: value})
    with pytest.raises(fb.ModelError, match="num has no coefficients"):
        m.add(fb.Transfer("none", of="1", num=[], den=[1, 1]))
    with pytest.raises(fb.ModelError, match="its matrices are complex"):
        fb.StateSpace.from_control("c", SimpleNamespace(A=[[1j]], B=[[1]], C=[[1]], D=[[0]]), inputs="1")


def test_friction_of_a_negative_coefficient_in_a_single_run():
    m = slide(fb.Lag("lag", of="1", time=1), force="lag", mu=0.1)
    m.add(fb.JointFriction("dry", joint="A", static="mu"))
    with pytest.raises(fb.ModelError, match="static is -1; it must be zero or greater"):
        m.simulate(1, parameters={"mu": -1.0})


@pytest.mark.parametrize(
    "ask",
    [
        lambda m: m.inverse_dynamics([0, 1]),
        lambda m: m.prepare(),
        lambda m: m.sensitivity(["A.displacement"], ["k"]),
        lambda m: m.simulate(1, method="variational", step=0.01),
        lambda m: m.simulate(1, method="impulse"),
    ],
)
def test_who_does_not_know_them_says_so(ask):
    m = slide(fb.Lag("lag", of="1", time=1), force="lag", k=1.0)
    with pytest.raises(fb.ModelError, match="Lag 'lag'"):
        ask(m)


def test_states_that_do_not_rest_are_called_what_they_are_called():
    """Not by the bodies that stand for them inside."""
    m = slide(
        fb.StateSpace("K", inputs=["A.displacement - 1"], A=[[-1, 0], [0, -2]], B=[[1], [2]], C=[[1, 1]]), force="K"
    )
    with pytest.raises(fb.AnalysisError, match=r"not in equilibrium.*: 'K\.x[12]' changes by -[12] in a second"):
        m.linearize()
    with pytest.raises(fb.NotConverged, match=r"'i\.value' changes by 1 in a second") as caught:
        slide(fb.Integrator("i", of="1"), force="i").equilibrium()
    assert caught.value.residuals["i.value"] == pytest.approx(1.0)
    assert set(caught.value.residuals) == {"i.value", "cart.x", "cart.y", "cart.angle"}
    with pytest.raises(fb.NotConverged, match=r"the next sample changes 'n\.value' by 1"):
        slide(fb.State("n", next="n + 1", period=0.1), force="0*n").equilibrium()
    m = slide(fb.State("K_x", rate="abs(K_x - 2e-4) - A.displacement + 0*t", initial=2e-4), force="K_x - 2e-4")
    with pytest.raises(
        fb.SingularityError, match=r"the law of 'K_x\.value': 'abs\(K_x - .*' has a kink at K_x\.value = 0\.0002\."
    ):
        m.linearize()


CROSSING = {
    "by time": ({"lower": "-1", "upper": "2 - t"}, {}, 3.0),
    "by the motion": ({"lower": "50*A.displacement - 1", "upper": "0.5"}, {}, None),
    "by a parameter": ({"lower": "a", "upper": 2.0}, {"parameters": {"a": 3.0}}, 0.0),
    "by an event": ({"lower": "b", "upper": "2"}, {}, 0.5),
}


@pytest.mark.parametrize("way", [{}, {"method": "radau"}, {"method": "generalised-alpha", "step": 0.01}], ids=str)
@pytest.mark.parametrize("period", [None, 0.01])
@pytest.mark.parametrize("case", CROSSING)
def test_limits_that_cross(case, period, way):
    """They gave the upper one, silently."""
    limits, more, t = CROSSING[case]
    pid = fb.PID("pid", setpoint="1", measured="A.displacement", kp=8, ki=6, tracking=1, period=period, **limits)
    m = slide(pid, a=1.0, b=1.0)
    m.add(fb.Event("later", "t - 0.5", do=fb.Set("b", 4)))
    with pytest.raises(
        fb.SimulationError, match=r"PID 'pid' has no output: its limits cross, lower is .* and upper"
    ) as e:
        m.simulate(4, outputs=5, **more, **way)
    if t is not None:
        assert e.value.t == pytest.approx(t, abs=0.0101)
    else:  # where the mechanism is at 0.03 m
        assert e.value.result.final[1][0] == pytest.approx(0.03, abs=3e-3)


def test_limits_that_cross_where_it_is_to_rest():
    pid = fb.PID("pid", setpoint="1", measured="A.displacement", kp=8, ki=6, tracking=1, lower="a", upper="b")
    m = slide(pid, a=1.0, b=20.0)
    assert m.equilibrium()["pid.output"] == pytest.approx(10.0)
    for ask in (m.equilibrium, m.linearize, m.modes):
        with pytest.raises(
            fb.AnalysisError, match="at t = 0 s, PID 'pid' has no output: its limits cross, lower is 30"
        ):
            ask(parameters={"a": 30.0})


@pytest.mark.parametrize("gains", [{}, {"ki": 10, "tracking": 1}])
def test_what_a_limited_controller_cannot_hold_is_told_with_and_without_states(gains):
    """3 N against 1 N at most: 2 N are left."""
    pid = fb.PID("pid", setpoint="0", measured="A.displacement", kp=100, lower=-1, upper=1, **gains)
    m = slide(pid, force="pid + 3").changed({"spring": None})
    with pytest.raises(fb.NotConverged, match=r"2 N push along cart\.x and nothing balances this"):
        m.equilibrium()


def test_units_of_limits_and_of_set_points_are_compared():
    def pid(**fields):
        return slide(fb.PID("pid", **{"setpoint": "20 cm", "measured": "A.displacement", "kp": 1, **fields}))

    with pytest.raises(fb.UnitError, match=r"PID 'pid': lower is '-2 kg'; '3 N'"):
        pid(lower="-2 kg", upper="3 N")
    with pytest.raises(fb.UnitError, match=r"setpoint of PID 'pid': '20 deg': expected a length"):
        pid(setpoint="20 deg")
    pid(lower="-2 kN", upper="3 N")
    pid(lower="-2", upper="3 N")
    pid(setpoint="20 deg", measured="57.3*A.displacement")  # what has no unit says nothing


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: fb.StateSpace("K", inputs=["t"], A=[["nan"]], B=[[1]], C=[[1]]), "row 1, column 1 of A of StateSpace 'K'"),
        (lambda: fb.StateSpace("K", inputs=["t"], D=[[1], [float("nan")]]), "row 2, column 1 of D of StateSpace 'K'"),
        (lambda: fb.StateSpace("K", inputs=["t", "q"], D=[[1, 1]]), "input 2 of StateSpace 'K': unknown name 'q'"),
    ],
)  # fmt: skip
def test_an_entry_of_a_matrix_is_named(made, said):
    with pytest.raises(fb.ModelError, match=said):
        slide(made(), force="K")


def test_outputs_of_one_name():
    """Of two outputs called alike there was one, the second; an output called as an input is took its place."""
    for names, said in ((("a", "a"), "'a'"), (("a", "input"), "'input'"), (("x", "b"), "'x'")):
        with pytest.raises(fb.ModelError, match=f"StateSpace 'K': two of its signals or states are called {said}"):
            slide(fb.StateSpace("K", inputs=["t"], A=-1, B=1, C=[[1], [2]], outputs=names), force="0")


@pytest.mark.parametrize(
    ("controller", "said"),
    [
        (fb.Lag("g", of="cart.ax", time=1), "^input of Lag 'g': 'cart.ax' is known only after"),
        (fb.Lag("g", of="1", time=1, gain="cart.ax"), "^gain of Lag 'g': 'cart.ax' is known only after"),
        (fb.StateSpace("g", inputs=["t", "cart.ax"], D=[[1, 1]]), "^input 2 of StateSpace 'g': 'cart.ax'"),
        (
            fb.StateSpace("g", inputs=["t", "t"], D=[[1, "nothing"]]),
            r"^row 1, column 2 of D of StateSpace 'g': unknown name",
        ),
        (fb.Transfer("g", of="1", num=[1], den=[]), "^Transfer 'g': den has no coefficients"),
        (fb.Transfer("g", of="1", num=[1], den=[0, 1]), "^Transfer 'g': the first coefficient of den is zero"),
    ],
)
def test_messages_name_what_was_written(controller, said):
    with pytest.raises(fb.FlyballError, match=said):
        slide(controller, force="0")
