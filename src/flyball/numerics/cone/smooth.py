"""What is minimised over the velocities e of an island: 1/2 |e|^2 + sum of rows' envelopes, its gradient and Hessian.

An envelope is that of the impulse nearest to y = p0 - u / R, u = u0 + G e (the augmented Lagrangian of the contact
problem, p0 the impulses held on to): its gradient is -p, so that at the least value e = sum G' p, and p0 = p there is
the solution without any compliance (Rockafellar 1976).
"""

from __future__ import annotations

from ...compiler.formulas import formula
from .gather import BLOCKS, ROWS
from .prox import DY, HELD, METRIC, ROOT_N, ROOT_T, WIDE, Q, U, Y, nearest, slipped, slope

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
        x[o + Y] = (r * x[o + HELD] - x[o + U] - slipped(x, o) - n) / x[o + ROOT_N]
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
def add_product(R, e, f, W, L, at):
    """Add G' W G of entries e and f to the block at ``at``; W: nn, ns, nt, ss, st, tt, sn, tn."""
    G, g, h = R.G, 18 * e, 18 * f
    nn, ns, nt, ss, st, tt, sn, tn = W
    for i in range(6):
        a, b, c = G[g + i], G[g + 6 + i], G[g + 12 + i]
        x, y, z = a * nn + b * sn + c * tn, a * ns + b * ss + c * st, a * nt + b * st + c * tt
        o = at + 6 * i
        for j in range(6):
            L[o + j] += x * G[h + j] + y * G[h + 6 + j] + z * G[h + 12 + j]


@formula
def add_row(R, row, W, symmetric):
    """Add G' W G of a row to the matrix."""
    k, above = R.pair_p[row], R.L.shape[0] // 2
    for e in range(R.entry_p[row], R.entry_p[row + 1]):
        i = R.block[e]
        add_product(R, e, e, W, R.D, 36 * i)
        for f in range(R.entry_p[row], e):
            j, at = R.block[f], 36 * R.pair[k]
            k += 1
            if at < 0:  # both on one block
                add_product(R, e, f, W, R.D, 36 * i)
                add_product(R, f, e, W, R.D, 36 * i)
                continue
            later, earlier = (e, f) if i > j else (f, e)
            add_product(R, later, earlier, W, R.L, at)
            if not symmetric:
                add_product(R, earlier, later, W, R.L, above + at)


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
def hessian(R, symmetric):
    """1 + sum G' R^-1/2 (derivative) R^-1/2 G."""
    x = R.row
    clear_matrix(R)
    for row in range(R.size[ROWS]):
        o = WIDE * row
        B = slope(x, o, x[o + Y], x[o + Y + 1], x[o + Y + 2])
        if B[0] != 0.0 or B[3] != 0.0 or B[5] != 0.0:
            a, b = 1.0 / x[o + ROOT_N], 1.0 / x[o + ROOT_T]
            ab, bb = a * b, b * b
            W = a * a * B[0], ab * B[1], ab * B[2], bb * B[3], bb * B[4], bb * B[5], ab * B[6], ab * B[7]
            add_row(R, row, W, symmetric)


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
