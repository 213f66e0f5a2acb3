"""Steps that are wide since nothing bends: what is measured need be no polynomial between their ends."""

from __future__ import annotations

import numpy as np
import pytest

from tests.mechanisms import example


@pytest.mark.parametrize("rtol", [1e-5, 1e-7, 1e-8])
def test_a_rope_that_flies_is_caught_again(rtol):
    """In free flight the error of a step is none, however wide: the rope's length falls and rises within one."""
    r = example("rope_pendulum.toml").simulate(10, rtol=rtol, outputs=101, progress=False)
    assert [e.kind for e in r.events] == ["taut", "slack"] * 13
    assert r.energy.drift < 1e-2 * np.ptp(r.energy.kinetic)
