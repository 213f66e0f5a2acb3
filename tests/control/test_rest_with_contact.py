"""Controllers beside contacts, stops and brakes at rest: equilibrium, linear equations, modes."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

G, MASS, ARM, KP, STOP, TARGET = 9.81, 2.0, 0.5, 50.0, 0.5, 1.0


def arm(stop: float | None = STOP, target: float = TARGET, angle: float = 0.0) -> fb.Mechanism:
    """A rod whose motor turns it against a stop; drawn level, which counts as ``angle``."""
    m = fb.Mechanism("arm", planar=True, gravity=(0, -G))
    m.add(
        fb.Body("rod", mass=MASS, inertia=0.1, position=(ARM, 0)),
        fb.Revolute("A", "ground", "rod", at=(0, 0), angle=angle),
    )
    m.add(fb.PID("pd", setpoint=f"{target}", measured="A.angle", kp=KP, kd=8, filter=0.01))
    m.add(fb.Motor("motor", "A", torque="pd"))
    if stop is not None:
        m.add(fb.Limit("stop", "A.angle", upper=stop))
    return m


def leg(m: fb.Mechanism, foot: str, mass: float = 1.0, lean: float = 0.05) -> fb.Mechanism:
    """A controlled leg on a foot, or on ground."""
    m.add(fb.Body("leg", mass=mass, inertia=0.03, position=(0, 0.6)), fb.Revolute("ankle", foot, "leg", at=(0, 0.1)))
    m.add(fb.PID("pid", setpoint=f"{lean}", measured="ankle.angle", kp=30, ki=20, kd=3, filter=0.01))
    m.add(fb.Motor("motor", "ankle", torque="pid"))
    return m


def standing(**of_leg: float) -> fb.Mechanism:
    """The leg with a foot that stands on the floor by friction."""
    m = fb.Mechanism("standing", planar=True, gravity=(0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))), fb.Contact(friction=0.8))
    m.add(fb.Body("foot", mass=2, inertia=0.05, position=(0, 0.05), shape=fb.Box(edges=(0.6, 0.1, 0.1))))
    return leg(m, "foot", **of_leg)


def test_a_motor_presses_an_arm_against_its_stop():
    m = arm()
    rest = m.equilibrium(start=m.simulate(6.0))
    assert rest["A.angle"] == pytest.approx(STOP, abs=1e-12)
    (stop,) = rest.touching
    assert stop.normal == pytest.approx(KP * (TARGET - STOP) - MASS * G * ARM * np.cos(STOP), rel=1e-9)
    assert rest.stability == "stable"
    assert len(m.linearize(about=rest).eigenvalues) == 1  # of the filter: nothing else can move
    assert set(m.modes(about=rest).kinds) == {"decay"}


def test_a_stop_that_is_not_reached_is_open():
    rest = arm(stop=3.0).equilibrium()
    assert KP * (TARGET - rest["A.angle"]) == pytest.approx(MASS * G * ARM * np.cos(rest["A.angle"]), rel=1e-9)
    assert not rest.touching


@pytest.mark.parametrize("draw", [0.0, STOP])
def test_stops_that_close_or_pull_are_named(draw):
    """Drawn away from the stop, or on it although the motor pulls away."""
    m = arm() if draw == 0.0 else arm(target=-0.5, angle=STOP)
    with pytest.raises(fb.NotConverged, match="stop"):
        m.equilibrium()


def test_a_leg_stands_as_if_its_foot_were_ground():
    m = standing()
    rest = m.equilibrium()
    fixed = leg(fb.Mechanism("fixed", planar=True, gravity=(0, -G)), "ground")
    other = fixed.equilibrium()
    assert rest["ankle.angle"] == pytest.approx(0.05, abs=1e-9)
    assert rest["pid.integral"] == pytest.approx(other["pid.integral"], rel=1e-9)
    assert sum(k.normal for k in rest.touching) == pytest.approx(3.0 * G, rel=1e-9)
    here, there = (
        x.linearize(about=e, inputs=["motor"], outputs=["ankle.angle"]) for x, e in ((m, rest), (fixed, other))
    )
    np.testing.assert_allclose(np.sort_complex(here.eigenvalues), np.sort_complex(there.eigenvalues), rtol=1e-7)
    np.testing.assert_allclose(response(here, 3.0j), response(there, 3.0j), rtol=1e-7)


def test_the_end_of_a_motion_with_contact_is_a_start():
    m = standing(lean=0.2)
    run = m.simulate(12.0)
    rest = m.equilibrium(start=run)
    assert rest["ankle.angle"] == pytest.approx(0.2, abs=1e-9)
    on = m.simulate(0.5, start=rest)
    assert np.ptp(on["ankle.angle"]) < 1e-8


def response(model: fb.LinearModel, s: complex) -> np.ndarray:
    """C (s I - A)^-1 B + D."""
    return model.C @ np.linalg.solve(s * np.eye(len(model.A)) - model.A, model.B) + model.D


def test_a_leg_that_leans_over_its_foot_does_not_stand():
    with pytest.raises(fb.NotConverged, match="does not rest with"):
        standing(lean=1.5, mass=20.0).equilibrium()


def test_a_brake_holds_what_the_motor_would_turn():
    m = arm(stop=None)
    m.add(fb.Brake("brake", "A.angle", capacity=60.0))
    rest = m.equilibrium()
    assert rest["A.angle"] == pytest.approx(0.0, abs=1e-12)
    (brake,) = rest.touching
    assert brake.tangential == pytest.approx(KP * TARGET - MASS * G * ARM, rel=1e-9)
    weak = m.changed({"brake": fb.Brake("brake", "A.angle", capacity=30.0)})
    with pytest.raises(fb.NotConverged, match="brake"):
        weak.equilibrium()


def test_equations_along_a_motion_with_a_closed_brake():
    """The second link swings on a first one that its brake holds: its linear equations are those of the link alone."""
    m = arm(stop=None)
    m.add(fb.Brake("brake", "A.angle", capacity=200.0))
    m.add(fb.Body("link", mass=1, inertia=0.02, position=(1.25, 0)), fb.Revolute("B", "rod", "link", at=(1, 0)))
    at_end = m.linearize(about=m.simulate(0.2), frozen=True)
    alone = fb.Mechanism("link", planar=True, gravity=(0, -G))
    alone.add(fb.Body("link", mass=1, inertia=0.02, position=(1.25, 0)), fb.Revolute("B", "ground", "link", at=(1, 0)))
    own = alone.linearize(about=alone.simulate(0.2), frozen=True).eigenvalues
    found = at_end.eigenvalues
    for value in own:
        assert np.abs(found - value).min() < 1e-5
    assert len(found) == 3  # and the controller's filter


def test_a_rest_found_from_the_end_of_a_motion_is_exact():
    """A link falls through the play of its coupling to a sprung one: -c b = m g l cos a, and b - a = gap / 2."""
    m = fb.Mechanism("play", planar=True, gravity=(0, -G))
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Body("b", mass=1, inertia=0.1, position=(2, 0)), fb.Revolute("B", "ground", "b", at=(2, 0)))
    m.add(fb.TorsionalSpringDamper("s", joint="B", stiffness=50, damping=5.0))
    m.add(fb.Backlash("g", ("A.angle", "B.angle"), gap=0.1))
    with pytest.raises(fb.NotConverged, match="g would open or close"):
        m.equilibrium()
    rest = m.equilibrium(start=m.simulate(10.0))
    assert 50 * rest["B.angle"] == pytest.approx(-G * 0.5 * np.cos(rest["A.angle"]), rel=1e-9)
    (g,) = rest.touching
    assert abs(rest["A.angle"] - rest["B.angle"]) == pytest.approx(0.05, abs=1e-12)
    assert abs(g.normal) == pytest.approx(G * 0.5 * np.cos(rest["A.angle"]), rel=1e-9)
    assert rest.stability == "stable"


def test_events_that_change_nothing_at_rest_are_left_out():
    m = standing()
    m.add(fb.Event("lost", "leg.y < 0.2", do=[fb.Set("pid.integral", 0.0), fb.Stop()]))
    rest = m.equilibrium()
    assert rest["ankle.angle"] == pytest.approx(0.05, abs=1e-9)
    assert "Event 'lost': left out" in rest.notes
    assert "Event 'lost': left out" in m.linearize(about=rest).notes
    m.add(fb.Event("locks", "leg.y < 0.3", do=[fb.Lock("ankle")]))
    with pytest.raises(fb.ModelError, match="Event 'locks'"):
        m.equilibrium()
