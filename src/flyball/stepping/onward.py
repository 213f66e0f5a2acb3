"""Contacts half a step on: a contact that was there before goes on as it came.

Impulses act along rows at the middle of the step, where the mean velocities do their work; contacts are closed at its
end. What is seen there differs from what is at the middle by as much as this does from what is at the start: this part
of the velocities, which are nearly the same, is a bias. So where mass centres are off the middle, where normals turn
and where corners go round, steps are of second order and need no lifts.

It is for free bodies and what stands still; the mechanism's rows are at the middle of the step anyway. Impacts are over
before the step begins, and have the rows of its start.
"""

from __future__ import annotations

from ..compiler.jit import formula
from ..contact.tables import BEFORE, FEATURE, NORMAL, POINT
from ..math.vec import add, cross, dot, load3, norm, put3, scale, sub
from .tables import LAST_STEP, STEP

NEAR = 0.95  # cosine between normals of a step and the next from which on a contact is none that goes on
SMOOTH = 0.3  # part of the velocities by which they may change in a step: after a blow all goes elsewhere
JUMP = 2.0  # times as far as velocities lead: what went further in the step before has jumped
STRAIGHT = 1e-10  # part of an arm across the normal that is none: as in balls

ZERO = (0.0, 0.0, 0.0)


@formula
def arm(M, a, point):
    """From the origin of mover a to a point; 0 for what stands still."""
    return sub(point, load3(M.pose, a, 0)) if a >= 0 else ZERO


@formula
def turning(M, a, r):
    """Velocity, beside that of its origin, of the point at r from mover a."""
    return cross(load3(M.twist, a, 3), r) if a >= 0 else ZERO


@formula
def travelling(M, a):
    """Velocity of the origin of mover a."""
    return load3(M.twist, a, 0) if a >= 0 else ZERO


@formula
def across(r, n):
    """The part of an arm across the normal."""
    s = sub(r, scale(dot(r, n), n))
    return s if dot(s, s) > STRAIGHT * STRAIGHT * dot(r, r) else ZERO


@formula
def further(r, n, before, old, part, on):
    """An arm that goes on: its length along the normal, and what it has across, each by a part of its change.

    ``on``: the normal there. So what is along the normal stays so to rounding.
    """
    s, was = across(r, n), across(before, old)
    along_it = dot(r, n) + part * (dot(r, n) - dot(before, old))
    return add(scale(along_it, on), add(s, scale(part, sub(s, was))))


@formula
def change(M, N, a, r):
    """By how much the velocity of the point at r from mover a changed in the step before, turning counted apart."""
    if a < 0:
        return 0.0
    spin = sub(load3(M.twist, a, 3), load3(N.before, a, 3))
    return norm(sub(load3(M.twist, a, 0), load3(N.before, a, 0))) + norm(cross(spin, r))


@formula
def carry_on(M, C, D, N, P, c, pace):
    """Take the normal and arms of contact c, which are those of the start of the step, half a step on.

    By as much as they changed since the contacts ``D`` of the step before, if it is the same contact: one with the same
    feature, and where the bodies' velocities, which have not changed much, can have brought it. Returns whether it is.
    """
    o, last = C.at[c, BEFORE], pace.real[LAST_STEP]
    a, b = P.at[c, 0], P.at[c, 1]
    if o < 0 or last == 0.0 or min(a, b) < -1 or C.at[c, FEATURE] != D.at[o, FEATURE]:
        return False
    n, old = load3(C.x, c, NORMAL), load3(D.x, o, NORMAL)
    if dot(n, old) < NEAR:
        return False
    at_a, at_b = load3(P.arm, c, 0), load3(P.arm, c, 3)
    fast = norm(sub(travelling(M, b), travelling(M, a))) + norm(turning(M, a, at_a)) + norm(turning(M, b, at_b))
    if change(M, N, a, at_a) + change(M, N, b, at_b) > SMOOTH * fast:
        return False
    went = sub(load3(C.x, c, POINT), load3(D.x, o, POINT))
    from_a = sub(went, sub(load3(M.pose, a, 0), load3(N.past, a, 0))) if a >= 0 else ZERO
    from_b = sub(went, sub(load3(M.pose, b, 0), load3(N.past, b, 0))) if b >= 0 else ZERO
    if max(dot(from_a, from_a), dot(from_b, from_b)) > (JUMP * last * fast) ** 2:
        return False
    part = 0.5 * pace.real[STEP] / last
    on = add(n, scale(part, sub(n, old)))
    on = scale(1.0 / norm(on), on)
    put3(P.frame, c, 0, on)
    if a >= 0:
        put3(P.arm, c, 0, further(at_a, n, sub(at_a, from_a), old, part, on))
    if b >= 0:
        put3(P.arm, c, 3, further(at_b, n, sub(at_b, from_b), old, part, on))
    return True


@formula
def lead(M, C, P, c):
    """What is seen at the end of the step beyond what is at its middle, along the frame of contact c.

    Along tangents only where an arm is not along the normal: balls among balls are solved without biases there.
    """
    a, b = P.at[c, 0], P.at[c, 1]
    n, on, point = load3(C.x, c, NORMAL), load3(P.frame, c, 0), load3(C.x, c, POINT)
    to_a, to_b = load3(P.arm, c, 0), load3(P.arm, c, 3)
    before = sub(turning(M, b, arm(M, b, point)), turning(M, a, arm(M, a, point)))
    more = sub(sub(turning(M, b, to_b), turning(M, a, to_a)), before)
    up = dot(on, more) + dot(sub(on, n), add(before, sub(travelling(M, b), travelling(M, a))))
    if across(to_a, on) == ZERO and across(to_b, on) == ZERO:
        return (up, 0.0, 0.0)
    return (up, dot(load3(P.frame, c, 3), more), dot(load3(P.frame, c, 6), more))
