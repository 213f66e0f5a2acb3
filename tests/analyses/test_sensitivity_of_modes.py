"""Derivatives of eigenvalues that are near each other, equal, or without all their eigenvectors."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.analyses.made import G


def carts(k1: float, k2: float, coupling: float = 0.0, damping: float = 0.0) -> fb.Mechanism:
    """Two carts of 1 kg on rails, each on a spring, pulled together by a force along their difference."""
    m = fb.Mechanism("carts", planar=True, parameters={"k1": k1, "k2": k2, "mass": 1.0, "c": damping})
    for y, name in enumerate("ab"):
        m.add(fb.Body(name, mass="mass", inertia=1, position=(1, y)))
        m.add(fb.Translational(f"rail {name}", "ground", name, at=(1, y), axis=(1, 0)))
        m.add(
            fb.SpringDamper(
                f"spring {name}", "ground", name, at=((0, y), (1, y)), stiffness=f"k{y + 1}", damping="c" if y else 0
            )
        )
    m.add(fb.Sensor("xa", "rail a.displacement"), fb.Sensor("xb", "rail b.displacement"))
    m.add(fb.PointForce("on a", "a", force=(f"{coupling}*(xb - xa)", 0)))
    m.add(fb.PointForce("on b", "b", force=(f"{coupling}*(xa - xb)", 0)))
    return m


def swinging(found: fb.Sensitivity, by: str) -> np.ndarray:
    """Derivatives of the frequencies, the lowest first."""
    upper = found.values[0].imag > 0
    order = np.argsort(found.values[0].imag[upper])
    return found.derivatives[0, upper, found.to.index(by)][order].imag


@pytest.mark.parametrize("apart", [1e-2, 1e-5])
def test_oscillators_that_do_not_know_of_each_other(apart):
    """w = sqrt(k / m): each depends on its own spring alone, however near the other is."""
    found = carts(100.0, 100.0 + apart).sensitivity(to=["k1", "k2"], analysis="modes")
    assert swinging(found, "k1") == pytest.approx([0.05, 0], abs=1e-8)
    assert swinging(found, "k2") == pytest.approx([0, 0.5 / np.sqrt(100.0 + apart)], abs=1e-8)


def test_equal_ones_part_as_the_perturbation_says():
    found = carts(100.0, 100.0).sensitivity(to=["k1", "mass"], analysis="modes")
    assert np.sort(swinging(found, "k1")) == pytest.approx([0, 0.05], abs=1e-8)
    assert swinging(found, "mass") == pytest.approx([-5, -5], rel=1e-8)


def test_frequencies_that_veer():
    """Against the derivatives of the closed form, w^2 = eigenvalues of [k1 + c, -c; -c, k2 + c]."""
    c, k1, k2 = 0.02, 100.0, 100.01
    found = carts(k1, k2, c).sensitivity(to=["k1"], analysis="modes")
    d = np.hypot(k2 - k1, 2 * c)
    square = (k1 + k2 + 2 * c) / 2 + np.array([-d, d]) / 2
    by_k1 = 0.5 + np.array([1, -1]) * (k2 - k1) / (2 * d)
    assert swinging(found, "k1") == pytest.approx(by_k1 / (2 * np.sqrt(square)), rel=1e-8)


def test_critical_damping_has_no_derivative():
    with pytest.raises(fb.SingularityError, match=r"-10\+0j 1/s is 2-fold .* no derivative with respect to 'k2'"):
        carts(50.0, 100.0, damping=20.0).sensitivity(to=["k2"], analysis="modes")


def test_what_moves_away_as_a_whole_keeps_its_zeros():
    """Two masses and a spring, w^2 = k (1/M + 1), beside a third mass that nothing holds."""
    m = fb.Mechanism("free", planar=True, parameters={"k": 1.0, "M": 2.0})
    for name, x, mass in (("a", 0, "M"), ("b", 1, 1.0)):
        m.add(fb.Body(name, mass=mass, inertia=1, position=(x, 0)))
        m.add(fb.Translational(f"rail {name}", "ground", name, at=(x, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("spring", "a", "b", at=((0, 0), (1, 0)), stiffness="k"))
    m.add(fb.Body("c", mass=1, inertia=1, position=(0, 3)))
    m.add(fb.Translational("rail c", "ground", "c", at=(0, 3), axis=(1, 0)))
    found = m.sensitivity(to=["k", "M"], analysis="modes")
    found.derivatives, found.values = found.derivatives[:, 2:], found.values[:, 2:]
    assert np.abs(found.derivatives[0, :2]).max() < 1e-12
    w = np.sqrt(1.5)
    assert np.abs(found.derivatives[0, 2:, 0].imag) == pytest.approx(1.5 / (2 * w), rel=1e-8)
    assert np.abs(found.derivatives[0, 2:, 1].imag) == pytest.approx(1 / 4 / (2 * w), rel=1e-8)


def test_a_place_is_counted_from_anywhere():
    """A small pendulum on a spring, drawn far away: its eigenvalues change with its place there as they do here."""

    def found(shift: float) -> fb.Sensitivity:
        m = fb.Mechanism("pendulum", planar=True, gravity=(0, -G), parameters={"x0": 0.1 + shift})
        m.add(fb.Body("rod", mass=1, inertia=0.01 / 12, position=("x0", "-0.05")))
        m.add(fb.Revolute("A", "ground", "rod", at=("x0", 0)))
        ends = ((shift, 0.0), ("x0+0.02", "-0.05"))
        m.add(fb.SpringDamper("s", "ground", "rod", at=ends, stiffness=10, length=0.3))
        return m.sensitivity(to=["x0"], analysis="modes", about="equilibrium", verify=True)

    here, there = found(0.0), found(500.0)
    assert here.difference < 1e-5
    assert there.derivatives == pytest.approx(here.derivatives, rel=1e-6, abs=1e-9)


def test_critical_damping_is_told_apart_from_what_moves_away():
    m = carts(50.0, 100.0, damping=20.0)
    m.add(fb.Body("free", mass=1, inertia=1, position=(0, 3)))
    m.add(fb.Translational("rail", "ground", "free", at=(0, 3), axis=(1, 0)))
    with pytest.raises(fb.SingularityError, match="no derivative with respect to 'k2'"):
        m.sensitivity(to=["k2"], analysis="modes")


def test_what_is_balanced_for_one_value_only_is_told():
    """A rod that a spring of one stiffness alone holds level."""
    m = fb.Mechanism("rod", planar=True, gravity=(0, -G), parameters={"k": 20.0})
    m.add(fb.Body("rod", mass=2, inertia=1, position=(0.5, 0)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.TorsionalSpringDamper("spring", joint="A", stiffness="k", angle=0.5 * 2 * G / 20))
    with pytest.raises(fb.AnalysisError, match=r"to the side of 'k' = 20, the mechanism is not in equilibrium"):
        m.sensitivity(analysis="modes")
