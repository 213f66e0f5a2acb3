"""Articulated bodies and composite bodies against the dense mass matrix, and against Newton's and Euler's laws.

The forests here are made by hand, one random number after another: joints of every kind, several velocities at a
point, massless bodies between, welds, roots that float, branches. Their mass matrix is the sum of J^T m J over bodies.
"""

from types import SimpleNamespace

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.engine.articulated_body import factor_articulated, mass_entries, solve_articulated
from flyball.engine.entry_point import MOTION
from flyball.engine.kinematics import twist_column
from flyball.math.vec import quaternion_matrix
from flyball.results.motion_record import RecordedMotion
from flyball.tables.table_definitions import (
    FREE,
    PLANAR,
    PRISMATIC,
    REVOLUTE,
    SPHERICAL,
    TREE_NV,
    WELD,
    ArticulatedBodies,
    Bodies,
    CompositeBodies,
    KinematicRecords,
    Pivots,
    Tree,
    Twists,
    zero_table,
)
from tests.mechanisms import planar_rod

SIZES = range(12)


def scratch(nb, nv, dtype=float):
    """The part of Work that trees use."""
    bodies = {"bodies": KinematicRecords, "composites": CompositeBodies, "articulated": ArticulatedBodies}
    records = {name: of.blank(nb, dtype=dtype) for name, of in bodies.items()}
    records |= {"twists": Twists.blank(nv, dtype=dtype), "pivots": Pivots.blank(nv, dtype=dtype)}
    return SimpleNamespace(**records, O=np.zeros((nb, 3), dtype), M=np.zeros(nv * (nv + 1) // 2, dtype))


def tables(parents, kinds):
    """A forest's tables without numbers in them."""
    nv = np.array([TREE_NV[k] for k in kinds])
    parent, joint, none = np.array(parents, np.int64), np.array(kinds, np.int64), np.full(len(nv), -1)
    hung = Tree(parent, joint, np.zeros_like(nv), np.cumsum(nv) - nv, np.zeros_like(nv), nv, none, none.copy())
    return SimpleNamespace(tree=hung, bodies=zero_table(Bodies, len(parents), float), rotor_inertia=np.zeros(nv.sum()))


def rotation(random):
    e = random.normal(size=4)
    return quaternion_matrix(*(e / np.linalg.norm(e)))


def forest(seed, *, massless=True, planar=False, chain=False, centre=(0, 0, 0)):
    """A random forest in a random position."""
    random = np.random.default_rng(seed)
    kinds, parents = [], []
    inner = [REVOLUTE, PRISMATIC] if planar else [REVOLUTE, REVOLUTE, PRISMATIC, SPHERICAL, WELD]
    for b in range(3 + seed):
        parents.append(b - 1 if chain else random.integers(-1, b))
        kinds.append(random.choice(inner) if parents[b] >= 0 or seed % 3 else PLANAR if planar else FREE)
    S = tables(parents, kinds)
    light = [massless and parents[b] >= 0 and random.random() < 0.3 and b in parents for b in range(len(parents))]
    W = scratch(len(parents), int(S.tree.nv.sum()))
    flat = np.array([1, 1, 0]) if planar else np.ones(3)
    for b, kind in enumerate(kinds):
        p = centre + flat * random.normal(size=3)
        W.bodies.position[b] = p
        W.bodies.rotation[b] = (1, 0, 0, 0, 1, 0, 0, 0, 1) if planar else rotation(random)
        W.O[b] = p if kind in (FREE, PLANAR) else p + flat * random.normal(size=3)
        if not light[b]:
            A = random.normal(size=(3, 3))
            S.bodies.mass[b] = random.uniform(0.5, 2.0)
            S.bodies.inertia[b] = (np.diag([0, 0, 0.7]) if planar else A @ A.T + np.eye(3)).ravel()
        n = np.array([0, 0, 1.0]) if planar and kind == REVOLUTE else flat * random.normal(size=3)
        n /= np.linalg.norm(n)
        v0 = S.tree.v[b]
        if kind == REVOLUTE:
            W.twists.angular[v0] = n
        elif kind == PRISMATIC:
            W.twists.linear[v0] = n
        elif kind == SPHERICAL:
            W.twists.angular[v0 : v0 + 3] = np.reshape(rotation(random), (3, 3))
    turning = random.random(len(S.rotor_inertia)) < 0.3
    S.rotor_inertia[turning] = random.uniform(0.0, 5.0, turning.sum())
    return S, W


def dense(S, W):
    """M as the sum over bodies of J^T m J, and the inertias of rotors on its diagonal."""
    nb, nv = len(S.tree.parent), W.twists.shape[0]
    M = np.diag(S.rotor_inertia).astype(W.twists.dtype)
    for b in range(nb):
        J = np.zeros((6, nv), W.twists.dtype)
        a = b
        while a >= 0:
            for k in range(S.tree.nv[a]):
                w, v = twist_column(S, W, a, k)
                J[:, S.tree.v[a] + k] = np.r_[w, np.add(v, np.cross(w, W.bodies.position[b] - W.O[a]))]
            a = S.tree.parent[a]
        R = W.bodies.rotation[b].reshape(3, 3)
        inertia = R @ S.bodies.inertia[b].reshape(3, 3) @ R.T
        M += S.bodies.mass[b] * J[3:].T @ J[3:] + J[:3].T @ inertia @ J[:3]
    return M


def places(S):
    """Row and column of each entry of M, in the order of ``mass_entries``."""
    entries = []
    for b in range(len(S.tree.parent)):
        for d in range(S.tree.v[b], S.tree.v[b] + S.tree.nv[b]):
            a = b
            while a >= 0:
                own = range(S.tree.v[a], S.tree.v[a] + S.tree.nv[a])
                entries += [(d, i) for i in own if i <= d]
                a = S.tree.parent[a]
    return np.array(entries)


def singular(M):
    """Whether some motion has no inertia."""
    return len(M) > 0 and np.linalg.cond(M) > 1e10


def solved(S, W, f, x=None):
    """Accelerations and efforts with the factor in W."""
    x, effort = np.zeros_like(f) if x is None else x.copy(), np.full_like(f, 77.0)
    solve_articulated(S, W, f, x, effort)
    return x, effort


KINDS = {
    "branched": {},
    "chain": {"chain": True},
    "planar": {"planar": True, "massless": False},
    "planar chain": {"planar": True, "chain": True, "massless": False},
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", SIZES)
def test_composite_bodies_give_the_mass_matrix(seed, kind):
    S, W = forest(seed, **KINDS[kind])
    mass_entries(S, W)
    M, at = dense(S, W), places(S)
    full = np.zeros_like(M)
    full[at[:, 0], at[:, 1]] = W.M[: len(at)]
    full += np.tril(full, -1).T
    assert full == pytest.approx(M, abs=1e-13 * np.abs(M).max()), (
        "and zero between bodies of which none carries the other"
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", SIZES)
def test_one_factor_solves_for_every_force(seed, kind):
    S, W = forest(seed, **KINDS[kind])
    M = dense(S, W)
    if singular(M):
        assert factor_articulated(S, W) > 0
        return
    assert factor_articulated(S, W) == 0
    for f in np.random.default_rng(seed).normal(size=(3, len(M))):
        x, effort = solved(S, W, f)
        exact = np.linalg.solve(M, f)
        assert x == pytest.approx(exact, abs=1e-14 * np.linalg.cond(M) * np.abs(exact).max())
        assert (effort == 77.0).all(), "nobody drives"


def test_few_forests_move_without_inertia():
    """Massless bodies are put where something hangs on them, which is enough for nearly all, but not for all."""
    found = [singular(dense(*forest(seed, **more))) for more in KINDS.values() for seed in SIZES]
    assert 0 < sum(found) <= 5


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(2, 12))
def test_prescribed_velocities_take_their_effort(seed, kind):
    """Their accelerations are given; M x = f elsewhere, and the drivers add what is missing to it where they act."""
    S, W = forest(seed, **KINDS[kind])
    random = np.random.default_rng(seed)
    drivable = np.flatnonzero(S.tree.nv == 1)
    driven = drivable[random.random(len(drivable)) < 0.5]
    S.tree.law[driven] = 0
    told = S.tree.v[driven]
    M = dense(S, W)
    free = np.setdiff1d(np.arange(len(M)), told)
    if singular(M[np.ix_(free, free)]):
        assert factor_articulated(S, W) > 0
        return
    f, given = random.normal(size=(2, len(M)))
    assert factor_articulated(S, W) == 0
    x, effort = solved(S, W, f, given)
    assert (x[told] == given[told]).all()
    size = np.abs(M @ x).max()
    assert (M @ x)[free] == pytest.approx(f[free], abs=1e-11 * size)
    assert effort[told] == pytest.approx((M @ x - f)[told], abs=1e-11 * size)
    assert (effort[free] == 77.0).all()


@pytest.mark.parametrize("seed", range(1, 12))
def test_mechanisms_far_away_move_as_near_ones(seed):
    """The same forest 10 km from the world's origin: only the places themselves are rounded more coarsely there."""
    (S, W), (_, far) = forest(seed, massless=False), forest(seed, massless=False, centre=(1e4, -2e4, 5e3))
    f = np.random.default_rng(seed).normal(size=W.twists.shape[0])
    assert factor_articulated(S, W) == 0
    assert factor_articulated(S, far) == 0
    x, y = solved(S, W, f)[0], solved(S, far, f)[0]
    assert y == pytest.approx(x, abs=1e-9 * np.abs(x).max())
    mass_entries(S, W)
    mass_entries(S, far)
    assert pytest.approx(W.M, abs=1e-10 * np.abs(W.M).max()) == far.M


def hinges(*axes):
    """Bodies without mass, each hung at the origin by a hinge on the one before it."""
    S = tables(np.arange(len(axes)) - 1, [REVOLUTE] * len(axes))
    W = scratch(len(axes), len(axes))
    W.bodies.rotation = np.eye(3).ravel()
    W.twists.angular = axes / np.linalg.norm(axes, axis=1)[:, None]
    return S, W


def slender(axis):
    """Inertia of a rod along the axis."""
    d = np.array(axis) / np.linalg.norm(axis)
    return 0.3 * (np.eye(3) - np.outer(d, d)).ravel()


def test_nothing_at_the_end_has_no_inertia():
    S, W = hinges([0, 0, 1], [0, 1, 0])
    S.bodies.mass[0], S.bodies.inertia[0] = 1.0, np.eye(3).ravel()
    assert factor_articulated(S, W) == 1 + 1, "the second velocity"


@pytest.mark.parametrize("axis", [(0.3, -0.7, 0.4), (0, 0, 1), (1, 1e-3, 0)])
def test_a_rod_does_not_resist_turning_about_itself(axis):
    """Whatever rounding makes of its inertia there; nor does it when two other hinges are taken out before."""
    S, W = hinges(axis)
    S.bodies.mass[0], S.bodies.inertia[0] = 1.0, slender(axis)
    assert factor_articulated(S, W) == 1
    S, W = hinges(axis, [0.1, 0.9, 0.8], [0.9, -0.3, 0.2])
    S.bodies.mass[2], S.bodies.inertia[2] = 1.0, slender(axis)
    assert factor_articulated(S, W) == 1
    S.tree.law[0] = 0
    assert factor_articulated(S, W) == 0, "a driver needs no inertia"


def test_two_hinges_on_one_axis_share_no_inertia():
    S, W = hinges([1, 2, 3], [1, 2, 3])
    S.bodies.mass[1], S.bodies.inertia[1] = 1.0, np.diag([0.3, 0.5, 0.7]).ravel()
    W.bodies.position[1] = 0.3, 0.1, -0.2
    assert factor_articulated(S, W) == 1
    S.bodies.mass[0], S.bodies.inertia[0] = 1e-9, 1e-9 * np.eye(3).ravel()
    assert factor_articulated(S, W) == 0, "a small inertia is one"


def test_complex_steps_go_through():
    """The derivative of accelerations by a mass: M dx/dm = -dM/dm x."""
    S, W = forest(9)
    f, h = np.random.default_rng(0).normal(size=W.twists.shape[0]), 1e-30
    M = dense(S, W)
    b = int(np.argmax(S.bodies.mass))
    S.bodies = Bodies(*(x.astype(complex) for x in S.bodies))
    S.bodies.mass[b] += h * 1j
    dM = dense(S, SimpleNamespace(**{k: a.astype(complex) for k, a in vars(W).items()})).imag / h
    C = SimpleNamespace(**{k: a.astype(complex) for k, a in vars(W).items()})
    assert factor_articulated(S, C) == 0
    x, _ = solved(S, C, f.astype(complex))
    exact = np.linalg.solve(M, -dM @ x.real)
    assert np.abs(exact).max() > 1e-3
    assert x.imag / h == pytest.approx(exact, abs=1e-11 * np.abs(exact).max())


def link(name, p, q, planar, i):
    """A link from p to q."""
    if planar:
        return planar_rod(name, p[:2], q[:2], 1.0 + 0.3 * i, angular_velocity=0.5 * i - 1.0)
    return fb.Body(
        name,
        mass=1.0 + 0.3 * i,
        inertia=((0.1, 0.01, 0.02), (0.01, 0.2, -0.03), (0.02, -0.03, 0.25)),
        position=p,
        com=(0.1, 0.02 * i, -0.05),
        orientation=(0.1 * i, -0.3, 0.2),
        angular_velocity=(0.5 * i, 1, -1),
    )


def tree(planar, floating, centre=(0.0, 0.0, 0.0)):
    """A trunk with two arms, one of which forks; on ground, or all of it in flight. Returns it and its hinges."""
    m = fb.Mechanism("tree", planar=planar, gravity=(1, -9.81) if planar else (1, -2, -9.81))
    points = np.array([(0, 0, 0), (0.5, 0.1, 0.2), (1, -0.3, 0.1), (1.2, 0.2, 0.7), (0.8, 0.9, -0.3), (0.1, 0.8, 0.3)])
    points = centre + points
    axes = ((0, 0, 1), (1, 2, 0), (0.3, -1, 0.5))
    hung = []
    for i, (a, b) in enumerate([(0, 1), (1, 2), (2, 3), (2, 4), (1, 5)]):
        m.add(link(f"link {b}", points[a], points[b], planar, i))
        if a > 0 or not floating:
            axis = {} if planar else {"axis": axes[i % 3]}
            before = f"link {a}" if a > 0 else "ground"
            m.add(fb.Revolute(f"J{b}", before, f"link {b}", at=points[a][: 2 if planar else 3], **axis))
            hung.append(f"J{b}")
    return m, hung


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("floating", [False, True])
def test_newton_and_euler_agree(planar, floating):
    """With the accelerations found, what every velocity's column makes of m (a - g) and I alpha + w x I w is nothing.

    Records know nothing of the mass matrix, of articulated bodies, or of the generalised forces.
    """
    m, hung = tree(planar, floating)
    c = compile_mechanism(m, tree=hung)
    S, W, s = c.values.system, c.work, c.structure
    v = c.values.v + 5.0 * np.cos(np.arange(s.nv))
    status, dy = c.at(0.0, c.values.q, v, MOTION)
    assert status == 0
    assert factor_articulated(S, W) == 0
    x, _ = solved(S, W, W.velocities.applied)
    assert x == pytest.approx(dy[s.nq : s.nq + s.nv], abs=1e-10 * np.abs(x).max())
    r = RecordedMotion(c.values, c.values.q[None], v[None], x[None])
    left, terms = np.zeros(s.nv), 0.0
    for b in range(len(S.tree.parent)):
        p, R, w, _, alpha, a = (np.ravel(part) for part in r.body(b))
        R = R.reshape(3, 3)
        inertia = R @ S.bodies.inertia[b].reshape(3, 3) @ R.T
        force = S.bodies.mass[b] * (a - S.gravity)
        torque = inertia @ alpha + np.cross(w, inertia @ w)
        k = b
        while k >= 0:
            for i in range(S.tree.nv[k]):
                turn, shift = twist_column(S, W, k, i)
                power = np.dot(shift, force) + np.dot(turn, torque + np.cross(p - W.O[k], force))
                left[S.tree.v[k] + i] += power
                terms = max(terms, abs(power))
            k = S.tree.parent[k]
    assert terms > 1.0
    assert left == pytest.approx(0.0, abs=1e-12 * terms)


@pytest.mark.parametrize("planar", [True, False])
def test_a_mechanism_far_away_falls_as_a_near_one(planar):
    """10 km from the world's origin, poses and forces included."""
    found = []
    for centre in ((0, 0, 0), (1e4, -1e4, 0)):
        m, hung = tree(planar, False, np.array(centre, float))
        c = compile_mechanism(m, tree=hung)
        v = 2.0 * np.cos(np.arange(c.structure.nv))
        c.at(0.0, c.values.q, v, MOTION)
        assert factor_articulated(c.values.system, c.work) == 0
        found.append(solved(c.values.system, c.work, c.work.velocities.applied)[0])
    near, far = found
    assert far == pytest.approx(near, abs=1e-9 * np.abs(near).max())


def test_driven_joints_of_a_mechanism():
    """A shoulder that follows its driver feels the torque that Newton and Euler ask for: see the dense M and f."""
    m, hung = tree(False, False)
    c = compile_mechanism(m, tree=hung)
    s, W = c.structure, c.work
    S = c.values.system._replace(tree=Tree(*(x.copy() for x in c.values.system.tree)))
    assert c.at(0.0, c.values.q, c.values.v, MOTION)[0] == 0
    S.tree.law[0] = 0
    M = dense(S, W)
    f = W.velocities.applied.copy()
    assert factor_articulated(S, W) == 0
    x, effort = solved(S, W, f, np.r_[3.0, np.zeros(s.nv - 1)])
    assert x[0] == 3.0
    assert x[1:] == pytest.approx(np.linalg.solve(M[1:, 1:], f[1:] - 3.0 * M[1:, 0]), rel=1e-10)
    assert effort[0] == pytest.approx(M[0] @ x - f[0], rel=1e-10)
