"""What slides as bounces die away: friction takes energy to the end, and never gives any."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.examples.test_examples import mechanism

G = 9.81


def dropped(body, **contact):
    m = fb.Mechanism("drop", gravity=(0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane()), body, fb.Contact(**contact))
    return m


def losing(run):
    """Nothing but losses, and what is lost is what was there."""
    size = run.energy.total[0]
    assert np.diff(run.energy.total).max() < 1e-7 * size
    assert np.abs(run.energy.balance).max() < 1e-6 * size


def test_a_capsule_that_falls_on_its_end_comes_to_lie():
    """Cut off bounces once left it a way of sliding that was not its own: friction drove it, to 2 kJ in 3 s."""
    body = fb.Body("c", shape=fb.Capsule(radius=0.1, length=0.5), density=1000, position=(0, 0, 0.8),
                   angular_velocity=(1, 0.5, 0))  # fmt: skip
    run = dropped(body, friction=0.3, restitution=0.4).simulate(2.0, outputs=101, method="dop853")
    losing(run)
    assert run["c.z"][-1] == pytest.approx(0.1, abs=1e-12)
    rolls = run["c"].velocity[-1] - np.cross(run["c"].angular_velocity[-1], (0, 0, 0.1))
    assert np.allclose(rolls, 0.0, atol=1e-9)
    assert np.diff(run.energy.total[-30:]) == pytest.approx(0.0, abs=1e-9)


def test_a_box_that_turns_as_it_slides_stops():
    """Slips of its corners end at nearly one instant, in space none of them passes zero."""
    body = fb.Body("b", shape=fb.Box(edges=(0.4, 0.3, 0.2)), density=500, position=(0, 0, 0.1), velocity=(1, 0.5, 0),
                   angular_velocity=(0, 0, 2))  # fmt: skip
    run = dropped(body, friction=0.3).simulate(1.0, outputs=101, method="dop853")
    losing(run)
    assert run.energy.kinetic[-1] < 1e-20
    assert run.events[-1].kind == "stick"


def test_a_box_dropped_on_a_corner_comes_to_lie():
    body = fb.Body("b", shape=fb.Box(edges=(0.4, 0.3, 0.2)), density=500, position=(0, 0, 0.6),
                   orientation=(0.3, 0.5, 0.2), angular_velocity=(1, 2, 0.5))  # fmt: skip
    run = dropped(body, friction=0.3, restitution=0.3).simulate(2.0, outputs=101, method="dop853")
    losing(run)
    assert min(abs(run["b.z"][-1] - half) for half in (0.1, 0.15, 0.2)) < 1e-12  # on one of its faces
    assert run.energy.kinetic[-1] < 1e-20


def test_a_ball_that_rolls_along_a_wall():
    """On floor and wall it sticks though the least forces would not hold it; friction at the wall once drove it.

    Beside impulse time stepping a tenth of a millisecond long.
    """
    m, at = mechanism("labyrinth.py"), [0.0, 1.3, 1.4, 1.6]
    ways = []
    for method in ("dop853", fb.Stepping(step=1e-4)):
        run = m.simulate(1.6, outputs=at, method=method)
        ways.append(np.einsum("tji,tj->ti", run["board"].rotation, run["ball"].position))
        assert run.energy.drift < 1e-6
    assert np.allclose(ways[0], ways[1], rtol=0, atol=1e-4)
