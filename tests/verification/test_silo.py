"""Granular flow and pressure against the laws of Beverloo and Janssen, and the angle of a heap."""

from __future__ import annotations

import runpy

import numpy as np
import pytest
from scipy.optimize import brentq

import flyball as fb
from tests.mechanisms import EXAMPLES

SILO = runpy.run_path(str(EXAMPLES / "silo.py"))
GRAIN, STEP = SILO["GRAIN"], SILO["STEP"]


def test_discharge_follows_beverloos_law():
    """Flow to the power 2/3 is linear in the outlet, to the fluctuations of 200 grains."""
    outlets = GRAIN * np.array([6.0, 8.0, 10.0])
    flows = [SILO["flow"](SILO["mechanism"](D, rolling=0.0).simulate(0.55, outputs=56, method=STEP)) for D in outlets]
    roots = np.array(flows) ** (2 / 3)
    slope, at_zero = np.polyfit(outlets, roots, 1)
    assert slope * outlets + at_zero == pytest.approx(roots, rel=0.06)
    dense = 0.78 / (np.pi * GRAIN**2 / 4)
    assert 1 < -at_zero / slope / GRAIN < 4
    assert 1 < slope**1.5 / (dense * np.sqrt(9.81)) < 2


def test_walls_carry_weight_by_janssens_law():
    """With L = breadth / (2 mu K) the bottom carries L / H (1 - exp(-H / L)) of the weight; K = 0.3 to 0.6 in practice."""
    breadth, count = 8 * GRAIN, 220
    m = SILO["mechanism"](0.0, count, breadth, creep=0.05)
    run = m.simulate(0.8, outputs=161, method=fb.Stepping(step=1e-3, solver="gauss-seidel"))
    weight = 9.81 * 2500 * 4 / 3 * np.pi * sum(len(s.position) * s.shape.radius**3 for s in m.bulk)
    height = np.sort(SILO["positions"](run)[-1, :, 1])[-6:].mean() + GRAIN / 2
    edges = np.linspace(0, height, 4)
    across, along, bottom = SILO["wall_forces"](run, breadth, edges)
    assert along + bottom == pytest.approx(weight, rel=0.05)
    assert along / across.sum() == pytest.approx(0.5, rel=0.06)  # friction is mobilised everywhere
    depth = brentq(lambda L: L / height * (1 - np.exp(-height / L)) - bottom / weight, 0.01 * height, 100 * height)
    assert 0.3 < breadth / (2 * 0.5 * depth) < 0.6
    z = height - edges
    law = weight / height * -np.diff(z + depth * np.exp(-z / depth))
    assert 0.5 * across == pytest.approx(law, abs=0.2 * law.max())  # single grains make the profile rough
    assert 0.5 * across[0] < 0.75 * weight / height / depth * (z[0] ** 2 - z[1] ** 2) / 2  # pressure as of a fluid


def test_a_heap_has_an_angle_of_repose():
    """Its mean height and half breadth are those of a triangle of 15 to 35 degrees."""
    run = SILO["mechanism"](10 * GRAIN, 120).simulate(1.0, outputs=11, method=fb.Stepping(step=1e-3))
    x, y = SILO["positions"](run)[-1].T
    heap = y < -0.02
    assert heap.sum() > 75
    assert 15 < np.degrees(np.arctan((y[heap] - SILO["FLOOR"]).mean() / abs(x[heap] - x[heap].mean()).mean())) < 35
