"""Lookup tables of two arguments: values, derivatives, motions, equations, refusals."""

import numpy as np
import pytest
from scipy.interpolate import RectBivariateSpline, RegularGridInterpolator

import flyball as fb
from flyball.model.element import LawOf

X, Y = np.linspace(-1, 2, 9), np.array([0.0, 0.5, 0.8, 1.5, 2.0, 3.0])
Z = np.sin(X)[:, None] * np.exp(-0.3 * Y) + 0.1 * X[:, None] * Y


def law(text="u(t, 2*t)", **options):
    m = fb.Mechanism("tables")
    m.add(fb.Table2D("u", x=X, y=Y, z=Z, **options))
    found = m.law(text, LawOf(None), "law")
    return lambda t: found.evaluate({"t": t}, m.law_tables())


@pytest.mark.parametrize(
    ("interpolation", "other"),
    [
        ("cubic", lambda x, y: RectBivariateSpline(X, Y, Z).ev(x, y)),
        ("linear", lambda x, y: RegularGridInterpolator((X, Y), Z)(np.stack([x, y], axis=-1))),
    ],
)
@pytest.mark.parametrize("turned", [False, True])
def test_values_are_those_of_scipy(interpolation, other, turned):
    """Bicubic not-a-knot splines and bilinear interpolation, whichever argument has more points."""
    t = np.linspace(0.05, 1.45, 29)
    m = fb.Mechanism("tables")
    grid = {"x": Y, "y": X, "z": Z.T} if turned else {"x": X, "y": Y, "z": Z}
    m.add(fb.Table2D("u", interpolation=interpolation, **grid))
    found = m.law("u(2*t, t)" if turned else "u(t, 2*t)", LawOf(None), "law")
    assert found.evaluate({"t": t}, m.law_tables()) == pytest.approx(other(t, 2 * t), abs=1e-12)


def test_beyond_the_grid():
    assert np.isnan(law()(2.1))
    assert law(beyond="hold")(5.0) == pytest.approx(Z[-1, -1])
    flat = law("u(t, 1.5)", beyond="line", interpolation="linear")
    assert flat(4.0) == pytest.approx(Z[-1, 3] + 2.0 * (Z[-1, 3] - Z[-2, 3]) / (X[-1] - X[-2]))


def test_units():
    m = fb.Mechanism("units")
    m.add(fb.Table2D("u", x=(0, 100), y=(0, 1), z=[(0, 1), (2, 3)], x_unit="mm", z_unit="kN", interpolation="linear"))
    assert m.law("u(t, 0.5)", LawOf(None), "law").evaluate({"t": 0.05}, m.law_tables()) == pytest.approx(1500.0)


def motor(**options):
    """A motor's torque by speed and angle: c0 - c1 rate + c2 angle, which a bilinear table gives exactly."""
    speed, angle = np.linspace(-5, 20, 6), np.linspace(-1, 30, 5)
    torque = 4 - 0.5 * speed[:, None] + 0.2 * angle
    m = fb.Mechanism("motor", planar=True)
    m.add(fb.Table2D("map", x=speed, y=angle, z=torque, **options))
    m.add(fb.Body("rotor", mass=1, inertia=0.5), fb.Revolute("A", "ground", "rotor", at=(0, 0)))
    m.add(fb.Motor("motor", "A", torque="map(rate, angle)"))
    return m


@pytest.mark.parametrize("interpolation", ["cubic", "linear"])
@pytest.mark.parametrize("method", ["auto", "radau"])
def test_motion(interpolation, method, tmp_path):
    m = motor(interpolation=interpolation)
    r = m.simulate(1.5, outputs=16, method=method, rtol=1e-9)
    a = np.array([[0, 1, 0], [0.4, -1, 8], [0, 0, 0]])  # of (angle, rate, 1)
    w, V = np.linalg.eig(a)
    exact = [((V * np.exp(w * t)) @ np.linalg.solve(V, [0, 0, 1]))[0].real for t in r.t]
    assert r["A.angle"] == pytest.approx(exact, abs=1e-7)
    m.save(tmp_path / "motor.toml")
    assert fb.load(tmp_path / "motor.toml") == m


def test_equations_sensitivities_and_constraints():
    m = motor(interpolation="cubic")
    eq = m.symbolic()
    f = eq.f.at({"A.angle": 0.3, "A.angle'": 1.2})
    assert np.ravel(f)[0] == pytest.approx(4 - 0.6 + 0.06, rel=1e-9)
    pair = fb.Mechanism("surface", planar=True)
    pair.add(fb.Table2D("z", x=X, y=Y, z=Z))
    for k, name in enumerate("pqr"):
        pair.add(fb.Body(name, mass=1, inertia=1, position=(0, k)))
        pair.add(fb.Translational(f"s{name}", "ground", name, at=(0, k), axis=(1, 0)))
    pair.add(fb.Constraint("c", "sr.displacement - z(sp.displacement, sq.displacement)"))
    pair.add(fb.Driver("da", "sp.displacement", "0.4*t"), fb.Driver("db", "sq.displacement", "1 + 0.3*t"))
    r = pair.kinematics(np.linspace(0, 3, 7))
    spline = RectBivariateSpline(X, Y, Z)
    x, y = 0.4 * r.t, 1 + 0.3 * r.t
    assert r["sr.displacement"] == pytest.approx(spline.ev(x, y), abs=1e-10)
    rate = 0.4 * spline.ev(x, y, dx=1) + 0.3 * spline.ev(x, y, dy=1)
    assert r["sr.rate"] == pytest.approx(rate, abs=1e-9)
    second = 0.16 * spline.ev(x, y, dx=2) + 0.24 * spline.ev(x, y, dx=1, dy=1) + 0.09 * spline.ev(x, y, dy=2)
    assert r["sr.acceleration"] == pytest.approx(second, abs=1e-8)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"z": [(0, 1), (2, 3), (4, 5)]}, "z must have 2 rows of 2; it has 3 of 2"),
        ({"z": [(0, 1), (2,)]}, "it has 2 of 1 or 2"),
        ({"x": (1, 0)}, "must ascend"),
        ({"z": [(0, 1), (2, float("nan"))]}, "finite"),
        ({"name": "sin"}, "has a meaning"),
    ],
)
def test_refused(fields, message):
    m = fb.Mechanism("bad")
    with pytest.raises(fb.ModelError, match=message):
        m.add(fb.Table2D(**({"name": "u", "x": (0, 1), "y": (0, 1), "z": [(0, 1), (2, 3)]} | fields)))


def test_calls_with_a_wrong_number_of_arguments():
    with pytest.raises(fb.ExpressionError, match=r"write u\(x, y\)"):
        law("u(t)")
    with pytest.raises(fb.ExpressionError, match=r"give its argument: u\(x, y\)"):
        law("u + t")
