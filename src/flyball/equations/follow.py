"""The motion of a mechanism whose drivers leave no freedom: from one time to the next by prediction and Newton.

Nothing is integrated, so nothing drifts. Positions are predicted by the cubic through the last two velocities and
accelerations; where the prediction is far from the mechanism the way is halved, so that no step leads to another
branch. Rows are written for all times that were stepped on, with the powers of what does work in place of the works.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..laws.evaluation import evaluate_jet
from ..laws.manner import entire
from ..math.scalar import atan2, cos, magnitude, sin
from ..numerics.integrators.clock import (
    DONE,
    RUNNING,
    STUCK,
    TOO_MANY,
)
from ..tables.system import REVOLUTE
from .motion import arrive, write_row
from .rows import BY_TIME
from .tree import retract

ALL_BUT = 1.0 - 1e-6
EVEN = 1e-6  # part of its change by which the change of a law may differ from that of its derivatives
NEAR, SHARP = 1e-10, 10.0  # a law that leaps changes over this part of the time span by more than this times its slope
TINY, SLOW = 1e-12, 1e-9  # changes of laws that are nothing: of the mechanism's size, of that in the time span
FAR_OFF = 1e-2  # a prediction that misses positions or velocities by this part of them was for too long a step


@formula
def follow(S, W, c, out):
    """Go on until the end, or until the buffer ``out`` is full or the quota is used. Returns rows written.

    ``c`` is the clock of the integrators; rows 0 and 1 of ``c.K`` hold derivatives now and at the step before.
    """
    used = 0
    c.count.status = RUNNING
    if c.count.started == 0:
        status, _ = arrive(c.real.t, c.y[0], c.K[0], S, W)
        if status != 0:
            c.count.status = STUCK
            return used
        write(c, out[used], S, W)
        used += 1
        c.count.started = 1
        c.real.h = 0.0
        c.real.grow = 1.0
        while c.count.next < c.times.shape[0] and c.times[c.count.next] <= c.real.t:
            c.count.next += 1
    steps = 0
    while c.real.t < c.real.t_end:
        if used == out.shape[0] or steps >= c.count.quota:
            return used
        if c.count.accepted + c.count.rejected >= c.count.limit:
            c.count.status = TOO_MANY
            return used
        goal = c.times[c.count.next] if c.count.next < c.times.shape[0] else c.real.t_end
        left = goal - c.real.t
        h = c.real.grow * min(left, c.real.h_max)
        lands = h > ALL_BUT * left  # no sliver is left over for the next step
        if lands:
            h = left
        if h < 1e-14 * max(abs(c.real.t), c.real.largest):
            c.count.status = STUCK
            return used
        t = goal if lands else c.real.t + h
        predict(S, c, h)
        status, found = arrive(t, c.y[1], c.K[2], S, W)
        steps += 1
        if status != 0 or not found <= FAR_OFF or broken(S, W, c.real.t, h, c.real.largest):
            c.count.rejected += 1
            c.real.grow *= 0.5
            continue
        accept(c, t, h)
        write(c, out[used], S, W)
        used += 1
        if t >= goal:
            c.count.next += 1
        c.real.grow = min(1.0, 2.0 * c.real.grow)
    c.count.status = DONE
    return used


@formula
def broken(S, W, t, h, span):
    """Whether a driver's law does more over a step than its derivatives say: it may jump there, or have a kink."""
    for b in range(S.tree.parent.shape[0]):
        law = S.tree.law[b]
        if law >= 0 and leaps(S, W, law, t, h, span, S.tree.joint[b] == REVOLUTE):
            return True
    for k in range(S.rows.law.shape[0]):
        law = S.rows.law[k]
        if law >= 0 and leaps(S, W, law, t, h, span, S.rows.wrapped[k] == 1):
            return True
    return False


@formula
def leaps(S, W, law, t, h, span, turns):
    """Whether value and rate of a law change over a step by something else than what their derivatives add up to.

    By Hermite's and Simpson's rule, to EVEN; over a step that cannot be much shorter, by more than they can add up to.
    """
    if entire(S.code, law):
        return False
    f0, v0, a0 = evaluate_jet(S.code, S.const, law, W.stack, t, W.sensed, BY_TIME)
    _, vm, am = evaluate_jet(S.code, S.const, law, W.stack, t + 0.5 * h, W.sensed, BY_TIME)
    f1, v1, a1 = evaluate_jet(S.code, S.const, law, W.stack, t + h, W.sensed, BY_TIME)
    way = f1 - f0 - h / 30.0 * (7.0 * v0 + 16.0 * vm + 7.0 * v1) - h * h / 60.0 * (a0 - a1)
    size = S.scales.length
    if turns:
        way = atan2(sin(way), cos(way))
        size = 0.0 * size + 1.0
    rate = v1 - v0 - h / 6.0 * (a0 + 4.0 * am + a1)
    v = max(magnitude(v0), magnitude(vm), magnitude(v1))
    a = max(magnitude(a0), magnitude(am), magnitude(a1))
    part = EVEN if h > NEAR * span else SHARP
    as_told = magnitude(way) <= part * h * (v + h * a) + TINY * (magnitude(f0) + magnitude(f1) + size)
    return not (as_told and magnitude(rate) <= EVEN * v + part * h * a + SLOW * size / span)


@formula
def predict(S, c, h):
    """State after h into c.y[1]: velocities by the cubic that fits the last two, positions by its integral."""
    nq = S.sizes.coordinates
    y, new, now, before = c.y[0], c.y[1], c.K[0], c.K[1]
    last = c.real.h
    way = c.y[2]
    for i in range(y.shape[0]):
        new[i] = y[i]
    nv = S.tree.v[-1] + S.tree.nv[-1]
    u = 1.0 + h / last if last > 0.0 else 1.0
    a, b, d = u * u, u * u * u, u * u * u * u
    for i in range(nv):
        v, vdot = y[nq + i], now[nq + i]
        if last > 0.0:
            # Hermite's cubic in u = (t - t0) / last through (v, vdot) at u = 0 and u = 1, and its integral from u = 1
            v0, vdot0 = c.K[3, nq + i], before[nq + i]
            new[nq + i] = (
                (2.0 * b - 3.0 * a + 1.0) * v0
                + (b - 2.0 * a + u) * last * vdot0
                + (3.0 * a - 2.0 * b) * v
                + (b - a) * last * vdot
            )
            way[i] = last * (
                (0.5 * d - b + u - 0.5) * v0
                + (0.25 * d - 2.0 / 3.0 * b + 0.5 * a - 1.0 / 12.0) * last * vdot0
                + (b - 0.5 * d - 0.5) * v
                + (0.25 * d - b / 3.0 + 1.0 / 12.0) * last * vdot
            )
        else:
            new[nq + i] = v + h * vdot
            way[i] = h * v + 0.5 * h * h * vdot
    retract(S, new[:nq], way)
    for i in range(nq + nv, y.shape[0]):
        new[i] = y[i] + h * now[i]


@formula
def write(c, out, S, W):
    """A row of the output at the present state, with powers for works."""
    write_row(c.real.t, c.y[0], out, S, W)
    for k in range(c.accounts.shape[0]):
        out[1 + c.accounts[k]] = c.K[0, c.accounts[k]]


@formula
def accept(c, t, h):
    """Make the state in the making the present one."""
    for i in range(c.y.shape[1]):
        c.K[1, i] = c.K[0, i]
        c.K[3, i] = c.y[0, i]
        c.K[0, i] = c.K[2, i]
        c.y[0, i] = c.y[1, i]
    c.real.h = h
    c.real.t = t
    c.count.accepted += 1
