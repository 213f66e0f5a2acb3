"""Where what touches comes to rest, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flyball as fb

G = 9.81


def block(friction: float, slope: float, height: float = 0.06) -> fb.Mechanism:
    """A block over a plane, gravity turned by the slope."""
    m = fb.Mechanism("incline", gravity=(G * math.sin(slope), 0, -G * math.cos(slope)))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    m.add(fb.Body("block", shape=fb.Box(edges=(0.2, 0.2, 0.1)), density=1000, position=(0, 0, height)))
    m.add(fb.Contact(friction=friction))
    return m


def test_a_block_on_a_slope_uses_the_tangent_of_it() -> None:
    e = block(0.6, 0.5).equilibrium()
    assert e.stability == "stable" and e.unbalanced < 1e-12
    force = e.result.contacts.between("ground", "block").force[0]
    assert force == pytest.approx((-4 * G * math.sin(0.5), 0, 4 * G * math.cos(0.5)), abs=1e-9)
    assert sum(k.tangential for k in e.touching) == pytest.approx(4 * G * math.sin(0.5), rel=1e-2)
    assert any("friction keeps it at rest" in x for x in e.notes) and any("is not unique" in x for x in e.notes)
    assert e["block.z"] == pytest.approx(0.05, abs=1e-9)


@pytest.mark.parametrize("part", [1.001, 0.9])
def test_a_block_rests_up_to_the_friction_angle(part: float) -> None:
    m = block(part * math.tan(0.3), 0.3, 0.05)
    if part > 1.0:
        assert m.equilibrium().unbalanced < 1e-9
        return
    with pytest.raises(fb.NotConverged, match="'block' still moves"):
        m.equilibrium()


def ladder(angle: float, friction: float) -> fb.Mechanism:
    """A ladder of 2 m against a smooth wall, its angle from the floor."""
    m = fb.Mechanism("ladder", planar=True, gravity=(0, -G))
    m.add(fb.Material("smooth", friction=0))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1, 0))))
    m.add(fb.Ground("wall", shape=fb.Plane(normal=(1, 0, 0))))
    c, s = math.cos(angle), math.sin(angle)
    rod = fb.Box(edges=(2.0, 1e-9, 1))
    m.add(fb.Body("rod", shape=rod, mass=10, position=(c, s), angle=-angle))
    m.add(fb.Contact(friction=friction))
    m.add(fb.Contact("slick", between=["wall"], others=["rod"], friction=0))
    return m


def test_a_ladder_stands_at_coulombs_angle() -> None:
    """Tangent of the least angle: 1 / (2 mu)."""
    least = math.atan(1.0 / (2.0 * 0.4))
    e = ladder(least + 0.01, 0.4).equilibrium()
    foot, head = ([k for k in e.touching if k.name.startswith(x)] for x in ("floor", "wall"))
    assert sum(k.normal for k in foot) == pytest.approx(10 * G)
    assert sum(k.normal for k in head) == pytest.approx(10 * G / (2 * math.tan(least + 0.01)), rel=1e-6)
    assert max(k.used for k in foot) == pytest.approx(math.tan(least) / math.tan(least + 0.01), rel=1e-5)
    assert e.stability == "stable"
    fallen = ladder(least - 0.01, 0.4).equilibrium()  # below it slides down, and lies on the floor
    assert fallen["rod.y"] == pytest.approx(0.0, abs=1e-6)


def test_three_balls_need_the_friction_of_the_pile() -> None:
    """Two rollers and one on top, a normal between them at an angle t from upright: tan(t / 2), a third on the floor."""
    need = math.tan(0.5 * math.asin(0.525))
    e = balls(0.3).equilibrium()
    on_top = [k for k in e.touching if "top" in k.name]
    below = [k for k in e.touching if "floor" in k.name]
    assert [k.tangential / k.normal for k in on_top] == pytest.approx([need] * 2, rel=1e-6)
    assert [k.tangential / k.normal for k in below] == pytest.approx([need / 3] * 2, rel=1e-6)
    assert balls(0.27).equilibrium()["top.y"] == pytest.approx(0.1, abs=1e-6)  # it has come down between them


def balls(friction: float) -> fb.Mechanism:
    m = fb.Mechanism("pile", planar=True, gravity=(0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1, 0))))
    r = 0.1
    apart, up = 1.05 * r, r + 2.0 * r * math.cos(math.asin(0.525))
    for name, x, y in (("left", -apart, r), ("right", apart, r), ("top", 0.0, up)):
        m.add(fb.Body(name, shape=fb.Sphere(radius=r), mass=1, position=(x, y)))
    m.add(fb.Contact(friction=friction))
    return m


def test_a_beam_about_to_lift_off_its_far_support() -> None:
    """Supports at 0 and 1 m; a load at 1 m + a lifts the end at 0 as a grows; without it both carry by the lever."""
    for weight, state in ((2.0, "sticks"), (4.0, "about to open")):
        m = fb.Mechanism("beam", planar=True, gravity=(0, -10.0))
        for x in (0.0, 1.0):
            m.add(fb.Ground(f"post_{x:.0f}", shape=fb.Sphere(radius=0.1), position=(x, -0.1)))
        beam = (fb.Box(edges=(2.0, 0.1, 1), position=(0.25, 0.05, 0)),)
        m.add(fb.Body("beam", shape=beam, mass=4, position=(0.25, 0)))
        m.add(fb.PointForce("load", "beam", at=(1.5, 0.1), force=(0, -10 * weight)))
        m.add(fb.Contact(friction=0.5))
        e = m.equilibrium()
        far = next(k for k in e.touching if "post_0" in k.name)
        assert far.normal == pytest.approx(40 * 0.5 - 10 * weight * 0.5, abs=1e-6)
        assert far.state == state
        assert (e.stability == "marginal") == (state == "about to open")


def test_a_door_leans_on_its_stop() -> None:
    m = fb.Mechanism("door", planar=True, gravity=(0, -G))
    m.add(fb.Body("bar", mass=2, inertia=0.1, position=(0.5, 0)))
    m.add(fb.Revolute("pin", "ground", "bar", at=(0, 0)))
    m.add(fb.Limit("stop", "pin.angle", lower=-0.3))
    e = m.equilibrium()
    assert e["pin.angle"] == pytest.approx(-0.3, abs=1e-9)
    (stop,) = e.touching
    assert stop.name == "stop" and stop.normal == pytest.approx(2 * G * 0.5 * math.cos(0.3))
    assert e.stability == "stable"


@pytest.mark.parametrize("length", [1e-3, 1.0, 1e3])
def test_stops_of_forces_and_of_torques_are_compared_in_any_unit_of_length(length: float) -> None:
    """A block of 1 kg on its stop, and beside it a bar of 0.1 g that leans on its own: both carry a load."""
    m = fb.Mechanism("beside", planar=True, gravity=(0, -G * length))
    m.add(fb.Body("block", mass=1, inertia=0.1 * length**2, position=(-length, 0)))
    m.add(fb.Body("bar", mass=1e-4, inertia=1e-5 * length**2, position=(0.5 * length, 0)))
    m.add(fb.Translational("rail", "ground", "block", at=(-length, 0), axis=(0, 1)))
    m.add(fb.Revolute("pin", "ground", "bar", at=(0, 0)))
    m.add(fb.Limit("buffer", "rail.displacement", lower=0), fb.Limit("stop", "pin.angle", lower=0))
    found = {k.name: k for k in m.equilibrium().touching}
    assert found["buffer"].normal == pytest.approx(G * length)
    assert found["stop"].normal == pytest.approx(1e-4 * G * 0.5 * length**2)
    assert {k.state for k in found.values()} == {"closed"}


def test_a_wedge_locks_itself() -> None:
    """A wedge of 20 degrees between two plates, of which one presses: it stays where mu > tan(10 deg)."""
    half = math.radians(10)
    stays, leaves = (wedge(half, k * math.tan(half)) for k in (1.05, 0.95))
    begun = stays.simulate(0.0 + 1e-3, outputs=2)["wedge.y"][0]
    assert stays.equilibrium()["wedge.y"] == pytest.approx(begun, abs=1e-6)
    assert leaves.equilibrium()["wedge.y"] > begun + 0.1


def wedge(half: float, friction: float) -> fb.Mechanism:
    """A wedge, its point down, between a wall and a plate that 100 N press on."""
    c, s, t = math.cos(half), math.sin(half), math.tan(half)
    m = fb.Mechanism("wedge", planar=True, gravity=(0, 0))
    m.add(fb.Ground("wall", shape=fb.Plane(normal=(c, s, 0))))
    points = [(-0.5 * t, 0.5), (-0.1 * t, 0.1), (0.1 * t, 0.1), (0.5 * t, 0.5)]
    m.add(fb.Body("wedge", shape=fb.Prism(outline=points, thickness=1), density=1))
    plate = (0.3 * t + 0.05 * c, 0.3 - 0.05 * s)
    m.add(fb.Body("plate", shape=fb.Box(edges=(0.1, 0.3, 1)), mass=1, angle=-half, position=plate))
    m.add(fb.Prismatic("guide", "ground", "plate", at=plate, axis=(1, 0)))
    m.add(fb.PointForce("press", "plate", at=plate, force=(-100, 0)))
    m.add(fb.Contact(friction=friction))
    return m


def test_smooth_contact_rests_where_forces_balance() -> None:
    """A ball on a spring between two smooth walls of a groove: exactly in the middle."""
    m = fb.Mechanism("groove", planar=True, gravity=(0, -G))
    s = math.sqrt(0.5)
    m.add(fb.Ground("left", shape=fb.Plane(normal=(s, s, 0))))
    m.add(fb.Ground("right", shape=fb.Plane(normal=(-s, s, 0))))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1), mass=1, position=(0.02, 0.3)))
    m.add(fb.Contact(friction=0))
    e = m.equilibrium()
    assert (e["ball.x"], e["ball.y"]) == pytest.approx((0, 0.1 / s), abs=1e-9)
    assert [k.normal for k in e.touching] == pytest.approx([G * s] * 2)
    assert not any("friction" in x for x in e.notes)


def test_what_statics_does_not_know_is_refused() -> None:
    m = block(0.5, 0.1)
    for option in ({"stable": True}, {"turning": ("x.angle",)}):
        with pytest.raises(fb.ModelError, match="without contact"):
            m.equilibrium(**option)
    m.add(fb.Bodies("balls", shape=fb.Sphere(radius=0.01), density=2500, position=np.array([[0, 0, 1.0]])))
    with pytest.raises(fb.ModelError, match="describe bodies in contact one by one"):
        m.equilibrium()
    belt = fb.Mechanism("belt", gravity=(0, 0, -G))
    belt.add(fb.Material("belt", friction=0.5, surface_velocity=(1, 0, 0)))
    belt.add(fb.Ground("floor", shape=fb.Plane(), material="belt"))
    belt.add(fb.Body("block", shape=fb.Box(edges=(0.2, 0.2, 0.1)), density=1000, position=(0, 0, 0.05)))
    belt.add(fb.Contact())
    with pytest.raises(fb.ModelError, match="surface_velocity"):
        belt.equilibrium()


@pytest.mark.parametrize("across", [0.4, 0.1])
def test_friction_with_a_grain_is_refused(across):
    """Be it greater or smaller across the grain: statics counts with one number."""
    m = fb.Mechanism("box", gravity=(0, 0, -9.81))
    m.add(fb.Material("wood", friction=(0.2, across), grain=(1, 0, 0)))
    m.add(fb.Ground("floor", shape=fb.Plane(), material="wood"))
    m.add(fb.Body("box", shape=fb.Box(edges=(0.2, 0.2, 0.1)), mass=1, position=(0, 0, 0.05)), fb.Contact())
    with pytest.raises(fb.ModelError, match="statics does not support friction with a grain"):
        m.equilibrium()
