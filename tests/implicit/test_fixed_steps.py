"""Steps of fixed width of the explicit methods: orders at their ends and between them, events, what is refused."""

import numpy as np
import pytest

import flyball as fb
from tests.implicit.test_radau import errors, pendulum
from tests.layers import both_layers
from tests.mechanisms import spatial_four_bar


@both_layers
@pytest.mark.parametrize(("method", "steps", "order", "dense"), [("rk45", 20, 5, 5), ("dop853", 5, 8, 7)])
def test_orders_of_positions_velocities_and_reactions(method, steps, order, dense):
    """Against Jacobi's elliptic functions, at the ends of steps and between them."""
    at_ends, between = [], []
    for n in (steps, 2 * steps):
        for at, found in ((np.arange(1, 6) / 5, at_ends), (np.arange(5) / 5 + 0.374 / n, between)):
            r = pendulum().simulate(1.0, outputs=at, method=method, step=1.0 / n, rtol=1e-12)
            assert (r.health.steps, r.health.rejected) == (n, 0)
            found.append(errors(r))
    assert (np.log2(at_ends[0] / at_ends[1]) > order - 0.5).all()
    assert (np.log2(between[0] / between[1]) > dense - 0.5).all()


def test_order_in_space_with_works():
    """A loop in space with a motor: positions, and the motor's work, of order 5; quaternions stay of unit length."""
    m = spatial_four_bar()
    m.add(fb.Motor("motor", m.joints[0].name, torque="2 - 0.3*rate"))
    exact = m.simulate(0.4, outputs=[0.4], rtol=1e-12)
    off, work = [], []
    for step in (0.01, 0.005):
        r = m.simulate(0.4, outputs=[0.4], method="rk45", step=step, rtol=1e-12, coordinates="absolute")
        off.append(max(np.abs(r[b.name].position - exact[b.name].position).max() for b in m.bodies))
        work.append(np.abs(r["motor"].work - exact["motor"].work).max())
        turns = r.q[:, [7 * k + i for k in range(len(m.bodies)) for i in range(3, 7)]].reshape(-1, 4)
        assert np.abs(np.linalg.norm(turns, axis=1) - 1.0).max() < 1e-15
    assert 4.5 < np.log2(off[0] / off[1]) < 6.5
    assert np.log2(work[0] / work[1]) > 4.5


def test_a_step_ends_at_an_event_and_goes_on():
    """A ball that bounces with e = 1/2, dropped from 1 m: blows at known times, whatever the steps."""
    m = fb.Mechanism("ball", gravity=(0, 0, -9.81))
    m.add(fb.Body("b", mass=1.0, inertia=(1, 1, 1), position=(0, 0, 1)))
    m.add(fb.Prismatic("p", "ground", "b", at=(0, 0, 0), axis=(0, 0, 1)))
    coordinate = "p." + next(iter(m["p"].coordinates))
    m.add(fb.Limit("floor", coordinate, lower=-1.0, restitution=0.5))
    fall = np.sqrt(2.0 / 9.81)
    r = m.simulate(2.0, outputs=[2.0 * fall], method="rk45", step=0.03)
    assert [e.t for e in r.events[:2]] == pytest.approx([fall, 2.0 * fall], rel=1e-9)
    steps = m.simulate(0.9, outputs=2, method="rk45", step=0.03).health.steps
    assert 0 <= steps - 31 <= 2  # one or two are cut to look closely


def refused(**options):
    with pytest.raises(fb.ModelError) as error:
        pendulum().simulate(1.0, **options)
    return str(error.value)


def test_what_does_nothing_is_refused():
    assert "max_step has no effect with fixed steps" in refused(step=0.1, max_step=0.2)
    assert "step must be greater than 0" in refused(step=-1.0)
    assert "Stepping(step=...)" in refused(step=0.1, method="impulse")
    assert pendulum().simulate(1.0, step="100 ms").health.steps == 10


def test_a_step_that_cannot_be_taken_is_told():
    """At steps of half a turn the stages find no positions in which the loop closes."""
    m = spatial_four_bar()
    with pytest.raises(fb.SimulationError, match=r"a step of 5 s has no solution.*give a shorter step"):
        m.simulate(50.0, step=5.0)
