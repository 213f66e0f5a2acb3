"""What an implicit integrator works with, and the names of its entries.

The equations are those of the second order on a manifold, with constraints (Gear, Gupta and Leimkuhler 1985):

    d' = T(d) (v + D G^T mu),  r(t, q0 (+) d, v, v', lam, x) = 0,  G v = nu,  g = 0,  x' = f(t, q0 (+) d, v, x)

d is the increment from the state at which a step begins; x, states of the first order, are the first of the integrals.
Unknowns are ordered d, v, lam, mu, x, equations as written.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...lu import Rows

# entries of Desk.count: what was done; whether the Jacobian is that of the present state (1), serves (0) or not (-1);
# whether there is a polynomial of the step before; refinements of each linear solve; iterations of a step at least;
# iterations of all stages together; whether velocities are not held to the constraints (index 3); where the sizes of
# rows begin in the Jacobian, if forces depend on multipliers; whether laws of forces or states have corners
ITERATIONS, JACOBIANS, FACTORS, FRESH, BEFORE, REFINE, LEAST, WHOLE, INDEX_3, SHARED, CORNERS, COUNTS = range(12)
# entries of Desk.real: tolerances as the estimate needs them; bound of the iteration; its last ratio, and its rate;
# width that is factored for; width and error of the step before; what the last step asks for: iterations it took, or
# the factor of its width; regularisation; size of corrections that are taken for rounding where they do not fall any
# more; rate of the iteration up to which a Jacobian serves on; what a step could be wider by and is not, since its
# factors serve on
RTOL, ATOL, NEWTON, THETA, RATE, WIDTH, LAST_H, LAST_ERROR, ASKED, SOFT, ROUGH, SERVES, STAYS, REALS = range(14)
START = 3  # row of the state at which a step begins, and of the error estimate


class Desk(NamedTuple):
    """Scratch and tables of one run."""

    count: np.ndarray  # type: ignore[assignment]  # (COUNTS,)
    real: np.ndarray  # (REALS,)
    d: np.ndarray  # (4, nv): increments at the stages; last: of the estimate
    v: np.ndarray  # (4, nv)
    dd: np.ndarray  # (4, nv): rates of both
    a: np.ndarray  # (4, nv)
    lam: np.ndarray  # (4, nr): multipliers; last: at the begin of the step
    found: np.ndarray  # (nr,): multipliers at the state last arrived at
    led: np.ndarray  # (3, nr): multipliers that rows, where they are soft, give way beyond (`share`)
    mu: np.ndarray  # (4, nr): of the stabilisation
    z: np.ndarray  # (4, nz): x and integrals of the motion at the stages; last: at the begin of the step
    rate: np.ndarray  # (4, nz): their rates, as the equations say
    xd: np.ndarray  # (4, nx): rates of x as stage values say
    out: np.ndarray  # (4, n): what the equations miss
    before_v: np.ndarray  # (4, nv): of the step before: stages, and where it began
    before_lam: np.ndarray  # (3, nr)
    before_x: np.ndarray  # (4, nx)
    tol: np.ndarray  # (2, nv): tolerances of d and v in this step
    tol_x: np.ndarray  # (nx,): and of x
    place: np.ndarray  # (nv,): component of the state that a velocity is the rate of, or -1: a turn
    x: np.ndarray  # (3, n): solution, right-hand side, product
    w: np.ndarray  # (3, n), complex
    J: np.ndarray  # (4, n): numbers of the Jacobian at the stages and where the step begins; the first is 1
    spring: np.ndarray  # (entries, 5): equation and velocity; numbers of the Jacobian by increment, rate, velocity
    put: np.ndarray  # (entries, 2): place in the matrix, number of the Jacobian: times 1, h-scale, its inverse
    part: np.ndarray  # (2,): ends of the first two groups of these
    real_A: np.ndarray  # the real matrix and its factors
    real_L: np.ndarray
    real_U: np.ndarray
    real_D: np.ndarray
    real_Y: np.ndarray
    pair_A: np.ndarray  # the complex one
    pair_L: np.ndarray
    pair_U: np.ndarray
    pair_D: np.ndarray
    pair_Y: np.ndarray
    P: Rows
    whole_put: np.ndarray  # (entries, 4): place in the matrix of all stages, row of J, number, what it is multiplied by
    whole_x: np.ndarray  # (3, 3 n)
    whole_A: np.ndarray
    whole_L: np.ndarray
    whole_U: np.ndarray
    whole_D: np.ndarray
    whole_Y: np.ndarray
    whole_P: Rows
