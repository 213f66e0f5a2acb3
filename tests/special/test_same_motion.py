"""Motions by code made for the mechanism are the motions of the engine for all mechanisms, within the tolerance."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import example, four_bar

SOME = {  # seconds of motion in which something happens, and not so many that differences grow
    "andrews.toml": 0.01,
    "double_wishbone.toml": 0.5,
    "heavy_top.toml": 0.5,
    "point_mass_pendulum.toml": 0.5,
    "rolling_disk.toml": 0.5,
}
TIGHT = {"rtol": 1e-10, "outputs": 11}


def differ(a: np.ndarray, b: np.ndarray) -> float:
    """The largest difference, by the largest value."""
    return float(np.abs(a - b).max() / (np.abs(b).max() or 1.0)) if b.size else 0.0


def same(m: fb.Mechanism, t_end: float, tolerance: float = 1e-7, **options) -> None:
    a, b = (m.simulate(t_end, specialize=x, **(TIGHT | options)) for x in (True, False))
    assert a.health.engine.startswith("made for this mechanism: ")
    assert "table-driven" not in a.health.engine
    assert b.health.engine == "table-driven: asked for"
    assert a.health.coordinates == b.health.coordinates
    assert differ(a.q, b.q) < tolerance
    assert differ(a.v, b.v) < tolerance
    assert differ(a.vdot, b.vdot) < 100 * tolerance
    assert differ(a.states, b.states) < tolerance
    assert a.health.violation <= 10 * b.health.violation + 1e-12
    assert abs(a.health.steps - b.health.steps) <= 2 + b.health.steps // 20


@pytest.mark.parametrize("name", SOME)
def test_examples(name):
    same(example(name), SOME[name])


STABILIZED = ["projection", "projection-steps", "positions", "velocities", "baumgarte", "none"]


@pytest.mark.parametrize("stabilization", STABILIZED)
def test_stabilizations(stabilization):
    same(four_bar(), 0.5, coordinates="absolute", stabilization=stabilization)


def test_integrators_and_coordinates():
    same(four_bar(), 0.3, coordinates="absolute", method="rk45", rtol=1e-8, tolerance=1e-5)
    same(four_bar(), 0.3, coordinates="joint")


def test_friction_in_joints():
    m = four_bar()
    m.add(fb.JointFriction("dry", joint="D", static=0.2, radius=0.02, stick_speed=1e-3))
    same(m, 0.3, tolerance=1e-6)


def test_driven_mechanisms_and_what_they_take():
    """Positions are followed; works and efforts come along."""
    m = four_bar()
    m.add(fb.Driver("motor", "A.angle", "6*t + 0.3*sin(5*t)"))
    a, b = (m.kinematics(21, t_end=1.0, specialize=x) for x in (True, False))
    assert a.health.engine.startswith("made for this mechanism")
    np.testing.assert_allclose(a.q, b.q, atol=1e-10)
    np.testing.assert_allclose(a["motor"].effort, b["motor"].effort, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(a["motor"].work, b["motor"].work, rtol=1e-7, atol=1e-9)


def oscillator() -> fb.Mechanism:
    m = fb.Mechanism("oscillator", planar=True, parameters={"k": "100 N/m", "x": 0.1})
    m.add(fb.Body("b", mass=1.0, inertia=1.0, position=("x", 0)))
    m.add(fb.Prismatic("slide", "ground", "b", at=("x", 0), axis=(1, 0), displacement="x"))
    m.add(fb.CoordinateSpring("spring", coordinate="slide.displacement", stiffness="k"))
    return m


def test_closed_form_at_several_values_of_the_parameters():
    """x = x0 cos(sqrt(k/m) t); the code that is made once serves all of them."""
    m = oscillator()
    for n, (k, x) in enumerate([(100.0, 0.1), (225.0, 0.1), (64.0, -0.2)]):
        r = m.simulate(2.0, parameters={"k": k, "x": x}, specialize=True, rtol=1e-9)
        np.testing.assert_allclose(r["b.x"], x * np.cos(np.sqrt(k) * r.t), atol=1e-7)
        assert n == 0 or r.health.engine == "made for this mechanism: kept in this process"


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("windows", [1, 4])
def test_singular_positions_are_passed_and_energy_is_kept(windows, coordinates):
    """The parallelograms pass the positions in which they are a line, with their energy (IFToMM A02)."""
    m = example("n_four_bar.py", windows=windows)
    options = {"coordinates": coordinates, "rtol": 1e-9, "outputs": 401}
    made, tables = (m.simulate(4.0, specialize=wish, **options) for wish in (True, False))
    assert made.health.engine.startswith("made")
    assert "table-driven" not in made.health.engine
    for r in (made, tables):
        angle = np.unwrap(r["A0"].angle)
        turned = angle.max() - angle.min()
        assert turned > 2.0 * np.pi, "flat on both sides"
        assert r.energy.drift < 1e-6 * np.ptp(r.energy.kinetic)
        assert r.health.violation < 1e-8
    assert differ(made.q, tables.q) < 1e-5
    for k in range(1, windows + 1):  # no window has left the others
        np.testing.assert_allclose(np.sin(made[f"A{k}"].angle), np.sin(made["A0"].angle), atol=1e-5)


def test_it_goes_on_from_where_it_ended():
    m = four_bar()
    whole = m.simulate(1.0, outputs=3, specialize=True, rtol=1e-10)
    first = m.simulate(0.5, outputs=2, specialize=True, rtol=1e-10)
    for wish in (True, False):
        rest = m.simulate(1.0, start=first, outputs=2, specialize=wish, rtol=1e-10)
        np.testing.assert_allclose(rest.q[-1], whole.q[-1], atol=1e-8)
