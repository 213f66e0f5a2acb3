"""`examples/spring_scale.py`: each run by the closed form, and the indices by those of the closed form."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np

EXAMPLE = Path(__file__).parents[2] / "examples" / "spring_scale.py"


def dip(k, c, load):
    z = c / (2.0 * np.sqrt(k * load))
    return -load * 9.81 / k * (1.0 + np.exp(-np.pi * z / np.sqrt(1.0 - z**2)))


def test_how_far_it_dips_and_why():
    s = runpy.run_path(str(EXAMPLE))["study"](samples=64)
    assert len(s) == 64 * 5
    exact = dip(*s.points.T)
    np.testing.assert_allclose(s["min(pan.y)"], exact, rtol=3e-5)  # output times are 5 ms apart
    found = s.indices()
    s.values["min(pan.y)"][:] = exact
    np.testing.assert_allclose(found.first, s.indices().first, atol=1e-3)
    slope = np.array(
        [dip(10e3 * f, 400.0 * g, 500.0 * h) - dip(10e3, 400.0, 500.0) for f, g, h in np.eye(3) * 1e-6 + 1]
    )
    part = (slope * [0.03, 0.2, 0.01]) ** 2
    np.testing.assert_allclose(found.total[0], part / part.sum(), atol=0.06)  # nearly linear
