"""What sticks at several places at once holds as long as some shares of friction hold, and no longer."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import flyball as fb

G = 10.0
BOXES = [(0.4, 0.1), (0.1, 0.1), (0.1, 0.2), (0.1, 0.24)]  # the last one tips beyond 4.17 m/s^2
MU = [(0.4, 0.4), (0.2, 0.4)]  # in motion, at rest
LAYERS = ["absolute", "joint"]


def box(w, h, mu, **more):
    m = fb.Mechanism("box", planar=True, gravity=(0, -G))
    m.add(fb.Body("box", shape=fb.Box(edges=(w, h, 0.1), mass=1), position=(0, h / 2)))
    m.add(fb.Contact(friction=mu[0], static_friction=mu[1], **more))
    return m


def pushed(w, h, mu, up=0.0):
    """By 2 t, ``up`` above its middle."""
    m = box(w, h, mu)
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))))
    m.add(fb.PointForce("push", "box", at=(0, h / 2 + up), force=("2*t", 0)))
    return m


def on_a_plate(w, h, mu):
    """That accelerates by 2 t."""
    m = box(w, h, mu)
    m.add(fb.Body("plate", shape=fb.Box(edges=(20, 0.1, 1), mass=5), position=(0, -0.05)))
    m.add(fb.Prismatic("J", "ground", "plate", at=(0, -0.05), axis=(1, 0)), fb.Driver("D", "J.displacement", "t**3/3"))
    return m


def within_cones(run, mu):
    """Friction that is told is within mu N at every place that sticks."""
    for e in run.model.forces:
        if type(e).__name__ == "Touch" and e.slips:
            N, T = run[e.name].normal, np.hypot.reduce(np.atleast_2d(run[e.name].friction))
            assert (mu * N + 1e-6 >= T).all()


@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize("mu", MU)
@pytest.mark.parametrize(("w", "h"), BOXES)
def test_a_pushed_box_slips_where_all_friction_is_used_up(w, h, mu, layer):
    """At 2 t = mu m g, whichever corner bears more; then x'' = 2 t - mu_k g."""
    run = pushed(w, h, mu).simulate(2.5, outputs=26, rtol=1e-9, coordinates=layer)
    (slip,) = run.events
    assert slip.kind == "slip" and slip.t == pytest.approx(2.0, abs=1e-9)
    assert run["box.x"][-1] == pytest.approx((4 - G * mu[0]) / 8 + 1 / 24, abs=1e-9)
    assert run["box.angle"] == pytest.approx(np.zeros(26), abs=1e-12)
    assert not run.health.warnings
    within_cones(run, 0.4)


@pytest.mark.parametrize("up", [-0.04, 0.0, 0.03, 0.05])
def test_at_any_height_below_tipping(up):
    """Tips about its edge at F (h / 2 + up) = m g w / 2: for w = h = 0.1 at 10 N / (1 + 20 up), beyond 4 N."""
    run = pushed(0.1, 0.1, (0.2, 0.4), up).simulate(2.2, outputs=3, rtol=1e-9)
    assert run.events[0].t == pytest.approx(2.0, abs=1e-9) and run.events[0].kind == "slip"


def test_what_is_tall_tips_instead():
    """F h / 2 = m g w / 2 at F = 3.5 N, before mu m g = 4 N: the rear corner opens, the front one goes on to stick."""
    run = pushed(0.07, 0.2, (0.4, 0.4)).simulate(1.8, outputs=3, rtol=1e-9)
    assert run.events[0].t == pytest.approx(1.75, abs=1e-9)
    assert run.events[0].kind == "open" or "parts" in str(run.events[0])
    assert run["box.angle"][-1] < -1e-6


@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize("mu", MU)
@pytest.mark.parametrize(("w", "h"), BOXES)
def test_a_box_on_a_plate_that_a_driver_moves(w, h, mu, layer):
    """It slips where 2 t = mu g; then x'' = mu_k g."""
    run = on_a_plate(w, h, mu).simulate(2.5, outputs=6, rtol=1e-9, coordinates=layer)
    (slip,) = run.events
    assert slip.kind == "slip" and slip.t == pytest.approx(2.0, abs=1e-9)
    assert run["box.x"][-1] == pytest.approx(8 / 3 + 2 + mu[0] * G / 8, abs=1e-8)
    assert not run.health.warnings


def test_a_brake_that_helps_a_stop():
    """Pressed against a stop, friction does not have to hold: nothing slides. Pulled away it holds 3 N by itself."""
    m = fb.Mechanism("slider", planar=True)
    m.add(
        fb.Body("b", mass=1, inertia=0.01),
        fb.Prismatic("J", "ground", "b", at=(0, 0), axis=(1, 0)),
        fb.Limit("stop", "J.displacement", upper=0),
    )
    m.add(fb.JointFriction("rub", "J", static=0.3, preload=10), fb.PointForce("F", "b", force=("20*sin(t)", 0)))
    run = m.simulate(4.0, outputs=41, rtol=1e-9)
    slip = next(e for e in run.events if e.kind == "slip")
    assert slip.t == pytest.approx(np.pi + np.arcsin(3 / 20), abs=1e-8)
    assert np.abs(run["b.x"][run.t < slip.t]).max() < 1e-15


DIPS = ["-50 - 51.2*cos(t)", "-200 - 201.05*cos(t)", "-5 - 5*sin(40*t) - 1.5*cos(3*t)", "-1.2 - 3*sin(t)"]
BACKSTOPS = {
    "ratchet": lambda: fb.Ratchet("back", "J.angle", pitch=0.25, direction=1),
    "freewheel": lambda: fb.OneWay("back", "J.angle"),
    "stop": lambda: fb.Limit("back", "J.angle", lower=0.0),
}


@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize("back", BACKSTOPS)
@pytest.mark.parametrize("torque", DIPS)
def test_a_load_that_lets_go_for_a_moment_is_seen_in_a_wide_step(torque, back, layer):
    """Friction of 1 N m and what lets nothing go back hold an angle until the torque first passes 1 N m.

    The margin of both is 1 N m until shortly before, whatever the load is.
    """
    m = fb.Mechanism("hinge", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1, inertia=0.5), fb.Revolute("J", "ground", "b", at=(0, 0)), BACKSTOPS[back]())
    m.add(fb.JointFriction("rub", "J", static=0.1, preload=10, radius=1.0), fb.Motor("M", "J", torque=torque))
    run = m.simulate(5, outputs=2, coordinates=layer)
    load = lambda t: eval(torque, {"sin": np.sin, "cos": np.cos, "t": t}) - 1.0  # noqa: E731
    t = np.linspace(0, 5, 20001)
    k = np.flatnonzero((load(t[:-1]) < 0) & (load(t[1:]) >= 0))[0]
    assert run.events[0].kind == "slip"
    assert run.events[0].t == pytest.approx(brentq(load, t[k], t[k + 1], xtol=1e-14), abs=1e-9)


def in_space(mu, force=("0", "0", "0"), at=None, torque=None, edges=(0.4, 0.3, 0.2)):
    """A box of 2 kg on a floor, on four corners."""
    m = fb.Mechanism("box", gravity=(0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 0, 1))), fb.Contact(friction=mu[0], static_friction=mu[1]))
    m.add(fb.Body("box", shape=fb.Box(edges=edges, mass=2), position=(0, 0, edges[2] / 2)))
    m.add(fb.PointForce("push", "box", force=force, at=at or (0, 0, edges[2] / 2)))
    if torque:
        m.add(fb.PointTorque("spin", "box", torque=torque))
    return m


def slipped(m, t_end, layer="absolute"):
    run = m.simulate(t_end, outputs=6, rtol=1e-9, method="dop853", coordinates=layer)
    (slip,) = run.events
    assert slip.kind == "slip" and not run.health.warnings
    return slip.t, run


@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize("mu", MU)
@pytest.mark.parametrize("up", [0.05, 0.1])
def test_a_box_in_space_is_pushed(mu, up, layer):
    """All four corners slip at 2 t = mu m g = 8 N, wherever they have their load from; the way is open."""
    force = ("2*t*0.6", "2*t*0.8", "0")
    t, run = slipped(in_space(mu, force, (0, 0, up)), 5.0, layer)
    assert t == pytest.approx(4.0, abs=1e-9)
    far = (8 - 20 * mu[0]) / 4 + 1 / 6
    assert run["box"].position[-1] == pytest.approx((0.6 * far, 0.8 * far, 0.1), abs=1e-9)
    within_cones(run, 0.4)


@pytest.mark.parametrize("mu", MU)
def test_a_box_in_space_is_spun(mu):
    """About the vertical, by 0.5 t: it slips at mu m g r = 2 N m, r = 0.25 m being half its diagonal."""
    t, run = slipped(in_space(mu, torque=("0", "0", "0.5*t")), 4.4)
    assert t == pytest.approx(4.0, abs=1e-9)
    inertia = 2 * (0.4**2 + 0.3**2) / 12
    assert run["box.omega_z"][-1] == pytest.approx(((2 - 5 * mu[0]) * 0.4 + 0.25 * 0.4**2) / inertia, abs=1e-8)


def test_a_tall_box_in_space_tips():
    """About its edge at F h / 2 = m g w / 2: at 2 t = 20 * 0.1 / 0.3 N, before mu m g = 8 N."""
    m = in_space((0.4, 0.4), ("2*t", "0", "0"), edges=(0.1, 0.1, 0.3))
    run = m.simulate(3.4, outputs=3, rtol=1e-9, method="dop853")
    assert run.events[0].t == pytest.approx(10 / 3, abs=1e-9)
    assert run["box.omega_y"][-1] > 1e-3 and abs(run["box.x"][-1]) < 0.01


def test_what_tips_slips_on_the_corners_that_are_left():
    """When it does in the plane, where one corner is left: those that part are no part of what holds."""
    twin = fb.Mechanism("box", planar=True, gravity=(0, -G))
    twin.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))), fb.Contact(friction=0.4))
    twin.add(fb.Body("box", shape=fb.Box(edges=(0.1, 0.3, 0.1), mass=2), position=(0, 0.15)))
    twin.add(fb.PointForce("push", "box", at=(0, 0.15), force=("2*t", 0)))
    box = in_space((0.4, 0.4), ("2*t", "0", "0"), edges=(0.1, 0.1, 0.3))
    runs = [m.simulate(4.1, outputs=3, rtol=1e-9, method="dop853") for m in (twin, box)]
    assert [[e.kind for e in r.events] for r in runs] == [["part", "slip"]] * 2
    assert [e.t for e in runs[1].events] == pytest.approx([e.t for e in runs[0].events], abs=1e-9)


@pytest.mark.parametrize("layer", LAYERS)
def test_a_ball_rolls_in_a_groove(layer):
    """On two planes at right angles, half its radius by sqrt(2) from its axis: a = g sin / (1 + 2/5 * 2)."""
    m = fb.Mechanism("groove", gravity=(0, G * np.sin(0.2), -G * np.cos(0.2)))
    m.add(fb.Ground("left", shape=fb.Plane(normal=(1, 0, 1))), fb.Ground("right", shape=fb.Plane(normal=(-1, 0, 1))))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1), density=1000, position=(0, 0, 0.1 * np.sqrt(2))))
    m.add(fb.Contact(friction=0.5))
    run = m.simulate(2.0, outputs=11, rtol=1e-9, method="dop853", coordinates=layer)
    assert run["ball.y"] == pytest.approx(G * np.sin(0.2) / 1.8 * run.t**2 / 2, abs=1e-8)
    assert run["ball.omega_x"][-1] == pytest.approx(-run["ball.vy"][-1] / (0.1 / np.sqrt(2)), rel=1e-9)
    assert not run.health.warnings and len(run.events) <= 1
    within_cones(run, 0.5)


@pytest.mark.parametrize("rtol", [1e-5, 1e-7, 1e-10])
@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize(("e", "x"), [(0.0, 0.0), (0.5, 0.0), (0.5, 0.01)])
def test_a_ball_at_rest_in_a_groove_needs_no_friction(e, x, layer, rtol):
    """So nothing is open there, whatever its two places share; a torque turns it when both are at their cones.

    N1 + N2 = 2 W cos 45 / (1 + mu^2) then, the torque mu r (N1 + N2).
    """
    m = fb.Mechanism("groove", planar=True, gravity=(0, -G))
    m.add(fb.Ground("left", shape=fb.Plane(normal=(1, 1))), fb.Ground("right", shape=fb.Plane(normal=(-1, 1))))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1, mass=1), position=(x, 0.1 * np.sqrt(2) + 0.5)))
    m.add(fb.Contact(friction=0.3, restitution=e))
    m.add(fb.PointTorque("turn", "ball", torque="where(t < 1.2, 0, t - 1.2)"))
    run = m.simulate(2.0, outputs=[0, 1.1, 1.5, 2], rtol=rtol, coordinates=layer)
    assert run["ball.y"][2] == pytest.approx(0.1 * np.sqrt(2), abs=1e-9) and not run.health.warnings
    slip = next(v for v in run.events if v.kind == "slip" and v.t > 1.2)
    assert slip.t == pytest.approx(1.2 + 0.3 * 0.1 * 2 * G * np.sqrt(0.5) / 1.09, abs=1e-8)
    assert run["ball.angle"][2] == pytest.approx(run["ball.angle"][1], abs=1e-12)
    assert run["ball.angle"][3] > run["ball.angle"][2] + 1


@pytest.mark.filterwarnings("ignore::flyball.StartWarning")
@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2), (0, 2, 1), (2, 1, 0)])
def test_who_holds_beside_a_brake_does_not_depend_on_the_order_of_elements(order, layer):
    """A brake and the friction of one joint share what holds it, in infinitely many ways: both of them stick.

    How the sliding friction of the rail follows each of the two is the same number, and known by differences.
    """
    m = fb.Mechanism("arm", planar=True, gravity=(0, -9.81))
    at, com = (0.17758964033116964, 0.15407077770253524), (0.12589158865766054, 0.05735997831044087)
    m.add(
        fb.Body("b2", mass=1.2134362269175012, inertia=0.04853744907670006, com=com, position=at, angle=0.479258673953)
    )
    tip, com = (0.7075267662402256, -0.13919795754046782), (-0.04243736705314474, -0.058067256998715344)
    m.add(fb.Body("b3", mass=0.34533740434010746, inertia=0.0138134961736043, com=com, position=tip,
                  angle=-1.8492416123872235, velocity=(-0.06379436668625171, -0.7302353031127615),
                  angular_velocity=-2.5757745379809682))  # fmt: skip
    m.add(fb.Prismatic("slide", "ground", "b2", at=(-0.2931071653351156, 0.13091637683881907), axis=(1, 0)))
    m.add(fb.Revolute("arm", "b2", "b3", at=(0.2673253940060067, -0.13919795754046782)))
    spring = ((1.0075267662402256, -0.13919795754046782), tip)
    m.add(fb.SpringDamper("pull", "ground", "b3", at=spring, stiffness=2.874044369432799))
    holding = [
        fb.Brake("brake", "arm.angle", capacity="where(t > 0.2, 5, 0)"),
        fb.JointFriction("pin", "arm", coordinate="angle", static=0.3479590124949839, radius=0.020069304240110185,
                         stribeck_speed=0.1),
        fb.JointFriction("rail", "slide", coordinate="displacement", static=0.016645826675879088, preload=5),
    ]  # fmt: skip
    m.add(*(holding[k] for k in order))
    r = m.simulate(0.5, outputs=5)
    stuck = sorted(name for x in r.events if x.kind == "stick" for name in x.name.split(", "))
    assert stuck == ["brake", "pin"]
