"""Values between the ends of steps that turn a body far: as good as those at the ends."""

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import free_body

METHODS = pytest.mark.parametrize(("method", "turn"), [("variational", 1.8), ("variational", 3.0), ("variational", 7.0),
                                                       ("generalised-alpha", 1.8)])  # fmt: skip


def places(step, part, steps=20):
    return np.r_[0.0, (np.arange(steps) + part) * step]


@METHODS
@pytest.mark.parametrize("part", [0.25, 0.5, 0.9])
def test_steady_turns_are_exact(method, turn, part):
    step = turn / 100.0
    t = places(step, part)
    r = free_body(inertia=(1.0, 1.0, 2.0), w=(0.0, 0.0, 100.0)).simulate(t[-1], outputs=t, method=method, step=step)
    x = r["b"].rotation[:, :, 0]
    near = 1e-11 if method == "variational" else 1e-4  # what its iteration leaves of each step
    assert np.abs(x - np.column_stack([np.cos(100 * t), np.sin(100 * t), 0 * t])).max() < near


@pytest.mark.parametrize(("method", "turn"), [("variational", 1.8), ("variational", 3.0), ("generalised-alpha", 1.8)])
def test_a_body_that_tumbles(method, turn):
    """Its error at the ends of steps is that of the method, and between them it is no larger."""
    step, off = turn / 100.0, []
    m = free_body(inertia=(1.0, 2.0, 2.5), w=(1.0, 0.3, 100.0))
    for part in (1.0, 0.5):
        t = places(step, part)
        r, exact = (m.simulate(t[-1], outputs=t, **how) for how in ({"method": method, "step": step}, {"rtol": 1e-11}))
        off.append(
            [np.abs(getattr(r["b"], k) - getattr(exact["b"], k)).max() for k in ("rotation", "angular_velocity")]
        )
    assert off[0][0] < 0.03
    assert (np.array(off[1]) < 1.2 * np.array(off[0])).all()


@pytest.mark.parametrize("step", [0.018, 0.03])
def test_an_event_within_a_step_is_where_the_body_is(step):
    m = free_body(inertia=(1.0, 1.0, 2.0), w=(0.0, 0.0, 100.0))
    m.add(fb.Frame("tip", "b", position=(1, 0, 0)), fb.Sensor("high", "tip.y"), fb.Event("top", "high > 0.6", times=1))
    (e,) = m.simulate(0.1, method="variational", step=step).events
    assert e.t == pytest.approx(np.arcsin(0.6) / 100.0, rel=1e-9)
