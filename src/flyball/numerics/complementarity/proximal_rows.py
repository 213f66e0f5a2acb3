"""The smoothed contact objective of Newton and ADMM: proximal maps of rows, gradient, Hessian, residual.

The function that is minimised over the velocities e of an island is 1/2 |e|^2 + sum of the rows' envelopes. The
envelope is that of the impulse nearest to y = p0 - u / R, u = u0 + G e (the augmented Lagrangian of the contact
problem, p0 the multipliers). Its gradient is -p, so that at the minimum e = sum G' p, and p0 = p there is the solution
without any compliance (Rockafellar 1976).

A row's impulses p minimise R_n (p_n - y_n)^2 / 2 + R_t |p_t - y_t|^2 / 2. In the scaled impulses sqrt(R) p this is a
projection on a scaled cone, |p_t| <= mu p_n, cut at p_n >= least; for a line, on an interval. The derivative of a
projection is symmetric with eigenvalues in [0, 1] (Hiriart-Urruty 1982). Row data are filled from the problem and the
state, and written back.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from .cone_projection import least_normal_impulse, project_on_cone_above
from .contact_operator import (
    apply_contact_impulse,
    apply_line_impulse,
    apply_torque_impulse,
    contact_angular_velocity,
    contact_range,
    contact_velocity,
    line_range,
    line_velocity,
)
from .island_rows import BEFORE_ROLLING, BLOCKS, CONTACTS, ROWS, row_subject

# columns of IslandRows.row: velocities with bias and no impulse; scaled y; its change along a step; scaled impulse;
# multiplier (reference impulse); velocities of the row
FREE_VELOCITY, SCALED_TARGET, TARGET_CHANGE, SCALED_IMPULSE, MULTIPLIER, ROW_VELOCITY = 0, 3, 6, 9, 12, 15
# mean mobility; roots of R_n, R_t; scaled mu, lower bound, upper bound; R; compliance; De Saxce's term; kind; mu
(
    MOBILITY,
    NORMAL_SCALE,
    TANGENT_SCALE,
    SCALED_MU,
    LOWEST,
    HIGHEST,
    REGULARISATION,
    SOFTNESS,
    ADDED_VELOCITY,
    KIND,
    FRICTION,
) = range(21, 32)
ROW_NUMBERS = 32
# kinds; IDLE: all that it acts on is immovable; ROLLING: torques bounded by LOWEST about the tangents and by HIGHEST
# about the normal, which are FRICTION and ADDED_VELOCITY times the normal impulse of the contact
CONTACT, LINE, IDLE, COULOMB_CONTACT, ROLLING = 0.0, 1.0, 2.0, 3.0, 4.0


@formula
def cone_derivative(mu, least, n, s, t):
    """Return the derivative of `project_on_cone_above`: nn, ns, nt, ss, st, tt, and sn, tn, here equal to ns and nt."""
    r = sqrt(s * s + t * t)
    if r <= mu * n and n >= least:
        return 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0
    near = (n + mu * r) / (1.0 + mu * mu) if r > mu * n else n
    if near <= least:
        return disc_derivative(0.0, mu * least, s, t, r)
    a, x, y, f = mu * near / r, s / r, t / r, 1.0 / (1.0 + mu * mu)
    b, p, q = f * mu * mu, f * mu * x, f * mu * y
    return f, p, q, b * x * x + a * y * y, (b - a) * x * y, b * y * y + a * x * x, p, q


@formula
def disc_derivative(normal, bound, s, t, r):
    """Return the derivative of the tangential part cut at a bound; ``normal``: that of the bound by the normal part."""
    one = 1.0 if normal > 0.0 else 0.0
    if r <= bound:
        b = 1.0 if bound > 0.0 else 0.0
        return one, 0.0, 0.0, b, 0.0, b, 0.0, 0.0
    a, x, y = bound / r, s / r, t / r
    return one, 0.0, 0.0, a * y * y, -a * x * y, a * x * x, normal * x, normal * y


@formula
def project_by_coulomb(mu, least, n, s, t):
    """Cut the normal part at ``least``, then the tangential part at mu times that (Alart and Curnier 1991)."""
    n = max(n, least)
    r = sqrt(s * s + t * t)
    a = 1.0 if r <= mu * n else mu * n / r
    return n, a * s, a * t


@formula
def coulomb_derivative(mu, least, n, s, t):
    """Return the derivative of `project_by_coulomb`, as `cone_derivative`; not symmetric while sliding."""
    r = sqrt(s * s + t * t)
    if n > least:
        p = disc_derivative(mu, mu * n, s, t, r)
        return 1.0, p[1], p[2], p[3], p[4], p[5], p[6], p[7]
    return disc_derivative(0.0, mu * least, s, t, r)


@formula
def nearest_impulse(x, o, n, s, t):
    """Admissible scaled impulse nearest to a scaled one, for the row that begins at o in x."""
    if x[o + KIND] == CONTACT:
        return project_on_cone_above(x[o + SCALED_MU], x[o + LOWEST], n, s, t)
    if x[o + KIND] == COULOMB_CONTACT:
        return project_by_coulomb(x[o + SCALED_MU], x[o + LOWEST], n, s, t)
    if x[o + KIND] == LINE:
        return min(max(n, x[o + LOWEST]), x[o + HIGHEST]), 0.0, 0.0
    if x[o + KIND] == ROLLING:
        a = project_by_coulomb(1.0, x[o + LOWEST], -1.0, s, t)
        return min(max(n, -x[o + HIGHEST]), x[o + HIGHEST]), a[1], a[2]
    return 0.0, 0.0, 0.0


@formula
def nearest_impulse_derivative(x, o, n, s, t):
    """Return the derivative of `nearest_impulse`."""
    if x[o + KIND] == CONTACT:
        return cone_derivative(x[o + SCALED_MU], x[o + LOWEST], n, s, t)
    if x[o + KIND] == COULOMB_CONTACT:
        return coulomb_derivative(x[o + SCALED_MU], x[o + LOWEST], n, s, t)
    if x[o + KIND] == ROLLING:
        a = disc_derivative(0.0, x[o + LOWEST], s, t, sqrt(s * s + t * t))
        return 1.0 if abs(n) < x[o + HIGHEST] else 0.0, 0.0, 0.0, a[3], a[4], a[5], 0.0, 0.0
    free = x[o + KIND] == LINE and x[o + LOWEST] < n < x[o + HIGHEST]
    return 1.0 if free else 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


@formula
def de_saxce_velocity(x, o):
    """De Saxce's term of the normal velocity, if it represents Coulomb's law."""
    return x[o + ADDED_VELOCITY] if x[o + KIND] == CONTACT else 0.0


@formula
def set_kind(R, old, new):
    """Change all rows of one kind to another."""
    for row in range(R.size[ROWS]):
        if R.row[ROW_NUMBERS * row + KIND] == old:
            R.row[ROW_NUMBERS * row + KIND] = new


@formula
def set_metric(R, rho):
    """Set R of every row: ``rho`` times its mobility, plus its compliance in the normal direction."""
    x = R.row
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        old = x[o + NORMAL_SCALE]
        metric = rho * x[o + MOBILITY]
        x[o + REGULARISATION] = metric
        x[o + NORMAL_SCALE] = sqrt(metric + x[o + SOFTNESS])
        x[o + TANGENT_SCALE] = sqrt(metric)
        x[o + SCALED_MU] = x[o + FRICTION] * x[o + TANGENT_SCALE] / x[o + NORMAL_SCALE]
        x[o + LOWEST] *= x[o + NORMAL_SCALE] / old
        x[o + HIGHEST] *= x[o + NORMAL_SCALE] / old


E, GRADIENT, STEP, SPARE = range(4)  # rows of IslandRows.blocks


@formula
def row_product(R, row, a):
    """G x of a row; x begins at a in IslandRows.blocks."""
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
    """Add G' p of a row to the vector that begins at a in IslandRows.blocks."""
    for e in range(R.entry_p[row], R.entry_p[row + 1]):
        o, b = 18 * e, a + 6 * R.block[e]
        for k in range(6):
            R.blocks[b + k] += R.G[o + k] * n + R.G[o + 6 + k] * s + R.G[o + 12 + k] * t


@formula
def velocities_of_multipliers(R):
    """Compute e from the multipliers."""
    for k in range(6 * R.size[BLOCKS]):
        R.blocks[k] = 0.0
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row + MULTIPLIER
        n, s, t = R.row[o], R.row[o + 1], R.row[o + 2]
        if n != 0.0 or s != 0.0 or t != 0.0:
            add_impulse(R, row, 0, n, s, t)


@formula
def set_targets(R):
    """Compute the scaled y of every row from e."""
    x = R.row
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        n, s, t = row_product(R, row, 0)
        r = x[o + REGULARISATION]
        x[o + SCALED_TARGET] = (r * x[o + MULTIPLIER] - x[o + FREE_VELOCITY] - de_saxce_velocity(x, o) - n) / x[
            o + NORMAL_SCALE
        ]
        x[o + SCALED_TARGET + 1] = (r * x[o + MULTIPLIER + 1] - x[o + FREE_VELOCITY + 1] - s) / x[o + TANGENT_SCALE]
        x[o + SCALED_TARGET + 2] = (r * x[o + MULTIPLIER + 2] - x[o + FREE_VELOCITY + 2] - t) / x[o + TANGENT_SCALE]


@formula
def set_impulses(R):
    """Compute the impulses of every row at y, and the gradient e - sum G' p."""
    x, g = R.row, 6 * R.size[BLOCKS]
    for k in range(g):
        R.blocks[g + k] = R.blocks[k]
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        n, s, t = nearest_impulse(x, o, x[o + SCALED_TARGET], x[o + SCALED_TARGET + 1], x[o + SCALED_TARGET + 2])
        x[o + SCALED_IMPULSE], x[o + SCALED_IMPULSE + 1], x[o + SCALED_IMPULSE + 2] = n, s, t
        if n != 0.0 or s != 0.0 or t != 0.0:
            add_impulse(R, row, g, -n / x[o + NORMAL_SCALE], -s / x[o + TANGENT_SCALE], -t / x[o + TANGENT_SCALE])


@formula
def add_block_product(R, e, f, W, L, at):
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
def add_row_to_matrix(R, row, W, symmetric):
    """Add G' W G of a row to the matrix."""
    k, above = R.pair_p[row], R.L.shape[0] // 2
    for e in range(R.entry_p[row], R.entry_p[row + 1]):
        i = R.block[e]
        add_block_product(R, e, e, W, R.D, 36 * i)
        for f in range(R.entry_p[row], e):
            j, at = R.block[f], 36 * R.pair[k]
            k += 1
            if at < 0:  # both on one block
                add_block_product(R, e, f, W, R.D, 36 * i)
                add_block_product(R, f, e, W, R.D, 36 * i)
                continue
            later, earlier = (e, f) if i > j else (f, e)
            add_block_product(R, later, earlier, W, R.L, at)
            if not symmetric:
                add_block_product(R, earlier, later, W, R.L, above + at)


@formula
def set_unit_matrix(R):
    """Set the matrix to 1."""
    for k in range(R.L.shape[0]):
        R.L[k] = 0.0
    for k in range(R.D.shape[0]):
        R.D[k] = 0.0
    for k in range(R.size[BLOCKS]):
        for i in range(6):
            R.D[36 * k + 7 * i] = 1.0


@formula
def assemble_hessian(R, symmetric):
    """Assemble 1 + sum G' R^-1/2 (derivative) R^-1/2 G."""
    x = R.row
    set_unit_matrix(R)
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        B = nearest_impulse_derivative(x, o, x[o + SCALED_TARGET], x[o + SCALED_TARGET + 1], x[o + SCALED_TARGET + 2])
        if B[0] != 0.0 or B[3] != 0.0 or B[5] != 0.0:
            a, b = 1.0 / x[o + NORMAL_SCALE], 1.0 / x[o + TANGENT_SCALE]
            ab, bb = a * b, b * b
            W = a * a * B[0], ab * B[1], ab * B[2], bb * B[3], bb * B[4], bb * B[5], ab * B[6], ab * B[7]
            add_row_to_matrix(R, row, W, symmetric)


@formula
def set_target_changes(R):
    """Compute the change of the scaled y of every row along the step."""
    x, a = R.row, 12 * R.size[BLOCKS]
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        n, s, t = row_product(R, row, a)
        x[o + TARGET_CHANGE] = -n / x[o + NORMAL_SCALE]
        x[o + TARGET_CHANGE + 1], x[o + TARGET_CHANGE + 2] = -s / x[o + TANGENT_SCALE], -t / x[o + TANGENT_SCALE]


@formula
def slope_along_step(R, a, first, second):
    """Return the derivative of the objective along the step at part a; ``first``, ``second``: e . step, |step|^2."""
    x = R.row
    total = first + a * second
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        n, s, t = x[o + TARGET_CHANGE], x[o + TARGET_CHANGE + 1], x[o + TARGET_CHANGE + 2]
        p = nearest_impulse(
            x, o, x[o + SCALED_TARGET] + a * n, x[o + SCALED_TARGET + 1] + a * s, x[o + SCALED_TARGET + 2] + a * t
        )
        total += p[0] * n + p[1] * s + p[2] * t
    return total


@formula
def island_span(P, O):
    """First and end index of the contacts and of the lines of the selected island."""
    first, last = contact_range(P, O)
    line, end = line_range(P, O)
    return first, last, line, end


@formula
def row_mobility(R, row, kind):
    """Mean change of the row's velocities per own unit impulse."""
    s = 0.0
    for k in range(18 * R.entry_p[row], 18 * R.entry_p[row + 1]):
        s += R.G[k] * R.G[k]
    return s / 3.0 if kind == CONTACT else s


@formula
def fill_rows(P, X, R, span):
    """Fill the data of every row; multipliers are the impulses of the state, made admissible. The metric is 1."""
    x = R.row
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        c, k = row_subject(span, row)
        if k >= 0:
            fill_line(P, X, x, o, k)
        elif k == -2:
            fill_rolling(P, X, x, o, c)
        else:
            fill_contact(P, X, x, o, c)
        x[o + MOBILITY] = row_mobility(R, row, x[o + KIND])
        if not x[o + MOBILITY] > 0.0:
            x[o + KIND], x[o + MOBILITY] = IDLE, 1.0
        x[o + REGULARISATION] = x[o + NORMAL_SCALE] = x[o + TANGENT_SCALE] = 1.0
        if k == -2:
            set_rolling_bounds(R, row, MULTIPLIER)
        p = nearest_impulse(x, o, x[o + MULTIPLIER], x[o + MULTIPLIER + 1], x[o + MULTIPLIER + 2])
        for s in range(3):
            x[o + MULTIPLIER + s] = x[o + SCALED_IMPULSE + s] = p[s]


@formula
def set_rolling_bounds(R, row, at):
    """Set the bounds of rolling and spinning friction from the normal impulse in column ``at`` of the contact."""
    o, c = ROW_NUMBERS * row, ROW_NUMBERS * (row - R.size[BEFORE_ROLLING])
    n = R.row[c + at]
    if at == SCALED_IMPULSE:
        n /= R.row[c + NORMAL_SCALE]
    R.row[o + LOWEST] = R.row[o + FRICTION] * n * R.row[o + NORMAL_SCALE]
    R.row[o + HIGHEST] = R.row[o + ADDED_VELOCITY] * n * R.row[o + NORMAL_SCALE]


@formula
def fill_rolling(P, X, x, o, c):
    """Fill the data of the rolling and spinning friction of a contact."""
    u = contact_angular_velocity(P, X.v, X.wide, c)
    for k in range(3):
        x[o + FREE_VELOCITY + k], x[o + MULTIPLIER + k] = u[k], X.torque[c, k]
    x[o + KIND], x[o + SOFTNESS] = ROLLING, 0.0
    x[o + FRICTION] = x[o + SCALED_MU] = P.turn[c, 0]
    x[o + ADDED_VELOCITY] = P.turn[c, 1]


@formula
def fill_contact(P, X, x, o, c):
    """Fill the data of a contact."""
    u = contact_velocity(P, X.v, X.wide, c)
    for k in range(3):
        x[o + FREE_VELOCITY + k] = u[k] + P.bias[c, k]
        x[o + MULTIPLIER + k] = X.p[c, k]
    x[o + KIND], x[o + ADDED_VELOCITY] = CONTACT, 0.0
    x[o + FRICTION] = x[o + SCALED_MU] = P.mu[c]
    x[o + SOFTNESS], x[o + HIGHEST] = P.soft[c], 0.0
    x[o + LOWEST] = least_normal_impulse(P, c)


@formula
def fill_line(P, X, x, o, k):
    """Fill the data of a line."""
    x[o + FREE_VELOCITY], x[o + FREE_VELOCITY + 1], x[o + FREE_VELOCITY + 2] = (
        line_velocity(P, X.wide, k) + P.line_law.bias[k],
        0.0,
        0.0,
    )
    x[o + MULTIPLIER], x[o + MULTIPLIER + 1], x[o + MULTIPLIER + 2] = X.line[k], 0.0, 0.0
    x[o + KIND], x[o + ADDED_VELOCITY] = LINE, 0.0
    x[o + FRICTION] = x[o + SCALED_MU] = 0.0
    x[o + SOFTNESS], x[o + LOWEST], x[o + HIGHEST] = (
        P.line_law.soft[k],
        P.line_law.lower[k],
        P.line_law.upper[k],
    )


@formula
def write_back_rows(P, X, R, span):
    """Write the multipliers to the state as impulses, and apply them to its velocities."""
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row + MULTIPLIER
        p = R.row[o], R.row[o + 1], R.row[o + 2]
        c, k = row_subject(span, row)
        if k >= 0:
            X.line[k] = p[0]
            apply_line_impulse(P, X.wide, k, p[0])
        elif k == -2:
            X.torque[c, 0], X.torque[c, 1], X.torque[c, 2] = p
            apply_torque_impulse(P, X.v, X.wide, c, p)
        else:
            X.p[c, 0], X.p[c, 1], X.p[c, 2] = p
            if p[0] != 0.0 or p[1] != 0.0 or p[2] != 0.0:
                apply_contact_impulse(P, X.v, X.wide, c, p)


@formula
def missing_impulse(x, o, n, s, t, u, v, w):
    """Distance of the impulse (n, s, t) of a row with velocities u, v, w from nearest(p - u / mobility)."""
    m, r = x[o + MOBILITY] + x[o + SOFTNESS], x[o + NORMAL_SCALE]
    u += x[o + SOFTNESS] * n
    if x[o + KIND] == CONTACT or x[o + KIND] == COULOMB_CONTACT:
        p = project_on_cone_above(x[o + FRICTION], x[o + LOWEST] / r, n - u / m, s - v / m, t - w / m)
    else:
        a, b, c = nearest_impulse(x, o, r * (n - u / m), r * (s - v / m), r * (t - w / m))
        p = a / r, b / r, c / r
    a, b, c = p[0] - n, p[1] - s, p[2] - t
    return sqrt(a * a + b * b + c * c)


@formula
def added_velocity(R, row, coulomb):
    """Term added to the normal velocity of a contact, so that the cone projection represents the law.

    Coulomb's law: mu |u_t| (De Saxce and Feng 1998). Convex form: the terms of rolling and spinning friction, whose
    bounds depend on the normal impulse, that make them parts of its cone. Velocities are in column ROW_VELOCITY.
    """
    x, o, o2 = R.row, ROW_NUMBERS * row + ROW_VELOCITY, ROW_NUMBERS * (row + R.size[BEFORE_ROLLING]) + ROW_VELOCITY
    if coulomb > 0.0:
        return x[ROW_NUMBERS * row + FRICTION] * sqrt(x[o + 1] * x[o + 1] + x[o + 2] * x[o + 2])
    if R.size[BEFORE_ROLLING] == R.size[ROWS]:
        return 0.0
    rolling = x[ROW_NUMBERS * (row + R.size[BEFORE_ROLLING]) + FRICTION] * sqrt(
        x[o2 + 1] * x[o2 + 1] + x[o2 + 2] * x[o2 + 2]
    )
    return -rolling - x[ROW_NUMBERS * (row + R.size[BEFORE_ROLLING]) + ADDED_VELOCITY] * abs(x[o2])


@formula
def rows_residual(R, coulomb):
    """Residual [m/s] and force residual [1] of the scaled impulses, with the velocities in column ROW_VELOCITY.

    The missing impulse is converted to a velocity by the row's mobility, and to a dimensionless number by the largest
    impulse. Torques are converted to impulses of equal energy.
    """
    x, worst, lacking, largest = R.row, 0.0, 0.0, 0.0
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        more, part = added_velocity(R, row, coulomb) if row < R.size[CONTACTS] else 0.0, 1.0
        if row >= R.size[BEFORE_ROLLING]:
            set_rolling_bounds(R, row, SCALED_IMPULSE)
        n, s, t = (
            x[o + SCALED_IMPULSE] / x[o + NORMAL_SCALE],
            x[o + SCALED_IMPULSE + 1] / x[o + TANGENT_SCALE],
            x[o + SCALED_IMPULSE + 2] / x[o + TANGENT_SCALE],
        )
        d = missing_impulse(x, o, n, s, t, x[o + ROW_VELOCITY] + more, x[o + ROW_VELOCITY + 1], x[o + ROW_VELOCITY + 2])
        if row >= R.size[BEFORE_ROLLING]:
            set_rolling_bounds(R, row, MULTIPLIER)
            c = ROW_NUMBERS * (row - R.size[BEFORE_ROLLING])
            part = sqrt(x[o + MOBILITY] / x[c + MOBILITY])
        lacking, largest = max(lacking, part * d), max(largest, part * sqrt(n * n + s * s + t * t))
        d *= x[o + MOBILITY] + x[o + SOFTNESS]
        worst = d if d > worst or d != d else worst
    return worst, lacking / largest if largest > 0.0 else lacking


@formula
def set_row_velocities(R):
    """Compute the velocities of every row at e into column ROW_VELOCITY."""
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        u = row_product(R, row, 0)
        for k in range(3):
            R.row[o + ROW_VELOCITY + k] = u[k] + R.row[o + FREE_VELOCITY + k]


@formula
def velocity_square(R):
    """|e|^2."""
    s = 0.0
    for k in range(6 * R.size[BLOCKS]):
        s += R.blocks[k] * R.blocks[k]
    return s


@formula
def make_dissipative(R):
    """Scale the impulses to minimise 1/2 p' N p + b' p along them, so that they dissipate energy."""
    velocities_of_multipliers(R)
    square, linear = velocity_square(R), 0.0
    for row in range(R.size[ROWS]):
        o = ROW_NUMBERS * row
        for k in range(3):
            linear += R.row[o + FREE_VELOCITY + k] * R.row[o + MULTIPLIER + k]
    a = -linear / square if square > 0.0 else 1.0
    a = min(max(a, 0.0), 1.0)
    for row in range(R.size[ROWS]):
        for k in range(3):
            R.row[ROW_NUMBERS * row + MULTIPLIER + k] *= a


@formula
def set_added_velocities(R, coulomb):
    """Set the terms added to normal velocities, and the bounds of rolling and spinning friction, at the multipliers."""
    for row in range(R.size[CONTACTS]):
        R.row[ROW_NUMBERS * row + ADDED_VELOCITY] = added_velocity(R, row, coulomb)
    for row in range(R.size[BEFORE_ROLLING], R.size[ROWS]):
        set_rolling_bounds(R, row, MULTIPLIER)
