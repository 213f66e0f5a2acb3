"""What the steps of an integration look at, and what they put right."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers

pytestmark = both_layers


def test_counted_turns_do_not_drift():
    """At a loose tolerance too the states that count turns are the angles of the poses, to rounding."""
    m = fb.Mechanism("wheel")
    m.add(fb.Body("wheel", mass=1, inertia=(1, 1, 1), position=(0, 0, 0)))
    m.add(fb.Revolute("A", "ground", "wheel", at=(0, 0, 0), axis=(1, 2, 2)))
    m.add(fb.Motor("motor", "A", torque="20*sin(3*t)"), fb.CoordinateSpring("s", "A.angle", stiffness=0.1))
    r = m.simulate(5.0, outputs=11, rtol=1e-3, atol=1e-3)
    turned = r.states[:, r.values.structure.state_at["A.angle"]]
    assert np.abs(r["A"].angle).max() > 10.0
    assert turned == pytest.approx(r["A"].angle, abs=1e-12)


def test_steps_follow_the_works_of_a_driven_part():
    """A cart that is driven evenly, against a force that changes fast: nothing but the work asks for short steps."""
    m = fb.Mechanism("cart", planar=True)
    m.add(fb.Body("cart", mass=1, inertia=1, position=(0, 0)), fb.Body("idle", mass=1, inertia=1, position=(0, 5)))
    m.add(fb.Prismatic("track", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Driver("drive", "track.displacement", "2*t"), fb.PointForce("push", "cart", force=("30*cos(40*t)", 0)))
    r = m.simulate(3.0, outputs=31)
    work = r.states[:, r.values.structure.state_at["push.work"]]
    assert work == pytest.approx(2 * 30 / 40 * np.sin(40 * r.t), abs=1e-5)
