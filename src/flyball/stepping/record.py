"""What is kept of a step: impulses for the next one, whether contacts slide, and where energy went."""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import sqrt
from ..math.vec import dot, load3, put3
from ..numerics.cone.operator import across, seen_turning
from .tables import (
    GIVEN,
    GOES_ON,
    IMPULSE,
    LEAD,
    LOST_FRICTION,
    LOST_IMPACT,
    NUMERICAL,
    SLIDES,
    STIFF,
    TORQUE,
)

ON = 1e-9  # part of the friction cone's radius within which an impulse is on it


@formula
def book(P, X, c, u, pace, now):
    """Impulse of contact c for the next step, and its work at the mean velocities u of the step.

    A contact that goes on neither opens nor is hit: work along its normal is the method's error, and so is that along
    its tangents where it sticks before and after. Friction never gives energy: what it would have given as a mean of
    the step is the other part's, whose sum with it is exact.
    """
    n, s, t = X.p[c, 0], X.p[c, 1], X.p[c, 2]
    put3(now, c, IMPULSE, across(P, c, n, s, t))
    if n > 0.0:
        belt = (P.bias[c, 1] - now[c, LEAD + 1]) * s + (P.bias[c, 2] - now[c, LEAD + 2]) * t
        other = NUMERICAL if now[c, GOES_ON] > 0.0 or now[c, STIFF] > 0.0 else LOST_IMPACT
        slides = sqrt(s * s + t * t) >= (1.0 - ON) * P.mu[c] * n
        worn = -(s * u[1] + t * u[2] + belt)
        sticks = now[c, GOES_ON] > 0.0 and now[c, SLIDES] == 0.0 and not slides
        pace.real[other] -= n * u[0]
        pace.real[other if sticks or worn < 0.0 else LOST_FRICTION] += worn
        pace.real[GIVEN] -= belt
        now[c, SLIDES] = 1.0 if slides else 0.0
    else:
        now[c, SLIDES] = -1.0


@formula
def book_turning(P, X, Y, c, pace, now):
    """Impulse of rolling and spinning friction at contact c, and its work at the mean velocities ``Y`` of the step."""
    t = load3(X.torque, c, 0)
    put3(now, c, TORQUE, across(P, c, t[0], t[1], t[2]))
    worn = -dot(t, seen_turning(P, Y.v, Y.wide, c))
    pace.real[LOST_FRICTION if worn >= 0.0 else NUMERICAL] += worn
