"""Sampled controllers against their exact discrete solutions: between instants the slide is a matrix exponential."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import cont2discrete

import flyball as fb
from tests.control.slide import TIGHT, slide

T = 0.01
PLANT = np.array([[0.0, 1.0], [-10.0, -2.0]]), np.array([[0.0], [1.0]])
Ad, Bd, *_ = cont2discrete((*PLANT, np.eye(2), np.zeros((2, 1))), T)
AGREED = 1e-10


def simulated(m, n, **options):
    """Positions, velocities and the result at n instants."""
    r = m.simulate((n - 0.5) * T, outputs=T * np.arange(n), **(TIGHT | options))
    return r["A.displacement"], r["A.displacement_rate"], r


def stepped(n, law, *state):
    """Positions, velocities and forces of the slide at n instants; ``law(k, x, state)``: force, and the next state."""
    x, out = np.zeros(2), []
    for k in range(n):
        u, state = law(k, x, state)
        out.append((*x, u))
        x = Ad @ x + Bd[:, 0] * u
    return np.array(out).T


KP, KI, KD, TF = 80.0, 60.0, 12.0, 0.02
TT = np.sqrt(KD / KI)


def pid_law(lower=-np.inf, upper=np.inf, reference=lambda k: 1.0):
    """Integral by Euler's rule, derivative by backward differences, back-calculation."""

    def law(k, x, state):
        integral, before, last = state
        e = reference(k) - x[0]
        d = TF / (TF + T) * before + KD / (TF + T) * (-x[0] - last)
        u = KP * e + integral + d
        limited = min(max(u, lower), upper)
        return limited, (integral + T * (KI * e + (limited - u) / TT), d, -x[0])

    return law


def pid(**fields):
    given = {"setpoint": "1", "measured": "A.displacement", "kp": KP, "ki": KI, "kd": KD, "filter": TF, "period": T}
    return fb.PID("pid", **(given | fields))


@pytest.mark.parametrize("watched", [False, True])
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_pid(watched, coordinates):
    m = slide(pid())
    if watched:  # the other loop: from event to event
        m.add(fb.Event("never", "A.displacement - 5"))
    x, v, r = simulated(m, 150, coordinates=coordinates)
    a, b, u = stepped(150, pid_law(), 0.0, 0.0, 0.0)
    assert max(np.abs(x - a).max(), np.abs(v - b).max(), np.abs(r["pid"].output - u).max()) < AGREED
    assert np.abs(r["pid.error"] - (1 - a)).max() < AGREED


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_short_intervals_take_fewer_evaluations_and_are_as_good(coordinates):
    """At 1 kHz, by the usual tolerance: half the stages of order 8; the same as the exact discrete solution."""
    period, n = 1e-3, 2000
    Ak, Bk, *_ = cont2discrete((*PLANT, np.eye(2), np.zeros((2, 1))), period)
    x, exact = np.zeros(2), []
    for _ in range(n):
        exact.append(x)
        x = Ak @ x + Bk[:, 0] * (KP * (1.0 - x[0]) - KD * x[1])
    law = f"{KP}*(1 - A.displacement) - {KD}*A.displacement_rate"
    m = slide(fb.Transfer("u", of=law, num=[1], den=[1], period=period), force="u")
    at = {"t_end": (n - 0.5) * period, "outputs": period * np.arange(n), "coordinates": coordinates}
    r = m.simulate(**at)
    found = np.stack([r["A.displacement"], r["A.displacement_rate"]], axis=1)
    assert np.abs(found - exact).max() < 1e-10
    assert r.health.evaluations < 0.75 * m.simulate(method="dop853", **at).health.evaluations


def test_intervals_that_are_not_short_stay_within_the_tolerance():
    """From much shorter than a step to much longer: every error is one that steps of order 8 may have."""
    for period in (2e-3, 0.02, 0.05, 0.2, 0.5):
        n = round(10.0 / period)
        Ak, Bk, *_ = cont2discrete((*PLANT, np.eye(2), np.zeros((2, 1))), period)
        x, exact = np.zeros(2), []
        for _ in range(n):
            exact.append(x[0])
            x = Ak @ x + Bk[:, 0] * (5.0 * (1.0 - x[0]))
        m = slide(fb.Transfer("u", of="5*(1 - A.displacement)", num=[1], den=[1], period=period), force="u")
        for rtol in (1e-5, 1e-8):
            at = {"t_end": (n - 0.5) * period, "outputs": period * np.arange(n), "rtol": rtol, "atol": 0.1 * rtol}
            off = np.abs(m.simulate(**at)["A.displacement"] - exact).max()
            assert off < rtol, (period, rtol, off)


@pytest.mark.parametrize("watched", [False, True])
def test_limits_and_a_set_point_that_jumps_at_an_instant(watched):
    m = slide(pid(setpoint="where(t < 0.5, 1, -0.5)", lower=-4, upper=12))
    if watched:
        m.add(fb.Event("never", "A.displacement - 5"))
    x, v, r = simulated(m, 120)
    a, b, u = stepped(120, pid_law(-4, 12, lambda k: 1.0 if k < 50 else -0.5), 0.0, 0.0, 0.0)
    assert max(np.abs(x - a).max(), np.abs(v - b).max(), np.abs(r["pid"].output - u).max()) < AGREED
    assert u.min() == -4 and u.max() == 12


@pytest.mark.parametrize("periods", [0.1, 1.0, 10.0])
def test_back_calculation_takes_back_no_more_than_there_is_at_an_instant(periods):
    """With e = kp = 1, ki = 2 and the limit 1/2: I+ = I + 2 T + (1/2 - 1 - I) T / max(T, tracking).

    A tracking time up to the period ends at I* = 2 T - 1/2 at once; n periods go there by 1 - 1/n at each instant.
    """
    m = slide(
        fb.PID("pid", setpoint="1", measured="0", kp=1, ki=2, upper=0.5, tracking=periods * T, period=T), force="0*pid"
    )
    r = simulated(m, 30)[2]
    n, k = max(1.0, periods), np.arange(30)
    assert np.abs(r["pid.unlimited"] - 1 - (2 * T * n - 0.5) * (1 - (1 - 1 / n) ** k)).max() < 1e-12


def test_state_space_with_an_observer_of_the_control_library():
    """A deadbeat-like state feedback on an observed state, as a discrete `control.StateSpace`."""
    ct = pytest.importorskip("control")
    L = ct.place(Ad.T, np.array([[1.0], [0.0]]), [0.5, 0.6]).T
    K = ct.place(Ad, Bd, [0.8, 0.85])
    C = np.array([[1.0, 0.0]])
    A = Ad - Bd @ K - L @ C
    system = ct.ss(A, L, -K, 0, T)
    m = slide(fb.StateSpace.from_control("K", system, inputs=["A.displacement - 0.3"]), force="K")
    x, v, r = simulated(m, 100)

    def law(k, x, state):
        (z,) = state
        return (-K @ z)[0], (A @ z + L[:, 0] * (x[0] - 0.3),)

    a, b, u = stepped(100, law, np.zeros(2))
    assert max(np.abs(x - a).max(), np.abs(v - b).max(), np.abs(r["K.output"] - u).max()) < AGREED
    assert np.abs(u).max() > 0.1


def test_other_kinds():
    """Lag and Integrator are exact for held inputs; a transfer function of z; a State that takes its next value."""
    ct = pytest.importorskip("control")
    m = slide(
        fb.State("count", next="count + 1", initial=-1, period=T),
        fb.Lag("lag", of="1", time=0.05, gain=2, period=T),
        fb.Integrator("sum", of="count", period=T),
        fb.Transfer("filter", of="1", num=[1, 0.5], den=[1, -0.7, 0.3], period=T),
        fb.State("even", next="0.6*even - 0.8*odd", initial=1, period=T),
        fb.State("odd", next="0.8*even + 0.6*odd", period=T),
        force="0.0*(lag + filter + sum + even)",
    )
    _, _, r = simulated(m, 30)
    k = np.arange(30)
    assert np.array_equal(r["count"].output, k)
    assert np.abs(r["lag"].output - 2 * (1 - np.exp(-k * T / 0.05))).max() < 1e-12
    assert np.abs(r["sum"].output - T * (k * (k - 1) / 2 - k)).max() < 1e-12  # it sees the count of before
    assert np.abs(r["filter"].output - ct.step_response(ct.tf([1, 0.5], [1, -0.7, 0.3], T), T * k)[1]).max() < 1e-12
    angle = np.arctan2(0.8, 0.6) * (k + 1)
    assert np.abs(r["even"].output - np.cos(angle)).max() < 1e-12
    assert np.abs(r["odd"].output - np.sin(angle)).max() < 1e-12


def test_several_rates_and_offsets_one_after_the_other():
    """The outer loop every 4 T, the inner every T, a third between the instants; at one instant the outer comes first."""
    m = slide(
        fb.StateSpace("inner", inputs=["outer - A.displacement"], D=50, period=T),
        fb.StateSpace("outer", inputs=["1 - A.displacement"], D=0.5, period=4 * T),
        fb.StateSpace("late", inputs=["inner"], D=1, period=T, offset=T / 2),
        force="inner + 0.0*late",
    )
    x, _, r = simulated(m, 60)

    def law(k, x, state):
        (held,) = state
        held = 0.5 * (1 - x[0]) if k % 4 == 0 else held
        return 50 * (held - x[0]), (held,)

    a, _, u = stepped(60, law, 0.0)
    assert np.abs(x - a).max() < AGREED
    assert np.abs(r["inner.output"] - u).max() < AGREED
    assert np.abs(r["late.output"][1:] - u[:-1]).max() < AGREED  # at instant k it holds what was between the two
    assert r["late.output"][0] == 0.0


def test_going_on_at_an_instant_samples_once():
    m = slide(pid(), fb.State("count", next="count + 1", period=T))
    whole = m.simulate(0.305, outputs=2, **TIGHT)
    for seam in (0.1, 0.153):
        first = m.simulate(seam, outputs=2, **TIGHT)
        rest = m.simulate(0.305, outputs=2, start=first, **TIGHT)
        assert rest["count.output"][-1] == whole["count.output"][-1] == 31
        assert rest["A.displacement"][-1] == pytest.approx(whole["A.displacement"][-1], abs=1e-10)


def test_a_jump_of_the_output_sets_free_what_sticks():
    """A block that friction holds, until the held force exceeds it at an instant: m v' = u - mu m g from then on."""
    m = fb.Mechanism("block", planar=True, gravity=(0, -10))
    m.add(fb.Body("block", mass=2.0, inertia=1.0))
    m.add(fb.Prismatic("A", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.JointFriction("dry", joint="A", static=0.5))
    m.add(fb.State("u", next="u + 1", period=0.1))
    m.add(fb.Actuator("push", coordinate="A.displacement", force="u"))
    r = m.simulate(1.15, outputs=[0, 1.0, 1.1, 1.15])
    assert r["u.output"].tolist() == [1, 11, 12, 12]
    assert r["A.displacement_rate"] == pytest.approx([0, 0, 0.05, 0.05 + 0.05], abs=1e-9)


def test_an_event_sees_a_held_signal_jump():
    m = slide(fb.State("u", next="u + 1", period=0.1), force="0.0*u")
    m.add(fb.Event("four", "u - 3.5", do=fb.Stop()))
    r = m.simulate(1)
    assert r.t[-1] == pytest.approx(0.3, abs=1e-12)


def test_periods_are_parameters():
    m = slide(fb.State("count", next="count + 1", period="T"), force="0.0*count", T=0.1)
    assert m.simulate(1.06, parameters={"T": 0.05})["count.output"][-1] == 22
    assert m.simulate(1.06)["count.output"][-1] == 11


def test_an_event_sets_a_period():
    """From then on it acts at multiples of the new one, to the end of the motion."""
    m = slide(fb.State("count", next="count + 1", period="T"), force="0.0*count", T=0.1)
    m.add(fb.Event("faster", "t - 0.52", do=fb.Set("T", 0.05)))
    r = m.simulate(1, outputs=[0.5, 0.54, 0.55, 0.6, 0.99])
    assert r["count.output"].tolist() == [6, 6, 7, 8, 15]
    m.replace(fb.Event("faster", "t - 0.52", do=fb.Set("T", 0.0)))
    with pytest.raises(fb.SimulationError, match="period is 0 s; it must be greater than 0"):
        m.simulate(1)


def test_an_instant_and_a_time_of_output_that_rounding_parts_are_one():
    """51 * 0.1 is a unit in the last place behind 5.1: the row there is that of what is held from then on."""
    for more in ([], [fb.Event("never", "A.displacement - 5")]):
        m = slide(fb.State("count", next="count + 1", period=0.1), force="0.0*count")
        m.add(*more)
        r = m.simulate(6, t_start=5.0, outputs=11)
        assert r["count.output"].tolist() == [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 10]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: fb.Lag("a", of="1", time=1, offset=0.1), "offset does nothing without period"),
        (lambda: fb.Lag("a", of="1", time=1, period=0), "period is 0"),
        (lambda: fb.State("a", rate="1", period=1), "with a period give next="),
        (lambda: fb.StateSpace("a", inputs=["a"], D=2, period=1), r"a\.output -> a\.output"),
    ],
)
def test_refused(make, said):
    with pytest.raises(fb.ModelError, match=said):
        slide(make(), force="a")
    ct = pytest.importorskip("control")
    with pytest.raises(fb.ModelError, match="discrete without a period"):
        fb.StateSpace.from_control("b", ct.ss([[0.5]], [[1]], [[1]], [[0]], True), inputs="1")
    with pytest.raises(fb.ModelError, match="the system is continuous; sample it"):
        fb.StateSpace.from_control("b", ct.ss([[0.5]], [[1]], [[1]], [[0]]), inputs="1", period=T)
    with pytest.raises(fb.ModelError, match=r"own period is 0\.1 s, and period=0\.2 is given"):
        fb.StateSpace.from_control("b", ct.ss([[0.5]], [[1]], [[1]], [[0]], 0.1), inputs="1", period=0.2)


@pytest.mark.parametrize(("slow", "fast"), [(3, 1), (1, 1), (1, 3)])
def test_a_state_read_at_the_instant_at_which_it_steps_is_what_it_was(slow, fast):
    """All step at once; a signal that is said by D is known at once."""
    m = slide(
        fb.State("count", next="count + 1", period=slow * T),
        fb.State("seen", next="count", period=fast * T),
        fb.StateSpace("held", inputs=["count"], D=1, period=fast * T),
        fb.StateSpace("now", inputs=["t"], D=1, period=slow * T),
        fb.StateSpace("after", inputs=["now"], D=1, period=fast * T),
        force="0*held",
    )
    t = T * (np.arange(12) + 0.5)
    r = m.simulate(12 * T, outputs=np.r_[0.0, t])
    at = fast * (np.arange(12) // fast)  # the last instant of the reader
    before = -(-at // slow)  # how often it had stepped before
    assert (r["count.output"][1:] == np.arange(12) // slow + 1).all()
    assert (r["seen.output"][1:] == before).all()
    assert (r["held.output"][1:] == before).all()
    assert r["after.output"][1:] == pytest.approx(T * slow * (at // slow))
