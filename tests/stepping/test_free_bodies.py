"""Free bodies in impulse time stepping: what is exact whatever the step is."""

import numpy as np
import pytest

import flyball as fb

G = 9.81


def ground(friction=0.3, restitution=None, planar=False):
    """A floor, and bodies that touch it."""
    m = fb.Mechanism(planar=planar, gravity=(0, -G) if planar else (0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    m.add(fb.Contact(friction=friction, restitution=restitution))
    return m


def test_free_fall_is_exact():
    m = ground()
    m.add(fb.Bodies("balls", shape=fb.Sphere(radius=0.1), density=1000, position=[[0, 0, 5], [1, 0, 6]]))
    r = m.simulate(0.9, outputs=10, method=fb.Stepping(step=0.03))
    z = r.bulk["balls"].position[:, :, 2]
    assert z == pytest.approx(np.array([5.0, 6.0]) - 0.5 * G * r.t[:, None] ** 2, abs=1e-12)


def test_a_free_body_keeps_energy_and_angular_momentum_at_any_step():
    m = fb.Mechanism(gravity=(0, 0, 0))
    J = np.array([1.0, 2.0, 2.5])
    m.add(
        fb.Body("book", mass=2, inertia=tuple(J), shape=fb.Box(edges=(0.3, 0.2, 0.1)), angular_velocity=(0.1, 6, 0.2))
    )
    m.add(fb.Contact(friction=0))
    r = m.simulate(20, outputs=101, method=fb.Stepping(step=0.05))
    R, w = r["book"].rotation, r["book"].angular_velocity
    momentum = np.einsum("tij,j,tkj,tk->ti", R, J, R, w)
    assert momentum == pytest.approx(np.tile(momentum[0], (101, 1)), rel=1e-11, abs=1e-11)
    assert r.energy.kinetic == pytest.approx(r.energy.kinetic[0], rel=1e-11)
    assert np.ptp(np.einsum("tij,ti->tj", R, w)[:, 1]) > 11  # about the middle axis it turns over


@pytest.mark.parametrize("step", [0.002, 0.01])
def test_sliding_becomes_rolling_at_five_sevenths(step):
    """A ball thrown without spin rolls with 5/7 of its speed; friction takes 2/7 of its energy."""
    m = ground(friction=0.3)
    m.add(fb.Body("ball", mass=4, shape=fb.Sphere(radius=0.1), position=(0, 0, 0.1), velocity=(2, 0, 0)))
    r = m.simulate(2, outputs=41, method=fb.Stepping(step=step))
    assert r["ball"].vx[-1] == pytest.approx(10 / 7, rel=1e-9)
    assert r.energy.kinetic[-1] == pytest.approx(8 * 5 / 7, rel=1e-9)
    slides = r.t < 2 * 2 / 7 / (0.3 * G) - step
    assert np.abs(r.energy.balance).max() < 1e-9
    assert r["ball"].x[slides] == pytest.approx(2 * r.t[slides] - 0.15 * G * r.t[slides] ** 2, abs=1e-9)


def test_an_elastic_ball_keeps_its_energy():
    m = ground(restitution=1.0)
    m.add(fb.Body("ball", mass=4, shape=fb.Sphere(radius=0.1), position=(0, 0, 1.1), velocity=(0, 0, 0)))
    r = m.simulate(5, outputs=501, method=fb.Stepping(step=0.01))
    assert r.energy.total == pytest.approx(r.energy.total[0], rel=1e-9)
    assert r["ball"].z.min() > 0.1 - 1e-9
    assert (np.diff(np.sign(r["ball"].vz)) > 0).sum() >= 4
