"""What holds a mechanism at rest is a constraint to statics and to linear equations: brakes, stops, ropes, latches."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

G = 9.81


def double(*parts):
    """A horizontal link on ground that carries a hanging one of 1 kg and 0.1 kg m^2, its centre 0.5 m below the pin."""
    m = fb.Mechanism("double", planar=True, gravity=(0, -G))
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Body("b", mass=1, inertia=0.1, position=(1.0, -0.5)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
    m.add(*parts)
    return m


HANGING = np.sqrt(G * 0.5 / (0.1 + 0.25))  # of the lower link about a pin that stands still
WEIGHT = G * (0.5 + 1.0)  # moment of both about A
HOLDERS = {
    "brake": fb.Brake("hold", "A.angle", capacity=2 * WEIGHT),
    "friction": fb.JointFriction("hold", "A", static=0.5, radius=2.0),
    "limit": fb.Limit("hold", "A.angle", lower=0.0),
    "one way": fb.OneWay("hold", "A.angle"),
    "ratchet": fb.Ratchet("hold", "A.angle", teeth=12),
    "ratchet with a tooth elsewhere": fb.Ratchet("hold", "A.angle", pitch=0.1, tooth=0.1),
    "shear pin": fb.ShearPin("hold", "A.angle", strength=2 * WEIGHT),
    "rope": fb.Rope("hold", bodies=("ground", "a"), at=((1, 1), (1, 0))),
}


@pytest.mark.parametrize("holder", HOLDERS)
def test_what_holds_leaves_the_lower_link_to_swing(holder):
    m = double(HOLDERS[holder])
    found = m.equilibrium()
    assert found["A.angle"] == pytest.approx(0.0, abs=1e-9)
    assert "hold" in [k.name for k in found.touching]
    for where in ({"about": found}, {}):
        modes = m.modes(**where)
        assert len(modes.eigenvalues) == 1
        assert abs(modes.eigenvalues[0]) == pytest.approx(HANGING, rel=1e-9)
    linear = m.linearize(about=found, outputs=("B.angle",))
    assert sorted(abs(linear.eigenvalues)) == pytest.approx([HANGING] * 2, rel=1e-9)


def test_friction_tells_how_much_of_what_it_bears_is_used():
    """The bearing carries both weights, 2 g; of 0.5 * 2 g * 2 m it uses the moment 1.5 g: three quarters."""
    touch = double(HOLDERS["friction"]).equilibrium().touching[0]
    assert touch.state == "sticks"
    assert touch.used == pytest.approx(0.75, rel=1e-9)
    assert touch.tangential == pytest.approx(WEIGHT, rel=1e-9)


def test_a_brake_that_is_too_weak_holds_nothing():
    m = double(fb.Brake("hold", "A.angle", capacity=0.9 * WEIGHT))
    with pytest.raises(fb.AnalysisError, match="does not rest there"):
        m.modes()


def test_a_pin_that_is_too_weak_holds_nothing():
    m = double(fb.ShearPin("hold", "A.angle", strength=0.9 * WEIGHT))
    with pytest.raises(fb.AnalysisError, match="does not rest there"):
        m.modes()


def test_a_pin_tells_how_much_of_its_strength_is_used():
    touch = double(fb.ShearPin("hold", "A.angle", strength=2 * WEIGHT)).equilibrium().touching[0]
    assert touch.used == pytest.approx(0.5, rel=1e-9)


def test_what_is_at_its_limit_has_no_linear_equations():
    m = double(fb.Brake("hold", "A.angle", capacity=WEIGHT))
    with pytest.raises(fb.SingularityError, match="hold: friction is at its limit"):
        m.modes()


def test_a_stop_that_is_not_reached_is_open():
    m = double(fb.Limit("far", "A.angle", lower=-3.0, upper=3.0), fb.Brake("hold", "A.angle", capacity=2 * WEIGHT))
    assert len(m.modes().eigenvalues) == 1
    free = double(fb.Limit("far", "A.angle", lower=-3.0))
    hung = free.equilibrium()
    assert hung["A.angle"] == pytest.approx(-np.pi / 2, abs=1e-6)
    assert len(free.modes(about=hung).eigenvalues) == 2


def shafts(capacity):
    """Two rotors, 2 and 3 kg m^2, the first on a spring of 100 N m; a clutch between them."""
    m = fb.Mechanism("shafts", planar=True)
    for name, inertia, x in (("one", 2, 0), ("two", 3, 1)):
        m.add(
            fb.Body(name, mass=1, inertia=inertia, position=(x, 0)),
            fb.Revolute(f"{name} pin", "ground", name, at=(x, 0)),
        )
    m.add(fb.CoordinateSpring("spring", "one pin.angle", stiffness=100))
    m.add(fb.Clutch("clutch", "one pin.angle", "two pin.angle", capacity=capacity))
    return m


@pytest.mark.parametrize(("capacity", "wanted"), [(5.0, [np.sqrt(100 / 5)]), (0.0, [0.0, np.sqrt(100 / 2)])])
def test_a_clutch_joins_shafts_or_does_not(capacity, wanted):
    w = np.abs(shafts(capacity).modes().eigenvalues)
    assert sorted(w) == pytest.approx(wanted, rel=1e-9, abs=1e-6)


def test_a_rope_over_eyes_that_is_taut_is_refused_by_name():
    m = double(fb.Rope("line", bodies=("ground", "a", "ground"), at=((0.5, 1), (1, 0), (1.5, 1))))
    with pytest.raises(fb.ModelError, match=r"Rope 'line' is taut.*stiffness"):
        m.modes()
