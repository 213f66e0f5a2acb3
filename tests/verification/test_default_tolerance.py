"""What the tolerances that nobody gave are good for: a millionth of the motion, whatever the mechanism's size."""

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

import flyball as fb
from tests.layers import both_layers
from tests.mechanisms import G, example

pytestmark = both_layers


def pendulum(length: float) -> fb.Mechanism:
    """Point mass on a massless rod, let go from the horizontal; gravity grows with it, so that the motion is the same."""
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -G * length))
    m.add(fb.Body("bob", mass=1.0, inertia=0, position=(-length, 0)), fb.Revolute("O", "ground", "bob", at=(0, 0)))
    return m


def swing(t):
    """Position of the bob over the length: sin(theta / 2) = k sn(K - w t), k^2 = 1 / 2."""
    s = np.sqrt(0.5) * ellipj(ellipk(0.5) - np.sqrt(G) * t, 0.5)[0]
    return np.stack([-2 * s * np.sqrt(1 - s * s), 2 * s * s - 1], axis=-1)


@pytest.mark.parametrize("length", [1e-6, 1.0, 1e3])
def test_ten_seconds_of_a_pendulum_of_any_size(length):
    """Two millionths of its length after four swings: a micrometre long as well as a kilometre."""
    r = pendulum(length).simulate(10.0, outputs=101)
    assert r["bob"].position / length == pytest.approx(swing(r.t), abs=2e-6)


def test_a_sleigh_and_a_squeezer():
    """Chaplygin's sleigh against its closed form; Andrews' mechanism against the digits of the test set."""
    r = example("chaplygin_sleigh.toml").simulate(5.0)
    W, rate = 2.0, 0.2 * np.sqrt(4 * (0.5 + 0.2**2)) / (0.5 + 0.2**2)
    turned = 2 * W / rate * np.arctan(np.tanh(rate * r.t / 2))
    assert r["sleigh.angle"] == pytest.approx(turned, abs=1e-6 * turned[-1])
    r = example("andrews.toml").simulate(0.03)
    assert r["crank"].angle[-1] == pytest.approx(15.81077119515369977, abs=1e-6 * 15.8)


def test_the_absolute_tolerance_follows_the_relative_one():
    m = pendulum(0.1)
    options = m.simulate(0.1, outputs=2, rtol=1e-9).health.options
    assert options["atol"] * 0.1 <= 1e-11 * 0.3  # relative to the mechanism's length
    assert m.simulate(0.1, outputs=2, atol=1e-5).health.options["atol"] == 1e-5
    with pytest.raises(fb.ModelError, match="atol must be greater than 0"):
        m.simulate(0.1, atol=0.0)
