"""Modes by accelerations: who carries, who lets go; in both coordinate layers."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.constraints.switches.latches import ONE_WAY
from flyball.constraints.switches.stop import STOP
from flyball.constraints.switches.switch_kind import HELD, OFF
from flyball.engine.entry_point import MOTION
from flyball.simulation.events.resolution import resolve_start
from tests.events.one_row import BOTH, Row, forgotten, rows
from tests.events.standing import modes, standing

__all__ = ["forgotten"]


def table(middle, load=1.0):
    """A rod on supports at -1, 0, 1, its weight at ``middle``."""
    m = fb.Mechanism("rod", planar=True, gravity=(0, -load))
    m.add(fb.Body("rod", mass=1.0, inertia=0.4, position=(middle, 0.0)))
    for k, x in enumerate((-1.0, 0.0, 1.0)):
        m.add(fb.Frame(f"f{k}", body="rod", position=(x - middle, 0.0)))
        rows(m, Row(f"support{k}", of=(f"f{k}.y",), kind=STOP, par=(0.0, np.inf, 0.0)))
    return m


def carried(here):
    c = here.c
    c.at(here.t, here.q, here.v, MOTION)
    return np.array([c.work.rows.multiplier[s.row] for s in c.structure.switches])


@BOTH
@pytest.mark.parametrize("middle", [0.0, 0.1, -0.1, 0.5, 0.9, -0.9, 1.0])
def test_rod_on_three_supports(coordinates, middle):
    """What it carries balances its weight, and no support pulls."""
    here = standing(table(middle), coordinates)
    resolve_start(here)
    x = carried(here)
    assert (x >= -1e-12).all()
    np.testing.assert_allclose([x.sum(), x[2] - x[0]], [1.0, middle], atol=1e-10)
    assert [m == HELD for m in modes(here)] == (x > 1e-12).tolist()


@BOTH
def test_rod_whose_weight_is_beyond_its_supports_tips(coordinates):
    here = standing(table(1.2), coordinates)
    resolve_start(here)
    assert modes(here) == [OFF, OFF, HELD]
    # about the last support: (0.4 + 0.2^2) alpha = -0.2; it carries 1 + 0.2 alpha
    assert carried(here)[2] == pytest.approx(1.0 - 0.2 * 0.2 / 0.44, rel=1e-12)


@BOTH
def test_layers_decide_the_same_by_the_same_words(coordinates):
    """Twelve rods at random places: modes and what is carried agree with the absolute layer."""
    rng = np.random.default_rng(5)
    for middle in rng.uniform(-1.3, 1.3, 6):
        one, other = standing(table(middle), "absolute"), standing(table(middle), "joint")
        resolve_start(one), resolve_start(other)
        assert modes(one) == modes(other)
        np.testing.assert_allclose(carried(one), carried(other), atol=1e-10)


@BOTH
def test_freewheel_that_is_pulled_back_locks(coordinates):
    m = fb.Mechanism("wheel", planar=True)
    m.add(fb.Body("wheel", mass=1.0, inertia=0.5), fb.Revolute("A", "ground", "wheel", at=(0, 0)))
    m.add(fb.Motor("pull", "A", torque="-2"))
    here = standing(rows(m, Row("free", of=("A.angle",), kind=ONE_WAY)), coordinates)
    resolve_start(here)
    assert modes(here) == [HELD]
    assert carried(here)[0] == pytest.approx(2.0, rel=1e-13)


def test_nothing_is_decided_twice_at_one_instant():
    """A motion that goes on from what was decided decides the same."""
    here = standing(table(0.3), "absolute")
    resolve_start(here)
    first, y = modes(here), here.y.copy()
    resolve_start(here)
    assert modes(here) == first
    np.testing.assert_array_equal(here.y, y)
    assert not here.records
