"""Small motions of what rests on contacts, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flyball as fb

G = 9.81


def roller(shape: fb.Solid, low: float, inertia: tuple, planar: bool = False) -> fb.Mechanism:
    """A round body of 2 kg on a floor, its mass centre ``low`` below its middle, which is 0.1 m above the floor."""
    m = fb.Mechanism("roller", planar=planar, gravity=(0, -G) if planar else (0, 0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1, 0) if planar else (0, 0, 1))))
    at = (0, 0.1) if planar else (0, 0, 0.1)
    com = (0, -low) if planar else (0, 0, -low)
    m.add(fb.Body("body", shape=shape, mass=2, com=com, inertia=inertia, position=at))
    m.add(fb.Contact(friction=0.8))
    return m


def moving(m: fb.Mechanism, **more) -> np.ndarray:
    """Frequencies [rad/s] of what oscillates."""
    modes = m.modes(**more)
    return modes.omega[[k == "oscillation" for k in modes.kinds]]


def test_a_half_cylinder_rocks() -> None:
    """omega^2 = 8 g / ((9 pi - 16) r) without slip."""
    r = 0.1
    low = 4 * r / (3 * math.pi)
    spin = 2 * (r * r / 2 - low * low)  # about its mass centre, along its axis
    shape = fb.Cylinder(radius=r, length=0.3, looks=True, contact=True)
    m = fb.Mechanism("half", gravity=(0, -G, 0))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1, 0))))
    m.add(fb.Body("half", shape=shape, mass=2, com=(0, -low, 0), inertia=(0.02, 0.02, spin), position=(0, r, 0)))
    m.add(fb.Contact(friction=0.8))
    w = 8 * G / ((9 * math.pi - 16) * r)
    assert moving(m) == pytest.approx([math.sqrt(w)], rel=1e-9)
    e = m.equilibrium()
    assert e.stability == "stable"
    assert moving(m, about=e) == pytest.approx([math.sqrt(w)], rel=1e-6)


@pytest.mark.parametrize("planar", [True, False])
def test_a_ball_with_a_low_centre_rocks(planar: bool) -> None:
    """m g a / (J + m (r - a)^2), in the plane once, in space every way."""
    a, J = 0.02, 0.006
    m = roller(fb.Sphere(radius=0.1, looks=True, contact=True), a, J if planar else (J, J, J), planar)
    w = math.sqrt(2 * G * a / (J + 2 * 0.08**2))
    assert moving(m) == pytest.approx([w] * (1 if planar else 2), rel=1e-9)
    x = m.linearize(outputs=["body.x"])
    assert np.abs(np.linalg.eigvals(x.A).imag).max() == pytest.approx(w, rel=1e-9)


def test_a_block_on_a_smooth_floor_swings_on_its_spring() -> None:
    m = fb.Mechanism("slide", planar=True, gravity=(0, -G))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1, 0))))
    m.add(fb.Body("block", shape=fb.Box(edges=(0.2, 0.1, 1)), mass=2, position=(0.5, 0.05)))
    m.add(fb.SpringDamper("spring", "ground", "block", at=((0, 0.05), (0.5, 0.05)), stiffness=50, length=0.5))
    m.add(fb.Contact(friction=0))
    assert moving(m) == pytest.approx([5.0])
    rough = m.changed({"contact": fb.Contact(friction=0.3)})
    assert len(rough.modes()) == 0  # it sticks
    m.add(fb.Ground("wall", shape=fb.Plane(normal=(1, 0, 0)), position=(0.4, 0, 0)))
    beside = m.modes()
    assert len(beside) == 0 and "wall-block-1, wall-block-2 about to open" in str(beside)
    assert "about to open" in str(m.linearize())


def test_a_box_on_springs_that_touches_a_stop_has_nothing_left() -> None:
    for lower, n in ((-0.3, 0), (None, 1)):
        m = fb.Mechanism("door", planar=True, gravity=(0, -G))
        m.add(fb.Body("bar", mass=2, inertia=0.1, position=(0.5, 0)))
        m.add(fb.Revolute("pin", "ground", "bar", at=(0, 0)))
        m.add(fb.Limit("stop", "pin.angle", lower=lower, upper=2.0))
        e = m.equilibrium()
        assert len(m.modes(about=e)) == n
        if n:
            assert m.modes(about=e).omega == pytest.approx([math.sqrt(2 * G * 0.5 / 0.6)])


def test_what_has_no_linear_model_is_refused_by_name() -> None:
    m = roller(fb.Sphere(radius=0.1), 0.0, (0.008,) * 3)
    m.add(fb.Body("top", shape=fb.Sphere(radius=0.1), mass=1, position=(0, 0, 0.3)))
    with pytest.raises(fb.ModelError, match="body-top is a sticking contact between a sphere and a sphere"):
        m.modes()
    m = roller(fb.Sphere(radius=0.1), 0.0, (0.008,) * 3).changed({"floor": None})
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0.1, 0, 1)), position=(0, 0, -0.0005)))
    with pytest.raises(fb.AnalysisError, match="does not rest there"):
        m.modes()
    run = roller(fb.Sphere(radius=0.1), 0.0, (0.008,) * 3)
    with pytest.raises(fb.ModelError, match="about rest"):
        run.modes(about=run.simulate(0.01, outputs=2))
