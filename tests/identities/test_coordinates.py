"""Two coordinate layers, one mechanism: absolute coordinates and joint coordinates give the same accelerations.

That is the proof that the layer is data: rows, forces and reactions never ask what is below them.
"""

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.assemble import assemble
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.engine.articulated_body import mass_entries
from flyball.engine.entry_point import MOTION
from flyball.engine.kinematics import load_record
from flyball.results.motion_record import RecordedMotion
from flyball.tables import reference_configuration
from flyball.tables.coordinate_choice import least_cost, right_hand_side_cost
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
    tree = compile_mechanism(model, tree=hinges)
    Q, V = tree.take(a.compiled, T, q, v)
    bodies = {}
    for c, x, u in ((a.compiled, q, v), (tree, Q, V)):
        status, _ = c.at(T, x, u, MOTION)
        assert status == 0
        r = RecordedMotion(c.values, x[None], u[None], c.work.velocities.solved[None])
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
        assert tree.work.rows.multiplier[rows] == pytest.approx(a.compiled.work.rows.multiplier[same], rel=1e-8)


def mass_matrix(c, t, q):
    """M by its definition: the kinetic energy's bilinear form, from the motion of every body at each unit velocity."""
    S, s, W = c.values.system, c.structure, c.work
    moved = []
    for unit in np.eye(s.nv):
        c.at(t, q, unit)
        parts = []
        for b in range(len(S.tree.parent)):
            _, R, w, u, _, _ = load_record(W.bodies, b)
            parts.append(
                (S.bodies.mass[b], np.array(u), S.bodies.inertia[b].reshape(3, 3), np.reshape(R, (3, 3)).T @ w)
            )
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
    c = compile_mechanism(model, tree=hinges)
    S, s = c.values.system, c.structure
    exact = mass_matrix(c, 0.0, c.values.q)
    assert np.linalg.eigvalsh(exact).min() > 0
    c.at(0.0, c.values.q, np.zeros(s.nv), MOTION)
    if not len(S.mass_entries.row):
        pytest.skip("without rows M is never made")
    mass_entries(S, c.work)
    M = np.zeros((s.nv, s.nv))
    M[S.mass_entries.row, S.mass_entries.column] = c.work.M
    assert pytest.approx(np.tril(exact), abs=1e-12 * np.abs(exact).max()) == M


@pytest.mark.parametrize("case", CASES)
def test_joint_layer_solves_the_equations_of_motion(case):
    """M x - G^T lam = f and G x = gamma, by a dense solve of the same G, f and gamma.

    Where a driver prescribes an acceleration, its effort is what is left of the first.
    """
    make, hinges = CASES[case]
    model = make()
    a = assemble(model, t=T)
    c = compile_mechanism(model, tree=hinges)
    Q, V = c.take(a.compiled, T, *spun(model, a))
    S, s, W = c.values.system, c.structure, c.work
    M = mass_matrix(c, T, Q)
    c.at(T, Q, V, MOTION)
    G, x, f = c.jacobian(), W.velocities.solved, W.velocities.applied
    driven = S.tree.v[list(s.prescribed.values())]
    free = np.delete(np.arange(s.nv), driven)
    K = np.block([[M[np.ix_(free, free)], G[:, free].T], [G[:, free], np.zeros((len(G), len(G)))]])
    known = np.r_[f[free] - M[np.ix_(free, driven)] @ x[driven], W.rows.gamma - G[:, driven] @ x[driven]]
    exact = np.linalg.lstsq(K, known, rcond=1e-12)[0][: len(free)]
    assert x[free] == pytest.approx(exact, abs=2e-10 * np.abs(exact).max())
    left = (M @ x - f - G.T @ W.rows.multiplier)[driven]
    assert W.velocities.effort[driven] == pytest.approx(left, rel=1e-9)


def ladder(planar, n=45):
    """A chain of hinges and slides about and along many axes, every third joint declared the other way round."""
    m = fb.Mechanism("ladder", planar=planar)
    dice = np.random.default_rng(3)
    for k in range(n):
        size = (
            {"inertia": 0.1, "angle": 0.3 * k}
            if planar
            else {"inertia": (0.1, 0.1, 0.1), "orientation": (0.1 * k, 0.2, 0)}
        )
        m.add(fb.Body(f"b{k}", mass=1, position=(k, 0.1 * k) if planar else (k, 0.1 * k, 0.2), **size))
        ends = (f"b{k - 1}" if k else "ground", f"b{k}")
        axis = dice.normal(size=2 if planar else 3)
        at = (k, 0.3) if planar else (k, 0.3, 0.1)
        slide = k % 4 == 3
        more = {} if planar and not slide else {"axis": tuple((axis / np.linalg.norm(axis)).tolist())}
        m.add((fb.Prismatic if slide else fb.Revolute)(f"J{k}", *(ends if k % 3 else ends[::-1]), at=at, **more))
    return m


@pytest.mark.parametrize("planar", [True, False])
def test_many_joints_are_read_as_few_are(planar, monkeypatch):
    """From where the bodies are: joint coordinates come back, whichever way they are read."""
    m = ladder(planar)
    tree = tuple(j.name for j in m.joints)
    plain, c = compile_mechanism(m), compile_mechanism(m, tree=tree)
    q = c.values.q + np.random.default_rng(4).uniform(-1.5, 1.5, len(c.values.q))
    v = np.random.default_rng(5).normal(size=len(q))
    there = plain.take(c, 0.0, q, v)
    back = c.take(plain, 0.0, *there)
    assert back[0] == pytest.approx(q, abs=1e-11)
    assert back[1] == pytest.approx(v, abs=1e-10)
    monkeypatch.setattr(reference_configuration, "MANY_JOINTS", 10**9)
    assert c.take(plain, 0.0, *there)[0] == pytest.approx(back[0], abs=1e-13)


def test_a_plate_without_inertia_on_links_is_not_put_into_a_forest():
    """It hangs by no joint that could be a tree joint, and its mass matrix would be singular: absolute coordinates."""

    def runs(inertia):
        m = fb.Mechanism("plate", planar=True, gravity=(0, -9.81))
        m.add(fb.Body("arm", mass=1, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "arm", at=(0, 0)))
        m.add(fb.Body("plate", mass=1, inertia=inertia, position=(1, -1)))
        m.add(fb.Distance("l1", "arm", "plate", at=((0.7, 0), (0.7, -1))))
        m.add(fb.Distance("l2", "arm", "plate", at=((1.3, 0), (1.3, -1.2))))
        return m.simulate(0.5, outputs=2, coordinates="joint")

    none, hardly = runs(0), runs(1e-7)
    assert "plate has no inertia, or less than 1e-07" in none.health.coordinates
    assert none["plate"].position[-1] == pytest.approx(hardly["plate"].position[-1], abs=1e-6)


def test_masses_of_which_several_coordinates_together_move_none_are_not_put_into_a_forest():
    """A point mass away from its body's frame turns about itself and the other keeps its place: M is singular.

    Each joint's own coordinates move inertia. In joint coordinates every thirtieth acceleration was not a number.
    """
    m = fb.Mechanism("two masses", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=0.26, inertia=0, position=(0.72, 0.33), com=(0.11, 0.12), angular_velocity=-2.2))
    m.add(fb.Body("b", mass=15.8, inertia=0, position=(0.48, 0.91)))
    m.add(fb.Distance("rod", "ground", "a", at=((0.1, 0.1), (0.71, 0.32))))
    m.add(fb.PointOnLine("slot", "a", "b", at=(0.48, 0.69), axis=(0, 1)))
    joint, absolute = (m.simulate(0.01, outputs=1001, coordinates=c) for c in ("joint", "absolute"))
    assert "absolute: a has no inertia" in joint.health.coordinates
    assert joint["a"].acceleration == pytest.approx(absolute["a"].acceleration, rel=1e-6, abs=1e-6)


def ball_net(n):
    """Rods on balls where they meet."""
    m = fb.Mechanism("net", gravity=(0, 0, -9.81))
    at = {}
    for a, b in [((i, j), (i + di, j + 1 - di)) for i in range(n) for j in range(n) for di in (0, 1)]:
        if max(b) < n:
            name = f"{a}{b}".replace(" ", "")
            p, q = (np.array([x, y, -0.3 * ((x + y) % 2)]) for x, y in (a, b))
            m.add(fb.Body(name, mass=1, inertia=(0.1, 0.1, 0.1), position=tuple((p + q) / 2)))
            for end, where in ((a, p), (b, q)):
                if at.setdefault(end, name) != name:
                    m.add(fb.Spherical(f"{name}{end}", at[end], name, at=tuple(where)))
    m.add(fb.Spherical("peg", "ground", at[0, 0], at=(0, 0, 0)))
    return m


def test_a_deep_tree_with_many_loops_is_not_made_to_see_that_it_costs_more():
    """Of a net of rods on balls the mass matrix alone costs more than absolute coordinates."""
    small, large = ball_net(6), ball_net(21)
    joint = small.simulate(1e-4, outputs=2, coordinates="joint").values.structure
    assert 0.2 * right_hand_side_cost(joint) < least_cost(small, joint.tree) <= right_hand_side_cost(joint)
    assert right_hand_side_cost(small.simulate(1e-4, outputs=2).values.structure) < right_hand_side_cost(joint)
    assert "the mass matrix alone" in large.simulate(1e-4, outputs=2).health.coordinates


def test_a_thin_rod_that_is_welded_to_the_ground():
    """It has no inertia about its axis, and no freedom in any coordinates."""
    m = fb.Mechanism("welded", gravity=(0, 0, -9.81))
    m.add(fb.Body("rod", mass=2, inertia=(0, 0.1, 0.1), com=(0.2, 0, 0)), fb.PointOnLine("slot", "ground", "rod", at=(0, 0, 0), axis=(0, 1, 0)))  # fmt: skip
    m.add(fb.Fixed("weld", "rod", "ground", at=(0.1, 0, 0)))
    for layer in ("auto", "joint", "absolute"):
        run = m.simulate(0.1, outputs=2, coordinates=layer)
        assert run["rod"].position[-1] == pytest.approx([0, 0, 0], abs=1e-12)
