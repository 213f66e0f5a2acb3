"""Radau IIA of order 5: orders, stiff motions in closed form, singular positions, redundant rows, energy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

import flyball as fb
from tests.layers import both_layers
from tests.mechanisms import example, free_body, spatial_four_bar

G = 9.81


def pendulum():
    """A point-like pendulum of length 1 that swings by 60 degrees."""
    m = fb.Mechanism("p", planar=True, gravity=(0, -G))
    m.add(fb.Body("bob", mass=1.0, inertia=1e-300, position=(np.sin(np.pi / 3), -np.cos(np.pi / 3)), angle="60 deg"))
    m.add(fb.Revolute("pin", "ground", "bob", at=(0, 0)))
    return m


def swing(t):
    """Angle and rate of that pendulum, and the tension of its rod: Jacobi's elliptic functions."""
    k, w = np.sin(np.pi / 6), np.sqrt(G)
    sn, cn, dn, _ = ellipj(ellipk(k * k) - w * t, k * k)
    angle, rate = 2.0 * np.arcsin(k * sn), -2.0 * k * w * cn
    return angle, rate, rate**2 + G * np.cos(angle)


def errors(r):
    """Of positions, velocities and the pin's force on the pendulum."""
    angle, rate, tension = swing(r.t)
    p, v = r["bob"].position, r["bob"].velocity
    way = np.column_stack([np.sin(angle), -np.cos(angle)])
    along = np.column_stack([np.cos(angle), np.sin(angle)])
    carried = np.linalg.norm(r["pin"].force, axis=1)
    return np.array([
        np.abs(p[:, :2] - way).max(),
        np.abs(v[:, :2] - rate[:, None] * along).max(),
        np.abs(carried - np.abs(tension)).max(),
    ])  # fmt: skip


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_order_at_the_ends_of_steps_and_between_them(coordinates):
    """Positions, velocities and reported reactions 5; between steps 4."""
    at_ends, between = [], []
    for step in (0.1, 0.05):
        for at, ends in ((np.arange(1, 11) / 10, at_ends), (np.arange(10) / 10 + 0.374 * step, between)):
            r = pendulum().simulate(1.0, outputs=at, method="radau", step=step, rtol=1e-12, coordinates=coordinates)
            ends.append(errors(r))
    assert (np.log2(at_ends[0] / at_ends[1]) > 4.6).all()
    assert (np.log2(between[0] / between[1]) > 3.6).all()
    assert at_ends[1].max() < 1e-5


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_order_in_space(coordinates):
    """A loop in space whose joints over-constrain nothing, against the explicit method of order 8."""
    m = spatial_four_bar()
    exact = m.simulate(0.4, outputs=[0.4], rtol=1e-12)
    found = []
    for step in (0.02, 0.01):
        r = m.simulate(0.4, outputs=[0.4], method="radau", step=step, rtol=1e-12, coordinates=coordinates)
        found.append(max(np.abs(r[b.name].position - exact[b.name].position).max() for b in m.bodies))
    assert 4.5 < np.log2(found[0] / found[1]) < 6.0
    assert found[1] < 1e-4


def test_free_rotation_is_eulers():
    """A symmetric body in free rotation: its spin is constant and its axis goes round a cone at a known rate."""
    m = free_body(inertia=(1.0, 1.0, 2.0), w=(3.0, 0.0, 10.0))
    r = m.simulate(2.0, outputs=21, method="radau", rtol=1e-10)
    name = m.bodies[0].name
    L = np.array([3.0, 0.0, 20.0])
    axis = r[name].rotation[:, :, 2]
    assert np.abs(axis @ L / np.linalg.norm(L) - 20.0 / np.linalg.norm(L)).max() < 1e-8
    turned = np.linalg.norm(L) / 1.0 * r.t  # the axis about L, at |L| / A
    e3 = L / np.linalg.norm(L)
    e1 = np.array([0.0, 0.0, 1.0]) - e3[2] * e3
    e1 /= np.linalg.norm(e1)
    e2 = np.cross(e3, e1)
    expected = np.outer(np.cos(turned), e1) + np.outer(np.sin(turned), e2)
    across = axis - np.outer(axis @ e3, e3)
    across /= np.linalg.norm(across, axis=1)[:, None]
    assert np.abs(across - expected).max() < 1e-6
    assert np.abs(np.linalg.norm(r.q[:, 3:7], axis=1) - 1.0).max() < 1e-15


@pytest.mark.parametrize("damping", [10.0, 1000.0])
def test_stiff_bushing_in_closed_form(damping):
    """1 g on 1e6 N/m: what has died out costs no steps, and its energy is in the work of the damper."""
    m = fb.Mechanism("b")
    m.add(fb.Body("x", mass=1e-3, inertia=(1e-7, 1e-7, 1e-7), velocity=(3.0, 0, 0)))
    m.add(
        fb.Bushing(
            "s", "ground", "x", at=(0, 0, 0), stiffness=1e6, damping=damping, torsional_stiffness=100.0,
            torsional_damping=1e-3,
        )
    )  # fmt: skip
    t = np.r_[0.0, np.geomspace(1e-7, 1.0, 60)]
    r = m.simulate(1.0, outputs=t, method="radau", rtol=1e-8)
    roots = np.roots([1e-3, damping, 1e6]).astype(complex)
    a = 3.0 / (roots[0] - roots[1])
    exact = (a * (np.exp(roots[0] * t) - np.exp(roots[1] * t))).real
    assert np.abs(r["x"].position[:, 0] - exact).max() < 1e-6 * np.abs(exact).max()
    assert r.health.steps < 1000
    assert r.health.energy_drift < 1e-5 * 4.5e-3
    assert not r.health.warnings


def test_strong_damping():
    """A pendulum in honey creeps: against SciPy's Radau on the equation of its angle."""
    m = fb.Mechanism("p", planar=True, gravity=(0, -G))
    m.add(fb.Body("x", mass=1, inertia=1e-2, position=(1, 0)))
    m.add(fb.Revolute("h", "ground", "x", at=(0, 0)))
    m.add(fb.TorsionalSpringDamper("d", "h", stiffness=0, damping=100.0))
    r = m.simulate(10.0, outputs=51, method="radau")
    exact = solve_ivp(
        lambda t, y: [y[1], (-G * np.cos(y[0]) - 100.0 * y[1]) / 1.01], (0, 10), [0, 0], method="Radau", rtol=1e-11,
        atol=1e-13, t_eval=r.t,
    )  # fmt: skip
    assert np.abs(r["h"].angle - exact.y[0]).max() < 4e-7
    assert r.health.steps < 100


def windows(double, number=1):
    m = example("n_four_bar.py", windows=number)
    if double:
        m.add(fb.Revolute("again", "bar 0", "post 1", at=(1, 1)))
    return m


@pytest.mark.parametrize("double", [False, True])
@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_singular_positions_are_passed(coordinates, double):
    """Ten singular positions, with rows that are doubled too; the motion is that of one freedom."""
    r = windows(double).simulate(10.0, outputs=2, method="radau", rtol=1e-8, coordinates=coordinates)
    k = G * 2.0 / (2.0 / 3.0 + 1.0)
    s = solve_ivp(
        lambda t, y: [y[1], -k * np.cos(y[0])], (0, 10), [np.pi / 2, -1.0], method="DOP853", rtol=1e-13, atol=1e-13
    )
    angle = s.y[0, -1]
    off = r["post 0"].position[-1, :2] - 0.5 * np.array([np.cos(angle), np.sin(angle)])
    assert np.linalg.norm(off) < 1e-5
    assert r.health.energy_drift < 1e-5


@pytest.mark.parametrize(("number", "double"), [(1, False), (1, True), (10, False), (10, True)])
def test_energy_through_singular_positions(number, double):
    """A microjoule in 10 s: ten passes, where rounding decides how wide a step may be."""
    r = windows(double, number).simulate(10.0, outputs=2, method="radau", rtol=1e-10)
    assert r.health.energy_drift < 1e-6
    assert not r.health.doubtful


@pytest.mark.parametrize(("number", "coordinates", "rtol"), [
    (1, "joint", 1e-10), (1, "absolute", 1e-10), (10, "joint", 1e-11), (10, "joint", 1e-12),
])  # fmt: skip
@pytest.mark.parametrize("double", [False, True])
def test_energy_between_steps_too(number, coordinates, rtol, double):
    """A microjoule at every hundredth of a second, where the polynomial within steps of order 4 tells the motion."""
    r = windows(double, number).simulate(10.0, outputs=1001, method="radau", rtol=rtol, coordinates=coordinates)
    assert r.health.energy_drift < 1e-6
    assert not r.health.doubtful


@pytest.mark.parametrize("rtol", [1e-7, 1e-8])
def test_a_step_that_ends_too_close_to_a_singular_position_is_taken_back(rtol):
    """From within a microsecond of it no width led on: ten windows in absolute coordinates."""
    r = windows(False, 10).simulate(10.0, outputs=101, method="radau", rtol=rtol, coordinates="absolute")
    assert r.health.energy_drift < 5e3 * rtol


@pytest.mark.parametrize("rtol", [1e-9, 1e-10])
def test_the_widest_step_passes_where_rounding_decides(rtol):
    """Narrower ones lead into the singular position; this ended there with a width of 1e-14 s."""
    r = windows(True).simulate(10.0, outputs=2, method="radau", rtol=rtol, coordinates="absolute")
    assert r.health.energy_drift < 1e-7


@pytest.mark.parametrize(("step", "allowed"), [(0.02, 1e-4), (0.01, 4e-6)])
def test_singular_positions_at_fixed_steps(step, allowed):
    """As the prototype of the stabilised form does them: errors of 6e-5 and 2e-6 m."""
    r = windows(False).simulate(10.0, outputs=2, method="radau", step=step, rtol=1e-9, coordinates="absolute")
    e = windows(False).simulate(10.0, outputs=2, rtol=1e-10)
    assert np.abs(r["post 0"].position - e["post 0"].position).max() < allowed


MOTIONS = ("governor.toml", "car_axis.toml", "chaplygin_sleigh.toml", "rolling_disk.toml", "heavy_top.toml")


@pytest.mark.parametrize("name", MOTIONS)
def test_motions_are_those_of_the_explicit_method(name):
    """Springs, drivers, rolling, knife edges, tops: positions, reactions, energy."""
    m = example(name)
    e = m.simulate(1.0, outputs=11, rtol=1e-10)
    r = m.simulate(1.0, outputs=11, method="radau", rtol=1e-8)
    size = max(np.abs(e[b.name].position).max() for b in m.bodies)
    assert max(np.abs(r[b.name].position - e[b.name].position).max() for b in m.bodies) < 3e-7 * size
    force = {j.name: np.asarray(e[j.name].force) for j in m.joints}
    largest = max(np.abs(f).max() for f in force.values())
    assert max(np.abs(r[n].force - f).max() for n, f in force.items()) < 1e-4 * largest
    assert not r.health.warnings


@both_layers
def test_friction_that_follows_reactions():
    m = fb.Mechanism("f", planar=True, gravity=(0, -G))
    m.add(fb.Body("x", mass=1, inertia=0.1, position=(1, 0)))
    m.add(fb.Revolute("h", "ground", "x", at=(0, 0)))
    m.add(fb.JointFriction("f", "h", radius=0.1, kinetic=0.3, static=0.3, stick_speed=0.05))
    e = m.simulate(3.0, outputs=31, rtol=1e-11)
    r = m.simulate(3.0, outputs=31, method="radau", rtol=1e-8)
    assert np.abs(r["x"].position - e["x"].position).max() < 1e-6
    assert r.health.energy_drift < 1e-5


@both_layers
def test_laws_that_name_sensors_and_drivers():
    m = fb.Mechanism("s")
    m.add(fb.Body("a", mass=1.0, inertia=(0.05, 0.06, 0.08)))
    m.add(fb.Body("b", mass=1.0, inertia=(0.02, 0.03, 0.05), position=(1, 0, 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0, 0), axis=(0, 0, 1), angle=0.4))
    m.add(fb.Revolute("B", "b", "ground", at=(1, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Sensor("s", "A.angle"), fb.Motor("m", joint="A", torque="0.5 + 0.1*angle"))
    m.add(fb.Initial("A.angle", value=0.4, rate=9.0), fb.Driver("d", "B.angle", "asin(0.5*sin(s)) + 0.3*sin(4*t)"))
    e = m.simulate(2.0, outputs=21, rtol=1e-11)
    r = m.simulate(2.0, outputs=21, method="radau", rtol=1e-8)
    assert np.abs(r["A"].angle - e["A"].angle).max() < 1e-5
    assert np.abs(r["d"].work - e["d"].work).max() < 1e-5 * np.abs(e["d"].work).max()


def test_brief_laws_are_not_stepped_over():
    """A pulse of 10 ms in 100 s, by time; and one by where the body is."""
    for force, speed in (
        ("step5(t, 50, 0, 50.005, 1)*step5(t, 50.005, 1, 50.01, 0)", 0.0), ("exp(-((way - 5)/0.002)**2)", 0.1),
    ):  # fmt: skip
        m = fb.Mechanism("brief")
        m.add(fb.Body("b", mass=1.0, inertia=(1, 1, 1), velocity=(speed, 0, 0)))
        m.add(fb.Prismatic("p", "ground", "b", at=(0, 0, 0), axis=(1, 0, 0)))
        coordinate = "p." + next(iter(m["p"].coordinates))
        m.add(fb.Sensor("way", coordinate), fb.CoordinateSpring("f", coordinate, stiffness=0, force=force))
        e = m.simulate(100.0, outputs=2, rtol=1e-9)
        r = m.simulate(100.0, outputs=2, method="radau", rtol=1e-7)
        assert np.abs(e["b"].velocity[-1, 0] - e["b"].velocity[0, 0]) > 1e-3
        assert np.abs(r["b"].velocity[-1, 0] - e["b"].velocity[-1, 0]) < 1e-5


def test_a_motion_goes_on():
    m = example("governor.toml")
    whole = m.simulate(1.0, outputs=[0.5, 1.0], method="radau", rtol=1e-9)
    half = m.simulate(0.5, outputs=2, method="radau", rtol=1e-9)
    rest = m.simulate(1.0, outputs=2, method="radau", rtol=1e-9, start=half)
    name = m.bodies[0].name
    assert np.abs(rest[name].position[-1] - whole[name].position[-1]).max() < 1e-7


def refused(**options):
    with pytest.raises(fb.ModelError) as error:
        pendulum().simulate(1.0, **options)
    return str(error.value)


def test_what_does_nothing_is_refused():
    assert "specialize=True has no effect" in refused(method="radau", specialize=True)
    assert "stabilization='baumgarte' does nothing" in refused(method="radau", stabilization="baumgarte")
    assert "step must be greater than 0" in refused(method="radau", step=0.0)
    assert "radau" in refused(method="radua")


def test_what_it_does_not_know_is_refused_by_name():
    m = pendulum()
    m.add(fb.Body("other", mass=1.0, inertia=1.0, position=(2, 0)))
    m.add(fb.Revolute("far", "ground", "other", at=(1, 0)), fb.Driver("d", "far.angle", "t"))
    with pytest.raises(fb.ModelError, match="drivers prescribe"):
        m.simulate(1.0, method="radau", coordinates="joint")
    m.simulate(0.1, method="radau")


@pytest.mark.parametrize("thrust", [0.0, 1.0])
def test_friction_under_reactions_that_are_open(thrust):
    """Of all that redundant rows may carry the least is taken, as by explicit methods, and that it is open is told.

    Newton's method by itself took self-stresses of 1e7 N, and friction held the door still.
    """
    m = fb.Mechanism("door", gravity=(0, 0, -G))
    m.add(fb.Body("leaf", mass=10.0, inertia=(1, 1, 1), position=(0.5, 0, 1)))
    for name, z in (("upper", 2.0), ("lower", 0.0)):
        m.add(fb.Revolute(name, "ground", "leaf", at=(0, 0, z), axis=(0, 0, 1)))
    m.add(fb.JointFriction("f", "upper", radius=0.1, kinetic=0.3, static=0.3, thrust_factor=thrust, stick_speed=0.05))
    m.add(fb.Initial("upper.angle", rate=3.0))
    e = m.simulate(1.0, outputs=11, rtol=1e-9, coordinates="absolute")
    r = m.simulate(1.0, outputs=11, rtol=1e-7, method="radau")
    assert np.abs(r["upper"].angle - e["upper"].angle).max() < 5e-5
    assert np.abs(r["upper"].force - e["upper"].force).max() < 1e-2
    assert any("leave undetermined" in w for w in r.health.warnings)


def test_a_step_that_is_too_long_says_so():
    m = example("n_four_bar.py", windows=1)
    with pytest.raises(fb.SimulationError, match="give a shorter step"):
        m.simulate(10.0, method="radau", step=2.0)


def test_a_driver_that_jumps_is_named_and_not_passed():
    """A rate that jumps would take an infinite force, which an implicit step does not notice by itself."""
    m = pendulum()
    m.add(fb.Body("cart", mass=1.0, inertia=1.0, position=(2, 0)))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(2, 0), axis=(1, 0)))
    m.add(fb.Driver("d", "rail." + next(iter(m["rail"].coordinates)), "where(t < 0.2, 0, 0.5*(t - 0.2))"))
    with pytest.raises(fb.SimulationError, match=r"Driver 'd' cannot be followed beyond t = 0\.2"):
        m.simulate(1.0, method="radau")


def test_many_windows_go_through_singular_positions():
    """Ten windows, in coordinates whose Jacobians are sparse by branches: the motion of one freedom."""
    m = example("n_four_bar.py", windows=10)
    r = m.simulate(10.0, outputs=2, method="radau")
    e = m.simulate(10.0, outputs=2, rtol=1e-9)
    assert r.health.coordinates.startswith("joint")
    assert np.abs(r["post 0"].position - e["post 0"].position).max() < 1e-4
    assert r.health.energy_drift < 1e-3
