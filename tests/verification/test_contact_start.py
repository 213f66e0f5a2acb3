"""How motions start and go on in scenes that are not as they should be: overlap, bullets, stacks, bodies in one place."""

import numpy as np
import pytest

import flyball as fb

from .contact_scenes import BOX, G, floor, stepped


@pytest.mark.parametrize("e", [0.0, 0.8])
@pytest.mark.parametrize("shape", [fb.Sphere(radius=0.1), BOX, fb.Capsule(radius=0.05, length=0.1)])
def test_overlap_makes_no_speed(shape, e):
    """Two bodies that start 30 % inside each other are put side by side, and stay where they are."""
    m = fb.Mechanism("two", gravity=(0, 0, 0))
    for k in range(2):
        m.add(fb.Body(f"b{k}", shape=shape, density=1000, position=(0, 0, 0.07 * k)))
    m.add(fb.Contact(friction=0.3, restitution=e))
    run = stepped(m, 0.1, 5e-3, outputs=21)
    assert run.energy.kinetic.max() < 1e-18
    moved = np.abs(run["b1"].position[-1] - run["b1"].position[0]).max()
    assert 0.01 < moved <= run.health.contact.overlap_at_start
    assert np.abs(run.contacts.at(0.1).gap).max(initial=0.0) < 1e-6


def test_overlap_lifts_by_no_more_than_itself():
    """A ball 30 % inside the floor comes up to it, at once, and lies."""
    m = floor(friction=0.3, restitution=0.5)
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1), density=1000, position=(0, 0, 0.07)))
    run = stepped(m, 1.0, 5e-3, outputs=201)
    assert run["ball"].z.max() < 0.1 + 1e-9
    assert run["ball"].z[-1] == pytest.approx(0.1, abs=1e-6)
    assert np.abs(run["ball"].vz).max() < 1e-6


def test_a_heap_that_starts_in_itself_calms():
    """27 balls in the room of 8: none is thrown, none higher than they all stand on each other."""
    at = 0.15 * np.stack(np.meshgrid(*3 * [np.arange(3)]), axis=-1).reshape(-1, 3) + (0, 0, 0.1)
    m = floor(friction=0.3, restitution=0.5)
    m.add(fb.Bodies("balls", shape=fb.Sphere(radius=0.1), density=1000, position=at))
    run = stepped(m, 0.5, 5e-3, outputs=101)
    b = run.bulk["balls"]
    speed = np.linalg.norm(b.velocity, axis=2)
    assert speed.max() < np.sqrt(2 * G * 0.5)
    assert b.position[..., 2].max() < 1.0


@pytest.mark.parametrize("shape", [fb.Sphere(radius=0.005), fb.Box(edges=(0.01, 0.01, 0.01))])
@pytest.mark.parametrize("wall", ["ground", "body"])
def test_a_bullet_does_not_tunnel(shape, wall):
    """300 m/s at a plate of 2 mm, 1.5 m a step: it stops there, or takes the plate along as momentum says."""
    m = fb.Mechanism("range", gravity=(0, 0, 0))
    plate = fb.Box(edges=(0.002, 0.5, 0.5))
    if wall == "ground":
        m.add(fb.Ground("plate", shape=plate, position=(1, 0, 0)))
    else:
        m.add(fb.Body("plate", shape=plate, mass=1, position=(1, 0, 0)))
    m.add(fb.Body("bullet", shape=shape, mass=0.01, position=(0, 0, 0), velocity=(300, 0, 0)))
    m.add(fb.Contact(friction=0.2))
    run = stepped(m, 0.05, 5e-3, outputs=11)
    if wall == "ground":
        assert run["bullet"].x.max() < 1
        assert np.abs(run["bullet"].velocity[-1]).max() < 1e-6
    else:
        assert run["bullet"].vx[-1] == pytest.approx(3 / 1.01, rel=1e-6)
        assert run["plate"].vx[-1] == pytest.approx(3 / 1.01, rel=1e-6)
        assert (run["bullet"].x < run["plate"].x).all()


@pytest.mark.parametrize(("top", "crooked"), [(1, False), (1000, False), (1e5, False), (1, True), (1000, True)])
def test_a_stack_stands(top, crooked):
    """Ten cubes of 1 m, one of any mass on top; also dropped from gaps of 1 mm, shifted by 3 cm and yawed."""
    m = floor(friction=0.5)
    cube = fb.Box(edges=(1, 1, 1))
    for k in range(11 if top > 1 else 10):
        side = (-1) ** k * crooked
        at = (0.03 * side, 0, k + 0.5 + 1e-3 * (k + 1) * crooked)
        m.add(fb.Body(f"b{k}", shape=cube, mass=top if k == 10 else 1, position=at, orientation=(0, 0, 0.06 * side)))
    run = m.simulate(2.0, outputs=3)
    for k in range(10):
        drift = run[f"b{k}"].position[-1] - run[f"b{k}"].position[0]
        assert np.abs(drift[:2]).max() < 1e-5
        assert run[f"b{k}"].z[-1] == pytest.approx(k + 0.5, abs=1e-5)
    assert run.health.contact.worst_overlap < 1e-5
    assert run.energy.kinetic[-1] < 1e-9


def test_many_in_one_place_are_refused_in_words():
    m = floor(friction=0.3)
    m.add(fb.Bodies("grains", shape=fb.Sphere(radius=0.01), density=2500, position=np.zeros((100_000, 3)) + 1.0))
    with pytest.raises(fb.ModelError, match=r"close together.*move bodies that start at the same place apart"):
        m.simulate(0.1)


def test_a_few_in_one_place_come_apart():
    """Directions that do not exist are made up; nothing hangs, nothing is thrown."""
    m = floor(friction=0.3)
    m.add(fb.Bodies("grains", shape=fb.Sphere(radius=0.01), density=2500, position=np.zeros((5, 3)) + (0, 0, 0.1)))
    run = stepped(m, 0.5, 5e-3, outputs=101).bulk["grains"]
    assert np.isfinite(run.position).all()
    assert np.abs(run.velocity).max() < 1.5 * np.sqrt(2 * G * 0.15)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_poses_that_are_none_are_refused(bad):
    m = floor(friction=0.3)
    with pytest.raises(fb.ModelError, match="grains"):
        m.add(fb.Bodies("grains", shape=fb.Sphere(radius=0.01), density=2500, position=[(0, 0, 1), (0, bad, 1)]))


@pytest.mark.parametrize("angle", [0.0, 1e-6])
def test_a_planar_stack_stands_for_long(angle):
    """Rounding once left the plane, grew as exp(35 t), and threw boxes 60 m high."""
    m = floor(planar=True, friction=0.4)
    shape = fb.Box(edges=(0.2, 0.1, 0.1))
    for k in range(4):
        m.add(fb.Body(f"b{k}", shape=shape, density=1000, position=(0.01 * (-1) ** k, 0.05 + 0.1 * k), angle=angle))
    run = stepped(m, 10.0, 5e-3, outputs=11)
    for k in range(4):
        assert run[f"b{k}"].y[-1] == pytest.approx(0.05 + 0.1 * k, abs=1e-9)
    assert run.energy.kinetic.max() < 1e-12


@pytest.mark.parametrize("shape", [fb.Sphere(radius=0.01), fb.Box(edges=(0.02, 0.02, 0.02))])
@pytest.mark.parametrize("gap", [0.0005, 0.004])
def test_what_falls_together_stops_together(shape, gap):
    """A column falls; what stops its lowest stops the others in the same step, though none came nearer before."""
    m = floor(friction=0.3)
    at = [(0, 0, 0.01 + gap + (0.02 + gap) * k) for k in range(20)]
    m.add(fb.Bodies("column", shape=shape, density=2500, position=at))
    run = m.simulate(0.3, outputs=61)
    z = run.bulk["column"].position[:, :, 2]
    assert np.diff(z, axis=1).min() > 0.02 - (1e-6 if isinstance(shape, fb.Sphere) else 2e-3)
    assert z[-1] == pytest.approx(0.01 + 0.02 * np.arange(20), abs=1e-5)
