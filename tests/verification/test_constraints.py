"""Equations between coordinates and time: closed forms of motion, reaction, energy, frequency; what is refused."""

import numpy as np
import pytest

import flyball as fb

G = 9.81
K, MASS = 0.8, 1.7


def bead(law="bead.y - k*bead.x**2", **more):
    m = fb.Mechanism("bead", planar=True, gravity=(0, -G), parameters={"k": K})
    m.add(fb.Body("bead", mass=MASS, inertia=0.1, position=(0.6, K * 0.36)), fb.Constraint("wire", law), **more)
    return m


@pytest.mark.parametrize("scale", ["", "1e-7*"])
def test_bead_on_a_parabola(scale):
    """(1 + 4 k^2 x^2) x'' = -2 k x (g + 2 k x'^2), whatever factor the equation has; the reaction is square to it."""
    m = bead(f"{scale}(bead.y - k*bead.x**2)")
    r = m.simulate(2.0, outputs=41, rtol=1e-9)
    x, v = r["bead.x"], r["bead.vx"]
    assert r["bead.y"] == pytest.approx(K * x**2, abs=1e-13)
    a = -2 * K * x * (G + 2 * K * v**2) / (1 + 4 * K**2 * x**2)
    assert r["bead.ax"] == pytest.approx(a, rel=1e-9, abs=1e-9)
    assert 0.5 * (1 + 4 * K**2 * x**2) * v**2 + G * K * x**2 == pytest.approx(np.full(41, G * K * 0.36), rel=1e-8)
    along_y = MASS * (2 * K * v**2 + 2 * K * x * a + G)
    assert r["wire.effort_1"] == pytest.approx(along_y, rel=1e-9)
    assert r["wire.effort_2"] == pytest.approx(-2 * K * x * along_y, rel=1e-9, abs=1e-9)
    assert r["wire"].effort("bead.x") == pytest.approx(MASS * a, rel=1e-9, abs=1e-9)


def test_bead_at_rest_and_its_frequency():
    """At the bottom omega^2 = 2 k g; its derivative by k is 2 g."""
    m = bead()
    m.add(fb.Constraint("upright", "bead.angle"))
    rest = m.equilibrium()
    assert rest["bead.x"] == pytest.approx(0.0, abs=1e-9)
    modes = m.modes(about=rest)
    assert np.abs(modes.eigenvalues.imag).max() == pytest.approx(np.sqrt(2 * K * G), rel=1e-9)


def test_equation_of_time():
    """Two pendulums with a rheonomic relation: rows of position, velocity and acceleration, and the energy balance."""
    m = fb.Mechanism("two", planar=True, gravity=(0, -G))
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Body("b", mass=2, inertia=0.3, position=(2, -0.4)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "ground", "b", at=(2, 0), angle=0.4))
    m.add(fb.Constraint("c", "A.angle - 2*B.angle**2 - 0.1*sin(3*t)"))
    r = m.simulate(2.0, outputs=21, rtol=1e-9)
    a, b, t = r["A"], r["B"], r.t
    assert a.angle == pytest.approx(2 * b.angle**2 + 0.1 * np.sin(3 * t), abs=1e-12)
    assert a.angle_rate == pytest.approx(4 * b.angle * b.angle_rate + 0.3 * np.cos(3 * t), abs=1e-11)
    second = 4 * b.angle_rate**2 + 4 * b.angle * b.angle_acceleration - 0.9 * np.sin(3 * t)
    assert a.angle_acceleration == pytest.approx(second, abs=1e-9)
    assert r["c.effort_2"] == pytest.approx(-4 * b.angle * r["c.effort_1"], rel=1e-9, abs=1e-9)
    assert r.energy.total - r.energy.total[0] == pytest.approx(r["c.work"], abs=1e-7)
    assert abs(r["c.work"]).max() > 0.1
    implicit = m.simulate(2.0, outputs=21, method="radau", coordinates="absolute", rtol=1e-9)
    assert implicit["B.angle"] == pytest.approx(b.angle, abs=1e-6)


def test_spherical_pendulum():
    """A mass point on a sphere: its tension is m (v^2 + g depth) / L."""
    m = fb.Mechanism("sphere", gravity=(0, 0, -G))
    m.add(fb.Body("p", mass=MASS, inertia=0, position=(0.6, 0, -0.8), velocity=(0, 1.5, 0)))
    m.add(fb.Constraint("sphere", "p.x**2 + p.y**2 + p.z**2 - 1"))
    r = m.simulate(3.0, outputs=31, rtol=1e-9)
    p, v = r["p"].position, r["p"].velocity
    assert (p * p).sum(axis=1) == pytest.approx(np.ones(31), abs=1e-12)
    tension = MASS * ((v * v).sum(axis=1) - G * p[:, 2])
    force = np.stack([r[f"sphere.effort_{k}"] for k in (1, 2, 3)], axis=1)
    assert force == pytest.approx(-tension[:, None] * p, rel=1e-7, abs=1e-7)


def test_symbolic_and_explicit_equations():
    m = bead()
    eq = m.symbolic(coordinates="absolute")
    assert str(eq.g).split(maxsplit=1)[1] == "bead.y - k*bead.x^2"
    found = eq.explicit(["bead.x", "bead.angle"])
    x = 0.3
    assert found.M.at({"bead.x": x, "k": K})[0, 0] == pytest.approx(MASS * (1 + 4 * K**2 * x**2))


def test_sensitivity_of_a_position():
    """x(t) of the bead near the bottom is a cosine of sqrt(2 k g) t: the derivative by k, to second order in x."""
    m = fb.Mechanism("bead", planar=True, gravity=(0, -G), parameters={"k": K})
    m.add(fb.Body("bead", mass=MASS, inertia=0.1, position=(1e-4, K * 1e-8)))
    m.add(fb.Constraint("wire", "bead.y - k*bead.x**2"))
    s = m.sensitivity(of=["bead.x"], to=["k"], analysis="motion", t_end=0.7, outputs=2)
    omega = np.sqrt(2 * K * G)
    exact = -1e-4 * 0.7 * np.sin(0.7 * omega) * G / omega
    assert np.ravel(s["bead.x", "k"])[-1] == pytest.approx(exact, rel=1e-4)


def test_kinematics_with_a_law_of_a_table_and_a_file(tmp_path):
    m = fb.Mechanism("cam", planar=True)
    m.add(fb.Body("c", mass=1, inertia=1), fb.Body("f", mass=1, inertia=1, position=(0, 1)))
    m.add(fb.Revolute("A", "ground", "c", at=(0, 0)))
    m.add(fb.Translational("slide", "ground", "f", at=(0, 1), axis=(0, 1)))
    at = np.linspace(0, 2 * np.pi, 41)
    m.add(fb.Table("lift", x=at, y=0.02 * (1 - np.cos(at)), beyond="repeat"))
    m.add(fb.Constraint("cam", "slide.displacement - lift(A.angle)"), fb.Driver("motor", "A.angle", "3*t"))
    m.save(tmp_path / "cam.toml")
    again = fb.load(tmp_path / "cam.toml")
    assert again == m
    r = again.kinematics(np.linspace(0, 4, 9))
    assert r["slide.displacement"] == pytest.approx(0.02 * (1 - np.cos(3 * r.t)), abs=1e-6)


def two():
    m = fb.Mechanism("two", planar=True)
    m.add(fb.Body("a", mass=1, inertia=1), fb.Body("b", mass=1, inertia=1))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "ground", "b", at=(2, 0)))
    m.add(fb.Constraint("first", "A.angle - B.angle**2 - B.angle"))
    return m


def test_what_is_redundant_and_what_does_not_close():
    m = two()
    m.add(fb.Constraint("same", "2*A.angle - 2*B.angle**2 - 2*B.angle"))
    found = m.mobility()
    assert found.redundancy == 1
    assert set(found.sets[0].elements) == {"first", "same"}
    other = two()
    other.add(fb.Constraint("never", "cos(A.angle) - 3"))
    with pytest.raises(fb.AssemblyError, match="never has the value 2 in place of 0"):
        other.assemble()
    outside = two()
    outside.add(fb.Constraint("root", "sqrt(A.angle - 500) - 1"))
    with pytest.raises(fb.AssemblyError, match="law of Constraint 'root' has no finite value"):
        outside.assemble()


REFUSED = {
    "t - 1": "names no coordinate",
    "A.rate - 2": "no coordinate 'rate'",
    "A.angel": "mean 'angle'",
    "A.angle - s": "names sensor 's'; write what it measures, 'B.angle'",
    "A.angle - q": "unknown name 'q'",
    "A.angle -": "cannot read",
    "sin(A.angle": "law of Constraint 'c'",
}


@pytest.mark.parametrize("law", REFUSED)
def test_refused_laws(law):
    m = two()
    m.add(fb.Sensor("s", "B.angle"))
    with pytest.raises(fb.ModelError, match=REFUSED[law]):
        m.add(fb.Constraint("c", law))
