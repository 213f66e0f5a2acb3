"""Laws of forces over time: all output times at once where a law takes arrays, and number by number where not."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.laws.interval_evaluation import takes_arrays

T = np.linspace(0.0, 1.0, 41)
LAWS = {
    "50*sin(3*t)*value + min(rate, 2) - max(value, k/4)": lambda t, x, v: (
        50 * np.sin(3 * t) * x + np.minimum(v, 2) - np.maximum(x, 0.75)
    ),
    "-k*abs(value)**1.5*sign(value)": lambda t, x, v: -3 * np.abs(x) ** 1.5 * np.sign(x),
    "-(k**2)*value + exp(-t)*sqrt(1 + value**2)/(2 + t)": lambda t, x, v: (
        -9 * x + np.exp(-t) * np.sqrt(1 + x**2) / (2 + t)
    ),
    "step(t, 0.2, 0, 0.6, 5) + atan2(rate, 1 + value)": lambda t, x, v: (
        5 * (s := np.clip((t - 0.2) / 0.4, 0, 1)) ** 2 * (3 - 2 * s) + np.arctan2(v, 1 + x)
    ),
    "k": lambda t, x, v: 3.0 + 0.0 * t,
    "far**2 - 1": lambda t, x, v: (x + 0.2) ** 2 - 1,
}


def sliding(force):
    """A slide with a given force."""
    m = fb.Mechanism("slide", planar=True, gravity=(0, 0), parameters={"k": 3.0})
    m.add(fb.Body("b", mass=1, inertia=1, position=(0.2, 0)), fb.Prismatic("s", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.Sensor("far", "b.x"), fb.Actuator("a", "s.displacement", force=force))
    return m


@pytest.mark.parametrize("text", LAWS)
def test_at_once(text):
    r = sliding(text).simulate(1.0, outputs=T)
    S = r.values.system
    assert takes_arrays(S.code, int(S.forces.laws[0, 0]))
    np.testing.assert_allclose(r["a"].force, LAWS[text](T, r["s"].displacement, r["s"].displacement_rate), rtol=1e-13)


def test_on_the_sides_of_a_corner_and_while_sliding_on_it():
    """Dry friction by the sign of the rate, pulled until it breaks loose: what holds it is what pulls, up to 1 N."""
    m = sliding("-sign(rate)")
    m.add(fb.Actuator("pull", "s.displacement", force="3*t"))
    r = m.simulate(1.0, outputs=T)
    late = T > 0.35
    np.testing.assert_allclose(r["a"].force[late], -1.0)
    v = np.where(late, 1.5 * T**2 - T + 1 / 6, 0.0)
    np.testing.assert_allclose(r["s"].displacement_rate[late], v[late], atol=1e-6)


def test_tables_at_once_and_functions_number_by_number():
    m = sliding("k")
    m.add(fb.Table("push", x=[0.0, 0.5, 1.0], y=[0.0, 1.0, 4.0], interpolation="linear"))
    m.add(fb.Actuator("c", "s.displacement", force="2*push(t)"))
    m.add(fb.Actuator("f", "s.displacement", force=lambda t, value: 2 * t + value))
    r = m.simulate(1.0, outputs=T)
    S = r.values.system
    assert [takes_arrays(S.code, int(at)) for at in S.forces.laws[:, 0]] == [True, True, False]
    np.testing.assert_allclose(r["f"].force, 2 * T + r["s"].displacement, atol=1e-12)
    np.testing.assert_allclose(r["c"].force, 2 * np.interp(T, [0, 0.5, 1], [0, 1, 4]), atol=1e-12)
