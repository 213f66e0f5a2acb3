"""Crossings that lie exactly on given values, and what they add up to; two sliders with laws of their own."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

layers = pytest.mark.parametrize("layer", ["absolute", "joint"])

SOFT = "-1*value - 0.1*(p - 0.4)*rate", "-4*value - 0.1*(p - 0.6)*rate"  # 1 and 2 rad/s, until 0.4 and 0.6
STIFF = "-1e6*value - 1e-3*(p - 0.4)*rate", "-1e-6*value - 1e-9*(p - 0.6)*rate"  # 1000 and 0.001 rad/s
THROUGH_ZERO = "-(p - 0.3)**2*value - 0.1*(p - 0.3)*rate", "-value + 0.1*(p - 0.6)*rate"  # pairs, at 0.3 and 0.6


def two(laws) -> fb.Mechanism:
    """Two sliders of 1 kg: x'' = law."""
    m = fb.Mechanism("two", planar=True, gravity=(0, 0), parameters={"p": 0.1})
    for k, law in enumerate(laws):
        m.add(fb.Body(f"body {k}", mass=1, inertia=1, position=(0, k)))
        m.add(fb.Translational(f"rail {k}", "ground", f"body {k}", at=(0, k), axis=(1, 0)))
        m.add(fb.Actuator(f"force {k}", f"rail {k}.displacement", force=law))
    return m


@layers
@pytest.mark.parametrize(("laws", "w"), [(SOFT, (1, 2)), (STIFF, (1e3, 1e-3))])
@pytest.mark.parametrize("values", [np.linspace(0, 1, 6), [0.3, 0.4, 0.6, 0.7], np.linspace(0.3, 0.7, 41), [0.6, 0.2]])
def test_a_crossing_on_a_given_value(laws, w, values, layer):
    """It lies where the damping is 0, however many values are so near to it that they count as on the axis."""
    locus = two(laws).root_locus("p", values, coordinates=layer)
    found = sorted(locus.crossings)
    assert [c.value for c in found] == pytest.approx([0.4, 0.6], rel=1e-9)  # eps / (0.5e-6), damping over stiffness
    assert [c.eigenvalue for c in found] == pytest.approx([1j * w[0], 1j * w[1]], rel=1e-9)
    assert {c.change for c in found} == {-2 if values[0] < values[-1] else 2}


def test_eigenvalues_that_stay_on_the_axis_cross_where_they_leave_it():
    """Damping -p below 0 and none from there on, up to 1; then 1 - p."""
    locus = two(("-value + max(-p, 0)*rate", "-4*value + max(p - 1, 0)*rate")).root_locus("p", [-0.7, 0.3, 0.5, 1.6])
    assert [c.value for c in locus.crossings] == pytest.approx([0.0, 1.0], abs=1e-6)
    assert [c.change for c in locus.crossings] == [-2, 2]


@layers
def test_a_pair_through_zero_counts_twice(layer):
    locus = two((THROUGH_ZERO[0], "-value")).root_locus("p", [0, 1], coordinates=layer)
    assert locus.unstable.tolist() == [2, 0]
    (only,) = locus.crossings
    assert (only.value, only.eigenvalue, only.kind, only.change) == (pytest.approx(0.3), 0j, "divergence", -2)


@pytest.mark.parametrize("laws", [SOFT, STIFF, THROUGH_ZERO, ("-p*value", "(p - 0.4)*value - rate")])
@pytest.mark.parametrize("values", [[1, 0], [0, 0.3], [0.3, 1], [0.4, 0.6], [0.35, 0.39], np.linspace(0, 1, 6)])
def test_changes_add_up_to_those_of_unstable(laws, values):
    locus = two(laws).root_locus("p", values)
    assert sum(c.change for c in locus.crossings) == locus.unstable[-1] - locus.unstable[0]
