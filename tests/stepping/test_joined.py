"""Mechanisms in impulse time stepping, without contact: order, energy, stiff springs, spinning tops."""

import numpy as np
import pytest

import flyball as fb
from flyball.compiler.kernels import StructBuffer
from flyball.simulation.impulse_stepping.stepping_tables import no_mechanism
from tests.layers import LAYERS

from .stepped import Stepped

H = 0.01


@pytest.mark.parametrize("coordinates", LAYERS)
def test_steps_are_of_second_order(coordinates):
    """Andrews' mechanism has three loops; the integrator at tight tolerance says where it goes."""
    model = fb.load("examples/andrews.toml")
    exact = model.simulate(0.005, coordinates=coordinates, rtol=1e-11, atol=1e-12).final[1]
    errors = []
    for n in (100, 200):
        s = Stepped(model, 0.005 / n, coordinates)
        s.step(n)
        y = s.A.clock.y.current
        errors.append(np.abs(y - exact))
    nq, nv = s.structure.nq, s.structure.nv
    for part in (slice(0, nq), slice(nq, nq + nv), slice(nq + nv, None)):
        assert errors[1][part].max() < 0.27 * errors[0][part].max() + 1e-12
    assert errors[1][:nq].max() < 1e-5


@pytest.mark.parametrize("coordinates", LAYERS)
def test_what_drivers_prescribe_is_met_and_their_work_is_of_second_order(coordinates):
    model = fb.load("examples/slider_crank.toml")
    exact = model.simulate(0.2, coordinates=coordinates, rtol=1e-11, atol=1e-12)
    nq = exact.final[1].size
    errors = []
    for n in (50, 100):
        s = Stepped(model, 0.2 / n, coordinates)
        s.step(n)
        assert s.q == pytest.approx(exact.final[1][: s.structure.nq], abs=1e-12)
        errors.append(np.abs(s.A.clock.y.current[:nq] - exact.final[1]).max())
    assert errors[1] < 0.3 * errors[0]


def oscillator(stiffness, damping=0.0):
    m = fb.Mechanism("oscillator", planar=True)
    m.add(fb.Body("block", mass=1.0, inertia=0.1, position=(1.1, 0.0)))
    m.add(
        fb.SpringDamper("s", "ground", "block", at=((0, 0), (1.1, 0.0)), stiffness=stiffness, damping=damping, length=1)
    )
    return m


@pytest.mark.parametrize("ratio", [1e-2, 1.0, 4.0, 1e2, 1e4, 1e8])
def test_a_spring_gains_no_energy_at_any_step(ratio):
    """h^2 k / m up to 1e8; what is soft keeps its energy."""
    k = ratio / H**2
    s = Stepped(oscillator(k), H)
    energy = [0.5 * k * 0.1**2]
    for _ in range(300):
        s.step()
        energy.append(0.5 * k * (s.q[0] - 1.0) ** 2 + 0.5 * s.v[0] ** 2)
    assert max(energy) <= energy[0] * (1.0 + 1e-9)
    assert energy[-1] > 0.9999 * energy[0] if ratio < 0.1 else energy[-1] < energy[0]


@pytest.mark.parametrize("ratio", [1e-2, 1.0, 1e3])
def test_a_damper_of_any_strength_only_slows(ratio):
    """Without a spring: v+ = v (1 - z / 2) / (1 + z / 2) for weak ones, z = h c / m."""
    m = fb.Mechanism("sledge", planar=True)
    m.add(fb.Body("block", mass=1.0, inertia=0.1, position=(1.0, 0.0), velocity=(1.0, 0.0)))
    m.add(fb.SpringDamper("d", "ground", "block", at=((0, 0), (1.0, 0.0)), damping=ratio / H))
    s = Stepped(m, H)
    s.step()
    assert 0.0 <= s.v[0] <= 1.0
    assert s.v[0] == pytest.approx(np.exp(-ratio), abs=1e-3 if ratio > 1.0 else 0.03 * ratio**2)
    if ratio < 0.1:
        assert s.z[0] == pytest.approx(0.5 * (s.v[0] ** 2 - 1.0), rel=1e-6)  # its work


@pytest.mark.parametrize("coordinates", LAYERS)
@pytest.mark.parametrize("spin", [200.0, 1000.0])
def test_a_top_spins_several_radians_in_a_step(spin, coordinates):
    """Energy and spin stay; the fast top is nearly regular: it precesses with m g l / (I spin)."""
    a = 0.3
    m = fb.Mechanism("top", gravity=(0, 0, -9.81))
    c, s = np.cos(a), np.sin(a)
    turn = (np.cos(a / 2), 0.0, np.sin(a / 2), 0.0)
    m.add(
        fb.Body("rotor", mass=1.0, inertia=(0.002, 0.002, 0.004), position=(0.1 * s, 0, 0.1 * c), orientation=turn,
                angular_velocity=(spin * s, 0, spin * c))
    )  # fmt: skip
    m.add(fb.Spherical("tip", "ground", "rotor", at=(0, 0, 0)))
    top = Stepped(m, 0.005, coordinates)
    top.step(200)
    (p, R), (v, w) = top.pose("rotor"), top.twist("rotor")
    w = R.T @ w
    energy = 0.5 * v @ v + 0.5 * (w * w) @ (0.002, 0.002, 0.004) + 9.81 * p[2]
    assert energy == pytest.approx(0.5 * 0.004 * spin**2 + 0.981 * c, rel=1e-4)
    assert w[2] == pytest.approx(spin, rel=1e-9)
    assert np.linalg.norm(p) == pytest.approx(0.1, abs=1e-12)
    assert p[2] == pytest.approx(0.1 * c, abs=0.004)
    assert top.A.count.unsettled == 0
    assert top.A.count.evaluated < 200 * 8


def test_no_mechanism_has_the_types_of_all_others():
    """So that the loop of steps is compiled once, and what has no joints compiles nothing of this."""
    assert StructBuffer(no_mechanism()).layout == StructBuffer(Stepped(oscillator(1.0), H).A).layout
