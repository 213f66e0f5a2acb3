"""The variational method: order 2 in everything, what it keeps, what it takes, what it refuses by name."""

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import G, example, free_body, spatial_four_bar

V = "variational"


def pendulum():
    m = fb.Mechanism("p", planar=True, gravity=(0, -G))
    m.add(fb.Body("bob", mass=1.0, inertia=0.1, position=(np.sin(1.0), -np.cos(1.0)), angle=1.0))
    m.add(fb.Revolute("pin", "ground", "bob", at=(0, 0)))
    return m


def driven_four_bar():
    m = spatial_four_bar()
    m.add(fb.Motor("motor", m.joints[0].name, torque="2 - 0.3*rate"))
    return m


def errors(m, t_end, step, exact, at=0.0):
    """Of positions, turns, velocities, reactions; ``at``: part of a step before the end."""
    r = m.simulate(t_end, outputs=[t_end - at * step], method=V, step=step)
    out = [
        max(np.abs(r[b.name].position - exact[b.name].position).max() for b in m.bodies),
        max(np.abs(r[b.name].rotation - exact[b.name].rotation).max() for b in m.bodies),
        max(np.abs(r[b.name].velocity - exact[b.name].velocity).max() for b in m.bodies),
    ]
    if m.joints:
        out.append(max(np.abs(r[j.name].force - exact[j.name].force).max() for j in m.joints))
    if any(f.name == "motor" for f in m.forces):
        out.append(np.abs(r["motor"].work - exact["motor"].work).max())
    return np.array(out)


@pytest.mark.parametrize("at", [0.0, 0.4])
@pytest.mark.parametrize("make", [pendulum, driven_four_bar])
def test_orders_of_positions_velocities_reactions_and_works(make, at):
    """In the plane and in space, at the ends of steps and between them."""
    m, found = make(), []
    for step in (0.002, 0.001):
        exact = m.simulate(0.4, outputs=[0.4 - at * step], rtol=1e-12)
        found.append(errors(m, 0.4, step, exact, at))
    assert np.log2(found[0] / found[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("name", ["governor.toml", "heavy_top.toml"])
def test_order_with_springs_dampers_and_fast_turns(name):
    """Of the governor's dampers a step is far too long for steps without iterations (h c / 2 m = 8)."""
    m = example(name)
    exact = m.simulate(0.3, outputs=[0.3], rtol=1e-11)
    found = [errors(m, 0.3, step, exact) for step in (0.002, 0.001)]
    assert np.log2(found[0] / found[1]) == pytest.approx(2.0, abs=0.2)


def test_a_free_body_keeps_its_momentum_to_rounding_and_its_energy_within_bounds():
    m = free_body(inertia=(1.0, 2.0, 3.0), w=(1.0, 5.0, 0.3))
    r = m.simulate(10000 * 0.02, outputs=1001, method=V, step=0.02)
    b = r["b"]
    J = np.diag([1.0, 2.0, 3.0])
    L = np.einsum("nij,jk,nlk,nl->ni", b.rotation, J, b.rotation, b.angular_velocity)
    assert np.abs(L - L[0]).max() < 1e-12 * np.linalg.norm(L[0])
    off = r.energy.kinetic / r.energy.kinetic[0] - 1.0
    assert np.abs(off).max() < 1e-3
    assert np.abs(off[:500]).max() == pytest.approx(np.abs(off[500:]).max(), rel=0.02)
    assert np.abs(np.linalg.norm(r.q[:, 3:7], axis=1) - 1.0).max() < 1e-15


def test_a_spin_about_a_fixed_axis_is_exact():
    r = free_body(inertia=(1.0, 1.0, 2.0), w=(0.0, 0.0, 10.0)).simulate(5.0, outputs=6, method=V, step=0.05)
    x = r["b"].rotation[:, :, 0]
    assert np.abs(x - np.column_stack([np.cos(10 * r.t), np.sin(10 * r.t), 0 * r.t])).max() < 1e-13


def test_a_heavy_top_keeps_its_momentum_about_the_vertical():
    m = example("heavy_top.toml")
    r = m.simulate(5.0, outputs=51, method=V, step=0.001)
    b, J = r["top"], np.diag([0.234375, 0.46875, 0.234375])
    L = np.einsum("nij,jk,nlk,nl->ni", b.rotation, J, b.rotation, b.angular_velocity)
    L += 15.0 * np.cross(b.position, b.velocity)
    assert np.abs(L[:, 2] - L[0, 2]).max() < 1e-12 * np.linalg.norm(L[0])
    spin = np.einsum("nji,nj->ni", b.rotation, b.angular_velocity)[:, 1]
    assert np.abs(spin - 150.0).max() < 1e-10
    assert r.health.energy_drift < 1e-5 * r.energy.kinetic[0]
    assert r.health.violation < 1e-14


def test_steps_go_back_to_where_they_came_from():
    """The method is symmetric: with velocities turned round it ends where it began, to rounding."""
    n = fb.Mechanism("back", planar=True, gravity=(0, -G))
    p = pendulum().simulate(1.0, outputs=2, method=V, step=0.01)
    angle, rate = p["pin"].angle[-1] + 1.0, p["pin"].rate[-1]
    x, y = np.sin(angle), -np.cos(angle)
    n.add(fb.Body("bob", mass=1.0, inertia=0.1, position=(x, y), angle=angle, velocity=(rate * y, -rate * x),
                  angular_velocity=-rate))  # fmt: skip
    n.add(fb.Revolute("pin", "ground", "bob", at=(0, 0)))
    r = n.simulate(1.0, outputs=2, method=V, step=0.01)
    assert r["bob"].position[-1] == pytest.approx(p["bob"].position[0], abs=1e-12)
    assert np.abs(r["bob"].velocity[-1]).max() < 1e-12


def test_drivers_and_redundant_rows():
    """A crank driven with a ripple, and a joint said twice."""
    m = fb.Mechanism("d", planar=True, gravity=(0, -G))
    m.add(
        fb.Body("a", mass=1.0, inertia=0.1, position=(0.5, 0)), fb.Body("b", mass=1.0, inertia=0.1, position=(1.5, 0))
    )
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
    m.add(fb.Revolute("again", "a", "b", at=(1, 0)), fb.Driver("drive", "A.angle", "2*t + 0.1*sin(5*t)"))
    exact = m.simulate(1.0, outputs=2, rtol=1e-12)
    found = []
    for step in (0.002, 0.001):
        r = m.simulate(1.0, outputs=2, method=V, step=step)
        found.append([
            np.abs(r["b"].position[-1] - exact["b"].position[-1]).max(), abs(r["drive"].work[-1] - exact["drive"].work[-1])
        ])  # fmt: skip
    assert np.log2(np.array(found[0]) / found[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("method", [V, "generalised-alpha"])
def test_a_step_ends_at_an_event_and_goes_on(method):
    """A ball that bounces with e = 1/2, dropped from 1 m: second order methods fall exactly."""
    m = fb.Mechanism("ball", gravity=(0, 0, -G))
    m.add(fb.Body("b", mass=1.0, inertia=(1, 1, 1), position=(0, 0, 1)))
    m.add(fb.Prismatic("p", "ground", "b", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Limit("floor", "p." + next(iter(m["p"].coordinates)), lower=-1.0, restitution=0.5))
    fall = np.sqrt(2.0 / G)
    r = m.simulate(1.3, outputs=2, method=method, step=0.03, rtol=1e-10)
    assert [e.t for e in r.events[:2]] == pytest.approx([fall, 2.0 * fall], rel=1e-9)


def test_comparison_knows_it():
    c = example("chaplygin_sleigh.toml").compare(1.0, outputs=5, formulations=[V], step=0.002, repeats=1)
    assert "constraints on velocities" in c[V].message
    c = pendulum().compare(1.0, outputs=5, formulations=["projection", V], step=0.002, repeats=1)
    assert c[V].success
    assert c[V].difference < 1e-5


def refused(m, **options):
    with pytest.raises(fb.ModelError) as error:
        m.simulate(0.1, method=V, **options)
    return str(error.value)


def test_what_it_does_not_know_is_refused_by_name():
    assert "takes steps of fixed width" in refused(pendulum())
    assert "takes absolute coordinates" in refused(pendulum(), step=0.01, coordinates="joint")
    assert "constraints on velocities" in refused(example("chaplygin_sleigh.toml"), step=0.01)
    assert "stabilization='none' does nothing" in refused(pendulum(), step=0.01, stabilization="none")
    thin = fb.Mechanism("thin")
    thin.add(
        fb.Body("rod", mass=1.0, inertia=(1.0, 1.0, 0.0)),
        fb.Revolute("h", "ground", "rod", at=(0, 0, 1), axis=(1, 0, 0)),
    )
    assert "inertias about all axes, which 'rod' does not have" in refused(thin, step=0.01)


def test_a_step_that_is_too_long_is_told():
    m = pendulum()
    m.add(fb.CoordinateSpring("s", "pin.angle", stiffness=1e9))
    with pytest.raises(fb.SimulationError, match=r"a step of 1 s finds no positions|not finite"):
        spatial_four_bar().simulate(5.0, method=V, step=1.0)
