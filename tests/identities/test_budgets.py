"""Budgets that every motion has to keep, whatever the mechanism: energy, momentum, and nothing made from nothing."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers
from tests.mechanisms import G, four_bar, hanging_bodies
from tests.verification.test_reactions import actuated

pytestmark = both_layers


def test_energy_balance_with_everything_that_works():
    """Kinetic and potential energy change by the work of dampers, motor, given force and torque, and by nothing else."""
    r = actuated().simulate(2.0, rtol=1e-10, atol=1e-12)
    assert r.energy.drift < 1e-6
    assert np.ptp(r.energy.total) > 1.0
    assert set(r.energy.work) == {"motor", "coil", "stay", "tie", "push", "spin"}
    for name in ("coil", "stay", "tie"):
        assert np.diff(r.energy.work[name]).max() < 1e-9, "a damper never gives"


@pytest.mark.parametrize("name", ["motor", "coil", "stay", "push", "spin"])
def test_work_is_the_integral_of_power(name):
    """The work state of each element against Simpson's rule over its power."""
    from scipy.integrate import simpson

    r = actuated().simulate(1.0, outputs=2001, rtol=1e-9)
    view = r[name]
    assert view.work[-1] == pytest.approx(simpson(view.power, x=r.t), abs=1e-6)


def test_work_of_a_driver():
    """A crank driven by a law: the driver's work is the energy gained; effort times rate is its power."""
    m = four_bar()
    m.add(fb.Driver("motor", "A.angle", "0.5*sin(4*t) + t"))
    r = m.simulate(2.0, rtol=1e-10, atol=1e-12, outputs=1001)
    gained = r.energy.total - r.energy.total[0]
    assert np.ptp(gained) > 1.0
    assert r["motor"].work == pytest.approx(gained, abs=1e-7)
    power = r["motor"].effort * r["A"].rate
    assert np.gradient(r["motor"].work, r.t, edge_order=2)[1:-1] == pytest.approx(power[1:-1], abs=2e-3)
    assert r.health.energy_drift < 1e-7


def momenta(r):
    """Linear momentum, and angular momentum about the world's origin."""
    p, h = 0.0, 0.0
    for name, b in r.values.structure.place.items():
        if b >= 0:
            d = r.values.bodies[name]
            x, R, w, v = (np.stack(c, axis=1) for c in r.records.body(b)[:4])
            R = R.reshape(-1, 3, 3)
            spin = np.einsum("nij,jk,nlk,nl->ni", R, d.inertia, R, w)
            p = p + d.mass * v
            h = h + np.cross(x, d.mass * v) + spin
    return p, h


def test_momentum_of_bodies_left_alone():
    """Springs and joints between free bodies change neither linear nor angular momentum, and here no energy."""
    r = hanging_bodies().simulate(5.0, rtol=1e-11, atol=1e-12)
    p, h = momenta(r)
    assert np.ptp(r["b.x"]) > 0.1
    assert p == pytest.approx(np.tile(p[0], (len(p), 1)), abs=1e-9)
    assert h == pytest.approx(np.tile(h[0], (len(h), 1)), abs=1e-8)
    assert r.energy.drift < 1e-8


def test_mass_centre_falls_freely():
    """With gravity the common mass centre of jointed bodies falls as a stone does."""
    m = fb.Mechanism("falling", gravity=(0, 0, -G))
    for e in hanging_bodies().elements():
        m.add(e)
    r = m.simulate(1.0, rtol=1e-10, outputs=11)
    p, _ = momenta(r)
    total = sum(b.mass for b in m.bodies)
    assert p[:, 2] == pytest.approx(p[0, 2] - total * G * r.t, abs=1e-8)
    assert p[:, :2] == pytest.approx(np.tile(p[0, :2], (11, 1)), abs=1e-9)


def test_a_planar_mechanism_moves_as_in_space():
    """The four-bar described in the plane and in space: the same angles, reactions and energies."""
    flat = four_bar()
    space = fb.Mechanism("in space", gravity=(0, -G, 0))
    for b in flat.bodies:
        inertia = (0.3 * b.inertia, 0.7 * b.inertia, b.inertia)
        space.add(
            fb.Body(b.name, mass=b.mass, inertia=inertia, position=(*b.position, 0.0), orientation=(0, 0, b.angle))
        )
    for j in flat.joints:
        space.add(fb.Revolute(j.name, j.body_i, j.body_j, at=(*j.at, 0.0), axis=(0, 0, 1)))
    one, two = (m.simulate(2.0, rtol=1e-10, atol=1e-12, outputs=51) for m in (flat, space))
    assert (one.health.freedoms, two.health.freedoms) == (1, 1)
    assert one.health.redundant == ()
    assert set(two.health.redundant) == {"A", "B", "C", "D"}
    for name in "ABCD":
        assert one[name].angle == pytest.approx(two[name].angle, abs=1e-7)
        assert one[name].force == pytest.approx(two[name].force[:, :2], abs=1e-5)
    assert one.energy.kinetic == pytest.approx(two.energy.kinetic, abs=1e-6)


def test_describing_a_body_otherwise_changes_nothing():
    """Three different principal moments, given about the mass centre, about another point, and in turned axes."""
    from scipy.spatial.transform import Rotation

    mass, J = 2.0, np.array([0.11, 0.23, 0.3])
    centre = np.array([0.3, 0.1, -0.2])
    R0 = Rotation.from_rotvec([0.4, -0.3, 0.7])
    w = np.array([2.0, -1.0, 3.0])
    off = np.array([0.2, -0.15, 0.3])  # from the mass centre to the other reference point, body axes
    turn = Rotation.from_rotvec([-0.5, 0.9, 0.2])  # the other reference axes in the principal ones
    about = np.diag(J) + mass * ((off @ off) * np.eye(3) - np.outer(off, off))
    T = turn.as_matrix()
    d = T.T @ off
    described = [
        {"inertia": tuple(J), "position": centre, "orientation": R0, "velocity": (0, 0, 0)},
        {
            "inertia": about,
            "inertia_about": (0, 0, 0),
            "com": tuple(-off),
            "position": centre + R0.apply(off),
            "orientation": R0,
            "velocity": np.cross(w, R0.apply(off)),
        },
        {
            "inertia": T.T @ np.diag(J) @ T,
            "com": tuple(-d),
            "position": centre + R0.apply(off),
            "orientation": R0 * turn,
            "velocity": np.cross(w, R0.apply(off)),
        },
        {
            "inertia": tuple(J),
            "inertia_axes": turn.inv(),
            "position": centre,
            "orientation": R0 * turn,
            "velocity": (0, 0, 0),
        },
    ]
    paths = []
    for more in described:
        m = fb.Mechanism("described", gravity=(0, 0, -G))
        m.add(fb.Body("b", mass=mass, angular_velocity=tuple(w), **more))
        m.add(fb.Spherical("ball", "ground", "b", at=(0, 0, 0)))
        m.add(fb.SpringDamper("s", "ground", "b", at=((1, 1, 1), (0.5, 0.2, -0.1)), stiffness=30.0, length=0.4))
        r = m.simulate(1.0, rtol=1e-11, atol=1e-12, outputs=21)
        b = r.values.structure.place["b"]
        paths.append(np.hstack([np.stack(r.records.body(b)[k], axis=1) for k in (0, 2, 3)]))
        assert r["b"].position[0] == pytest.approx(np.asarray(more["position"]), abs=1e-12)
    for path in paths[1:]:
        assert path == pytest.approx(paths[0], abs=1e-8)


def test_where_the_world_is_changes_nothing():
    """The mechanism turned and moved as a whole, gravity with it, moves the same."""
    from scipy.spatial.transform import Rotation

    Q, d = Rotation.from_rotvec([0.3, 1.1, -0.6]), np.array([10.0, -20, 5])
    runs = []
    for turn, shift in ((Rotation.identity(), np.zeros(3)), (Q, d)):
        m = fb.Mechanism("turned", gravity=tuple(turn.apply([0, 0, -G])))
        place = lambda p, turn=turn, shift=shift: tuple(turn.apply(p) + shift)  # noqa: E731
        m.add(fb.Body("arm", mass=1, inertia=(0.03, 0.1, 0.12), position=place((0.5, 0, 0)), orientation=turn))
        m.add(fb.Body("bob", mass=2, inertia=(0.1, 0.2, 0.15), position=place((1, 0, -0.5)), orientation=turn))
        m.add(fb.Revolute("A", "ground", "arm", at=place((0, 0, 0)), axis=tuple(turn.apply([0, 1, 0.2]))))
        m.add(fb.Universal("U", "arm", "bob", at=place((1, 0, 0)), axes=[tuple(turn.apply(a)) for a in np.eye(3)[:2]]))
        runs.append(m.simulate(1.5, rtol=1e-11, atol=1e-12, outputs=31))
    one, two = runs
    assert two["bob"].position == pytest.approx(Q.apply(one["bob"].position) + d, abs=1e-8)
    assert two["A"].angle == pytest.approx(one["A"].angle, abs=1e-8)
    assert two["U"].angle_2 == pytest.approx(one["U"].angle_2, abs=1e-8)
    assert two["U"].force == pytest.approx(Q.apply(one["U"].force), abs=1e-6)
