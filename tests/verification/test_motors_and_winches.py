"""Motors of given speed, drivers of rates, and winches against closed forms."""

import numpy as np
import pytest

import flyball as fb
from flyball.errors import ModelError
from flyball.model.model_files import dumps, loads
from tests.layers import both_layers

G = 9.81


def arm(*more, gravity=0.0):
    """A bar on a hinge, 0.6 kg m^2 about it, level as drawn."""
    m = fb.Mechanism("arm", planar=True, gravity=(0, -gravity), parameters={"w": 3.0, "on": 1.0})
    m.add(fb.Body("arm", mass=2, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "arm", at=(0, 0)))
    m.add(*more)
    return m


@both_layers
def test_driver_of_a_rate():
    m = arm(fb.Driver("D", "A.angle_rate", "w + sin(t)"), gravity=G)
    r = m.simulate(2.0)
    assert r["A.angle_rate"] == pytest.approx(3.0 + np.sin(r.t), abs=1e-10)
    assert r["A.angle"] == pytest.approx(3.0 * r.t + 1.0 - np.cos(r.t), abs=1e-7)
    torque = 0.6 * np.cos(r.t) + 2 * G * 0.5 * np.cos(r["A.angle"])
    assert r["D.effort"] == pytest.approx(torque, abs=1e-6)
    assert r["D.work"][-1] == pytest.approx(r["energy.total"][-1] - r["energy.total"][0], abs=1e-5)
    k = m.kinematics(np.linspace(0, 2, 5))
    assert k["A.angle"] == pytest.approx(3.0 * k.t + 1.0 - np.cos(k.t), abs=1e-8)


def test_rate_that_follows_a_position():
    """theta' = w (1 - theta): theta = 1 - exp(-w t), and the torque J theta''."""
    m = arm(fb.Sensor("angle", "A.angle"), fb.Driver("D", "A.angle_rate", "w*(1 - angle)"))
    r = m.simulate(1.0)
    assert r["A.angle"] == pytest.approx(1.0 - np.exp(-3.0 * r.t), abs=1e-7)
    assert r["D.effort"] == pytest.approx(-0.6 * 9.0 * np.exp(-3.0 * r.t), abs=1e-6)


def test_run_up_at_the_limit_then_exactly_at_speed():
    """3 N m on 0.6 kg m^2: 5 rad/s^2 until 2 pi rad/s, then no torque."""
    m = arm(fb.Motor("M", "A", speed="60 rpm", limit="3 N*m"))
    r = m.simulate(2.0)
    reached = 2.0 * np.pi / 5.0
    assert [(e.kind, e.name) for e in r.events] == [("stick", "M_coupling")]
    assert r.events[0].t == pytest.approx(reached, abs=1e-7)
    before = r.t < reached
    assert r["M.torque"][before] == pytest.approx(3.0, abs=1e-9)
    assert r["M.torque"][~before] == pytest.approx(0.0, abs=1e-9)
    assert r["M.rate"][~before] == pytest.approx(2.0 * np.pi, rel=1e-12)
    assert r["M.work"][-1] == pytest.approx(0.3 * (2.0 * np.pi) ** 2, rel=1e-6)
    assert r["M.power"] == pytest.approx(r["M.torque"] * r["M.rate"], abs=1e-9)


def test_falls_behind_where_the_load_exceeds_the_limit():
    r = arm(fb.Motor("M", "A", speed="0.2", limit="9 N*m"), gravity=G).simulate(0.5)
    assert r["M.torque"] == pytest.approx(9.0, abs=1e-9)
    assert r["A.angle_acceleration"][0] == pytest.approx((9.0 - G) / 0.6, rel=1e-9)


def test_without_a_limit_it_is_a_driver_and_events_read_its_torque():
    m = arm(fb.Motor("M", "A", speed="w"), gravity=G)
    r = m.simulate(0.5)
    assert r["M.torque"] == pytest.approx(2 * G * 0.5 * np.cos(3.0 * r.t), abs=1e-6)
    m.add(fb.Event("over", "M.torque < 8", do=[fb.Stop()]))
    assert m.simulate(0.5).t[-1] == pytest.approx(np.arccos(8.0 / G) / 3.0, abs=1e-7)


def test_switched_off_by_an_event():
    m = arm(fb.Motor("M", "A", speed="w", limit="on*30"), fb.Event("off", "t > 0.5", do=[fb.Set("on", 0)]), gravity=G)
    r = m.simulate(0.6)
    late = r.t > 0.5 + 1e-9
    assert r["M.torque"][late] == pytest.approx(0.0, abs=1e-12)
    assert r["A.angle_acceleration"][late] == pytest.approx(-G / 0.6 * np.cos(r["A.angle"][late]), rel=1e-9)


def test_motor_in_other_analyses():
    still = arm(fb.Motor("M", "A", speed="0", limit=20), gravity=G)
    assert "M_coupling" in str(still.equilibrium())
    with pytest.raises(ModelError, match="prescribes a rate of 3 at t = 0 s"):
        arm(fb.Motor("M", "A", speed="w")).equilibrium()
    with pytest.raises(ModelError, match="prescribes a rate of 3 at t = 0 s"):
        arm(fb.Motor("M", "A", speed="w", limit=2)).equilibrium()
    assert "sign(" in str(arm(fb.Motor("M", "A", speed="w", limit=20)).symbolic())
    text = str(arm(fb.Driver("D", "A.angle_rate", "w + sin(t)")).symbolic())
    assert "nu[1] = w + sin(t)" in text
    assert "gamma[1] = cos(t)" in text


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({}, "neither torque nor speed"),
        ({"torque": 1, "speed": 1}, "both given"),
        ({"torque": 1, "limit": 1}, "limit is for a given speed"),
        ({"speed": "3 rad"}, "speed of Motor 'M': .*expected an angular speed"),
        ({"speed": "pid.output"}, "speed of Motor 'M'"),
        ({"speed": 3, "limit": -2}, "zero or greater"),
        ({"speed": 3, "limit": "2 N"}, "N"),
    ],
)
def test_refused_motors(fields, why):
    with pytest.raises(ModelError, match=why):
        arm(fb.Motor("M", "A", **fields))


@pytest.mark.parametrize("planar", [True, False])
def test_actuator_of_given_speed_switched_by_events(planar):
    """20 N on 4 kg until 0.5 m/s; switched off it slows down by 2 N; switched on again it makes up for that."""

    def p(x, y):
        return (x, y) if planar else (x, y, 0.0)

    m = fb.Mechanism("carriage", planar=planar, gravity=p(0, 0), parameters={"on": 1.0})
    m.add(fb.Body("carriage", mass=4, inertia=0.1 if planar else (0.1,) * 3))
    m.add(fb.Prismatic("guide", "ground", "carriage", at=p(0, 0), axis=p(1, 0)))
    m.add(fb.Actuator("drive", "guide.displacement", speed="0.5 m/s", limit="on*20"))
    m.add(fb.Brake("rubbing", "guide.displacement", capacity="2 N"))
    m.add(fb.Event("off", "t > 1", do=[fb.Set("on", 0)]), fb.Event("on", "t > 1.5", do=[fb.Set("on", 1)]))
    r = m.simulate(3, outputs=301)
    reached, slow = 0.5 / (18 / 4), 0.5 - 2 / 4 * 0.5
    regained = 1.5 + (0.5 - slow) / (18 / 4)
    speed = np.select(
        [r.t < reached, r.t < 1, r.t < 1.5, r.t < regained],
        [4.5 * r.t, 0.5, 0.5 - 0.5 * (r.t - 1), slow + 4.5 * (r.t - 1.5)],
        0.5,
    )
    assert r["drive.rate"] == pytest.approx(speed, abs=1e-9)
    steady = (r.t > regained + 1e-6) | ((r.t > reached + 1e-6) & (r.t < 1))
    assert r["drive.force"][steady] == pytest.approx(2.0, abs=1e-7)
    assert r["drive.force"][(r.t > 1) & (r.t < 1.5)] == pytest.approx(0.0, abs=1e-12)
    assert np.abs(r["energy.balance"]).max() < 1e-8


def test_refused_actuators():
    for fields, why in (
        ({}, "neither force nor speed"),
        ({"force": 1, "speed": 1}, "both given"),
        ({"speed": "3 rad/s"}, "speed of Actuator 'D'"),
        ({"speed": 1, "limit": "2 N*m"}, "N"),
    ):
        m = fb.Mechanism("m", planar=True)
        m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("g", "ground", "b", at=(0, 0), axis=(1, 0)))
        with pytest.raises(ModelError, match=why):
            m.add(fb.Actuator("D", "g.displacement", **fields))
    with pytest.raises(ModelError, match="speed is that of one coordinate"):
        arm(fb.Actuator("D", ["A.angle"], weights=[2], speed=1))


def test_cylinder_of_given_speed():
    """A cylinder that extends at 0.1 m/s whatever it lifts, and up to a force."""
    m = fb.Mechanism("hoist", planar=True, gravity=(0, -G))
    m.add(fb.Body("load", mass=10, inertia=0.1, position=(0, 1)))
    m.add(fb.Prismatic("guide", "ground", "load", at=(0, 0), axis=(0, 1)))
    m.add(fb.LinearActuator("C", "ground", "load", at=((0, 0), (0, 1)), speed="0.1 m/s", limit="200 N"))
    r = m.simulate(1)
    assert r["C.length_rate"][-1] == pytest.approx(0.1, abs=1e-9)
    assert r["C_drive.force"][-1] == pytest.approx(10 * G, rel=1e-7)


LOAD, DRUM, RADIUS = 10.0, 0.2, 0.1


def winch(*more, planar=True, **rope):
    """A load of 10 kg on a rope over a pulley, to a drum of 0.2 kg m^2."""

    def p(x, y):
        return (x, y) if planar else (x, y, 0.0)

    m = fb.Mechanism("winch", planar=planar, gravity=p(0, -G), parameters={"v": 0.2})
    inertia, axis = (0.1, {}) if planar else ((0.1,) * 3, {"axis": (0, 0, 1)})
    m.add(fb.Body("load", mass=LOAD, inertia=inertia, position=p(1, -2)))
    m.add(fb.Prismatic("hoist", "ground", "load", at=p(1, -2), axis=p(0, 1)))
    m.add(fb.Body("drum", mass=5, inertia=DRUM if planar else (DRUM,) * 3))
    m.add(fb.Revolute("J", "ground", "drum", at=p(0, 0), **axis))
    own = {"drum": "J.angle", "radius": RADIUS} if "feed" not in rope else {}
    m.add(fb.Rope("rope", ("ground", "ground", "load"), at=(p(0, 0.1), p(1, 0.1), p(1, -2)), **own | rope), *more)
    return m


@pytest.mark.parametrize("planar", [True, False])
def test_winch_with_a_torque(planar):
    torque = 12.0
    a = (torque / RADIUS - LOAD * G) / (LOAD + DRUM / RADIUS**2)
    r = winch(fb.Motor("M", "J", torque=torque), planar=planar).simulate(0.5)
    assert r["hoist.displacement"] == pytest.approx(0.5 * a * r.t**2, abs=1e-9)
    assert r["rope.tension"] == pytest.approx(LOAD * (G + a), rel=1e-9)
    assert r["rope.load_2"] == pytest.approx(np.sqrt(2.0) * r["rope.tension"], rel=1e-9), "the pulley's bearing"
    assert r["rope.length"] == pytest.approx(3.1 - r["hoist.displacement"], abs=1e-9)
    assert (r["rope.taut"] == 1.0).all()


@pytest.mark.parametrize("law", ["-v*t", "-v*t**2", "v*t**2"])
def test_rope_paid_out_by_a_law(law):
    r = winch(feed=law).changed({"J": None, "drum": None}).simulate(1.0)
    fed = {"-v*t": -0.2 * r.t, "-v*t**2": -0.2 * r.t**2, "v*t**2": 0.2 * r.t**2}[law]
    assert r["hoist.displacement"] == pytest.approx(-fed, abs=1e-9)
    assert r["rope.tension"] == pytest.approx(LOAD * (G + {"-v*t": 0.0, "-v*t**2": 0.4, "v*t**2": -0.4}[law]), rel=1e-9)
    assert r["rope_drive.effort"] == pytest.approx(-r["rope.tension"], rel=1e-6)


def test_elastic_winch_and_slack():
    """A drum that turns at once beyond the load's fall pays out: the rope is slack; an elastic one swings about m g / k."""
    k = 5e3
    m = winch(fb.Driver("D", "J.angle", "0"), stiffness=k)
    r = m.simulate(1.0)
    omega = np.sqrt(k / LOAD)
    assert r["hoist.displacement"] == pytest.approx(-LOAD * G / k * (1.0 - np.cos(omega * r.t)), abs=1e-6)
    loose = winch(fb.Driver("D", "J.angle", "-60*t**2")).simulate(0.5)
    assert loose["rope.tension"].max() == 0.0
    assert loose["hoist.displacement"] == pytest.approx(-0.5 * G * loose.t**2, abs=1e-9)
    assert winch(fb.Event("cut", "t > 0.1", do=[fb.Release("rope")])).simulate(0.3)["rope.tension"][-1] == 0.0


def test_winch_at_rest_and_its_frequency():
    """The rope couples load and a spring on the drum: (m r^2 + J) theta'' + c theta = 0 about the rest."""
    m = winch(fb.CoordinateSpring("spring", "J.angle", stiffness=100, rest=LOAD * G * RADIUS / 100.0))
    e = m.equilibrium()
    assert e["J.angle"] == pytest.approx(0.0, abs=1e-9)
    omega = np.sqrt(100.0 / (LOAD * RADIUS**2 + DRUM))
    assert m.modes(about=e).omega[0] == pytest.approx(omega, rel=1e-6)


def test_files_have_the_one_rope_and_motor():
    m = winch(fb.Motor("M", "J", speed="v", limit="20 N*m"), length="3 m", radius="10 cm")
    text = dumps(m)
    assert "M_shaft" not in text
    assert "rope_limit" not in text
    assert loads(text, fb.Mechanism, "winch.toml") == m


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"radius": 0}, "a drum has an angle and a radius"),
        ({"radius": None}, "a drum has an angle and a radius"),
        ({"drum": "Q.angle"}, "Q"),
        ({"drum": "hoist.displacement"}, "which is no angle"),
        ({"feed": "x*t"}, "feed of Rope 'rope': unknown name 'x'"),
    ],
)
def test_refused_ropes(fields, why):
    with pytest.raises(ModelError, match=why):
        winch(**fields)


def test_a_winch_between_frames_needs_its_length():
    m = winch()
    m.add(fb.Frame("hook", "load"), fb.Frame("top", "ground", position=(0, 0.1)))
    with pytest.raises(ModelError, match="give its free length"):
        m.add(fb.Rope("other", ("top", "hook"), feed="-v*t"))
    m.add(fb.Rope("other", ("top", "hook"), feed="-v*t", length=4))


def slide(*more):
    """A body of 2 kg on a vertical guide."""
    m = fb.Mechanism("slide", planar=True, gravity=(0, -G))
    m.add(fb.Body("b", mass=2, inertia=0.1), fb.Prismatic("g", "ground", "b", at=(0, 0), axis=(0, 1)), *more)
    return m


def test_drives_of_given_speed_tell_at_rest_what_they_hold():
    m = slide(fb.Actuator("d", "g.displacement", speed=0, limit=30))
    assert m.equilibrium()["d.force"] == pytest.approx(2 * G, rel=1e-9)
    m = arm(fb.Motor("M", "A", speed=0, limit=30), gravity=G)
    assert m.equilibrium()["M.torque"] == pytest.approx(2 * G * 0.5, rel=1e-9)


def test_limits_of_drives_are_named_as_such():
    with pytest.raises(ModelError, match="limit of Actuator 'd' is -3 N; it must be zero or greater"):
        slide(fb.Actuator("d", "g.displacement", speed=0, limit=-3))
    m = slide(fb.Actuator("d", "g.displacement", speed=0, limit="30*(1 - t)"))
    with pytest.raises(fb.SimulationError, match=r"the force of Actuator 'd' is no number\. Its limit is"):
        m.simulate(2)
