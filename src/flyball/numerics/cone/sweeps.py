"""One visit of a contact in a sweep of Gauss-Seidel, for each kind of contact as `pack` laid it out.

Each returns the largest change of a velocity that its new impulse made [m/s]. The law is Coulomb's: the normal impulse
first, then the tangential one within mu times that. In the convex form (``coulomb`` 0) the impulse is the point of the
cone nearest to a step, in the metric of the diagonal block.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .pack import (
    ARM1,
    ARM2,
    B_BIAS,
    B_IN,
    B_IT,
    B_LEAST,
    B_MU,
    B_P,
    B_RATIO,
    B_SOFT,
    B_T,
    BIAS,
    C1,
    C2,
    G1,
    G2,
    IMPULSE,
    IN,
    ISS,
    IST,
    ITT,
    LEAST,
    MU,
    NS,
    NT,
    R1,
    R2,
    RATIO,
    S_BIAS,
    S_IN,
    S_LEAST,
    S_P,
    S_SOFT,
    SLIDE,
    SLOW,
    SOFT,
    change_balls,
)


@formula
def limited(n, r, mu, ratio, coulomb, least):
    """Normal impulse and the part of the tangential one that is kept, of a step to (n, r): see above."""
    near = n if n > least else least
    if r <= mu * near:
        return near, 1.0
    if not coulomb:
        near = (n + ratio * mu * r) / (1.0 + ratio * mu * mu)
        near = near if near > least else least
    return near, mu * near / r


@formula
def visit_smooth_ball(k, v, i, j, at):
    """Balls without friction: only velocities along the normal change."""
    x, y, z, p = k[at], k[at + 1], k[at + 2], k[at + B_P]
    u = x * (v[j, 0] - v[i, 0]) + y * (v[j, 1] - v[i, 1]) + z * (v[j, 2] - v[i, 2])
    q = p - (u + k[at + B_BIAS] + k[at + B_SOFT] * p) * k[at + B_IN]
    q = q if q > k[at + B_LEAST] else k[at + B_LEAST]
    d = q - p
    if d == 0.0:
        return 0.0
    k[at + B_P] = q
    a, b = d * v[j, SLOW], d * v[i, SLOW]
    v[j, 0] += a * x
    v[j, 1] += a * y
    v[j, 2] += a * z
    v[i, 0] -= b * x
    v[i, 1] -= b * y
    v[i, 2] -= b * z
    return abs(a + b)


@formula
def smooth_velocity(k, v, i, j, at):
    """Normal velocity of any nodes."""
    u = k[at] * (v[j, 0] - v[i, 0]) + k[at + 1] * (v[j, 1] - v[i, 1]) + k[at + 2] * (v[j, 2] - v[i, 2])
    u += k[at + C2] * v[j, 3] + k[at + C2 + 1] * v[j, 4] + k[at + C2 + 2] * v[j, 5]
    return u - (k[at + C1] * v[i, 3] + k[at + C1 + 1] * v[i, 4] + k[at + C1 + 2] * v[i, 5])


@formula
def visit_smooth(k, v, i, j, at):
    """Any nodes without friction."""
    x, y, z, p = k[at], k[at + 1], k[at + 2], k[at + S_P]
    u = smooth_velocity(k, v, i, j, at)
    q = p - (u + k[at + S_BIAS] + k[at + S_SOFT] * p) * k[at + S_IN]
    q = q if q > k[at + S_LEAST] else k[at + S_LEAST]
    d = q - p
    if d == 0.0:
        return 0.0
    k[at + S_P] = q
    a, b = d * v[j, SLOW], d * v[i, SLOW]
    v[j, 0] += a * x
    v[j, 1] += a * y
    v[j, 2] += a * z
    v[j, 3] += d * k[at + G2]
    v[j, 4] += d * k[at + G2 + 1]
    v[j, 5] += d * k[at + G2 + 2]
    v[i, 0] -= b * x
    v[i, 1] -= b * y
    v[i, 2] -= b * z
    v[i, 3] -= d * k[at + G1]
    v[i, 4] -= d * k[at + G1 + 1]
    v[i, 5] -= d * k[at + G1 + 2]
    return abs(d) / k[at + S_IN]


@formula
def sliding(k, v, i, j, at, d):
    """Tangential velocity in the world of balls, d: that of their centres and its normal part."""
    x, y, z, r1, r2 = k[at], k[at + 1], k[at + 2], k[at + R1], k[at + R2]
    e, f, g = r2 * v[j, 3], r2 * v[j, 4], r2 * v[j, 5]
    e, f, g = e + r1 * v[i, 3], f + r1 * v[i, 4], g + r1 * v[i, 5]
    # u = v2 - v1 - (r2 w2 + r1 w1) x n, less its normal part
    a, b, c, n = d
    return a - n * x - (f * z - g * y), b - n * y - (g * x - e * z), c - n * z - (e * y - f * x)


@formula
def visit_ball(k, v, i, j, at, coulomb):
    """Balls: the tangential impulse is a vector in the world, and no block couples it with the normal one."""
    a, b, c, p = v[j, 0] - v[i, 0], v[j, 1] - v[i, 1], v[j, 2] - v[i, 2], k[at + B_P]
    un = k[at] * a + k[at + 1] * b + k[at + 2] * c
    n = p - (un + k[at + B_BIAS] + k[at + B_SOFT] * p) * k[at + B_IN]
    if n <= 0.0 and p == 0.0 and coulomb and k[at + B_LEAST] == 0.0:
        return 0.0
    a, b, c = sliding(k, v, i, j, at, (a, b, c, un))
    it, s, t, w = k[at + B_IT], k[at + B_T], k[at + B_T + 1], k[at + B_T + 2]
    a, b, c = s - it * a, t - it * b, w - it * c
    q, part = limited(n, sqrt(a * a + b * b + c * c), k[at + B_MU], k[at + B_RATIO], coulomb, k[at + B_LEAST])
    a, b, c = part * a, part * b, part * c
    k[at + B_P], k[at + B_T], k[at + B_T + 1], k[at + B_T + 2] = q, a, b, c
    n, a, b, c = q - p, a - s, b - t, c - w
    change_balls(k, v, i, j, at, (n, a, b, c))
    return (abs(n) + abs(a) + abs(b) + abs(c)) / it


@formula
def velocity_at(k, v, i, at):
    """Velocity of a point of node i whose arm stands at ``at``."""
    a, b, c = k[at], k[at + 1], k[at + 2]
    e, f, g = v[i, 3], v[i, 4], v[i, 5]
    return v[i, 0] + f * c - g * b, v[i, 1] + g * a - e * c, v[i, 2] + e * b - f * a


@formula
def rough_velocity(k, v, i, j, at):
    """Velocity of a rough contact along its frame, without bias."""
    a, b, c = velocity_at(k, v, j, at + ARM2)
    e, f, g = velocity_at(k, v, i, at + ARM1)
    a, b, c = a - e, b - f, c - g
    return (
        k[at] * a + k[at + 1] * b + k[at + 2] * c,
        k[at + 3] * a + k[at + 4] * b + k[at + 5] * c,
        k[at + 6] * a + k[at + 7] * b + k[at + 8] * c,
    )


@formula
def change(k, v, B, i, at, x, y, z):
    """What an impulse at that point does to node i."""
    a, b, c, m = k[at], k[at + 1], k[at + 2], v[i, SLOW]
    e, f, g = b * z - c * y, c * x - a * z, a * y - b * x
    v[i, 0] += m * x
    v[i, 1] += m * y
    v[i, 2] += m * z
    v[i, 3] += B[i, 0] * e + B[i, 3] * f + B[i, 4] * g
    v[i, 4] += B[i, 3] * e + B[i, 1] * f + B[i, 5] * g
    v[i, 5] += B[i, 4] * e + B[i, 5] * f + B[i, 2] * g


@formula
def stepped(k, at, u, coulomb):
    """The new impulse of a rough contact at velocities u without bias; what it was is still there."""
    p, s, t = k[at + IMPULSE], k[at + IMPULSE + 1], k[at + IMPULSE + 2]
    n = p - (u[0] + k[at + BIAS] + k[at + SOFT] * p) * k[at + IN]
    us, ut = u[1] + k[at + BIAS + 1], u[2] + k[at + BIAS + 2]
    if coulomb:
        n = n if n > k[at + LEAST] else k[at + LEAST]
        us += k[at + NS] * (n - p)
        ut += k[at + NT] * (n - p)
        a = s - (k[at + ISS] * us + k[at + IST] * ut)
        b = t - (k[at + IST] * us + k[at + ITT] * ut)
        if a * a + b * b <= k[at + MU] * k[at + MU] * n * n:
            return n, a, b
    # it slides: only a step of one size in all directions ends with friction against the velocity
    a, b = s - k[at + SLIDE] * us, t - k[at + SLIDE] * ut
    q, part = limited(n, sqrt(a * a + b * b), k[at + MU], k[at + RATIO], coulomb, k[at + LEAST])
    return q, part * a, part * b


@formula
def visit_rough(k, v, B, i, j, at, coulomb):
    """Any nodes."""
    u = rough_velocity(k, v, i, j, at)
    n, s, t = stepped(k, at, u, coulomb)
    dn, ds, dt = n - k[at + IMPULSE], s - k[at + IMPULSE + 1], t - k[at + IMPULSE + 2]
    if dn == 0.0 and ds == 0.0 and dt == 0.0:
        return 0.0
    k[at + IMPULSE], k[at + IMPULSE + 1], k[at + IMPULSE + 2] = n, s, t
    x = k[at] * dn + k[at + 3] * ds + k[at + 6] * dt
    y = k[at + 1] * dn + k[at + 4] * ds + k[at + 7] * dt
    z = k[at + 2] * dn + k[at + 5] * ds + k[at + 8] * dt
    change(k, v, B, j, at + ARM2, x, y, z)
    change(k, v, B, i, at + ARM1, -x, -y, -z)
    return (abs(dn) + abs(ds) + abs(dt)) / k[at + IN]
