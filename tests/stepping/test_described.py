"""What is described of contact is what happens: belts, grains, materials, exclusions, planes that move."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

G = 9.81
BOX = fb.Box(edges=(0.2, 0.2, 0.1))


def floor(planar: bool = False, **fields: object) -> fb.Mechanism:
    m = fb.Mechanism("floor", planar=planar, gravity=(0, -G) if planar else (0, 0, -G))
    m.add(fb.Material("oak", **fields))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1) if planar else None), material="oak"))
    return m


def box(name: str = "box", **fields: object) -> fb.Body:
    return fb.Body(name, shape=BOX, density=500, **{"position": (0, 0, 0.05)} | fields)


def test_a_belt_takes_things_along() -> None:
    """At mu g up to the speed of the belt: after t1 = v / (mu g) it has come v t1 / 2 and rests on the belt."""
    m = floor(friction=0.2, surface_velocity=(0, 1, 0))
    m.add(box(), fb.Contact())
    run = m.simulate(1.5, method="impulse")
    t1 = 1 / (0.2 * G)
    assert run["box"].velocity[-1] == pytest.approx([0, 1, 0], abs=1e-6)
    assert run["box"].y[-1] == pytest.approx(t1 / 2 + (1.5 - t1), abs=5e-3)


def test_friction_along_the_grain_and_across_it() -> None:
    """v^2 / (2 mu g) to stop, with the friction of either direction; the grain turns with what bears it."""
    m = floor(friction=(0.2, 0.4), grain=(1, 0, 0))
    m.replace(fb.Ground("floor", shape=fb.Plane(), material="oak", orientation=(0, 0, np.pi / 2)))  # grain along y
    m.add(box("along", velocity=(0, 1, 0), angular_velocity=(0, 0, 0)))
    m.add(box("across", velocity=(1, 0, 0), angular_velocity=(0, 0, 0), position=(5, 0, 0.05)))
    m.add(fb.Contact(between="floor", others=["along", "across"]))
    run = m.simulate(1.0, method="impulse")
    assert run["along"].y[-1] == pytest.approx(1 / (2 * 0.2 * G), rel=2e-2)
    assert run["across"].x[-1] - 5 == pytest.approx(1 / (2 * 0.4 * G), rel=2e-2)


@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_a_surface_that_runs_on_a_body_drives_it(heading) -> None:
    """Tracks that run forwards push back, at mu g from rest (not by static friction) up to the speed that they have."""
    m = fb.Mechanism("crawler", gravity=(0, 0, -G))
    m.add(fb.Material("track", friction=0.2, static_friction=0.5, surface_velocity=(1, 0, 0)))
    m.add(fb.Ground("floor", shape=fb.Plane()), box(orientation=(0, 0, heading), material="track"), fb.Contact())
    run = m.simulate(0.6, outputs=[0.0, 0.2, 0.4, 0.6], method=fb.Stepping(step=1e-3))
    speed = -np.minimum(0.2 * G * run.t, 1.0)
    assert run["box"].vx == pytest.approx(speed * np.cos(heading), abs=1e-5)
    assert run["box"].vy == pytest.approx(speed * np.sin(heading), abs=1e-5)


def test_a_belt_that_is_rough_at_rest_slides_by_its_kinetic_friction() -> None:
    """What lies still on a belt that runs slides on it: mu g t, though static friction would hold more."""
    m = floor(friction=0.2, static_friction=0.5, surface_velocity=(0, 1, 0))
    m.add(box(), fb.Contact())
    run = m.simulate(0.3, outputs=4, method=fb.Stepping(step=1e-3))
    assert run["box"].vy == pytest.approx(0.2 * G * run.t, abs=1e-5)


@pytest.mark.parametrize("across", [0.4, 0.1, 0.0])
@pytest.mark.parametrize("grain", [(1, 0, 0), (0, 1, 0), (0, 0, 1)])
@pytest.mark.parametrize("whose", ["floor", "box"])
def test_a_grain_is_that_of_either_surface_and_turns_with_it(whose, grain, across) -> None:
    """v - mu g t along it and across it; where it stands square on the surface that across it holds all around."""
    wood, turned = {"material": "wood"}, {"orientation": (0, 0, np.pi / 2)}  # x of the reference frame along y
    m = fb.Mechanism("boxes", gravity=(0, 0, -G))
    m.add(fb.Material("wood", friction=(0.2, across), grain=grain))
    m.add(fb.Ground("floor", shape=fb.Plane(), **(wood | turned if whose == "floor" else {})))
    own = {"angular_velocity": (0, 0, 0), **(wood | turned if whose == "box" else {})}
    m.add(box("a", velocity=(1, 0, 0), **own), box("b", velocity=(0, 1, 0), position=(5, 0, 0.05), **own))
    m.add(fb.Contact(between="floor", others=["a", "b"]))
    run = m.simulate(0.2, outputs=3, method=fb.Stepping(step=2e-3))
    mu = {(1, 0, 0): (across, 0.2), (0, 1, 0): (0.2, across), (0, 0, 1): (across, across)}[grain]
    assert run["a"].vx == pytest.approx(1 - mu[0] * G * run.t, abs=1e-5)
    assert run["b"].vy == pytest.approx(1 - mu[1] * G * run.t, abs=1e-5)
    assert run["a"].z == pytest.approx(0.05, abs=1e-9)


def test_what_is_excluded_goes_through() -> None:
    m = floor(friction=0.2)
    m.add(box("a"), box("b", position=(1, 0, 0.05)), fb.Contact(friction=0.2, exclude=[("a", "floor")]))
    run = m.simulate(0.5, method="impulse")
    assert run["a"].z[-1] == pytest.approx(0.05 - G * 0.5**2 / 2, abs=1e-9)
    assert run["b"].z[-1] == pytest.approx(0.05, abs=1e-5)


def test_a_plane_that_moves() -> None:
    """An elastic blow of 2 kg at 1 m/s on 1 kg at rest: 1/3 and 4/3 m/s."""
    m = fb.Mechanism("board")
    m.add(fb.Body("board", mass=2, inertia=(1, 1, 1), shape=fb.Plane(), velocity=(0, 0, 1), angular_velocity=(0, 0, 0)))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1), mass=1, position=(0, 0, 0.5)))
    m.add(fb.Contact(friction=0.3, restitution=1))
    run = m.simulate(1.0, method="impulse")
    assert run["board"].vz[-1] == pytest.approx(1 / 3)
    assert run["ball"].vz[-1] == pytest.approx(4 / 3)


def test_many_bodies_move_as_single_ones() -> None:
    at = np.array([(0, 0, 0.1), (0.03, 0, 0.32), (0, 0.02, 0.6)])
    one, many = floor(friction=0.3), floor(friction=0.3)
    for k, p in enumerate(at):
        one.add(fb.Body(f"b{k}", shape=fb.Sphere(radius=0.1), density=1000, position=p))
    many.add(fb.Bodies("b", shape=fb.Sphere(radius=0.1), density=1000, position=at))
    runs = []
    for m in (one, many):
        m.add(fb.Contact(friction=0.3))
        runs.append(m.simulate(1.0, method="impulse"))
    for k in range(3):
        assert runs[1][f"b[{k}]"].position[-1] == pytest.approx(runs[0][f"b{k}"].position[-1], abs=1e-9)


def test_outlines_roll_and_rest_in_the_plane() -> None:
    """A disc that spins backwards starts to roll at w r / 3; boxes and capsules come to lie."""
    m = floor(planar=True, friction=0.3)
    m.add(
        fb.Bodies(
            "discs", shape=fb.Cylinder(radius=0.1, length=0.1), density=1000, position=[(1, 0.1)], angular_velocity=-10
        )
    )
    m.add(fb.Body("box", shape=fb.Box(edges=(0.4, 0.2, 0.1)), density=1000, position=(-1, 0.3), angle=0.3))
    bar = fb.Capsule(radius=0.1, length=0.3, orientation=(0, np.pi / 2, 0))
    m.add(fb.Body("bar", shape=bar, density=1000, position=(-2, 0.3), angle=0.3))
    m.add(fb.Contact(friction=0.3))
    run = m.simulate(2.0, method="impulse")
    assert run["discs[0]"].velocity[-1] == pytest.approx([1 / 3, 0], abs=1e-6)
    for name in ("box", "bar"):
        assert run[name].y[-1] == pytest.approx(0.1, abs=1e-5)
        assert run[name].angle[-1] == pytest.approx(0.0, abs=1e-5)


def test_whole_turns_count_and_round_bodies_turn_exactly():
    """100 rad/s for 0.4 s, told only at the end, at any step."""
    for step in (1e-3, 2e-2):
        m = fb.Mechanism("wheel", planar=True, gravity=(0, -9.81))
        m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))), fb.Contact(friction=0.1))
        wheel = fb.Sphere(radius=0.1)
        m.add(fb.Body("wheel", shape=wheel, mass=1, inertia=0.01, position=(0, 2), angle=1.0, angular_velocity=100.0))
        run = m.simulate(0.4, outputs=2, method=fb.Stepping(step=step))["wheel"]
        assert run.angle == pytest.approx([1.0, 41.0], abs=1e-9)


def test_a_solver_of_the_convex_problem_does_not_take_coulombs():
    """It would leave everything as it was: bodies would fall through the floor."""
    with pytest.raises(fb.ModelError, match="coulomb=False"):
        fb.Stepping(solver="barzilai-borwein")
    assert not fb.Stepping(solver="barzilai-borwein", coulomb=False).coulomb


def test_a_belt_gives_the_energy_of_what_bounces_on_it():
    """Friction never gives any: a ball that drops on a belt gets its speed from the belt."""
    m = fb.Mechanism("belt", gravity=(0, 0, -G))
    m.add(fb.Material("belt", friction=0.5, restitution=0.8, surface_velocity=(1, 0, 0)))
    m.add(fb.Ground("floor", shape=fb.Plane(), material="belt"))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1), mass=1, position=(0, 0, 0.5)))
    m.add(fb.Contact(friction=0.5, restitution=0.8))
    run = m.simulate(0.6, outputs=61, method=fb.Stepping(step=1e-3))
    friction, belt = run.exchanged["friction_loss"], run.exchanged["surface_work"]
    assert np.diff(friction).min() > -1e-12
    before = np.searchsorted(run.t, np.sqrt(2 * 0.4 / G)) + 1
    impulse = run["ball"].vx[before]  # times 1 kg, all of it from the belt, which moves with 1 m/s
    assert impulse > 0.1
    assert belt[before] == pytest.approx(impulse, rel=1e-9)
    assert np.abs(run.energy.balance).max() < 1e-10


def test_few_bodies_on_many_feet_stand():
    """Contacts of a crowd, but bodies so few that Newton's method is all that was compiled."""
    m = fb.Mechanism("tables", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact(friction=0.3))
    feet = [fb.Box(edges=(0.1, 0.1, 0.1), position=(x, 0, 0)) for x in (-0.3, -0.1, 0.1, 0.3)]
    where = np.stack([np.arange(30.0), np.zeros(30), np.full(30, 0.05)], axis=1)
    m.add(fb.Bodies("tables", shape=feet, density=1000, position=where))
    r = m.simulate(0.1, outputs=3)
    assert r.health.contact.most == 30 * 16
    assert r.bulk["tables"].position[-1] == pytest.approx(where, abs=1e-9)
    assert r.contacts.on("tables").force[-1] == pytest.approx([0, 0, 30 * 4 * 9.81], abs=1e-6)
