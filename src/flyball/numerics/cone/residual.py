"""How far impulses are from a solution, as a velocity and as a force, and the objective.

The natural map: a solution is a fixed point of p -> P(p - s u), with P the nearest point of the cone. What p differs
from it by, over s, is a velocity [m/s]; over the largest impulse of all it is a number, the force residual. s is a
contact's own: three over the trace of its diagonal block (for torques likewise, counted in lengths so that both blocks
have the same size), so that light and heavy contacts count alike. The velocity residual is the largest of all
contacts and lines; on stacks of large mass ratios a harmless one may hide impulses that are wrong, hence the other.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .diagonal import diagonal, diagonal_turning
from .operator import diagonal_of_line, seen, seen_line, seen_turning
from .problem import BIAS, HIGH, LOW, SOFT
from .projection import least_of, projected_above, projected_turning

NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0)  # residual, impulse lacking, square of the largest impulse, b' p, p' N p


@formula
def part_of(begin, whole, O):
    """First of what is meant and the one after its last, where islands begin at ``begin``."""
    k = O.count.island
    if k < 0:
        return 0, whole
    return begin[k], begin[k + 1]


@formula
def contacts_of(P, O):
    """First contact of what is meant, and the one after its last."""
    return part_of(P.island, P.size[0], O)


@formula
def nodes_of(P, O):
    """First node of what is meant and the one after its last, in ``member``."""
    return part_of(P.member_p, P.size[1], O)


@formula
def lines_of(P, O):
    """First line of what is meant, and the one after its last."""
    return part_of(P.line_p, P.size[3], O)


@formula
def larger(a, b):
    """The larger of two; nan if one is, so that none is lost."""
    return a if a >= b or a != a else b


@formula
def of_contact(P, X, c, u, coulomb):
    """Squares of the impulse that contact c lacks and of its step, and of the impulse, without turning."""
    D = diagonal(P, c)
    s = D[0] + D[3] + D[5]
    s = 3.0 / (s + P.soft[c]) if s > 0.0 else 0.0
    n, a, b = X.p[c, 0], X.p[c, 1], X.p[c, 2]
    more = coulomb * P.mu[c] * sqrt(u[1] * u[1] + u[2] * u[2])  # De Saxce and Feng 1998
    x, y, z = projected_above(P.mu[c], least_of(P, c), n - s * (u[0] + more), a - s * u[1], b - s * u[2])
    lack = (x - n) * (x - n) + (y - a) * (y - a) + (z - b) * (z - b)
    return lack, s, n * n + a * a + b * b


@formula
def of_turning(P, X, c, u, w, coulomb):
    """As `of_contact` for a contact with rolling and spinning friction."""
    D, E = diagonal(P, c), diagonal_turning(P, c)
    whole = D[0] + D[3] + D[5] + P.soft[c]
    s, size = 3.0 / whole, sqrt(whole / (E[0] + E[3] + E[5]))  # torques are counted as size * force
    n, a, b = X.p[c, 0], X.p[c, 1], X.p[c, 2]
    k, l, m = X.torque[c, 0] / size, X.torque[c, 1] / size, X.torque[c, 2] / size
    mu, rho, sigma = P.mu[c], P.turn[c, 0] / size, P.turn[c, 1] / size
    w = w[0] * size, w[1] * size, w[2] * size
    more = mu * sqrt(u[1] * u[1] + u[2] * u[2]) + rho * sqrt(w[1] * w[1] + w[2] * w[2]) + sigma * abs(w[0])
    f = n - s * (u[0] + coulomb * more), a - s * u[1], b - s * u[2]
    q = k - s * w[0], l - s * w[1], m - s * w[2]
    p, q = projected_turning(mu, rho, sigma, least_of(P, c), f, q)
    lack = (p[0] - n) * (p[0] - n) + (p[1] - a) * (p[1] - a) + (p[2] - b) * (p[2] - b)
    lack += (q[0] - k) * (q[0] - k) + (q[1] - l) * (q[1] - l) + (q[2] - m) * (q[2] - m)
    return lack, s, n * n + a * a + b * b


@formula
def with_bias(P, X, c, u):
    """Velocity of contact c with bias and compliance."""
    return u[0] + P.bias[c, 0] + P.soft[c] * X.p[c, 0], u[1] + P.bias[c, 1], u[2] + P.bias[c, 2]


@formula
def worse(sofar, more):
    """Worst residual, impulse lacking and square of the largest impulse; sums of b' p and p' N p.

    more: squares of the impulse that is lacking, step, square of the impulse, b' p, p' N p of one contact or line.
    """
    lack = sqrt(more[0])
    rate = lack / more[1] if more[1] > 0.0 else lack
    a, b, c = larger(sofar[0], rate), larger(sofar[1], lack), larger(sofar[2], more[2])
    return a, b, c, sofar[3] + more[3], sofar[4] + more[4]


@formula
def summary(sofar):
    """Residual [m/s], force residual [1], b . p and p' N p."""
    worst, lacking, largest, linear, square = sofar
    return worst, lacking / sqrt(largest) if largest > 0.0 else lacking, linear, square


@formula
def of_one(P, X, O, velocities, c):
    """What `worse` wants to know of contact c."""
    v, wide, free, free_wide = velocities
    n, a, b, coulomb = X.p[c, 0], X.p[c, 1], X.p[c, 2], 1.0 * O.count.coulomb
    d, e = seen(P, v, wide, c), seen(P, free, free_wide, c)
    u = with_bias(P, X, c, d)
    linear = n * (e[0] + P.bias[c, 0]) + a * (e[1] + P.bias[c, 1]) + b * (e[2] + P.bias[c, 2])
    square = n * (d[0] - e[0] + P.soft[c] * n) + a * (d[1] - e[1]) + b * (d[2] - e[2])
    if P.turn.shape[0] > 0:
        w, o = seen_turning(P, v, wide, c), seen_turning(P, free, free_wide, c)
        for k in range(3):
            linear += X.torque[c, k] * o[k]
            square += X.torque[c, k] * (w[k] - o[k])
        lack, s, size = of_turning(P, X, c, u, w, coulomb)
    else:
        lack, s, size = of_contact(P, X, c, u, coulomb)
    return lack, s, size, linear, square


@formula
def residuals(P, X, O, velocities):
    """Residual [m/s], force residual [1], b . p and p' N p of the impulses in X.

    Parameters
    ----------
    velocities : tuple
        With the impulses: of nodes and of groups; without them: of nodes and of groups.
    """
    sofar = NOTHING
    first, last = contacts_of(P, O)
    for c in range(first, last):
        sofar = worse(sofar, of_one(P, X, O, velocities, c))
    return summary(of_lines(P, X, O, velocities[1], velocities[3], sofar))


@formula
def of_lines(P, X, O, wide, free_wide, sofar):
    """What is so far, and of the lines."""
    first, last = lines_of(P, O)
    for k in range(first, last):
        p, d, e = X.line[k], seen_line(P, wide, k), seen_line(P, free_wide, k)
        s = diagonal_of_line(P, k)
        s = 1.0 / s if s > 0.0 else 0.0
        q = p - s * (d + P.line_x[k, BIAS] + P.line_x[k, SOFT] * p)
        q = min(max(q, P.line_x[k, LOW]), P.line_x[k, HIGH]) - p
        linear, square = p * (e + P.line_x[k, BIAS]), p * (d - e + P.line_x[k, SOFT] * p)
        sofar = worse(sofar, (q * q, s, p * p, linear, square))
    return sofar
