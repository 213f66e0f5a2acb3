"""Residuals of a solve over its iterations, for every solver: solves of one problem, cut after 1, 2, 3, ... iterations.

Each row is the result of a solve of its own from the same start, so the solver that is measured is the one that runs:
also one that treats islands separately, or returns its best iterate.
"""

from __future__ import annotations

import numpy as np

from ...compiler.formulas import formula
from ...compiler.kernels import kernel
from ...compiler.struct_layout import Float1
from ...math.scalar import sqrt
from .contact_operator import (
    biased_velocity,
    contact_angular_velocity,
    contact_range,
    contact_velocity,
    residuals,
)
from .contact_problem import ContactProblem, ContactSolution, SolverSettings, allocate_solver
from .solver_choice import prepare_solver

EVERY_CUT = 32  # number of iterations up to which each is a cut; further cuts grow by an eighth
CUT_GROWTH = 1.125


# columns: number of iterations; residual of the natural map as a velocity [m/s] and as a force (missing impulse over
# the largest impulse); largest speed at which a contact still approaches [m/s]; largest |p . (u + mu |u_t| n)| of a
# contact [J]; 1/2 p' N p + b' p [J]
ITERATION, VELOCITY, FORCE, PRIMAL, COMPLEMENTARITY, ENERGY, COLUMNS = range(7)


@formula
def feasibility(P, X, O):
    """Return the largest speed of approach, and the largest product of an impulse and the velocity of its law."""
    worst, work, coulomb = 0.0, 0.0, 1.0 * O.count.coulomb
    first, last = contact_range(P, O)
    for c in range(first, last):
        u = biased_velocity(P, X, c, contact_velocity(P, X.v, X.wide, c))
        more = P.mu[c] * sqrt(u[1] * u[1] + u[2] * u[2])
        product = X.p[c, 1] * u[1] + X.p[c, 2] * u[2]
        if P.turn.shape[0] > 0:
            w = contact_angular_velocity(P, X.v, X.wide, c)
            more += P.turn[c, 0] * sqrt(w[1] * w[1] + w[2] * w[2]) + P.turn[c, 1] * abs(w[0])
            for k in range(3):
                product += X.torque[c, k] * w[k]
        worst = max(worst, -u[0])
        work = max(work, abs(product + X.p[c, 0] * (u[0] + coulomb * more)))
    return worst, work


@kernel
def solve_residuals(
    P: ContactProblem, X: ContactSolution, start: ContactSolution, O: SolverSettings, out: Float1
) -> int:
    """Compute the residuals of the solution X; ``start`` holds the velocities without impulses."""
    velocity, force, linear, square = residuals(P, X, O, (X.v, X.wide, start.v, start.wide))
    out[VELOCITY], out[FORCE], out[ENERGY] = velocity, force, 0.5 * square + linear
    out[PRIMAL], out[COMPLEMENTARITY] = feasibility(P, X, O)
    return 0


def cuts(most: int) -> list[int]:
    """Return the numbers of iterations after which a solve is cut, the last of them ``most``."""
    out = [0]
    while out[-1] < most:
        out.append(min(most, max(out[-1] + 1, int(out[-1] * CUT_GROWTH)) if out[-1] >= EVERY_CUT else out[-1] + 1))
    return out[1:]


def solve_history(solver: str, P: ContactProblem, start: ContactSolution, settings: SolverSettings) -> np.ndarray:
    """Return the residuals of a solve over its iterations.

    Parameters
    ----------
    solver : str
        One of `solver_choice.solver_names`.
    P : ContactProblem
    start : ContactSolution
        Warm start, and velocities without impulses; unchanged.
    settings : SolverSettings
        Of the solve, with its limits of iterations and its tolerance; unchanged.

    Returns
    -------
    ndarray (n, COLUMNS)
        The last row is that of the whole solve.
    """
    X, W, O, _ = allocate_solver(P)
    O.count[:], O.real[:] = settings.count, settings.real
    prepared = prepare_solver(solver, P, X, W, O)
    rows = np.zeros((0, COLUMNS))
    most, most_steps = int(settings.count.most), int(settings.count.most_steps)  # of sweeps, and of Newton's method
    for cut in cuts(max(most, most_steps)):
        for mine, first in zip(X, start, strict=True):
            mine[...] = first
        O.count.most, O.count.most_steps = min(cut, most), min(cut, most_steps)
        used = int(prepared.kernel(P, X, W, O, prepared.F, 0))
        row = np.zeros(COLUMNS)
        solve_residuals(P, X, start, O, row)
        row[ITERATION] = min(used, cut)
        rows = np.vstack([rows, row])
        if used < cut:
            break
    return rows
