"""What a result says against itself, and how far friction crept."""

import math

import numpy as np
import pytest

import flyball as fb
from flyball.view.report import health, report_html

G = 9.81


def incline(angle: float, static: float, stick_speed: float = 1e-3, **friction) -> fb.Mechanism:
    """A block of 2 kg on an inclined slide through its centre of mass, gravity downwards."""
    m = fb.Mechanism("incline", planar=True, gravity=(0, -G))
    m.add(fb.Body("block", mass=2, inertia=0.01))
    m.add(fb.Translational("slide", "ground", "block", at=(0, 0), axis=(math.cos(angle), -math.sin(angle))))
    m.add(fb.JointFriction("rub", "slide", static=static, stick_speed=stick_speed, **friction))
    return m


@pytest.mark.parametrize(("angle", "static"), [(0.1, 0.2), (0.2, 0.5), (0.4, 0.45)])
def test_creep_below_the_friction_angle(angle, static):
    """mu N tanh(v / v0) = m g sin a with N = m g cos a: it creeps at v0 artanh(tan a / mu)."""
    v0 = 1e-3
    r = incline(angle, static, v0).simulate(2.0, rtol=1e-8)
    v = v0 * math.atanh(math.tan(angle) / static)
    speed, distance = r.health.creep["rub"]
    assert speed == pytest.approx(v, rel=1e-4)
    # it reaches that speed within a few v0 / (mu g cos a)
    assert distance == pytest.approx(2.0 * v, abs=10 * v * v0 / (static * G))
    assert r["slide"].displacement[-1] == pytest.approx(distance)
    assert dict(r.health.lines())["creep of friction"].startswith("rub: ")


def test_creep_is_counted_at_the_bearing():
    """A wheel held by friction against a torque T: mu N r tanh(r w / v0) = T, and r w is what creeps."""
    radius, v0, static, torque = 0.05, 2e-3, 0.3, 0.1
    m = fb.Mechanism("brake", planar=True, gravity=(0, -G))
    m.add(fb.Body("wheel", mass=3, inertia=0.02), fb.Revolute("axle", "ground", "wheel", at=(0, 0)))
    m.add(fb.Motor("motor", "axle", torque=torque))
    m.add(fb.JointFriction("rub", "axle", static=static, radius=radius, stick_speed=v0))
    v = v0 * math.atanh(torque / (static * 3 * G * radius))
    speed, distance = m.simulate(1.0).health.creep["rub"]
    assert speed == pytest.approx(v, rel=1e-4)
    assert distance == pytest.approx(v, rel=1e-2)


def test_sliding_is_no_creep():
    r = incline(0.5, 0.1).simulate(1.0)
    assert r["slide"].displacement[-1] > 1.0
    assert r.health.creep == {"rub": (0.0, 0.0)}
    assert "creep of friction" not in dict(r.health.lines())


def test_passing_through_rest_is_no_creep():
    """A block that swings on a spring passes through rest twice a period, between two output times."""
    m = incline(0.0, 0.02)
    m.add(
        fb.CoordinateSpring("spring", "slide.displacement", stiffness=50), fb.Initial("slide.displacement", value=0.3)
    )
    speed, distance = m.simulate(1.0, outputs=101).health.creep["rub"]
    assert distance < 1e-4


def test_creep_that_matters_is_a_warning():
    m = incline(0.4, 0.45, 0.1)
    (warning,) = m.simulate(5.0).health.warnings
    assert warning.startswith("JointFriction 'rub' crept ")
    assert "a smaller stick_speed" in warning
    assert incline(0.4, 0.45, 1e-5).simulate(0.1).health.warnings == ()


def pendulum() -> fb.Mechanism:
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -G))
    m.add(fb.Body("rod", mass=1, inertia=1 / 12, position=(0.5, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    return m


def test_a_sound_motion_has_no_warnings():
    r = pendulum().simulate(3.0)
    assert r.health.warnings == ()
    assert r.health.acceleration_violation < 1e-12
    assert not any(label.startswith("warning") for label, _ in r.health.lines())


def test_an_energy_balance_that_does_not_close_is_a_warning():
    """Baumgarte's stabilisation with lazy rates and a rough tolerance loses energy."""
    m = pendulum()
    lazy = {"stabilization": "baumgarte", "alpha": 0.1, "beta": 0.1, "coordinates": "absolute"}  # no row in the other
    r = m.simulate(10.0, **lazy, rtol=1e-2, atol=1e-2, method="rk45")
    moved = np.ptp(r.energy.gravity) + r.energy.kinetic.max()
    assert r.health.energy_drift > 1e-4 * moved
    assert any(w.startswith("the energy balance is off by ") for w in r.health.warnings)
    assert any(w.startswith("constraints are violated by up to ") for w in r.health.warnings)


def test_a_structure_at_rest_has_no_energy_to_lose():
    m = pendulum()
    m.add(fb.Fixed("weld", "ground", "rod", at=(0.5, 0)))
    r = m.simulate(1.0)
    assert not any("energy" in w for w in r.health.warnings)


def test_friction_of_an_undetermined_reaction_is_a_warning():
    """A door on two hinges: either may carry the weight, so the friction of one is not unique."""
    m = fb.Mechanism("door", gravity=(0, 0, -G))
    m.add(fb.Body("leaf", mass=30.0, inertia=(10.0, 11.6, 1.6), position=(0.4, 0, 1), angular_velocity=(0, 0, 1)))
    for name, z in (("upper", 1.8), ("lower", 0.2)):
        m.add(fb.Revolute(name, "ground", "leaf", at=(0, 0, z), axis=(0, 0, 1)))
    m.add(fb.JointFriction("rub", "upper", static=0.1, radius=0.02))
    (warning,) = m.simulate(0.2).health.warnings
    assert warning.startswith("JointFriction 'rub' follows the reaction of 'upper', which redundant constraints leave")
    assert "force z" in warning


def test_warnings_and_creep_are_kept_in_files(tmp_path):
    r = incline(0.4, 0.45, 0.1).simulate(5.0, outputs=51)
    r.save(tmp_path / "r.nc")
    again = fb.load_result(tmp_path / "r.nc")
    assert again.health.creep == r.health.creep
    assert again.health.warnings == r.health.warnings
    assert again.health.as_dict() == r.health.as_dict()


@pytest.mark.parametrize("coordinates", ["auto", "absolute"])
def test_a_report_says_each_thing_of_a_run_once(coordinates):
    r = incline(0.4, 0.45, 0.1).simulate(0.1, outputs=2, coordinates=coordinates, rtol=1e-7)
    labels = [label for label, _ in health(r).rows]
    assert len(set(labels)) == len(labels)
    said = dict(health(r).rows)
    assert said["coordinates"] == r.health.coordinates
    assert said["rtol"] == "1e-07"
    assert "max step" not in said  # there is none
    capped = dict(health(incline(0.4, 0.45, 0.1).simulate(0.1, outputs=2, max_step=0.01)).rows)
    assert capped["max step"] == "0.01"


def test_an_energy_balance_that_was_not_measured_says_so():
    """A motion that ends before its second output time has nothing to be compared."""
    m = fb.Mechanism("p", planar=True, gravity=(0, -G))
    m.add(fb.Body("b", mass=1, inertia=1, position=(0.5, 0)), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.Event("low", "A.angle < -0.5", do=[fb.Stop()]))
    short = m.simulate(2, outputs=[1.5, 2])
    assert len(short.t) == 1
    assert math.isnan(short.health.energy_drift)
    assert dict(short.health.lines())["energy balance"].startswith("not measured: ")
    assert "not measured" in report_html(short)
    whole = m.simulate(2, outputs=[0, 2])
    assert 0.0 < whole.health.energy_drift < 1e-6
    assert dict(whole.health.lines())["energy balance"].endswith(" J largest deviation")


def follower(speed, **cam):
    """An eccentric disk, e = 30 mm, lifts a follower of 0.5 kg: m (g - e w^2 sin(w t)) presses it on, about."""
    u = np.linspace(0, 2 * np.pi, 80, endpoint=False)
    m = fb.Mechanism("cam", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("cam", mass=1, inertia=0.01), fb.Body("follower", mass=0.5, inertia=0.01, position=(0, 0.5)))
    m.add(fb.Revolute("axle", "ground", "cam", at=(0, 0)), fb.Driver("motor", "axle.angle", f"{speed}*t"))
    m.add(fb.Translational("guide", "ground", "follower", at=(0, 0.5), axis=(0, 1)))
    points = np.column_stack([0.03 + 0.1 * np.cos(u), 0.1 * np.sin(u)])
    top = np.sqrt((0.1 + cam.get("radius", 0.0)) ** 2 - 0.03**2)
    m.add(fb.Cam("touch", "cam", "follower", points=points, at=(0, top), **cam))
    return m


@pytest.mark.parametrize("method", ["auto", "impulse"])
def test_a_follower_that_pulls_is_named(method):
    """A real one lifts off, from about e w^2 = g on. In a groove it may pull; nothing is said where it only pushes."""

    def warned(speed, **cam):
        run = follower(speed, **cam).simulate(0.5, outputs=51, method=method)
        return run, [w for w in run.health.warnings if "Cam 'touch'" in w]

    assert not warned(8.0, radius=0.02)[1] and not warned(8.0)[1] and not warned(30.0, radius=0.02, groove=True)[1]
    run, (said,) = warned(30.0, radius=0.02)
    least = np.linalg.norm(run["touch"].force[run["touch"].force[:, 1] < 0], axis=1).max()
    assert least > 10.0 and f"pulls with up to {least:.4g} N" in said
    (said,) = warned(30.0)[1]
    assert "pushes to both sides" in said and "groove=True" in said


def test_wheels_that_pull_are_named():
    """Held down by the joint where something lifts them; a weightless one presses with nothing, and pulls with nothing."""
    wheels = {
        "line": (True, lambda: fb.WheelOnLine("roll", "ground", "w", at=(0, 0), axis=(1, 0), centre=(0, 0.5))),
        "disk": (False, lambda: fb.RollingDisk("roll", "ground", "w", at=(0, 0, 0.5), axis=(0, 1, 0), radius=0.5)),
        "ball": (False, lambda: fb.RollingBall("roll", "ground", "w", at=(0, 0, 0.5), radius=0.5)),
    }
    for planar, joint in wheels.values():
        for lift in (0.0, 9.0, 9.81, 15.0):
            up = (0, 1) if planar else (0, 0, 1)
            m = fb.Mechanism("wheel", planar=planar, gravity=[-9.81 * x for x in up])
            start = {"position": [0.5 * x for x in up], "velocity": (1, 0) if planar else (1, 0, 0)}
            spin = {"inertia": 0.1, "angular_velocity": -2} if planar else {
                "inertia": (0.1, 0.1, 0.1), "angular_velocity": (0, 2, 0)
            }  # fmt: skip
            m.add(fb.Body("w", mass=1, **spin, **start), joint(), fb.PointForce("F", "w", force=[lift * x for x in up]))
            said = [w for w in m.simulate(0.2, outputs=3).health.warnings if "roll" in w]
            assert len(said) == (lift == 15.0) and all("pulls with up to 5.19 N" in w for w in said)
