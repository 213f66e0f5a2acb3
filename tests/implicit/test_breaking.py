"""Places where a law's formula ends: no step, however wide, passes them without a word; by any method, at any tolerance."""

import numpy as np
import pytest

import flyball as fb
from tests.robust.families import made
from tests.robust.forces import FORCES

METHODS = ("dop853", "rk45", "radau")


def turning(stiffness):
    """A body that turns at 40 rad/s, too fast for its mount to turn it back."""
    m = fb.Mechanism("turning")
    m.add(fb.Body("x", mass=1, inertia=(1, 1.3, 1.6), angular_velocity=(0.3, 0.1, 40.0)))
    m.add(fb.Bushing("mount", "ground", "x", at=(0, 0, 0), stiffness=10, torsional_stiffness=stiffness))
    return m


@pytest.mark.parametrize("rtol", [1e-2, 1e-3, 1e-7])
@pytest.mark.parametrize("method", METHODS)
def test_a_bushing_is_not_turned_by_half_a_turn(method, rtol):
    """Soft as it is, no tolerance sees it: it was passed, with the torque on the wrong side from there on."""
    with pytest.raises(fb.SimulationError, match=r"Bushing 'mount'.* half a turn") as error:
        turning(0.05).simulate(1.0, method=method, rtol=rtol)
    assert error.value.t == pytest.approx(np.pi / 40.0, rel=0.05)


@pytest.mark.parametrize("method", METHODS)
def test_without_torsional_stiffness_it_turns_for_ever(method):
    r = turning(0.0).simulate(1.0, method=method, rtol=1e-6)
    assert r.health.energy_drift < 1e-3
    momentum = np.einsum("tij,j,tkj,tk->ti", r["x"].rotation, [1, 1.3, 1.6], r["x"].rotation, r["x"].angular_velocity)
    assert np.abs(momentum - momentum[0]).max() < 1e-3 * np.abs(momentum[0]).max()


def test_steps_of_fixed_width_do_not_jump_over_it_either():
    with pytest.raises(fb.SimulationError, match="give a shorter step"):
        turning(0.05).simulate(1.0, method="radau", step=0.02)


@pytest.mark.parametrize("method", METHODS)
def test_to_and_fro_through_rest_is_no_turn(method):
    """From 100 degrees on one side to 100 on the other, in the plane: 0.05 s for the 200 degrees through rest."""
    m = fb.Mechanism("swing", planar=True)
    m.add(fb.Body("x", mass=1, inertia=1, angular_velocity=1.75 * np.sqrt(4000.0)))
    m.add(fb.Bushing("mount", "ground", "x", at=(0, 0), stiffness=10, torsional_stiffness=4000.0))
    r = m.simulate(1.0, outputs=201, method=method, rtol=1e-7)
    assert np.abs(r["x"].angle - 1.75 * np.sin(np.sqrt(4000.0) * r.t)).max() < 1e-3


@pytest.mark.parametrize("rtol", [1e-3, 1e-7])
def test_rows_of_nothing_but_rounding_hold_nothing(rtol, monkeypatch):
    """A hinge twice: in joint coordinates nothing is left of its rows, and an implicit step took them for real ones.

    Where the mount's torque turned round, multipliers of 1e17 held the body still from there on.
    """
    monkeypatch.delitem(FORCES, "PathSpring")  # the mechanism was drawn when it was not among them
    with pytest.raises(fb.SimulationError, match=r"Bushing 'F0'.* half a turn") as error:
        made("redundant", 6).mechanism.simulate(0.5, method="radau", rtol=rtol)
    assert error.value.t == pytest.approx(0.064168, abs=2e-4)
