"""Pendulums against Jacobi's elliptic functions, and steady motions that elementary mechanics gives."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

import flyball as fb
from tests.layers import both_layers
from tests.mechanisms import G, example

pytestmark = both_layers

# the benchmark's closed-form values, A01: exact (Jacobi); the IFToMM library's file agrees to its six digits
A01 = {
    0.5: (-0.391048791551, -0.920369948785),
    1.0: (0.986291751132, -0.165010853126),
    2.0: (-0.793566195343, -0.608483930444),
    10.0: (-0.275087462576, -0.961419205099),
}
LIBRARY = Path(__file__).parent / "data" / "A01_solution_data.txt"  # the library's own solution


def swing(t):
    """Position of the bob of A01, let go at x = -1 (l = 1 m): sin(theta/2) = k sn(K - w t), k^2 = 1/2."""
    k2, w = 0.5, np.sqrt(G)
    s = np.sqrt(k2) * ellipj(ellipk(k2) - w * np.asarray(t), k2)[0]
    return np.stack([-2 * s * np.sqrt(1 - s * s), 2 * s * s - 1], axis=-1)


def test_a01_ten_seconds():
    """IFToMM benchmark A01 to 1e-8 over 10 s, between the steps too."""
    r = example("point_mass_pendulum.toml").simulate(10.0, rtol=1e-12, atol=1e-13)
    at = {float(t): p for t, p in zip(r.t, r["bob"].position, strict=True)}
    for t, exact in A01.items():
        assert at[t] == pytest.approx(exact, abs=1e-8)
    assert r["bob"].position == pytest.approx(swing(r.t), abs=1e-8)
    assert r.health.violation < 1e-12
    assert r.energy.drift < 1e-9


def test_a01_two_thousand_seconds():
    """IFToMM benchmark A01 over its 2000 s (845 swings): to 1e-6 of the exact motion and of the library's 4001 rows."""
    t, x, y = np.loadtxt(LIBRARY, comments="%", unpack=True)
    r = example("point_mass_pendulum.toml").simulate(2000.0, rtol=1e-13, atol=1e-13, outputs=4001)
    p = r["bob"].position
    assert r.t == pytest.approx(t, abs=5e-3)  # six digits of the time too
    assert p == pytest.approx(swing(r.t), abs=1e-6)
    assert p == pytest.approx(np.column_stack([x, y]), abs=1e-6)
    assert p[-1] == pytest.approx((0.814603068589, -0.580018827837), abs=1e-6)
    assert r.health.violation < 1e-14
    assert r.energy.drift < 1e-7


def test_a01_tension():
    """The pivot carries m (v^2 / l + g cos): three times the weight at the bottom, from rest at the horizontal."""
    r = example("point_mass_pendulum.toml").simulate(2.0, rtol=1e-10, outputs=201)
    p = r["bob"].position
    pull = r["pivot"].force  # on the bob, towards the pivot
    assert np.einsum("ij,ij->i", pull, -p) == pytest.approx(-3 * G * p[:, 1], abs=1e-6)
    assert r["pivot"].torque == pytest.approx(np.zeros(201), abs=1e-9) or "torque" not in r["pivot"].channels()


def test_compound_pendulum_has_its_period():
    """A rod of 1 m let go from the horizontal swings back in T = 4 K(sin 45 deg) / sqrt(3 g / 2 l) (closed form)."""
    T = 4 * ellipk(0.5) / np.sqrt(1.5 * G)
    assert pytest.approx(1.933334854373246, rel=1e-14) == T
    m = fb.Mechanism("rod", planar=True, gravity=(0, -G))
    m.add(fb.Body("rod", mass=1.0, inertia=1 / 12, position=(0.5, 0)), fb.Revolute("O", "ground", "rod", at=(0, 0)))
    r = m.simulate(3 * T, rtol=1e-11, atol=1e-12, outputs=[T / 4, T / 2, T, 3 * T])
    assert r["O"].angle[:3] == pytest.approx([-np.pi / 2, -np.pi, 0.0], abs=1e-9)
    assert r["O"].rate[1:] == pytest.approx([0, 0, 0], abs=1e-8)


def thin_rod(angular_velocity):
    """The example, with this angular velocity."""
    body = example("thin_rod.toml")["rod"]
    m = fb.Mechanism("thin rod", gravity=(0, 0, -G), parameters={"tilt": 1.0, "speed": np.sqrt(1.5 * G / np.cos(1.0))})
    m.add(dataclasses.replace(body, angular_velocity=angular_velocity))
    m.add(fb.Universal("pivot", "ground", "rod", at=(0, 0, 0), axes=((1, 0, 0), (0, 1, 0))))
    return m


def test_ideal_thin_rod_turns_steadily():
    """Conical pendulum of a rod without inertia about its axis: cos(tilt) w^2 = 3 g / 2 l keeps the tilt (closed form)."""
    w = np.sqrt(1.5 * G / np.cos(1.0))
    spinning = thin_rod(("speed*tan(tilt)", 0, 0))  # with the spin that the universal joint asks for at the start
    for m, slack in ((spinning, 1e-8), (example("thin_rod.toml"), 1e-5)):
        r = m.simulate(5.0, rtol=1e-10, atol=1e-12)
        p = 2 * r["rod"].position  # the free end
        assert p[:, 2] == pytest.approx(np.full(len(p), -np.cos(1.0)), abs=slack)
        exact = np.sin(1.0) * np.stack([np.cos(w * r.t), np.sin(w * r.t)], axis=1)
        assert p[:, :2] == pytest.approx(exact, abs=10 * slack)


def test_spring_oscillates_and_decays():
    """A damped oscillator: x = e^(-d t) (cos w t + d/w sin w t), d = c / 2 m, w^2 = k / m - d^2 (closed form)."""
    m = fb.Mechanism("oscillator", planar=True)
    m.add(fb.Body("block", mass=2.0, inertia=1.0, position=(2, 0)))
    m.add(fb.Translational("slide", "ground", "block", at=(0, 0), axis=(1, 0), displacement=1.0))
    m.add(fb.SpringDamper("spring", "ground", "block", at=((0, 0), (2, 0)), stiffness=50.0, damping=3.0, length=1.0))
    r = m.simulate(4.0, rtol=1e-11, atol=1e-12)
    d = 3 / 4
    w = np.sqrt(25 - d * d)
    x = np.exp(-d * r.t) * (np.cos(w * r.t) + d / w * np.sin(w * r.t))
    assert r["slide"].displacement == pytest.approx(x, abs=1e-8)
    assert r["block.x"] == pytest.approx(1 + x, abs=1e-8)
