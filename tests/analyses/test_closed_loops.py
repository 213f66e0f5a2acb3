"""Recursive dynamics with closed loops: against the engine, closed forms, and forwards against backwards."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb


def four_bar():
    m = fb.Mechanism("four-bar", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("crank", mass=0.4, inertia=0.0015, position=(0, 0.1)))
    m.add(fb.Body("coupler", mass=1.2, inertia=0.034, position=(0.25, 0.35)))
    m.add(fb.Body("rocker", mass=1.0, inertia=0.022, position=(0.55, 0.25)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "coupler", at=(0, 0.2)))
    m.add(fb.Revolute("C", "coupler", "rocker", at=(0.5, 0.5)), fb.Revolute("D", "ground", "rocker", at=(0.6, 0)))
    return m


def spatial_four_bar():
    """The same in space: three of its rows depend on the others."""
    m = fb.Mechanism("redundant", gravity=(0, -9.81, 0))
    for e in four_bar().bodies:
        m.add(fb.Body(e.name, mass=e.mass, inertia=(e.inertia,) * 3, position=(*e.position, 0)))
    for e in four_bar().joints:
        m.add(fb.Revolute(e.name, e.body_i, e.body_j, at=(*e.at, 0), axis=(0, 0, 1)))
    return m


@pytest.fixture(scope="module", params=[four_bar, spatial_four_bar])
def case(request):
    """A prepared mechanism and consistent states: those of a motion."""
    m = request.param()
    p = m.prepare(coordinates="joint")
    run = p.simulate(1.0, outputs=8, rtol=1e-10)
    return p, run.q, run.v


def test_forward_dynamics_is_the_engines(case):
    p, q, v = case
    a = p.aba(q, v, np.zeros(len(p.v)))
    np.testing.assert_allclose(a, [p.acceleration(0.0, *x) for x in zip(q, v, strict=True)], rtol=1e-8, atol=1e-8)
    np.testing.assert_array_equal(p.aba(q[3], v[3], np.zeros(len(p.v))), p.aba(q[3:4], v[3:4], np.zeros(len(p.v)))[0])
    tau = np.zeros(len(p.v))
    tau[p.names.index("A.angle")] = 2.5
    m = p.model.changed({})
    m.add(fb.Motor("motor", "A", torque="2.5"))
    driven = m.prepare(coordinates="joint")
    wanted = [driven.acceleration(0.0, *x) for x in zip(q, v, strict=True)]
    np.testing.assert_allclose(p.aba(q, v, tau), wanted, rtol=1e-8, atol=1e-8)


def test_the_equations_are_satisfied(case):
    """M a = tau - bias + G^T lam with the engine's Jacobian."""
    p, q, v = case
    tau = np.linspace(-1, 1, len(p.v))
    a, lam = p.aba(q[2], v[2], tau), p.loop_multipliers(q[2], v[2], tau)
    G = p.jacobian(0.0, q[2])
    left = p.mass_matrix(q[2]) @ a + p.bias_forces(q[2], v[2]) - tau
    np.testing.assert_allclose(G.T @ lam, left, atol=1e-9)


def test_backwards(case):
    """The torque of the crank that gives an acceleration, and the acceleration that this torque gives."""
    p, q, v = case
    B, c = p.dependent_velocities(q, v, ["A.angle"])
    np.testing.assert_allclose((B @ v[:, [p.names.index("A.angle")], None])[..., 0], v, atol=1e-7)
    a = 3.0 * B[..., 0] + c
    torque = p.rnea(q, v, a, drives=["A.angle"])
    tau = np.zeros((len(q), len(p.v)))
    tau[:, p.names.index("A.angle")] = torque[:, 0]
    np.testing.assert_allclose(p.aba(q, v, tau), a, rtol=1e-9, atol=1e-9)
    out = np.empty((len(q), 1))
    assert p.rnea(q, v, a, drives=["A.angle"], out=out) is out
    np.testing.assert_array_equal(out, torque)
    with pytest.raises(fb.AnalysisError, match="accelerations do not satisfy the constraints"):
        p.rnea(q, v, a + 0.1, drives=["A.angle"])
    reduced = p.reduced_mass_matrix(q, ["A.angle"])  # the change of the torque per acceleration
    more = p.rnea(q, v, a + B[..., 0], drives=["A.angle"])
    np.testing.assert_allclose(reduced[:, 0, 0], (more - torque)[:, 0], rtol=1e-7)
    w = 1.7  # twice the kinetic energy
    energy = p.energies(q, w * B[..., 0])[:, 0]
    np.testing.assert_allclose(reduced[:, 0, 0] * w**2, 2 * energy, rtol=1e-9)


def equations_with_loops(p, q, v, tau):
    """Accelerations of M a = tau - bias + G^T lam, G a = gamma at any state, by a dense solve."""
    rows, M = p._loops().rows_at(q[None], v[None]), p.mass_matrix(q)
    G, n, nr = rows.jacobian[0], len(v), len(p.rows)
    K = np.block([[M, -G.T], [G, np.zeros((nr, nr))]])
    return (np.linalg.pinv(K, rcond=1e-10) @ np.r_[tau - p.bias_forces(q, v), rows.gamma[0]])[:n]


def test_derivatives(case):
    """Of the equations, also off the constraints; and along a motion."""
    p, q, v = case
    tau = np.linspace(-1, 1, len(p.v))
    by_q, by_v, by_tau = p.aba_derivatives(q, v, tau)
    h = 1e-5
    for i in (2, 5):
        for k, e in enumerate(h * np.eye(len(p.v))):
            moved = [equations_with_loops(p, p.step(q[i], s * e), v[i], tau) for s in (1, -1)]
            turned = [equations_with_loops(p, q[i], v[i] + s * e, tau) for s in (1, -1)]
            size = max(abs(by_q[i]).max(), abs(by_v[i]).max())
            np.testing.assert_allclose((moved[0] - moved[1]) / (2 * h), by_q[i, :, k], atol=1e-8 * size)
            np.testing.assert_allclose((turned[0] - turned[1]) / (2 * h), by_v[i, :, k], atol=1e-8 * size)
    np.testing.assert_allclose(p.aba(q, v, 2 * tau) - p.aba(q, v, tau), by_tau @ tau, rtol=1e-7, atol=1e-7)
    run = p.simulate(0.5002, outputs=[0.4998, 0.5, 0.5002], rtol=1e-12)
    a = p.aba(run.q, run.v, 0 * tau)
    by_q, by_v, _ = p.aba_derivatives(run.q[1], run.v[1], 0 * tau)
    np.testing.assert_allclose((a[2] - a[0]) / 4e-4, by_q @ run.v[1] + by_v @ a[1], atol=1e-4 * abs(a).max())


def test_derivatives_see_no_springs_and_inverse_mass_is_reduced(case):
    p, q, v = case
    m = p.model.changed({})
    m.add(fb.CoordinateSpring("spring", "A.angle", stiffness=50, damping=5))
    if m.planar:
        m.add(fb.JointFriction("friction", "C", radius=0.1, static=0.3))
    damped = m.prepare(coordinates="joint")
    tau = np.ones(len(p.v))
    for x, y in zip(damped.aba_derivatives(q, v, tau), p.aba_derivatives(q, v, tau), strict=True):
        np.testing.assert_allclose(x, y, atol=1e-12 * abs(y).max())
    B, _ = p.dependent_velocities(q, v, ["A.angle"])
    inverse = B @ np.linalg.inv(p.reduced_mass_matrix(q, ["A.angle"])) @ np.swapaxes(B, 1, 2)
    np.testing.assert_allclose(p.aba_derivatives(q, v, tau).by_force, inverse, atol=1e-9 * abs(inverse).max())


def test_bound_calls(case):
    p, q, v = case
    tau = np.ones_like(v)
    out = np.zeros_like(v)
    p.bind("aba", q, v, tau, out)()
    np.testing.assert_array_equal(out, p.aba(q, v, tau))
    outs = p.aba_derivatives(q, v, 0 * tau)
    p.bind("aba_derivatives", q, v, tau, outs)()
    np.testing.assert_array_equal(outs, p.aba_derivatives(q, v, tau))
    with pytest.raises(fb.ModelError, match="threads are for"):
        p.aba_derivatives(q, v, tau, threads=2)


def parallelogram(flat: bool):
    """Three cranks of one length on a bar, which may turn either way where they are flat."""
    m = fb.Mechanism("parallelogram", planar=True, gravity=(0, -9.81))
    x, y = (1.0, 0.0) if flat else (0.0, 1.0)
    for k in range(3):
        m.add(fb.Body(f"crank{k}", mass=1, inertia=0.1, position=(k + x / 2, y / 2)))
    m.add(fb.Body("bar", mass=1, inertia=0.1, position=(1 + x, y)))
    for k in range(3):
        m.add(fb.Revolute(f"A{k}", "ground", f"crank{k}", at=(k, 0)))
        m.add(fb.Revolute(f"B{k}", f"crank{k}", "bar", at=(k + x, y)))
    return m


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("turned", [0.0, 1e-12])
def test_a_singular_position_is_refused(turned, flat):
    """Where the cranks are flat no number is right, also if that is the start; elsewhere they are."""
    p = parallelogram(flat).prepare(coordinates="joint")

    def at(angle):
        q = p.q.copy()
        for d, name in enumerate(p.names):
            q[d] += (angle if flat else angle - np.pi / 2) * (1 if name.startswith("A") else -1)
        assert abs(p.constraint(0.0, q)).max() < 1e-12
        return q

    zero, tau = np.zeros(len(p.v)), np.ones(len(p.v))
    for method in (p.aba, p.loop_multipliers, p.aba_derivatives):
        with pytest.raises(fb.AnalysisError, match="singular position"):
            method(at(turned), zero, tau)
    bodies = parallelogram(flat).bodies
    lever = sum(b.mass for b in bodies[:3]) / 4 + bodies[3].mass + sum(b.inertia for b in bodies[:3])
    angle = p.names.index("A0.angle")
    a = p.aba(at(1.0), zero, 0 * tau)
    np.testing.assert_allclose(a[angle], -9.81 * (1.5 + 1.0) * np.cos(1.0) / lever, rtol=1e-9)


def test_an_infinitesimal_mechanism_is_refused():
    """Two bars in line between fixed points: the middle moves by no finite amount."""
    m = fb.Mechanism("shaky", planar=True)
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Body("b", mass=1, inertia=0.1, position=(1.5, 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
    m.add(fb.Revolute("C", "b", "ground", at=(2, 0)))
    p = m.prepare(coordinates="joint")
    with pytest.raises(fb.AnalysisError, match="singular position"):
        p.aba(p.q, p.v, np.ones(len(p.v)))


def test_numbers_that_overflow():
    p = four_bar().prepare(coordinates="joint")
    B, _ = p.dependent_velocities(p.q, np.zeros(len(p.v)), ["A.angle"])
    with pytest.raises(fb.AnalysisError, match="'four-bar': the results at state 0 are not finite"):
        p.aba(p.q, 1e200 * B[:, 0], np.zeros(len(p.v)))


def test_rest_in_balance_is_no_singular_position():
    """Nothing accelerates, and rounding in dependent rows is no contradiction; light and heavy links side by side."""
    m = spatial_four_bar().changed(
        {"rocker": fb.Body("rocker", mass=1e-9, inertia=(1e-12,) * 3, position=(0.55, 0.25, 0))}
    )
    p = m.prepare(coordinates="joint")
    tau = p.gravity_forces(p.q)
    np.testing.assert_allclose(p.aba(p.q, np.zeros(len(p.v)), tau), 0.0, atol=1e-6)


def test_gears_count_turns():
    """A coupling of angles far beyond a whole turn, in closed form."""
    m = fb.Mechanism("gears", planar=True)
    m.add(fb.Body("a", mass=1, inertia=0.2), fb.Body("b", mass=1, inertia=0.3, position=(1, 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "ground", "b", at=(1, 0)))
    m.add(fb.Coupler("gear", ["A.angle", "B.angle"], weights=[1, 2]))
    p = m.prepare(coordinates="joint")
    q = np.array([[20.0, -10.0], [-90.0, 45.0]])
    np.testing.assert_allclose(p.aba(q, [0.0, 0.0], [1.0, 0.0])[:, 0], 1 / (0.2 + 0.3 / 4), rtol=1e-12)


def test_bad_input():
    p = four_bar().prepare(coordinates="joint")
    zero = np.zeros(len(p.v))
    with pytest.raises(fb.AnalysisError, match=r"state 0 violates the constraints of 'four-bar': 'C: .*' is off by"):
        p.aba(p.q + 0.3, zero, zero)
    with pytest.raises(fb.AnalysisError, match="the velocities of state 0 violate"):
        p.aba(p.q, zero + 1.0, zero)
    with pytest.raises(fb.AnalysisError, match=r"A\.angle, B\.angle are not independent"):
        p.dependent_velocities(p.q, zero, ["A.angle", "B.angle"])
    with pytest.raises(fb.ModelError, match=r"'E\.angle' is no velocity"):
        p.rnea(p.q, zero, zero, drives=["E.angle"])
    with pytest.raises(fb.ModelError, match="give a list of names"):
        p.reduced_mass_matrix(p.q, "A.angle")
    five = fb.Mechanism("two", planar=True)
    five.add(fb.Body("a", mass=1, inertia=1), fb.Body("b", mass=1, inertia=1, position=(1, 0)))
    five.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "ground", "b", at=(1, 0)))
    t = five.prepare(coordinates="joint")
    with pytest.raises(fb.AnalysisError, match="cannot give these accelerations"):
        t.rnea([0.0, 0.0], [0.0, 0.0], [1.0, 1.0], drives=["A.angle"])
    m = four_bar()
    m.add(fb.Driver("motor", "A.angle", "t"))
    d = m.prepare(coordinates="joint")
    with pytest.raises(fb.AnalysisError, match="has drivers or curves"):
        d.aba(d.q, d.v, np.zeros(len(d.v)))
