"""`check` of what cannot move: locked by its joints, or held by its drivers."""

import json

import pytest

import flyball as fb


def triangle(law="0", length=0.5):
    """Three bars and a driver; with a fourth point it is a four-bar."""
    m = fb.Mechanism("triangle", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("left", mass=1.0, inertia=0.1, position=(0.25, 0.4)))
    m.add(fb.Body("right", mass=1.0, inertia=0.1, position=(0.75, 0.4)))
    m.add(fb.Revolute("A", "ground", "left", at=(0, 0)), fb.Revolute("B", "left", "right", at=(0.5, 0.8)))
    m.add(fb.Revolute("C", "ground", "right", at=(1, 0)), fb.Driver("motor", "A.angle", law))
    return m


def test_a_locked_loop_with_a_driver_is_called_locked():
    said = " ".join(triangle().check().warnings)
    assert "no freedom is left even without the drivers: the mechanism is locked" in said
    assert "drivers take every freedom" not in said


def test_a_driven_crank_is_not():
    m = fb.load("examples/slider_crank.toml")
    said = " ".join(m.check().warnings)
    assert "drivers take every freedom" in said
    assert "locked" not in said


def test_it_is_assembled_without_its_drivers_only_where_something_is_redundant(monkeypatch):
    asked = []
    monkeypatch.setattr("flyball.check._locked", lambda model: asked.append(model.name))
    m = triangle("t")
    m.bodies[1:] = []
    m.joints[1:] = []
    m.check()
    assert not asked
    triangle().check()
    assert asked == ["triangle"]


def test_an_equilibrium_of_what_cannot_move_is_json():
    m = triangle()
    m.drivers.clear()
    told = m.equilibrium().as_dict()
    assert told["least"] is None
    json.dumps(told, allow_nan=False)
    with pytest.raises(ValueError, match="JSON"):
        json.dumps({"least": m.equilibrium().least}, allow_nan=False)
