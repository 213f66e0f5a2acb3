"""The linear complementarity problem: a friction pyramid with d edges in place of the cone, by Gauss-Seidel.

Stewart and Trinkle 1996, Anitescu and Potra 1997: the tangential impulse is a sum of nonnegative impulses in d
directions, together at most mu p_n, with maximum dissipation. Equivalently, a step against the velocity is projected on
a regular d-gon. The tests solve small
problems by pivoting instead (Lemke 1965).
"""

from __future__ import annotations

import math

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ...math.scalar import atan2, cos, sin
from .contact_operator import (
    apply_contact_impulse,
    apply_line_impulse,
    contact_range,
    contact_velocity,
    finish_solve,
    larger_or_nan,
    line_range,
    node_range,
    residuals,
)
from .contact_problem import (
    CONVERGED,
    LIMIT_REACHED,
    SOLVE_FAILED,
    ContactProblem,
    ContactSolution,
    ContactWorkspace,
    FactorStorage,
    SolverSettings,
)
from .gauss_seidel import sweep_lines
from .packed_contacts import (
    copy_nodes,
    count_contact_kinds,
    pack_contacts,
)

ALL_FRICTIONAL = 2  # no contact counts as one of spheres


@formula
def project_on_polygon(d, r, x, y):
    """Project (x, y) on the regular polygon with d corners at distance r, the first along x."""
    half = math.pi / d
    side = math.floor(atan2(y, x) / (2.0 * half))  # the corners are at angles 2 half side, 2 half (side + 1)
    middle = (2.0 * side + 1.0) * half
    c, s = cos(middle), sin(middle)
    out, along = c * x + s * y, c * y - s * x
    if out <= r * cos(half):
        return x, y
    most = r * sin(half)
    out, along = r * cos(half), min(max(along, -most), most)
    return c * out - s * along, s * out + c * along


@formula
def pyramid_sliding_friction(d, angle):
    """Sliding friction on a pyramid relative to that on the cone: components against the velocity, and across it.

    Parameters
    ----------
    d : int
        Number of edges of the pyramid.
    angle : float
        Direction of the velocity [rad], from an edge.

    Returns
    -------
    tuple of float
        It acts along the edge nearest to the direction opposite to the velocity; on the cone: (1, 0).
    """
    part = 2.0 * math.pi / d
    off = angle - part * math.floor(angle / part + 0.5)
    return cos(off), -sin(off)


@formula
def update_pyramid(P, X, W, c, at, d):
    """Update one contact: the normal impulse, then the tangential one; returns the largest change of a velocity."""
    k = W.frictional
    u, p = contact_velocity(P, W.node_state, X.wide, c), k.impulse[at, 0]
    n = max(p - (u[0] + k.bias[at, 0] + k.soft[at] * p) * k.inverse_nn[at], k.least[at])
    x = k.impulse[at, 1] - k.sliding_step[at] * (u[1] + k.bias[at, 1] + k.ns[at] * (n - p))
    y = k.impulse[at, 2] - k.sliding_step[at] * (u[2] + k.bias[at, 2] + k.nt[at] * (n - p))
    x, y = project_on_polygon(d, k.mu[at] * n, x, y)
    change = n - p, x - k.impulse[at, 1], y - k.impulse[at, 2]
    k.impulse[at, 0], k.impulse[at, 1], k.impulse[at, 2] = n, x, y
    X.p[c, 0], X.p[c, 1], X.p[c, 2] = n, x, y
    apply_contact_impulse(P, W.node_state, X.wide, c, change)
    moved = abs(change[0]) + abs(change[1]) + abs(change[2])
    return moved / k.inverse_nn[at] if moved > 0.0 else 0.0


@formula
def pyramid_residuals(P, X, W, O, worst):
    """Residuals for `finish_solve`: the residual is the change in the last sweep, the objective is exact."""
    _, _, linear, square = residuals(P, X, O, (W.node_state, X.wide, W.free, W.free_wide))
    first, last = contact_range(P, O)
    most, step = 0.0, 0.0
    for c in range(first, last):
        most = max(most, abs(X.p[c, 0]))
        step = max(step, W.rows[1, c, 0])
    return worst, worst * step / most if most > 0.0 else worst * step, linear, square


@formula
def prepare_pyramids(P, X, W, O):
    """Pack contacts, and apply the initial impulses; returns the number of contacts."""
    first, last = contact_range(P, O)
    copy_nodes(P, X, W, node_range(P, O))
    for k in range(X.wide.shape[0]):
        W.free_wide[k] = X.wide[k]
    pack_contacts(P, X, W, 1, first, count_contact_kinds(P, W, first, last, ALL_FRICTIONAL))
    begin, end = line_range(P, O)
    for k in range(begin, end):
        apply_line_impulse(P, X.wide, k, X.line[k])
    return last - first


@kernel
def pyramid(
    P: ContactProblem, X: ContactSolution, W: ContactWorkspace, O: SolverSettings, F: FactorStorage, task: int
) -> int:
    """Sweep until velocities change by less than O.real.enough, or O.count.most times. Returns sweeps.

    Coulomb's law on a pyramid of O.count.directions edges, at least three; without rolling friction. Otherwise it
    ends with `SOLVE_FAILED` and changes nothing.
    """
    used, O.count.ended = 0, LIMIT_REACHED
    if P.turn.shape[0] > 0 or O.count.directions < 3 or not O.count.coulomb:
        O.count.ended, O.count.used = SOLVE_FAILED, 0
        return 0
    n = prepare_pyramids(P, X, W, O)
    worst = 0.0
    while used < O.count.most:
        turned, worst = used % 2 == 1, 0.0
        for e in range(n):
            s = n - 1 - e if turned else e
            worst = larger_or_nan(worst, update_pyramid(P, X, W, W.contact_nodes[s, 2], s, O.count.directions))
        worst = larger_or_nan(worst, sweep_lines(P, X, O, turned))
        used += 1
        if worst <= O.real.enough:
            O.count.ended = CONVERGED
            break
    O.count.used = used
    finish_solve(P, X, W, O, pyramid_residuals(P, X, W, O, worst))
    return used
