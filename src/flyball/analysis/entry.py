"""The compiled entry points. Few on purpose: each holds the right-hand side and costs seconds to compile once."""

from __future__ import annotations

from .._jit import kernel
from ..numerics.integrators.explicit import advance
from ..numerics.ldl import ldl_factor
from ..system.motion import derivative, place, project, report
from ..system.solve import factor

POSITION, MOTION, FACTOR = 0, 1, 2


@kernel
def evaluate(S, W, t, y, dy, level):
    """Kinematics and rows at (t, y); at level MOTION also dy = f(t, y), at level FACTOR the factor of the solve."""
    if level == 1:
        return derivative(t, y, dy, S, W)
    nq = S.kinds[-2]
    place(S, W, t, y[:nq], y[nq : nq + W.vel.shape[1]])
    if level == 2:
        return factor(S, W)
    return 0


@kernel
def simulate(S, W, tableau, clock, out):
    """Go on with an integration; returns the number of output rows written."""
    return advance(derivative, project, report, S, W, tableau, clock, out)


@kernel
def factor_matrix(P, A, L, D, Y):
    """Factor a sparse symmetric matrix; see ``ldl_factor``."""
    return ldl_factor(P, A, L, D, Y)
