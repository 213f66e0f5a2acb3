"""Motions in which events act, against closed forms, in both layers of coordinates."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flyball as fb

LAYERS = ("joint", "absolute")


@pytest.fixture(params=LAYERS)
def layer(request):
    return request.param


def slide(**parameters: float) -> fb.Mechanism:
    """A block of 2 kg on a smooth slide along x."""
    m = fb.Mechanism("slide", planar=True, parameters={"k": 8.0, "c": 0.0, "m": 2.0, **parameters})
    m.add(fb.Body("b", mass="m", inertia=1.0), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(1, 0)))
    return m


def test_stop_ends_the_motion_with_success(layer):
    m = slide()
    m.add(fb.Initial("A.displacement", rate=3.0), fb.Event("there", "A.displacement > 1.5", do=fb.Stop()))
    r = m.simulate(2, outputs=21, coordinates=layer)
    assert r.health.success
    assert r.health.message == "ended at 0.5 s by event 'there' (requested: 2 s)"
    assert r.health.status == dict(r.health.lines())["status"] == r.health.message
    assert r.health.ended_early
    assert "ended at 0.5 s by event 'there' (requested: 2 s)" in repr(r)
    assert r.t[-1] == pytest.approx(0.5, abs=1e-12)
    assert r["A.displacement"][-1] == pytest.approx(1.5, abs=1e-12)
    assert [(h.name, h.kind, h.done) for h in r.events] == [("there", "event", ("ended the motion",))]


def test_a_note_changes_nothing(layer):
    """A swing of a spring passes zero twice a period, to the tolerance."""
    m = slide()
    m.add(fb.CoordinateSpring("s", "A.displacement", stiffness="k"), fb.Initial("A.displacement", value=1.0))
    m.add(fb.Event("zero", "A.displacement", direction="either", do=fb.Note("middle")))
    m.add(fb.Event("down", "A.displacement", direction="falling", times=2))
    r = m.simulate(4, outputs=81, coordinates=layer)
    assert np.abs(r["A.displacement"] - np.cos(2 * r.t)).max() < 1e-6
    assert r.events["zero"].t == pytest.approx([math.pi / 4 * (2 * k + 1) for k in range(3)], abs=1e-7)
    assert r.events["down"].t == pytest.approx([math.pi / 4, 5 * math.pi / 4], abs=1e-7)
    assert {h.done for h in r.events["zero"]} == {("middle",)}
    assert r.events.lost.sum() == 0.0


def test_a_stiffness_that_is_set_where_the_spring_is_slack_costs_nothing(layer):
    """Four times as stiff from the middle on: twice the frequency, half the swing."""
    m = slide()
    m.add(fb.CoordinateSpring("s", "A.displacement", stiffness="k"), fb.Initial("A.displacement", value=1.0))
    m.add(fb.Event("zero", "A.displacement", direction="falling", do=fb.Set("k", "4*k"), times=1))
    r = m.simulate(2, outputs=201, coordinates=layer)
    t1 = math.pi / 4
    exact = np.where(r.t < t1, np.cos(2 * r.t), -0.5 * np.sin(4 * (r.t - t1)))
    assert np.abs(r["A.displacement"] - exact).max() < 1e-6
    assert r.events[0].done == ("k = 32, was 8",)
    assert np.abs(r["s"].energy - np.where(r.t < t1, 4.0, 16.0) * exact**2).max() < 1e-5
    assert r.energy.drift < 1e-5


@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_energy_that_a_stiffness_brings_is_told(layer, damping):
    """Where the spring is stretched by 1 m, 8 N/m more store 4 J more."""
    m = slide()
    m.add(fb.CoordinateSpring("s", "A.displacement", stiffness="k", damping=damping))
    m.add(fb.Initial("A.displacement", value=1.0), fb.Event("harder", "start", do=fb.Set("k", 16)))
    m.add(fb.Event("softer", "t - 1", do=fb.Set("k", "k - 8")))
    r = m.simulate(2, outputs=41, coordinates=layer)
    w = math.sqrt(16 / 2 - (damping / 4) ** 2)
    x1 = math.exp(-damping / 4) * (math.cos(w) + damping / 4 / w * math.sin(w))
    assert r["A.displacement"][20] == pytest.approx(x1, abs=1e-6)
    given = r["energy.event_work"]
    assert given[0] == 0.0  # of the start, counted from after it
    assert given[-1] == pytest.approx(-4.0 * x1**2, abs=1e-6)
    assert r.energy.drift < 1e-5
    assert r["s"].energy[0] == pytest.approx(8.0, abs=1e-9)


def test_mass_that_goes_takes_its_energy_along(layer):
    """Half the mass is dropped at 3 m/s: what stays goes on, what goes had 4.5 J."""
    m = slide()
    m.add(fb.Initial("A.displacement", rate=3.0), fb.Event("drop", "t - 0.5", do=fb.Set("m", "m/2")))
    m.add(fb.PointForce("f", "b", force=(2.0, 0)))
    r = m.simulate(1, outputs=11, coordinates=layer)
    assert r["b.vx"][-1] == pytest.approx(3.0 + 0.5 * 1.0 + 0.5 * 2.0, abs=1e-9)
    assert r["energy.event_work"][-1] == pytest.approx(-0.5 * 1.0 * 3.5**2, abs=1e-8)
    assert r.energy.drift < 1e-8


def test_lock_and_release(layer):
    m = slide()
    m.add(fb.Initial("A.displacement", rate=3.0), fb.Event("hold", "t - 0.5", do=fb.Lock("A")))
    m.add(fb.Event("free", "t - 1", do=[fb.Release("A"), fb.Impulse("A", 4)]))
    r = m.simulate(2, outputs=201, coordinates=layer)
    x = np.where(r.t < 0.5, 3 * r.t, np.where(r.t < 1, 1.5, 1.5 + 2 * (r.t - 1)))
    assert np.abs(r["A.displacement"] - x).max() < 1e-9
    hold, free = r.events
    assert (hold.done, hold.lost) == (("locked A",), pytest.approx(9.0, abs=1e-9))
    assert hold.impulses["A.displacement"] == pytest.approx(-6.0, abs=1e-9)
    assert (hold.before["b.vx"], hold.after["b.vx"]) == pytest.approx((3.0, 0.0), abs=1e-9)
    assert free.done == ("released A", "impulse on A: 4 N s")
    assert free.after["A.rate"] == pytest.approx(2.0, abs=1e-9)
    assert r.energy.drift < 1e-8


def rods(planar: bool) -> fb.Mechanism:
    """Two rods of 1 kg and 1 m in a row, hung up at the origin, without gravity."""
    m = fb.Mechanism("rods", planar=planar)
    z = (lambda x: (x, 0)) if planar else (lambda x: (x, 0, 0))
    I = 1 / 12 if planar else (1e-3, 1 / 12, 1 / 12)
    axis = {} if planar else {"axis": (0, 0, 1)}
    m.add(fb.Body("one", mass=1, inertia=I, position=z(0.5)), fb.Body("two", mass=1, inertia=I, position=z(1.5)))
    m.add(fb.Revolute("A", "ground", "one", at=z(0), **axis), fb.Revolute("B", "one", "two", at=z(1), **axis))
    m.add(fb.Frame("end", "two", position=z(0.5)))
    return m


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("way", ["at", "frame", "torque", "coordinate"])
def test_a_blow_on_a_double_rod(layer, planar, way):
    """M w = J, with M of the stretched double rod in absolute turns: ((4/3, 1/2), (1/2, 1/3)).

    Hinges carry what else the momentum across changes by: w1 / 2 of the first rod, w1 + w2 / 2 of the second.
    """
    m = rods(planar)
    force = (0, 0.7) if planar else (0, 0.7, 0)
    p = (2, 0) if planar else (2, 0, 0)
    blow, J = {
        "at": (fb.Impulse("two", force, at=p), (0.7, 0.7)),
        "frame": (fb.Impulse("end", force, axes="body"), (0.7, 0.7)),
        "torque": (fb.Impulse("two", torque=0.7 if planar else (0, 0, 0.7)), (0.0, 0.7)),
        "coordinate": (fb.Impulse("B.angle", "0.7 N*m*s"), (-0.7, 0.7)),
    }[way]
    m.add(fb.Event("hit", "start", do=blow))
    r = m.simulate(0.01, outputs=2, coordinates=layer)
    w = np.linalg.solve([[4 / 3, 1 / 2], [1 / 2, 1 / 3]], J)
    assert [r["A.rate"][0], r["A.rate"][0] + r["B.rate"][0]] == pytest.approx(w, abs=1e-10)
    assert r["energy.kinetic"][0] == pytest.approx(0.5 * np.dot(J, w), abs=1e-10)
    assert r.events[0].before["energy.kinetic"] == 0.0
    assert r.energy.drift < 1e-9
    own, last = 0.7 if way in ("at", "frame") else 0.0, w[0] + 0.5 * w[1]
    for joint, p in {"A": 0.5 * w[0] + last - own, "B": last - own}.items():
        assert r.events[0].impulses[joint] == pytest.approx([0, p, 0, 0, 0, 0], abs=1e-9)


def test_sudden_stop_of_a_double_rod(layer):
    """It turns as one at w = 2; the first is locked to ground: about B the second keeps I_B w of its angular momentum.

    Angular momentum of the second about B: 1/12 w + 1/2 * 3/2 w = 5/6 w, so it turns at 5/2 w then.
    """
    m = rods(True)
    m.add(
        fb.Initial("A.angle", rate=2.0),
        fb.Initial("B.angle", rate=0.0),
        fb.Event("lock", "A.angle > 0.4", do=fb.Lock("A")),
    )
    r = m.simulate(0.3, outputs=31, coordinates=layer)
    (lock,) = r.events
    assert lock.t == pytest.approx(0.2, abs=1e-9)
    assert lock.after["B.rate"] == pytest.approx(2.5 * 2.0, abs=1e-8)
    before, after = 0.5 * (8 / 3) * 4.0, 0.5 * (1 / 3) * 25.0
    assert lock.lost == pytest.approx(before - after, abs=1e-8)
    assert r["A.angle"][-1] == pytest.approx(0.4, abs=1e-10)
    assert r["B.angle"][-1] == pytest.approx(5.0 * 0.1, abs=1e-7)


@pytest.mark.parametrize("planar", [True, False])
def test_a_joint_lets_go_and_holds_again(layer, planar):
    """A thrown stone: it leaves the arm along the tangent, flies freely."""
    m = fb.Mechanism("sling", planar=planar)
    z = (1, 0) if planar else (1, 0, 0)
    I = 0.1 if planar else (0.1, 0.1, 0.1)
    axis = {} if planar else {"axis": (0, 0, 1)}
    m.add(fb.Body("arm", mass=3, inertia=I), fb.Body("stone", mass=1, inertia=I, position=z))
    m.add(fb.Revolute("A", "ground", "arm", at=(0, 0) if planar else (0, 0, 0), **axis))
    m.add(fb.Fixed("hand", "arm", "stone", at=z))
    m.add(fb.Initial("A.angle", rate=2.0), fb.Event("throw", "A.angle - 1", do=fb.Release("hand")))
    r = m.simulate(1, outputs=101, coordinates=layer)
    late = r.t > 0.5
    x = math.cos(1) - 2 * math.sin(1) * (r.t[late] - 0.5)
    y = math.sin(1) + 2 * math.cos(1) * (r.t[late] - 0.5)
    assert np.abs(r["stone.x"][late] - x).max() < 1e-7
    assert np.abs(r["stone.y"][late] - y).max() < 1e-7
    assert r["A.angle"] == pytest.approx(2 * r.t, abs=1e-7)
    assert r.events["throw"][0].done == ("released hand",)
    assert np.abs(r["hand"].force[late]).max() == 0.0
    assert np.abs(r["hand"].force[~late]).max() == pytest.approx(4.0, abs=1e-6)
    assert r.energy.drift < 1e-7


def test_a_joint_that_is_open_does_not_hold(layer):
    m = fb.Mechanism("open", planar=True, gravity=(0, -10))
    m.add(fb.Body("b", mass=1, inertia=1), fb.Fixed("hook", "ground", "b", at=(0, 0)))
    m.add(fb.Event("drop", "t - 0.1", do=fb.Release("hook")), fb.Event("catch", "t - 0.2", do=fb.Lock("hook")))
    with pytest.raises(fb.SimulationError, match=r"Lock of 'hook' in Event 'catch': it is open by 0.05") as error:
        m.simulate(1, coordinates=layer)
    assert error.value.t == pytest.approx(0.2)
    assert error.value.result.t[-1] == pytest.approx(0.2, abs=2.1e-3)


def test_expressions_are_reckoned_just_before(layer):
    """A blow that turns the velocity round, and a parameter by time and speed."""
    m = slide()
    m.add(fb.Initial("A.displacement", rate=3.0))
    m.add(fb.Event("back", "b.x > 1.5", do=[fb.Impulse("b", ("-2*m*b.vx", 0)), fb.Set("k", "t + A.rate")]))
    r = m.simulate(1, outputs=11, coordinates=layer)
    assert r["b.x"] == pytest.approx(np.where(r.t < 0.5, 3 * r.t, 3 - 3 * r.t), abs=1e-9)
    assert r.events[0].done[0] == "k = 3.5, was 8"
    assert r["energy.event_work"] == pytest.approx(0 * r.t, abs=1e-9)


def test_events_that_set_off_each_other_at_one_instant(layer):
    """A parameter that is set takes another expression through zero: that event is there and then."""
    m = slide()
    m.add(fb.Initial("A.displacement", rate=3.0))
    m.add(fb.Event("first", "t - 0.5", do=fb.Set("k", 20)), fb.Event("second", "k - 10 + 0*t", do=fb.Set("c", 1)))
    m.add(fb.Event("third", "c*A.rate - 1", do=fb.Stop()))
    r = m.simulate(1, coordinates=layer)
    assert [h.name for h in r.events] == ["first", "second", "third"]
    assert r.events.t == pytest.approx([0.5] * 3, abs=1e-9)


def test_no_end_at_one_instant(layer):
    m = slide()
    m.add(fb.Event("on", "where(k > 10, 1, -1)*(t + 1)", direction="either", do=fb.Set("k", "where(k > 10, 8, 12)")))
    m.add(fb.Event("begin", "t - 0.5", do=fb.Set("k", 12)))
    with pytest.raises(fb.SimulationError, match=r"t = 0.5\d* s events follow each other without end .* on") as error:
        m.simulate(1, coordinates=layer)
    assert error.value.result.t[-1] == pytest.approx(0.5, abs=2.1e-3)


def test_actions_that_contradict_at_one_instant(layer):
    m = slide()
    m.add(
        fb.Event("hold", "t - 0.5", do=fb.Lock("A")),
        fb.Event("free", "0.5 - t", direction="falling", do=fb.Release("A")),
    )
    with pytest.raises(fb.SimulationError, match="Lock of 'A' of Event 'hold' and Release of 'A' of Event 'free'"):
        m.simulate(1, coordinates=layer)


def test_what_would_be_elsewhere_in_no_time(layer):
    m = fb.Mechanism("p", planar=True, gravity=(0, -10), parameters={"l": 1.0, "r": 0.1})
    m.add(fb.Body("bob", mass=1, inertia="r", position=("l", 0)), fb.Revolute("A", "ground", "bob", at=(0, 0)))
    m.add(fb.Event("long", "t - 0.5", do=fb.Set("l", 2)))
    with pytest.raises(fb.SimulationError, match=r"Set of 'l' in Event 'long' would put .* instantaneously"):
        m.simulate(1, coordinates=layer)
    m.events.clear()
    m.add(fb.Event("none", "t - 0.5", do=fb.Set("r", -1)))
    with pytest.raises(fb.SimulationError, match=r"Set of 'r' in Event 'none': Body 'bob'"):
        m.simulate(1, coordinates=layer)


def test_a_value_that_is_none(layer):
    m = slide()
    m.add(fb.Event("e", "t - 0.5", do=fb.Set("k", "sqrt(-t)")))
    with pytest.raises(fb.SimulationError, match=r"value of Set of 'k' in Event 'e' is nan: 'sqrt\(-t\)' has no value"):
        m.simulate(1, coordinates=layer)


def test_a_motion_that_goes_on_keeps_what_was_locked_and_set(layer):
    """Blows at the start come once; a lock, a joint that let go and a parameter last."""
    m = slide()
    m.add(fb.CoordinateSpring("s", "A.displacement", stiffness="k"))
    m.add(fb.Event("kick", "start", do=fb.Impulse("A", 6)), fb.Event("set", "t - 0.1", do=fb.Set("k", 18)))
    m.add(fb.Event("hold", "t - 0.2", do=fb.Lock("A")), fb.Event("free", "t - 1", do=fb.Release("A")))
    whole = m.simulate(2, outputs=21, coordinates=layer)
    first = m.simulate(0.5, outputs=6, coordinates=layer)
    again = m.simulate(2, outputs=16, coordinates=layer, start=first)
    assert again["A.displacement"] == pytest.approx(whole["A.displacement"][5:], abs=1e-7)
    assert [h.name for h in again.events] == ["free"]
    late = m.simulate(2, outputs=11, coordinates=layer, start=m.simulate(1.0, outputs=2, coordinates=layer))
    assert late["A.displacement"] == pytest.approx(whole["A.displacement"][10:], abs=1e-6)


def test_before_and_after_are_by_the_parameters_of_their_time(layer, tmp_path):
    """Stretched by 1 m a spring of 8 N/m stores 4 J, of 16 N/m 8 J; in files too."""
    m = slide()
    m.add(fb.CoordinateSpring("s", "A.displacement", stiffness="k"), fb.Initial("A.displacement", value=1.0))
    m.add(fb.Event("note", "t - 0.5"), fb.Event("softer", "t - 1", do=fb.Set("k", 2)), fb.Event("late", "t - 1.5"))
    m.add(fb.Event("harder", "start", do=fb.Set("k", 16)))
    r = m.simulate(2, outputs=21, coordinates=layer)
    r.save(tmp_path / "r.nc")
    for run in (r, fb.load_result(tmp_path / "r.nc")):
        first, note, softer, late = run.events
        assert first.before["s.energy"] == pytest.approx(4.0, abs=1e-9)
        assert first.after["s.energy"] == pytest.approx(8.0, abs=1e-9)
        assert note.before["energy.total"] == pytest.approx(8.0, abs=1e-5)
        x = softer.before["b.x"]
        assert x == pytest.approx(math.cos(math.sqrt(8)), abs=1e-6)
        assert (softer.before["s.energy"], softer.after["s.energy"]) == pytest.approx((8 * x**2, x**2), abs=1e-9)
        assert late.after["energy.total"] == pytest.approx(8.0 - 7 * x**2, abs=1e-5)
        assert run["energy.event_work"][-1] == pytest.approx(-7 * x**2, abs=1e-6)


@pytest.mark.parametrize("stiffness", [None, 1000.0])
def test_a_rope_is_cut(layer, stiffness):
    """It carries 10 N until then; what it stores is gone with it."""
    m = fb.Mechanism("cut", planar=True, gravity=(0, -10))
    elastic = {} if stiffness is None else {"stiffness": stiffness, "length": 0.99}
    m.add(fb.Body("b", mass=1, inertia=0, position=(0, -1)))
    m.add(fb.Rope("line", ("ground", "b"), at=((0, 0), (0, -1)), **elastic))
    m.add(fb.Event("cut", "t - 1", do=fb.Release("line")))
    r = m.simulate(2, outputs=21, coordinates=layer)
    assert r["b.y"] == pytest.approx(np.where(r.t < 1, -1.0, -1 - 5 * (r.t - 1) ** 2), abs=1e-8)
    assert r["line.tension"] == pytest.approx(np.where(r.t < 0.999999, 10.0, 0.0), abs=1e-6)
    assert r.events["cut"][0].done == ("released line",)
    assert r["energy.event_work"][-1] == pytest.approx(0.0 if stiffness is None else -0.05, abs=1e-9)
    assert r.energy.drift < 1e-8


def test_a_limit_opens_and_holds_again(layer):
    """A floor that is taken away and put back: the body falls past it, to where it was, and is stopped from above."""
    m = fb.Mechanism("floor", planar=True, gravity=(0, -10))
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("A", "ground", "b", at=(0, 0), axis=(0, 1)))
    m.add(fb.Limit("floor", "A.displacement", lower=-0.2), fb.Event("open", "t - 1", do=fb.Release("floor")))
    r = m.simulate(1.5, outputs=16, coordinates=layer)
    y = np.where(r.t < 0.2, -5 * r.t**2, np.where(r.t < 1, -0.2, -0.2 - 5 * (r.t - 1) ** 2))
    assert r["b.y"] == pytest.approx(y, abs=1e-8)


def test_a_driver_whose_speed_jumps(layer):
    m = fb.Mechanism("d", planar=True, parameters={"w": 2.0})
    m.add(fb.Body("b", mass=1, inertia=1, position=(1, 0)), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.Driver("motor", "A.angle", "w*(t - 1)"), fb.Initial("A.angle", value=-2.0))
    m.add(fb.Event("fast", "t > 1", do=fb.Set("w", 3)))
    with pytest.raises(fb.SimulationError, match=r"Set of 'w' in Event 'fast' would change the velocity of .* by 1 in"):
        m.simulate(2, coordinates=layer)


def test_steps_by_impulses_know_none():
    m = slide()
    m.add(fb.Event("e", "t - 0.5"))
    with pytest.raises(fb.ModelError, match="impulse time stepping does not support Event 'e'; the adaptive"):
        m.simulate(1, method="impulse")


def test_an_event_at_the_time_at_which_a_law_jumps(layer):
    """Held from the instant on at which a force begins, which the lock carries; let go as it ends."""
    m = slide()
    m.add(
        fb.Initial("A.displacement", rate=3.0),
        fb.PointForce("f", "b", force=("where(t < 1, where(t > 0.5, 5, 0), 0)", 0)),
    )
    m.add(fb.Event("hold", "t - 0.5", do=fb.Lock("A")), fb.Event("free", "t - 1", do=fb.Release("A")))
    r = m.simulate(2, outputs=201, coordinates=layer)
    assert r["b.x"] == pytest.approx(np.where(r.t < 0.5, 3 * r.t, 1.5), abs=1e-9)
    assert [h.name for h in r.events] == ["hold", "free"]
    assert r.events.t == pytest.approx([0.5, 1.0], abs=1e-12)


def test_without_parameters_results_are_saved_too(layer, tmp_path):
    m = fb.Mechanism("swing", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("rod", mass=1, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Event("hold", "A.angle < -90 deg", do=fb.Lock("A")), fb.Event("end", "t - 1", do=fb.Stop()))
    r = m.simulate(3, outputs=31, coordinates=layer)
    r.save(tmp_path / "r.nc")
    again = fb.load_result(tmp_path / "r.nc")
    for a, b in zip(again.events, r.events, strict=True):
        assert (a.t, a.name, a.kind, a.done, a.lost) == (b.t, b.name, b.kind, b.done, b.lost)
    assert again.events["hold"][0].lost == pytest.approx(9.81 * 0.5, abs=1e-6)
    assert again["A.torque"] == pytest.approx(r["A.torque"], abs=1e-9)


def test_events_that_come_ever_closer_are_named(monkeypatch):
    from flyball.simulation.events import event_loop

    monkeypatch.setattr(event_loop, "ENDLESS", 30)
    monkeypatch.setattr(event_loop, "AT_ONCE", 1e-3)
    m = slide()
    m.add(fb.Event("ever faster", "sin(1/(0.3 - t))"))
    with pytest.raises(fb.SimulationError, match=r"without end \(30 within .* s\): Event 'ever faster'"):
        m.simulate(0.3)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_what_holds_a_locked_coordinate_of_a_body_is_a_curve(coordinates):
    """A falling body is held at one height against its weight until it is let go, and against a torque."""
    m = fb.Mechanism("held", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("b", mass=2.0, inertia=1.0, velocity=(1, 0)), fb.PointTorque("turn", "b", torque=0.7))
    m.add(fb.Event("hold", "t - 0.5", do=[fb.Lock("b.y"), fb.Lock("b.angle")]))
    m.add(fb.Event("free", "t - 0.8", do=[fb.Release("b.y")]))
    r = m.simulate(1.0, outputs=101, coordinates=coordinates)
    held, free = (r.t > 0.505) & (r.t < 0.795), (r.t < 0.495) | (r.t > 0.805)
    assert r["b.y_effort"][held] == pytest.approx(2.0 * 9.81)
    assert r["b.y_effort"][free] == pytest.approx(0.0, abs=1e-12)
    assert r["b.angle_effort"][r.t > 0.505] == pytest.approx(-0.7)
    assert r["b.angle_effort"][r.t < 0.495] == pytest.approx(0.0, abs=1e-12)
    assert r["b"].names["y_effort"].unit == "N" and r["b"].names["angle_effort"].unit == "N*m"
    assert "x_effort" not in r["b"].names
