"""Stacks that stand: equal cubes, and a heavy one on light ones."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.numerics.complementarity.contact_problem import CONVERGED
from tests.cone.stacks import G, H, Stack

MASSES = {"equal": [1000.0] * 10, "1000:1": [1.0] * 10 + [1000.0], "1e5:1": [1.0] * 10 + [1e5]}


@pytest.mark.parametrize("name", MASSES)
def test_a_stack_stands_for_two_seconds(name):
    s = Stack(MASSES[name], most=300)
    for _ in range(400):
        assert s.step() == CONVERGED
    assert s.kinetic < 1e-9
    assert abs(s.find()).max() < 1e-8  # metres
    assert s.x[:, 2] == pytest.approx(0.5 + np.arange(s.n), abs=1e-8)
    assert abs(s.x[:, :2] - s.start[:, :2]).max() < 1e-5


@pytest.mark.parametrize("name", MASSES)
@pytest.mark.parametrize("most", [1, 5])
def test_a_stack_cut_short_is_not_thrown(name, most):
    """No velocity solve adds energy; no displacement lifts a box above where it began."""
    s = Stack(MASSES[name], most=most)
    for _ in range(120):
        free = s.v.copy()
        free[:, 2] -= H * G
        s.step()
        assert s.kinetic <= s.kinetic_of(free) * (1 + 1e-12)
        assert np.isfinite(s.x).all() and s.x[:, 2].max() < s.start[:, 2].max() + 1e-3


@pytest.mark.parametrize("solver", ["auto", "admm"])
def test_others_stand_too(solver):
    s = Stack(MASSES["1000:1"], solver, most=2000)
    for _ in range(60):
        s.step()
    assert abs(s.find()).max() < 1e-6 and abs(s.x[:, :2] - s.start[:, :2]).max() < 1e-5
