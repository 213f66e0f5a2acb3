"""From impulses to velocities: what a contact or a line sees, and what its impulse does.

Velocities and impulses of a contact are tuples along its frame: normal, two tangential; of its turning: about the
normal, about the two tangential axes. ``v`` (nn, 6 or more) and ``wide`` are any velocities of nodes and of groups.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.vec import add, cross, load3, load9, mtv, mv, neg, put3, scale, sub, symmetric
from .problem import BLOCK, NONE, SOFT


@formula
def at_point(v, i, P, c, side):
    """Velocity of a node at the contact."""
    return add(load3(v, i, 0), cross(load3(v, i, 3), load3(P.arm, c, 3 * side)))


@formula
def seen(P, v, wide, c):
    """D v of contact c [m/s], without bias: velocity of side 2 less that of side 1."""
    i, j = P.at[c, 0], P.at[c, 1]
    u = (0.0, 0.0, 0.0)
    if j >= 0:
        u = at_point(v, j, P, c, 1)
    if i >= 0:
        u = sub(u, at_point(v, i, P, c, 0))
    u = along(P, c, u)
    return add(u, grouped(P, wide, c, 0)) if i < NONE or j < NONE else u


@formula
def along(P, c, x):
    """Components along the contact's frame of a vector in the world."""
    return mv(load9(P.frame, c, 0), x)


@formula
def across(P, c, n, s, t):
    """The vector in the world with these components along the contact's frame."""
    return mtv(load9(P.frame, c, 0), (n, s, t))


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
def block_at(A, i, o):
    """A symmetric matrix that stands as xx yy zz xy xz yz in row i of a table, from column o, for ``vec.symmetric``."""
    return (A[i, o], A[i, o + 3], A[i, o + 4], A[i, o + 1], A[i, o + 5], A[i, o + 2])


@formula
def put_block(A, i, o, a):
    """Write a symmetric matrix, as ``vec.symmetric`` takes it, where `block_at` reads it."""
    A[i, o], A[i, o + 3], A[i, o + 4], A[i, o + 1], A[i, o + 5], A[i, o + 2] = a


@formula
def turned(P, i, t):
    """What an angular impulse changes the angular velocity of node i by."""
    return symmetric(block_at(P.node, i, BLOCK), t)


@formula
def twist_node(P, v, i, t):
    """Change a node's angular velocity by an angular impulse."""
    put3(v, i, 3, add(load3(v, i, 3), turned(P, i, t)))


@formula
def push_node(P, v, c, side, f):
    """Change a node's velocities by an impulse at the contact."""
    i = P.at[c, side]
    put3(v, i, 0, add(load3(v, i, 0), scale(P.node[i, 0], f)))
    twist_node(P, v, i, cross(load3(P.arm, c, 3 * side), f))


@formula
def push(P, v, wide, c, p):
    """Change the velocities by the impulse p of contact c."""
    i, j = P.at[c, 0], P.at[c, 1]
    f = across(P, c, p[0], p[1], p[2])
    if j >= 0:
        push_node(P, v, c, 1, f)
    if i >= 0:
        push_node(P, v, c, 0, neg(f))
    if i < NONE or j < NONE:
        push_groups(P, wide, c, 0, p)


@formula
def seen_turning(P, v, wide, c):
    """Relative angular velocity of contact c [rad/s] along its frame."""
    i, j = P.at[c, 0], P.at[c, 1]
    w = (0.0, 0.0, 0.0)
    if j >= 0:
        w = load3(v, j, 3)
    if i >= 0:
        w = sub(w, load3(v, i, 3))
    w = along(P, c, w)
    return add(w, grouped(P, wide, c, 3)) if i < NONE or j < NONE else w


@formula
def push_turning(P, v, wide, c, p):
    """Change the velocities by the torque impulse p of contact c [N m s]."""
    i, j = P.at[c, 0], P.at[c, 1]
    t = across(P, c, p[0], p[1], p[2])
    if j >= 0:
        twist_node(P, v, j, t)
    if i >= 0:
        twist_node(P, v, i, neg(t))
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
