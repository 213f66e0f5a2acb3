"""A variational integrator on Lie groups with constraints, of order 2, at fixed steps, for very long runs.

The discrete Lagrangian h l(d / h) - h (V(q0) + V(q1)) / 2 of increments d, q1 = q0 (+) d, with forces by Lagrange and
d'Alembert (Marsden and West 2001; of rotations: Lee, Leok and McClamroch 2007; Kobilarov and Marsden 2011), and
velocities on the constraints at the ends of steps, as in RATTLE (Andersen 1983; Reich 1996):

    p0 + h/2 (f0 + G0^T lam) = T(d)^-T M d / h,  p1- = T(-d)^-T M d / h,  g(t1, q1) = 0
    M v1 = p1- + h/2 (f1 + G1^T lam'),  G1 v1 = nu1

It is symplectic, keeps momenta that symmetries keep, and its energy stays within bounds that do not grow. Forces that
depend on velocities are iterated. Knows nothing of bodies: given compose, arrive, inspect, as `asked` is, and

    weigh(v, p, S), speed(p, v, S)  momenta of velocities, and back
    fly(p, h, d, p1, S) -> status   the way of momenta p, and those on arrival
    push(t, y, lam, f, S)           forces
    place(t, y, g, S) -> worst      what positions miss, and the largest of it
    relax(g, lam, S)                multipliers of an impulse along the rows that takes g away in a unit of time
    pull(rows, lam, by, p, S)       adds by G^T lam to momenta
    rows_to(rows, S)                keeps G as last evaluated
"""

from __future__ import annotations

from ....compiler.formulas import formula
from ..clock import AT_END, NEW, NOW
from ..loop import BEGIN, ENDED, ENTER, OVERLOOKED, REFUSE, TRY, WITHIN, ending
from .asked import begin, within
from .desk import START
from .even import account
from .even import enter as enter_step
from .hermite import END, V_RATE, V_RATE_END, between

FREE, ARRIVING, CARRIED, CARRIED_ON = range(4)  # rows of p
HERE, THERE, TRIAL = range(3)  # rows of f, and of rows: at the begin of the step, at its end
MOST = 30  # iterations
SAME = 4e-15  # part of the momenta below which a change of forces is none
ROUNDED = 1e-9  # and below which it is rounding, if it does not fall
STALLED = 0.7  # what is left of a violation by an iteration that rounding stops
NOT_CLOSED, NOT_SETTLED = 1, 2


@formula
def prepare(callbacks, S, K, c):
    """Forces and rows where the method begins anew."""
    weigh, push, rows_to = callbacks[3], callbacks[6], callbacks[10]
    weigh(K.v[START], K.p[CARRIED], S)
    push(c.real.t, c.y[NOW], K.lam[START], K.f[HERE], S)
    rows_to(K.rows[HERE], S)


@formula
def attempt(callbacks, S, K, c, h):
    """One step of width h into c.y[NEW], derivatives there into c.K[1]. Returns a status."""
    nv, nz = K.v.shape[1], K.z.shape[1]
    at = c.y.shape[1] - nz - nv
    for i in range(nv):
        K.v[START, i] = c.y[NOW, at + i]
    if K.count.before == 0:
        prepare(callbacks, S, K, c)
    for i in range(nz):
        K.z[START, i], K.rate[START, i] = c.y[NOW, at + nv + i], c.K[0, at + nv + i]
        K.z[END, i] = K.z[START, i] + h * K.rate[START, i]
    status = go(callbacks, S, K, c, h)
    if status == 0:
        status = land(callbacks, S, K, c, h)
    if status != 0:
        return status
    account(c, h)
    seen(K, c, 1)
    for i in range(nz):
        K.z[END, i] = c.y[NEW, at + nv + i]
    return 0


@formula
def seen(K, c, end):
    """What is asked for within the step, by the velocities in c.y[NEW] and the rates in row ``end`` of c.K."""
    nv, nz = K.v.shape[1], K.z.shape[1]
    at = c.y.shape[1] - nz - nv
    for i in range(nv):
        K.v[END, i] = c.y[NEW, at + i]
        K.ends[V_RATE, i], K.ends[V_RATE_END, i] = c.K[0, at + i], c.K[end, at + i]
    for i in range(nz):
        K.rate[START, i], K.rate[END, i] = c.K[0, at + nv + i], c.K[end, at + nv + i]


@formula
def go(callbacks, S, K, c, h):
    """To the positions at the end of the step, on the constraints, and the momenta on arrival. Returns a status."""
    compose, fly = callbacks[0], callbacks[5]
    place, relax, pull = callbacks[7], callbacks[8], callbacks[9]
    nr = K.lam.shape[1]
    for i in range(K.v.shape[1]):
        K.p[FREE, i] = K.p[CARRIED, i] + 0.5 * h * K.f[HERE, i]
    pull(K.rows[HERE], K.lam[START], 0.5 * h, K.p[FREE], S)
    last = 1e300
    for n in range(MOST):
        if fly(K.p[FREE], h, K.d[END], K.p[ARRIVING], S) != 0:
            return NOT_CLOSED
        compose(c.y[NOW], K.d[END], K.v[START], K.z[END], c.y[NEW], S)
        if nr == 0:
            return 0
        worst = place(c.real.t + h, c.y[NEW], K.g, S)
        if worst <= K.real.newton or (worst > STALLED * last and worst <= K.real.rough):
            return 0
        if not worst < 1e3:
            return NOT_CLOSED
        at = n % K.steps.shape[0]
        relax(K.g, K.steps[at], S)
        if not better(K.steps, at):
            return NOT_CLOSED
        pull(K.rows[HERE], K.steps[at], 1.0 / h, K.p[FREE], S)
        K.count.iterations += 1
        last = worst
    return NOT_CLOSED


@formula
def better(steps, n):
    """Make the next step of a simple iteration, row n, Broyden's, by those before (Kelley 1995, algorithm brsol).

    What the rows of the begin answer to is turned until the end of the step, the more so where a body spins.
    Returns whether there is one.
    """
    z = steps[n]
    nr = z.shape[0]
    for j in range(n):
        s = steps[j]
        size = along = 0.0
        for r in range(nr):
            size += s[r] * s[r]
            along += s[r] * z[r]
        if not size > 0.0:
            return False
        if j == n - 1:
            by = 1.0 / (1.0 - along / size)
            for r in range(nr):
                z[r] *= by
        else:
            for r in range(nr):
                z[r] += steps[j + 1, r] * along / size
    return True


@formula
def land(callbacks, S, K, c, h):
    """Velocities at the end of the step, with forces that may depend on them. Returns a status."""
    arrive, weigh, speed, push, rows_to = callbacks[1], callbacks[3], callbacks[4], callbacks[6], callbacks[10]
    nv = K.v.shape[1]
    at = c.y.shape[1] - K.z.shape[1] - nv
    speed(K.p[ARRIVING], c.y[NEW, at : at + nv], S)
    push(c.real.t + h, c.y[NEW], K.lam[START], K.f[TRIAL], S)
    last = 1e300
    for n in range(MOST):
        size = 0.0
        for i in range(nv):
            K.p[FREE, i] = K.p[ARRIVING, i] + 0.5 * h * K.f[TRIAL, i]
            size = max(size, abs(K.p[FREE, i]), 0.5 * h * abs(K.f[TRIAL, i]))
        speed(K.p[FREE], c.y[NEW, at : at + nv], S)
        seen(K, c, 0 if n == 0 else 1)
        status, _ = arrive(c.real.t + h, c.y[NEW], c.K[1], S, K)
        if status != 0:
            return status
        push(c.real.t + h, c.y[NEW], K.found, K.f[THERE], S)
        change = 0.0
        for i in range(nv):
            x = 0.5 * h * abs(K.f[THERE, i] - K.f[TRIAL, i])
            if not x <= change:
                change = x
        if change <= SAME * size or (change > STALLED * last and change <= ROUNDED * size):
            rows_to(K.rows[THERE], S)
            for i in range(nv):  # momenta are carried on, less rounding: what constraints did is all that is weighed
                K.p[ARRIVING, i] = c.y[NEW, at + i] - K.v[END, i]
            weigh(K.p[ARRIVING], K.p[CARRIED_ON], S)
            for i in range(nv):
                K.p[CARRIED_ON, i] += K.p[FREE, i]
            return 0
        if not change < 1e300:
            return NOT_SETTLED
        at_once = n % K.pushes.shape[0]
        for i in range(nv):
            K.pushes[at_once, i] = K.f[THERE, i] - K.f[TRIAL, i]
        if not better(K.pushes, at_once):
            return NOT_SETTLED
        for i in range(nv):
            K.f[TRIAL, i] += K.pushes[at_once, i]
        last = change
    return NOT_SETTLED


@formula
def enter(K, c):
    """Make the end of the step the present state, and remember what the next one needs."""
    for i in range(K.v.shape[1]):
        K.f[HERE, i] = K.f[THERE, i]
        K.p[CARRIED, i] = K.p[CARRIED_ON, i]
    for e in range(K.rows.shape[1]):
        K.rows[HERE, e] = K.rows[THERE, e]
    for r in range(K.lam.shape[1]):
        K.lam[START, r] = K.found[r]
    K.count.before = 1
    c.real.before = c.real.t
    enter_step(c, ending(c))


@formula
def answer(callbacks, S, K, c, task):
    """What the `loop` asks of the method: as `asked.answer`."""
    compose, arrive, inspect = callbacks[0], callbacks[1], callbacks[2]
    if task == TRY:
        c.count.extended, c.real.error = 0, 0.0
        return attempt(callbacks, S, K, c, c.real.tried)
    if task == WITHIN:
        return within(between, compose, S, K, c)
    if task == ENTER:
        enter(K, c)
        return 0
    if task == REFUSE:
        return 1
    if task == OVERLOOKED or task == ENDED:
        inspect(c.real.t, c.real.tried, c.real.span, AT_END, c.seen, S, K)
        return 0
    if task == BEGIN:
        return begin(arrive, inspect, S, K, c)
    return 0
