"""Restitution: impacts are over before a step begins, where a contact closes within it.

Contacts that close within the step, faster than smooth forces make them, are hit with the velocities of the start:

- Poisson: compression (an inelastic impact with impulses p_c), then expansion with normal impulses of at least e p_c
  and friction for these (Pfeiffer and Glocker, 1996, section 8.3);
- Newton: u+ >= -e u- normal to the contact; Moreau: the same along all three directions.

No law may add energy: what goes beyond an inelastic impact is done only as far as that leaves energy for it (Newton's
law with friction would add some: Kane and Levinson, 1985).

What is hit may reach something else within the same step: impacts go in rounds until nothing more is hit.
"""

from __future__ import annotations

from ..compiler.formulas import call, formula
from ..contact.surfaces import RESTITUTION
from ..contact.tables import FOUND, GAP, MATERIAL, SHAPE_1, SHAPE_2
from ..math.scalar import sqrt
from ..math.vec import add, dot, load3, put3, scale, sub
from ..numerics.cone.operator import across, seen, seen_turning
from ..numerics.cone.problem import CONVERGED, NONE
from .motion import no_impact
from .penalty import stiffness
from .sequence import one_after_the_other
from .tables import (
    BEFORE_KICK,
    BOUNCE,
    CUTS,
    ENOUGH_V,
    FLAT,
    GIVEN,
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
    ROUGH,
    SEQUENTIAL,
    STEP,
    SWEEPS,
    TURNED_BEFORE,
    YIELDING,
)

ROUNDS = 1000  # of impacts in one step, after which what still closes comes to rest against what it meets
NEAR = 1e3  # gaps up to so many times what is none are hit at once
LESS = 1.0 - 1e-6  # part of an expansion below which it is told that it was reduced
MORE = 4  # times as many iterations as for velocities that are warm started


@formula
def elasticity(G, C, L, c):
    """Restitution of contact c."""
    return L.pair[G.shape_i[C.at[c, SHAPE_1], MATERIAL], G.shape_i[C.at[c, SHAPE_2], MATERIAL], RESTITUTION]


@formula
def bounce(G, C, bias, R, Z, E, X, W, O, F, L, pace, now):
    """The impacts that `hits` found; velocities in ``X.v`` and ``X.wide`` are those after them.

    ``R`` is the problem with biases and least normal impulses of its own, ``Z`` the state of compression, which shares
    its velocities with ``X``, ``E`` that of expansion.
    """
    if pace.count[SEQUENTIAL] != 0:
        for c in range(C.count[FOUND]):
            R.least[c] = elasticity(G, C, L, c)
        if not one_after_the_other(R, Z, X, C, pace, now):
            pace.count[REDUCED] += 1
    elif pace.count[LAW] == POISSON:
        by_compression(G, C, bias, R, Z, E, X, W, O, F, L, pace, now)
    else:
        by_velocities(C, bias, R, Z, E, X, W, O, F, pace, now)
    close(R, bias, Z, X, C, pace, now)


@formula
def no_kicks(C, now):
    """Nothing has been hit in this step yet."""
    for c in range(C.count[FOUND]):
        for i in range(3):
            now[c, KICK + i] = 0.0


@formula
def by_compression(G, C, bias, R, Z, E, X, W, O, F, L, pace, now):
    """Poisson's law: an inelastic impact, then expansion."""
    solve_afresh(pace.door[BOUNCE], R, Z, W, O, F, pace)
    for c in range(C.count[FOUND]):
        R.least[c] = elasticity(G, C, L, c) * Z.p[c, 0] if now[c, HIT] > 0.0 else 0.0
    copy_velocities(X, E)
    solve_afresh(pace.door[BOUNCE], R, E, W, O, F, pace)
    expand(R, bias, Z, E, X, C, pace, now)


@formula
def by_velocities(C, bias, R, Z, E, X, W, O, F, pace, now):
    """Newton's and Moreau's law; where they make energy, as far as an inelastic impact leaves enough of it."""
    copy_velocities(X, E)
    solve_afresh(pace.door[BOUNCE], R, E, W, O, F, pace)
    if power(R, bias, E, E, C, now) <= 0.0:
        copy_velocities(E, X)
        for c in range(C.count[FOUND]):
            add_impulses(Z, 0.0, E, 1.0, c)
        return
    for c in range(C.count[FOUND]):
        for i in range(3):
            R.bias[c, i] = 0.0 if i == 0 and now[c, HIT] > 0.0 else bias[c, i]
    solve_afresh(pace.door[BOUNCE], R, Z, W, O, F, pace)
    for c in range(C.count[FOUND]):
        add_impulses(E, 1.0, Z, -1.0, c)
    expand(R, bias, Z, E, X, C, pace, now)


@formula
def add_impulses(Z, z, E, e, c):
    """z times the impulse of Z, and e times that of E, into Z."""
    put3(Z.p, c, 0, add(scale(z, load3(Z.p, c, 0)), scale(e, load3(E.p, c, 0))))
    if Z.torque.shape[0] > 0:
        put3(Z.torque, c, 0, add(scale(z, load3(Z.torque, c, 0)), scale(e, load3(E.torque, c, 0))))


@formula
def copy_velocities(X, E):
    """E's velocities become X's."""
    for k in range(X.v.shape[0]):
        for i in range(6):
            E.v[k, i] = X.v[k, i]
    for k in range(X.wide.shape[0]):
        E.wide[k] = X.wide[k]


@formula
def hits(G, C, at, bias, R, X, L, pace, now):
    """Whether there are impacts; biases of the contacts that are hit, and their velocities before in ``now``."""
    if pace.count[LAW] == NO_RESTITUTION:
        return False
    h = pace.real[STEP]
    slowest = no_impact(pace, h)
    found = False
    law = pace.count[LAW]
    for c in range(C.count[FOUND]):
        R.least[c] = 0.0
        gives_way = pace.count[YIELDING] != 0 and stiffness(G, C, L, c) > 0.0
        for i in range(2):  # what gives way has no impulse in no time
            R.at[c, i] = NONE if gives_way else at[c, i]
        u = seen(R, X.v, X.wide, c)
        put3(now, c, BEFORE_KICK, u)
        put3(R.bias, c, 0, load3(bias, c, 0))
        if R.turn.shape[0] > 0:
            put3(now, c, TURNED_BEFORE, seen_turning(R, X.v, X.wide, c))
        e = elasticity(G, C, L, c)
        now[c, HIT] = 0.0
        plain = pace.count[SEQUENTIAL] != 0 and C.x[c, GAP] <= pace.real[FLAT]
        if gives_way:
            R.bias[c, 0] = 0.0
            continue
        if (e > 0.0 or plain) and C.x[c, GAP] + h * u[0] <= pace.real[FLAT]:  # what rests against what is hit, too
            now[c, HIT] = 1.0
            found = found or (e > 0.0 and u[0] < -slowest)
            R.bias[c, 0] = 0.0
            if law != POISSON and u[0] < 0.0:
                R.bias[c, 0] = e * u[0]
                for i in range(1, 3 if law == MOREAU else 1):
                    R.bias[c, i] += e * u[i]
        elif C.x[c, GAP] > NEAR * pace.real[FLAT]:
            for i in range(2):  # an impact takes no time in which it could close: it has its turn in the next round
                R.at[c, i] = NONE
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
    O.count.most = MORE * pace.count[SWEEPS]
    O.real.enough = pace.real[ENOUGH_V]
    call(address, R, Z, W, O, F.impacts, 0)
    if O.count.ended != CONVERGED and O.real.residual > pace.real[ROUGH] * pace.real[STEP]:
        pace.count[CUTS] += 1


@formula
def power(R, bias, Z, X, C, now):
    """Energy that impulses of ``Z`` gave, which led to the velocities of ``X``: p . (u- + u+) / 2 of every contact.

    With the own motion of surfaces, ``bias`` along the tangents, from which they may give energy.
    """
    total = 0.0
    for c in range(C.count[FOUND]):
        u = seen(R, X.v, X.wide, c)
        for i in range(3):
            own = bias[c, i] if i > 0 else 0.0
            total += Z.p[c, i] * (0.5 * (u[i] + now[c, BEFORE_KICK + i]) + own)
        total += power_of_turning(R, Z, X, c, now)
    return total


@formula
def power_of_turning(R, Z, X, c, now):
    """The same of the torque's impulse at contact c."""
    if R.turn.shape[0] == 0:
        return 0.0
    return 0.5 * dot(load3(Z.torque, c, 0), add(seen_turning(R, X.v, X.wide, c), load3(now, c, TURNED_BEFORE)))


@formula
def expand(R, bias, Z, E, X, C, pace, now):
    """The impulses E.p are added to Z.p: X's velocities become those of ``E``, or what energy there is for on the way.

    On the way s from X to E it grows by a s + b s^2, a = p . u, b = p . (u+ - u) / 2. All of the way is allowed by the
    constraints, which are convex.
    """
    there = max(0.0, -power(R, bias, Z, X, C, now))
    a, b = 0.0, 0.0
    for c in range(C.count[FOUND]):
        u = seen(R, X.v, X.wide, c)
        w = seen(R, E.v, E.wide, c)
        for i in range(3):
            own = bias[c, i] if i > 0 else 0.0
            a += E.p[c, i] * (u[i] + own)
            b += 0.5 * E.p[c, i] * (w[i] - u[i])
        if R.turn.shape[0] > 0:
            u, w, t = seen_turning(R, X.v, X.wide, c), seen_turning(R, E.v, E.wide, c), load3(E.torque, c, 0)
            a, b = a + dot(t, u), b + 0.5 * dot(t, sub(w, u))
    s = 1.0
    if a + b > there and b > 0.0:
        s = (sqrt(a * a + 4.0 * b * there) - a) / (2.0 * b)
        s = min(1.0, max(0.0, s))
        if s < LESS:
            pace.count[REDUCED] += 1
    for k in range(X.v.shape[0]):
        for i in range(6):
            X.v[k, i] += s * (E.v[k, i] - X.v[k, i])
    for k in range(X.wide.shape[0]):
        X.wide[k] += s * (E.wide[k] - X.wide[k])
    for c in range(C.count[FOUND]):
        add_impulses(Z, 1.0, E, s, c)


@formula
def close(R, bias, Z, X, C, pace, now):
    """Impulses of the impacts, and what was lost in them."""
    for c in range(C.count[FOUND]):
        u = seen(R, X.v, X.wide, c)
        worn = -power_of_turning(R, Z, X, c, now)
        for i in range(3):
            mean = 0.5 * (u[i] + now[c, BEFORE_KICK + i])
            if i == 0:
                pace.real[LOST_IMPACT] -= Z.p[c, 0] * mean
            else:  # of a surface that moves the bias is its own motion
                worn -= Z.p[c, i] * (mean + bias[c, i])
                pace.real[GIVEN] -= Z.p[c, i] * bias[c, i]
        # the mean of an impact in which the slip reverses: friction gives no energy, the impact's sum is exact
        pace.real[LOST_FRICTION if worn >= 0.0 else LOST_IMPACT] += worn
        put3(now, c, KICK, add(load3(now, c, KICK), across(R, c, Z.p[c, 0], Z.p[c, 1], Z.p[c, 2])))
    pace.count[IMPACTS] += 1
