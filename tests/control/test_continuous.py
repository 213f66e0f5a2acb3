"""Continuous controllers against the ``control`` library, closed forms, and a second integration."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import flyball as fb
from tests.control.slide import TIGHT, slide

KP, KI, KD, TF = 80.0, 60.0, 12.0, 0.02
LOWER, UPPER = -4.0, 12.0


def pid(**fields):
    given = {"setpoint": "1", "measured": "A.displacement", "kp": KP, "ki": KI, "kd": KD, "filter": TF}
    return fb.PID("pid", **(given | fields))


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_step_response_of_a_pid_is_that_of_the_control_library(coordinates):
    ct = pytest.importorskip("control")
    r = slide(pid()).simulate(3, outputs=61, coordinates=coordinates, **TIGHT)
    s = ct.tf("s")
    P, C, D = 1 / (s**2 + 2 * s + 10), KP + KI / s, KD * s / (1 + TF * s)
    _, y = ct.step_response(ct.ss(ct.minreal(P * C / (1 + P * (C + D)), verbose=False)), r.t)
    assert np.abs(y - r["A.displacement"]).max() < 1e-9
    p = r["pid"]
    assert np.allclose(p.output, p.proportional + p.integral + p.derivative, rtol=0, atol=1e-12)
    assert np.array_equal(p.error, 1 - r["A.displacement"])
    assert np.allclose(r["drive.force"], p.output, rtol=0, atol=1e-12)


def plant(t, y, windup):
    """The slide with a limited PID, as an equation: (x, v, I, slow)."""
    x, v, integral, slow = y
    e = 1 - x
    u = KP * e + integral + KD / TF * (-x - slow)
    limited = min(max(u, LOWER), UPPER)
    rate = KI * e
    if windup == "back-calculation":
        rate += (limited - u) / np.sqrt(KD / KI)
    if windup == "clamping" and ((u > UPPER and e > 0) or (u < LOWER and e < 0)):
        rate = 0.0
    return [v, limited - 10 * x - 2 * v, rate, (-x - slow) / TF]


def pieces(windup, t_end):
    """The same integrated from corner to corner: the state at the end."""

    def beyond(t, y):
        return KP * (1 - y[0]) + y[2] + KD / TF * (-y[0] - y[3])

    def over(t, y):
        return beyond(t, y) - UPPER

    def under(t, y):
        return beyond(t, y) - LOWER

    def turns(t, y):
        return 1 - y[0]

    corners = (over, under, turns)
    for f in corners:
        f.terminal = True
    t, y = 0.0, np.zeros(4)
    while t < t_end:
        shift = 1e-9  # an event is not found again where it just was
        on = solve_ivp(plant, (t, t + shift), y, args=(windup,), rtol=1e-12, atol=1e-13)
        wrapped = [lambda t, y, w, f=f: f(t, y) for f in corners]
        for w in wrapped:
            w.terminal = True
        s = solve_ivp(
            plant,
            (t + shift, t_end),
            on.y[:, -1],
            args=(windup,),
            events=wrapped,
            rtol=1e-12,
            atol=1e-13,
            method="DOP853",
        )
        t, y = s.t[-1], s.y[:, -1]
    return y


@pytest.mark.parametrize("windup", ["back-calculation", "clamping", "none"])
def test_limited_pid_is_integrated_from_corner_to_corner(windup):
    r = slide(pid(lower=LOWER, upper=UPPER, anti_windup=windup)).simulate(1.5, outputs=4, **TIGHT)
    found = r["A.displacement"][-1], r["A.displacement_rate"][-1], r["pid.integral"][-1], r["pid.slow"][-1]
    assert np.abs(np.array(found) - pieces(windup, 1.5)).max() < 1e-8
    assert r["pid.output"].max() <= UPPER
    assert r["pid.output"][0] == UPPER


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_clamping_at_either_limit(side):
    """With e = +-t, kp = 1 and ki = 2 the sum t + t^2 is at the limit 3 at t1 = (sqrt(13) - 1) / 2: I stays +-t1^2.

    An integral of +-10 with e = -+1 is 9 beyond the limit and on its way back: it goes on, I = +-(10 - 2 t).
    """
    given = {"kp": 1, "ki": 2, "lower": -3, "upper": 3, "anti_windup": "clamping"}
    m = slide(
        fb.PID("out", setpoint=f"{side}*t", measured="0", **given),
        fb.PID("back", setpoint=f"{-side}", measured="0", initial=10 * side, **given),
        force="0*(out + back)",
    )
    r = m.simulate(2, outputs=5, **TIGHT)
    still = (13**0.5 - 1) / 2
    assert np.abs(r["out.integral"] - side * np.minimum(r.t, still) ** 2).max() < 1e-9
    assert np.abs(r["back.integral"] - side * (10 - 2 * r.t)).max() < 1e-9
    assert r["out"].output[-1] == r["back"].output[-1] == 3 * side


def test_anti_windup_overshoots_less():
    top = {
        w: slide(pid(ki=400, lower=LOWER, upper=UPPER, anti_windup=w)).simulate(3, outputs=301)["A.displacement"].max()
        for w in ("none", "clamping", "back-calculation")
    }
    assert top["none"] > top["clamping"] + 0.01
    assert top["none"] > top["back-calculation"] + 0.01


@pytest.mark.parametrize(
    ("num", "den", "response"),
    [
        ([2, 3], [4, 2], lambda t: 1.5 - np.exp(-t / 2)),  # 1/2 + 1 / (2 s + 1)
        ([2, 6, 10], [2, 6, 4], lambda t: 2.5 - 3 * np.exp(-t) + 1.5 * np.exp(-2 * t)),  # 1 + 3 / ((s + 1) (s + 2))
    ],
)
def test_a_transfer_function_that_passes_its_input_on_at_once(num, den, response):
    """The state space of a transfer function of equal orders, by partial fractions."""
    K = fb.StateSpace.from_control("K", SimpleNamespace(num=[[num]], den=[[den]], dt=0), inputs=["1"])
    r = slide(K, force="0*K").simulate(3, outputs=7, **TIGHT)
    assert np.abs(r["K.output"] - response(r.t)).max() < 1e-9


def test_linear_controllers_are_exponentials():
    """A lag, a lead-lag, an integrator, a transfer function and a state space, all of them driven by a lag of 1."""
    A = np.array([[-1.0, 2.0], [-3.0, -0.5]])
    m = slide(
        fb.Lag("one", of="1", time=0.4),
        fb.Lag("lead", of="one", time=0.1, lead=0.3, gain=2, initial=0.25),
        fb.Integrator("sum", of="one", gain=3, initial=-1),
        fb.Transfer("filter", of="one", num=[1, 0, 3], den=[2, 1, 5]),
        fb.StateSpace("K", inputs=["one", "2*t"], A=A, B=[[1, 0], [0, 1]], C=[[1, 1], [0, 2]], D=[[0, 0], [1, 0]]),
        fb.State("x", rate="one*x - x/0.7", initial=1),
        force="0.0*(lead + sum + filter + K.output2 + x)",
    )
    r = m.simulate(1.2, outputs=5, **TIGHT)
    t = r.t
    e = 1 - np.exp(-t / 0.4)
    assert np.abs(r["one"].output - e).max() < 1e-10
    # x' = (e - x)/0.1, x(0) = 0.25: a constant, exp(-t/0.4) and exp(-t/0.1)
    c = -1 / (1 - 0.1 / 0.4)
    x = 1 + c * np.exp(-t / 0.4) + (0.25 - 1 - c) * np.exp(-t / 0.1)
    assert np.abs(r["lead"].output - 2 * (x + 3 * (e - x))).max() < 1e-9
    assert np.abs(r["sum"].output - (-1 + 3 * (t - 0.4 * e))).max() < 1e-9
    assert np.abs(r["x"].output - np.exp(t - 0.4 * e - t / 0.7)).max() < 1e-9
    # all of K with its inputs as an autonomous linear system (x1, x2, exp(-t/0.4), 1, t)
    big = np.zeros((5, 5))
    big[:2, :2], big[0, 2:4], big[1, 4] = A, (-1, 1), 2.0
    big[2, 2], big[4, 3] = -1 / 0.4, 1.0
    z = np.array([expm(big * s) @ [0, 0, 1, 1, 0] for s in t])
    assert np.abs(r["K.output1"] - z[:, 0] - z[:, 1]).max() < 1e-9
    assert np.abs(r["K.output2"] - 2 * z[:, 1] - e).max() < 1e-9
    ct = pytest.importorskip("control")
    s = ct.tf("s")
    G = ct.ss((s**2 + 3) / (2 * s**2 + s + 5) / (0.4 * s + 1))
    assert np.abs(r["filter"].output - ct.step_response(G, t)[1]).max() < 1e-9


def test_systems_of_the_control_library():
    ct = pytest.importorskip("control")
    s = ct.tf("s")
    G = (s + 2) / (s**2 + 3 * s + 1)
    m = slide(
        fb.StateSpace.from_control("a", G, inputs=["1"]),
        fb.StateSpace.from_control("b", ct.ss(G), inputs="1"),
        fb.StateSpace.from_control("gain", ct.ss([], [], [], [[2.0, 1.0]]), inputs=["a", "b"]),
        force="0.0*gain",
    )
    r = m.simulate(2, outputs=9, **TIGHT)
    y = ct.step_response(ct.ss(G), r.t)[1]
    assert np.abs(r["a"].output - y).max() < 1e-9
    assert np.abs(r["b"].output - y).max() < 1e-9
    assert np.abs(r["gain"].output - 3 * y).max() < 1e-9
    with pytest.raises(fb.ModelError, match="dict is no linear system"):
        fb.StateSpace.from_control("c", {}, inputs=["1"])


def test_a_derivative_that_knows_what_was_before_does_not_kick():
    """The slide begins drawn out by 0.3: what was measured before says whether that is a jump."""
    for period in (None, 0.01):
        first = {}
        for known in (0.0, 0.3):
            m = slide(pid(kp=0.0, ki=0.0, setpoint="0", initial_measured=known, period=period))
            m.add(fb.Initial("A.displacement", value=0.3))
            first[known] = m.simulate(0.005, outputs=2)["pid.output"][0]
        assert first[0.3] == 0.0
        assert first[0.0] == pytest.approx(-0.3 * KD / (TF + (period or 0.0)))


def test_two_that_need_each_other(tmp_path):
    """A circle: x' = y, y' = -x; a file may hold them too."""
    m = slide(fb.State("x", rate="y", initial=1), fb.State("y", rate="-x"), force="0.0*x")
    r = m.simulate(6, outputs=7, **TIGHT)
    assert np.abs(r["x"].output - np.cos(r.t)).max() < 1e-9
    assert np.abs(r["y"].output + np.sin(r.t)).max() < 1e-9
    m.save(tmp_path / "m.toml")
    assert fb.load(tmp_path / "m.toml") == m
    (tmp_path / "m.toml").write_text((tmp_path / "m.toml").read_text().replace('rate = "-x"', 'rate = "-z"'))
    with pytest.raises(fb.ModelError, match="unknown name"):
        fb.load(tmp_path / "m.toml")


def test_events_watch_what_controllers_say():
    m = slide(fb.Lag("one", of="1", time=0.5), force="0.0*one")
    m.add(fb.Event("half", "one - 0.5", do=fb.Note("there")), fb.Event("late", "one.value > 0.75", do=fb.Stop()))
    r = m.simulate(3)
    assert [e.t for e in r.events] == pytest.approx([0.5 * np.log(2), 0.5 * np.log(4)], abs=1e-8)


def test_gains_are_parameters_that_events_set():
    m = slide(fb.Integrator("sum", of="1", gain="k"), force="0.0*sum", k=2.0)
    m.add(fb.Event("more", "t - 0.5", do=fb.Set("k", 5)))
    r = m.simulate(1, outputs=11)
    assert np.abs(r["sum"].output - np.where(r.t < 0.5, 2 * r.t, 1 + 5 * (r.t - 0.5))).max() < 1e-12
    assert slide(fb.Integrator("sum", of="1", gain="k"), force="sum", k=2.0).simulate(1, parameters={"k": 3.0})[
        "sum.output"
    ][-1] == pytest.approx(3.0, abs=1e-12)


def test_driven_mechanisms_integrate_their_controllers():
    m = fb.Mechanism("driven", planar=True)
    m.add(fb.Body("cart", mass=1.0, inertia=1.0))
    m.add(fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("move", "A.displacement", "sin(3*t)"))
    m.add(fb.Integrator("way", of="A.displacement"))
    r = m.simulate(2, outputs=9, rtol=1e-10)
    assert np.abs(r["way"].output - (1 - np.cos(3 * r.t)) / 3).max() < 1e-8


def test_going_on_and_files(tmp_path):
    m = slide(pid(lower=LOWER, upper=UPPER), fb.Lag("slow", of="pid.error", time=0.3))
    whole = m.simulate(2, outputs=5)
    first = m.simulate(0.7, outputs=3)
    rest = m.simulate(2, outputs=3, start=first)
    for name in ("A.displacement", "pid.integral", "pid.slow", "slow.output"):
        assert rest[name][-1] == pytest.approx(whole[name][-1], abs=1e-6)
    whole.save(tmp_path / "run.nc")
    again = fb.load_result(tmp_path / "run.nc")
    assert np.array_equal(again["pid"].output, whole["pid"].output)
    m.save(tmp_path / "m.toml")
    assert fb.load(tmp_path / "m.toml") == m
    assert "pid.output" in whole.to_dataframe().columns
    assert "pid" in str(m)


def test_more_accurate_where_asked():
    """States of controllers are in the control of the step: the mechanism itself hardly moves."""
    m = slide(fb.State("x", rate="200*cos(200*t)"), force="0.0*x")
    for rtol in (1e-5, 1e-8):
        r = m.simulate(1, outputs=201, rtol=rtol)
        assert np.abs(r["x"].output - np.sin(200 * r.t)).max() < 100 * rtol


def test_outputs_of_systems_keep_their_names():
    ct = pytest.importorskip("control")
    one = ct.ss([[-1.0]], [[1.0]], [[2.0]], [[0.0]], outputs=["A speed"])
    two = ct.ss([[-1.0]], [[1.0]], [[2.0], [3.0]], [[0.0], [0.0]], outputs=["fast", "slow"])
    bare = ct.ss([[-1.0]], [[1.0]], [[2.0]], [[0.0]])
    m = slide(
        fb.StateSpace.from_control("K", one, inputs=["1"]),
        fb.StateSpace.from_control("L", two, inputs=["1"]),
        fb.StateSpace.from_control("M", two, inputs=["1"], outputs=["p", "q"]),
        fb.StateSpace.from_control("N", bare, inputs=["1"]),
        force="K + L.slow + N",
    )
    run = m.simulate(1.0, outputs=5)
    exact = 1.0 - np.exp(-run.t)
    for name, factor in (
        ("K.A_speed", 2),
        ("L.fast", 2),
        ("L.slow", 3),
        ("M.q", 3),
        ("N.output", 2),
        ("drive.force", 7),
    ):
        assert run[name] == pytest.approx(factor * exact, abs=1e-6)
    linear = m.linearize(["drive"], ["K", "A.displacement"], about=m.equilibrium())
    assert linear.C[0][linear.states.index("K.x")] == pytest.approx(2.0)
    with pytest.raises(fb.ModelError, match=r"has several outputs; name one: L\.fast, L\.slow"):
        slide(fb.StateSpace.from_control("L", two, inputs=["1"]), force="L")


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_an_integral_is_held_at_zero_by_a_law_of_its_own_sign(coordinates):
    """c' = -sign(c) + sin(t) / 2: c = 0.3 - t + (1 - cos(t)) / 2 down to zero, where it stays; it is a force on 1 kg."""
    m = fb.Mechanism("held", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1.0, inertia=1.0), fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Integrator("c", of="-sign(c.output) + 0.5*sin(t)", initial=0.3))
    m.add(fb.PointForce("f", "b", force=("c.output", 0)))
    end = brentq(lambda t: 0.3 - t + 0.5 * (1 - np.cos(t)), 0.0, 1.0)
    r = m.simulate(2.0, outputs=21, coordinates=coordinates, rtol=1e-10, atol=1e-12)
    t = np.minimum(r.t, end)
    assert r["c"].output == pytest.approx(np.where(r.t < end, 0.3 - t + 0.5 * (1 - np.cos(t)), 0.0), abs=1e-9)
    assert r["b.vx"] == pytest.approx(0.8 * t - 0.5 * t**2 - 0.5 * np.sin(t), abs=1e-9)
