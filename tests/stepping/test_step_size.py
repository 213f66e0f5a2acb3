"""Default step and tolerance of impulse time stepping: those of the scene's own size and speed, and reported."""

import math

import numpy as np
import pytest

import flyball as fb

G = 9.81


def tumbling(size: float, n: int = 3) -> fb.Mechanism:
    """Boxes and a ball that fall on a floor, all lengths in this unit [m]."""
    m = fb.Mechanism("tumbling", gravity=(0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane()))
    for k in range(n):
        turned = {"position": (0.3 * size * k, 0.02 * size * k, 0.6 * size), "orientation": (1, 0.2 + k, 0.4, 0.1)}
        m.add(fb.Body(f"box{k}", shape=fb.Box(edges=(0.2 * size, 0.3 * size, 0.1 * size)), density=1000, **turned))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1 * size), density=1000, position=(0, 0, 0.2 * size)))
    m.add(fb.Contact(friction=0.4, restitution=0.3))
    return m


@pytest.mark.parametrize("size", [1e-3, 1e6])
def test_a_watch_and_a_planet_move_like_a_toy(size):
    """Lengths times s, times times sqrt(s): Froude's law. Powers of ten are rounded, and impacts enlarge that."""
    ones, others = (tumbling(s).simulate(0.5 * math.sqrt(s), outputs=21, method="impulse") for s in (1.0, size))
    assert others.health.steps == ones.health.steps
    for name in ("box0", "box2", "ball"):
        assert np.abs(others[name].position / size - ones[name].position).max() < 1e-6


def test_steps_are_those_of_bodies_of_usual_size_and_reported():
    found = tumbling(1.0).simulate(0.1, outputs=2, method="impulse").health
    radius = 0.5 * math.sqrt(0.2**2 + 0.3**2 + 0.1**2)
    assert found.contact.step == pytest.approx(0.05 * math.sqrt(radius / G))
    assert found.contact.tolerance == pytest.approx(1e-5 * math.sqrt(radius * G))
    assert found.steps == math.ceil(0.1 / found.contact.step)
    assert ("contact step", "at most 0.0069 s, for bodies of radius 0.187 m under gravity") in found.contact.lines()


def test_one_crumb_among_many_bodies_does_not_shorten_the_steps():
    m = tumbling(1.0, 4)
    m.add(fb.Body("crumb", shape=fb.Sphere(radius=1e-4), density=1000, position=(2, 2, 1)))
    assert step_of(m).step == step_of(tumbling(1.0, 4)).step


def step_of(m, **options):
    return m.simulate(0.01, outputs=2, **{"method": "impulse"} | options).health.contact


def flying(speed: float, gravity: float = 0.0, spin: float = 0.0) -> fb.Mechanism:
    m = fb.Mechanism("flying", gravity=(0, 0, -gravity))
    move = {"velocity": (speed, 0, 0), "angular_velocity": (0, 0, spin)}
    m.add(fb.Body("a", mass=1, shape=fb.Sphere(radius=0.2), **move))
    m.add(fb.Body("b", mass=1, shape=fb.Sphere(radius=0.2), position=(1, 0, 0)))
    m.add(fb.Contact(friction=0.1))
    return m


def test_in_a_step_the_fastest_body_moves_a_tenth_of_the_size():
    for m in (flying(20), flying(20, G), flying(20, 1e-9), flying(0, 0, 100)):
        found = step_of(m)
        assert found.step * 20 == pytest.approx(0.1 * 0.2)
        assert found.tolerance == pytest.approx(1e-4)
        assert found.step_reason == "for bodies of radius 0.2 m at 20 m/s at the start"
    assert step_of(flying(0.5, G)).step == step_of(flying(0, G)).step


def slider(force: float, gravity: float = 0.0, speed: float = 0.0) -> fb.Mechanism:
    m = fb.Mechanism("slider", planar=True, gravity=(0, -gravity))
    m.add(fb.Body("block", mass=2, inertia=1, position=(0, 1)))
    m.add(fb.Prismatic("guide", "ground", "block", at=(0, 0), axis=(0, 1)))
    m.add(fb.Initial("guide.displacement", rate=speed))
    m.add(fb.Actuator("motor", "guide.displacement", force=force), fb.Limit("end", "guide.displacement", upper=2))
    return m


def test_without_shapes_the_size_is_that_of_the_mechanism_and_without_gravity_the_scale_is_that_of_its_forces():
    assert step_of(slider(0, G)).step == pytest.approx(0.05 * math.sqrt(0.1 / G))
    assert step_of(slider(0, G)).step_reason == "for a mechanism of 1 m under gravity"
    assert step_of(slider(50)).step == pytest.approx(0.05 * math.sqrt(0.1 / 25))
    assert step_of(slider(50)).step_reason == "for a mechanism of 1 m at 25 m/s^2 at the start"
    assert step_of(slider(0, 0, 3)).step == pytest.approx(0.1 * 0.1 / 3)


def test_at_rest_without_gravity_and_forces_no_duration_is_known():
    found = step_of(slider(0))
    assert (found.step, found.tolerance) == (5e-3, 1e-5)
    assert "the scene has no duration" in found.step_reason


def test_given_steps_and_max_step():
    m = tumbling(1.0)
    usual, given = step_of(m), step_of(m, method=fb.Stepping(step="1 ms"))
    assert (given.step, given.tolerance, given.step_reason) == (1e-3, usual.tolerance, "as given")
    exact = step_of(m, method=fb.Stepping(tolerance=1e-8))
    assert (exact.step, exact.tolerance) == (usual.step, 1e-8)
    bounded = step_of(m, max_step="2 ms")
    assert (bounded.step, bounded.step_reason) == (2e-3, "by max_step")
    assert step_of(m, max_step=1).step == usual.step
    assert step_of(m, method=fb.Stepping(step=1e-3), max_step=5e-4).step == 5e-4


def test_a_motion_continues_with_its_steps():
    """Though what it starts from is faster; the parts are the whole to the last bit."""
    m = flying(0, 1.0)
    m.add(fb.Ground("floor", shape=fb.Plane(), position=(0, 0, -100)))
    times = np.linspace(0, 8, 9)
    whole = m.simulate(8, outputs=times, method="impulse")
    first = m.simulate(5, outputs=times[:6], method="impulse")
    then = m.simulate(8, outputs=times[6:], start=first, method="impulse")
    assert abs(first["a"].vz[-1]) > 4
    assert then.health.contact.step == first.health.contact.step == whole.health.contact.step
    assert then.health.contact.step_reason == "as in the motion that this one continues"
    assert np.array_equal(then["a"].z, whole["a"].z[6:])


def test_the_stepper_takes_the_same_steps():
    m = tumbling(1e-3)
    sim = m.stepper(0.001, outputs=["ball.z", "box2.x"])
    run = m.simulate(0.02, outputs=21, method="impulse")
    assert sim.method.endswith(f"steps of at most {run.health.contact.step:.3g} s, {run.health.contact.step_reason}")
    y = [sim.outputs(), *(sim.step() for _ in range(20))]
    assert np.abs(np.array(y) - np.column_stack([run["ball.z"], run["box2.x"]])).max() < 1e-15


def test_a_hinge_that_turns_far_in_a_step_is_reported():
    """It turns by (w h)^2 / 48 too little; the warning gives that part."""
    m = fb.Mechanism("spinner", gravity=(0, 0, 0))
    m.add(
        fb.Body("wheel", mass=1, inertia=(0.1, 0.2, 0.3), position=(2, 0, 0)),
        fb.Body("ball", mass=1, shape=fb.Sphere(radius=0.1)),
    )
    m.add(fb.Revolute("A", "ground", "wheel", at=(2, 0, 0), axis=(0, 0, 1)), fb.Contact("touch", friction=0.5))
    m.parameters = {"w": 100.0}
    m.add(fb.Initial("A.angle", rate="w"))
    quick = m.simulate(0.1, outputs=2, method=fb.Stepping(step=5e-3))
    assert quick["A.angle"][-1] == pytest.approx(10.0 * (1 - 0.5**2 / 48), rel=1e-4)
    (warning,) = quick.health.warnings
    assert "wheel turns by up to 0.5 rad in a step, and by up to 0.52 per cent too little" in warning
    assert not m.simulate(0.1, outputs=2, parameters={"w": 50.0}, method=fb.Stepping(step=5e-3)).health.warnings
