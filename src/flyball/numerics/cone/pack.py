"""Contacts in the order of sweeps, each all in one place: what Gauss-Seidel reads.

Contacts of one kind stand together, the kinds with the least to do first. Within a kind those that follow each other
are taken from distant places of the list, so that they share no body and the processor works at several of them at
once.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import sqrt
from ...math.vec import cross, dot
from .diagonal import axis, diagonal
from .operator import push, push_turning, turned
from .problem import NONE, ROUND
from .projection import least_of, share

SMOOTH_BALL, BALL, SMOOTH, ROUGH, ANY, KINDS = range(6)
WIDTH_BALL, WIDTH_SMOOTH = 16, 20  # numbers of a contact; the rest have 32
STREAMS = 4
PARALLEL = 1e-20  # square of the sine below which an arm is along the normal: poses far from the origin are rounded
# columns of Scratch.own
SLOW, SPUN = 6, 7  # 1/m, mean of the block's diagonal
# where a ball's numbers stand
R1, R2, B_BIAS, B_SOFT, B_IN, B_IT, B_MU, B_RATIO, B_P, B_T, B_LEAST = 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 15
# of a smooth contact: normal, torques of a unit impulse on both sides, what they turn by
C1, C2, G1, G2, S_BIAS, S_SOFT, S_IN, S_P, S_LEAST = 3, 6, 9, 12, 15, 16, 17, 18, 19
# of a rough one: frame, arms, bias; what `local_steps` says; impulse
ARM1, ARM2, BIAS, SOFT, IN, NS, NT = 9, 12, 15, 18, 19, 20, 21
ISS, IST, ITT, SLIDE, RATIO, MU, IMPULSE, LEAST = 22, 23, 24, 25, 26, 27, 28, 31


@formula
def take_nodes(P, X, W, nodes):
    """Velocities of the nodes ``member[first:last]`` and what each weighs into their own rooms."""
    for e in range(nodes[0], nodes[1]):
        i = P.member[e]
        for k in range(6):
            W.own[i, k] = X.v[i, k]
            W.free[i, k] = X.v[i, k]
            W.inner[i, k] = P.node[i, 1 + k]
        W.own[i, SLOW] = P.node[i, 0]
        W.own[i, SPUN] = (P.node[i, 1] + P.node[i, 2] + P.node[i, 3]) / 3.0
    for k in range(8):
        W.own[P.size[1], k], W.inner[P.size[1], k], W.free[P.size[1], k] = 0.0, 0.0, 0.0


@formula
def along_normal(P, c, side):
    """Whether the arm is along the normal, and its length in that direction."""
    a, b, d = P.arm[c, 3 * side], P.arm[c, 3 * side + 1], P.arm[c, 3 * side + 2]
    x, y, z = P.frame[c, 0], P.frame[c, 1], P.frame[c, 2]
    r = a * x + b * y + d * z
    a, b, d = a - r * x, b - r * y, d - r * z
    return a * a + b * b + d * d <= PARALLEL * r * r, r


@formula
def kind_of(P, W, c, rubbing):
    """What is to be done for a contact, the arms of balls in W.rows[0]; ``rubbing``: 1 if none is taken
    as smooth, 2 if none as one of balls either.
    """
    i, j = P.at[c, 0], P.at[c, 1]
    if i < NONE or j < NONE or P.turn.shape[0] > 0:
        return ANY
    if rubbing > 1:
        return ROUGH
    first, second = True, True
    W.rows[0, c, 1], W.rows[0, c, 2] = 0.0, 0.0
    if i >= 0:
        first, W.rows[0, c, 1] = along_normal(P, c, 0)
    if j >= 0:
        second, W.rows[0, c, 2] = along_normal(P, c, 1)
    if P.mu[c] == 0.0 and not rubbing:
        return SMOOTH_BALL if first and second else SMOOTH
    if not (first and second) or P.bias[c, 1] != 0.0 or P.bias[c, 2] != 0.0:
        return ROUGH
    if (i < 0 or P.node[i, 0] == 0.0) and (j < 0 or P.node[j, 0] == 0.0):
        return ROUGH
    alike = (i < 0 or P.node[i, ROUND] == 1.0) and (j < 0 or P.node[j, ROUND] == 1.0)
    x, y, z = P.frame[c, 6], P.frame[c, 7], P.frame[c, 8]
    return BALL if alike and abs(x * x + y * y + z * z - 1.0) < 1e-12 else ROUGH


@formula
def width(kind):
    """Numbers of a contact of a kind."""
    if kind == SMOOTH_BALL or kind == BALL:
        return WIDTH_BALL
    return WIDTH_SMOOTH if kind == SMOOTH else 32


@formula
def shuffled(e, m):
    """Where the e-th of m stands in a sweep."""
    q = m // STREAMS
    if e < q * STREAMS:
        return (e % q) * STREAMS + e // q
    return e


@formula
def pack_ball(P, X, W, c, place):
    """A contact of balls."""
    k, i, j, r1, r2 = W.pack, P.at[c, 0], P.at[c, 1], W.rows[0, c, 1], -W.rows[0, c, 2]
    dn, dt, p, q = 0.0, 0.0, X.p[c, 1], X.p[c, 2]
    for s in range(3):
        k[place + s] = P.frame[c, s]
        k[place + B_T + s] = P.frame[c, 3 + s] * p + P.frame[c, 6 + s] * q
    if i >= 0:
        dn, dt = dn + P.node[i, 0], dt + r1 * r1 * P.node[i, 1]
    if j >= 0:
        dn, dt = dn + P.node[j, 0], dt + r2 * r2 * P.node[j, 1]
    dt += dn
    k[place + R1], k[place + R2] = r1, r2
    k[place + B_BIAS], k[place + B_SOFT] = P.bias[c, 0], P.soft[c]
    k[place + B_IN] = 1.0 / (dn + P.soft[c]) if dn > 0.0 else 0.0
    k[place + B_IT] = 1.0 / dt if dt > 0.0 else 0.0
    k[place + B_MU], k[place + B_RATIO] = P.mu[c], dt * k[place + B_IN]
    k[place + B_P], k[place + B_LEAST] = X.p[c, 0], least_of(P, c)


@formula
def pack_smooth(P, W, c, place):
    """A contact without friction between any nodes."""
    k, n = W.pack, axis(P, c, 0)
    d = P.soft[c]
    for side in range(2):
        i = P.at[c, side]
        a = P.arm[c, 3 * side], P.arm[c, 3 * side + 1], P.arm[c, 3 * side + 2]
        r, g = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if i >= 0:
            r = cross(a, n)
            g = turned(P, i, r)
            d += P.node[i, 0] + dot(r, g)
        for s in range(3):
            k[place + s] = n[s]
            k[place + C1 + 3 * side + s] = r[s]
            k[place + G1 + 3 * side + s] = g[s]
    k[place + S_BIAS], k[place + S_SOFT] = P.bias[c, 0], P.soft[c]
    k[place + S_IN] = 1.0 / d if d > P.soft[c] else 0.0


@formula
def pack_rough(P, coulomb, W, c, place):
    """A contact with friction of any kind."""
    k, D = W.pack, diagonal(P, c)
    for s in range(9):
        k[place + s] = P.frame[c, s]
    for s in range(6):
        k[place + ARM1 + s] = P.arm[c, s]
    for s in range(3):
        k[place + BIAS + s] = P.bias[c, s]
    k[place + SOFT], k[place + MU] = P.soft[c], P.mu[c]
    size = D[0] + D[3] + D[5]
    W.rows[1, c, 0] = 3.0 / (size + P.soft[c]) if size > 0.0 else 0.0
    steps = local_steps(D, P.soft[c], coulomb)
    for s in range(8):
        k[place + IN + s] = steps[s]


@formula
def local_steps(D, soft, coulomb):
    """Inverse of nn, ns, nt, the inverse of the tangential block, a step of one size for it, its ratio to nn.

    For the convex form (``coulomb`` 0) those of a diagonal block that is nowhere less than D: with c = |(ns, nt)| and l
    the larger eigenvalue of the tangential block, D <= (1 + c / sqrt(nn l)) diag(nn, l, l).
    """
    nn, ns, nt, ss, st, tt = D[0] + soft, D[1], D[2], D[3], D[4], D[5]
    if not nn > soft:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    half = 0.5 * (ss - tt)
    most = 0.5 * (ss + tt) + sqrt(half * half + st * st)
    if most <= 1e-12 * nn:
        return 1.0 / nn, ns, nt, 0.0, 0.0, 0.0, 0.0, 0.0
    if not coulomb:
        more = 1.0 + sqrt((ns * ns + nt * nt) / (nn * most))
        return 1.0 / (more * nn), ns, nt, 0.0, 0.0, 0.0, 1.0 / (more * most), most / nn
    det = ss * tt - st * st
    if det <= 1e-12 * most * most:  # one direction only in which it can slide
        det, ss, st, tt = most * most, tt, -st, ss
    return 1.0 / nn, ns, nt, tt / det, -st / det, ss / det, 1.0 / most, most / nn


@formula
def count_kinds(P, W, first, last, rubbing):
    """How many contacts there are of each kind; the kind of each is left in W.rows[0, c, 0]."""
    a, b, d, e, f = 0, 0, 0, 0, 0
    for c in range(first, last):
        kind = kind_of(P, W, c, rubbing)
        W.rows[0, c, 0] = kind
        if kind == SMOOTH_BALL:
            a += 1
        elif kind == BALL:
            b += 1
        elif kind == SMOOTH:
            d += 1
        elif kind == ROUGH:
            e += 1
        else:
            f += 1
    return a, b, d, e, f


@formula
def pack(P, X, W, coulomb, first, many):
    """Put contacts in their order, and their impulses on the velocities in W.own and X.wide."""
    begin, at = 0, 0  # first visit and first number of a kind
    last = first + many[0] + many[1] + many[2] + many[3] + many[4]
    for kind in range(KINDS):
        e, m, wide = 0, many[kind], width(kind)
        for c in range(first, last if m > 0 else first):
            if W.rows[0, c, 0] == kind:
                visit = shuffled(e, m)
                e += 1
                put(P, X, W, coulomb, c, kind, begin + visit, at + wide * visit)
        begin, at = begin + m, at + wide * m


@formula
def admit(P, X, c):
    """Make an impulse to start from one of the cone: where it presses less, or not, its friction is less."""
    n = X.p[c, 0] if X.p[c, 0] > 0.0 else 0.0  # nan too
    n = max(n, least_of(P, c))
    a, b = X.p[c, 1], X.p[c, 2]
    r = sqrt(a * a + b * b)
    part = share(n, P.mu[c], r) if n > 0.0 and r == r else 0.0
    X.p[c, 0], X.p[c, 1], X.p[c, 2] = n, part * a if part > 0.0 else 0.0, part * b if part > 0.0 else 0.0
    if P.turn.shape[0] > 0:
        z, a, b = X.torque[c, 0], X.torque[c, 1], X.torque[c, 2]
        roll = share(n, P.turn[c, 0], sqrt(a * a + b * b)) if n > 0.0 else 0.0
        spin = share(n, P.turn[c, 1], abs(z)) if n > 0.0 else 0.0
        X.torque[c, 0], X.torque[c, 1], X.torque[c, 2] = spin * z, roll * a, roll * b


@formula
def put(P, X, W, coulomb, c, kind, visit, place):
    """One contact, with its impulse acting."""
    i, j = P.at[c, 0], P.at[c, 1]
    i, j = i if i >= 0 else P.size[1], j if j >= 0 else P.size[1]
    W.sides[visit, 0], W.sides[visit, 1], W.sides[visit, 2] = i, j, c
    admit(P, X, c)
    k = W.pack
    if kind == SMOOTH_BALL or kind == BALL:
        pack_ball(P, X, W, c, place)
        if k[place + B_P] != 0.0:
            change_balls(
                k, W.own, i, j, place, (k[place + B_P], k[place + B_T], k[place + B_T + 1], k[place + B_T + 2])
            )
        return
    p = X.p[c, 0], X.p[c, 1], X.p[c, 2]
    if kind == SMOOTH:
        pack_smooth(P, W, c, place)
        k[place + S_P], k[place + S_LEAST] = p[0], least_of(P, c)
    else:
        pack_rough(P, coulomb, W, c, place)
        k[place + LEAST] = least_of(P, c)
        for s in range(3):
            k[place + IMPULSE + s] = p[s]
    if p[0] != 0.0 or p[1] != 0.0 or p[2] != 0.0:
        push(P, W.own, X.wide, c, p)
    if P.turn.shape[0] > 0:
        push_turning(P, W.own, X.wide, c, (X.torque[c, 0], X.torque[c, 1], X.torque[c, 2]))


@formula
def change_balls(k, v, i, j, at, p):
    """What an impulse of a contact of balls does: normal part, tangential vector in the world."""
    x, y, z, r1, r2 = k[at], k[at + 1], k[at + 2], k[at + R1], k[at + R2]
    n, a, b, c = p
    e, f, g = y * c - z * b, z * a - x * c, x * b - y * a  # n x tangential
    a, b, c = a + n * x, b + n * y, c + n * z
    m, r = v[j, SLOW], r2 * v[j, SPUN]
    v[j, 0] += m * a
    v[j, 1] += m * b
    v[j, 2] += m * c
    v[j, 3] -= r * e
    v[j, 4] -= r * f
    v[j, 5] -= r * g
    m, r = v[i, SLOW], r1 * v[i, SPUN]
    v[i, 0] -= m * a
    v[i, 1] -= m * b
    v[i, 2] -= m * c
    v[i, 3] -= r * e
    v[i, 4] -= r * f
    v[i, 5] -= r * g
