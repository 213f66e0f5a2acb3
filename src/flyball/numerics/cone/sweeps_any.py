"""One visit of a contact of groups or with rolling and spinning friction, and of a line, by the operator itself."""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .diagonal import diagonal_turning
from .operator import diagonal_of_line, push, push_line, push_turning, seen, seen_line, seen_turning
from .pack import BIAS, IMPULSE, IN, LEAST, MU, SLIDE, SOFT, local_steps
from .problem import BIAS as LINE_BIAS
from .problem import HIGH, LOW
from .problem import SOFT as LINE_SOFT
from .projection import normal_of_three, share
from .sweeps import stepped


@formula
def visit_any(P, X, W, O, c, at):
    """A contact of nodes and groups."""
    k = W.pack
    n, s, t = k[at + IMPULSE], k[at + IMPULSE + 1], k[at + IMPULSE + 2]
    if P.turn.shape[0] > 0:
        visit_turning(P, X, W, O, c, at)
    else:
        q = stepped(k, at, seen(P, W.own, X.wide, c), O.count.coulomb)
        put(P, X, W, c, at, q)
    d = abs(k[at + IMPULSE] - n) + abs(k[at + IMPULSE + 1] - s) + abs(k[at + IMPULSE + 2] - t)
    return d / k[at + IN] if d > 0.0 else 0.0


@formula
def put(P, X, W, c, at, q):
    """Change the impulse to q, and the velocities with it."""
    k = W.pack
    d = q[0] - k[at + IMPULSE], q[1] - k[at + IMPULSE + 1], q[2] - k[at + IMPULSE + 2]
    if d[0] != 0.0 or d[1] != 0.0 or d[2] != 0.0:
        k[at + IMPULSE], k[at + IMPULSE + 1], k[at + IMPULSE + 2] = q
        push(P, W.own, X.wide, c, d)


@formula
def put_turning(P, X, W, c, z, x, y):
    """Change the torque impulse, and the velocities with it."""
    d = z - X.torque[c, 0], x - X.torque[c, 1], y - X.torque[c, 2]
    X.torque[c, 0], X.torque[c, 1], X.torque[c, 2] = z, x, y
    push_turning(P, W.own, X.wide, c, d)


@formula
def visit_turning(P, X, W, O, c, at):
    """A contact with rolling and spinning friction.

    By Coulomb's law the torques are bounded by the normal impulse found just before; in the convex form all six
    impulses are the nearest point of the cone, in the metric of twice the diagonal blocks.
    """
    steps = local_steps(diagonal_turning(P, c), 0.0, 0)
    spin, roll = steps[0], steps[6]
    u = seen(P, W.own, X.wide, c)
    if O.count.coulomb:
        put(P, X, W, c, at, stepped(W.pack, at, u, 1))
        n = W.pack[at + IMPULSE]
        w = seen_turning(P, W.own, X.wide, c)
        z, x, y = X.torque[c, 0] - spin * w[0], X.torque[c, 1] - roll * w[1], X.torque[c, 2] - roll * w[2]
        a, b = share(n, P.turn[c, 0], sqrt(x * x + y * y)), share(n, P.turn[c, 1], abs(z))
        put_turning(P, X, W, c, b * z, a * x, a * y)
    else:
        q, o = nearest(P, X, W.pack, c, at, u, seen_turning(P, W.own, X.wide, c), (spin, roll))
        put(P, X, W, c, at, q)
        put_turning(P, X, W, c, o[0], o[1], o[2])


@formula
def nearest(P, X, k, c, at, u, w, steps):
    """Impulse and torque of the convex form after a step at velocities u and w."""
    spin, roll, slide, press = 0.5 * steps[0], 0.5 * steps[1], 0.5 * k[at + SLIDE], 0.5 * k[at + IN]
    n = k[at + IMPULSE] - press * (u[0] + k[at + BIAS] + k[at + SOFT] * k[at + IMPULSE])
    s = k[at + IMPULSE + 1] - slide * (u[1] + k[at + BIAS + 1])
    t = k[at + IMPULSE + 2] - slide * (u[2] + k[at + BIAS + 2])
    z, x, y = X.torque[c, 0] - spin * w[0], X.torque[c, 1] - roll * w[1], X.torque[c, 2] - roll * w[2]
    r, q, mu, rho, sigma = sqrt(s * s + t * t), sqrt(x * x + y * y), k[at + MU], P.turn[c, 0], P.turn[c, 1]
    # in units in which the metric is 1
    a, b, d = relative(press, slide), relative(press, roll), relative(press, spin)
    near = normal_of_three(mu * a, rho * b, sigma * d, n, r * a, q * b, abs(z) * d)
    near = max(near, k[at + LEAST])
    a, b, d = share(near, mu, r), share(near, rho, q), share(near, sigma, abs(z))
    return (near, a * s, a * t), (d * z, b * x, b * y)


@formula
def relative(a, b):
    """Square root of a / b; 0 where nothing moves that way."""
    return sqrt(a / b) if b > 0.0 else 0.0


@formula
def visit_line(P, X, k):
    """A single impulse on a group."""
    p, d = X.line[k], diagonal_of_line(P, k)
    if not d > 0.0:
        return 0.0
    q = p - (seen_line(P, X.wide, k) + P.line_x[k, LINE_BIAS] + P.line_x[k, LINE_SOFT] * p) / d
    q = min(max(q, P.line_x[k, LOW]), P.line_x[k, HIGH])
    X.line[k] = q
    push_line(P, X.wide, k, q - p)
    return abs(q - p) * d
