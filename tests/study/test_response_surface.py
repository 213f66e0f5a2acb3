"""Response surfaces over samples: planes are planes, the mean is told where others vary, lines are no surface."""

from __future__ import annotations

import numpy as np

from flyball.view.study_plots import surface_of_means
from tests.study.rigs import oscillator


def test_a_plane_is_a_plane():
    x, y = np.random.default_rng(0).uniform((1e3, 0.01), (2e3, 0.03), (200, 2)).T
    a, b, z = surface_of_means(x, y, 3.0 + 2e-3 * x - 50.0 * y)
    exact = 3.0 + 2e-3 * a - 50.0 * b[:, None]
    inside = np.isfinite(z)
    assert 0.8 < inside.mean() < 1.0
    np.testing.assert_allclose(z[inside], exact[inside], atol=1e-10)


def test_what_else_varies_is_averaged():
    x, y, u = np.random.default_rng(1).uniform(-1.0, 1.0, (3, 4000))
    a, b, z = surface_of_means(x, y, x * y + 5.0 * u)
    off = z - a * b[:, None]
    assert np.nanstd(off) < 0.3  # that of 5 u is 2.9
    assert abs(np.nanmean(off)) < 0.15


def test_samples_on_a_line_are_drawn_as_points():
    s = oscillator().study({"k": [1.0, 2.0, 3.0], "mass": [1.0, 2.0, 3.0]}, ["end(b.x)"], t_end=0.01, design="list")
    figure = s.plot()
    figure.canvas.draw()
    (points,) = figure.axes[0].collections
    assert points.get_offsets().tolist() == [[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]
