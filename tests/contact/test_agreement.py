"""Signed distances agree with coal's; where they do not, a direction proves that coal's is not the separation."""

from __future__ import annotations

import numpy as np
import pytest

from tests.contact.against import MODES, NAMES, PAIRS, asked, judged, sample

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
