"""Sensitivities against closed forms and central differences."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.analyses.made import G


def slider_crank() -> fb.Mechanism:
    """x = r cos + sqrt(l^2 - r^2 sin^2) at the crank's angle w t."""
    m = fb.Mechanism("slider-crank", planar=True, parameters={"r": 0.2, "l": 0.5, "w": 10.0})
    m.add(fb.Body("crank", mass=1, inertia=0.01, position=(0, 0)))
    m.add(fb.Body("rod", mass=1, inertia=0.02, position=("r", 0)))
    m.add(fb.Body("slider", mass=1, inertia=0.01, position=("r + l", 0)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)))
    m.add(fb.Revolute("B", "crank", "rod", at=("r", 0)))
    m.add(fb.Revolute("C", "rod", "slider", at=("r + l", 0)))
    m.add(fb.Prismatic("D", "ground", "slider", at=("r + l", 0), axis=(1, 0)))
    m.add(fb.Driver("motor", "A.angle", "w*t"))
    return m


def test_kinematics_of_a_slider_crank():
    t, r, l, w = 0.13, 0.2, 0.5, 10.0
    s, c = np.sin(w * t), np.cos(w * t)
    root = np.sqrt(l * l - (r * s) ** 2)
    found = slider_crank().sensitivity(["slider.x", "slider.vx"], ["r", "l", "w"], t=t)
    by_angle = -r * s - r * r * s * c / root
    assert found["slider.x", "r"] == pytest.approx(c - r * s * s / root, rel=1e-9)
    assert found["slider.x", "l"] == pytest.approx(l / root, rel=1e-9)
    assert found["slider.x", "w"] == pytest.approx(t * by_angle, rel=1e-9)
    assert found["slider.vx", "l"] == pytest.approx(w * r * r * s * c * l / root**3, rel=1e-9)


def test_over_a_driven_motion_and_checked():
    found = slider_crank().sensitivity(["slider.ax", "B.fx"], analysis="motion", t_end=0.6, outputs=7, verify=True)
    assert found.to == ("r", "l", "w")
    assert found.derivatives.shape == (7, 2, 3)
    assert found.difference < 1e-5


def oscillator() -> fb.Mechanism:
    m = fb.Mechanism("mass", planar=True, parameters={"k": 50.0, "m": 2.0, "x": 0.1})
    m.add(fb.Body("mass", mass="m", inertia=1, position=("1 + x", 0)))
    m.add(fb.Prismatic("rail", "ground", "mass", at=("1 + x", 0), axis=(1, 0)))
    m.add(fb.SpringDamper("spring", "ground", "mass", at=((0, 0), ("1 + x", 0)), stiffness="k", length=1))
    return m


def test_a_motion_with_freedom():
    """x cos(sqrt(k/m) t), by stiffness, mass and start."""
    found = oscillator().sensitivity(["mass.x"], ["k", "m", "x"], analysis="motion", t_end=2.0, outputs=9)
    t, k, m, x = found.t, 50.0, 2.0, 0.1
    w = np.sqrt(k / m)
    assert found.values[:, 0] == pytest.approx(1 + x * np.cos(w * t), abs=1e-9)
    assert found["mass.x", "k"] == pytest.approx(-x * t * np.sin(w * t) / (2 * w * m), abs=1e-9)
    assert found["mass.x", "m"] == pytest.approx(x * t * np.sin(w * t) * w / (2 * m), abs=1e-9)
    assert found["mass.x", "x"] == pytest.approx(np.cos(w * t), abs=1e-9)


def spatial() -> fb.Mechanism:
    m = fb.Mechanism("pendulum", gravity=(0, 0, -G), parameters={"length": 0.8, "tilt": 0.5})
    at = ("length*sin(tilt)", 0, "-length*cos(tilt)")
    m.add(fb.Body("bob", mass=2, inertia=(0.01, 0.02, 0.03), position=at, angular_velocity=(0.3, 0.2, 2.0)))
    m.add(fb.Spherical("pivot", "ground", "bob", at=(0, 0, 0)))
    return m


def test_a_spatial_motion_against_differences():
    found = spatial().sensitivity(["bob.x", "bob.vz", "pivot.fz"], analysis="motion", t_end=0.8, outputs=5, verify=True)
    assert found.difference < 1e-5


def spring_rod() -> fb.Mechanism:
    m = fb.Mechanism("rod", planar=True, gravity=(0, -G), parameters={"k": 20.0, "mass": 2.0, "length": 1.0})
    at = ("length/2*sin(0.7)", "-length/2*cos(0.7)")
    m.add(fb.Body("rod", mass="mass", inertia="mass*length**2/12", position=at, angle=0.7))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0), angle=0.7))
    m.add(fb.TorsionalSpringDamper("spring", joint="A", stiffness="k", angle=1.0))
    return m


def test_an_equilibrium():
    """k (theta - 1) + (m g l / 2) sin theta = 0, differentiated implicitly; the reaction carries the weight."""
    found = spring_rod().sensitivity(["A.angle", "A.fy"], analysis="equilibrium")
    a = found.values[0, 0]
    slope = 20 + G * np.cos(a)
    assert found["A.angle", "k"] == pytest.approx(-(a - 1) / slope, rel=1e-9)
    assert found["A.angle", "mass"] == pytest.approx(-G / 2 * np.sin(a) / slope, rel=1e-9)
    assert found["A.angle", "length"] == pytest.approx(-G * np.sin(a) / slope, rel=1e-9)
    assert found["A.fy", "mass"] == pytest.approx(G, rel=1e-9)
    assert found["A.fy", "k"] == pytest.approx(0, abs=1e-9)


def test_eigenvalues():
    """w^2 = (k + (m g l / 2) cos theta) / (m l^2 / 3) at the equilibrium, which moves too."""
    found = spring_rod().sensitivity(analysis="modes", about="equilibrium", verify=True)
    a = spring_rod().equilibrium()["A.angle"]

    def square(k, m, l, angle):
        return (k + m * G * l / 2 * np.cos(angle)) / (m * l * l / 3)

    slope = 20 + G * np.cos(a)
    by_k = (1 - G * np.sin(a) * -(a - 1) / slope) / (2 / 3)
    w = np.sqrt(square(20, 2, 1, a))
    k = int(np.argmax(found.values[0].imag))
    assert found.values[0, k] == pytest.approx(1j * w, rel=1e-9)
    assert found[f"eigenvalue {k}", "k"] == pytest.approx(1j * by_k / (2 * w), rel=1e-9)
    assert found.difference < 1e-5


def test_what_has_no_derivative_is_told():
    m = fb.Mechanism("wheel", planar=True, gravity=(0, -G), parameters={"m": 1.0})
    m.add(fb.Body("wheel", mass="m", inertia=1))
    m.add(fb.Revolute("axle", "ground", "wheel", at=(0, 0)))
    with pytest.raises(fb.SingularityError, match=r"no stiffness along wheel.angle"):
        m.sensitivity(["axle.fy"], analysis="equilibrium")


def test_what_does_not_exist_is_named():
    m = slider_crank()
    with pytest.raises(fb.ModelError, match="no parameter 'R'"):
        m.sensitivity(["slider.x"], ["R"])
    with pytest.raises(fb.ModelError, match="Body 'slider' has no curve 'xx'"):
        m.sensitivity(["slider.xx"], ["r"])
    with pytest.raises(fb.ModelError, match="unknown analysis 'motions'"):
        m.sensitivity(["slider.x"], ["r"], analysis="motions")
    with pytest.raises(fb.ModelError, match="give t_end"):
        m.sensitivity(["slider.x"], ["r"], analysis="motion")
    with pytest.raises(fb.ModelError, match="there is no parameter 'q'"):
        m.sensitivity(["slider.x"], ["r"])["slider.x", "q"]


def test_a_spring_is_tuned():
    """The stiffness at which a hanging rod swings at 1.5 Hz: k = w^2 m l^2 / 3 - m g l / 2."""
    m = fb.Mechanism("rod", planar=True, gravity=(0, -G), parameters={"k": 20.0})
    m.add(fb.Body("rod", mass=2, inertia=2 / 12, position=(0, -0.5)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.TorsionalSpringDamper("spring", joint="A", stiffness="k"))
    w = 2 * np.pi * 1.5
    assert m.optimize([], ["k"], analysis="modes", target=[1j * w]).parameters["k"] == pytest.approx(w * w * 2 / 3 - G)
    with pytest.raises(fb.ModelError, match="does not fit eigenvalue 0, eigenvalue 1"):
        m.optimize([], ["k"], analysis="modes", target=[1j * w, 2j * w, 3])
    found = m.optimize([], ["k"], analysis="modes", target=[1j * w, -1j * w])
    assert found.success
    assert found.parameters["k"] == pytest.approx(w * w * 2 / 3 - G, rel=1e-8)
    assert found.cost < 1e-12 < found.start_cost


def test_a_function_of_eigenvalues_is_minimised():
    """The damping at which a mass on a spring of 25 N/m loses e^-3 of its swing a second, at its own frequency."""
    m = fb.Mechanism("mass", planar=True, parameters={"k": 9.0, "c": 1.0})
    m.add(fb.Body("mass", mass=1, inertia=1, position=(1, 0)))
    m.add(fb.Translational("rail", "ground", "mass", at=(1, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("s", "ground", "mass", at=((0, 0), (1, 0)), stiffness="k", damping="c"))

    def off(values):
        return float(abs(values[0, 1] - (-3 + 4j)) ** 2)

    found = m.optimize([], {"k": (1, 100), "c": (0, 50)}, minimize=off, analysis="modes")
    assert found.parameters == pytest.approx({"k": 25.0, "c": 6.0}, rel=1e-4)


def test_a_slider_crank_is_fitted_and_a_stroke_is_minimised():
    m = slider_crank()
    wanted = m.sensitivity(["slider.x"], ["r"], analysis="motion", t_end=0.6, outputs=13).values
    found = m.optimize(
        ["slider.x"], {"r": (0.05, 0.3), "l": ("40 cm", 1.0)}, target=wanted, analysis="motion", t_end=0.6,
        outputs=13, parameters={"r": 0.15, "l": 0.6},
    )  # fmt: skip
    assert found.parameters == pytest.approx({"r": 0.2, "l": 0.5}, rel=1e-7)

    def stroke(values):
        return float(((values - values.mean()) ** 2).sum())

    least = m.optimize(["slider.x"], {"r": (0.1, 0.3)}, minimize=stroke, analysis="motion", t_end=0.6, outputs=7)
    assert least.parameters["r"] == pytest.approx(0.1)
    assert least.at_bound == ("r",)


def test_optimisation_asks_for_sense():
    m = slider_crank()
    with pytest.raises(fb.ModelError, match="either a target or a function"):
        m.optimize(["slider.x"], ["r"])
    with pytest.raises(fb.ModelError, match=r"does not fit slider\.x, slider\.vx"):
        m.optimize(["slider.x", "slider.vx"], ["r"], target=[0.3])
    assert m.optimize(["slider.x"], ["l"], target=["80 cm"]).parameters["l"] == pytest.approx(0.6)
    with pytest.raises(fb.ModelError, match="give the quantities"):
        m.sensitivity([], ["r"])
    with pytest.raises(fb.ModelError, match="no parameter 'rr'"):
        m.optimize(["slider.x"], ["rr"], target=[0.6])
    with pytest.raises(fb.ModelError, match=r"'r' starts at 0.2, outside its bound 0.3"):
        m.optimize(["slider.x"], {"r": (0.3, 0.4)}, target=[0.6])
