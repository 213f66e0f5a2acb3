"""One step of a projected gradient for all contacts at once, and the product with N that it needs.

What Jacobi, Barzilai-Borwein and APGD are made of. The metric is that of diagonal blocks (or 1), so a step of size 1
is of the size of Gauss-Seidel's. Vectors are planes of `Scratch.rows`, by visit: impulses in the first four, their
velocities N p in three more, b = D v + bias in the last; torques stand eight planes further, lines in `Scratch.lines`.
Impulses of balls are vectors in the world; of all others along the frame.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .pack import B_IN, B_IT, B_LEAST, B_MU, B_RATIO, IN, LEAST, MU, RATIO, SLIDE
from .problem import HIGH, LOW
from .projection import normal_of_three, share
from .sweeps import limited

B, TORQUE = 7, 8  # plane of b; by how many planes torques stand further on
STEPS, METRIC = 16, 8  # plane of steps of spinning and rolling; row of lines' diagonal


@formula
def mixed(W, a, b, beta, s):
    """Vector a + beta (a - b) of visit s."""
    x, y, z = W.rows[a, s, 0], W.rows[a, s, 1], W.rows[a, s, 2]
    if beta == 0.0:
        return x, y, z
    return x + beta * (x - W.rows[b, s, 0]), y + beta * (y - W.rows[b, s, 1]), z + beta * (z - W.rows[b, s, 2])


@formula
def write(W, a, s, x):
    """Vector a of visit s."""
    W.rows[a, s, 0], W.rows[a, s, 1], W.rows[a, s, 2] = x


@formula
def step_ball(k, at, y, g, size, coulomb):
    """Impulse after a step from y against g; sums of d' M d and the square of M d, d: by what it differs from y."""
    x0, x1, x2, lean, slide = k[at], k[at + 1], k[at + 2], k[at + B_IN], k[at + B_IT]
    gn, yn, mu = g[0] * x0 + g[1] * x1 + g[2] * x2, y[0] * x0 + y[1] * x1 + y[2] * x2, k[at + B_MU]
    a, b, c = g[0] - gn * x0, g[1] - gn * x1, g[2] - gn * x2
    if coulomb:
        gn += mu * sqrt(a * a + b * b + c * c)
    n = yn - size * lean * gn
    a, b, c = y[0] - yn * x0 - size * slide * a, y[1] - yn * x1 - size * slide * b, y[2] - yn * x2 - size * slide * c
    n, part = limited(n, sqrt(a * a + b * b + c * c), mu, k[at + B_RATIO], 0, k[at + B_LEAST])
    a, b, c = n * x0 + part * a, n * x1 + part * b, n * x2 + part * c
    e, f, h, n = a - y[0], b - y[1], c - y[2], n - yn
    dn, dt = n * n, e * e + f * f + h * h - n * n
    return (a, b, c), dn / lean + dt / slide, dn / (lean * lean) + dt / (slide * slide)


@formula
def step_rough(k, at, y, g, size, coulomb):
    """As `step_ball`, of any contact, along its frame."""
    lean, slide, gn = k[at + IN], k[at + SLIDE], g[0]
    if lean == 0.0:  # nothing moves
        return y, 0.0, 0.0
    if coulomb:
        gn += k[at + MU] * sqrt(g[1] * g[1] + g[2] * g[2])
    n, a, b = y[0] - size * lean * gn, y[1] - size * slide * g[1], y[2] - size * slide * g[2]
    n, part = limited(n, sqrt(a * a + b * b), k[at + MU], k[at + RATIO], 0, k[at + LEAST])
    a, b = part * a, part * b
    dn, dt = (n - y[0]) * (n - y[0]), (a - y[1]) * (a - y[1]) + (b - y[2]) * (b - y[2])
    if slide == 0.0:
        return (n, a, b), dn / lean, dn / (lean * lean)
    return (n, a, b), dn / lean + dt / slide, dn / (lean * lean) + dt / (slide * slide)


@formula
def step_turning(P, k, c, at, y, g, way):
    """As `step_rough`, impulses and torques together: y and g are two vectors each, way: size, coulomb, steps."""
    size, coulomb, spin, roll = way
    (yn, ys, yt), (yz, yx, yy) = y
    (gn, gs, gt), (gz, gx, gy) = g
    lean, slide, mu, rho, sigma = k[at + IN], k[at + SLIDE], k[at + MU], P.turn[c, 0], P.turn[c, 1]
    if coulomb:
        gn += mu * sqrt(gs * gs + gt * gt) + rho * sqrt(gx * gx + gy * gy) + sigma * abs(gz)
    n, s, t = yn - size * lean * gn, ys - size * slide * gs, yt - size * slide * gt
    z, x, w = yz - size * spin * gz, yx - size * roll * gx, yy - size * roll * gy
    a, b, d = sqrt(lean / slide), sqrt(lean / roll), sqrt(lean / spin)  # in units in which the metric is 1
    r, q = sqrt(s * s + t * t), sqrt(x * x + w * w)
    n = max(normal_of_three(mu * a, rho * b, sigma * d, n, r * a, q * b, abs(z) * d), k[at + LEAST])
    a, b, d = share(n, mu, r), share(n, rho, q), share(n, sigma, abs(z))
    s, t, z, x, w = a * s, a * t, d * z, b * x, b * w
    dn, dt, dz = (n - yn) * (n - yn), (s - ys) * (s - ys) + (t - yt) * (t - yt), (z - yz) * (z - yz)
    dx = (x - yx) * (x - yx) + (w - yy) * (w - yy)
    dd = dn / lean + dt / slide + dz / spin + dx / roll
    return (n, s, t), (z, x, w), dd, dn / (lean * lean) + dt / (slide * slide)


@formula
def step_line(P, W, k, ids, par):
    """As `step_ball`, of line k, written down; and g times the whole change."""
    cur, prev, ucur, uprev, new = ids
    beta, size, _ = par
    y = W.lines[cur, k] + beta * (W.lines[cur, k] - W.lines[prev, k])
    g = W.lines[ucur, k] + beta * (W.lines[ucur, k] - W.lines[uprev, k]) + W.lines[B, k]
    d = W.lines[METRIC, k]
    q = min(max(y - size * g / d, P.line_x[k, LOW]), P.line_x[k, HIGH])
    W.lines[new, k] = q
    return d * (q - y) * (q - y), g * (q - W.lines[cur, k]), d * d * (q - y) * (q - y)
