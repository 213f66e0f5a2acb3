"""The same motion in absolute and in joint coordinates: every example, over a short time, with all that its result says.

Short: many mechanisms are chaotic, and what is compared here are equations, not luck.
"""

import numpy as np
import pytest

from tests.examples.test_examples import FILES, mechanism
from tests.identities.test_results_in_both_layers import agree

TIMES = {"andrews.toml": 0.003, "governor.toml": 0.1, "heavy_top.toml": 0.1}  # a few tenths of a second for the others
TIMES["geneva_drive.toml"] = 0.29  # the pin leaves at 0.25 s, where accelerations jump: no time of output
EXACT = {"rtol": 1e-11, "atol": 1e-13, "outputs": 7}


@pytest.mark.parametrize("name", FILES)
def test_examples(name):
    m = mechanism(name)
    t = TIMES.get(name, 0.3)
    r, o = (m.simulate(t, coordinates=c, **EXACT) for c in ("absolute", "joint"))
    if not o.values.structure.tree:
        pytest.skip("no joint of it can be a tree joint")
    assert not r.values.structure.tree
    agree(r, o, 1e-8, reactions=not r.health.redundant)
    moved = np.ptp(r.energy.kinetic) + np.ptp(r.energy.potential) + 0.1 * r.energy.kinetic.max()
    assert r.energy.drift < 1e-8 * moved
    assert o.energy.drift < 1e-8 * moved
    for element, work in r.energy.work.items():
        assert o.energy.work[element] == pytest.approx(work, abs=1e-8 * moved), element
    assert o.health.freedoms == r.health.freedoms
    assert o.health.redundant == r.health.redundant
