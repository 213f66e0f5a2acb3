"""Engines, gear boxes and drivers against closed forms: acceleration, top speed, shifts, closed loops, paths."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

RATIOS, ENGINE, CAR, RADIUS = (4.0, 2.0, 1.0), 0.3, 1500.0, 0.3  # ratios, inertia [kg m^2], mass [kg], radius [m]
SHAFT = 0.02  # kg m^2
MASS = CAR + SHAFT / RADIUS**2  # of the vehicle with its shaft
RPM = np.pi / 30


def car(torque=100.0, throttle="1", speed=0.0, gear=1, drag=0.0, capacity=1000.0, box=None, **engine):
    """A point-mass vehicle on its driveline: crank, gear box, shaft, and wheels as a rack and pinion."""
    m = fb.Mechanism("driveline", planar=True, gravity=(0, 0), parameters={"drag": drag})
    start = RATIOS[max(gear, 1) - 1] * speed / RADIUS
    for k, (name, inertia, rate) in enumerate((("crank", ENGINE, start), ("shaft", SHAFT, speed / RADIUS))):
        m.add(fb.Body(name, mass=1, inertia=inertia, position=(k, 0), angular_velocity=rate))
        m.add(fb.Revolute(f"{name}_joint", "ground", name, at=(k, 0)))
    m.add(fb.Body("car", mass=CAR, inertia=1, position=(0, 1), velocity=(speed, 0)))
    m.add(fb.Prismatic("way", "ground", "car", at=(0, 1), axis=(1, 0)))
    m.add(fb.Coupler("wheels", ("way.displacement", "shaft_joint.angle"), weights=(1, -RADIUS)))
    m.add(fb.Actuator("air", "way.displacement", force="-drag*rate*abs(rate)"))
    rows = torque if isinstance(torque, tuple) else ((0.0, torque),) * 2
    m.add(fb.EngineMap("engine", "crank_joint", speeds=(0, 6000), speed_unit="rpm", throttles=(0, 1), torques=rows,
                       throttle=throttle, **engine))  # fmt: skip
    angles = ("crank_joint.angle", "shaft_joint.angle")
    m.add(fb.GearBox("box", *angles, ratios=RATIOS, capacity=capacity, gear=gear, **(box or {})))
    return m


@pytest.mark.parametrize("gear", [1, 2, 3])
def test_acceleration_in_a_gear(gear):
    """a = T r / R / (m + I r^2 / R^2): the engine's inertia counts by the square of the ratio."""
    run = car(gear=gear).simulate(2.0, outputs=21)
    ratio = RATIOS[gear - 1] / RADIUS
    assert run["car"].vx == pytest.approx(100.0 * ratio / (MASS + ENGINE * ratio**2) * run.t, rel=1e-9, abs=1e-9)
    assert run["engine"].torque == pytest.approx(100.0)
    assert run[f"box_{gear}"].friction[-1] == pytest.approx(
        -100.0 + ENGINE * run["crank"].alpha[-1], rel=1e-9
    )  # what is left of the engine's torque


def test_top_speed_is_where_drag_takes_the_power():
    """Torque falls linearly with the speed: T(w) r / R = c v^2 with w = r v / R."""
    rows = ((-20.0, 160.0), (-60.0, 60.0))
    c, ratio = 0.9, RATIOS[2] / RADIUS
    run = car(rows, gear=3, drag=c, speed=30.0).simulate(1000.0, outputs=3)
    slope = 100.0 / (6000 * RPM)
    # c v^2 + slope ratio^2 v - 160 ratio = 0
    top = np.roots([c, slope * ratio**2, -160.0 * ratio]).max()
    assert run["car"].vx[-1] == pytest.approx(top, rel=1e-6)
    power = run["engine"].torque[-1] * run["crank"].omega[-1]
    assert power == pytest.approx(c * top**3, rel=1e-6)


def test_a_shift_conserves_what_acts_along_no_slip():
    """Without engine torque r I w_i + I_j w_j remains; what is lost of the energy is the heat of the clutch."""
    m = car(torque=0.0, speed=10.0)
    m.add(fb.Event("shift", "t - 0.1", do=[fb.Set("box_target.value", 2), fb.Set("box_shifted.value", "t")]))
    run = m.simulate(2.0, outputs=201)
    w, v = RATIOS[0] * 10.0 / RADIUS, 10.0
    r = RATIOS[1] / RADIUS
    after = (r * ENGINE * w + MASS * v) / (r**2 * ENGINE + MASS)
    assert run["car"].vx[-1] == pytest.approx(after, rel=1e-8)
    assert run["crank"].omega[-1] == pytest.approx(r * after, rel=1e-8)
    lost = 0.5 * (ENGINE * w**2 + MASS * v**2 - (MASS + ENGINE * r**2) * after**2)
    assert -run["box_2"].work[-1] == pytest.approx(lost, rel=1e-6)
    assert -run["box_1"].work[-1] == pytest.approx(0.0, abs=1e-9 * lost)
    assert run["box_gear"].output[[0, -1]] == pytest.approx([1, 2])
    jump = np.abs(np.diff(run["car"].vx)).max()
    assert jump < 0.2 * abs(after - v)  # over the closing of the clutch, not at once
    assert not run.health.doubtful


def test_gears_are_shifted_up_and_down_at_their_speeds():
    box = {"up": "1000 rpm", "down": "400 rpm"}
    m = car(120.0, "step(t, 25, 1, 25.1, 0)", speed=4.0, drag=1.0, box=box, inertia=0.1, idle="300 rpm")
    m.add(fb.Motor("brake", "shaft_joint", torque="-300*step(t, 25, 0, 25.1, 1)*tanh(rate/2)"))
    run = m.simulate(41.0, outputs=821)
    ups = [e for e in run.events if e.name == "box_up"]
    downs = [e for e in run.events if e.name == "box_down"]
    assert len(ups) == 2 and len(downs) == 2
    for events, speed, ratios in ((ups, 1000, (4, 2)), (downs, 400, (1, 2))):
        for e, ratio in zip(events, ratios, strict=True):
            rate = np.interp(e.t, run.t, run["shaft"].omega)
            assert rate == pytest.approx(speed * RPM / ratio, rel=1e-3)
    engages = [e.t for e in run.events if e.name == "box_engages"]
    assert engages == pytest.approx([e.t + 0.2 for e in (*ups, *downs)], abs=1e-9)
    assert abs(run.health.energy_drift) < 1e-5 * run.energy.kinetic.max()


def test_a_motion_that_starts_beyond_a_shift_speed_shifts():
    """20 m/s are 2546 rpm in first gear, 637 rpm in third."""
    up = car(speed=20.0, gear=1, box={"up": "2000 rpm", "down": "400 rpm"}).simulate(4.0)
    assert up["box_target"].output[-1] >= 2
    down = car(torque=0.0, speed=20.0, gear=3, box={"up": "4000 rpm", "down": "900 rpm"}).simulate(4.0)
    assert down["box_target"].output[-1] == 2


def test_idle_speed_and_limiter():
    """Out of gear: governor's and friction's torque meet within the band below idle; full throttle ends at the limit."""
    rows = ((-20.0, 150.0), (-20.0, 150.0))
    for throttle, low, high in (("0", 760, 800), ("1", 3800, 4000)):
        run = car(rows, throttle, gear=0, idle="800 rpm", limit="4000 rpm").simulate(20.0, outputs=3)
        assert low < run["crank"].omega[-1] / RPM < high
        assert run["engine"].torque[-1] == pytest.approx(0.0, abs=1e-6)


def driven(**driver):
    """A mass that a driver accelerates and brakes with at most 6 kN."""
    m = fb.Mechanism("driver", planar=True, gravity=(0, 0), parameters={"goal": 20.0})
    m.add(fb.Body("car", mass=CAR, inertia=1, position=(0, 0)))
    m.add(fb.Prismatic("way", "ground", "car", at=(0, 0), axis=(1, 0)))
    m.add(fb.SpeedDriver("driver", setpoint="goal", measured="car.vx", **({"kp": 0.5, "ki": 0.1} | driver)))
    m.add(fb.Actuator("force", "way.displacement", force="6000*(driver.throttle - driver.brake)"))
    return m


def test_speed_driver_is_its_linear_loop_and_does_not_wind_up():
    """Near the goal m s^2 + F kp s + F ki = 0; from far below it runs at full throttle, and hardly overshoots."""
    roots = np.roots([CAR, 6000 * 0.5, 6000 * 0.1])
    m = driven(initial=1e-3)
    m.add(fb.Initial("way.displacement", rate=20.0))
    found = m.linearize().eigenvalues
    for r in roots:
        assert np.abs(found - r).min() < 1e-6 * abs(r)
    run = driven().simulate(30.0, outputs=601)
    early = run.t < 3.0
    assert run["car"].vx[early] == pytest.approx(4.0 * run.t[early], rel=1e-6, abs=1e-6)
    assert run["car"].vx.max() < 20.0 * 1.08 and run["car"].vx[-1] == pytest.approx(20.0, rel=1e-3)
    sampled = driven(period="20 ms").simulate(30.0, outputs=601)
    assert sampled["car"].vx == pytest.approx(run["car"].vx, abs=0.15)


BASE, V = 2.5, 10.0  # wheelbase [m], speed [m/s]


def bicycle(path, start=(0.0, 0.0, 0.0), **driver):
    """A kinematic vehicle: blades in place of the wheels, the front one turned by a stiff servo."""
    x, y, heading = start
    c, s = np.cos(heading), np.sin(heading)
    m = fb.Mechanism("bicycle", planar=True, gravity=(0, 0))
    moving = {"angle": heading, "velocity": (V * c, V * s)}
    m.add(fb.Body("frame", mass=100, inertia=50, position=(x, y), **moving))
    nose = (x + BASE * c, y + BASE * s)
    m.add(fb.Body("fork", mass=0.1, inertia=0.01, position=nose, angle=heading))
    m.add(fb.Revolute("head", "frame", "fork", at=nose))
    m.add(fb.KnifeEdge("rear", "ground", "frame", at=(x, y), axis=(c, s)))
    m.add(fb.KnifeEdge("front", "ground", "fork", at=nose, axis=(c, s)))
    m.add(fb.PathDriver("driver", "frame", path=path, wheelbase=BASE, **driver))
    m.add(fb.Motor("servo", "head", torque="0.01*(400**2*(driver - angle) - 2*400*rate)"))
    return m


@pytest.mark.parametrize("preview", [0.6, 1.2])
def test_deviation_from_a_straight_path_decays_as_its_closed_form(preview):
    """e'' + 2 (v/l) e' + 2 (v/l)^2 e = 0 with l^2 = least^2 + (preview v)^2."""
    line = [(10.0 * k, 0.0) for k in range(8)]
    run = bicycle(line, start=(0.0, 0.05, 0.0), preview=preview).simulate(3.0, outputs=61)
    a = V / np.hypot(2.0, preview * V)
    expected = 0.05 * np.exp(-a * run.t) * (np.cos(a * run.t) + np.sin(a * run.t))
    assert run["driver"].error == pytest.approx(expected, abs=1e-3)


def test_a_circle_is_followed_without_error():
    R = 30.0
    angle = np.linspace(0.0, 3 * np.pi, 200)
    circle = np.c_[R * np.sin(angle), R * (1.0 - np.cos(angle))]
    run = bicycle(circle, preview=0.8).simulate(12.0, outputs=121)
    late = run.t > 6.0
    assert np.abs(run["driver"].error[late]).max() < 1e-2
    assert np.hypot(run["frame"].x, run["frame"].y - R)[late] == pytest.approx(R, abs=1e-2)
    assert run["driver"].output[late] == pytest.approx(np.arctan(BASE / R), rel=2e-3)
    assert run["driver"].place[-1] == pytest.approx(12.0 * V, rel=5e-3)
