"""Two coordinate layers, one mechanism: absolute coordinates and joint coordinates give the same accelerations.

That is the proof that the layer is data: rows, forces and reactions never ask what is below them.
"""

import numpy as np
import pytest

import flyball as fb
from flyball.analysis.assemble import assemble
from flyball.analysis.compiled import compiled
from flyball.equations.engine import MOTION
from flyball.equations.mass import mass_entries
from flyball.equations.records import load
from flyball.results.records import Records
from flyball.tables.system import EFFORT, F_APPLIED, GAMMA, LAM, V0, X_SOLVED
from tests.mechanisms import bricard, example, four_bar, planar_rod, spatial_four_bar
from tests.verification.test_reactions import actuated

T = 0.3  # laws have all derivatives there


def planar_chain():
    m = fb.Mechanism("chain", planar=True, gravity=(0, -9.81))
    p = np.array([[0, 0], [0.5, -0.2], [0.9, 0.3], [1.6, 0.4]])
    before = "ground"
    for i in range(3):
        m.add(planar_rod(f"rod {i}", p[i], p[i + 1], 1.0 + i, angular_velocity=(1, -2, 3)[i]))
        m.add(fb.Revolute(f"J{i}", before, f"rod {i}", at=p[i]))
        before = f"rod {i}"
    m.add(fb.SpringDamper("s", "ground", "rod 2", at=((0, 1), p[3]), stiffness=40.0, damping=2.0, length=0.7))
    m.add(fb.TorsionalSpringDamper("c", "J1", stiffness=7.0, damping=0.3, angle=0.2))
    return m


def spatial_chain():
    m = fb.Mechanism("spatial chain", gravity=(1, -2, -9.81))
    axes = [(0, 0, 1), (1, 2, 0), (0.3, -1, 0.5)]
    p = np.array([[0, 0, 0], [0.5, 0.1, 0.2], [1, -0.3, 0.1], [1.2, 0.2, 0.7]])
    before = "ground"
    for i in range(3):
        m.add(
            fb.Body(
                f"rod {i}",
                mass=1.0 + i,
                inertia=(0.1, 0.2, 0.25),
                position=p[i],
                com=(0.1, 0.02 * i, -0.05),
                orientation=(0.1 * i, -0.3, 0.2),
                angular_velocity=(0.5 * i, 1, -1),
            )
        )
        m.add(fb.Revolute(f"J{i}", before, f"rod {i}", at=p[i], axis=axes[i]))
        before = f"rod {i}"
    m.add(fb.SpringDamper("s", "rod 0", "rod 2", at=(p[0], p[3]), stiffness=40.0, damping=2.0, length=0.7))
    m.add(fb.PointTorque("twist", "rod 1", torque=(1, "t", 2), axes="body"))
    return m


def driven_four_bar():
    m = four_bar()
    m.add(fb.Driver("motor", "A.angle", "1 + 2*sin(3*t)"))
    return m


def moving_four_bar():
    m = four_bar()
    m.add(fb.Initial("A.angle", rate=5.0))
    return m


CASES = {
    "planar chain": (planar_chain, ["J0", "J1", "J2"]),
    "planar chain, one hinge": (planar_chain, ["J1"]),
    "spatial chain": (spatial_chain, ["J0", "J1", "J2"]),
    "spatial chain, two hinges": (spatial_chain, ["J0", "J2"]),
    "four-bar, one side": (moving_four_bar, ["A", "B"]),
    "four-bar, both sides": (moving_four_bar, ["A", "D"]),
    "four-bar, all but one": (moving_four_bar, ["A", "B", "D"]),
    "spatial four-bar": (spatial_four_bar, ["A", "D"]),
    "spatial four-bar, driven": (lambda: spatial_four_bar(driven=True), ["A", "D"]),
    "four-bar, driven": (driven_four_bar, ["A", "D"]),
    "four-bar, driven by a row": (driven_four_bar, ["B", "D"]),
    "Bricard": (bricard, ["R1", "R2", "R3", "R4", "R5"]),
    "governor": (lambda: example("governor.toml"), ["bearing", "left hinge", "right hinge"]),
    "robot": (actuated, ["waist"]),
}


def spun(model, a):
    """A consistent state in motion: where nothing moves yet, the free motion of largest kinetic energy is added."""
    q, v = a.q.copy(), a.v.copy()
    a.compiled.at(0.0, q, v)
    G = a.compiled.jacobian()
    if len(G) and not model.drivers:
        _, d, Vt = np.linalg.svd(G)
        rank = int((d > 1e-9 * d[0]).sum())
        free = Vt[rank:]
        v = v + 3.0 * free.T @ np.cos(np.arange(len(free)))
    return q, v


@pytest.mark.parametrize("case", CASES)
def test_joint_coordinates_give_the_same_accelerations(case):
    """Poses, velocities and accelerations of all bodies, and the multipliers that are unique, to 1e-9."""
    make, hinges = CASES[case]
    model = make()
    a = assemble(model, t=T)
    q, v = spun(model, a)
    tree = compiled(model, tree=hinges)
    Q, V = tree.take(a.compiled, T, q, v)
    bodies = {}
    for c, x, u in ((a.compiled, q, v), (tree, Q, V)):
        status, _ = c.at(T, x, u, MOTION)
        assert status == 0
        r = Records(c.values, x[None], u[None], c.work.vel[X_SOLVED][None])
        for name, b in c.structure.place.items():
            if b >= 0:
                bodies.setdefault(name, []).append([np.ravel(part) for part in r.body(b)])
    assert tree.structure.nv < a.compiled.structure.nv
    assert len(tree.structure.rows) < len(a.compiled.structure.rows)
    largest = max(np.abs(one[5]).max() for one, _ in bodies.values())
    assert largest > 1.0, "something moves"
    for name, (one, two) in bodies.items():
        for part, (x, y) in enumerate(zip(one, two, strict=True)):
            scale = largest if part >= 4 else 1.0
            assert y == pytest.approx(x, abs=1e-9 * scale), f"{name}, part {part} of its record"
    if case.startswith("four-bar"):
        rows = tree.structure.slices["C"]
        same = a.compiled.structure.slices["C"]
        assert tree.work.row[LAM][rows] == pytest.approx(a.compiled.work.row[LAM][same], rel=1e-8)


def mass_matrix(c, t, q):
    """M by its definition: the kinetic energy's bilinear form, from the motion of every body at each unit velocity."""
    S, s, W = c.values.system, c.structure, c.work
    moved = []
    for unit in np.eye(s.nv):
        c.at(t, q, unit)
        parts = []
        for b in range(len(S.body_i)):
            _, R, w, u, _, _ = load(W.BK, b)
            parts.append((S.body_x[b, 0], np.array(u), S.body_x[b, 1:10].reshape(3, 3), np.reshape(R, (3, 3)).T @ w))
        moved.append(parts)
    return np.array(
        [
            [sum(m * (u @ v) + w @ J @ o for (m, u, J, w), (_, v, _, o) in zip(x, y, strict=True)) for y in moved]
            for x in moved
        ]
    )


@pytest.mark.parametrize("case", CASES)
def test_mass_matrix_is_that_of_the_bodies(case):
    """Composite rigid bodies against the definition of M."""
    make, hinges = CASES[case]
    model = make()
    model.drivers.clear()  # they would prescribe some of the velocities
    c = compiled(model, tree=hinges)
    S, s = c.values.system, c.structure
    exact = mass_matrix(c, 0.0, c.values.q)
    assert np.linalg.eigvalsh(exact).min() > 0
    c.at(0.0, c.values.q, np.zeros(s.nv), MOTION)
    if not len(S.mass_i):
        pytest.skip("without rows M is never made")
    mass_entries(S, c.work)
    M = np.zeros((s.nv, s.nv))
    M[S.mass_i[:, 0], S.mass_i[:, 1]] = c.work.M
    assert pytest.approx(np.tril(exact), abs=1e-12 * np.abs(exact).max()) == M


@pytest.mark.parametrize("case", CASES)
def test_joint_layer_solves_the_equations_of_motion(case):
    """M x - G^T lam = f and G x = gamma, by a dense solve of the same G, f and gamma.

    Where a driver prescribes an acceleration, its effort is what is left of the first.
    """
    make, hinges = CASES[case]
    model = make()
    a = assemble(model, t=T)
    c = compiled(model, tree=hinges)
    Q, V = c.take(a.compiled, T, *spun(model, a))
    S, s, W = c.values.system, c.structure, c.work
    M = mass_matrix(c, T, Q)
    c.at(T, Q, V, MOTION)
    G, x, f = c.jacobian(), W.vel[X_SOLVED], W.vel[F_APPLIED]
    driven = S.body_i[list(s.prescribed.values()), V0]
    free = np.delete(np.arange(s.nv), driven)
    K = np.block([[M[np.ix_(free, free)], G[:, free].T], [G[:, free], np.zeros((len(G), len(G)))]])
    known = np.r_[f[free] - M[np.ix_(free, driven)] @ x[driven], W.row[GAMMA] - G[:, driven] @ x[driven]]
    exact = np.linalg.lstsq(K, known, rcond=1e-12)[0][: len(free)]
    assert x[free] == pytest.approx(exact, abs=2e-10 * np.abs(exact).max())
    left = (M @ x - f - G.T @ W.row[LAM])[driven]
    assert W.vel[EFFORT, driven] == pytest.approx(left, rel=1e-9)
