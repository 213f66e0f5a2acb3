"""What is minimised over the velocities e of an island: 1/2 |e|^2 + sum of rows' envelopes, its gradient and Hessian.

An envelope is that of the impulse nearest to y = p0 - u / R, u = u0 + G e (the augmented Lagrangian of the contact
problem, p0 the impulses held on to): its gradient is -p, so that at the least value e = sum G' p, and p0 = p there is
the solution without any compliance (Rockafellar 1976).
"""

from __future__ import annotations

from ...compiler.jit import formula
from .gather import BLOCKS, ROWS
from .prox import DY, HELD, METRIC, ROOT_N, ROOT_T, SLIP, WIDE, Q, U, Y, nearest, slope

E, GRADIENT, STEP, SPARE = range(4)  # rows of Rows.blocks


@formula
def product(R, row, a):
    """G x of a row; x begins at a in Rows.blocks."""
    n, s, t = 0.0, 0.0, 0.0
    for e in range(R.entry_p[row], R.entry_p[row + 1]):
        o, b = 18 * e, a + 6 * R.block[e]
        for k in range(6):
            x = R.blocks[b + k]
            n += R.G[o + k] * x
            s += R.G[o + 6 + k] * x
            t += R.G[o + 12 + k] * x
    return n, s, t


@formula
def add_impulse(R, row, a, n, s, t):
    """Add G' p of a row to the vector that begins at a in Rows.blocks."""
    for e in range(R.entry_p[row], R.entry_p[row + 1]):
        o, b = 18 * e, a + 6 * R.block[e]
        for k in range(6):
            R.blocks[b + k] += R.G[o + k] * n + R.G[o + 6 + k] * s + R.G[o + 12 + k] * t


@formula
def from_held(R):
    """e of the impulses held on to."""
    for k in range(6 * R.size[BLOCKS]):
        R.blocks[k] = 0.0
    for row in range(R.size[ROWS]):
        o = WIDE * row + HELD
        n, s, t = R.row[o], R.row[o + 1], R.row[o + 2]
        if n != 0.0 or s != 0.0 or t != 0.0:
            add_impulse(R, row, 0, n, s, t)


@formula
def set_y(R):
    """Scaled y of every row at e."""
    x = R.row
    for row in range(R.size[ROWS]):
        o = WIDE * row
        n, s, t = product(R, row, 0)
        r = x[o + METRIC]
        x[o + Y] = (r * x[o + HELD] - x[o + U] - x[o + SLIP] - n) / x[o + ROOT_N]
        x[o + Y + 1] = (r * x[o + HELD + 1] - x[o + U + 1] - s) / x[o + ROOT_T]
        x[o + Y + 2] = (r * x[o + HELD + 2] - x[o + U + 2] - t) / x[o + ROOT_T]


@formula
def set_impulses(R):
    """Impulses of every row at y, and the gradient e - sum G' p."""
    x, g = R.row, 6 * R.size[BLOCKS]
    for k in range(g):
        R.blocks[g + k] = R.blocks[k]
    for row in range(R.size[ROWS]):
        o = WIDE * row
        n, s, t = nearest(x, o, x[o + Y], x[o + Y + 1], x[o + Y + 2])
        x[o + Q], x[o + Q + 1], x[o + Q + 2] = n, s, t
        if n != 0.0 or s != 0.0 or t != 0.0:
            add_impulse(R, row, g, -n / x[o + ROOT_N], -s / x[o + ROOT_T], -t / x[o + ROOT_T])


@formula
def weigh(R, e, W):
    """W G of entry e, W symmetric (nn, ns, nt, ss, st, tt): 18 numbers."""
    g, G = 18 * e, R.G
    nn, ns, nt, ss, st, tt = W
    a0, a1, a2, a3, a4, a5 = G[g], G[g + 1], G[g + 2], G[g + 3], G[g + 4], G[g + 5]
    b0, b1, b2, b3, b4, b5 = G[g + 6], G[g + 7], G[g + 8], G[g + 9], G[g + 10], G[g + 11]
    c0, c1, c2, c3, c4, c5 = G[g + 12], G[g + 13], G[g + 14], G[g + 15], G[g + 16], G[g + 17]
    return (
        (
            nn * a0 + ns * b0 + nt * c0,
            nn * a1 + ns * b1 + nt * c1,
            nn * a2 + ns * b2 + nt * c2,
            nn * a3 + ns * b3 + nt * c3,
            nn * a4 + ns * b4 + nt * c4,
            nn * a5 + ns * b5 + nt * c5,
        ),
        (
            ns * a0 + ss * b0 + st * c0,
            ns * a1 + ss * b1 + st * c1,
            ns * a2 + ss * b2 + st * c2,
            ns * a3 + ss * b3 + st * c3,
            ns * a4 + ss * b4 + st * c4,
            ns * a5 + ss * b5 + st * c5,
        ),
        (
            nt * a0 + st * b0 + tt * c0,
            nt * a1 + st * b1 + tt * c1,
            nt * a2 + st * b2 + tt * c2,
            nt * a3 + st * b3 + tt * c3,
            nt * a4 + st * b4 + tt * c4,
            nt * a5 + st * b5 + tt * c5,
        ),
    )


@formula
def add_block(R, e, L, o, T, lower):
    """Add G' T of entry e to a block, (i, j) at o + 6 i + j; of that only the lower triangle if so asked."""
    g = 18 * e
    t, u, v = T
    for i in range(6):
        a, b, c = R.G[g + i], R.G[g + 6 + i], R.G[g + 12 + i]
        k = o + 6 * i
        L[k] += a * t[0] + b * u[0] + c * v[0]
        if not lower or i > 0:
            L[k + 1] += a * t[1] + b * u[1] + c * v[1]
        if not lower or i > 1:
            L[k + 2] += a * t[2] + b * u[2] + c * v[2]
        if not lower or i > 2:
            L[k + 3] += a * t[3] + b * u[3] + c * v[3]
        if not lower or i > 3:
            L[k + 4] += a * t[4] + b * u[4] + c * v[4]
        if not lower or i > 4:
            L[k + 5] += a * t[5] + b * u[5] + c * v[5]


@formula
def add_row(R, row, W):
    """Add G' W G of a row to the matrix."""
    k = R.pair_p[row]
    for e in range(R.entry_p[row], R.entry_p[row + 1]):
        T, i = weigh(R, e, W), R.block[e]
        add_block(R, e, R.D, 36 * i, T, True)
        for f in range(R.entry_p[row], e):
            j, at = R.block[f], R.pair[k]
            k += 1
            if at < 0:  # both on one block
                add_block(R, f, R.D, 36 * i, T, False)
                V = weigh(R, f, W)
                add_block(R, e, R.D, 36 * i, V, False)
            elif i < j:  # rows belong to the block that is eliminated later
                add_block(R, f, R.L, 36 * at, T, False)
            else:
                add_block(R, e, R.L, 36 * at, weigh(R, f, W), False)


@formula
def clear_matrix(R):
    """The matrix 1."""
    for k in range(R.L.shape[0]):
        R.L[k] = 0.0
    for k in range(R.D.shape[0]):
        R.D[k] = 0.0
    for k in range(R.size[BLOCKS]):
        for i in range(6):
            R.D[36 * k + 7 * i] = 1.0


@formula
def hessian(R):
    """1 + sum G' R^-1/2 (derivative) R^-1/2 G."""
    x = R.row
    clear_matrix(R)
    for row in range(R.size[ROWS]):
        o = WIDE * row
        B = slope(x, o, x[o + Y], x[o + Y + 1], x[o + Y + 2])
        if B[0] != 0.0 or B[3] != 0.0 or B[5] != 0.0:
            a, b = 1.0 / x[o + ROOT_N], 1.0 / x[o + ROOT_T]
            W = a * a * B[0], a * b * B[1], a * b * B[2], b * b * B[3], b * b * B[4], b * b * B[5]
            add_row(R, row, W)


@formula
def along_step(R):
    """Change of the scaled y of every row along the step."""
    x, a = R.row, 12 * R.size[BLOCKS]
    for row in range(R.size[ROWS]):
        o = WIDE * row
        n, s, t = product(R, row, a)
        x[o + DY] = -n / x[o + ROOT_N]
        x[o + DY + 1], x[o + DY + 2] = -s / x[o + ROOT_T], -t / x[o + ROOT_T]


@formula
def slope_along(R, a, first, second):
    """Derivative along the step at its part a; ``first`` and ``second``: e . step, |step|^2."""
    x = R.row
    total = first + a * second
    for row in range(R.size[ROWS]):
        o = WIDE * row
        n, s, t = x[o + DY], x[o + DY + 1], x[o + DY + 2]
        p = nearest(x, o, x[o + Y] + a * n, x[o + Y + 1] + a * s, x[o + Y + 2] + a * t)
        total += p[0] * n + p[1] * s + p[2] * t
    return total
