"""Hertz's ellipse, Kalker's coefficients and Polach's creep force against tables, integrals and FASTSIM."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from flyball.forces.rolling_contact import (
    AXES,
    axes_ratio,
    elliptic_integrals,
    hertz,
    kalker_coefficients,
    kalker_table,
    linear_force,
    polach,
)

G, E_STAR = 8.2e10, 1.14e11
HERTZ = {30: (2.731, 0.493), 45: (1.926, 0.604), 60: (1.486, 0.717), 75: (1.202, 0.846), 90: (1.0, 1.0)}
"""Angle [deg] with cosine (B - A) / (A + B) -> Hertz's coefficients m and n (Timoshenko and Goodier, *Theory of
Elasticity*, 1951, article 126): semi-axes in units of (3 N / (4 E* (A + B)))^(1/3)."""


@pytest.mark.parametrize("angle", HERTZ)
def test_hertzs_table(angle):
    c = math.cos(math.radians(angle))
    a, b, N = hertz(1.0 - c, 1.0 + c, E_STAR, 1e-4)
    unit = (3.0 * N / (8.0 * E_STAR)) ** (1.0 / 3.0)
    assert (a / unit, b / unit) == pytest.approx(HERTZ[angle], abs=1.5e-3)
    across = hertz(1.0 + c, 1.0 - c, E_STAR, 1e-4)
    assert across == pytest.approx((b, a, N), rel=1e-12)


@pytest.mark.parametrize("ratio", [1.0, 0.9, 0.3, 0.05, 1e-3])
def test_the_ellipse_fulfils_the_exact_relation(ratio):
    def curvatures(g):
        m = 1.0 - g * g
        return (ellipk(m) - ellipe(m)) / (ellipe(m) / g**2 - ellipk(m)) - ratio

    g = 1.0 if ratio == 1.0 else brentq(curvatures, 1e-4, 1.0 - 1e-9, xtol=1e-14)
    assert axes_ratio(ratio) == pytest.approx(g, rel=1e-9)
    K, D = elliptic_integrals(g)
    assert pytest.approx(ellipk(1.0 - g * g), rel=1e-11) == K
    assert g == 1.0 or pytest.approx((ellipk(1 - g * g) - ellipe(1 - g * g)) / (1 - g * g), rel=1e-9) == D


def test_a_ball_on_a_plane():
    """4 / 3 E* sqrt(R) delta^1.5."""
    R, depth = 0.4, 2e-4
    a, b, N = hertz(0.5 / R, 0.5 / R, E_STAR, depth)
    assert (a, b) == pytest.approx((math.sqrt(R * depth),) * 2, rel=1e-9)
    assert pytest.approx(4.0 / 3.0 * E_STAR * math.sqrt(R) * depth**1.5, rel=1e-9) == N


def test_kalkers_table():
    table = np.array(kalker_table(0.25))
    for ratio, C in {
        0.1: (3.31, 2.52, 0.473),
        0.5: (3.62, 3.01, 0.929),
        1.0: (4.12, 3.67, 1.47),
        5.0: (7.78, 8.14, 6.63),
    }.items():
        assert kalker_coefficients(table, 0, ratio) == pytest.approx(C, rel=1e-12)
    for ratio in AXES:  # equal at Poisson's ratio 0 by symmetry
        C = kalker_coefficients(np.array(kalker_table(0.0)), 0, ratio)
        assert C[0] == pytest.approx(C[1], rel=1e-12)
    slender = kalker_coefficients(table, 0, 0.05)  # pi^2 / (4 (1 - nu)) and pi^2 / 4 in the limit
    assert slender[:2] == pytest.approx((math.pi**2 / 3.0, math.pi**2 / 4.0), rel=0.03)


def fastsim(limit, a, b, C, creepages, n=40):
    """Kalker's FASTSIM (Vehicle System Dynamics 11, 1982) with three flexibilities and a parabolic limit, on n strips."""
    sx, sy, phi = creepages
    lx, ly, ls = 8 * a / (3 * G * C[0]), 8 * a / (3 * G * C[1]), math.pi * a * math.sqrt(a / b) / (4 * G * C[2])
    total = np.zeros(2)
    for y in (np.arange(n) + 0.5) / n * 2.0 - 1.0:
        half = math.sqrt(1.0 - y * y)
        step, p = 2.0 * half * a / n, np.zeros(2)
        for k in range(n):
            x = half * a - (k + 0.5) * step
            p = p - step * np.array([sx / lx - phi * y * b / ls, sy / ly + phi * x / ls])
            bound = 2.0 * limit / (math.pi * a * b) * max(1.0 - (x - 0.5 * step) ** 2 / a**2 - y * y, 0.0)
            p *= min(1.0, bound / max(np.hypot(*p), 1e-30))
            total += p * step * 2.0 * b / n
    return total


@pytest.mark.parametrize("axes", [(6e-3, 6e-3), (7.5e-3, 2.5e-3), (3e-3, 6e-3)])
@pytest.mark.parametrize(
    "creep", [(1e-3, 0, 0), (0, 3e-3, 0), (2e-3, 1e-3, 0.1), (0, 0, 0.5), (0, -2e-3, 0.5), (1e-2, 0, 0)]
)
def test_polachs_force_is_near_fastsims(axes, creep):
    C, limit = kalker_coefficients(np.array(kalker_table(0.28)), 0, axes[0] / axes[1]), 3e4
    assert polach(G, limit, *axes, C, creep) == pytest.approx(fastsim(limit, *axes, C, creep), abs=0.06 * limit)


def test_polachs_force_has_kalkers_slope_and_the_friction_limit():
    a, b, limit = 6e-3, 4e-3, 3e4
    C = kalker_coefficients(np.array(kalker_table(0.28)), 0, a / b)
    for creep in ((1, 0, 0), (0, 1, 0), (0.6, -0.8, 0), (0.3, 0.4, 200.0)):
        small = tuple(1e-8 * x for x in creep)
        assert polach(G, limit, a, b, C, small) == pytest.approx(linear_force(G, a, b, C, small), rel=1e-6)
        large = polach(G, limit, a, b, C, tuple(10.0 * x for x in creep[:2]) + (0.0,))
        assert np.hypot(*large) == pytest.approx(limit, rel=1e-3)
