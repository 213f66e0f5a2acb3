"""The woodpecker toy: published state on its limit cycle, and the order of impacts, sticking and slip."""

from __future__ import annotations

import numpy as np
import pytest

from tests.mechanisms import example

PUBLISHED = {"sleeve.angle": -0.1036, "sleeve.omega": 0.0, "bird.omega": -7.4583, "sleeve.vy": -0.3411}
"""On the limit cycle at the bird's angle -0.2788, of Glocker's data (1995), as the woodpecker examples of Siconos state it."""


def cycles(size: float, duration: float):
    """A motion, its events, and the instants at which the bird's angle falls past -0.2788 times the size."""
    run = example("woodpecker.py", size=size).simulate(duration, outputs=20001, rtol=1e-9)
    angle = run["bird.angle"] / size + 0.2788
    (at,) = np.nonzero((angle[:-1] > 0) & (angle[1:] <= 0))
    return run, at


def test_at_small_size_the_limit_cycle_is_the_published_one():
    """Period and drop are those of the linear equations stepped by Moreau's method at 2 us: 0.14598 s and 19.445 mm."""
    size = 1e-3
    run, at = cycles(size, 2.0)
    for name, value in PUBLISHED.items():
        assert run[name][at[-2:]].mean() / size == pytest.approx(value, rel=6e-3, abs=1e-9)
    assert (run.t[at[-1]] - run.t[at[-3]]) / 2 == pytest.approx(0.14598, rel=1e-3)
    assert (run["sleeve.y"][at[-3]] - run["sleeve.y"][at[-1]]) / 2 / size == pytest.approx(0.019445, rel=1e-3)


def test_phases_of_a_cycle():
    """The lower edge hits twice, sticks, slides and parts; the beak hits, then the upper edge hits and parts."""
    run, at = cycles(1.0, 3.0)
    start, end = run.t[at[-2:]]
    phases = [(e.name.removeprefix("pole-"), e.kind) for e in run.events if start < e.t < end]
    assert phases == [
        ("sleeve-1", "stick"), ("sleeve-1", "slip"), ("sleeve-1", "part"), ("bark-bird", "impact"), ("sleeve-4", "impact"),
        ("sleeve-4", "part"), ("sleeve-1", "impact"), ("sleeve-1", "impact"),
    ]  # fmt: skip
    periods, drops = np.diff(run.t[at]), np.diff(run["sleeve.y"][at])
    assert np.ptp(periods[-3:]) < 2e-4  # of the output times
    assert (periods[-1], drops[-1]) == (pytest.approx(0.1938, abs=2e-4), pytest.approx(-0.0562, abs=1e-4))
