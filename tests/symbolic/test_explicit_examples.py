"""Explicit equations of every example have the engine's accelerations."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.model.contact import has_contact
from tests.examples.test_examples import EVENTS, LARGE, ROBOTS
from tests.mechanisms import EXAMPLES, example
from tests.symbolic.explicit_made import engine, whole

NAMES = sorted(p.name for p in EXAMPLES.iterdir() if p.suffix in (".toml", ".py") and p.name not in ROBOTS | LARGE)


@pytest.mark.parametrize("name", NAMES)
def test_every_example(name):
    """At states about the start, and at other times where drivers move all; implicit coordinates included."""
    m = example(name)
    if has_contact(m) or m.controllers or name in EVENTS:
        pytest.skip("contact, controllers and events are refused by m.symbolic")
    s = m.symbolic().state_space()
    coordinates = s.equations.coordinates.partition(":")[0]
    rng = np.random.default_rng(0)
    for t in (0.0, 0.02, 0.05):
        x = s.start + rng.uniform(-0.1, 0.1, len(s.start)) * (np.abs(s.start) + 0.3)
        for k, state in enumerate(s.states):
            if state.endswith(".e0"):
                x[k : k + 4] /= np.linalg.norm(x[k : k + 4])
        q, v, a = whole(s, x, t)
        exact = engine(m, coordinates, t, q, v, s.point(x, t=t))
        assert np.abs(a - exact).max() <= 1e-12 * np.abs(exact).max() + 1e-11  # the engine's rounding where all rests
