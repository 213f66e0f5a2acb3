"""Root loci over a gain of a controller in the loop: Routh's conditions."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.control.slide import pendulum, slide


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_a_pi_on_a_mass_on_a_spring(coordinates):
    """s^3 + 2 s^2 + 15 s + ki is stable up to ki = 30, where it sways with sqrt(15) rad/s."""
    pid = fb.PID("pid", setpoint="r", measured="A.displacement", kp=5, ki="ki")
    m = slide(pid, ki=1.0, r=0.0)
    locus = m.root_locus("ki", np.linspace(1, 50, 8), coordinates=coordinates)
    (only,) = locus.crossings
    assert only.value == pytest.approx(30, rel=1e-10)
    assert (only.kind, only.change) == ("flutter", 2)
    assert only.eigenvalue == pytest.approx(1j * np.sqrt(15), rel=1e-10)
    for ki, w in zip(locus.values, locus.eigenvalues, strict=True):
        assert np.sort_complex(w) == pytest.approx(np.sort_complex(np.roots([1, 2, 15, ki])), rel=1e-9)


def test_where_it_rests():
    """A pendulum held at r by a PID: the integral carries the weight at every value; s^3 limits the gain again."""
    locus = pendulum(400).root_locus("r", np.linspace(0.1, 3.0, 6), equilibrium=True)
    for r, w in zip(locus.values, locus.eigenvalues, strict=True):
        k = 60 + 9.81 * np.cos(r)
        p = np.polyadd(np.polymul([0.05, 1], [0.6, 0, k, 400]), [20, 0, 0])
        assert np.sort_complex(w) == pytest.approx(np.sort_complex(np.roots(p)), rel=1e-8)
    assert not locus.crossings


def test_what_is_refused():
    pid = fb.PID("pid", setpoint="r", measured="A.displacement", kp=5, ki="ki")
    with pytest.raises(fb.NotConverged, match=r"'pid\.integral' changes by 0\.5 in a second"):
        slide(pid, ki=1.0, r=0.5).root_locus("ki", [1, 2])
