"""Spectra against closed forms: sines, Parseval's theorem, white noise; and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import trapezoid

import flyball as fb
from flyball.results.spectrum import array_spectrum

HERTZ, SWING = 3.0, 0.2


@pytest.fixture(scope="module")
def rocker() -> fb.Result:
    """A hinge driven as 0.2 sin(2 pi 3 t) rad, for 4 s."""
    m = fb.Mechanism("rocker", planar=True, gravity=(0, 0))
    m.add(fb.Body("rod", mass=1, inertia=0.1), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Driver("motor", "A.angle", f"{SWING}*sin(2*pi*{HERTZ}*t)"))
    return m.simulate(4, outputs=401)


@pytest.mark.parametrize("window", ["hann", "boxcar", "blackmanharris", "flattop"])
def test_a_sine_has_its_amplitude_at_its_frequency(rocker, window):
    s = rocker.spectrum("A.angle", "A.rate", window=window)
    omega = 2.0 * np.pi * HERTZ
    for name, size in (("A.angle", SWING), ("A.rate", SWING * omega)):
        (f, a), *rest = s.peaks(name)
        assert f == pytest.approx(HERTZ, rel=1e-12)
        assert a == pytest.approx(size, rel=1e-6)
        assert rest == []
    assert s.units == ("rad", "rad/s")
    assert s.density_units == ("rad^2/Hz", "(rad/s)^2/Hz")
    np.testing.assert_allclose(s.frequency, np.arange(201) / 4.0, rtol=1e-12)


def test_parseval():
    """Half the sum of squared amplitudes, and the integral of the density, are the variance."""
    rng = np.random.default_rng(3)
    for n in (200, 201):
        x = rng.normal(size=(n + 1, 1)) + 5.0
        s = array_spectrum(("x",), ("m",), 0.01 * np.arange(n + 1), x, "boxcar", 0.01 * n)
        a = s.amplitude[:, 0] ** 2 / 2.0
        a[-1] *= 1.0 if n % 2 else 2.0  # half the sampling frequency
        variance = x[:n].var()
        assert a[1:].sum() == pytest.approx(variance, rel=1e-12)
        assert s.density.sum() * s.density_frequency[1] == pytest.approx(variance, rel=1e-12)
        assert s.mean == pytest.approx([x[:n].mean()])


@pytest.mark.parametrize("window", ["hann", "boxcar"])
def test_white_noise_has_a_level_density(window):
    """Of variance s^2 at the step h: 2 s^2 h."""
    h, size = 1e-3, 0.3
    x = size * np.random.default_rng(0).normal(size=(200_001, 1))
    s = array_spectrum(("x",), ("m/s",), h * np.arange(len(x)), x, window, 0.5)
    inside = s.density[2:-2, 0]
    assert inside.mean() == pytest.approx(2.0 * size**2 * h, rel=0.01)
    assert inside.std() < 0.1 * inside.mean()
    assert trapezoid(s.density[:, 0], s.density_frequency) == pytest.approx(size**2, rel=0.02)


def test_a_record_may_begin_after_a_transient_and_segments_are_chosen(rocker):
    s = rocker.spectrum("A.rate", start="2 s", segment="500 ms")
    assert (s.start, s.samples) == (2.0, 200)
    assert s.peaks("A.rate", 1)[0] == pytest.approx((HERTZ, SWING * 2 * np.pi * HERTZ), rel=1e-6)
    assert s.density_frequency[1] == pytest.approx(2.0)


def test_uneven_times_are_refused_and_can_be_interpolated(rocker):
    t = np.linspace(0, 2, 401) ** 2
    uneven = rocker.model.simulate(4, outputs=t.tolist())
    with pytest.raises(fb.AnalysisError, match=r"not evenly spaced \(steps from .* outputs=401\)"):
        uneven.spectrum("A.angle")
    s = uneven.spectrum("A.angle", outputs=401)
    assert s.peaks("A.angle", 1)[0] == pytest.approx((HERTZ, SWING), rel=1e-4)
    assert "resampled by cubic splines" in repr(s)


@pytest.mark.parametrize(
    ("names", "options", "message"),
    [
        ((), {}, "name at least one curve"),
        (("A.rat",), {}, r"has no curve 'A?\.?rat'.*did you mean 'rate'"),
        (("A.force",), {}, "has 2 components"),
        (("A.rate", "A.rate"), {}, "'A.rate' is named twice"),
        (("A.rate",), {"window": "hannn"}, "'hannn' is no window of scipy.signal"),
        (("A.rate",), {"window": "kaiser"}, "without parameters"),
        (("A.rate",), {"start": 4}, r"start=4 s is not in the motion, which has 0 to 4 s"),
        (("A.rate",), {"segment": 5}, r"segment=5 must be between 0.08 s \(8 steps\) and 4 s"),
        (("A.rate",), {"outputs": 2}, "outputs must be at least 9"),
    ],
)
def test_what_is_refused(rocker, names, options, message):
    with pytest.raises(fb.ModelError, match=message):
        rocker.spectrum(*names, **options)


def test_too_few_times_are_refused(rocker):
    with pytest.raises(fb.AnalysisError, match="3 output times are too few"):
        rocker.model.simulate(1, outputs=3).spectrum("A.rate")
