"""What guards depend on, between the ends of a step, without evaluating the equations there.

Measured quantities are the polynomials of degree five through their values, rates and accelerations at the ends. In a
step so short that values differ by rounding, rates are cubics and values the integrals of these. What has no known rate
(multipliers, loads) is the polynomial through the ends and what late stages of the step have seen.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from .watching import BRIEF


@formula
def expect(W, x, h):
    """What is measured at a part x of the step, and its rates, to W.sensed; multipliers to W.lam."""
    n = W.moving.shape[2]
    for m in range(n):
        value, rate = quintic(W.moving, m, x, h, W.count[BRIEF] == 1)
        W.sensed[0, m], W.sensed[1, m], W.sensed[0, n + m] = value, rate, rate
    rows = W.rows.shape[0]
    count = W.places.shape[0]
    for m in range(W.levels.shape[1]):
        put(W, m, rows, 0.0)
    for j in range(count):
        w = 1.0
        for k in range(count):
            if k != j:
                w *= (x - W.places[k]) / (W.places[j] - W.places[k])
        for m in range(W.levels.shape[1]):
            put(W, m, rows, got(W, m, rows) + w * W.levels[j, m])


@formula
def put(W, m, rows, x):
    """Write what has no known rate to where guards look for it."""
    if m < rows:
        W.lam[W.rows[m]] = x
    else:
        W.sensed[W.spots[m - rows, 0], W.spots[m - rows, 1]] = x


@formula
def got(W, m, rows):
    """What stands there."""
    return W.lam[W.rows[m]] if m < rows else W.sensed[W.spots[m - rows, 0], W.spots[m - rows, 1]]


@formula
def quintic(ends, m, x, h, brief):
    """Value and rate at a part x of the step of what has values, rates and accelerations ``ends[end, :, m]``."""
    f, u, a = ends[0, 0, m], h * ends[0, 1, m], h * h * ends[0, 2, m]
    change = ends[1, 0, m] - f
    if brief or (f == 0.0 and ends[1, 0, m] == 0.0):  # the integral of the rate's own cubic; some are rates of nothing
        change = 0.5 * (u + h * ends[1, 1, m]) + (a - h * h * ends[1, 2, m]) / 12.0
    d0 = change - u - 0.5 * a
    d1 = h * ends[1, 1, m] - u - a
    d2 = h * h * ends[1, 2, m] - a
    c3 = 10.0 * d0 - 4.0 * d1 + 0.5 * d2
    c4 = -15.0 * d0 + 7.0 * d1 - d2
    c5 = 6.0 * d0 - 3.0 * d1 + 0.5 * d2
    value = f + x * (u + x * (0.5 * a + x * (c3 + x * (c4 + x * c5))))
    return value, (u + x * (a + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))) / h
