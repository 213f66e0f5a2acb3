"""The example that swings a pole up: what CasADi and Ipopt find on exported code holds when flyball simulates it."""

import runpy

import numpy as np
import pytest

from tests.mechanisms import EXAMPLES

pytest.importorskip("casadi", reason="the swing-up needs CasADi: pip install 'flyball[casadi]'")


def test_it_ends_upright_at_rest_and_better_with_more_intervals():
    example = runpy.run_path(str(EXAMPLES / "cart_pole_swing_up.py"))
    off = []
    for intervals in (10, 20):
        forces = example["swing_up"](intervals)
        r = example["shown"](forces)
        assert np.abs(forces).max() <= example["FORCE"] * (1 + 1e-8)
        wanted = {"pin.angle": np.pi, "pin.rate": 0.0, "rail.displacement": example["WAY"], "rail.rate": 0.0}
        off.append(max(abs(r[name][-1] - x) for name, x in wanted.items()))
        height = -example["LENGTH"] * np.cos(r["pin.angle"])
        assert height[0] == pytest.approx(-0.5) and height[-1] == pytest.approx(0.5, abs=1e-3)
        np.testing.assert_allclose(r["push.force"][-1], forces[-1], rtol=1e-6)
    assert off[1] < 2e-3 and off[1] < 0.1 * off[0]
