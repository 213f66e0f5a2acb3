"""The example that holds a pole upright: published matrices and gains, and motions that follow from them.

Digits: "Inverted Pendulum" of Control Tutorials for MATLAB and Simulink (B. Messner, D. Tilbury; University of Michigan),
system modelling and state-space methods.
"""

from __future__ import annotations

import runpy

import numpy as np
import pytest
from scipy.linalg import expm

from tests.mechanisms import EXAMPLES

pytest.importorskip("control", reason="the example needs control: pip install 'flyball[control]'")


@pytest.fixture(scope="module")
def example():
    return runpy.run_path(str(EXAMPLES / "inverted_pendulum.py"))


def test_plant_and_gains_are_the_published_ones(example):
    plant = example["plant"]()
    np.testing.assert_allclose(plant.A[2:], [[0, 2.6727, -0.1818, 0], [0, 31.1818, -0.4545, 0]], atol=5e-5)
    np.testing.assert_allclose(plant.B.ravel(), [0, 0, 1.8182, 4.5455], atol=5e-5)
    poles = [-5.6041, -0.1428, 0, 5.5651]
    np.testing.assert_allclose(np.sort(plant.eigenvalues.real), poles, atol=5e-5)
    np.testing.assert_allclose(example["gains"](), [[-70.7107, 105.5298, -37.8345, 20.9238]], atol=5e-5)


def test_it_stands(example):
    """From 10 degrees, and so near to upright that it moves as the linear equations say."""
    for period in (None, example["PERIOD"]):
        r = example["held"]("10 deg", period).simulate(6)
        assert np.abs(r["pin.angle"]).max() < 0.2
        assert abs(r["pin.angle"][-1]) + abs(r["rail.displacement"][-1]) < 1e-5
    plant, tilt, dt = example["plant"](), 1e-5, example["PERIOD"]
    r = example["held"](tilt).simulate(1, outputs=6, rtol=1e-10, atol=1e-14)
    closed = plant.A - plant.B @ example["gains"]()
    linear = [(expm(closed * t) @ [0, tilt, 0, 0])[1] for t in r.t]
    np.testing.assert_allclose(r["pin.angle"], linear, atol=1e-6 * tilt)
    r = example["held"](tilt, dt).simulate(1, outputs=6, rtol=1e-10, atol=1e-14)
    both = expm(np.block([[plant.A, plant.B], [np.zeros((1, 5))]]) * dt)
    step = both[:4, :4] - both[:4, 4:] @ example["gains"](dt)
    linear = [(np.linalg.matrix_power(step, round(t / dt)) @ [0, tilt, 0, 0])[1] for t in r.t]
    np.testing.assert_allclose(r["pin.angle"], linear, atol=1e-6 * tilt)
    held = example["held"](0.0).linearize()
    np.testing.assert_allclose(np.sort_complex(held.eigenvalues), np.sort_complex(np.linalg.eigvals(closed)), atol=1e-9)
