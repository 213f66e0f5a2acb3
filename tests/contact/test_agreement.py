"""Signed distances agree with coal's; where they do not, a direction proves that coal's is not the separation."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.collision.narrow_phase.primitives import SCRATCH_ROWS
from flyball.collision.shape_kinds import CONE, PLANE
from flyball.collision.tables import Movers
from tests.contact.against import MODES, NAMES, PAIRS, asked, judged, pool, rotation, sample, tables
from tests.contact.scenes import meet

COUNT = 500
TOLERANCE = 2e-7  # [m], of shapes half a metre in size; coal is asked for 1e-9 and reaches 1e-8


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("pair", PAIRS, ids=lambda p: f"{NAMES[p[0]]}-{NAMES[p[1]]}")
def test_signed_distance_is_that_of_coal(pair, mode):
    pytest.importorskip("coal", reason="coal, of the dev extra, is not installed: pip install coal")
    s = sample(*pair, COUNT, mode)
    found = judged(s, asked(s), TOLERANCE)
    assert np.isfinite(s.core).all()
    assert found.unproved < 1e-12
    assert not found.wrong, [(k, s.ours[k]) for k in found.wrong]
    assert len(found.refuted) < 0.5 * COUNT


def test_the_judge_finds_a_wrong_answer():
    """Of both: a separation that is too small, and a reference that is."""
    s = sample(*PAIRS[1], 10, "deep")
    truth = np.column_stack([s.ours, s.normal])
    assert judged(s, truth, 1e-7).difference == 0
    s.ours[3] -= 0.01
    s.normal[3] = -s.normal[3]
    assert judged(s, truth, 1e-7).wrong == [3]
    truth[4, 0] -= 0.01
    assert judged(s, truth, 1e-7).refuted == [4]


@pytest.mark.parametrize("kind", NAMES, ids=NAMES.get)
def test_gap_over_a_plane_is_that_of_coal(kind):
    coal = pytest.importorskip("coal", reason="coal, of the dev extra, is not installed: pip install coal")
    rng = np.random.default_rng(kind)
    result, ground = coal.DistanceResult(), coal.Halfspace(0.0, 0.0, 1.0, 0.0)
    for _ in range(100):
        s = pool(kind)[rng.integers(60)]
        R = rotation(rng)
        p = np.array([*rng.normal(size=2), s.top(-R[2]) + rng.choice([0.3, 1e-6, -1e-6, -0.3]) * rng.uniform()])
        one = tables([s])
        at, x = np.repeat(one.shape, 2, axis=0), np.repeat(one.dimensions, 2, axis=0)
        at.kind[1], at.mover[1], x.radius[1] = PLANE, 1, np.inf
        pose = np.array([[*p, *R.ravel()], [0, 0, 0, *np.eye(3).ravel()]])
        room = np.zeros((SCRATCH_ROWS, 8))
        count = meet(one._replace(shape=at, dimensions=x), Movers(pose, np.zeros((2, 6))), 0, 1, 1.0, room)
        middle = p + (R[:, 2] * s.par[1] / 2 if s.kind == CONE else 0)
        result.clear()
        there = coal.distance(
            s.coal, coal.Transform3s(R, middle), ground, coal.Transform3s(), coal.DistanceRequest(), result
        )
        assert room[:count, 6].min() == pytest.approx(
            there, abs=1e-6
        )  # corners of a face may stand for its lowest point
        assert room[:count, 6].min() == pytest.approx(p[2] - s.top(-R[2]), abs=1e-6)
        np.testing.assert_allclose(room[:count, 3:6], [[0, 0, -1]] * count, atol=1e-15)
