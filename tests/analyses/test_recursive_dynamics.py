"""Recursive dynamics on arrays: against closed forms, sums over bodies, differences, and the equations of motion."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.codegen.batch_code import LARGEST_ANGLE, sine_and_cosine

G = 9.81


def forest() -> fb.Mechanism:
    """Two trees with every kind of tree joint; one of them is free, and begins far from the world's origin."""
    rng = np.random.default_rng(5)
    m = fb.Mechanism("forest", gravity=(0.3, -1, -9.81))
    inertia = ((0.3, 0.01, 0.02), (0.01, 0.4, 0.03), (0.02, 0.03, 0.5))
    for k in range(8):
        m.add(fb.Body(f"b{k}", mass=1 + 0.3 * k, inertia=inertia, position=tuple(rng.normal(size=3) + (3.0, 0, 0))))
    at = [tuple(x) for x in rng.normal(size=(7, 3)) + (3.0, 0, 0)]
    axis = [tuple(x) for x in rng.normal(size=(4, 3))]
    m.add(fb.Revolute("r1", "b0", "b1", at=at[0], axis=axis[0]), fb.Spherical("s2", "b1", "b2", at=at[1]))
    m.add(fb.Prismatic("p3", "b2", "b3", at=at[2], axis=axis[1]))
    m.add(fb.Universal("u4", "b0", "b4", at=at[3], axes=((1, 0, 0), (0, 1, 0))))
    m.add(fb.Revolute("r5", "ground", "b5", at=at[4], axis=axis[2]))
    m.add(fb.Cylindrical("c6", "b5", "b6", at=at[5], axis=axis[3]), fb.Fixed("f7", "b6", "b7", at=at[6]))
    m.add(fb.Frame("tool", "b3", position=(0.1, 0.2, 0.3), orientation=(0.1, 0.2, 0.3)))
    return m


def state(p, seed=0, k=None):
    rng = np.random.default_rng(seed)
    n = len(p.v)
    q = np.array([p.step(p.q, rng.normal(size=n)) for _ in range(k or 1)])
    v, a = rng.normal(size=(2, k or 1, n))
    return (q, v, a) if k else (q[0], v[0], a[0])


@pytest.fixture(scope="module", params=[False, True], ids=["general", "specialized"])
def p(request):
    return forest().prepare(coordinates="joint", specialize=request.param)


def test_double_pendulum():
    """Two rods of length l: the equations of any textbook, in angles relative to the rod before."""
    l, m1, m2 = 0.7, 1.3, 0.9
    m = fb.Mechanism("two", planar=True, gravity=(0, -G))
    m.add(fb.Body("A", mass=m1, inertia=m1 * l**2 / 12, position=(l / 2, 0)))
    m.add(fb.Body("B", mass=m2, inertia=m2 * l**2 / 12, position=(1.5 * l, 0)))
    m.add(fb.Revolute("J", "ground", "A", at=(0, 0)), fb.Revolute("K", "A", "B", at=(l, 0)))
    p = m.prepare(coordinates="joint")
    rng = np.random.default_rng(0)
    q, v, a = rng.normal(size=(3, 2))
    c, s = np.cos(q[1]), np.sin(q[1])
    m12 = m2 * l**2 * (1 / 3 + c / 2)
    M = np.array([[m1 * l**2 / 3 + m2 * l**2 * (4 / 3 + c), m12], [m12, m2 * l**2 / 3]])
    h = -0.5 * m2 * l**2 * s * np.array([2 * v[0] * v[1] + v[1] ** 2, -(v[0] ** 2)])
    g2 = m2 * G * l / 2 * np.cos(q[0] + q[1])
    g = np.array([(m1 / 2 + m2) * G * l * np.cos(q[0]) + g2, g2])
    np.testing.assert_allclose(p.crba(q), M, rtol=1e-13)
    np.testing.assert_allclose(p.gravity_forces(q), g, rtol=1e-13)
    np.testing.assert_allclose(p.bias_forces(q, v), h + g, rtol=1e-12)
    np.testing.assert_allclose(p.rnea(q, v, a), M @ a + h + g, rtol=1e-12)
    np.testing.assert_allclose(p.aba(q, v, M @ a + h + g), a, rtol=1e-11)


def test_sums_over_bodies(p):
    """Mass matrix, momenta and energy from the Jacobians of the bodies, whose centres are their origins here."""
    q, v, _ = state(p)
    M, h, centre = np.zeros((len(v), len(v))), np.zeros(6), p.centre_of_mass(q)
    kinetic = potential = total = 0.0
    for b in p.model.bodies:
        J, (x, R) = p.frame_jacobian(b.name, q), p.pose(b.name, q)
        inertia = R @ np.array(b.inertia) @ R.T
        M += b.mass * J[:3].T @ J[:3] + J[3:].T @ inertia @ J[3:]
        momentum = b.mass * J[:3] @ v
        h += np.r_[momentum, inertia @ J[3:] @ v + np.cross(x - centre, momentum)]
        kinetic += 0.5 * (momentum @ J[:3] @ v + (J[3:] @ v) @ inertia @ (J[3:] @ v))
        potential -= b.mass * np.array(p.model.gravity) @ x
        total += b.mass * x
    np.testing.assert_allclose(p.crba(q), M, atol=1e-12 * abs(M).max())
    np.testing.assert_allclose(p.momentum(q, v), h, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(p.centroidal_momentum_matrix(q) @ v, h, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(p.energies(q, v), (kinetic, potential), rtol=1e-12)
    np.testing.assert_allclose(centre, total / sum(b.mass for b in p.model.bodies), rtol=1e-12)


def test_agreement_with_the_equations_of_motion(p):
    """Of the engine, which computes gyroscopic terms and accelerations by other formulas."""
    q, v, a = state(p)
    np.testing.assert_allclose(p.bias_forces(q, v), -p.forces(0.0, q, v), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(p.aba(q, v, np.zeros(len(v))), p.acceleration(0.0, q, v), rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(p.aba(q, v, p.rnea(q, v, a)), a, rtol=1e-12, atol=1e-12)


def test_momentum_changes_by_gravity_and_support(p):
    """In free flight: dh/dt is the weight of the free tree, and no moment about its centre of mass."""
    m = p.model.changed(dict.fromkeys(("r5", "c6", "f7", "b5", "b6", "b7")))
    p = m.prepare(coordinates="joint")
    q, v, _ = state(p, 1)
    a, h = p.aba(q, v, np.zeros(len(v))), 1e-5

    def moved(t):
        return p.momentum(p.step(q, t * v + 0.5 * t**2 * a), v + t * a)

    weight = sum(b.mass for b in m.bodies) * np.array(m.gravity)
    np.testing.assert_allclose((moved(h) - moved(-h)) / (2 * h), np.r_[weight, 0, 0, 0], rtol=1e-7, atol=1e-5)


def difference(f, p, q, h=1e-6):
    """Derivatives of f(q) along every velocity, by central differences."""
    steps = h * np.eye(len(p.v))
    return np.array([(f(p.step(q, e)) - f(p.step(q, -e))) / (2 * h) for e in steps]).T


def test_derivatives_of_inverse_dynamics(p):
    q, v, a = state(p)
    by_q, by_v, by_a = p.rnea_derivatives(q, v, a)
    size = abs(by_q).max()
    np.testing.assert_allclose(by_q, difference(lambda x: p.rnea(x, v, a), p, q), atol=1e-8 * size)
    by_rate = np.array([p.rnea(q, v + e, a) - p.rnea(q, v - e, a) for e in np.eye(len(v))]).T / 2  # quadratic: exact
    np.testing.assert_allclose(by_v, by_rate, atol=1e-12 * size)
    np.testing.assert_allclose(by_a, p.crba(q), rtol=1e-13)


def test_derivatives_of_forward_dynamics(p):
    q, v, tau = state(p)
    by_q, by_v, by_tau = p.aba_derivatives(q, v, tau)
    np.testing.assert_allclose(by_q, difference(lambda x: p.aba(x, v, tau), p, q), atol=1e-7 * abs(by_q).max())
    by_rate = np.array([p.aba(q, v + e, tau) - p.aba(q, v - e, tau) for e in np.eye(len(v))]).T / 2
    np.testing.assert_allclose(by_v, by_rate, atol=1e-11 * abs(by_v).max())
    np.testing.assert_allclose(by_tau @ p.crba(q), np.eye(len(v)), atol=1e-12)


@pytest.mark.parametrize("frame", ["tool", "b4", "b7", "ground"])
def test_frames(p, frame):
    q, v, _ = state(p)
    J = p.frame_jacobian(frame, q)
    np.testing.assert_allclose(J[:3], difference(lambda x: p.pose(frame, x)[0], p, q), atol=1e-8)
    R = p.pose(frame, q)[1]
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-14)
    turned = difference(lambda x: p.pose(frame, x)[1], p, q)  # (columns, rows, velocity): R'_d = w_d x R
    for d in range(len(v)):
        np.testing.assert_allclose(turned[:, :, d].T, np.cross(J[3:, d], R, axisb=0, axisc=0), atol=1e-8)
    h = 1e-6
    rate = (p.frame_jacobian(frame, p.step(q, h * v)) - p.frame_jacobian(frame, p.step(q, -h * v))) / (2 * h)
    np.testing.assert_allclose(p.frame_jacobian_rate(frame, q, v), rate, atol=1e-7)


def test_many_states_are_single_states(p):
    """To the last bit: in a batch of any length, on threads, in given arrays, bound beforehand."""
    q, v, a = state(p, 2, 11)
    for name in ("rnea", "aba", "rnea_derivatives", "aba_derivatives"):
        method = getattr(p, name)
        parts = [np.atleast_1d(x) for x in np.array([np.stack(method(*x)) for x in zip(q, v, a, strict=True)])]
        whole = np.stack(method(q, v, a)) if "der" in name else method(q, v, a)
        one = np.moveaxis(np.array(parts), 0, 1) if "der" in name else np.array(parts)
        np.testing.assert_array_equal(whole, one)
        np.testing.assert_array_equal(np.stack(method(q, v, a, threads=3)), np.stack(method(q, v, a)))
        out = method(q, v, a)
        bound = p.bind(name, q, v, a, out)
        expected = np.stack(out).copy()
        for x in out if "der" in name else (out,):
            x[:] = 0.0
        bound()
        np.testing.assert_array_equal(np.stack(out), expected)
    out = np.empty((11, len(p.v)))
    assert p.rnea(q, v, a, out=out) is out
    np.testing.assert_array_equal(p.rnea(q, v[0], a), p.rnea(q, np.tile(v[0], (11, 1)), a))
    x, R = p.pose("tool", q)
    assert (x.shape, R.shape, p.energies(q, v).shape) == ((11, 3), (11, 3, 3), (11, 2))


def test_no_states_and_arrays_that_overlap(p):
    q, v, a = state(p, 4, 3)
    assert p.rnea(q[:0], v[:0], a[:0]).shape == (0, len(p.v))
    assert p.aba_derivatives(q[:0], v[:0], a[:0])[0].shape == (0, len(p.v), len(p.v))
    for out in (a, a[::-1][::-1]):
        with pytest.raises(fb.ModelError, match="must not overlap"):
            p.aba(q, v, a, out=out)


def test_bound_calls_beside_others(p):
    """They have workspaces of their own."""
    from concurrent.futures import ThreadPoolExecutor

    q, v, a = state(p, 6, 400)
    outs = [np.empty_like(a) for _ in range(4)]
    calls = [p.bind("rnea", q, v, a, out) for out in outs]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda call: call(), calls))
    for out in outs:
        np.testing.assert_array_equal(out, p.rnea(q, v, a))


def test_generated_code_is_the_general_kernel():
    m = forest()
    general, special = m.prepare(coordinates="joint"), m.prepare(coordinates="joint", specialize=True)
    q, v, a = state(general, 3, 5)
    for name in ("rnea", "aba", "rnea_derivatives", "aba_derivatives"):
        x, y = np.stack(getattr(general, name)(q, v, a)), np.stack(getattr(special, name)(q, v, a))
        np.testing.assert_allclose(y, x, atol=1e-13 * abs(x).max())
    q[2, -1] = 2 * LARGEST_ANGLE  # the reduction of angles ends there
    before = special.rnea(q, v, a)
    np.testing.assert_array_equal(before[2], general.rnea(q, v, a)[2])
    rest = [0, 1, 3, 4]
    np.testing.assert_array_equal(before[rest], special.rnea(q[rest], v[rest], a[rest]))
    np.testing.assert_array_equal(special.aba(q, v, a)[rest], special.aba(q[rest], v[rest], a[rest]))


def test_sine_and_cosine_of_vectors():
    """Under one unit in the last place, against the C library in extended precision; also near multiples of pi/2."""
    from flyball.compiler.object_code import LoadedCode, object_code_of_text

    vector = "<4 x double>"
    text = f"""{sine_and_cosine()}
define void @both(ptr %x, ptr %s, ptr %c) {{
  %a = load {vector}, ptr %x, align 8
  %r = call {{ {vector}, {vector} }} @sine_and_cosine({vector} %a)
  %s0 = extractvalue {{ {vector}, {vector} }} %r, 0
  %c0 = extractvalue {{ {vector}, {vector} }} %r, 1
  store {vector} %s0, ptr %s, align 8
  store {vector} %c0, ptr %c, align 8
  ret void
}}
"""
    import ctypes

    loaded = LoadedCode(object_code_of_text(text))
    call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)(loaded.address("both"))
    rng = np.random.default_rng(0)
    k = rng.integers(-60_000, 60_000, 4000)
    x = np.r_[rng.uniform(-4, 4, 4000), rng.uniform(-LARGEST_ANGLE, LARGEST_ANGLE, 4000), k * (np.pi / 2)]
    x = np.r_[x, k * (np.pi / 2) * (1 + 1e-13), 0.0, -0.0, 1e-300, np.pi]
    s, c = np.zeros_like(x), np.zeros_like(x)
    for i in range(0, len(x), 4):
        call(x.ctypes.data + 8 * i, s.ctypes.data + 8 * i, c.ctypes.data + 8 * i)
    for mine, exact in ((s, np.sin(x.astype(np.longdouble))), (c, np.cos(x.astype(np.longdouble)))):
        assert (abs(mine - exact) <= np.spacing(abs(exact.astype(float))) + 1e-28).all()


def test_planar_and_absolute_coordinates():
    """The recursion also holds where every body is free; the joint's rows are solved with it."""
    m = fb.Mechanism("bar", planar=True, gravity=(0, -G))
    m.add(fb.Body("A", mass=2, inertia=0.3, position=(0.5, 0)), fb.Revolute("J", "ground", "A", at=(0, 0)))
    p = m.prepare(coordinates="absolute")
    np.testing.assert_allclose(p.crba(p.q), np.diag([2, 2, 0.3]))
    np.testing.assert_allclose(p.gravity_forces(p.q), (0, 2 * G, 0))
    alpha = -2 * G * 0.5 / (0.3 + 2 * 0.25)
    np.testing.assert_allclose(p.aba(p.q, p.v, np.zeros(3)), (0, 0.5 * alpha, alpha), atol=1e-12)
    inverse = p.aba_derivatives(p.q, p.v, np.zeros(3)).by_force
    np.testing.assert_allclose(inverse[2], np.array([0, 0.5, 1]) / (0.3 + 2 * 0.25), atol=1e-14)


def test_stops_count_as_open():
    m = fb.Mechanism("arm", planar=True, gravity=(0, -G))
    m.add(fb.Body("A", mass=2, inertia=0.3, position=(0.5, 0)), fb.Revolute("J", "ground", "A", at=(0, 0)))
    m.add(fb.Limit("stop", "J.angle", lower=-0.1, upper=0.1))
    p = m.prepare(coordinates="joint")
    assert p.stops == ("stop",) and "open stops" in repr(p)
    np.testing.assert_allclose(p.aba([1.0], [0.0], [0.0]), -G * np.cos(1.0) / (0.3 + 0.5), rtol=1e-13)
    assert p.simulate(1.0)["J.angle"].min() >= -0.1 - 1e-9


def test_bad_input(p):
    q, v, a = state(p)
    for bad, match in (
        ((q[:-1], v, a), "q has the shape"),
        ((q, v, np.full(len(v), np.nan)), "a or tau of 'forest' is not finite"),
        ((q, v.astype(complex), a), "forces are real"),
        ((np.tile(q, (3, 1)), np.tile(v, (2, 1)), a), "2 states"),
        ((q * 0.0, v, a), "quaternion"),
    ):
        with pytest.raises(fb.ModelError, match=match):
            p.rnea(*bad)
    with pytest.raises(fb.ModelError, match="out must be an array"):
        p.rnea(q, v, a, out=np.empty((2, len(v))))
    with pytest.raises(fb.ModelError, match="threads"):
        p.rnea(q, v, a, threads=0)
    with pytest.raises(fb.ModelError, match="has no pose"):
        p.pose("r1", q)
    with pytest.raises(fb.ModelError, match="cannot be bound"):
        p.bind("crba", q, v, a, a)


def test_numbers_that_overflow(p):
    q, v, a = state(p, 0, 3)
    v[1] *= 1e200
    for method in (p.rnea, p.aba, p.rnea_derivatives, p.aba_derivatives):
        for given, i in (((q, v, a), 1), ((q[1], v[1], a[1]), 0)):
            with np.errstate(all="ignore"), pytest.raises(fb.AnalysisError, match=f"state {i} are not finite"):
                method(*given)
    assert np.isfinite(p.rnea(q, 1e-199 * v, a)).all()
    large = p.rnea(q[0], 1e120 * v[0], a[0])  # whose squares overflow, not themselves
    assert np.isfinite(large).all() and abs(large).max() > 1e200


@pytest.mark.parametrize("specialize", [False, True])
def test_a_velocity_that_moves_no_inertia_is_named(specialize):
    m = fb.Mechanism("thin rod on a vertical shaft", gravity=(0, 0, -G))
    m.add(fb.Body("ring", mass=0, inertia=0), fb.Body("rod", mass=1, inertia=(0, 0.1, 0.1)))
    m.add(fb.Revolute("J", "ground", "ring", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Revolute("K", "ring", "rod", at=(0, 0, 0), axis=(0, 1, 0)))
    p = m.prepare(coordinates="joint", specialize=specialize)
    q = np.zeros((6, 2))
    np.testing.assert_allclose(p.aba(q, q, q + 1.0), 10.0)
    q[4, 1] = np.pi / 2  # along the shaft
    with pytest.raises(fb.AnalysisError, match=r"state 4: the mass matrix is singular there.*'J.angle'"):
        p.aba(q, q, q)
    with pytest.raises(fb.AnalysisError, match="mass matrix is singular"):
        p.aba_derivatives(q[4], q[0], q[0])


def test_an_axis_near_the_vertical():
    """It is not taken for the vertical: half a turn about an axis tilted by e moves a point above by 2 e."""
    e = 1e-6
    m = fb.Mechanism("tilted", gravity=(0, 0, -G))
    m.add(fb.Body("A", mass=1, inertia=(1, 1, 1), position=(0, 0, 1)))
    m.add(fb.Revolute("J", "ground", "A", at=(0, 0, 0), axis=(e, 0, 1)))
    x, _ = m.prepare(coordinates="joint").pose("A", np.array([np.pi]))
    np.testing.assert_allclose(x, (2 * e, 0, 1), rtol=1e-9, atol=1e-15)
