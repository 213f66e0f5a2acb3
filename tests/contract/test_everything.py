"""One mechanism with every force and coupling that there is: compiled code, files, and results read back."""

from functools import lru_cache

import numpy as np
import pytest

import flyball as fb
from flyball import forces, joints
from flyball.engine.entry_point import MOTION
from flyball.engine.motion import derivative
from flyball.model.controller import IMU, Sensor
from flyball.model.joint import Coupling
from flyball.model.model_files import dumps, loads
from tests.layers import both_layers, started

pytestmark = both_layers
SOFT = {
    "youngs_modulus": 1e4,
    "inclination": 0.05,
    "wheel_load": 0.5,
    "dissipation": 0.1,
    "friction": 0.1,
    "rail_arcs": [(5.0, 2.0)],
}


@lru_cache(maxsize=1)
def everything():
    """Five bodies in a row of joints, tied by every kind of force and coupling."""
    m = fb.Mechanism("everything", gravity=(0.3, -0.5, -9.7), parameters={"c": 2.0})
    for k, name in enumerate("abcde"):
        m.add(
            fb.Body(
                name,
                mass=1.0 + 0.2 * k,
                inertia=(0.05 + 0.01 * k, 0.07, 0.06),
                position=(0.5 * k, 0.1 * k, -0.2 * k),
                com=(0.02, 0.01 * k, -0.03),
                orientation=(0.2 * k, -0.1, 0.3),
                angular_velocity=(0.3, 1.0 - k, 0.5 * k),
            )
        )
    m.add(
        fb.Revolute("A", "ground", "a", at=(-0.2, 0, 0), axis=(1, 2, 0)), fb.Frame("tip", "c", position=(0.1, 0.2, 0.3))
    )
    m.add(
        fb.Cylindrical("B", "a", "b", at=(0.3, 0.1, 0), axis=(0, 1, 1)),
        fb.Revolute("C", "a", "c", at=(0.2, 0.3, 0), axis=(0, 1, 2)),
    )
    m.add(
        fb.Prismatic("D", "b", "d", at=(0.9, 0.2, 0), axis=(1, 0, 1)),
        fb.Revolute("E", "d", "e", at=(1.8, 0.3, 0), axis=(1, 1, 1)),
    )
    m.add(fb.Sensor("turned", "A.angle"), fb.Sensor("speed", "tip.vx"), fb.IMU("imu", "tip"))
    m.add(fb.GearPair("gears", joint_1="B", joint_2="C", teeth=(20, 30)))
    m.add(fb.RackAndPinion("rack", rack="D", pinion="E", radius=0.1))
    m.add(fb.Coupler("sum", coordinates=("A.angle", "B.displacement", "tip.z"), weights=(0.5, 1.0, 0.7)))
    m.add(fb.Constraint("bent", "A.angle*C.angle - 0.3*e.yaw**2 - 0.1*tip.z - 0.02*sin(t)"))
    m.add(fb.Actuator("actuator", coordinate="D.displacement", force="3*sin(t) - c*rate + 0.1*speed"))
    m.add(fb.Detent("notches", "C.angle", pitch="40 deg", holding="0.4 N*m", notch=0.1, damping=0.02))
    m.add(fb.Limit("soft", "E.angle", lower=0.05, upper=0.1, stiffness=30.0, damping=0.3))
    m.add(fb.Backlash("loose", ("A.angle", "C.angle"), weights=(2, 3), gap="1 deg", stiffness=20.0, damping=0.1))
    m.add(
        fb.Bushing(
            "bushing", "c", "e", at=(1.5, 0, 0.1), stiffness=(40, 60, 50), damping=1.0, torsional_stiffness=(2, 3, 4)
        )
    )
    m.add(fb.CoordinateSpring("height", coordinate="tip.z", stiffness=30.0, damping=0.5, rest=0.2))
    m.add(fb.JointFriction("friction", joint="E", static=0.2, kinetic=0.1, radius=0.05, bending_length=0.3))
    m.add(fb.JointFriction("collar", joint="B", coordinate="angle", static=0.2, radius=0.05, twist_length=0.3))
    m.add(fb.Clutch("clutch", "A.angle", "E.angle", capacity="0.02 + 0.01*t"))
    m.add(fb.Brake("brake", "C.angle", capacity=0.03, static=1.2))
    m.add(fb.Motor("motor", joint="A", torque="0.5 - 0.1*rate + 0.2*turned"))
    m.add(fb.PointForce("wind", "e", force=("1 + speed", "2*t", 0.5), at=(2, 0.5, -0.7), axes="body"))
    m.add(fb.PointTorque("twist", "d", torque=(0.1, "0.2*cos(t)", 0.3)))
    m.add(
        fb.Rope(
            "rope",
            bodies=("ground", "c", "ground", "e"),
            at=((0, 1, 0), (1, 0.3, -0.4), (1.5, 1, 0), (2, 0.4, -0.8)),
            stiffness=80.0,
            damping=0.4,
            length=2.5,
        )
    )
    m.add(
        fb.PathSpring(
            "tendon",
            bodies=("a", "c", "e"),
            at=((0.1, 0.5, 0), (1, 0.3, -0.4), (2, 0.4, -0.8)),
            stiffness=20.0,
            damping=0.3,
            force="2 + 0.1*rate",
        )
    )
    m.add(fb.CoordinateSpring("pair", ("A.angle", "D.displacement"), weights=(1, "0.3 rad/m"), stiffness=2.0))
    m.add(
        fb.SpringDamper(
            "spring",
            "b",
            "e",
            at=((0.5, 0.1, -0.2), (2, 0.4, -0.8)),
            stiffness=20.0,
            damping=1.0,
            length=0.9,
            force="0.1*length*rate",
        )
    )
    m.add(fb.WheelOnRail("wheel", "ground", "e", at=(2, 0.4, -1.2), axis=(0, 1, 0), radius=0.4, conicity=0.05, **SOFT))
    m.add(fb.TorsionalSpringDamper("torsion", joint="C", stiffness=3.0, damping=0.1, angle=0.2, torque="0.1*angle**3"))
    tyre = fb.FialaTyre(
        radius=0.9,
        stiffness=30.0,
        damping=0.5,
        nominal_load=3.0,
        slip_stiffness=20.0,
        cornering_stiffness=15.0,
        trail=0.02,
    )
    m.add(fb.Road("road", position=(0, 0, -1)), fb.Tyre("tyre", "road", "e", at=(2, 0.4, -0.6), model=tyre))
    return m


def test_everything_is_there():
    m = everything()
    absolute = {c for c in forces.ALL if not getattr(c, "adds_inertia", False)}
    assert {type(e) for e in m.forces} == absolute
    assert {type(e) for e in m.couplings} == {
        c for c in Coupling.registry.values() if issubclass(c, Coupling) and c.__module__.startswith(joints.__name__)
    }
    assert {type(e) for e in m.sensors} == {Sensor, IMU}


def test_compiled_code_is_the_plain_python():
    """Plain Python first: it notices scratch that is too small, where compiled code would write beside it."""
    a = started(everything())
    c = a.compiled
    c.at(0.3, a.q, a.v)
    y = np.r_[a.q, a.v, c.z]
    plain = np.zeros(len(y))
    assert derivative(0.3, y, plain, c.values.system, c.work) == 0
    _, fast = c.at(0.3, a.q, a.v, MOTION)
    assert fast == pytest.approx(plain, rel=1e-9, abs=1e-9 * np.abs(plain).max())


def test_energy_is_accounted_for():
    """What every damper, motor, friction and given force takes or gives: the balance stays zero."""
    r = everything().simulate(0.5, outputs=101, rtol=1e-9, atol=1e-11)
    assert r.health.energy_drift < 1e-6
    assert r.health.violation < 1e-12
    for e in (*r.model.forces, *r.model.limits):
        power, work = r[e.name].power, r[e.name].work
        moved = np.r_[0.0, np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(r.t))]
        assert work == pytest.approx(moved, abs=2e-3 * max(1.0, np.abs(work).max())), e.name


def test_a_model_file_holds_it():
    text = dumps(everything())
    again = loads(text, fb.Mechanism, "everything.toml")
    assert again == everything()
    assert dumps(again) == text


def test_order_of_forces_and_bodies_changes_nothing():
    """Described in the reverse order the same happens."""
    m, n = everything(), fb.Mechanism("reversed", gravity=(0.3, -0.5, -9.7), parameters={"c": 2.0})
    parts = (m.bodies, m.frames, m.joints, m.sensors, m.couplings, m.forces, m.limits)
    n.add(*(e for part in parts for e in reversed(part)))
    one, two = (x.simulate(0.2, outputs=3, rtol=1e-10, atol=1e-12) for x in (m, n))
    for body in m.bodies:
        assert two[body.name].position == pytest.approx(one[body.name].position, abs=1e-8)
        assert two[body.name].acceleration == pytest.approx(one[body.name].acceleration, abs=1e-5)
