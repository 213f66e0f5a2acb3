"""Impacts one after the other: the contact that closes fastest is hit first, until none closes.

What Newton's cradle needs, and billiards. Each impact is one of two bodies, by Poisson's law: compression until the
contact's normal velocity is gone, expansion with e times its normal impulse, friction in each within its cone (Routh's
impact in two parts, each inelastic along the tangents).
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..contact.tables import FOUND, GAP
from ..math.scalar import sqrt
from ..numerics.cone.diagonal import diagonal
from ..numerics.cone.operator import push, seen
from .tables import BEFORE_KICK, FLAT, HIT, STEP

MANY = 200  # impacts for each contact, after which what still closes is left to the step
NOTHING = 1e-13  # part of what an impulse moves along all three directions that is none
STILL = 1e-12  # closing speed that is none, in parts of the fastest


@formula
def one_after_the_other(R, Z, X, C, pace, now):
    """Impacts of the contacts that are hit; impulses in ``Z.p``, velocities in ``X``. Returns whether all are over.

    Their restitutions stand in ``R.least``. What closes within the step after others' impacts is hit too.
    """
    n = C.count[FOUND]
    for c in range(n):
        for i in range(3):
            Z.p[c, i] = 0.0
    fastest = 0.0
    for c in range(n):
        if now[c, HIT] > 0.0:
            fastest = max(fastest, -now[c, BEFORE_KICK])
    for _ in range(MANY * n):
        first, most = -1, STILL * fastest
        for c in range(n):
            if now[c, HIT] > 0.0 or R.least[c] > 0.0:
                u = seen(R, X.v, X.wide, c)
                there = now[c, HIT] > 0.0 or C.x[c, GAP] + pace.real[STEP] * u[0] <= pace.real[FLAT]
                if there and -u[0] > most:
                    first, most = c, -u[0]
        if first < 0:
            return True
        now[first, HIT] = 1.0
        hit_alone(R, Z, X, first, R.least[first])
    return False


@formula
def hit_alone(R, Z, X, c, e):
    """One contact's impact."""
    D = diagonal(R, c)
    n = compress(R, Z, X, c, D)
    u = seen(R, X.v, X.wide, c)
    p = within(R, c, D, e * n, u)
    add_impulse(R, Z, X, c, p)


@formula
def part(d, D):
    """1 / d of a diagonal entry d of D; 0 for a direction along which joints let nothing move."""
    return 1.0 / d if d > NOTHING * (D[0] + D[3] + D[5]) else 0.0


@formula
def compress(R, Z, X, c, D):
    """Impulses that end the approach; the normal one is returned.

    Normal and tangential impulses act on each other's velocities: they are taken in turn until they agree.
    """
    total = 0.0
    s, t = 0.0, 0.0
    for _ in range(MANY):
        u = seen(R, X.v, X.wide, c)
        d = -u[0] * part(D[0], D)
        if total + d < 0.0:
            d = -total
        add_impulse(R, Z, X, c, (d, 0.0, 0.0))
        total += d
        u = seen(R, X.v, X.wide, c)
        ps = s - (u[1] + R.bias[c, 1]) * part(D[3], D)
        pt = t - (u[2] + R.bias[c, 2]) * part(D[5], D)
        size = sqrt(ps * ps + pt * pt)
        if size > R.mu[c] * total:
            ps, pt = ps * R.mu[c] * total / size, pt * R.mu[c] * total / size
        add_impulse(R, Z, X, c, (0.0, ps - s, pt - t))
        change = abs(d) + abs(ps - s) + abs(pt - t)
        s, t = ps, pt
        if change <= 1e-14 * total:
            break
    return total


@formula
def within(R, c, D, n, u):
    """Impulses of expansion: n along the normal, and along the tangents what ends sliding, within the cone."""
    a, b = -(u[1] + R.bias[c, 1] + D[1] * n), -(u[2] + R.bias[c, 2] + D[2] * n)
    s, t = a * part(D[3], D), b * part(D[5], D)
    d = D[3] * D[5] - D[4] * D[4]
    if d > NOTHING * D[3] * D[5] and s != 0.0 and t != 0.0:
        s, t = (D[5] * a - D[4] * b) / d, (D[3] * b - D[4] * a) / d
    size = sqrt(s * s + t * t)
    if size > R.mu[c] * n:
        s, t = s * R.mu[c] * n / size, t * R.mu[c] * n / size
    return (n, s, t)


@formula
def add_impulse(R, Z, X, c, p):
    """An impulse at contact c."""
    push(R, X.v, X.wide, c, p)
    for i in range(3):
        Z.p[c, i] += p[i]
