"""Momentum of bodies: closed forms, conservation, groups, points, sets of bodies, masses that change."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb


def pendulum() -> fb.Mechanism:
    m = fb.Mechanism("double pendulum", planar=True, gravity=(0, -9.81))
    m.add(
        fb.Body("upper", mass=2, inertia=0.1, position=(0.5, 0)),
        fb.Body("lower", mass=1, inertia=0.05, position=(1.4, 0)),
    )
    m.add(fb.Revolute("A", "ground", "upper", at=(0, 0)), fb.Revolute("B", "upper", "lower", at=(1, 0)))
    m.add(fb.Frame("tip", "lower", position=(0.6, 0)))
    return m


@pytest.fixture(scope="module")
def run() -> fb.Result:
    return pendulum().simulate(1.5, outputs=301, rtol=1e-9)


def test_momenta_of_a_pendulum_in_closed_form(run):
    upper = run.momentum("upper", about=(0, 0))
    np.testing.assert_allclose(upper.linear, 2 * run["upper"].velocity, rtol=1e-12)
    np.testing.assert_allclose(upper.angular, (0.1 + 2 * 0.5**2) * run["A.angle_rate"], rtol=1e-9)
    assert upper.about == "(0, 0) m"
    own = run.momentum("upper")
    np.testing.assert_allclose(own.angular, 0.1 * run["A.angle_rate"], rtol=1e-9, atol=1e-14)


def test_its_rate_is_the_force_and_moment_from_outside(run):
    """Force and moment about the pivot: reaction at A, and the weights (Euler's laws)."""
    whole = run.momentum(about=("0 mm", 0))
    force = run["A"].force + np.array([0.0, -9.81 * 3])
    rate = np.gradient(whole.linear, run.t, axis=0, edge_order=2)
    np.testing.assert_allclose(rate[2:-2], force[2:-2], atol=2e-3 * np.abs(force).max())
    moment = -9.81 * (2 * run["upper.x"] + run["lower.x"])
    turning = np.gradient(whole.angular, run.t, edge_order=2)
    np.testing.assert_allclose(turning[2:-2], moment[2:-2], atol=2e-3 * np.abs(moment).max())


def test_groups_add_and_points_move(run):
    whole, parts = run.momentum(about="tip"), [run.momentum(n, about="tip") for n in ("upper", "lower")]
    np.testing.assert_allclose(whole.angular, parts[0].angular + parts[1].angular, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(whole.linear, parts[0].linear + parts[1].linear, rtol=1e-12, atol=1e-12)
    central, p = run.momentum(), run["tip"].position
    arm = central.centre - p  # H_P = H_C + (C - P) x L
    transferred = central.angular + arm[:, 0] * central.linear[:, 1] - arm[:, 1] * central.linear[:, 0]
    np.testing.assert_allclose(whole.angular, transferred, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(central.centre, (2 * run["upper"].position + run["lower"].position) / 3, rtol=1e-12)


def test_a_free_body_keeps_its_angular_momentum_in_space():
    m = fb.Mechanism("stone")
    m.add(
        fb.Body("s", mass=2, inertia=(1, 2, 3), com=(0.1, 0.2, 0), velocity=(1, 0, 0.5), angular_velocity=(0.1, 5, 0.2))
    )
    k = m.simulate(3, outputs=31, rtol=1e-10).momentum("s")
    assert k.angular.shape == (31, 3)
    np.testing.assert_allclose(k.angular, np.broadcast_to(k.angular[0], (31, 3)), rtol=1e-7)
    np.testing.assert_allclose(k.linear, np.broadcast_to(k.linear[0], (31, 3)), rtol=1e-9)


def test_centroidal_momentum_of_recursive_dynamics_is_the_same():
    m = fb.Mechanism("arm", gravity=(0, 0, -9.81))
    m.add(fb.Body("a", mass=2, inertia=(0.1, 0.2, 0.3), position=(0.5, 0, 0)))
    m.add(fb.Body("b", mass=1, inertia=(0.03, 0.02, 0.01), position=(1.3, 0.2, 0)))
    m.add(
        fb.Revolute("A", "ground", "a", at=(0, 0, 0), axis=(0, 0.6, 0.8)),
        fb.Revolute("B", "a", "b", at=(1, 0, 0), axis=(1, 0, 1)),
    )
    run, p = m.simulate(0.5, outputs=6), m.prepare()
    q, v = (np.column_stack([run[f"{j}.{x}"] for j in "AB"]) for x in ("angle", "angle_rate"))
    h = p.momentum(q, v)
    k = run.momentum()
    np.testing.assert_allclose(np.c_[k.linear, k.angular], h, rtol=1e-9, atol=1e-12)


def test_sets_of_bodies_and_their_members():
    m = fb.Mechanism("shot", gravity=(0, 0, 0))
    m.add(
        fb.Bodies(
            "balls",
            shape=fb.Sphere(radius=0.1),
            density=1000,
            position=[(0, 0, 0), (1, 0, 0)],
            velocity=[(1, 0, 0), (0, 2, 0)],
        )
    )
    m.add(fb.Contact(friction=0.1))
    run = m.simulate(0.1, outputs=3)
    mass = 1000 * 4 / 3 * np.pi * 1e-3
    np.testing.assert_allclose(run.momentum("balls").linear[-1], mass * np.array([1, 2, 0]), rtol=1e-12)
    np.testing.assert_allclose(run.momentum("balls[1]", about=(0, 0, 0)).angular[-1], [0, 0, 2 * mass], rtol=1e-12)
    np.testing.assert_allclose(run.momentum().linear, run.momentum("balls").linear)


def test_a_mass_that_an_event_changes():
    m = fb.Mechanism("cart", planar=True, parameters={"load": 1.0})
    m.add(fb.Body("c", mass="load", inertia=1, velocity=(2, 0)), fb.Event("more", "t - 0.5", do=[fb.Set("load", 3)]))
    run = m.simulate(1, outputs=5)
    assert run.momentum("c").linear[[0, -1], 0] == pytest.approx([2, 6])


@pytest.mark.parametrize(
    ("names", "options", "message"),
    [
        (("uper",), {}, r"momentum: there is no moving body 'uper' \(did you mean 'upper'\?\)"),
        (("ground",), {}, r"momentum: there is no moving body 'ground'"),
        (("upper", "upper"), {}, r"momentum: 'upper' is given twice"),
        ((3,), {}, r"momentum: bodies are given by name, not by 3"),
        ((), {"about": "A"}, r"momentum: about='A' is no body or frame"),
        ((), {"about": (1, 2, 3)}, r"momentum: about must be 2 coordinates, a body, a frame or 'com', not \(1, 2, 3\)"),
        ((), {"about": ("1 kg", 0)}, r"about.*expected a length \[m\]"),
    ],
)  # fmt: skip
def test_what_is_no_body_or_point_is_refused(run, names, options, message):
    with pytest.raises(fb.FlyballError, match=message):
        run.momentum(*names, **options)


def test_it_prints_ranges_and_is_plotted(run, tmp_path):
    text = str(run.momentum())
    assert "about      the common mass centre" in text.replace("about           ", "about      ")
    assert "angular z" in text
    run.momentum().plot(tmp_path / "p.png")
