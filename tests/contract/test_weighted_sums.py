"""Elements along weighted sums of coordinates, and springs along paths, against other elements and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

SUM = {"coordinate": ["A.angle", "S.displacement"], "weights": [2.0, "-3 rad/m"]}


def wheel_and_slide(*elements, **start) -> fb.Mechanism:
    """A wheel of 0.5 kg m^2 and a slide of 2 kg, independent of each other but for the elements."""
    m = fb.Mechanism("pair", planar=True, parameters={"u": 0.7})
    m.add(fb.Body("wheel", mass=1, inertia=0.5), fb.Body("slide", mass=2, inertia=1, position=(1, 0)))
    m.add(fb.Revolute("A", "ground", "wheel", at=(0, 0)), fb.Prismatic("S", "ground", "slide", at=(1, 0), axis=(1, 0)))
    m.add(
        fb.Initial("A.angle", value=0.3, rate=start.get("spin", 0.4)),
        fb.Initial("S.displacement", value=0.1, rate=start.get("slip", -0.2)),
    )
    m.add(*elements)
    return m


def accelerations(m):
    p = m.prepare(coordinates="joint")
    return p.acceleration(0.0, np.array([0.3, 0.1]), np.array([0.4, -0.2])) * (0.5, 2.0)


X, RATE = 2 * 0.3 - 3 * 0.1, 2 * 0.4 + 3 * 0.2


@pytest.mark.parametrize(
    ("element", "effort"),
    [
        (fb.CoordinateSpring("e", **SUM, stiffness=5, damping=0.7, rest=0.2), -5 * (X - 0.2) - 0.7 * RATE),
        (fb.CoordinateSpring("e", **SUM, force="value*rate"), X * RATE),
        (fb.Actuator("e", **SUM, force="u + 3*value - rate"), 0.7 + 3 * X - RATE),
        (fb.Brake("e", **SUM, capacity=1.3), -1.3),
        (fb.Limit("e", **SUM, upper=0.1, stiffness=9, damping=0.5), -9 * (X - 0.1) - 0.5 * RATE),
        (fb.Limit("e", **SUM, lower=0.4, stiffness=9), 9 * (0.4 - X)),
    ],
)
def test_the_effort_on_each_coordinate_is_its_weight_times_that_of_the_sum(element, effort):
    """Virtual work: F dx with x = 2 angle - 3 displacement."""
    m = wheel_and_slide(element)
    np.testing.assert_allclose(accelerations(m), (2 * effort, -3 * effort), rtol=1e-13)
    p = m.prepare(coordinates="joint", specialize=True)
    np.testing.assert_allclose(p.acceleration(0.0, [0.3, 0.1], [0.4, -0.2]), (4 * effort, -1.5 * effort), rtol=1e-13)


def test_one_coordinate_with_a_weight():
    m = wheel_and_slide(fb.CoordinateSpring("e", ["A.angle"], weights=[2], stiffness=5, rest=0.1))
    np.testing.assert_allclose(accelerations(m), (-2 * 5 * (0.6 - 0.1), 0), rtol=1e-13)


def test_a_spring_along_a_sum_oscillates():
    """The sum of both motions: x'' = -k (w1^2 / J + w2^2 / m) x; and what it stores is in the balance."""
    m = wheel_and_slide(fb.CoordinateSpring("e", **SUM, stiffness=5))
    run = m.simulate(2.0, outputs=41, rtol=1e-10)
    w = np.sqrt(5 * (4 / 0.5 + 9 / 2))
    x = X * np.cos(w * run.t) + RATE / w * np.sin(w * run.t)
    np.testing.assert_allclose(run["e"].value, x, atol=1e-8)
    np.testing.assert_allclose(run["e"].rate, w * (-X * np.sin(w * run.t) + RATE / w * np.cos(w * run.t)), atol=1e-7)
    np.testing.assert_allclose(run["e"].energy, 2.5 * x**2, atol=1e-8)
    assert np.abs(run.energy.balance).max() < 1e-8


@pytest.mark.parametrize("method", ["auto", fb.Stepping(step=1e-3)], ids=["events", "impulse"])
def test_a_rigid_stop_of_a_sum(method):
    """It closes at the bound without rebound: the rate of the sum becomes zero, along M^-1 w."""
    m = wheel_and_slide(fb.Limit("e", **SUM, upper=1.0))
    run = m.simulate(1.0, outputs=21, method=method)
    x = 2 * run["A.angle"] - 3 * run["S.displacement"]
    assert x.max() < 1.0 + 2e-3
    impulse = -RATE / (4 / 0.5 + 9 / 2)
    np.testing.assert_allclose(run["A.rate"][-1], 0.4 + 2 * impulse / 0.5, rtol=1e-9)
    np.testing.assert_allclose(run["S.rate"][-1], -0.2 - 3 * impulse / 2, rtol=1e-9)


def test_a_brake_on_a_sum_locks_it():
    """It slows the sum down, then holds it as a coupling does; nothing stops the motion that leaves the sum alone."""
    m = wheel_and_slide(fb.Brake("e", **SUM, capacity=2.0))
    run = m.simulate(1.0, outputs=11)
    stop = RATE / (2.0 * (4 / 0.5 + 9 / 2))
    assert run.events[0].t == pytest.approx(stop, rel=1e-6)
    assert np.abs(run["e"].rate[-5:]).max() < 1e-10
    impulse = -2.0 * stop
    np.testing.assert_allclose(run["A.rate"][-1], 0.4 + 2 * impulse / 0.5, rtol=1e-7)


def test_a_sum_of_angles_of_several_turns():
    m = fb.Mechanism("wheels", planar=True)
    for k in range(2):
        m.add(fb.Body(f"w{k}", mass=1, inertia=1, position=(k, 0)), fb.Revolute(f"A{k}", "ground", f"w{k}", at=(k, 0)))
        m.add(fb.Initial(f"A{k}.angle", value=20.0 * k, rate=5.0))
    m.add(fb.CoordinateSpring("e", ["A0.angle", "A1.angle"], weights=[1, -1], stiffness=2, rest=-20))
    run = m.simulate(3.0, outputs=7)
    np.testing.assert_allclose(run["A1.angle"] - run["A0.angle"], 20.0, atol=1e-9)


def path(planar=True):
    m = fb.Mechanism("path", gravity=(0, -9.81, 0))
    m.add(
        fb.Body("a", mass=1, inertia=(0.1, 0.2, 0.3)), fb.Body("b", mass=2, inertia=(0.3, 0.2, 0.3), position=(1, 0, 0))
    )
    m.add(
        fb.Spherical("S", "ground", "a", at=(0, 0, 0)),
        fb.Universal("U", "a", "b", at=(0.7, 0, 0), axes=((0, 1, 0), (0, 0, 1))),
    )
    return m


def test_a_path_of_two_points_is_a_spring_between_them():
    ends, law = (
        ((0.2, 1, 0.1), (1.2, 0.2, 0)),
        {"stiffness": 30, "damping": 0.4, "length": 0.9, "force": "2 - length*rate"},
    )
    one, two = path(), path()
    one.add(fb.SpringDamper("s", "ground", "b", at=ends, **law))
    two.add(fb.PathSpring("s", ["ground", "b"], at=ends, **law))
    a, b = (m.simulate(0.5, outputs=6, rtol=1e-10, atol=1e-12) for m in (one, two))
    np.testing.assert_allclose(b["b"].position, a["b"].position, atol=1e-9)
    np.testing.assert_allclose(b["s"].tension, a["s"].force, atol=1e-7)
    np.testing.assert_allclose(b["s"].energy, a["s"].energy, atol=1e-8)


def test_a_taut_rope_is_a_spring_along_its_path():
    points = {"bodies": ["ground", "a", "b"], "at": ((0.2, 1, 0.1), (0.5, 0.1, 0), (1.2, 0.2, 0))}
    one, two = path(), path()
    one.add(fb.Rope("s", **points, stiffness=50, damping=1, length=0.5))
    two.add(fb.PathSpring("s", **points, stiffness=50, damping=1, length=0.5))
    a, b = (m.simulate(0.3, outputs=4, rtol=1e-10, atol=1e-12) for m in (one, two))
    assert a["s"].taut.all()
    np.testing.assert_allclose(b["s"].tension, a["s"].tension, rtol=1e-7)


def test_a_path_that_is_shorter_than_its_spring_pushes():
    m = path()
    m.add(
        fb.PathSpring(
            "s", ["ground", "a", "b"], at=((0.2, 1, 0.1), (0.5, 0.1, 0), (1.2, 0.2, 0)), stiffness=50, length=4
        )
    )
    run = m.simulate(0.1, outputs=3)
    np.testing.assert_allclose(run["s"].tension, 50 * (run["s"].length - 4), rtol=1e-12)
    assert (run["s"].tension < 0).all()


def test_an_input_along_a_sum_has_the_unit_of_its_effort():
    """Transfer from a torque along the sum to the wheel: weight / (J s^2) without springs."""
    m = wheel_and_slide(fb.Actuator("e", **SUM, force=0), spin=0, slip=0)
    found = m.linearize(["e"], ["A.angle", "e.value"])
    assert tuple(found.input_units) == ("N*m",)
    s = 0.7j
    gain = found.C @ np.linalg.solve(s * np.eye(len(found.A)) - found.A, found.B)
    np.testing.assert_allclose(gain[:, 0], np.array([2 / 0.5, 4 / 0.5 + 9 / 2]) / s**2, rtol=1e-12)
