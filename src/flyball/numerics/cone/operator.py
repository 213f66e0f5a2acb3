"""From impulses to velocities: what a contact or a line sees, and what its impulse does.

Velocities and impulses of a contact are tuples along its frame: normal, two tangential; of its turning: about the
normal, about the two tangential axes. ``v`` (nn, 6 or more) and ``wide`` are any velocities of nodes and of groups.
"""

from __future__ import annotations

from ...compiler.jit import formula
from .problem import NONE, SOFT


@formula
def seen(P, v, wide, c):
    """D v of contact c [m/s], without bias: velocity of side 2 less that of side 1."""
    i, j = P.at[c, 0], P.at[c, 1]
    x, y, z = 0.0, 0.0, 0.0
    if j >= 0:
        a, b, d = P.arm[c, 3], P.arm[c, 4], P.arm[c, 5]
        x += v[j, 0] + v[j, 4] * d - v[j, 5] * b
        y += v[j, 1] + v[j, 5] * a - v[j, 3] * d
        z += v[j, 2] + v[j, 3] * b - v[j, 4] * a
    if i >= 0:
        a, b, d = P.arm[c, 0], P.arm[c, 1], P.arm[c, 2]
        x -= v[i, 0] + v[i, 4] * d - v[i, 5] * b
        y -= v[i, 1] + v[i, 5] * a - v[i, 3] * d
        z -= v[i, 2] + v[i, 3] * b - v[i, 4] * a
    un, us, ut = along(P, c, x, y, z)
    if i < NONE or j < NONE:
        a, b, d = grouped(P, wide, c, 0)
        un, us, ut = un + a, us + b, ut + d
    return un, us, ut


@formula
def along(P, c, x, y, z):
    """Components along the contact's frame of a vector in the world."""
    return (
        P.frame[c, 0] * x + P.frame[c, 1] * y + P.frame[c, 2] * z,
        P.frame[c, 3] * x + P.frame[c, 4] * y + P.frame[c, 5] * z,
        P.frame[c, 6] * x + P.frame[c, 7] * y + P.frame[c, 8] * z,
    )


@formula
def across(P, c, n, s, t):
    """The vector in the world with these components along the contact's frame."""
    return (
        P.frame[c, 0] * n + P.frame[c, 3] * s + P.frame[c, 6] * t,
        P.frame[c, 1] * n + P.frame[c, 4] * s + P.frame[c, 7] * t,
        P.frame[c, 2] * n + P.frame[c, 5] * s + P.frame[c, 8] * t,
    )


@formula
def grouped(P, wide, c, first):
    """What the groups' velocities add to three velocities of a contact: rows ``first`` and on of J."""
    x, y, z = 0.0, 0.0, 0.0
    for side in range(2):
        e = P.block[c, side]
        if P.at[c, side] < NONE and e >= 0:
            g = -2 - P.at[c, side]
            w, n = P.group[g], P.group[g + 1] - P.group[g]
            e += first * n
            sign = 2.0 * side - 1.0
            for k in range(n):
                a = sign * wide[w + k]
                x += P.J[e + k] * a
                y += P.J[e + n + k] * a
                z += P.J[e + 2 * n + k] * a
    return x, y, z


@formula
def push_groups(P, wide, c, first, p):
    """Change the groups' velocities by three impulses p of a contact."""
    for side in range(2):
        e = P.block[c, side]
        if P.at[c, side] < NONE and e >= 0:
            g = -2 - P.at[c, side]
            w, n = P.group[g], P.group[g + 1] - P.group[g]
            e += first * n
            sign = 2.0 * side - 1.0
            a, b, d = sign * p[0], sign * p[1], sign * p[2]
            for k in range(n):
                wide[w + k] += P.Y[e + k] * a + P.Y[e + n + k] * b + P.Y[e + 2 * n + k] * d


@formula
def twist_node(P, v, i, x, y, z):
    """Change a node's angular velocity by an angular impulse."""
    v[i, 3] += P.node[i, 1] * x + P.node[i, 4] * y + P.node[i, 5] * z
    v[i, 4] += P.node[i, 4] * x + P.node[i, 2] * y + P.node[i, 6] * z
    v[i, 5] += P.node[i, 5] * x + P.node[i, 6] * y + P.node[i, 3] * z


@formula
def push_node(P, v, c, side, x, y, z):
    """Change a node's velocities by an impulse at the contact."""
    i, m = P.at[c, side], P.node[P.at[c, side], 0]
    a, b, d = P.arm[c, 3 * side], P.arm[c, 3 * side + 1], P.arm[c, 3 * side + 2]
    v[i, 0] += m * x
    v[i, 1] += m * y
    v[i, 2] += m * z
    twist_node(P, v, i, b * z - d * y, d * x - a * z, a * y - b * x)


@formula
def push(P, v, wide, c, p):
    """Change the velocities by the impulse p of contact c."""
    i, j = P.at[c, 0], P.at[c, 1]
    x, y, z = across(P, c, p[0], p[1], p[2])
    if j >= 0:
        push_node(P, v, c, 1, x, y, z)
    if i >= 0:
        push_node(P, v, c, 0, -x, -y, -z)
    if i < NONE or j < NONE:
        push_groups(P, wide, c, 0, p)


@formula
def seen_turning(P, v, wide, c):
    """Relative angular velocity of contact c [rad/s] along its frame."""
    i, j = P.at[c, 0], P.at[c, 1]
    x, y, z = 0.0, 0.0, 0.0
    if j >= 0:
        x, y, z = v[j, 3], v[j, 4], v[j, 5]
    if i >= 0:
        x, y, z = x - v[i, 3], y - v[i, 4], z - v[i, 5]
    un, us, ut = along(P, c, x, y, z)
    if i < NONE or j < NONE:
        a, b, d = grouped(P, wide, c, 3)
        un, us, ut = un + a, us + b, ut + d
    return un, us, ut


@formula
def push_turning(P, v, wide, c, p):
    """Change the velocities by the torque impulse p of contact c [N m s]."""
    i, j = P.at[c, 0], P.at[c, 1]
    x, y, z = across(P, c, p[0], p[1], p[2])
    if j >= 0:
        twist_node(P, v, j, x, y, z)
    if i >= 0:
        twist_node(P, v, i, -x, -y, -z)
    if i < NONE or j < NONE:
        push_groups(P, wide, c, 3, p)


@formula
def seen_line(P, wide, k):
    """J v of line k, without bias and compliance."""
    g, e = P.line_at[k, 0], P.line_at[k, 1]
    w, u = P.group[g], 0.0
    for s in range(P.group[g + 1] - w):
        u += P.J[e + s] * wide[w + s]
    return u


@formula
def push_line(P, wide, k, p):
    """Change the velocities by the impulse p of line k."""
    g, e = P.line_at[k, 0], P.line_at[k, 1]
    w = P.group[g]
    for s in range(P.group[g + 1] - w):
        wide[w + s] += P.Y[e + s] * p


@formula
def diagonal_of_line(P, k):
    """Velocity of line k for its own unit impulse, compliance included."""
    g, e, u = P.line_at[k, 0], P.line_at[k, 1], P.line_x[k, SOFT]
    for s in range(P.group[g + 1] - P.group[g]):
        u += P.J[e + s] * P.Y[e + s]
    return u
