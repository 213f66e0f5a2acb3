"""What is kept of a step: impulses for the next one, whether contacts slide, and where energy went."""

from __future__ import annotations

from ..compiler.jit import formula
from ..math.scalar import sqrt
from ..math.vec import dot, load3, put3
from ..numerics.cone.operator import across, seen_turning
from .tables import GIVEN, IMPULSE, LEAD, LOST_FRICTION, LOST_IMPACT, SLIDES, TORQUE

ON = 1e-9  # part of the friction cone's radius within which an impulse is on it


@formula
def book(P, X, c, u, pace, now):
    """Impulse of contact c for the next step, and its work at the mean velocities u of the step."""
    n, s, t = X.p[c, 0], X.p[c, 1], X.p[c, 2]
    put3(now, c, IMPULSE, across(P, c, n, s, t))
    if n > 0.0:
        belt = (P.bias[c, 1] - now[c, LEAD + 1]) * s + (P.bias[c, 2] - now[c, LEAD + 2]) * t
        pace.real[LOST_IMPACT] -= n * u[0]
        pace.real[LOST_FRICTION] -= s * u[1] + t * u[2] + belt
        pace.real[GIVEN] -= belt
        now[c, SLIDES] = 1.0 if sqrt(s * s + t * t) >= (1.0 - ON) * P.mu[c] * n else 0.0
    else:
        now[c, SLIDES] = -1.0


@formula
def book_turning(P, X, Y, c, pace, now):
    """Impulse of rolling and spinning friction at contact c, and its work at the mean velocities ``Y`` of the step."""
    t = load3(X.torque, c, 0)
    put3(now, c, TORQUE, across(P, c, t[0], t[1], t[2]))
    pace.real[LOST_FRICTION] -= dot(t, seen_turning(P, Y.v, Y.wide, c))
