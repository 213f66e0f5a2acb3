"""Mechanisms with joints, contacts and stops through `simulate`."""

import numpy as np
import pytest

import flyball as fb

G = 9.81


def scene(planar=False, **contact):
    """A floor, gravity, contact of all with all."""
    m = fb.Mechanism("scene", planar=planar, gravity=(0, -G) if planar else (0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    m.add(fb.Contact(**contact))
    return m


def test_a_lever_that_lies_on_the_floor_shares_its_weight_with_the_hinge():
    """Moments about the hinge: the floor carries m g x / d, the hinge the rest; the spring pulls a third of it up."""
    m = scene(friction=0.0)
    m.add(fb.Body("lever", mass=3.0, inertia=(0.1, 0.1, 0.1), position=(1.0, 0, 0.1), shape=fb.Sphere(radius=0.1)))
    m.add(fb.Revolute("hinge", "ground", "lever", at=(-1.0, 0, 0.1), axis=(0, 1, 0)))
    m.add(fb.SpringDamper("s", "ground", "lever", at=((0.0, 0, 2.1), (0.0, 0, 0.1)), stiffness=G / 0.2, length=1.8))
    r = m.simulate(0.5, outputs=3, method="impulse")
    force = r.contacts.total("floor", "lever")[-1] if hasattr(r.contacts, "total") else r.contacts.force.sum(axis=0) / 2
    assert np.abs(force[2]) == pytest.approx(3 * G - G / 2, rel=1e-5)
    assert r["hinge"].fz[-1] == pytest.approx(3 * G - G - (3 * G - G / 2), rel=1e-5)
    assert r["lever"].position[-1] == pytest.approx((1.0, 0, 0.1), abs=1e-9)
    assert r.health.violation < 1e-12


def test_a_pendulum_hits_a_ball_and_all_energy_is_accounted_for():
    """Two equal masses, dead: the ball leaves with half the speed, as the hinge's arm is long and the bob compact."""
    m = scene(friction=0.0)
    m.add(fb.Body("bob", mass=1.0, inertia=(1e-6,) * 3, position=(-1.0, 0, 1.1), shape=fb.Sphere(radius=0.1)))
    m.add(fb.Revolute("hinge", "ground", "bob", at=(0.0, 0, 1.1), axis=(0, 1, 0)))
    m.add(fb.Body("ball", mass=1.0, inertia=(0.004,) * 3, position=(0.2, 0, 0.1), shape=fb.Sphere(radius=0.1)))
    r = m.simulate(1.0, outputs=201, method=fb.Stepping(step=1e-3))
    v = np.sqrt(2 * G)
    assert r["ball"].velocity[-1, 0] == pytest.approx(v / 2, rel=0.01)
    assert np.linalg.norm(r["bob"].position - (0, 0, 1.1), axis=1) == pytest.approx(1.0, abs=1e-12)
    assert r.energy.drift < 0.01 * G
    assert r.health.violation < 1e-12


def chain(tip):
    """20 links of 1 kg on spherical joints, stretched out level over a floor, the last one heavier."""
    m = scene(friction=0.5)
    for i in range(20):
        mass = tip if i == 19 else 1.0
        m.add(fb.Body(f"b{i}", mass=mass, inertia=(0.01 * mass, 0.014 * mass, 0.005 * mass),
                      position=(0.2 * i + 0.1, 0, 2.0), shape=fb.Sphere(radius=0.05)))  # fmt: skip
        m.add(fb.Spherical(f"j{i}", f"b{i - 1}" if i else "ground", f"b{i}", at=(0.2 * i, 0, 2.0)))
    return m


@pytest.mark.parametrize(("tip", "part"), [(1.0, 2e-4), (1000.0, 5e-3)])
def test_a_chain_that_falls_on_a_floor_accounts_for_its_energy(tip, part):
    """Stops of links are impacts, in joints too; its joints stay closed, whatever the masses.

    A tip of 1000 kg that stops pulls so hard at light links that steps have to be shorter for a while.
    """
    r = chain(tip).simulate(1.0, outputs=101, method="impulse")
    assert r.energy.drift < part * r.energy.kinetic.max()
    assert r.exchanged["impact_loss"][-1] > 0.1 * r.energy.kinetic.max()
    assert np.diff(r.energy.total).max() < part * r.energy.kinetic.max()
    assert r.health.violation < 1e-12
    assert r.health.contact.worst_overlap < (1e-6 if tip == 1.0 else 2e-5)


def test_a_limit_stops_a_free_body_and_a_joint():
    m = fb.Mechanism("stops", planar=True, gravity=(0, -G))
    m.add(fb.Body("rod", mass=1.0, inertia=0.1, position=(0.5, 0)))
    m.add(fb.Revolute("hinge", "ground", "rod", at=(0, 0)))
    m.add(fb.Limit("stop", "hinge.angle", lower=-1.0))
    m.add(fb.Body("block", mass=1.0, inertia=0.1, position=(5, 0)))
    m.add(fb.Limit("bottom", "block.y", lower=-0.5, restitution=0.5))
    r = m.simulate(1.0, outputs=101, method="impulse")
    assert r["hinge"].angle.min() == pytest.approx(-1.0, abs=1e-9)
    assert r["hinge"].angle[-1] == pytest.approx(-1.0, abs=1e-9)
    y = r["block"].position[:, 1]
    assert y.min() == pytest.approx(-0.5, abs=1e-9)
    assert y[45:].max() == pytest.approx(-0.5 + 0.25 * 0.5, abs=0.01)
    assert r.energy.drift < 1e-3 * G
    assert r.exchanged["impact_loss"].min() >= 0.0


def test_a_gripper_lifts_a_box_by_friction():
    """Two driven fingers on a driven carriage squeeze a box of 1 kg; it comes along, slipping nowhere."""
    m = scene(friction=0.6)
    m.add(fb.Body("carriage", mass=2.0, inertia=(0.1,) * 3, position=(0, 0, 1.0)))
    m.add(fb.Prismatic("lift", "ground", "carriage", at=(0, 0, 1.0), axis=(0, 0, 1)))
    m.add(fb.Driver("lifter", "lift.displacement", law="0.2*max(t - 0.5, 0)**2"))
    for name, side in (("left", -1.0), ("right", 1.0)):
        m.add(
            fb.Body(
                name, mass=0.2, inertia=(0.01,) * 3, position=(side * 0.2, 0, 0.1), shape=fb.Box(edges=(0.1, 0.2, 0.1))
            )
        )
        m.add(fb.Prismatic(f"{name}_slide", "carriage", name, at=(side * 0.2, 0, 0.1), axis=(-side, 0, 0)))
        m.add(fb.Actuator(f"{name}_push", f"{name}_slide.displacement", force="15"))
    m.add(fb.Body("box", mass=1.0, inertia=(0.01,) * 3, position=(0, 0, 0.1), shape=fb.Box(edges=(0.2, 0.2, 0.2))))
    r = m.simulate(1.5, outputs=31, method="impulse")
    lifted = 0.2 * 1.0**2
    assert r["carriage"].position[-1, 2] == pytest.approx(1.0 + lifted, abs=1e-9)
    assert r["box"].position[-1, 2] == pytest.approx(0.1 + lifted, abs=2e-3)
    assert r.health.violation < 1e-12


def test_a_force_that_is_no_number_is_told():
    m = scene(friction=0.0)
    m.add(fb.Body("bob", mass=1.0, inertia=(0.1,) * 3, position=(1.0, 0, 1.1), shape=fb.Sphere(radius=0.1)))
    m.add(fb.Prismatic("rail", "ground", "bob", at=(1.0, 0, 1.1), axis=(0, 0, 1)))
    m.add(fb.Actuator("push", "rail.displacement", force="sqrt(0.2 - t)"))
    with pytest.raises(fb.SimulationError, match="cannot continue") as told:
        m.simulate(1.0, outputs=11, method="impulse")
    assert told.value.t == pytest.approx(0.2, abs=5e-3)


def test_newtons_cradle_on_joints():
    """Impacts one after the other: the last of five leaves with the first one's speed."""
    m = fb.Mechanism("cradle", planar=True, gravity=(0, -G))
    m.add(fb.Contact(friction=0.0, restitution=1.0))
    for k in range(5):
        a = 0.3 if k == 0 else 0.0
        x = 0.1 * k
        shape = fb.Sphere(radius=0.05)
        m.add(fb.Body(f"b{k}", mass=1.0, inertia=1e-6, position=(x - np.sin(a), -np.cos(a)), angle=-a, shape=shape))
        m.add(fb.Revolute(f"j{k}", "ground", f"b{k}", at=(x, 0)))
    r = m.simulate(0.75, outputs=301, method=fb.Stepping(step=1e-3, impacts="sequential"))
    fast = [np.abs(r[f"b{k}"].velocity[:, 0]).max() for k in range(5)]
    assert fast[4] == pytest.approx(2 * np.sqrt(G) * np.sin(0.15), rel=1e-3)
    assert max(fast[1:4]) < 0.01 * fast[4]


def test_what_steps_by_impulses_cannot_do_is_refused():
    m = scene(friction=0.0)
    m.add(fb.Body("bob", mass=1.0, inertia=(0.1,) * 3, position=(1.0, 0, 1.1), shape=fb.Sphere(radius=0.1)))
    with pytest.raises(fb.ModelError, match="absolute coordinates"):
        m.simulate(0.1, coordinates="joint", method="impulse")


def test_a_motion_with_contact_goes_on_from_where_one_ended():
    """Free bodies, sets of bodies, a mechanism with a driver and a stop: in two parts as in one."""
    m = scene(friction=0.3)
    m.add(fb.Body("ball", mass=1.0, inertia=(0.004, 0.005, 0.006), position=(0, 0, 0.3), velocity=(1, 0, 0),
                  angular_velocity=(3, 20, 1), shape=fb.Sphere(radius=0.1)))  # fmt: skip
    m.add(fb.Bodies("many", mass=0.5, shape=fb.Sphere(radius=0.05), position=[(k, 2.0, 0.2) for k in range(3)]))
    m.add(fb.Body("bob", mass=1.0, inertia=(0.1,) * 3, position=(1.0, -2, 0.6), shape=fb.Sphere(radius=0.1)))
    m.add(fb.Spherical("hinge", "ground", "bob", at=(0.0, -2, 0.6)))
    m.add(fb.Body("cart", mass=1.0, inertia=(0.1,) * 3, position=(0, -4, 1)))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(0, -4, 1), axis=(1, 0, 0)))
    m.add(fb.Driver("push", "rail.displacement", law="sin(3*t)"))
    whole = m.simulate(0.8, outputs=9, method="impulse")
    first = m.simulate(0.4, outputs=5, method="impulse")
    then = m.simulate(0.8, outputs=5, start=first, method="impulse")
    assert then.t[0] == 0.4
    for name in ("ball", "bob", "cart"):
        for part, at in ((first, slice(0, 5)), (then, slice(4, 9))):
            assert part[name].position == pytest.approx(whole[name].position[at], abs=1e-6)
            assert part[name].velocity == pytest.approx(whole[name].velocity[at], abs=1e-5)
    assert then.bulk["many"].position == pytest.approx(whole.bulk["many"].position[4:], abs=1e-6)
    assert then["push"].work == pytest.approx(whole["push"].work[4:], abs=1e-9)
    with pytest.raises(fb.ModelError, match="start"):
        m.simulate(0.8, t_start=0.1, start=first, method="impulse")


@pytest.mark.parametrize("restitution", [0.5, 0.9])
@pytest.mark.parametrize("step", [2e-3, 5e-4])
def test_a_pendulum_that_jams_on_the_floor(step, restitution):
    """Friction alone would hold more than restitution gives back (Painleve's jam): the pendulum stops at once.

    With a and b the distances of the floor's point from the hinge along floor and normal, compression ends after
    I w / (a + mu b), in which friction opposes the slip; expansion adds its part, held by friction.
    """
    mass, radius, mu, top = 0.5, 0.05, 0.8, 0.55
    m = fb.Mechanism("jam", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    m.add(fb.Body("bob", mass=mass, inertia=(5e-4,) * 3, shape=fb.Sphere(radius=radius), position=(0.27, 0.0, 0.083)))
    m.add(fb.Revolute("hinge", "ground", "bob", at=(0.0, 0.0, top), axis=(0, 1, 0)))
    m.add(fb.Contact(friction=mu, restitution=restitution))
    run = m.simulate(0.3, outputs=round(0.3 / step) + 1, method=fb.Stepping(step=step))
    assert not run.health.warnings
    length = np.hypot(0.27, top - 0.083)
    a = np.sqrt(length**2 - (top - radius) ** 2)
    rate = np.sqrt(2 * 9.81 * mass * (0.083 - radius) / (mass * length**2 + 5e-4))
    pressed = (1 + restitution) * (mass * length**2 + 5e-4) * rate / (a + mu * top)
    hit = int(np.argmax(run.contacts.normal_force))
    at = run.contacts.t[run.contacts.when[hit]]
    assert step * run.contacts.normal_force[hit] == pytest.approx(pressed, rel=15.0 * step)
    after = run.energy.kinetic[run.t > at + 3 * step]
    assert after.max() < 0.02 * run.energy.kinetic.max()
    assert run.energy.impact_loss[-1] + run.energy.friction_loss[-1] == pytest.approx(
        run.energy.kinetic.max(), rel=20.0 * step
    )
