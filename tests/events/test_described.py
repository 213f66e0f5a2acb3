"""Events as they are described: in Python, in files, and what is refused with which words."""

from __future__ import annotations

import pytest

import flyball as fb
from flyball.model.model_files import dumps, loads

PARAMETERS = {"k": 2.0, "c": "3 N*s/m"}


def model() -> fb.Mechanism:
    """A rod on a hinge with a tip that is fixed to it, a stop and a rope."""
    m = fb.Mechanism("p", planar=True, gravity=(0, -9.81), parameters=PARAMETERS)
    m.add(fb.Body("rod", mass=1, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Body("tip", mass=1, inertia=0.1, position=(1, 0)), fb.Fixed("W", "rod", "tip", at=(1, 0)))
    m.add(fb.Limit("stop", "A.angle", upper=1))
    m.add(fb.Rope("line", ("ground", "tip"), at=((0, 1), (1, 0)), stiffness=100))
    m.add(fb.Sensor("turned", "A.angle"))
    return m


def every() -> list[fb.Event]:
    """One event with each action and each way of writing."""
    return [
        fb.Event("hit", "A.angle > 90 deg", do=[fb.Stop(), fb.Set("k", "2*k*A.rate"), fb.Lock("A")]),
        fb.Event("back", "turned - 1", direction="falling", times=3, do=[fb.Release("A.angle"), fb.Note("free")]),
        fb.Event("part", "min(t - 1, line.length - 2)", direction="either", do=[fb.Release("W"), fb.Release("line")]),
        fb.Event("go", "start", do=fb.Impulse("tip", (0, "2*k"), at=("1 m", 0), torque="0.1 N*m*s", axes="body")),
        fb.Event("kick", "2 < t", do=fb.Impulse("A", "-2*A.angle_rate")),
        fb.Event("noted", "tip.vy"),
    ]


def test_python_and_files_say_the_same():
    m = model()
    m.add(*every())
    text = dumps(m)
    again = loads(text, fb.Mechanism)
    assert again == m
    assert dumps(again) == text
    assert "[[events]]" in text
    assert '{type = "Set", parameter = "k", value = "2*k*A.rate"}' in text
    assert m.copy() == m
    assert m.snapshot().events == tuple(m.events)
    assert "events     6: hit (A.angle > 90 deg), back (turned - 1)" in repr(m)


def test_actions_as_tables_of_their_own():
    """As one writes TOML by hand."""
    m = model()
    text = dumps(m) + '\n[[events]]\nname = "e"\nwhen = "t - 1"\n[[events.do]]\ntype = "Lock"\nwhat = "A"\n'
    text += '[[events.do]]\ntype = "Stop"\n'
    assert loads(text, fb.Mechanism)["e"].do == (fb.Lock("A"), fb.Stop())


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("A.angle - 1", "A.angle - 1"),
        ("A.angle > 90 deg", "(A.angle) - (90 deg)"),
        ("A.angle < 1", "(1) - (A.angle)"),
        ("A.rate >= 0", "A.rate"),
        ("0 <= where(t < 1, t, A.rate)", "where(t < 1, t, A.rate)"),
    ],
)
def test_a_comparison_becomes_true_where_a_difference_rises_through_zero(written, meant):
    m = model()
    assert m.add(fb.Event("e", written)).law == meant


WRONG = {
    "A.angel - 1": r"when of Event 'e': 'A.angel' is no curve; .*did you mean 'angle'",
    "B.angle": r"when of Event 'e': 'B.angle' is no curve of a part; .*no part named 'B'",
    "rod.ax - 1": r"'rod.ax' is known only after the accelerations are",
    "k - 1": r"when is 'k - 1', which never changes; name t, a sensor, or a curve",
    "3": r"when is '3', which never changes",
    "turnd - 1": r"unknown name 'turnd'",
    "0 < t < 1": r"'0 < t < 1' has 2 comparisons; write one: both of two are true where min",
    "t == 1": r"'t == 1' is an equality; write the difference",
    "t - 1 s": r"a quantity in a formula must be in parentheses",
    "": r"the expression is empty",
    "start": r"nothing is done at the start; give do",
}


@pytest.mark.parametrize("when", WRONG)
def test_expressions_that_make_no_event_are_refused(when):
    with pytest.raises(fb.ModelError, match=WRONG[when]):
        model().add(fb.Event("e", when))


UNFIT = [
    (fb.Set("q", 1), r"Event 'e': Set of 'q': 'p' has no parameter 'q'; known: k, c"),
    (fb.Set("c", "2 m"), r"value of Set of 'c' in Event 'e'"),
    (fb.Set("k", "A.fx"), r"'A.fx' is known only after"),
    (fb.Lock("B"), r"Lock of 'B': there is no part named 'B'; name a joint, a coordinate"),
    (fb.Lock("rod"), r"Body 'rod' has the coordinates x, y, angle; name one, as in 'rod.x'"),
    (fb.Lock("A.x"), r"no coordinate 'x'; it has angle"),
    (fb.Release("turned"), r"Sensor 'turned' is no joint, coordinate, driver, limit or rope"),
    (
        [fb.Lock("A"), fb.Release("A.angle")],
        r"Lock of 'A' and Release of 'A.angle' are both in do, and they contradict",
    ),
    ([fb.Set("k", 1), fb.Set("k", 2)], r"Set of 'k' and Set of 'k' are both in do, and each may be given once"),
    ([fb.Stop(), fb.Stop()], r"Stop and Stop are both in do"),
    (fb.Impulse("rod"), r"Impulse of 'rod': it is none; give impulse"),
    (fb.Impulse("rod", (1, 0, 0)), r"impulse needs 2 components, such as \(0, 1\), got"),
    (fb.Impulse("rod", torque=(0, 0, 1)), r"torque needs 1 component, such as 0.5, got"),
    (fb.Impulse("rod", torque=1, at=(0, 0)), r"at has no effect on the impulse of a torque alone"),
    (fb.Impulse("rod", (1, 0), at=(0, "2 s")), r"at of Impulse of 'rod' in Event 'e'"),
    (fb.Impulse("ground", (1, 0)), r"an impulse on ground has no effect"),
    (fb.Impulse("A", (1, 0)), r"impulse needs 1 component"),
    (fb.Impulse("A", 1, axes="body"), r"axes is of a body; along a coordinate give one number"),
    (fb.Impulse("A", "1 N"), r"impulse of Impulse of 'A' in Event 'e': '1 N': expected a quantity \[N\*m\*s\]"),
    (fb.Impulse("W", 1), r"Fixed 'W' has 0 coordinates; name a body"),
    (fb.Impulse("X", 1), r"there is no body, frame or joint named 'X'"),
]


@pytest.mark.parametrize(("do", "message"), UNFIT)
def test_actions_that_cannot_be_done_are_refused(do, message):
    with pytest.raises(fb.ModelError, match=message):
        model().add(fb.Event("e", "t - 1", do=do))


def test_what_a_driver_prescribes_cannot_be_locked():
    m = model()
    m.add(fb.Driver("motor", "A.angle", "t"))
    with pytest.raises(fb.ModelError, match=r"Lock of 'A': Driver 'motor' prescribes 'A.angle'"):
        m.add(fb.Event("e", "t - 1", do=fb.Lock("A")))


FIELDS = [
    (lambda: fb.Event("e", "t", direction="up"), r"field 'direction': Input should be 'rising', 'falling' or 'either'"),
    (lambda: fb.Event("e", "t", times=0), r"field 'times': give a whole number from 1"),
    (lambda: fb.Event("e", "t", times=1.5), r"field 'times'"),
    (lambda: fb.Event("e", "t", once=True), r"it is called times, here times=1"),
    (lambda: fb.Event("e", "t", do=fb.Stop), r"field 'do': give Stop\(...\) with parentheses"),
    (lambda: fb.Event("e", "t", do="stop"), r"give actions such as fb.Impulse\(...\), fb.Lock\(...\)"),
    (lambda: fb.Event("e", "t", do=[{"type": "Stp"}]), r"unknown action 'Stp' \(did you mean 'Stop'\?\); actions are"),
    (lambda: fb.Event("e", "t", do=[{"what": "A"}]), r"an action has no type"),
    (lambda: fb.Event("e"), r"field 'when' is missing"),
    (lambda: fb.Set("k"), r"Set 'k': field 'value' is missing"),
    (lambda: fb.Note(""), r"give a name"),
    (lambda: fb.Impulse(step=1e-3), r"options of impulse time stepping are fb.Stepping"),
]


@pytest.mark.parametrize(("make", "message"), FIELDS)
def test_wrong_fields_are_named(make, message):
    with pytest.raises(fb.ModelError, match=message):
        make()


@pytest.mark.parametrize(("field", "value"), [("direction", "either"), ("times", 2)])
def test_the_start_has_no_direction_and_comes_once(field, value):
    with pytest.raises(fb.ModelError, match=f"{field} has no effect at the start; leave it out"):
        model().add(fb.Event("e", "start", do=fb.Stop(), **{field: value}))


def test_start_must_mean_one_thing():
    m = fb.Mechanism("p", planar=True, parameters={"start": 1.0})
    with pytest.raises(fb.ModelError, match="'p' has a parameter or sensor of that name; rename that"):
        m.add(fb.Event("e", "start", do=fb.Stop()))


def test_laws_of_forces_say_how_curves_are_used():
    m = model()
    with pytest.raises(fb.ModelError, match=r"laws use curves by sensors: add fb.Sensor\('name', 'A.angle'\)"):
        m.add(fb.PointForce("f", "rod", force=("A.angle", 0)))


def test_a_function_may_say_when():
    m = model()
    m.add(fb.Event("e", lambda t, turned: turned - t))
    with pytest.raises(fb.ModelError, match="Event 'e': when is the Python function"):
        dumps(m)


def test_check_lists_them():
    m = fb.Mechanism("p", planar=True)
    m.add(fb.Body("rod", mass=1, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Event("hit", "A.angle > 90 deg", times=1, do=[fb.Lock("A"), fb.Stop()]))
    m.add(fb.Event("low", "A.angle", direction="falling"))
    lines = dict(m.check().lines())
    assert lines["event hit"] == "A.angle > 90 deg, once: Lock A, Stop"
    assert lines["event low"] == "A.angle (falling): noted"
