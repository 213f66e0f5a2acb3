"""Newton's method on velocities, with impulses held on to: second order, for few bodies and any ratio of masses.

The contact problem is the limit of ones with a compliance R, min 1/2 |e|^2 + sum of envelopes (`smooth.py`), a convex
function once differentiable, piecewise smooth: Newton's method with the exact Hessian of the piece at hand, factored in
6 x 6 blocks, and an exact line search along the step ends in few steps (Todorov 2014; Castro et al. 2022 in velocities
with finite compliance). Impulses are then held on to (p0 = p, the method of multipliers: Rockafellar 1976), so that
contact is hard however large R is, and a warm start that is right costs no factor at all. R falls as the multipliers
get closer. Coulomb's law: De Saxce's addition mu |u_t| to the normal velocity is renewed with the multipliers
(Cadoux 2009).
"""

from __future__ import annotations

from ...compiler.formulas import by_address, formula
from ...compiler.kernels import kernel
from ...math.scalar import sqrt
from .blocks import factor, solve
from .fill import fill_rows, hand_back, make_safe, residual, set_own, set_slips, span_of
from .gather import BLOCKS, CONTACTS, ROWS
from .layout import prepare, rows_of
from .problem import (
    BROKEN,
    CONVERGED,
    CUT,
    STALLED,
    Choices,
    Factor,
    Problem,
    Scratch,
    State,
)
from .prox import (
    CONTACT,
    COULOMB_CONTACT,
    DY,
    FRICTION,
    HELD,
    METRIC,
    MOBILITY,
    OWN,
    ROOT_N,
    ROOT_T,
    WIDE,
    Q,
    U,
    Y,
    nearest,
    set_kind,
    set_metric,
    slipped,
)
from .smooth import add_impulse, along_step, from_held, hessian, product, set_impulses, set_y, slope_along

# compliance, in parts of the mobility: far from the solution, near it, the least
MOST_RHO, SMALL_RHO, LEAST_RHO, FLAT_RHO = 0.1, 1e-3, 1e-9, 1e-6  # FLAT: without friction
FALL, FALL_NEAR, NEAR = 0.1, 0.01, 1e-3  # where impulses come closer slowly; residual over velocities that is near
RAISE = 3.0  # of the compliance where Newton's method on the law itself does not come closer
ROOM, MANY = 1.0, 12  # see `next_rho`; steps at one compliance, after which it was too small
SLOW = 0.05  # change of impulses over the one before, from which on the compliance falls
EXACT = 0.1  # what is left of the slope along a step when its length is right
SEARCHES, HALVINGS = 30, 4


@formula
def direction(R, symmetric):
    """Step from the gradient; its e . step, |step|^2 and gradient . step. False if the matrix could not be factored."""
    n = R.size[BLOCKS]
    b, g, s = R.blocks, 6 * n, 12 * n
    hessian(R, symmetric)
    Lp = R.graph[6 * (n + 1) : 7 * (n + 1)]
    if not factor(n, Lp, R.Li, R.D, R.L, symmetric):
        return False, 0.0, 0.0, 0.0
    for k in range(g):
        b[s + k] = -b[g + k]
    solve(n, Lp, R.Li, R.D, R.L, b[s : s + g])
    first, second, down = 0.0, 0.0, 0.0
    for k in range(g):
        first += b[k] * b[s + k]
        second += b[s + k] * b[s + k]
        down += b[g + k] * b[s + k]
    return True, first, second, down


@formula
def length(R, first, second, down):
    """How much of a step makes the objective least along it: the slope is continuous, rising and piecewise smooth."""
    low, high, a = 0.0, 1e300, 1.0
    at_low, at_high = down, 0.0
    for _ in range(SEARCHES):
        here = slope_along(R, a, first, second)
        if abs(here) <= -EXACT * down:
            return a
        if here < 0.0:
            low, at_low = a, here
            if high > 1e299:
                a *= 2.0
                continue
        else:
            high, at_high = a, here
        a = low - at_low * (high - low) / (at_high - at_low)
        a = min(max(a, low + 0.1 * (high - low)), high - 0.1 * (high - low))
    return a


@formula
def left(R, a):
    """|e - sum G' p|^2 at the part a of the step."""
    x, n = R.row, 6 * R.size[BLOCKS]
    for k in range(n):
        R.blocks[3 * n + k] = R.blocks[k] + a * R.blocks[2 * n + k]
    for row in range(R.size[ROWS]):
        o = WIDE * row
        p = nearest(x, o, x[o + Y] + a * x[o + DY], x[o + Y + 1] + a * x[o + DY + 1], x[o + Y + 2] + a * x[o + DY + 2])
        if p[0] != 0.0:
            add_impulse(R, row, 3 * n, -p[0] / x[o + ROOT_N], -p[1] / x[o + ROOT_T], -p[2] / x[o + ROOT_T])
    s = 0.0
    for k in range(n):
        s += R.blocks[3 * n + k] * R.blocks[3 * n + k]
    return s


@formula
def part(R):
    """How much of a step leaves less of what is to vanish, where that is no gradient; 0 if nothing does."""
    n = 6 * R.size[BLOCKS]
    now, a = 0.0, 1.0
    for k in range(n):
        now += R.blocks[n + k] * R.blocks[n + k]
    for _ in range(HALVINGS):
        if left(R, a) < (1.0 - 0.5 * a) * now:
            return a
        a *= 0.5
    return 0.0


@formula
def advance(R, a):
    """e and the scaled y move by the part a of the step.

    y is not found anew from e: velocities are differences of large numbers where a heavy body stands on light ones, and
    their rounding over R would be seen in every impulse; in this way it is only once, and solved for.
    """
    x, n = R.row, 6 * R.size[BLOCKS]
    for k in range(n):
        R.blocks[k] += a * R.blocks[2 * n + k]
    for row in range(R.size[ROWS]):
        o = WIDE * row
        for k in range(3):
            x[o + Y + k] += a * x[o + DY + k]


@formula
def gaps(R, coulomb):
    """Of the impulses at y: residuals, velocity that is still to come of the gradient, compliance times change [m/s].

    The velocities that these impulses make are left in column OWN of the rows.
    """
    x, g = R.row, 6 * R.size[BLOCKS]
    near, change = 0.0, 0.0
    for row in range(R.size[ROWS]):
        o = WIDE * row
        a, b, c = product(R, row, g)
        r, p, q = x[o + METRIC], x[o + ROOT_N], x[o + ROOT_T]
        x[o + OWN] = r * x[o + HELD] - p * x[o + Y] - slipped(x, o) - a
        x[o + OWN + 1] = r * x[o + HELD + 1] - q * x[o + Y + 1] - b
        x[o + OWN + 2] = r * x[o + HELD + 2] - q * x[o + Y + 2] - c
        near = max(near, a * a + b * b + c * c)
        a, b, c = x[o + Q] / p - x[o + HELD], x[o + Q + 1] / q - x[o + HELD + 1], x[o + Q + 2] / q - x[o + HELD + 2]
        change = max(change, r * r * (a * a + b * b + c * c))
    return residual(R, coulomb), sqrt(near), sqrt(change)


@formula
def hold(R, coulomb):
    """Hold on to the impulses at y."""
    x, n = R.row, 6 * R.size[BLOCKS]
    for row in range(R.size[ROWS]):
        o = WIDE * row
        x[o + HELD] = x[o + Q] / x[o + ROOT_N]
        x[o + HELD + 1], x[o + HELD + 2] = x[o + Q + 1] / x[o + ROOT_T], x[o + Q + 2] / x[o + ROOT_T]
    set_slips(R, coulomb)
    for k in range(n):
        R.blocks[k] -= R.blocks[n + k]


@formula
def inner(R, O, coulomb, law, steps):
    """Newton steps at what is held on to: (how it ended, residual, change of what is held on to, steps)."""
    enough, last = O.real.enough, steps + MANY
    while True:
        set_impulses(R)
        (worst, O.real.force_residual), near, change = gaps(R, coulomb)
        if worst != worst:
            return BROKEN, worst, change, steps
        if worst <= enough or near <= max(0.1 * change, 0.1 * enough):
            return CONVERGED, worst, change, steps
        if steps >= O.count.most:
            return CUT, worst, change, steps
        if steps >= last:
            return STALLED, worst, change, steps
        steps += 1
        good, first, second, down = direction(R, not law)
        if not good:
            return STALLED if law else BROKEN, worst, change, steps
        along_step(R)
        a = part(R) if law else length(R, first, second, down)
        if law and a == 0.0:
            return STALLED, worst, change, steps
        advance(R, a)


@formula
def fastest(R):
    """The largest velocity without impulses, or of an impulse that is held on to, by itself [m/s]."""
    s = 0.0
    for row in range(R.size[ROWS]):
        o = WIDE * row
        for k in range(3):
            s = max(s, abs(R.row[o + U + k]), R.row[o + MOBILITY] * abs(R.row[o + HELD + k]))
    return s


@formula
def rough(R):
    """Whether there is friction anywhere; without it all pieces are flat, and a small compliance is as easy as any."""
    f = 0.0
    for row in range(R.size[CONTACTS]):
        f = max(f, R.row[WIDE * row + FRICTION])
    return f > 0.0


@formula
def next_rho(rho, slow, near):
    """Compliance of the next problem; ``near``: residual over the largest velocity."""
    if slow:  # but not so small that a velocity as large as the residual moves impulses by as much as they are
        rho = max((FALL if near > NEAR else FALL_NEAR) * rho, min(rho, ROOM * near), LEAST_RHO)
    return min(rho, max(near, SMALL_RHO))


@formula
def search(R, O, coulomb, worst):
    """Impulses within `ENOUGH`, held on to. Returns how it ended and the residual.

    Coulomb's law by turns: convex problems with De Saxce's additions held on to, and Newton's method on the law itself.
    """
    steps, before, law, best, force = 0, 1e300, False, 1e300, 0.0
    rho = min(max(worst / fastest(R), SMALL_RHO), MOST_RHO) if rough(R) else FLAT_RHO
    set_slips(R, coulomb)
    for _ in range(4 * O.count.most + 20):
        set_metric(R, rho)
        if law:
            set_kind(R, CONTACT, COULOMB_CONTACT)
        set_y(R)
        ended, worst, change, steps = inner(R, O, coulomb, law, steps)
        O.count.used = steps
        if law:
            set_kind(R, COULOMB_CONTACT, CONTACT)
            if ended != CONVERGED or not worst < best:  # it has not come closer: on as before it
                if ended == CUT:
                    O.real.force_residual = force
                    return CUT, best
                from_held(R)
                law, before, rho = False, 1e300, min(RAISE * rho, MOST_RHO)
                continue
        hold(R, coulomb)
        if ended == CUT or ended == BROKEN or worst <= O.real.enough:
            return ended, worst
        best, force, law = worst, O.real.force_residual, coulomb > 0.0
        if ended == STALLED:
            rho, before = min(10.0 * rho, MOST_RHO), 1e300
        else:
            rho, before = next_rho(rho, change > SLOW * before, worst / fastest(R)), change
    return STALLED, worst


@formula
def newton_solve(P, X, O, F):
    """See `newton`."""
    span = span_of(P, O)
    if P.turn.shape[0] > 0 and O.count.coulomb == 0:
        O.count.ended = BROKEN
        return 0
    if not prepare(P, span, F, O):
        return 0
    R = by_address(rows_of(P, F, F.places[:16]))
    fill_rows(P, X, R, span)
    from_held(R)
    coulomb = 1.0 * O.count.coulomb
    set_own(R)
    worst, O.real.force_residual = residual(R, coulomb)
    O.count.used = 0
    ended = CONVERGED
    if not worst <= O.real.enough:
        ended, worst = search(R, O, coulomb, worst)
        if ended == CUT:
            make_safe(R)
    O.count.ended, O.real.residual = ended, worst
    if ended != BROKEN:
        hand_back(P, X, R, span)
    return O.count.used


@kernel
def newton(P: Problem, X: State, W: Scratch, O: Choices, F: Factor, task: int) -> int:
    """Newton's method; returns factorisations.

    In `Choices.count[ENDED]` SMALL: enlarge `Factor`, call again; BROKEN: not finite, or the convex form with rolling
    friction, which it does not take. Then nothing was changed.
    """
    return newton_solve(P, X, O, F)
