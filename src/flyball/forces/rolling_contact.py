"""Elastic rolling contact of two bodies of one material: Hertz's ellipse, Kalker's coefficients, Polach's creep forces.

In the contact plane x is the rolling direction, y is across it, and z = x × y. The gap of the undeformed surfaces is
``A x^2 + B y^2``. Creepages are slip velocities of the first body relative to the second, divided by the rolling speed:
``sx`` and ``sy`` of its contact point, and the spin ``phi`` [1/m] about z. Forces act on the first body.

References
----------
H. Hertz, *Über die Berührung fester elastischer Körper*, J. reine angew. Math. 92, 1882; in the form of K. L. Johnson,
*Contact Mechanics*, 1985, equations 4.24 to 4.28. J. J. Kalker, *Three-Dimensional Elastic Bodies in Rolling Contact*,
1990, table E3. O. Polach, *A fast wheel-rail forces calculation computer code*, Vehicle System Dynamics 33 (suppl.),
1999, pages 728 to 739.
"""

from __future__ import annotations

import math

import numpy as np

from ..compiler.formulas import formula
from ..math.scalar import atan, choose, exp, log, maximum, minimum, sqrt
from ..math.spline import complex_cubic, pack_spline, spline

AGM_STEPS = 5  # of the arithmetic-geometric mean: exact to rounding for ellipses up to 1 : 100
RATIO_STEPS = 2  # of Newton's method for the ratio of the axes: exact to 1e-9 from the fit
RATIO_FIT = (0.66697, -5.880e-4, -3.2725e-3, 4.4619e-4, -1.9016e-5)
"""Coefficients of ln(b/a) / ln(A/B) over powers of -ln(A/B), to 0.4 % of b/a; a fit to the exact relation."""
NEARLY_ROUND = 1e-6  # square of the modulus below which the slope of the ratio is that of a circle
CIRCLE = 3.0 * math.pi / 16.0
LEAST_RATIO = 1e-4  # of the curvatures A and B, or B and A: a longer ellipse is computed as this one
SMALLEST = 1e-30  # added to squares whose root is taken

AXES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
"""Ratios of the smaller semi-axis to the larger one in Kalker's table."""
POISSON = (0.0, 0.25, 0.5)
"""Poisson's ratios in Kalker's table."""
KALKER = {
    "C11": (
        "2.51 2.59 2.68 2.78 2.88 2.98 3.09 3.19 3.29 3.4 3.51 3.65 3.82 4.06 4.37 4.84 5.57 6.96 10.7",
        "3.31 3.37 3.44 3.53 3.62 3.72 3.81 3.91 4.01 4.12 4.22 4.36 4.54 4.78 5.1 5.57 6.34 7.78 11.7",
        "4.85 4.81 4.8 4.82 4.83 4.91 4.97 5.05 5.12 5.2 5.3 5.42 5.58 5.8 6.11 6.57 7.34 8.82 12.9",
    ),
    "C22": (
        "2.51 2.59 2.68 2.78 2.88 2.98 3.09 3.19 3.29 3.4 3.51 3.65 3.82 4.06 4.37 4.84 5.57 6.96 10.7",
        "2.52 2.63 2.75 2.88 3.01 3.14 3.28 3.41 3.54 3.67 3.81 3.99 4.21 4.5 4.9 5.48 6.4 8.14 12.8",
        "2.53 2.66 2.81 2.98 3.14 3.31 3.48 3.65 3.82 3.98 4.16 4.39 4.67 5.04 5.56 6.31 7.51 9.79 16",
    ),
    "C23": (
        "0.334 0.483 0.607 0.72 0.827 0.93 1.03 1.13 1.23 1.33 1.44 1.58 1.76 2.01 2.35 2.88 3.79 5.72 12.2",
        "0.473 0.603 0.715 0.823 0.929 1.03 1.14 1.25 1.36 1.47 1.59 1.75 1.95 2.23 2.62 3.24 4.32 6.63 14.6",
        "0.731 0.809 0.889 0.977 1.07 1.18 1.29 1.4 1.51 1.63 1.77 1.94 2.18 2.5 2.96 3.7 5.01 7.89 18",
    ),
}
"""Kalker's coefficients for each of `POISSON`, at a/b = 0.1 ... 1 and then b/a = 0.9 ... 0.1."""


@formula
def elliptic_integrals(g):
    """Return K and D = (K - E) / m of the parameter m = 1 - g^2, by the arithmetic-geometric mean.

    g is a ratio of semi-axes, 0 < g <= 1. K - E has no cancellation in this form (M. Abramowitz and I. A. Stegun,
    *Handbook of Mathematical Functions*, 1964, 17.6).
    """
    m = 1.0 - g * g
    a, b = 0.5 * (1.0 + g), sqrt(g)
    c = 0.25 * (1.0 - g) / (1.0 + g)  # square of the half difference, divided by m
    total, weight = 0.5 + c, 1.0
    for _ in range(AGM_STEPS - 1):
        a, b = 0.5 * (a + b), sqrt(a * b)
        c = c * c * m / (16.0 * a * a)
        weight = 2.0 * weight
        total = total + weight * c
    K = 0.5 * math.pi / a
    return K, K * total


@formula
def axes_ratio(curvatures):
    """Return the ratio g <= 1 of the semi-axes of Hertz's ellipse for the ratio A / B <= 1 of the curvatures.

    Newton's method for g^2 D / (K - D) = A / B.
    """
    x = -log(curvatures)
    c = RATIO_FIT
    g = minimum(exp(-x * (c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * c[4]))))), 1.0 + 0.0 * x)
    for _ in range(RATIO_STEPS):
        K, D = elliptic_integrals(g)
        m = 1.0 - g * g
        round_ = choose(m - NEARLY_ROUND, 0.0 * m, 1.0 + 0.0 * m)
        x = (1.0 - round_) * (K - D - g * g * D) / (m + round_) + round_ * CIRCLE
        slope = 3.0 - x * (1.0 / D + 1.0 / (K - D))
        g = g * (1.0 - (1.0 - curvatures * (K - D) / (g * g * D)) / slope)
    return g


@formula
def hertz(A, B, modulus, depth):
    """Return the semi-axes a along x and b along y of the contact ellipse [m], and the normal force [N].

    Parameters
    ----------
    A, B : number [1/m]
        Half the sums of the curvatures of both bodies along x and y, greater than zero.
    modulus : number [Pa]
        E*, with 1 / E* = (1 - nu_1^2) / E_1 + (1 - nu_2^2) / E_2.
    depth : number [m]
        Approach of the bodies, greater than zero.
    """
    small, large = minimum(A, B), maximum(A, B)
    g = axes_ratio(maximum(small / large, LEAST_RATIO + 0.0 * A))
    K, D = elliptic_integrals(g)
    major = sqrt(depth * D / (small * K))
    minor = g * major
    along = B - A
    return choose(along, major, minor), choose(along, minor, major), 2.0 * math.pi / 3.0 * major * depth * modulus / K


@formula
def kalker_coefficients(data, at, ratio):
    """Return C11, C22 and C23 for a ratio a / b, from the table at ``data[at]`` (`kalker_table`)."""
    x = log(ratio)
    width = KALKER_WIDTH
    return (
        exp(spline(data, at, x)[0]),
        exp(spline(data, at + width, x)[0]),
        exp(spline(data, at + 2 * width, x)[0]),
    )


@formula
def linear_force(stiffness, a, b, C, creepages):
    """Return Kalker's linear creep force along x and y [N]; ``stiffness`` is the shear modulus [Pa]."""
    sx, sy, phi = creepages
    k = stiffness * a * b
    return -k * C[0] * sx, -k * (C[1] * sy + sqrt(a * b) * C[2] * phi)


@formula
def polach(stiffness, limit, a, b, C, creepages):
    """Return Polach's creep force along x and y [N].

    Its slope at zero creepage is Kalker's linear theory in every direction: the creepages are weighted by their
    coefficients before their direction is taken, where the published form weights their magnitude only. Creep along x
    or y alone gives the published values. The force from spin vanishes for large creep.

    Parameters
    ----------
    stiffness : number [Pa]
        Shear modulus G.
    limit : number [N]
        Friction limit: coefficient of friction times normal force.
    a, b : number [m]
        Semi-axes.
    C : tuple
        Kalker's C11, C22 and C23.
    creepages : tuple
        sx, sy, and the spin phi [1/m].
    """
    sx, sy, phi = creepages
    spun = sy + phi * a
    across = choose(spun * spun - sy * sy, spun, sy)
    k = 0.25 * math.pi * stiffness * a * b / limit
    square = k * k * (C[0] * C[0] * sx * sx + C[1] * C[1] * across * across) + SMALLEST
    size = sqrt(square)
    creep = -2.0 / math.pi * limit * k * (1.0 / (1.0 + square) + atan(size) / size)
    mean = sqrt(a * b)
    shape = 1.0 + 6.3 * (1.0 - exp(-a / b))
    e = 8.0 / 3.0 * stiffness * b * mean * C[2] / (shape * limit)
    e2 = e * e * (sx * sx + across * across)
    d = (e2 - 1.0) / (e2 + 1.0)
    fading = 1.5 * (0.5 * d * d - d * d * d / 3.0 - 1.0 / 6.0) + 4.0 * e2 / ((1.0 + e2) * (1.0 + e2) * (1.0 + e2))
    return creep * C[0] * sx, creep * C[1] * sy - stiffness * a * b * mean * C[2] * phi * fading


def kalker_table(poisson: float | complex) -> list[float]:
    """Return the logarithms of Kalker's coefficients over that of a/b as three splines of `KALKER_WIDTH` numbers.

    Between Poisson's ratios of the table: the parabola through them. Beyond axes of 1 : 10: a power of a/b.
    """
    weights = [math.prod((poisson - q) / (p - q) for q in POISSON if q != p) for p in POISSON]
    ratios = np.log(np.array([*AXES, *(1.0 / x for x in AXES[-2::-1])]))
    out: list[float] = []
    for table in KALKER.values():
        out += packed_cubic(ratios, np.log(np.array(weights) @ np.array([row.split() for row in table], float)))
    return out


def packed_cubic(x: np.ndarray, y: np.ndarray) -> list[float]:
    """Return the C2 spline through four or more points, straight beyond its ends; numbers may be complex."""
    pieces = complex_cubic(x, y, False)
    if np.iscomplexobj(x) or np.iscomplexobj(y):
        real = pack_spline(x.real, y.real, pieces.real, "line")
        return (real + 1j * np.imag(pack_spline(x, y, pieces, "line"))).tolist()  # type: ignore[no-any-return]
    return pack_spline(x, y, pieces.real, "line").tolist()  # type: ignore[no-any-return]


KALKER_WIDTH = len(kalker_table(0.25)) // 3
