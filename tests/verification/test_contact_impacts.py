"""Collisions against closed forms: balls in a row by both orders, Routh's rod, and momentum of whatever collides."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb

from .contact_scenes import stepped

Z = np.array([0.0, 0.0, 1.0])


def row(masses, speeds, e, gap=0.0, planar=False):
    """Balls of radius 0.1 m in a row along x, without gravity."""
    m = fb.Mechanism("row", planar=planar, gravity=(0, 0) if planar else (0, 0, 0))
    for k, (mass, v) in enumerate(zip(masses, speeds, strict=True)):
        at = k * (0.2 + gap)
        m.add(
            fb.Body(
                f"b{k}",
                shape=fb.Sphere(radius=0.1),
                mass=mass,
                inertia=0.01 if planar else None,
                position=(at, 0) if planar else (at, 0, 0),
                velocity=(v, 0) if planar else (v, 0, 0),
            )
        )
    m.add(fb.Contact(friction=0.3, restitution=e))
    return m


def after(m, count, step=1e-3, span=0.2, **choices):
    """Velocities along x at the end."""
    run = stepped(m, span, step, **choices)
    return np.array([run[f"b{k}"].vx[-1] for k in range(count)]), run


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize(
    ("law", "impacts"),
    [*((law, "simultaneous") for law in ("poisson", "newton", "moreau")), ("poisson", "sequential")],
)
@pytest.mark.parametrize("ratio", [1, 3, 1000])
def test_two_balls(e, law, impacts, ratio):
    """All laws agree: v1 = (m1 - e m2) / (m1 + m2) v, v2 = (1 + e) m1 / (m1 + m2) v."""
    v, _ = after(row((1, ratio), (1, 0), e, gap=0.05), 2, restitution=law, impacts=impacts)
    assert v == pytest.approx([(1 - e * ratio) / (1 + ratio), (1 + e) / (1 + ratio)], abs=1e-9)


@pytest.mark.parametrize("masses", [(1, 1, 1, 1), (1, 2, 3, 4), (5, 1, 2, 1)])
@pytest.mark.parametrize("e", [1.0, 0.6])
@pytest.mark.parametrize("gap", [0.0, 1e-6])
def test_a_row_one_after_the_other(masses, e, gap):
    """Impacts of two, the first with the second and so on, until none closes: as with gaps between them."""
    v = np.array([1.0, 0, 0, 0])
    w = np.array(masses, float)
    for _ in range(100):
        closing = v[:-1] - v[1:]
        k = closing.argmax()
        if closing[k] <= 1e-13:
            break
        p = (1 + e) * closing[k] / (1 / w[k] + 1 / w[k + 1])
        v[k], v[k + 1] = v[k] - p / w[k], v[k + 1] + p / w[k + 1]
    got, run = after(row(masses, (1, 0, 0, 0), e, gap), 4, impacts="sequential")
    assert got == pytest.approx(v, abs=1e-9)
    assert w @ got == pytest.approx(w[0], rel=1e-12)


def at_once(masses, e):
    """All at once by Poisson's law: the impulses of compression stop all approach; of these e times more come back."""
    w = np.array(masses, float)
    D = np.array([[-1, 1, 0, 0], [0, -1, 1, 0], [0, 0, -1, 1.0]])
    N = D / w @ D.T
    p = np.linalg.solve(N, -D @ [1.0, 0, 0, 0])  # a chain that is pushed presses everywhere
    assert (p > 0).all()
    v = np.array([1.0, 0, 0, 0]) + D.T @ p / w
    return v + e * D.T @ p / w


@pytest.mark.parametrize("masses", [(1, 1, 1, 1), (1, 2, 3, 4)])
@pytest.mark.parametrize("e", [1.0, 0.6])
def test_a_row_at_once(masses, e):
    """Equal balls: (-1, 1, 1, 1) / 2 for e = 1 (Pfeiffer and Glocker, 1996), not what a cradle does."""
    got, run = after(row(masses, (1, 0, 0, 0), e), 4, impacts="simultaneous")
    assert got == pytest.approx(at_once(masses, e), abs=1e-9)
    assert np.array(masses) @ got == pytest.approx(masses[0], rel=1e-12)
    assert run.energy.kinetic[-1] <= run.energy.kinetic[0] * (1 + 1e-12)


SOLIDS = {
    "sphere": fb.Sphere(radius=0.1),
    "box": fb.Box(edges=(0.3, 0.2, 0.1)),
    "capsule": fb.Capsule(radius=0.06, length=0.2),
    "cylinder": fb.Cylinder(radius=0.1, length=0.2),
    "cone": fb.Cone(radius=0.1, height=0.2),
}


@pytest.mark.parametrize("law", ["poisson", "newton", "moreau", "sequential"])
@pytest.mark.parametrize("pair", [("sphere", "box"), ("box", "box"), ("capsule", "cylinder"), ("cone", "box")])
def test_momentum_is_exact_and_energy_never_grows(pair, law):
    """Free bodies that collide askew while they turn, with friction: p to rounding, at a large step.

    L too where they rebound, since that is over before a step begins; without restitution to the order of the step.
    """
    rng = np.random.default_rng(3)
    choices = {"impacts": law} if law == "sequential" else {"restitution": law}
    for e in (0.0, 0.6, 1.0):
        m = fb.Mechanism("two", gravity=(0, 0, 0))
        for k, name in enumerate(pair):
            v, w = (1 - 2 * k, *rng.uniform(-0.2, 0.2, 2)), tuple(rng.uniform(-4, 4, 3))
            m.add(
                fb.Body(
                    f"b{k}", shape=SOLIDS[name], density=1000 * (1 + 9 * k), position=(0.6 * k, 0.03 * k, 0),
                    orientation=tuple(rng.uniform(-3, 3, 3)), velocity=v, angular_velocity=w,
                )
            )  # fmt: skip
        m.add(fb.Contact(friction=0.4, restitution=e))
        run = stepped(m, 0.8, 5e-3, outputs=41, **choices)
        p, L = total_momentum(m, run)
        size = np.abs(p[0]).max() + np.abs(L[0]).max()
        assert np.abs(np.diff(run["b0"].velocity, axis=0)).max() > 0.1
        assert np.abs(p - p[0]).max() < 1e-12 * size
        assert np.abs(L - L[0]).max() < (1e-11 if e > 0.0 else 1e-3) * size
        assert (np.diff(run.energy.total) <= 1e-11 * run.energy.total[0]).all()


def total_momentum(m, run):
    """Momentum and angular momentum about the origin, over time."""
    P, H = 0.0, 0.0
    for name, b in m.mass_properties().bodies.items():
        R, w = run[name].rotation, run[name].angular_velocity
        x = run[name].position + R @ b.com
        v = run[name].velocity + np.cross(w, R @ b.com)
        P = P + b.mass * v
        H = H + b.mass * np.cross(x, v) + np.einsum("tij,jk,tlk,tl->ti", R, b.inertia, R, w)
    return P, H


@pytest.mark.parametrize("heading", [0.0, 0.7, 2.2, -1.9])
@pytest.mark.parametrize("law", ["moreau", "poisson"])
def test_a_ball_that_hits_the_floor_askew_in_space(law, heading):
    """Moreau: both slips of the surface go back by e, and v+ = v - 2/7 (1 + e) u along the floor; Poisson: they end."""
    e, r = 0.6, 0.1
    d = np.array([np.cos(heading), np.sin(heading), 0.0])
    m = fb.Mechanism("ball", gravity=(0, 0, 0))
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact(friction=5.0, restitution=e))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=r), mass=2, position=(0, 0, r), velocity=tuple(0.5 * d - Z)))
    run = m.simulate(0.05, outputs=2, method=fb.Stepping(step=1e-3, restitution=law))
    back = e if law == "moreau" else 0.0
    v = (0.5 - 2 / 7 * (1 + back) * 0.5) * d + e * Z
    assert run["ball"].velocity[-1] == pytest.approx(v, abs=1e-6)
    turning = 5 / 7 * (1 + back) * 0.5 / r
    assert run["ball"].angular_velocity[-1] == pytest.approx(turning * np.cross(Z, d), abs=1e-5)


@pytest.mark.parametrize("turned", [(0, 0, 0), (0.4, -0.7, 1.1)])
def test_a_smooth_blow_beside_the_centre_of_a_body_with_products_of_inertia(turned):
    """p = -(1 + e) u / (1 / m + (r x n) J^-1 (r x n)), J with all six of its numbers, in axes that are turned."""
    e, radius = 0.5, 0.1
    R = Rotation.from_rotvec(turned).as_matrix()
    J = np.array([[0.04, 0.01, -0.006], [0.01, 0.05, 0.008], [-0.006, 0.008, 0.06]])
    com = np.array([0.05, -0.03, 0.02])
    m = fb.Mechanism("stone", gravity=(0, 0, 0))
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact(friction=0.0, restitution=e))
    m.add(
        fb.Body("stone", mass=2, inertia=J, com=tuple(com), shape=fb.Sphere(radius=radius), orientation=R,
                position=(0, 0, radius), velocity=(0, 0, -1), angular_velocity=(0, 0, 0))
    )  # fmt: skip
    run = m.simulate(0.03, outputs=[0.0, 1e-4, 0.03], method=fb.Stepping(step=1e-4))
    arm = np.cross(-radius * Z - R @ com, Z)
    turn = R @ np.linalg.solve(J, R.T @ arm)
    p = (1 + e) / (1 / 2 + arm @ turn)
    assert run["stone"].angular_velocity[1] == pytest.approx(p * turn, abs=1e-4)
    assert run["energy.kinetic"][-1] == pytest.approx(1 - p * 1 + 0.5 * p * p * (1 / 2 + arm @ turn), rel=1e-9)


def test_impacts_that_do_not_end_within_a_step_are_told():
    """A ball between two elastic walls 1 mm apart: ten impacts in 10 ms, none of which the method can end its step on."""

    def rattling(step):
        m = fb.Mechanism("rattling", gravity=(0, 0, 0))
        m.add(fb.Ground("left", shape=fb.Plane(normal=(1, 0, 0))))
        m.add(fb.Ground("right", shape=fb.Plane(normal=(-1, 0, 0), position=(0.201, 0, 0))))
        m.add(fb.Body("ball", mass=1, shape=fb.Sphere(radius=0.1), position=(0.1005, 0, 0), velocity=(1, 0, 0)))
        m.add(fb.Contact(friction=0, restitution=1))
        return m.simulate(0.1, outputs=11, method=fb.Stepping(step=step))

    long, short = rattling(1e-2), rattling(2e-4)
    assert long.energy.kinetic[-1] < 0.1 and long.health.contact.endless > 0
    assert any("the sequence of impacts did not end" in text for text in long.health.doubtful)
    assert abs(short.energy.kinetic[-1] - 0.5) < 1e-6 and not short.health.warnings


@pytest.mark.parametrize("step", [1e-2, 1e-3])
@pytest.mark.parametrize("planar", [False, True])
def test_smooth_balls_that_meet_off_centre_keep_their_spins(planar, step):
    """However far they go in the step: the impulse acts through both middles, along the line on which they touch."""
    m = fb.Mechanism("balls", planar=planar, gravity=(0, 0) if planar else (0, 0, 0))
    for name, side, r, w in (("a", -1, 0.16, -0.557), ("b", 1, 0.147, 0.653)):
        p, v = (0.5 * side, -0.019 * side), (-1.5 * side, 0.0)
        if planar:
            m.add(fb.Body(name, shape=fb.Sphere(radius=r), density=1000, position=p, velocity=v, angular_velocity=w))
        else:
            m.add(fb.Body(name, shape=fb.Sphere(radius=r), density=1000, position=(*p, 0.01 * side), velocity=(*v, 0.0),
                          angular_velocity=(1.0, 2.0, w)))  # fmt: skip
    m.add(fb.Contact(friction=0.0, restitution=1.0))
    run = stepped(m, 1.0, step)
    for name in "ab":
        w = run[name].angular_velocity
        assert np.abs(run[name].velocity[-1] - run[name].velocity[0]).max() > 0.5
        assert w[-1] == pytest.approx(w[0], abs=1e-12)
