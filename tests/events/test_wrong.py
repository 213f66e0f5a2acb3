"""What a user writes wrongly of events: each is refused by names, with what to write instead."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.errors import ExpressionError, ModelError, UnitError


def arm(*parts) -> fb.Mechanism:
    """An arm on a hinge."""
    m = fb.Mechanism("p", planar=True, gravity=(0, -9.81), parameters={"k": 8.0, "grip": 5.0})
    m.add(fb.Body("a", mass=1, inertia=1, position=(1, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(*parts)
    return m


@pytest.mark.parametrize(
    ("when", "error", "said"),
    [
        ("A.angle + 90 deg", ExpressionError, r"must be in parentheses, here \(90 deg\)"),
        ("sin(t)*2.5e-3 kN + t", ExpressionError, r"here \(2\.5e-3 kN\)"),
        ("A.angle > 1 m", UnitError, r"Event 'e': in 'A\.angle > 1 m' A\.angle is '1 rad'; '1 m': expected"),
        ("90 deg < a.x", UnitError, r"in '90 deg < a\.x' a\.x is '1 m'; '90 deg': expected"),
        ("A.angle_rate > 3 rad", UnitError, r"A\.angle_rate is '1 rad/s'"),
        ("A.angel > 1", ModelError, r"'A\.angel' is no curve; Revolute 'A' has A\.angle, .*did you mean 'angle'"),
        ("B.angle > 1", ModelError, r"There is no part named 'B'; known: a, A"),
        ("0 < t < 1", ModelError, r"has 2 comparisons; write one"),
        ("k > 3", ModelError, r"when is 'k > 3', which never changes"),
    ],
)
def test_conditions(when, error, said):
    with pytest.raises(error, match=said):
        arm(fb.Event("e", when))


@pytest.mark.parametrize(
    ("when", "what", "limit"),
    [
        ("A.angle < -30 deg", "A.angle", -np.pi / 6),
        ("A.angle < (-90 deg)/2", "A.angle", -np.pi / 4),
        ("a.x < 500 mm", "a.x", 0.5),
        ("20 rpm < -A.angle_rate", "A.angle_rate", -2 * np.pi / 3),
    ],
)
def test_units_that_fit(when, what, limit):
    """The arm falls from the horizontal; the event is where the quantity has that value in SI units."""
    r = arm(fb.Event("e", when, do=[fb.Stop()])).simulate(2.0)
    assert r[what][-1] == pytest.approx(limit, rel=1e-6)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: fb.Stop("x"), r"Stop: 1 values are given for its fields; it has none"),
        (lambda: fb.Note("a", "b"), r"Note: 2 values are given for its fields; it has 1: text"),
        (lambda: fb.Event("e", "t - 1", do=[fb.Stop]), r"give Stop\(\.\.\.\) with parentheses"),
    ],
)
def test_actions(made, said):
    with pytest.raises(ModelError, match=said):
        made()


def test_a_start_beyond_a_limit_tells_degrees():
    with pytest.raises(
        ModelError, match=r"starts beyond it: A\.angle is 0 rad and must be at least 0\.174533 rad \(10 deg\)"
    ):
        arm(fb.Limit("L", "A.angle", lower="10 deg")).simulate(1)


def test_what_is_true_all_along_does_not_become_true():
    """It is told, of those that never happen; not of one that becomes false and true again."""
    m = arm(fb.Event("ever", "t + 1 > 0", do=[fb.Stop()]), fb.Event("back", "A.angle < -0.1"), fb.Event("sub", "t + 2"))
    m.add(fb.Event("again", "sin(2*pi*t) < 0.5"))
    r = m.simulate(1)
    (said,) = [w for w in r.health.warnings if "never happened" in w]
    assert said.startswith("Event 'ever' never happened: 't + 1 > 0' was true from the start")
    assert r.events["again"].t == pytest.approx([5 / 12], abs=1e-9)


def test_what_became_true_before_a_motion_goes_on_is_not_told_as_never():
    m = arm(fb.Event("late", "t > 0.1"))
    first = m.simulate(0.2, outputs=3)
    assert first.events["late"].t == pytest.approx([0.1], abs=1e-12)
    assert not [w for w in m.simulate(0.3, start=first, outputs=3).health.warnings if "never happened" in w]


def test_a_file_tells_its_line(tmp_path: Path):
    path = tmp_path / "v.toml"
    arm().save(path)
    path.write_text(path.read_text() + '\n[[events]]\nname = "e"\nwhen = "A.angle > 1 m"\n')
    with pytest.raises(UnitError, match=r"v\.toml: \[\[events\]\] 1 'e' \(line \d+\): Event 'e': in 'A\.angle > 1 m'"):
        fb.load(path)
