"""Projection on the cone of Coulomb friction, and on the cone with rolling and spinning friction."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt


@formula
def project_on_cone(mu, n, s, t):
    """Project (n, s, t) on the cone |(s, t)| <= mu n."""
    r = sqrt(s * s + t * t)
    if r <= mu * n:
        return n, s, t
    if mu * r <= -n:
        return 0.0, 0.0, 0.0
    near = (n + mu * r) / (1.0 + mu * mu)
    a = mu * near / r
    return near, a * s, a * t


@formula
def fraction_within(n, bound, r):
    """Factor that reduces a length r to at most bound * n."""
    return 1.0 if r <= bound * n else bound * n / r


@formula
def rolling_cone_normal(mu, rho, sigma, n, r, q, w):
    """Return the normal component of the projection on r' <= mu n', q' <= rho n', w' <= sigma n'; r, q, w >= 0.

    It is the root of n' - n - sum m max(0, x - m n') over the three, a concave increasing function, so Newton's method
    from the left ends at it after at most one step per corner.
    """
    if n + mu * r + rho * q + sigma * w <= 0.0:
        return 0.0
    near = n if n > 0.0 else 0.0
    for _ in range(4):
        up, down = n, 1.0
        if r > mu * near:
            up, down = up + mu * r, down + mu * mu
        if q > rho * near:
            up, down = up + rho * q, down + rho * rho
        if w > sigma * near:
            up, down = up + sigma * w, down + sigma * sigma
        near = up / down
    return near


@formula
def project_on_rolling_cone(mu, rho, sigma, least, p, q):
    """Project on the cone with rolling and spinning friction.

    Parameters
    ----------
    mu, rho, sigma : float
        Friction, rolling and spinning: |p_t| <= mu p_n, |q_t| <= rho p_n, |q_n| <= sigma p_n.
    least : float
        Lower bound of p_n.
    p, q : tuple
        Impulse and torque, in the same unit: normal, two tangential.
    """
    r, a, w = sqrt(p[1] * p[1] + p[2] * p[2]), sqrt(q[1] * q[1] + q[2] * q[2]), abs(q[0])
    n = max(rolling_cone_normal(mu, rho, sigma, p[0], r, a, w), least)
    x, y, z = fraction_within(n, mu, r), fraction_within(n, rho, a), fraction_within(n, sigma, w)
    return (n, x * p[1], x * p[2]), (z * q[0], y * q[1], y * q[2])


@formula
def least_normal_impulse(P, c):
    """Lower bound of the normal impulse of contact c."""
    return P.least[c] if P.least.shape[0] > 0 else 0.0


@formula
def project_on_cone_above(mu, least, n, s, t):
    """Project (n, s, t) on the part of the cone with a normal component of at least ``least``."""
    near, a, b = project_on_cone(mu, n, s, t)
    if not near < least:  # nan stays nan
        return near, a, b
    part = fraction_within(least, mu, sqrt(s * s + t * t))
    return least, part * s, part * t
