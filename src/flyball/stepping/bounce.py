"""Restitution: impacts are over before a step begins, where a contact closes within it.

Contacts that close within the step, faster than smooth forces make them, are hit with the velocities of the start:

- Poisson: compression (an inelastic impact with impulses p_c), then expansion with normal impulses of at least e p_c
  and friction for these (Pfeiffer and Glocker, 1996, section 8.3);
- Newton: u+ >= -e u- normal to the contact; Moreau: the same along all three directions.

No law may add energy: expansion is taken only as far as what the compression lost.
"""

from __future__ import annotations

from ..compiler.door import enter
from ..compiler.jit import formula
from ..contact.surfaces import RESTITUTION
from ..contact.tables import FOUND, GAP, MATERIAL, SHAPE_1, SHAPE_2
from ..math.scalar import sqrt
from ..numerics.cone.operator import across, seen
from ..numerics.cone.problem import ENOUGH, MOST, NONE
from .penalty import stiffness
from .sequence import one_after_the_other
from .tables import (
    BEFORE_KICK,
    BOUNCE,
    ENOUGH_V,
    FLAT,
    GRAVITY,
    HIT,
    IMPACTS,
    KICK,
    LAW,
    LOST_FRICTION,
    LOST_IMPACT,
    MOREAU,
    NO_RESTITUTION,
    POISSON,
    REDUCED,
    SEQUENTIAL,
    SLOWEST,
    STEP,
    SWEEPS,
    YIELDING,
)

ROUNDING = 1e-12
MORE = 4  # times as many iterations as for velocities that are warm started
SHARE = 2.0  # times the speed that gravity makes in a step: what is slower rests


@formula
def elasticity(G, C, L, c):
    """Restitution of contact c."""
    return L.pair[G.shape_i[C.at[c, SHAPE_1], MATERIAL], G.shape_i[C.at[c, SHAPE_2], MATERIAL], RESTITUTION]


@formula
def bounce(G, C, at, bias, R, Z, E, X, W, O, F, L, pace, now):
    """Impacts; velocities in ``X.v`` and ``X.wide`` are those after them. Returns whether there were any.

    ``R`` is the problem with biases and least normal impulses of its own, ``Z`` the state of compression, which shares
    its velocities with ``X``, ``E`` that of expansion.
    """
    if pace.count[LAW] == NO_RESTITUTION or not hits(G, C, at, bias, R, X, L, pace, now):
        return False
    poisson = pace.count[LAW] == POISSON
    if pace.count[SEQUENTIAL] != 0:
        for c in range(C.count[FOUND]):
            R.least[c] = elasticity(G, C, L, c)
        if not one_after_the_other(R, Z, X, C, now):
            pace.count[REDUCED] += 1
        close(R, Z, X, C, pace, now)
        return True
    solve_afresh(pace.door[BOUNCE], R, Z, W, O, F, pace)
    spent = power(R, Z, X.v, X.wide, C, now)
    if poisson:
        for c in range(C.count[FOUND]):
            R.least[c] = elasticity(G, C, L, c) * Z.p[c, 0] if now[c, HIT] > 0.0 else 0.0
        copy_velocities(X, E)
        solve_afresh(pace.door[BOUNCE], R, E, W, O, F, pace)
        expand(R, E, X, C, pace, spent)
        for c in range(C.count[FOUND]):
            for i in range(3):
                Z.p[c, i] += E.p[c, i]
    close(R, Z, X, C, pace, now)
    return True


@formula
def copy_velocities(X, E):
    """E's velocities are X's."""
    for k in range(X.v.shape[0]):
        for i in range(6):
            E.v[k, i] = X.v[k, i]
    for k in range(X.wide.shape[0]):
        E.wide[k] = X.wide[k]


@formula
def hits(G, C, at, bias, R, X, L, pace, now):
    """Whether there are impacts; biases of the contacts that are hit, and their velocities before in ``now``."""
    h = pace.real[STEP]
    g0, g1, g2 = pace.real[GRAVITY], pace.real[GRAVITY + 1], pace.real[GRAVITY + 2]
    slowest = max(pace.real[SLOWEST], SHARE * h * sqrt(g0 * g0 + g1 * g1 + g2 * g2))
    found = False
    law = pace.count[LAW]
    for c in range(C.count[FOUND]):
        R.least[c] = 0.0
        gives_way = pace.count[YIELDING] != 0 and stiffness(G, C, L, c) > 0.0
        for i in range(2):  # what gives way has no impulse in no time
            R.at[c, i] = NONE if gives_way else at[c, i]
        for i in range(3):
            now[c, KICK + i] = 0.0
        u = seen(R, X.v, X.wide, c)
        for i in range(3):
            now[c, BEFORE_KICK + i] = u[i]
            R.bias[c, i] = bias[c, i]
        e = elasticity(G, C, L, c)
        now[c, HIT] = 0.0
        plain = pace.count[SEQUENTIAL] != 0 and C.x[c, GAP] <= pace.real[FLAT]
        if gives_way:
            R.bias[c, 0] = 0.0
            continue
        flat = pace.real[FLAT] if plain else 0.0  # what rests against what is hit is hit by it
        if (e > 0.0 or plain) and C.x[c, GAP] + h * u[0] <= flat:
            now[c, HIT] = 1.0
            found = found or (e > 0.0 and u[0] < -slowest)
            R.bias[c, 0] = 0.0
            if law != POISSON and u[0] < 0.0:
                R.bias[c, 0] = e * u[0]
                for i in range(1, 3 if law == MOREAU else 1):
                    R.bias[c, i] += e * u[i]
    return found


@formula
def solve_afresh(address, R, Z, W, O, F, pace):
    """Solve from zero impulses."""
    for c in range(R.size[0]):
        for i in range(3):
            Z.p[c, i] = 0.0
        for i in range(3 if Z.torque.shape[0] > 0 else 0):
            Z.torque[c, i] = 0.0
    for k in range(R.size[3]):
        Z.line[k] = 0.0
    O.count[MOST] = MORE * pace.count[SWEEPS]
    O.real[ENOUGH] = pace.real[ENOUGH_V]
    enter(address, R, Z, W, O, F.impacts, 0)


@formula
def power(R, Z, v, wide, C, now):
    """Energy that the impulses of ``Z`` gave: p . (u- + u+) / 2 of every contact, its surfaces' own motion included."""
    total = 0.0
    for c in range(C.count[FOUND]):
        if Z.p[c, 0] > 0.0:
            u = seen(R, v, wide, c)
            for i in range(3):
                own = R.bias[c, i] if i > 0 else 0.0
                total += Z.p[c, i] * (0.5 * (u[i] + now[c, BEFORE_KICK + i]) + own)
    return total


@formula
def expand(R, E, X, C, pace, spent):
    """Velocities after expansion: those of ``E``, or between X's and these where that is all the energy there is.

    On the way s from X to E it grows by a s + b s^2, a = p . u, b = p . (u+ - u) / 2. All of the way is allowed by the
    constraints, which are convex.
    """
    a, b = 0.0, 0.0
    for c in range(C.count[FOUND]):
        if E.p[c, 0] > 0.0:
            u = seen(R, X.v, X.wide, c)
            w = seen(R, E.v, E.wide, c)
            for i in range(3):
                own = R.bias[c, i] if i > 0 else 0.0
                a += E.p[c, i] * (u[i] + own)
                b += 0.5 * E.p[c, i] * (w[i] - u[i])
    s = 1.0
    there = max(0.0, -spent)
    if a + b > there * (1.0 + ROUNDING) and b > 0.0:
        s = (sqrt(a * a + 4.0 * b * there) - a) / (2.0 * b)
        s = min(1.0, max(0.0, s))
        pace.count[REDUCED] += 1
    for k in range(X.v.shape[0]):
        for i in range(6):
            X.v[k, i] += s * (E.v[k, i] - X.v[k, i])
    for k in range(X.wide.shape[0]):
        X.wide[k] += s * (E.wide[k] - X.wide[k])
    for c in range(C.count[FOUND]):
        for i in range(3):
            E.p[c, i] *= s


@formula
def close(R, Z, X, C, pace, now):
    """Impulses of the impacts, and what was lost in them."""
    for c in range(C.count[FOUND]):
        u = seen(R, X.v, X.wide, c)
        for i in range(3):
            mean = 0.5 * (u[i] + now[c, BEFORE_KICK + i])
            if i == 0:
                pace.real[LOST_IMPACT] -= Z.p[c, 0] * mean
            else:
                pace.real[LOST_FRICTION] -= Z.p[c, i] * mean
        k = across(R, c, Z.p[c, 0], Z.p[c, 1], Z.p[c, 2])
        for i in range(3):
            now[c, KICK + i] = k[i]
    pace.count[IMPACTS] += 1
