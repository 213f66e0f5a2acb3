"""A block that rocks on its corners (Housner 1963)."""

import numpy as np
import pytest

import flyball as fb

from .contact_scenes import G, floor, stepped

B, H = 0.1, 0.3  # half of its width and height
R, ALPHA = np.hypot(B, H), np.arctan2(B, H)
P = np.sqrt(3 * G / (4 * R))  # Housner's p: J about a corner is 4/3 m R^2


def block(tilt, planar):
    """It stands on one corner, tilted; friction keeps the corner."""
    m = floor(planar=planar, friction=2.0)
    shape = fb.Box(edges=(2 * B, 2 * H, 0.2) if planar else (2 * B, 0.4, 2 * H))
    x, z = -B + R * np.sin(ALPHA - tilt), R * np.cos(ALPHA - tilt)
    if planar:
        m.add(fb.Body("block", shape=shape, mass=10, position=(x, z), angle=tilt))
    else:
        m.add(fb.Body("block", shape=shape, mass=10, position=(x, 0, z), orientation=(0, -tilt, 0)))
    return m


def exact_fall(tilt):
    """Time from rest at ``tilt`` to upright, by energy: p t = int d phi / sqrt(2 (cos(alpha - tilt) - cos(alpha - phi)))."""
    from scipy.integrate import quad

    def f(s):  # phi = tilt - s^2 takes the root at the start away
        phi = tilt - s * s
        return 2 * s / np.sqrt(2 * (np.cos(ALPHA - tilt) - np.cos(ALPHA - phi)))

    return quad(f, 1e-9, np.sqrt(tilt))[0] / P


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("part", [0.3, 0.6])
def test_time_to_the_blow_and_what_it_takes(planar, part):
    """First order in the step: a quarter of the period; at the blow the rate falls to 1 - 3/2 sin^2 alpha of itself."""
    tilt = part * ALPHA
    fall, times, ratios = exact_fall(tilt), [], []
    for step in (2e-3, 5e-4):
        n = round(1.5 * fall / step)
        run = stepped(block(tilt, planar), n * step, step, outputs=n + 1)
        w = np.abs(run["block"].angular_velocity if planar else run["block"].angular_velocity[:, 1])
        times.append(run.t[np.flatnonzero(np.diff(w) < -0.05 * w.max())[0]] - fall)
        upright = 10 * G * H
        ratios.append(np.sqrt((run.energy.total[-1] - upright) / (run.energy.total[0] - upright)))
        assert run.health.contact.worst_overlap < 0.1 * step**2
    assert np.abs(times) == pytest.approx([0, 0], abs=2e-3)
    assert abs(times[1]) <= 5e-4
    exact = 1 - 1.5 * np.sin(ALPHA) ** 2
    assert ratios[1] == pytest.approx(exact, abs=5e-3)
    assert abs(ratios[1] - exact) < 0.5 * abs(ratios[0] - exact)
