"""IFToMM benchmark A05, Watt's governor with stiff springs."""

import numpy as np
import pytest

from tests.layers import both_layers, cached
from tests.mechanisms import example

pytestmark = both_layers

# the benchmark's published or closed-form values: converged values of minimal coordinates; agree with the library's plot to its resolution
S = {0.1: 0.5238364756, 0.5: 0.7432494248, 1.0: 0.5014209224, 2.0: 0.5059092943, 5.0: 0.5355631037, 10.0: 0.6196229171}
ALPHA = {0.5: 0.2594913815, 10.0: 0.3900737018}


@cached
def governor(t_end, rtol):
    return example("governor.toml").simulate(t_end, rtol=rtol, atol=1e-2 * rtol, outputs=round(10 * t_end) + 1)


def test_one_second():
    """s to 1e-8 at 1 s."""
    r = governor(1.0, 1e-10)
    s = r["guide"].displacement
    for t in (0.1, 0.5, 1.0):
        assert s[round(10 * t)] == pytest.approx(S[t], abs=1e-8)
    assert r["left hinge"].angle[5] == pytest.approx(ALPHA[0.5], abs=1e-8)
    assert r["right hinge"].angle == pytest.approx(r["left hinge"].angle, abs=1e-9)


def test_ten_seconds():
    """s and the arms' angle to 1e-6 at 10 s; angular momentum about the shaft is kept."""
    r = governor(10.0, 1e-8)
    s = r["guide"].displacement
    for t, exact in S.items():
        assert s[round(10 * t)] == pytest.approx(exact, abs=1e-6)
    for t, exact in ALPHA.items():
        assert r["left hinge"].angle[round(10 * t)] == pytest.approx(exact, abs=1e-6)
    assert r["slider.z"] == pytest.approx(s, abs=1e-9)
    assert r.health.violation < 1e-9
    assert r.health.freedoms == 4
    assert r.health.redundant == ()
    assert r.energy.drift < 1e-4
    assert np.all(np.diff(r["bearing"].angle) > 0)
    assert r["bearing"].angle[-1] > 6 * np.pi  # whole turns are counted
    lost = sum(r[f"{side} spring"].work[-1] + r[f"{side} spring"].energy[-1] for side in ("left", "right"))
    assert lost < 0  # the dampers only take
