"""Mechanisms that touch: wedges and their self-locking angle, and a brake shoe in both directions."""

import numpy as np
import pytest

import flyball as fb

from .contact_scenes import stepped


def wedge(angle, mu, load, push):
    """A wedge of 1 kg on a floor without friction, a block of 2 kg in a guide on top of it, a load on both."""
    a = np.radians(angle)
    m = fb.Mechanism("wedge", planar=True, gravity=(0, 0))
    n = (-np.sin(a), np.cos(a))  # the slope rises with x
    m.add(fb.Body("wedge", mass=1, inertia=1, shape=fb.Plane(normal=n), position=(0, 0)))
    m.add(fb.Body("block", mass=2, inertia=1, shape=fb.Cylinder(radius=0.1, length=0.1),
                  position=tuple(0.1 * np.array(n))))  # fmt: skip
    at = tuple(0.1 * np.array(n))
    m.add(fb.Prismatic("floor", "ground", "wedge", at=(0, 0), axis=(1, 0)))
    m.add(fb.Prismatic("guide", "ground", "block", at=at, axis=(0, 1)))
    m.add(fb.PointForce("load", "block", at=at, force=(0, -load)))
    if push:
        m.add(fb.PointForce("push", "wedge", at=(0, 0), force=(push, 0)))
    m.add(fb.Contact(friction=mu))
    return m


@pytest.mark.parametrize(
    ("angle", "mu", "locks"), [(15, 0.3, True), (16, 0.3, True), (17, 0.3, False), (30, 0.3, False)]
)
def test_a_wedge_locks_itself_below_the_angle_of_friction(angle, mu, locks):
    """The load drives it out above atan(mu), with the acceleration of both along their guides."""
    run = stepped(wedge(angle, mu, 50.0, 0), 0.2, 2e-3)
    t = np.tan(np.radians(angle))
    # block: 2 y'' = n c + f s - 50, wedge: x'' = -(-n s + f c), y' = -t ... by the push of the slope q = tan(angle - phi)
    q = np.tan(np.radians(angle) - np.arctan(mu))
    x2 = 0.0 if locks else 50.0 * q / (1 + 2 * t * q)
    assert abs(run["wedge"].vx[-1]) == pytest.approx(0.2 * x2, rel=1e-6, abs=1e-8)
    assert abs(run["block"].vy[-1]) == pytest.approx(0.2 * x2 * t, rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("turn", [1, -1])
def test_a_brake_shoe_grips_more_in_one_direction(turn):
    """An arm pivoted at (0, h) presses a shoe at (l, 0) on a drum below: N = F a / (l -+ mu h)."""
    mu, h, long, arm, force = 0.4, 0.15, 0.3, 0.6, 20.0
    r = 0.2
    m = fb.Mechanism("brake", planar=True, gravity=(0, 0))
    m.add(fb.Body("drum", shape=fb.Cylinder(radius=r, length=0.1), mass=5, inertia=0.1, position=(long, -r),
                  angular_velocity=20 * turn))  # fmt: skip
    m.add(fb.Revolute("axle", "ground", "drum", at=(long, -r)))
    m.add(fb.Body("arm", mass=1, inertia=0.1, position=(long, 0.02),
                  shape=fb.Cylinder(radius=0.02, length=0.1)))  # fmt: skip
    m.add(fb.Revolute("pin", "ground", "arm", at=(0, h)))
    m.add(fb.PointForce("hand", "arm", at=(arm, 0.0), force=(0, -force)))
    m.add(fb.Contact(friction=mu))
    run = stepped(m, 0.1, 1e-3)
    # drum turning by +: its top moves to -x and drags the shoe there; moments about the pin at (0, h)
    n = force * arm / (long - turn * mu * h)
    got = (run["drum"].omega[-1] if hasattr(run["drum"], "omega") else run["drum"].angular_velocity[-1]) - 20 * turn
    assert got == pytest.approx(-turn * mu * n * r / 0.1 * 0.1, rel=1e-4)
    f = run.contacts.between("drum", "arm").force[-1]
    assert f[1] == pytest.approx(n, rel=1e-4)
    assert f[0] == pytest.approx(-turn * mu * n, rel=1e-4)
