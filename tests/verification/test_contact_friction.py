"""Laws of friction: stick and slip with static above kinetic friction, grain, belts."""

import numpy as np
import pytest

import flyball as fb

from .contact_scenes import BOX, G, floor, stepped


def test_what_lies_stays_up_to_static_friction_and_slides_by_kinetic():
    """On slopes between the two angles what lies stays, and what is pushed slides on; breaking loose takes a step."""
    mu, static, slope = 0.3, 0.5, 20.0
    s, c = np.sin(np.radians(slope)), np.cos(np.radians(slope))
    for v in (0.0, 0.5):
        m = floor(slope, friction=mu, static_friction=static)
        m.add(fb.Body("block", shape=BOX, density=1000, position=(0, 0, 0.05), velocity=(v, 0, 0)))
        run = stepped(m, 0.5, 5e-3)["block"]
        assert run.vx[-1] == pytest.approx(0.0 if v == 0.0 else v + 0.5 * G * (s - mu * c), abs=1e-6)
    m = floor(27.0, friction=mu, static_friction=static)  # above atan(static)
    m.add(fb.Body("block", shape=BOX, density=1000, position=(0, 0, 0.05)))
    s, c = np.sin(np.radians(27)), np.cos(np.radians(27))
    assert stepped(m, 0.5, 5e-3)["block"].vx[-1] == pytest.approx(
        0.5 * G * (s - mu * c), abs=1.01 * 5e-3 * G * c * (static - mu)
    )


def stick_slip(step):
    """A block on a belt, held by a spring: m = 1 kg, k = 100 N/m, 0.1 m/s, friction 0.5 static and 0.3 kinetic."""
    m = floor(friction=0.3, static_friction=0.5)
    m.add(fb.Material("belt", surface_velocity=(0.1, 0, 0)))
    m.replace(fb.Ground("floor", shape=fb.Plane(), material="belt"))
    m.add(fb.Body("block", shape=BOX, mass=1, inertia=(1, 1, 1), position=(0, 0, 0.05)))
    m.add(fb.SpringDamper("s", "ground", "block", at=((-10, 0, 0.05), (0, 0, 0.05)), stiffness=100, length=10))
    return stepped(m, 4.0, step, outputs=2001)


def test_stick_and_slip_on_a_belt():
    """It is taken along to x = mu_s m g / k, slips back, and sticks again: a cycle of known length.

    From there x - x_k = a cos(w t) + v / w sin(w t), x_k = mu m g / k, a = (mu_s - mu) m g / k, until its speed is the
    belt's again: w t = 2 pi - 2 atan(w a / v); it then sticks for 2 a / v.
    """
    w, v = 10.0, 0.1
    a = 0.2 * G / 100
    slip, stick = (2 * np.pi - 2 * np.arctan(w * a / v)) / w, 2 * a / v
    run = stick_slip(1e-3)
    x, vx = run["block"].x, run["block"].vx
    late = run.t > 1.0
    assert x[late].max() == pytest.approx(0.3 * G / 100 + np.hypot(a, v / w), rel=5e-3)
    sticks = np.abs(vx - v) < 1e-6
    begins = run.t[1:][sticks[1:] & ~sticks[:-1]]
    assert np.diff(begins[begins > 0.7]) == pytest.approx(slip + stick, rel=2e-2)
    assert np.mean(sticks[late]) == pytest.approx(stick / (slip + stick), abs=0.05)


def test_friction_with_a_grain_turns_what_slides():
    """At 45 degrees to the grain friction is along the greatest dissipation: (mu1^2 c, mu2^2 s) / |(mu1 c, mu2 s)|."""
    mu, across = 0.2, 0.6
    m = fb.Mechanism("grain", gravity=(0, 0, -G))
    m.add(fb.Material("wood", friction=(mu, across), grain=(1, 0, 0)))
    m.add(fb.Ground("floor", shape=fb.Plane(), material="wood"), fb.Contact())
    ball = {"mass": 1.0, "inertia": (1e6, 1e6, 1e6)}  # it does not turn: what slides at one point
    c = np.sqrt(0.5)
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1), position=(0, 0, 0.1), velocity=(5 * c, 5 * c, 0), **ball))
    run = stepped(m, 2e-3, 1e-3)["ball"]
    got = (run.velocity[-1] - run.velocity[0])[:2] / (-2e-3 * G)
    want = np.array([mu**2, across**2]) * c / np.hypot(mu * c, across * c)
    assert got == pytest.approx(want, rel=5e-3)


SKIS = {
    "box": fb.Box(edges=(0.2, 0.2, 0.2)),
    "sphere": fb.Sphere(radius=0.1),
    "cylinder": fb.Cylinder(radius=0.1, length=0.2),
    "capsule": fb.Capsule(radius=0.1, length=1e-6),
}


@pytest.mark.parametrize("sled", ["ground", "before", "behind"])
@pytest.mark.parametrize("kind", SKIS)
def test_the_grain_of_a_moving_body(kind, sled):
    """mu = sqrt(0.01 0.5) along the grain, sqrt(0.5 0.5) across it, whichever body was added first; both may move."""
    for along, mu in ((True, np.sqrt(0.005)), (False, 0.5)):
        m = fb.Mechanism("ski", gravity=(0, 0, -G))
        m.add(fb.Material("base", friction=(0.01, 0.5), grain=(0, 1, 0)), fb.Contact(friction=0.5))
        velocity = (0, 1, 0) if along else (1, 0, 0)
        ski = fb.Body("ski", mass=1, inertia=(1e6,) * 3, shape=SKIS[kind], position=(0, 0, 0.1), velocity=velocity,
                      material="base")  # fmt: skip
        snow = fb.Body("snow", mass=2, inertia=(1, 1, 1), shape=fb.Box(edges=(9, 9, 1)), position=(0, 0, -0.5))
        m.add(
            *{"ground": (fb.Ground("snow", shape=fb.Plane()), ski), "before": (ski, snow), "behind": (snow, ski)}[sled]
        )
        if sled != "ground":
            m.add(fb.Planar("ice", "ground", "snow", at=(0, 0, -1), axis=(0, 0, 1)))
        run = m.simulate(0.1, outputs=2)
        assert 1 - run["ski"].velocity[-1] @ velocity == pytest.approx(mu * G * 0.1, rel=1e-4)
        if sled != "ground":
            assert run["snow"].velocity[-1] @ velocity == pytest.approx(0.5 * mu * G * 0.1, rel=1e-4)


def test_a_grain_square_on_the_surface():
    """Then the second number holds in every direction."""
    for velocity in ((1, 0, 0), (0, 1, 0), (0.6, 0.8, 0)):
        m = fb.Mechanism("stubs", gravity=(0, 0, -G))
        m.add(fb.Material("stubs", friction=(0.1, 0.4), grain=(0, 0, 1)), fb.Contact())
        m.add(fb.Ground("floor", shape=fb.Plane(), material="stubs"))
        m.add(fb.Body("b", mass=1, shape=BOX, position=(0, 0, 0.05), velocity=velocity))
        assert 1 - np.linalg.norm(m.simulate(0.1, outputs=2)["b"].velocity[-1]) == pytest.approx(0.04 * G, rel=1e-4)


@pytest.mark.parametrize("planar", [False, True])
def test_a_belt_brings_a_block_to_speed(planar):
    """After v / (mu g), exactly; the belt gives twice what the block gets."""
    m = floor(0, planar, friction=0.2)
    m.add(fb.Material("belt", surface_velocity=(1, 0) if planar else (1, 0, 0)))
    m.replace(fb.Ground("floor", shape=fb.Plane(normal=(0, 1) if planar else None), material="belt"))
    shape = fb.Box(edges=(0.2, 0.1, 0.1)) if planar else BOX
    m.add(fb.Body("block", shape=shape, mass=2, position=(0, 0.05) if planar else (0, 0, 0.05)))
    run = stepped(m, 1.0, 5e-3, outputs=101)
    t1 = 1 / (0.2 * G)
    v = run["block"].vx
    assert v[run.t < t1] == pytest.approx(0.2 * G * run.t[run.t < t1], abs=1e-6)
    assert v[run.t > t1 + 0.01] == pytest.approx(1.0, abs=1e-6)
    assert run.exchanged["surface_work"][-1] == pytest.approx(2.0, rel=1e-6)
    assert run.exchanged["friction_loss"][-1] == pytest.approx(1.0, rel=1e-6)
    assert np.abs(run.energy.balance).max() < 1e-9


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_forces_on_what_turns_are_within_their_cones(friction):
    """A ball slides down a sphere, and a box tumbles: at every output forces are along the normal that they have."""
    m = fb.Mechanism("scene", gravity=(0, 0, -G))
    m.add(fb.Ground("hill", shape=fb.Sphere(radius=1.0)))
    m.add(fb.Ground("floor", shape=fb.Plane(), position=(0, 0, -1)))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1), mass=1, position=(0.3, 0, np.sqrt(1.1**2 - 0.3**2))))
    m.add(fb.Body("egg", shape=fb.Ellipsoid(semi_axes=(0.1, 0.2, 0.3)), mass=50, position=(3, 0, -0.7),
                  orientation=(0.2, 0.1, 0), angular_velocity=(5, 3, 0)))  # fmt: skip
    m.add(fb.Contact(friction=friction))
    run = stepped(m, 1.0, 5e-3, outputs=201)
    c = run.contacts
    held = np.linalg.norm(c.tangential_force, axis=1)
    assert c.normal_force.max() > 50 * G
    assert (held <= (1 + 1e-9) * friction * c.normal_force + 1e-9).all()
