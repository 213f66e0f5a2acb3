"""The equations on plain arrays: against closed forms, against one another, from many threads."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy

import numpy as np
import pytest

import flyball as fb
from tests import mechanisms
from tests.examples.test_examples import PREPARED

LAYERS = ["absolute", "joint"]
G = 9.81


def double_pendulum() -> fb.Mechanism:
    """Rods of 1 m, 2 kg and of 0.5 m, 3 kg, hanging along -y."""
    m = fb.Mechanism("double", planar=True, gravity=(0, -G), parameters={"m": 3.0})
    m.add(fb.Body("a", mass=2, inertia=2 / 12, position=(0, -0.5)))
    m.add(fb.Body("b", mass="m", inertia="m*0.25/12", position=(0, -1.25)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(0, -1)))
    return m


def test_double_pendulum():
    """Mass matrix and accelerations of the textbook (angles of the joints: the second is relative)."""
    p = double_pendulum().prepare(coordinates="joint")
    assert p.names == ("A.angle", "B.angle")
    assert p.rows == ()
    q, v = np.array([0.4, -0.7]), np.array([1.3, -0.6])
    l1, c1, c2, m1, m2, I1, I2 = 1.0, 0.5, 0.25, 2.0, 3.0, 2 / 12, 3 * 0.25 / 12
    h = m2 * l1 * c2
    M12 = I2 + m2 * c2**2 + h * np.cos(q[1])
    M11 = I1 + m1 * c1**2 + m2 * l1**2 + 2 * h * np.cos(q[1]) + I2 + m2 * c2**2
    M = np.array([[M11, M12], [M12, I2 + m2 * c2**2]])
    s = h * np.sin(q[1])
    bias = np.array([s * (2 * v[0] * v[1] + v[1] ** 2), -s * v[0] ** 2])
    low = m2 * c2 * np.sin(q.sum())
    f = bias - G * np.array([(m1 * c1 + m2 * l1) * np.sin(q[0]) + low, low])
    np.testing.assert_allclose(p.mass_matrix(q), M, rtol=1e-13)
    np.testing.assert_allclose(p.forces(0.0, q, v), f, rtol=1e-12)
    np.testing.assert_allclose(p.acceleration(0.0, q, v), np.linalg.solve(M, f), rtol=1e-12)
    np.testing.assert_allclose(p.rates(q, v), v)
    tip, R = p.pose("b", q)
    np.testing.assert_allclose(tip[:2], [np.sin(0.4) - 0.25 * np.sin(0.3), -np.cos(0.4) - 0.25 * np.cos(0.3)])
    np.testing.assert_allclose(R[:2, 0], [np.cos(-0.3), np.sin(-0.3)])


@pytest.mark.parametrize("wrong", [[1j, 0.0], ["a", "b"], [True, False], [None, 0.0]])
def test_what_is_no_real_number_is_refused(wrong):
    p = double_pendulum().prepare(coordinates="joint")
    with pytest.raises(fb.ModelError, match=r"v contains \w+ numbers; coordinates, velocities and forces are real"):
        p.acceleration(0.0, p.q, np.array(wrong))


def somewhere(p) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(1)
    return p.step(p.q, 1e-3 * random.normal(size=len(p.v))), random.normal(size=len(p.v))


@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize("name", PREPARED)
def test_the_equations_fit_together(name, layer):
    """M vdot = f + G^T lam + effort; G is the derivative of g; M is that of the bodies' kinetic energies."""
    m = mechanisms.example(name)
    try:
        p = m.prepare(coordinates=layer)
    except fb.AnalysisError:
        pytest.skip("friction with redundant joints has no joint coordinates")
    q, v = somewhere(p)
    x, lam = p.acceleration(0.0, p.q, p.v), p.multipliers(0.0, p.q, p.v)
    terms = [p.mass_matrix(p.q) @ x, p.forces(0.0, p.q, p.v), p.jacobian(0.0, p.q).T @ lam, p.efforts(0.0, p.q, p.v)]
    size = max(np.abs(a).max(initial=0.0) for a in terms)
    np.testing.assert_allclose(terms[0], terms[1] + terms[2] + terms[3], atol=1e-8 * size)
    J = np.zeros((len(p.rows), len(p.v)))
    holonomic = [r.holonomic for r in p._start.compiled.structure.rows]
    if not any(d.law for d in m.drivers):
        for k, e in enumerate(np.eye(len(p.v))):
            h = 1e-5
            J[:, k] = (p.constraint(0.0, p.step(q, h * e)) - p.constraint(0.0, p.step(q, -h * e))) / (2 * h)
        # bodies of a loop that hang on one free body turn its gap with them, which G, made for closed loops, leaves out
        gap = np.abs(p.constraint(0.0, q)).max() if name == "car.toml" else 0.0
        np.testing.assert_allclose(J[holonomic], p.jacobian(0.0, q)[holonomic], atol=3e-6 + gap)
    energy = 0.0
    for b in m.bodies:
        x, R = p._start.compiled.values.bodies[b.name], p.pose(b.name, q)[1]
        rates = p.frame_jacobian(b.name, q) @ v
        w, u = rates[3:], rates[:3] + np.cross(rates[3:], R @ x.com)
        inertia = np.diag([0, 0, x.inertia[2, 2]]) if m.planar else x.inertia
        energy += 0.5 * (x.mass * u @ u + (R.T @ w) @ inertia @ (R.T @ w))
    assert 0.5 * v @ p.mass_matrix(q) @ v == pytest.approx(energy, rel=1e-10)


@pytest.mark.parametrize("layer", LAYERS)
def test_motions_are_those_of_the_mechanism(layer):
    m = double_pendulum()
    p = m.prepare(coordinates=layer, parameters={"m": 4.0})
    assert p.parameters == {"m": 4.0}
    m.add(fb.Driver("d", "A.angle", "t"))  # is not seen
    m.drivers.clear()
    a = p.simulate(0.5, outputs=11)
    b = m.simulate(0.5, outputs=11, coordinates=layer, parameters={"m": 4.0})
    assert a.q.tobytes() == b.q.tobytes()
    assert p.simulate(0.5, parameters={"m": 3.0})["b"].x[-1] == m.simulate(0.5, coordinates=layer)["b"].x[-1]
    with pytest.raises(fb.ModelError, match="coordinates were chosen"):
        p.simulate(0.5, coordinates="joint")


def test_answers_do_not_depend_on_who_asks_or_asked():
    p = mechanisms.example("andrews.toml").prepare()
    random = np.random.default_rng(0)
    states = [(p.step(p.q, 0.3 * random.normal(size=len(p.v))), random.normal(size=len(p.v))) for _ in range(40)]
    wanted = [p.acceleration(0.0, *s).tobytes() for s in states]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda k: p.acceleration(0.0, *states[k]).tobytes(), [*range(40), *range(39, -1, -1)]))
    assert found == wanted + wanted[::-1]


def test_wrong_arguments_are_refused():
    p = double_pendulum().prepare()
    with pytest.raises(fb.ModelError, match=r"q has the shape \(3,\); 'double' has 2 numbers there"):
        p.mass_matrix(np.zeros(3))
    with pytest.raises(fb.ModelError, match="no part named 'c'"):
        p.pose("c", p.q)
    with pytest.raises(fb.ModelError, match="Revolute 'A' has no pose"):
        p.pose("A", p.q)
    with pytest.raises(ValueError, match="read-only"):
        p.q[0] = 1.0
    with pytest.raises(fb.ModelError, match="'q' cannot be set: a prepared mechanism is constant"):
        p.q = np.ones(2)
    p.parameters["m"] = 5.0
    assert p.parameters == {"m": 3.0}
    m = double_pendulum()
    m.add(fb.Motor("M", "A", torque="sqrt(1 - t)"))
    with pytest.raises(fb.AnalysisError, match="at t = 2 s"):
        m.prepare().acceleration(2.0, p.q, p.v)


@pytest.mark.parametrize("layer", ["absolute", "joint"])
def test_mass_matrix_of_bodies_that_only_drivers_keep_from_being_points(layer):
    m = fb.Mechanism("driven point", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Body("b", mass=2, inertia=0, position=(1, 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
    m.add(fb.Driver("spin", "B.angle", "t"))
    p = m.prepare(coordinates=layer)
    wanted = np.diag([1.0, 1.0, 0.1, 2.0, 2.0, 0.0]) if layer == "absolute" else np.diag([0.35 + 2.0, 0.0])
    assert p.mass_matrix(p.q) == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("layer", ["absolute", "joint"])
def test_what_is_not_finite_is_refused(layer):
    """Fully driven, nothing is solved for, and nothing came of it but zeros."""
    m = fb.Mechanism("driven", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Driver("spin", "A.angle", "t**2"))
    p = m.prepare(coordinates=layer)
    assert p.acceleration(0, p.q, p.v)[-1] == pytest.approx(2.0)
    for ask in (p.acceleration, p.multipliers, p.efforts, p.forces):
        with pytest.raises(fb.ModelError, match="q of 'driven' is not finite"):
            ask(0.0, p.q * np.nan, p.v)
        with pytest.raises(fb.ModelError, match="v of 'driven' is not finite"):
            ask(0.0, p.q, p.v + np.inf)
        for t in (np.nan, np.inf, "1 s", None):
            with pytest.raises(fb.ModelError, match="t is a finite number of seconds"):
                ask(t, p.q, p.v)
    with pytest.raises(fb.ModelError, match="q of 'driven' is not finite"):
        p.mass_matrix(p.q * np.nan)


@pytest.mark.parametrize("layer", ["joint", "absolute"])
def test_cams_far_from_the_start(layer):
    """The follower is where the profile is nearest there, not where Newton's method leads from the start."""
    m = mechanisms.example("cam.py")
    run = m.simulate(0.2, outputs=9, coordinates=layer)
    p = m.prepare(coordinates=layer)
    for k in range(1, 9):
        np.testing.assert_allclose(p.constraint(run.t[k], run.q[k]), 0.0, atol=1e-9)
        found = p.acceleration(run.t[k], run.q[k], run.v[k])
        np.testing.assert_allclose(found, run.vdot[k], rtol=1e-6, atol=1e-6)


def test_pickled_and_copied():
    p = double_pendulum().prepare()
    wanted = p.acceleration(0.0, p.q, p.v)
    for other in (pickle.loads(pickle.dumps(p)), deepcopy(p)):
        assert np.array_equal(other.acceleration(0.0, p.q, p.v), wanted)
        assert np.array_equal(other.mass_matrix(p.q), p.mass_matrix(p.q))


def wound_spring():
    m = fb.Mechanism("wound", planar=True, gravity=None)
    m.add(fb.Body("a", mass=1, inertia=2), fb.Body("b", mass=1, inertia=0.5))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(0, 0)))
    m.add(fb.TorsionalSpringDamper("s", "A", stiffness=2.0), fb.TorsionalSpringDamper("r", "B", stiffness=3.0))
    return m


@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize("first", [0.3, 3.2, 7.0, -40.0])
@pytest.mark.parametrize("second", [-0.2, 3.2, -9.0])
def test_whole_turns_count_in_the_plane(layer, first, second):
    """Springs of 2 and 3 N m/rad about concentric hinges, wound up by any number of turns."""
    p = wound_spring().prepare(coordinates=layer)
    q, v = (np.array([first, second]), np.zeros(2)) if layer == "joint" else (p.q.copy(), np.zeros(6))
    if layer == "absolute":
        q[[2, 5]] = first, first + second
    torque = np.array([-2 * first + 3 * second, -3 * second])
    found = p.acceleration(0.0, q, v)
    found = np.cumsum(found) if layer == "joint" else found[[2, 5]]
    np.testing.assert_allclose(found, torque / (2, 0.5), rtol=1e-12)


def test_whole_turns_count_where_a_joint_is_told_how_many_it_starts_with():
    """The start is two turns on, and coordinates of bodies are not."""
    for layer in LAYERS:
        m = wound_spring()
        m.add(fb.Initial("A.angle", value=4 * np.pi))
        p = m.prepare(coordinates=layer)
        more = 5.0 * np.ones(len(p.q)) if layer == "joint" else np.array([0, 0, 5.0, 0, 0, 10.0])
        found = p.acceleration(0.0, p.q + more, np.zeros(len(p.v)))
        found = np.cumsum(found) if layer == "joint" else found[[2, 5]]
        torque = np.array([-2 * (4 * np.pi + 5.0) + 15, -15])
        np.testing.assert_allclose(found, torque / (2, 0.5), rtol=1e-11)


def test_whole_turns_count_in_space_where_they_are_coordinates():
    m = fb.Mechanism("wound", gravity=None)
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 2)), fb.Revolute("A", "ground", "b", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.TorsionalSpringDamper("s", "A", stiffness=3.0))
    p = m.prepare(coordinates="joint")
    found = [p.acceleration(0.0, [x], [0.0])[0] for x in (3.0, 3.2, 7.0, -20.0)]
    np.testing.assert_allclose(found, [-4.5, -4.8, -10.5, 30.0], rtol=1e-12)


@pytest.mark.parametrize("layer", LAYERS)
def test_whole_turns_of_what_a_driver_prescribes(layer):
    """The driver turns 2 t, and a spring of 3 N m/rad between it and ground wants 6 t of it."""
    m = fb.Mechanism("driven", planar=True, gravity=None)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.Driver("D", "A.angle", "2*t"), fb.TorsionalSpringDamper("s", "A", stiffness=3.0))
    p = m.prepare(coordinates=layer)
    for t in (1.0, 2.0, 10.0):
        q = p.q.copy()
        q[-1] = 2 * t
        found = p.efforts(t, q, [2.0]) if layer == "joint" else p.multipliers(t, q, [0, 0, 2.0])
        assert abs(found).max() == pytest.approx(6 * t)
