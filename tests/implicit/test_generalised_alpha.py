"""Generalised-alpha on Lie groups: order 2 in everything, what it damps, what it takes, and index 3 for comparison."""

import numpy as np
import pytest

import flyball as fb
from tests.implicit.test_radau import errors, pendulum, windows
from tests.layers import both_layers
from tests.mechanisms import example, free_body, spatial_four_bar

ALPHA = "generalised-alpha"


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
@pytest.mark.parametrize("rho", [1.0, 0.8, 0.0])
def test_order_at_the_ends_of_steps_and_between_them(coordinates, rho):
    """Positions, velocities and reported reactions, against Jacobi's elliptic functions."""
    at_ends, between = [], []
    for n in (100, 200):
        for at, found in ((np.arange(1, 6) / 5, at_ends), (np.arange(5) / 5 + 0.374 / n, between)):
            r = pendulum().simulate(
                1.0, outputs=at, method=ALPHA, rho_inf=rho, step=1.0 / n, rtol=1e-12, coordinates=coordinates
            )
            found.append(errors(r))
    for found in (at_ends, between):
        assert (np.abs(np.log2(found[0] / found[1]) - 2.0) < 0.1).all()
    assert at_ends[1][0] < 5e-4


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_order_in_space_with_works(coordinates):
    """A loop in space with a motor: positions, velocities, reactions, the motor's work; quaternions of unit length."""
    m = spatial_four_bar()
    m.add(fb.Motor("motor", m.joints[0].name, torque="2 - 0.3*rate"))
    exact = m.simulate(0.4, outputs=[0.4], rtol=1e-12)
    found = []
    for step in (0.002, 0.001):
        r = m.simulate(0.4, outputs=[0.4], method=ALPHA, step=step, rtol=1e-12, coordinates=coordinates)
        found.append([
            max(np.abs(r[b.name].position - exact[b.name].position).max() for b in m.bodies),
            max(np.abs(r[b.name].velocity - exact[b.name].velocity).max() for b in m.bodies),
            max(np.abs(r[j.name].force - exact[j.name].force).max() for j in m.joints),
            np.abs(r["motor"].work - exact["motor"].work).max(),
        ])  # fmt: skip
        if coordinates == "absolute":
            turns = r.q.reshape(-1, 7)[:, 3:]
            assert np.abs(np.linalg.norm(turns, axis=1) - 1.0).max() < 1e-15
    assert (np.abs(np.log2(np.array(found[0]) / found[1]) - 2.0) < 0.15).all()


def oscillator(k):
    m = fb.Mechanism("o")
    m.add(fb.Body("x", mass=1.0, inertia=(1, 1, 1), velocity=(0.5, 0, 0)))
    m.add(fb.Bushing("s", "ground", "x", at=(0, 0, 0), stiffness=k))
    return m


def recursion(k, widths, rho):
    """Positions of m x'' = - k x by the formulas of Chung and Hulbert (1993), a being x'' at t + (am - af) h at first."""
    am, af = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    gamma = 0.5 - am + af
    beta = 0.25 * (gamma + 0.5) ** 2
    x, v = 0.0, 0.5
    true, last = -k * x, widths[0]
    a = true + (am - af) * last * (-k * v)
    out = [x]
    for h in widths:
        a = true + (a - true) * h / last  # at t + (am - af) h of another width, by the same rate
        # x1 = p + beta h^2 a1, (1 - am) a1 + am a = - (1 - af) k x1 + af x''
        p = x + h * v + (0.5 - beta) * h * h * a
        new = (-(1 - af) * k * p + af * true - am * a) / (1 - am + (1 - af) * k * beta * h * h)
        x = p + beta * h * h * new
        v += h * ((1 - gamma) * a + gamma * new)
        a, true, last = new, -k * x, h
        out.append(x)
    return np.array(out)


@pytest.mark.parametrize("rho", [1.0, 0.5, 0.0, 1, 0])
@pytest.mark.parametrize("k", [100.0, 1e10])
def test_steps_are_those_of_the_formulas(rho, k):
    """An oscillator that steps resolve, and one of a thousand periods a step: what of it is left after each is rho."""
    r = oscillator(k).simulate(0.5, outputs=51, method=ALPHA, rho_inf=rho, step=0.01, rtol=1e-10)
    expected = recursion(k, [0.01] * 50, rho)
    assert np.abs(r["x"].position[:, 0] - expected).max() < 1e-5 * np.abs(expected).max()
    if k > 1e9 and rho == 0.5:
        assert np.abs(r["x"].position[-1, 0]) < 1e-10 * np.abs(r["x"].position[:5, 0]).max()


@pytest.mark.parametrize("rho", [1.0, 0.5, 0.0])
def test_a_last_step_that_is_narrower(rho):
    r = oscillator(100.0).simulate(0.104, outputs=[0.104], method=ALPHA, rho_inf=rho, step=0.01, rtol=1e-13)
    assert r["x"].position[-1, 0] == pytest.approx(recursion(100.0, [0.01] * 10 + [0.004], rho)[-1], abs=1e-14)


@pytest.mark.parametrize("method", [ALPHA, "variational"])
@pytest.mark.parametrize("n", [10, 20])
def test_works_are_those_of_the_trapezoidal_rule(method, n):
    """A torque 6 t on 2 kg m^2: the rate 3 t^2 / 2 is exact, and the work 9 t^4 / 4 becomes 9 (1 + h^2) / 4 at 1 s."""
    m = fb.Mechanism("wheel", planar=True)
    m.add(fb.Body("b", mass=1.0, inertia=2.0), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.Motor("M", "A", torque="6*t"))
    r = m.simulate(1.0, outputs=[1.0], method=method, step=1.0 / n, rtol=1e-13)
    assert r["A"].rate[-1] == pytest.approx(1.5, rel=1e-13)
    assert r["M"].work[-1] == pytest.approx(2.25 * (1.0 + 1.0 / n**2), rel=1e-11)


@pytest.mark.parametrize("method", [ALPHA, "variational"])
@pytest.mark.parametrize("w", [10.0, 0.02])
def test_a_body_that_spins_about_a_fixed_axis_is_exact(method, w):
    """Increments are of the exponential map: at up to a tenth of a turn each step no error but rounding."""
    m = free_body(inertia=(1.0, 1.0, 2.0), w=(0.0, 0.0, w))
    r = m.simulate(5.0, outputs=6, method=method, step=0.05, rtol=1e-13)
    x = r[m.bodies[0].name].rotation[:, :, 0]
    assert np.abs(x - np.column_stack([np.cos(w * r.t), np.sin(w * r.t), 0 * r.t])).max() < 1e-11


@pytest.mark.parametrize("name", ["governor.toml", "chaplygin_sleigh.toml", "rolling_disk.toml", "heavy_top.toml"])
def test_motions_are_those_of_the_explicit_method(name):
    """Springs, drivers, rolling, knife edges, tops: the error falls by four where steps are halved."""
    m = example(name)
    e = m.simulate(0.5, outputs=2, rtol=1e-10)
    found = []
    for step in (0.0025, 0.00125):
        r = m.simulate(0.5, outputs=2, method=ALPHA, step=step, rtol=1e-10)
        found.append(max(np.abs(r[b.name].position - e[b.name].position).max() for b in m.bodies))
    assert np.log2(found[0] / found[1]) == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("double", [False, True])
def test_singular_positions_are_passed(double):
    m = windows(double)
    r = m.simulate(10.0, outputs=2, method=ALPHA, step=0.002, rtol=1e-9)
    assert r.health.energy_drift < 1e-4
    assert r.health.violation < 1e-12


@both_layers
def test_friction_with_a_stick_speed_and_laws_that_name_sensors():
    m = fb.Mechanism("f", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("x", mass=1, inertia=0.1, position=(1, 0)))
    m.add(fb.Revolute("h", "ground", "x", at=(0, 0)), fb.Sensor("turn", "h.angle"))
    m.add(fb.JointFriction("f", "h", radius=0.1, kinetic=0.3, static=0.3, stick_speed=0.05))
    m.add(fb.Motor("m", joint="h", torque="2*cos(turn)"))
    e = m.simulate(1.0, outputs=2, rtol=1e-11)
    r = m.simulate(1.0, outputs=2, method=ALPHA, step=0.0005, rtol=1e-9)
    assert np.abs(r["x"].position - e["x"].position).max() < 1e-4


@pytest.mark.parametrize(("method", "orders"), [(ALPHA, (2, 2)), ("radau", (5, 3))])
def test_index_3_holds_positions_alone(method, orders):
    """Order in positions and velocities (of Radau: Hairer, Lubich and Roche 1989); velocities leave the constraints."""
    n = 50 if method == ALPHA else 20
    found = []
    for steps in (n, 2 * n):
        r = pendulum().simulate(
            1.0,
            outputs=[1.0],
            method=method,
            step=1.0 / steps,
            rtol=1e-12,
            coordinates="absolute",
            stabilization="none",
        )
        found.append(errors(r)[:2])
    assert np.log2(found[0] / found[1]) == pytest.approx(orders, abs=0.25)
    assert r.health.violation < 1e-12
    assert r.health.velocity_violation > 1e-6


def test_health_says_by_what_it_was_computed():
    h = (
        pendulum()
        .simulate(0.1, outputs=2, method=ALPHA, step=0.01, coordinates="absolute", stabilization="none")
        .health
    )
    assert h.method == (
        "generalised-alpha, as requested, steps of 0.01 s, rho_inf = 0.8, index 3: velocities are not projected "
        "on the constraints"
    )
    assert (
        pendulum().simulate(0.1, outputs=2, step=0.01, method="rk45").health.method
        == "rk45, as requested, steps of 0.01 s"
    )
    assert not pendulum().simulate(0.1, outputs=2, method="rk45").health.method


def test_comparison_knows_methods_of_their_own():
    m = windows(False)
    names = ("projection", "radau", "radau index 3", ALPHA, f"{ALPHA} index 3")
    c = m.compare(2.0, outputs=5, formulations=names, step="5 ms", rtol=1e-8, repeats=1)
    assert all(f.success for f in c)
    assert c[ALPHA].steps == 400
    assert c[ALPHA].velocity_drift < 1e-12 < 1e-5 < c[f"{ALPHA} index 3"].velocity_drift
    assert c["radau"].difference < 1e-5 < 1e-2
    with pytest.raises(fb.ModelError, match="takes steps of fixed width: give one"):
        m.compare(2.0, formulations=[ALPHA])
    with pytest.raises(fb.ModelError, match="of which none is compared"):
        m.compare(2.0, formulations=["projection"], step=0.1)


def refused(**options):
    with pytest.raises(fb.ModelError) as error:
        pendulum().simulate(1.0, **options)
    return str(error.value)


def test_what_makes_no_sense_is_refused():
    assert "takes steps of fixed width: give one, for instance step='1 ms'" in refused(method=ALPHA)
    assert "0 (oscillations too fast" in refused(method=ALPHA, step=0.1, rho_inf=1.5)
    assert "rho_inf belongs to method='generalised-alpha'" in refused(method="radau", rho_inf=0.5)
    assert "did you mean 'generalised-alpha'" in refused(method="newmark")
    assert "stabilization='baumgarte' does nothing" in refused(method=ALPHA, step=0.1, stabilization="baumgarte")
