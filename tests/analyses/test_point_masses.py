"""Statics and linear models of point masses, whose turns mean nothing; and of mechanisms with next to nothing in them."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.analyses.made import G

LAYERS = ("absolute", "joint")


def pendulum(*masses: tuple[float, float, float], planar: bool = False, velocity: tuple = (0, 0, 0)) -> fb.Mechanism:
    """Point masses on massless rods, each hung on the one before."""

    def flat(p):
        return (p[0], p[2]) if planar else tuple(p)

    m = fb.Mechanism("point masses", planar=planar, gravity=flat((0, 0, -G)))
    before, at = "ground", (0.0, 0.0, 0.0)
    for k, p in enumerate(masses):
        m.add(fb.Body(f"p{k}", mass=1, inertia=0 if planar else (0, 0, 0), position=flat(p), velocity=flat(velocity)))
        m.add(fb.Distance(f"rod {k}", before, f"p{k}", at=(flat(at), flat(p))))
        before, at = f"p{k}", p
    return m


@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize("planar", [True, False])
def test_two_point_masses_hang_and_swing(planar, layer):
    """w^2 = (2 -+ sqrt 2) g / l, in each direction (Landau and Lifshitz, *Mechanics*, section 23)."""
    m = pendulum((0, 0, -1), (0, 0, -2), planar=planar)
    found = m.equilibrium()
    assert found.stability == "stable"
    exact = np.sqrt(np.array([2 - np.sqrt(2), 2 + np.sqrt(2)]) * G)
    omega = m.modes(about=found, coordinates=layer).omega
    assert omega == pytest.approx(np.repeat(exact, 1 if planar else 2), rel=1e-9)


@pytest.mark.parametrize("layer", LAYERS)
def test_a_conical_pendulum_of_a_point_mass(layer):
    """It turns with W^2 = g / (l cos a) and swings about that with W sqrt(1 + 3 cos^2 a)."""
    turn = np.sqrt(G / 0.8)
    m = pendulum((0.6, 0, -0.8), velocity=(0, 0.6 * turn, 0))
    found = m.modes(coordinates=layer)
    assert found.turning == pytest.approx([0, 0, turn], rel=1e-9)
    assert found.omega == pytest.approx([0, turn * np.sqrt(1 + 3 * 0.64)], rel=1e-7, abs=1e-6)


@pytest.mark.parametrize("layer", LAYERS)
def test_what_is_no_steady_motion_is_said(layer):
    for m in (pendulum((1, 0, 0), planar=True, velocity=(0, 0, 1)), pendulum((0.6, 0, -0.8), velocity=(0, 1, 0))):
        with pytest.raises(fb.AnalysisError, match="is not steady"):
            m.modes(coordinates=layer)


@pytest.mark.parametrize("layer", LAYERS)
def test_a_turn_without_inertia_that_something_acts_on_is_named(layer):
    m = pendulum((0, 0, -1), planar=True)
    m.add(fb.SpringDamper("spring", "ground", "p0", at=((0.1, 0), (0.1, -1)), stiffness=10))
    with pytest.raises(fb.ModelError, match=r"nothing with inertia moves along p0\.angle"):
        m.modes(coordinates=layer)


def next_to_nothing() -> dict[str, fb.Mechanism]:
    out = {
        name: fb.Mechanism(name, planar=name != "spatial") for name in ("empty", "fixed", "point", "spatial", "driven")
    }
    out["fixed"].add(fb.Body("b", mass=1, inertia=1), fb.Fixed("f", "ground", "b", at=(0, 0)))
    out["point"].add(fb.Body("b", mass=1, inertia=0))
    out["spatial"].add(fb.Body("b", mass=1, inertia=(0, 0, 0)))
    out["driven"].add(fb.Body("b", mass=1, inertia=1), fb.Revolute("A", "ground", "b", at=(0, 0)))
    out["driven"].add(fb.Driver("d", "A.angle", "t"))
    return out


@pytest.mark.parametrize("name", next_to_nothing())
@pytest.mark.parametrize("ask", ["equilibrium", "modes", "linearize", "mobility", "check", "mass_properties"])
def test_next_to_nothing_gets_an_answer_or_a_reason(name, ask):
    try:
        str(getattr(next_to_nothing()[name], ask)())
    except fb.FlyballError as error:
        assert name in ("empty", "driven") or ask in ("mobility", "check")
        assert str(error)
