"""Contacts that go on: rows in the middle of the step, and velocities that are means over it.

A contact that pressed in the step before, and neither opens nor is hit, takes no energy if its impulse p acts along the
row D along which the mean velocity of the step vanishes: its work is p . D (v- + v+) / 2. So D v+ = -D v-, with rows in
the middle of the step, where bodies are after half of it with the velocities of its start. This is the midpoint rule
of constraints. Gaps and overlaps that are left are closed by displacements, as far as the contact presses; what these
change the energy of gravity by is the error that is left, of the third order in the step.

The rule returns a velocity that the contact has at the start of the step with the opposite sign, so that what blows and
solvers leave would never go. It is used where this velocity is less than what the rows change by in half a step, which
is of a lower order in smooth motion; else what was at the start is left out, and the contact has no velocity at the end
of the step but for what its rows change by. The same holds along the tangents of what slides or has just come to stick.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..contact.tables import BEFORE, FEATURE, FOUND, MOVER, NORMAL, POINT, SHAPE_1, SHAPE_2
from ..math.scalar import cos, sin
from ..math.vec import add, cross, dot, load3, load9, mm, norm, put3, put9, quaternion_matrix, scale, sub
from ..numerics.cone.operator import along, seen
from .motion import no_impact
from .penalty import stiffness
from .rows import arm, sides, tangents
from .tables import (
    ENOUGH_V,
    GOES_ON,
    KICK,
    LEAD,
    LEFT_OVER,
    MIDDLE,
    PRESSES,
    SEEN_FIRST,
    SLIDES,
    STEP,
    WANTED,
    YIELDING,
)

NEAR = 0.95  # cosine between normals of a step's start and its middle from which on a contact is none that goes on
SMOOTH = 0.3  # part of the velocities by which rows may change in half a step: a contact that jumps does not go on
CLEAR = 10.0  # times the residual of the last solve: what is slower may be noise of it
STILL = 1e-9  # change of a normal, or turn of a body, in a step that is none
STRAIGHT = 1e-10  # part of an arm across the normal that is none: as in balls


@formula
def of_side(P, M, G, C, c, side):
    """Mover of a side of contact c, its arm, and the part of that across the normal, 0 where nothing moves."""
    a = G.shape_i[C.at[c, SHAPE_1 if side == 0 else SHAPE_2], MOVER]
    n, r = load3(P.frame, c, 0), load3(P.arm, c, 3 * side)
    s = sub(r, scale(dot(r, n), n))
    if dot(s, s) <= STRAIGHT * STRAIGHT * dot(r, r):
        s = (0.0, 0.0, 0.0)
    return a, r, s


@formula
def straight(P, M, G, C, c):
    """Whether both arms are along the normal."""
    s, t = of_side(P, M, G, C, c, 0)[2], of_side(P, M, G, C, c, 1)[2]
    return dot(s, s) + dot(t, t) == 0.0


@formula
def changes(G, M, C, D, P, c, h):
    """Whether the rows of contact c change within the step: normals turn, or bodies whose arms are across them."""
    change = norm(sub(load3(C.x, c, NORMAL), load3(D.x, C.at[c, BEFORE], NORMAL)))
    for side in range(2):
        a, _, s = of_side(P, M, G, C, c, side)
        if a >= 0 and dot(s, s) > 0.0:
            change += h * norm(load3(M.twist, a, 3))
    return change > STILL


@formula
def velocity(M, a, r):
    """Velocity of the point at r from the origin of mover a."""
    return add(load3(M.twist, a, 0), cross(load3(M.twist, a, 3), r)) if a >= 0 else (0.0, 0.0, 0.0)


@formula
def jumps(M, P, c, movers, arms):
    """Whether contact c with other arms is elsewhere: where bodies move otherwise by a part of their speeds."""
    fast, way = 0.0, (0.0, 0.0, 0.0)
    for side in range(2):
        a, r = movers[side], load3(P.arm, c, 3 * side)
        v = velocity(M, a, r)
        way = add(way, scale(2.0 * side - 1.0, sub(velocity(M, a, arms[side]), v)))
        fast += norm(v) + (norm(sub(v, load3(M.twist, a, 0))) if a >= 0 else 0.0)
    return norm(way) > SMOOTH * fast


@formula
def keep_start(N, M, X):
    """Keep poses, and twists, which at the start of a step are in ``M`` those of the mechanism's bodies only."""
    for k in range(M.pose.shape[0]):
        for i in range(12):
            N.start[k, i] = M.pose[k, i]
        for i in range(6):
            N.start[k, 12 + i] = X.v[k, i] if k < N.body.shape[0] else M.twist[k, i]


@formula
def seen_first(G, C, N, P, X, c):
    """Relative velocity of contact c at the start of the step, in the world."""
    u = (0.0, 0.0, 0.0)
    for side in range(2):
        a = G.shape_i[C.at[c, SHAPE_1 if side == 0 else SHAPE_2], MOVER]
        if a >= 0:
            v, w = twist_first(N, X, a)
            u = add(u, scale(2.0 * side - 1.0, add(v, cross(w, load3(P.arm, c, 3 * side)))))
    return u


@formula
def twist_first(N, X, a):
    """Velocities of mover a at the start of the step."""
    if a < N.body.shape[0]:
        return load3(X.v, a, 0), load3(X.v, a, 3)
    return load3(N.start, a, 12), load3(N.start, a, 15)


@formula
def clear(G, C, N, P, X, c, pace):
    """Whether the bodies' speeds at contact c are more than what the last solve left."""
    fast, way = 0.0, (0.0, 0.0, 0.0)
    for side in range(2):
        a = G.shape_i[C.at[c, SHAPE_1 if side == 0 else SHAPE_2], MOVER]
        if a >= 0:
            v, w = twist_first(N, X, a)
            fast += norm(cross(w, load3(P.arm, c, 3 * side)))
            way = add(way, scale(2.0 * side - 1.0, v))
    return fast + norm(way) > CLEAR * pace.real[LEFT_OVER]


@formula
def kicked(now, c):
    """Whether contact c had an impact before the step."""
    return now[c, KICK] != 0.0 or now[c, KICK + 1] != 0.0 or now[c, KICK + 2] != 0.0


@formula
def was_hit(G, C, now, c, impacts):
    """Whether contact c was hit before the step, or a mechanism that it is on.

    impacts: first mover of the mechanism, and whether there were any.
    """
    first, any_ = impacts
    a, b = sides(G, C, c)
    return kicked(now, c) or (any_ and max(a, b) >= first)


@formula
def begin_contacts(G, M, C, D, N, P, X, L, pace, now, before, impacts):
    """Which contacts go on, and the relative velocities at the start. Returns whether rows are wanted in the middle."""
    h, wanted = pace.real[STEP], False
    slow = no_impact(pace, h)
    for c in range(C.count[FOUND]):
        o, u = C.at[c, BEFORE], seen_first(G, C, N, P, X, c)
        put3(now, c, LEAD, (0.0, 0.0, 0.0))
        put3(now, c, SEEN_FIRST, u)
        now[c, GOES_ON] = 0.0
        if o < 0 or not before[o, SLIDES] >= 0.0:
            continue
        soft = pace.count[YIELDING] != 0 and stiffness(G, C, L, c) > 0.0
        closing = -dot(load3(C.x, c, NORMAL), u)
        if soft or closing <= pace.real[ENOUGH_V]:
            now[c, GOES_ON] = PRESSES
        steady = closing <= slow and not was_hit(G, C, now, c, impacts) and clear(G, C, N, P, X, c, pace)
        if not soft and steady and changes(G, M, C, D, P, c, h):
            now[c, GOES_ON] = WANTED
            wanted = True
    return wanted


@formula
def half_on(N, M, X, h):
    """Free bodies where they are after half the step with the velocities of its start."""
    for k in range(N.body.shape[0]):
        w = load3(X.v, k, 3)
        put3(M.pose, k, 0, add(load3(M.pose, k, 0), scale(0.5 * h, load3(X.v, k, 0))))
        turn = 0.25 * h * norm(w)
        if turn > 0.0:
            e = scale(0.25 * h * sin(turn) / turn, w)
            put9(M.pose, k, 3, mm(quaternion_matrix(cos(turn), e[0], e[1], e[2]), load9(N.start, k, 3)))


@formula
def put_back_poses(N, M):
    """Poses of the start of the step again."""
    for k in range(M.pose.shape[0]):
        for i in range(12):
            M.pose[k, i] = N.start[k, i]


@formula
def middle_rows(G, M, C, H, P, L, now):
    """Rows of the contacts that go on, with poses and contacts ``H`` of the middle. Returns whether there are any."""
    found = False
    for k in range(H.count[FOUND]):
        c = H.at[k, BEFORE]
        if c < 0 or now[c, GOES_ON] != WANTED or C.at[c, FEATURE] != H.at[k, FEATURE]:
            continue
        n, point = load3(H.x, k, NORMAL), load3(H.x, k, POINT)
        a, b = sides(G, C, c)
        r, s = arm(M, a, point), arm(M, b, point)
        if dot(n, load3(P.frame, c, 0)) < NEAR or jumps(M, P, c, (a, b), (r, s)):
            continue
        if straight(P, M, G, C, c):  # it stays so to rounding
            r, s = scale(dot(r, n), n), scale(dot(s, n), n)
        put3(P.frame, c, 0, n)
        put3(P.arm, c, 0, r)
        put3(P.arm, c, 3, s)
        tangents(G, M, C, P, L, c)
        now[c, GOES_ON] = MIDDLE
        found = True
    return found


@formula
def lead(G, M, C, P, X, now, before):
    """Biases of the contacts whose rows are in the middle; see above."""
    for c in range(C.count[FOUND]):
        if now[c, GOES_ON] != MIDDLE:
            continue
        u = seen(P, X.v, X.wide, c)
        first = along(P, c, load3(now, c, SEEN_FIRST))
        more = sub(u, first)
        mean = abs(first[0]) <= abs(more[0])
        ahead = (u[0] if mean else more[0], 0.0, 0.0)
        if not straight(P, M, G, C, c):
            s, t = more[1], more[2]
            own = P.bias[c, 1], P.bias[c, 2]
            a, b = first[1] + own[0], first[2] + own[1]
            if before[C.at[c, BEFORE], SLIDES] == 0.0 and a * a + b * b <= s * s + t * t:
                s, t = u[1] + own[0], u[2] + own[1]
            ahead = (ahead[0], s, t)
        put3(now, c, LEAD, ahead)
        if mean:  # displacements close its gap
            P.bias[c, 0] = 0.0
        else:
            now[c, GOES_ON] = WANTED
        put3(P.bias, c, 0, add(load3(P.bias, c, 0), ahead))
