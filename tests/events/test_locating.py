"""Events on equations with closed forms: when they fire, which, and which do not. The loop runs as plain Python."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.numerics.event_location.guards import EITHER, FALLING, RISING
from tests.events.watched_ode import run

G = 9.81
METHODS = ("dop853", "rk45")


def falling(t, q, v):
    return -G + 0.0 * q


def swinging(t, q, v):
    return -q


def resting(t, q, v):
    return 0.0 * q


def times(events):
    return np.array([t for t, _, _ in events])


@pytest.mark.parametrize("method", METHODS)
def test_a_bouncing_ball_is_on_the_floor_when_it_should_be(method):
    """Flights last 2 e^k t1 each, t1 = sqrt(2 h / g)."""

    def bounce(t, y, fired):
        y[1] *= -0.8

    events, rows, _, _ = run(
        falling, lambda t, q, v: q, [1.0, 0.0], 3.5, [FALLING], bounce, np.linspace(0.0, 3.5, 36), method=method
    )
    t1 = np.sqrt(2.0 / G)
    flights = t1 * np.r_[1.0, 2.0 * 0.8 ** np.arange(1, len(events))]
    assert len(events) == 9
    assert np.abs(times(events) - np.cumsum(flights)).max() < 1e-12
    assert np.array_equal(rows[:, 0], np.linspace(0.0, 3.5, 36))
    assert rows[:, 1].min() > -1e-13


def test_bounces_that_become_very_short_are_all_seen():
    """The ball is at rest after t1 (1 + e) / (1 - e); flights down to 1e-9 of the first one, none left out."""

    def bounce(t, y, fired):
        y[1] *= -0.5

    def enough(t, y, fired):
        bounce(t, y, fired)
        return y[1] < 1e-9

    events, _, _, _ = run(falling, lambda t, q, v: q, [1.0, 0.0], 3.0, [FALLING], enough)
    t1 = np.sqrt(2.0 / G)
    flights = t1 * np.r_[1.0, 2.0 * 0.5 ** np.arange(1, len(events))]
    assert len(events) == 33
    assert np.abs(times(events) - np.cumsum(flights)).max() < 1e-12


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("way", "first", "every"), [(FALLING, 0.5, 2.0), (RISING, 1.5, 2.0), (EITHER, 0.5, 1.0)])
def test_directions(way, first, every, method):
    """cos t passes zero at (k + 1/2) pi, falling first."""
    events, _, _, _ = run(swinging, lambda t, q, v: q, [1.0, 0.0], 20.0, [way], rtol=1e-12, method=method)
    wanted = np.pi * np.arange(first, 20.0 / np.pi, every)
    assert len(events) == len(wanted)
    assert np.abs(times(events) - wanted).max() < 2e-10


def test_a_loose_tolerance_spoils_the_motion_and_not_the_event():
    """The state returned is on the event to rounding, whatever the tolerance of the integration is."""
    for rtol in (1e-4, 1e-6, 1e-8):
        events, _, _, _ = run(swinging, lambda t, q, v: q**3 - 0.1, [1.0, 0.0], 10.0, [EITHER], rtol=rtol)
        assert len(events) == 3
        assert max(abs(y[0] ** 3 - 0.1) for _, _, y in events) < 1e-14


@pytest.mark.parametrize("of", ["time", "state"])
def test_four_hundred_changes_in_a_second(of):
    def fast(t, q, v):
        return (np.sin(400.0 * np.pi * (t if of == "time" else q[0]) + 0.3),)

    events, _, _, c = run(resting, fast, [0.0, 1.0], 1.0, [EITHER])
    wanted = (np.arange(1, 401) * np.pi - 0.3) / (400.0 * np.pi)
    assert len(events) == 400
    assert np.abs(times(events) - wanted).max() < 1e-14


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("depth", [1e-12, 1e-10, 1e-6, 1e-2])
def test_grazing(depth, method):
    """A ball thrown to a height of 5 m touches a ceiling that is lower by ``depth``, and not one that is higher."""
    y = [0.0, np.sqrt(10.0 * G)]
    top = np.sqrt(10.0 / G)
    above, _, _, _ = run(falling, lambda t, q, v: 5.0 + depth - q, y, 2.0, [FALLING], method=method)
    assert above == []
    below, _, _, _ = run(falling, lambda t, q, v: 5.0 - depth - q, y, 2.0, [FALLING], method=method)
    assert len(below) == 1
    assert top - below[0][0] == pytest.approx(np.sqrt(2.0 * depth / G), rel=max(1e-9, 1e-14 / depth))
    away, _, _, _ = run(falling, lambda t, q, v: 5.0 - depth - q, y, 2.0, [RISING], method=method)
    assert len(away) == 1
    assert away[0][0] > top


def test_events_at_one_instant_come_together():
    """cos t and its third power pass zero at once, and so do the other end of the same quantity and a copy."""

    def four(t, q, v):
        return q[0], q[0] ** 3 + q[0], -q[0], 0.3 * q[0] - 0.01

    events, _, _, _ = run(swinging, four, [1.0, 0.0], 2.0, [FALLING] * 2 + [RISING] + [FALLING])
    assert [fired for _, fired, _ in events] == [(3,), (0, 1, 2)]


def test_two_that_are_nearly_at_once_come_one_after_the_other():
    def both(t, q, v):
        return q[0], q[0] - 1e-7

    events, _, _, _ = run(swinging, both, [1.0, 0.0], 2.0, [FALLING, FALLING], rtol=1e-12)
    assert [fired for _, fired, _ in events] == [(1,), (0,)]
    assert events[1][0] - events[0][0] == pytest.approx(1e-7, rel=1e-6)


def test_at_the_start_there_is_no_way_through_zero():
    """What begins at zero does not fire until it comes back, whichever way it goes; rounding is no other side."""
    for begin in (0.0, 1e-17, -1e-17):
        events, _, _, _ = run(swinging, lambda t, q, v: q, [begin, 1.0], 7.0, [EITHER], rtol=1e-12)
        assert times(events) == pytest.approx([np.pi, 2.0 * np.pi], abs=1e-10)
        events, _, _, _ = run(swinging, lambda t, q, v: -q, [begin, 1.0], 7.0, [EITHER], rtol=1e-12)
        assert times(events) == pytest.approx([np.pi, 2.0 * np.pi], abs=1e-10)


def test_at_an_output_time_and_at_the_end():
    """The row at the instant of an event holds the state after it, and there is one."""
    end = np.sqrt(2.0 / G)

    def stop(t, y, fired):
        y[1] = 0.0
        y[0] = 7.0

    outputs = [0.0, 0.5 * end, end]
    guard = lambda t, q, v: q - 0.75  # noqa: E731
    events, rows, _, _ = run(falling, guard, [1.0, 0.0], end, [FALLING], stop, outputs)
    assert times(events) == pytest.approx([0.5 * end], rel=1e-14)
    assert rows[:, 0].tolist() == outputs
    assert rows[2, 1] == pytest.approx(7.0 - 0.25, rel=1e-12)
    at_end, rows, _, _ = run(
        falling, lambda t, q, v: q - (1.0 - 0.5 * G * end**2), [1.0, 0.0], end, [FALLING], stop, outputs
    )
    assert len(at_end) <= 1  # the last digit decides
    assert rows[:, 0].tolist() == outputs


def test_a_guard_that_jumps():
    """A sign is no smooth function: its jump is found as near as numbers are, and fires once."""
    events, _, _, _ = run(swinging, lambda t, q, v: np.where(q > 0.3, 1.0, -1.0), [1.0, 0.0], 6.0, [EITHER], rtol=1e-12)
    assert times(events) == pytest.approx([np.arccos(0.3), 2.0 * np.pi - np.arccos(0.3)], abs=1e-9)


def test_a_guard_that_is_not_watched():
    events, _, _, _ = run(swinging, lambda t, q, v: (np.nan, np.inf, q[0]), [1.0, 0.0], 2.0, [EITHER] * 3)
    assert [fired for _, fired, _ in events] == [(2,)]


def test_many_outputs_between_events_are_all_written_once():
    wanted = np.linspace(0.0, 20.0, 1000)
    _, rows, _, _ = run(swinging, lambda t, q, v: q, [1.0, 0.0], 20.0, [EITHER], None, wanted, rtol=1e-11)
    assert np.array_equal(rows[:, 0], wanted)
    assert np.abs(rows[:, 1] - np.cos(wanted)).max() < 1e-9


def test_places_looked_at_without_the_equations():
    """Watching costs evaluations only where a guard comes near zero."""
    evaluations = [0]

    def counted(t, q, v):
        evaluations[0] += 1
        return -q

    run(counted, lambda t, q, v: q - 5.0, [1.0, 0.0], 20.0, [EITHER])
    far = evaluations[0]
    evaluations[0] = 0
    run(counted, lambda t, q, v: [], [1.0, 0.0], 20.0, [])
    assert far < 1.15 * evaluations[0] + 20


def test_what_is_rounding_has_an_end():
    """A guard of denormal numbers, which are zero between the ends of a step, does not keep the loop from going on."""

    def tiny(t, q, v):
        return (1.5e-323 * (t in (0.0, 1.0, 2.0)),)

    _, rows, _, _ = run(resting, tiny, [1.0, 0.0], 2.0, [FALLING], times=[2.0], most=200)
    assert rows[:, 0].tolist() == [2.0]
