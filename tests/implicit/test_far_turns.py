"""Values between the ends of steps that turn a body far: as good as those at the ends."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball.math import rotation
from flyball.numerics.integrators import implicit_method
from flyball.numerics.integrators.implicit_method import END_ROW
from flyball.numerics.integrators.implicit_workspace import STEP_START
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


def test_what_is_between_steps_has_their_values_and_rates():
    """Cubics within a step: places and turns begin and end where the step does, with its velocities there."""
    h, near = 0.1, 1e-6
    v, d, rate, z = np.zeros((4, 4)), np.zeros((4, 4)), np.zeros((4, 1)), np.zeros((4, 1))
    v[[STEP_START, END_ROW]] = (1.0, -2.0, 0.5, 0.3), (1.5, -1.0, 0.9, -0.4)
    d[END_ROW] = *rotation.cayley_step(rotation.cayley_quaternion((0.14, -0.13, 0.08))), 0.02
    rate[[STEP_START, END_ROW]], z[[STEP_START, END_ROW]] = ((0.7,), (-0.2,)), ((2.0,), (2.1,))
    K = SimpleNamespace(v=v, d=d, rate=rate, z=z, ends=np.zeros((2, 4)), turns=np.array([0]))

    def at(x):
        out = np.zeros(4), np.zeros(4), np.zeros(1)
        implicit_method.interpolate_hermite(K, x, h, *out)
        turn = Rotation.from_quat(np.roll(rotation.cayley_quaternion(tuple(out[0][:3])), -1))
        return turn, np.r_[out[0][3], out[2]]

    for x, k in ((0.0, STEP_START), (1.0, END_ROW)):
        (here, f), (before, a), (after, b) = at(x), at(x - near), at(x + near)
        there = Rotation.from_quat(np.roll(rotation.cayley_quaternion(tuple(d[k, :3])), -1))
        assert (there.inv() * here).magnitude() < 1e-14
        assert f == pytest.approx([d[k, 3], z[k, 0]], abs=1e-14)
        assert (before.inv() * after).as_rotvec() / (2 * near * h) == pytest.approx(v[k, :3], abs=1e-6)
        assert (b - a) / (2 * near * h) == pytest.approx([v[k, 3], rate[k, 0]], abs=1e-6)


def test_angles_between_bodies_that_both_turn_far_count_their_turns():
    """Two discs on one axle at 50 and 51 rad/s, which a step turns by more than once: the angle grows by 1 rad/s."""
    m = fb.Mechanism("discs", gravity=(0, 0, 0))
    for name, w in (("a", 50.0), ("b", 51.0)):
        m.add(fb.Body(name, mass=1.0, inertia=(1, 1, 1.5), angular_velocity=(0, 0, w)))
    m.add(fb.Revolute("axle", "a", "b", at=(0, 0, 0), axis=(0, 0, 1)))
    r = m.simulate(10.0, outputs=2, method="variational", step=0.14)
    assert r["axle"].angle[-1] == pytest.approx(10.0, abs=1e-9)
