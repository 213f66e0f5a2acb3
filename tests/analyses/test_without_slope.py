"""Laws whose linear part is 0: no coefficient comes of the step that slopes are found with."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

layers = pytest.mark.parametrize("layer", ["absolute", "joint"])
pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def slider(force, **options) -> fb.Mechanism:
    """2 kg on a rail."""
    m = fb.Mechanism("slider", planar=True, **options)
    m.add(fb.Body("body", mass=2, inertia=0.1, position=(0, 0)))
    m.add(fb.Translational("rail", "ground", "body", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("force", "rail.displacement", force=force))
    return m


@layers
@pytest.mark.parametrize("law", ["-value**3", "value**3", "-rate**3", "1e6*value**3 - 1e9*rate**5", "value*rate**2"])
def test_a_cube_is_no_stiffness(law, layer):
    m = slider(law)
    assert m.modes(coordinates=layer).kinds == ("rigid",)
    linear = m.linearize(["force"], ["rail.displacement"], coordinates=layer)
    assert np.array_equal(linear.A, [[0, 1], [0, 0]])
    assert np.array_equal(linear.B, [[0], [0.5]])


@layers
def test_at_the_value_where_the_linear_part_is_none(layer):
    m = slider("k*value - value**3", parameters={"k": 0.0})
    locus = m.root_locus("k", [-1, 0, 1], coordinates=layer)
    assert locus.unstable.tolist() == [0, 0, 1]
    assert locus.eigenvalues[1].tolist() == [0, 0]
    assert sum(c.change for c in locus.crossings) == 1


@layers
def test_a_small_slope_is_one(layer):
    """k = 1e-30 N/m is a stiffness, however small."""
    A = slider("-1e-30*value").linearize(coordinates=layer).A
    assert pytest.approx(np.array([[0, 1], [-5e-31, 0]]), rel=1e-12, abs=0) == A


@pytest.mark.parametrize("values", [[1j, 2], np.array([1j, 2]), np.array([1 + 0j])])
@pytest.mark.parametrize("analysis", ["root_locus", "equilibria"])
def test_values_are_real(analysis, values):
    with pytest.raises(fb.ModelError, match="values are finite numbers"):
        getattr(slider("-k*value", parameters={"k": 1.0}), analysis)("k", values)


@pytest.mark.parametrize("analysis", ["root_locus", "equilibria"])
def test_what_is_varied_is_not_given_as_well(analysis):
    ask = getattr(slider("-k*value", parameters={"k": 1.0}), analysis)
    with pytest.raises(fb.ModelError, match="'k' takes all its values, so parameters cannot fix it at 7"):
        ask("k", [1, 2], parameters={"k": 7})
    with pytest.raises(fb.ModelError, match="'t' takes all its values, so t cannot fix it at 5"):
        ask("t", [1, 2], t=5)
