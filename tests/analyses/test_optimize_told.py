"""What a search says at its end: in our words, and a zero slope is not called found."""

import pytest

import flyball as fb


def spring(k=100.0):
    m = fb.Mechanism("scale", planar=True, gravity=(0, -9.81), parameters={"k": k, "other": 1.0})
    m.add(fb.Body("b", mass=1.0, inertia=1.0, position=(0, 0)))
    m.add(fb.Prismatic("p", "ground", "b", at=(0, 0), axis=(0, 1)))
    m.add(fb.CoordinateSpring("s", "p.displacement", stiffness="k"))
    return m


def test_a_zero_slope_is_not_called_found():
    found = spring().optimize(["b.y"], ["other"], target=[-0.2], analysis="equilibrium")
    assert not found.success
    assert "every derivative is zero where it begins" in found.message


def test_the_reason_is_told_in_our_words():
    found = spring().optimize(["b.y"], ["k"], target=[-0.2], analysis="equilibrium")
    assert found.parameters["k"] == pytest.approx(9.81 / 0.2, rel=1e-6)
    assert found.success
    assert "`" not in found.message
    few = spring().optimize(["b.y"], ["k"], target=[-0.2], analysis="equilibrium", evaluations=1)
    assert "as evaluations= allows" in few.message
