"""Events by generalised-alpha and the variational method: order 2 over impacts, turns, rest, contact, as without."""

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers
from tests.mechanisms import example

G = 9.81
ALPHA, VARIATIONAL = "generalised-alpha", "variational"
BOTH = pytest.mark.parametrize("method", [ALPHA, VARIATIONAL])


def off(m, exact, method, step, t, **more):
    """How far positions are from those, times of events from theirs; kinds and names of events are the same."""
    r = m.simulate(t, outputs=31, method=method, step=step, **more)
    assert [(e.name, e.kind) for e in r.events] == [(e.name, e.kind) for e in exact.events]
    assert not r.health.undetermined
    place = max(np.abs(r[b.name].position - exact[b.name].position).max() for b in m.bodies)
    return place, max((abs(a.t - b.t) for a, b in zip(r.events, exact.events, strict=True)), default=0.0)


def of_order_2(m, method, step, t, near):
    """As against `dop853`; ``near``: the largest error of positions at that step."""
    exact = m.simulate(t, outputs=31, method="dop853", rtol=1e-11)
    assert exact.events
    wide, narrow = off(m, exact, method, step, t), off(m, exact, method, step / 4, t)
    assert wide[0] < near
    for a, b in zip(wide, narrow, strict=True):
        assert b < 0.1 * a + 1e-9  # 1/16


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("cam_follower.toml", 3e-5),
        ("capstan.toml", 2e-6),
        ("clock_escapement.toml", 1e-6),
        ("rope_pendulum.toml", 1e-4),
        ("stick_slip.toml", 5e-6),
    ],
)
@BOTH
def test_examples(name, near, method):
    of_order_2(example(name), method, 2e-3, 1.0, near)


def test_a_block_rocks_on_its_corners():
    of_order_2(example("rocking_block.toml"), ALPHA, 2e-3, 1.0, 2e-6)


def swing(*friction):
    """1 kg at 1 m on a hinge, let go beside it."""
    m = fb.Mechanism("swing", planar=True, gravity=(0, -G))
    m.add(fb.Body("b", mass=1, inertia=0.1, position=(1, 0)), fb.Revolute("A", "ground", "b", at=(0, 0)), *friction)
    return m


def slide(*friction):
    """1 kg on a slide and a spring of 20 N/m, let go from rest at 1 m."""
    m = fb.Mechanism("slide", planar=True, gravity=(0, -G))
    m.add(fb.Body("b", mass=1, inertia=0.1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)), *friction)
    m.add(fb.CoordinateSpring("k", "A.displacement", stiffness=20), fb.Initial("A.displacement", value=1))
    return m


@pytest.mark.parametrize("friction", [
    fb.Brake("f", "A.angle", capacity=0.3),
    fb.JointFriction("f", "A", static=0.35, kinetic=0.3, radius=0.1),
    fb.JointFriction("f", "A", static=0.3, kinetic=0.3, radius=0.1),
])  # fmt: skip
@BOTH
@both_layers
def test_a_pendulum_with_friction_turns_and_swings_back(friction, method):
    of_order_2(swing(friction), method, 4e-3, 2.0, 3e-4)


@pytest.mark.parametrize("friction", [
    fb.Brake("f", "A.displacement", capacity=2.3),
    fb.JointFriction("f", "A", static=0.2, kinetic=0.2),
])  # fmt: skip
@BOTH
@both_layers
def test_a_block_let_go_from_rest_slides(friction, method):
    of_order_2(slide(friction), method, 4e-3, 2.0, 2e-4)


def test_what_iterations_leave_over_does_not_add_up():
    """Friction follows what presses, so that multipliers count: of order 2 down to the narrowest steps."""
    m = swing(fb.JointFriction("f", "A", static=0.3, kinetic=0.3, radius=0.1))
    exact = m.simulate(1.0, outputs=31, rtol=1e-11)
    wide, narrow = (off(m, exact, ALPHA, h, 1.0)[0] for h in (1e-3, 2.5e-4))
    assert narrow < 0.1 * wide
    r = m.simulate(1.0, outputs=31, method=ALPHA, step=2.5e-4)
    assert r.health.energy_drift < 3e-6


def test_an_elastic_stop_gives_back_what_falls_on_it():
    """1 kg on 1e7 N/m from 1 m: up to as high as before, after pi / w besides."""
    m = fb.Mechanism("ball", planar=True, gravity=(0, -G))
    m.add(fb.Body("b", mass=1, inertia=0.1, position=(0, 1)))
    m.add(fb.Prismatic("A", "ground", "b", at=(0, 1), axis=(0, 1)))
    m.add(fb.Limit("s", "A.displacement", lower=-1, stiffness=1e7))
    r = m.simulate(1.5, outputs=[1.5], method=ALPHA, step=2e-5, rho_inf=1.0)
    exact = m.simulate(1.5, outputs=[1.5], rtol=1e-11)
    assert [e.t for e in r.events] == pytest.approx([e.t for e in exact.events], abs=1e-6)
    assert r["b"].position[-1, 1] == pytest.approx(exact["b"].position[-1, 1], abs=5e-4)


def test_a_stack_is_pushed_away():
    """Places on outlines are at their corners: rounding must not take them to the next edge."""
    m = fb.Mechanism("stack", planar=True, gravity=(0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))), fb.Contact(friction=0.5))
    for k in range(2):
        m.add(fb.Body(f"b{k}", shape=fb.Box(edges=(0.3, 0.2, 0.2), mass=1), position=(0.01 * k, 0.1 + 0.2 * k)))
    m.add(fb.PointForce("push", "b0", at=(0, 0.1), force=("12*t", 0)))
    of_order_2(m, ALPHA, 4e-3, 1.0, 1e-5)


@pytest.mark.parametrize("step", [1e-3, 7e-3])
@pytest.mark.parametrize("method", [ALPHA, VARIATIONAL, "radau"])
def test_a_driver_whose_law_jumps_is_named(method, step):
    """A shorter step would not do."""
    m = swing(fb.Driver("D", "A.angle", "where(t < 0.5, 0, t - 0.5)"))
    with pytest.raises(fb.SimulationError, match=r"Driver 'D' cannot be followed beyond t = 0\.5 s: its law jumps in its "
                                                 r"rate, from 0 to 1, which requires an infinite force") as e:  # fmt: skip
        m.simulate(1.0, outputs=3, method=method, step=step)
    assert "step;" not in str(e.value)
    assert e.value.result.t[-1] <= 0.5
