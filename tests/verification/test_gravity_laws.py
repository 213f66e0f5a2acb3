"""Gravity as a law of time, in every analysis: closed forms, energy, reactions, equations; what is refused."""

import numpy as np
import pytest

import flyball as fb

G, A, W = 9.81, 0.3, 5.0
LAW = "-g*(1 + 0.3*sin(5*t))"


def falling(planar=True, gravity=None, **body):
    m = fb.Mechanism("fall", planar=planar, gravity=gravity or ("0", LAW), parameters={"g": G})
    m.add(fb.Body("b", mass=2.0, inertia=0.1, position=(1, 3), velocity=(0.5, 0), **body))
    return m


def height(t):
    """y'' = -g (1 + a sin(w t)) from rest."""
    return 3 - G * (t**2 / 2 + A * (t / W - np.sin(W * t) / W**2))


@pytest.mark.parametrize("how", ["auto", "radau", "variational", "generalised-alpha", "impulse"])
def test_free_fall(how):
    fixed = {"step": 1e-3} if how in ("variational", "generalised-alpha") else {}
    r = falling().simulate(1.5, outputs=16, method=how, **fixed)
    near = {"auto": 1e-6, "radau": 1e-5}.get(how, 2e-4)
    near = 1e-1 if how == "impulse" else near
    assert r["b.y"] == pytest.approx(height(r.t), abs=near)
    assert r["b.x"] == pytest.approx(1 + 0.5 * r.t, abs=1e-9)


def test_energy_counts_the_work_of_the_change():
    """Potential energy is that of gravity at t = 0; the work of its change is the integral of m (g - g0) . v."""
    r = falling().simulate(1.5, outputs=16, rtol=1e-9)
    assert r.energy.gravity == pytest.approx(2.0 * G * height(r.t), rel=1e-7)
    assert r.energy.work["gravity"] == pytest.approx(r.energy.total - r.energy.total[0], abs=1e-6)
    assert abs(r.energy.work["gravity"]).max() > 1.0
    assert r.health.energy_drift < 1e-7


def pendulum():
    m = fb.Mechanism("pendulum", planar=True, gravity=("0", LAW), parameters={"g": G})
    m.add(fb.Body("rod", mass=1.5, inertia=0.2, position=(0, -0.8)), fb.IMU("imu", "rod"))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    return m


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
@pytest.mark.parametrize("specialize", [False, True])
def test_pendulum_in_both_layers(coordinates, specialize):
    """(J + m l^2) phi'' = -m g(t) l sin(phi), with the bearing's force from Newton's law."""
    m = pendulum()
    m.add(fb.Initial("A.angle", value=0.7))
    options = {"coordinates": coordinates} | ({"specialize": True} if specialize and coordinates == "joint" else {})
    r = m.simulate(2.0, outputs=21, rtol=1e-9, **options)
    g = G * (1 + A * np.sin(W * r.t))
    found = r["A"].angle_acceleration * (0.2 + 1.5 * 0.64)
    assert found == pytest.approx(-1.5 * g * 0.8 * np.sin(r["A.angle"]), abs=1e-8)
    assert r["A.fy"] == pytest.approx(1.5 * (r["rod.ay"] + g), abs=1e-8)
    assert r["A.fx"] == pytest.approx(1.5 * r["rod.ax"], abs=1e-8)
    felt = r["imu"].specific_force
    own = np.array([r["rod.ax"], r["rod.ay"] + g])
    assert np.linalg.norm(felt[:, :2], axis=1) == pytest.approx(np.linalg.norm(own, axis=0), abs=1e-8)
    assert r.energy.balance == pytest.approx(np.zeros(21), abs=1e-6)


def test_equations_with_symbols_and_linear_ones():
    m = pendulum()
    eq = m.symbolic()
    f = eq.explicit().f.at({"A.angle": 0.4, "A.angle'": 0.0, "t": 0.3, "g": G})
    assert f.item() == pytest.approx(-1.5 * G * (1 + A * np.sin(W * 0.3)) * 0.8 * np.sin(0.4))
    with pytest.raises(fb.AnalysisError, match="time"):
        m.linearize(outputs=["A.angle"])


def test_sensitivity_of_a_fall():
    s = falling().sensitivity(of=["b.y"], to=["g"], analysis="motion", t_end=1.2, outputs=2)
    assert np.ravel(s["b.y", "g"])[-1] == pytest.approx((height(1.2) - 3) / G, rel=1e-6)


def test_a_step_is_not_passed_over():
    """Gravity that acts for 10 ms in the middle of a second."""
    m = fb.Mechanism("pulse", planar=True, gravity=(0, "where(abs(t - 0.5) < 0.005, -100, 0)"))
    m.add(fb.Body("b", mass=1.0, inertia=0.1))
    r = m.simulate(1.0, outputs=2)
    assert r["b.vy"][-1] == pytest.approx(-1.0, rel=1e-9)


def test_controllers_and_recursive_dynamics():
    """A robot's controller follows gravity as it changes; arrays of states have that at t = 0."""
    m = pendulum()
    m.add(fb.GravityCompensatedPD("pd", coordinates=["A.angle"], reference=[0.7], kp=0.0, kd=0.0))
    m.add(fb.Motor("motor", "A", torque="pd.A"))
    m.add(fb.Initial("A.angle", value=0.7, rate=0.0))
    r = m.simulate(1.0, outputs=5)
    assert r["A.angle"] == pytest.approx(np.full(5, 0.7), abs=1e-7)
    p = pendulum().prepare(coordinates="joint")
    assert p.gravity_forces(np.array([0.7])) == pytest.approx([1.5 * G * 0.8 * np.sin(0.7)])


def test_contact_by_steps():
    """A ball on a floor whose gravity changes: the floor carries m g(t)."""
    m = fb.Mechanism("ball", gravity=(0, 0, "-9.81*(1 + 0.3*sin(5*t))"))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1), mass=2.0, position=(0, 0, 0.1)))
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact(friction=0.2))
    r = m.simulate(1.0, outputs=11, method="impulse")
    assert r["ball.z"] == pytest.approx(np.full(11, 0.1), abs=1e-5)
    assert r["ball.contact_fz"][1:] == pytest.approx(2.0 * G * (1 + A * np.sin(W * r.t[1:])), rel=0.02)
    m.add(fb.Bodies("grains", shape=fb.Sphere(radius=0.01), density=1000, position=[(1, 0, 0.1)]))
    with pytest.raises(fb.ModelError, match="sets of bodies need constant gravity"):
        m.simulate(0.1, method="impulse")


def test_file(tmp_path):
    m = falling()
    m.save(tmp_path / "fall.toml")
    assert fb.load(tmp_path / "fall.toml") == m


@pytest.mark.parametrize(
    ("gravity", "message"),
    [
        (("0", "-9.81*u(t)"), "unknown function"),
        (("0", "-9.81*t*q"), "unknown name 'q'"),
        (("0", "1/t"), "finite"),
        (("0", "t*x"), "unknown name"),
    ],
)
def test_refused(gravity, message):
    with pytest.raises(fb.ModelError, match=message):
        fb.Mechanism("bad", planar=True, gravity=gravity)
