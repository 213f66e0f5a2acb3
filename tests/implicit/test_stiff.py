"""method="auto": stiff motions go on by an implicit method, others do not; both ways, told, and the same each time."""

import numpy as np
import pytest

import flyball as fb
from flyball.numerics.eigen import dominant_eigenvalue
from flyball.numerics.integrators import time_loop as ex
from flyball.simulation.initial_state import find_initial_state
from flyball.simulation.solver_switching import largest_eigenvalue


def bushing(damping, *more):
    """1 g on 1e6 N/m."""
    m = fb.Mechanism("b", parameters={"c": damping})
    m.add(fb.Body("x", mass=1e-3, inertia=(1e-7, 1e-7, 1e-7), velocity=(3.0, 0, 0)))
    m.add(fb.Prismatic("s", "ground", "x", at=(0, 0, 0), axis=(1, 0, 0)))
    m.add(fb.CoordinateSpring("k", "s.displacement", stiffness=1e6, damping="c"), *more)
    return m


def clock_at(start):
    real, y = ex.StepReals.blank(), ex.StateVectors.blank(len(start.y))
    y.current, y.unit = start.y, 1.0
    return ex.StepState(real, ex.StepCounts.blank(), np.zeros(0), y, np.zeros((1, len(start.y))), np.zeros(0, int))


@pytest.mark.parametrize("damping", [0.0, 10.0, 50.0, 1000.0])
def test_fastest_eigenvalue(damping):
    """Root of m s^2 + c s + k = 0, with its damping: a pair but for the last."""
    start = find_initial_state(bushing(damping).snapshot(), 0.0, None, None, "joint")
    found = largest_eigenvalue(start.assembly.compiled, clock_at(start), 1e4)
    roots = np.roots([1e-3, damping, 1e6])
    root = roots[np.argmax(np.abs(roots))]
    assert complex(found.real, abs(found.imag)) == pytest.approx(complex(root.real, abs(root.imag)), rel=1e-5)


def test_largest_eigenvalue_of_a_matrix():
    """As of all its eigenvalues; and of one whose start spans two directions only, by three products."""
    matrix = np.random.default_rng(1).normal(size=(7, 7))
    values = np.linalg.eigvals(matrix)
    assert abs(dominant_eigenvalue(lambda x: matrix @ x, np.ones(7), 7)) == pytest.approx(
        np.abs(values).max(), rel=1e-9
    )
    pair = np.diag(np.arange(1.0, 7.0))
    pair[:2, :2] = [[-3.0, 9.0], [-9.0, -3.0]]
    found = dominant_eigenvalue(lambda x: pair @ x, np.eye(6)[0], 5)
    assert (found.real, abs(found.imag)) == pytest.approx((-3.0, 9.0))
    assert dominant_eigenvalue(lambda x: x * np.nan, np.ones(3), 2) == 0.0


def on_a_tip(mass, stiffness, ratio, *more):
    """A pendulum of 1 kg, with a light body at its end on a spring of that damping ratio along it."""
    m = fb.Mechanism("tip", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("big", mass=1, inertia=0.1, position=(1, 0)))
    m.add(fb.Body("tip", mass=mass, inertia=mass * 1e-2, position=(2, 0)))
    m.add(fb.Revolute("A", "ground", "big", at=(0, 0)), fb.Prismatic("P", "big", "tip", at=(2, 0), axis=(1, 0)))
    damping = 2 * ratio * np.sqrt(stiffness * mass)
    m.add(fb.CoordinateSpring("k", "P.displacement", stiffness=stiffness, damping=damping), *more)
    return m


TIPS = [(1e-3, 1e7), (1e-3, 1e8), (1e-3, 1e9), (1e-6, 1e6), (1e-2, 1e8), (1e-8, 1e3)]  # kg, N/m: 1e5 to 1e6 rad/s


@pytest.mark.parametrize("ratio", [0.05, 0.2, 0.5, 0.7, 0.9, 1.5])
def test_damped_pairs_are_seen(ratio):
    """Whatever their damping: what is found costs two hundred steps or so, not 2e5; as `radau` by itself, closely."""
    for mass, stiffness in TIPS:
        both = {x: on_a_tip(mass, stiffness, ratio).simulate(5.0, outputs=21, method=x) for x in ("auto", "radau")}
        assert both["auto"].health.steps < 3 * both["radau"].health.steps + 150
        fine = on_a_tip(mass, stiffness, ratio).simulate(5.0, outputs=21, method="radau", rtol=1e-10)
        assert both["auto"]["big"].position == pytest.approx(fine["big"].position, abs=1e-4)


@pytest.mark.parametrize("ratio", [0.2, 0.9])
def test_steps_that_rounding_limits_are_seen(ratio):
    """By tight tolerances: a fraction of what is stable, for ever (2e6 steps)."""
    for mass, stiffness in TIPS[1:4]:
        r = on_a_tip(mass, stiffness, ratio).simulate(2.0, outputs=21, rtol=1e-9)
        assert "where it is stiff" in r.health.method
        assert r.health.steps < 3000
        fine = on_a_tip(mass, stiffness, ratio).simulate(2.0, outputs=21, rtol=1e-11, method="radau")
        assert r["big"].position == pytest.approx(fine["big"].position, abs=1e-7)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("ratio", [0.05, 0.2, 0.7])
def test_what_is_driven_as_fast_as_it_swings_stays_explicit(ratio, rtol):
    """Though damped: swings of 4 to 50 mm have to be followed."""
    push = fb.CoordinateSpring("f", "P.displacement", force="5e4*sin(1e5*t)")
    with pytest.raises(fb.SimulationError) as caught:
        on_a_tip(1e-3, 1e7, ratio, push).simulate(2.0, outputs=3, rtol=rtol, max_steps=4000)
    assert caught.value.result.health.method == ""


@pytest.mark.parametrize(("ratio", "rtol"), [(0.0, 1e-3), (0.0, 1e-6), (0.0, 1e-9), (1e-3, 1e-6), (0.01, 1e-9)])
def test_a_fast_swing_stays_explicit(ratio, rtol):
    """10 mm that last."""
    with pytest.raises(fb.SimulationError) as caught:
        on_a_tip(1e-3, 1e7, ratio, fb.Initial("P.displacement", value=0.01)).simulate(
            2.0, outputs=3, rtol=rtol, max_steps=1500
        )
    assert caught.value.result.health.method == ""


def test_a_weakly_damped_swing_is_followed_until_it_is_gone():
    """A hundredth of critical: 10 mm fall by exp(-1e3 t)."""
    r = on_a_tip(1e-3, 1e7, 0.01, fb.Initial("P.displacement", value=0.01)).simulate(8.0, outputs=21)
    told = r.health.method
    assert told.startswith("dop853; radau from t = ")
    gone = float(told.split("t = ")[1].split()[0])
    assert 1e3 * np.exp(-1e3 * gone) < 1e-6


def test_a_stiff_motion_goes_over_and_says_so():
    """In closed form, with the energy in the work of the damper; the same each time."""
    r = bushing(1000.0).simulate(1.0, outputs=np.r_[0, np.geomspace(1e-6, 1, 30)])
    roots = np.roots([1e-3, 1000.0, 1e6]).astype(complex)
    a = 3.0 / (roots[0] - roots[1])
    exact = (a * (np.exp(roots[0] * r.t) - np.exp(roots[1] * r.t))).real
    assert np.abs(r["x"].position[:, 0] - exact).max() < 1e-5 * np.abs(exact).max()
    assert r.health.method.startswith("dop853; radau from t = 0.00")
    assert r.health.steps < 2000
    assert r.health.energy_drift < 1e-5 * 4.5e-3
    again = bushing(1000.0).simulate(1.0, outputs=r.t)
    assert np.array_equal(again.q, r.q)
    assert again.health.method == r.health.method


def test_a_motion_that_is_short_or_not_stiff_does_not():
    assert bushing(1000.0).simulate(0.01).health.method == ""
    assert bushing(0.0).simulate(0.01).health.method == ""


def on_mounts(bodies):
    """Some bodies of 1 kg, each on a mount that damps all at 2e4/s."""
    m = fb.Mechanism("mounts", gravity=(0, 0, 0))
    for k in range(bodies):
        m.add(fb.Body(f"x{k}", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(k, 0, 0), velocity=(1.0, 0, 0)))
        m.add(fb.SpringDamper(f"s{k}", "ground", f"x{k}", at=((k - 1, 0, 0), (k, 0, 0)), stiffness=1e4, damping=2e4))
    return m


def test_what_is_left_is_counted_by_what_it_costs():
    """As many steps for sixteen bodies as for one, and each is dearer: they go over, one does not."""
    one, many = (on_mounts(n).simulate(5.0, rtol=1e-3, outputs=3) for n in (1, 16))
    assert one.health.method == ""
    assert many.health.method.startswith("dop853; radau from t = 0.0")
    rest = 1.0 / 2e4  # the way of 1 m/s until it is damped away; the spring brings it back in 2 s
    assert np.abs(many["x7"].position[-1] - (7 + rest * np.exp(-2.5), 0, 0)).max() < 1e-5


def test_it_comes_back_where_nothing_is_stiff_any_more():
    """The damper lets go: then it swings freely, with what energy there is."""
    off = fb.Event("off", "t - 0.9", do=[fb.Set("c", 0.0), fb.Impulse("s", "3e-3")])
    r = bushing(1000.0, off).simulate(1.0, outputs=[0.9, 0.901, 1.0])
    assert "radau from t = " in r.health.method
    assert r.health.method.rpartition("; ")[2].startswith("dop853 from t = 0.9")
    w = np.sqrt(1e9)
    at = np.hypot(r["x"].position[1:, 0] * w, r["x"].velocity[1:, 0])
    assert at == pytest.approx([3.0, 3.0], rel=1e-4)


def test_what_radau_does_not_know_stays_explicit_and_health_says_why():
    m = bushing(1000.0)
    m.add(fb.Actuator("a", "s.displacement", force=lambda t: 0.0 * t))
    r = m.simulate(0.8, outputs=2)
    assert "dop853, though it is stiff" in r.health.method
    assert "is a Python function" in r.health.method


def test_a_blow_on_an_undamped_spring_swings_on():
    """Beside what is stiff and damped, which made the motion go over: x = J / sqrt(k m) sin(w (t - t0))."""
    m = fb.Mechanism("struck", planar=True, gravity=(0, 0))
    for n in "abd":
        m.add(fb.Body(n, mass=1, inertia=1), fb.Prismatic(n.upper(), "ground", n, at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("soft", "A.displacement", stiffness=10), fb.Initial("A.displacement", value=0.5))
    m.add(fb.CoordinateSpring("hard", "B.displacement", stiffness=1e10))
    m.add(
        fb.CoordinateSpring("oil", "D.displacement", stiffness=1e5, damping=1e5),
        fb.Initial("D.displacement", value=0.1),
    )
    m.add(fb.Event("blow", "t > 5", do=[fb.Impulse("b", (0.1, 0))]))
    r = m.simulate(5.3, outputs=np.r_[0, np.linspace(5, 5.3, 301)[1:]])
    told = r.health.method
    assert told.index("radau from") < told.index("dop853 from t = 5 s on, as velocities jumped")
    swing = np.hypot(r["B.displacement"] * 1e5, r["B.displacement_rate"])[1:]
    assert swing == pytest.approx(0.1, rel=1e-3)
    assert r["A.displacement"] == pytest.approx(0.5 * np.cos(np.sqrt(10) * r.t), abs=1e-5)
