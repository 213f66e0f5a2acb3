"""Rubber springs: dynamic stiffness of a generalised Maxwell model, Berg's friction loops, statics and modes."""

import numpy as np
import pytest
from scipy.integrate import quad

import flyball as fb
from flyball.errors import ModelError

K, BRANCHES, TIMES = 1e5, (4e4, 2e4), (0.01, 0.1)
MOST, TRAVEL = 50.0, 0.4e-3


def mount(*more, mass=10.0, **fields):
    m = fb.Mechanism("mount", planar=True)
    m.add(fb.Body("block", mass=mass, inertia=1), fb.Prismatic("G", "ground", "block", at=(0, 0), axis=(1, 0)))
    m.add(fb.Rubber("R", "G.displacement", stiffness=K, **fields), *more)
    return m


VISCOUS = {"viscous_stiffness": BRANCHES, "relaxation_times": TIMES}
FRICTION = {"friction": MOST, "friction_travel": TRAVEL}


def complex_stiffness(w):
    return K + sum(k * 1j * w * T / (1 + 1j * w * T) for k, T in zip(BRANCHES, TIMES, strict=True))


@pytest.mark.parametrize("w", [3.0, 30.0, 300.0])
def test_dynamic_stiffness_of_the_maxwell_model(w):
    """Force of a steady oscillation: the real part of -K*(w) x exp(i w t), to the decay of the first transient."""
    x = 1e-3
    m = mount(fb.Driver("D", "G.displacement", f"{x}*sin({w}*t)"), **VISCOUS)
    cycles = 1 + int(np.ceil(20 * max(TIMES) * w / (2 * np.pi)))
    end = cycles * 2 * np.pi / w
    r = m.simulate(end, outputs=64 * cycles + 1, rtol=1e-9)
    last = r.t > end - 2 * np.pi / w
    exact = -(complex_stiffness(w) * x * np.exp(1j * w * r.t)).imag
    assert r["R.force"][last] == pytest.approx(exact[last], abs=1e-5 * K * x)


def test_linear_model_has_the_dynamic_stiffness():
    """Transfer function from a force to the deflection: 1 / (K*(w) - m w^2)."""
    m = mount(**VISCOUS)
    m.parameters["P"] = 0.0
    m.add(fb.Actuator("push", "G.displacement", force="P"))
    lin = m.linearize(inputs=["P"], outputs=["G.displacement"])
    for w in (10.0, 100.0, 250.0):
        found = lin.C @ np.linalg.solve(1j * w * np.eye(len(lin.A)) - lin.A, lin.B) + lin.D
        assert found[0, 0] == pytest.approx(1 / (complex_stiffness(w) - 10 * w**2), rel=1e-8)


def berg(t, x):
    """Berg's friction along x sin(2 pi t), from its formula, turning point by turning point."""
    turned_at, turned, out = 0.0, 0.0, []
    for k, one in enumerate(np.split(t, np.searchsorted(t, np.arange(0.25, t[-1], 0.5)))):
        s = (-1.0) ** k  # the sign of the rate

        def along(u, s=s, F=turned, u0=turned_at):
            return F + s * (MOST - s * F) * s * (u - u0) / (TRAVEL * (1 - s * F / MOST) + s * (u - u0))

        out.append(along(x * np.sin(2 * np.pi * one)))
        turned_at, turned = s * x, along(s * x)
    return np.concatenate(out)


@pytest.mark.parametrize("x", [0.1e-3, 0.4e-3, 3e-3])
def test_friction_loops(x):
    m = mount(fb.Driver("D", "G.displacement", f"{x}*sin(2*pi*t)"), **FRICTION)
    r = m.simulate(4.2, outputs=421)
    friction = -r["R.force"] - K * r["R.value"]
    assert friction == pytest.approx(berg(r.t, x), abs=1e-4 * MOST)


def test_loss_of_a_large_loop():
    """The symmetric loop between -F_0 and F_0 at -x and x (Berg 1998, equation 8)."""
    x = 20 * TRAVEL
    m = mount(fb.Driver("D", "G.displacement", f"{x}*sin(2*pi*t)"), **FRICTION)
    r = m.simulate(3.25, outputs=326)
    ratio = (np.sqrt(TRAVEL**2 + x**2 + 6 * TRAVEL * x) - TRAVEL - x) / (2 * TRAVEL)
    width = TRAVEL * (1 + ratio)

    def rising(u):
        return -MOST * ratio + (u + x) / (width + u + x) * MOST * (1 + ratio)

    loss = 2 * quad(rising, -x, x)[0]
    assert r["R.work"][225] - r["R.work"][325] == pytest.approx(loss, rel=1e-3)


def test_small_motions_find_the_stiffness_at_the_origin():
    m = mount(**FRICTION)
    w = np.abs(np.imag(m.linearize().eigenvalues)).max()
    assert w == pytest.approx(np.sqrt((K + MOST / TRAVEL) / 10), rel=1e-8)


def test_static_load_relaxes():
    m = mount(fb.Actuator("load", "G.displacement", force=200), **VISCOUS)
    assert m.equilibrium()["G.displacement"] == pytest.approx(200 / K, rel=1e-9)


def test_free_vibration_decays_and_energy_balances():
    m = mount(fb.Initial("G.displacement", value=2e-3), **VISCOUS, **FRICTION)
    r = m.simulate(1.0)
    assert np.abs(r["R.value"][-10:]).max() < 0.2e-3
    assert np.abs(r["energy.balance"]).max() < 1e-6 * 0.5 * K * 4e-6
    assert r.events["R_turns_up"][0].t > 0 and r.events["R_turns_down"][0].t > 0


def test_in_a_part_of_another_mechanism():
    part, whole = (
        mount(fb.Initial("G.displacement", value=2e-3), **VISCOUS, **FRICTION),
        fb.Mechanism("whole", planar=True),
    )
    whole.add(part, prefix="left")
    assert whole.simulate(0.1)["left.R.force"] == pytest.approx(part.simulate(0.1)["R.force"], abs=1e-6)


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"viscous_stiffness": (1e4,)}, "1 viscous_stiffness and 0 relaxation_times"),
        ({"viscous_stiffness": (1e4,), "relaxation_times": (0.0,)}, "greater than zero"),
        ({"friction": 5.0}, "friction and friction_travel belong together"),
        ({"friction": 5.0, "friction_travel": -1e-3}, "friction_travel is -0.001"),
        ({"rest": "2 kg"}, "rest"),
    ],
)
def test_refused(fields, why):
    with pytest.raises(ModelError, match=why):
        mount(**fields)


def test_friction_is_none_in_an_equilibrium_and_stiffens_the_linear_model():
    """Every friction force is one of rest, and it keeps its value; about it dF/dx = -F_m / x_2 on both sides."""
    mass = 10.0
    m = fb.Mechanism("mount", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=mass, inertia=1), fb.Prismatic("G", "ground", "a", at=(0, 0), axis=(0, 1)))
    m.add(fb.Rubber("R", "G.displacement", stiffness=K, **FRICTION))
    rest = m.equilibrium()
    assert rest["G.displacement"] == pytest.approx(-mass * 9.81 / K, rel=1e-9)
    eigenvalues = m.linearize(about=rest).eigenvalues
    assert np.abs(eigenvalues.imag).max() == pytest.approx(np.sqrt((K + MOST / TRAVEL) / mass), rel=1e-9)
    run = m.simulate(0.5, start=rest)
    assert np.abs(run["G.displacement"] - rest["G.displacement"]).max() < 1e-12


@pytest.mark.parametrize("damping", [2.0, 20.0])
def test_friction_brings_a_mass_to_rest(damping):
    """Where what remains is the spring's force, the load and friction; turning points end with the motion."""
    m = fb.Mechanism("mount", planar=True)
    m.add(fb.Body("b", mass=2, inertia=1), fb.Prismatic("G", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Rubber("R", "G.displacement", stiffness=1000, friction=50, friction_travel=0.01))
    m.add(fb.Actuator("load", "G.displacement", force=20))
    m.add(fb.CoordinateSpring("damper", "G.displacement", stiffness=0, damping=damping))
    r = m.simulate(60.0)
    rest = r["G.displacement"][-1]
    assert r.t[-1] == 60.0
    assert np.ptp(r["G.displacement"][r.t > 50.0]) < 1e-7
    assert 1000 * rest == pytest.approx(20 + r["R_friction.value"][-1], rel=1e-6)
    assert abs(r["R_friction.value"][-1]) < 50
