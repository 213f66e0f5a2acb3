"""Workspaces of the implicit integrators: named arrays, counts and tolerances.

The equations of motion are of second order on a manifold, with constraints (Gear, Gupta and Leimkuhler 1985):

    d' = T(d) (v + D G^T mu),  r(t, q0 (+) d, v, v', lam, x) = 0,  G v = nu,  g = 0,  x' = f(t, q0 (+) d, v, x)

d is the increment from the state at which a step begins; x, states of first order, are the first of the
integrals. Unknowns are ordered d, v, lam, mu, x, equations as written.
"""

from __future__ import annotations

from typing import NamedTuple

from ...compiler.struct_layout import Complex1, Complex2, Float1, Float2, Int1, Int2, Record
from ..sparse_factorisation import LUPattern

STEP_START = 3  # row of the state at which a step begins, also used by the error estimate


class ImplicitCounts(Record, kind="Int"):
    """Counters and choices of an implicit method."""

    iterations: int
    jacobians: int
    factors: int
    fresh: int  # whether the Jacobian is that of the present state (1), reusable (0) or outdated (-1)
    before: int  # whether the polynomial of the previous step exists
    refine: int  # refinements of each linear solve
    least: int  # minimum number of iterations of a step
    whole: int  # iterations of all stages together
    index_3: int  # whether velocities are not projected on the constraints (index 3)
    shared: int  # first position of the row scales in the Jacobian if forces depend on multipliers, else 0
    infinite_slopes: int  # whether slopes of laws may be infinite (`radau_stages.confirm_convergence`)


class ImplicitReals(Record, kind="Float"):
    """Tolerances and rates of an implicit method."""

    rtol: float  # relative tolerance as used by the error estimate
    atol: float
    newton: float  # tolerance of the Newton iteration
    theta: float  # its last contraction ratio
    rate: float
    width: float  # width for which the matrices are factored
    last_h: float  # width and error of the previous step
    last_error: float
    result: float  # result of the last step: number of iterations, or factor for its width
    soft: float  # regularisation
    rounding_size: float  # size of corrections that count as rounding once they stop decreasing
    reuse_rate: float  # contraction ratio up to which a Jacobian is reused
    stays: float  # growth factor of the width up to which the width and the factors are kept
    correction: float  # size of the last Newton correction


class RadauStepWorkspace(NamedTuple):
    """Workspace and tables of one run of Radau IIA."""

    count: ImplicitCounts  # type: ignore[assignment]
    real: ImplicitReals  # type: ignore[assignment]
    d: Float2  # (4, nv): increments at the stages; last: for the error estimate
    v: Float2  # (4, nv)
    dd: Float2  # (4, nv): rates of d
    a: Float2  # (4, nv)
    lam: Float2  # (4, nr): multipliers; last: at the start of the step
    found: Float1  # (nr,): multipliers at the state projected last
    proximal_point: Float2  # (3, nr): reference multipliers of regularised rows (`radau_stages.shift_proximal_point`)
    mu: Float2  # (4, nr): multipliers of the stabilisation
    z: Float2  # (4, nz): x and integrals over the motion at the stages; last: at the start of the step
    rate: Float2  # (4, nz): their rates from the equations
    xd: Float2  # (4, nx): rates of x from the stage values
    out: Float2  # (4, n): residuals of the equations
    previous_v: Float2  # (4, nv): of the previous step: stages, and its start
    previous_lam: Float2  # (3, nr)
    previous_x: Float2  # (4, nx)
    tol: Float2  # (2, nv): tolerances of d and v in this step
    tol_x: Float1  # (nx,): and of x
    place: Int1  # (nv,): component of the state whose rate is the velocity, or -1: a rotation
    x: Float2  # (3, n): solution, right-hand side, product
    w: Complex2  # (3, n), complex
    J: Float2  # (4, n): entries of the Jacobian at the stages and at the start of the step; the first is 1
    spring: Int2  # (entries, 5): equation and velocity; entries of the Jacobian by increment, rate, velocity
    scatter: Int2  # (entries, 2): place in the matrix, entry of the Jacobian: with factor 1, h-scale, its inverse
    part: Int1  # (2,): ends of the first two groups of `scatter`
    real_A: Float1  # the real matrix and its factors
    real_L: Float1
    real_U: Float1
    real_D: Float1
    real_Y: Float1
    pair_A: Complex1  # the complex matrix and its factors
    pair_L: Complex1
    pair_U: Complex1
    pair_D: Complex1
    pair_Y: Complex1
    P: LUPattern
    whole_scatter: Int2  # (entries, 4): place in the matrix of all stages, row of J, entry, multiplier
    whole_x: Float2  # (3, 3 n)
    whole_A: Float1
    whole_L: Float1
    whole_U: Float1
    whole_D: Float1
    whole_Y: Float1
    whole_P: LUPattern


class AlphaStepWorkspace(NamedTuple):
    """Workspace and tables of one run of generalised-alpha; fields shared with `RadauStepWorkspace` mean the same."""

    count: ImplicitCounts  # type: ignore[assignment]
    real: ImplicitReals  # type: ignore[assignment]
    rho: Float1  # (1,): spectral radius at infinity
    d: Float2
    v: Float2
    dd: Float2
    a: Float2
    lam: Float2
    found: Float1
    mu: Float2
    z: Float2
    rate: Float2
    xd: Float2
    out: Float2
    tol: Float2
    tol_x: Float1
    place: Int1
    x: Float2
    J: Float2
    spring: Int2
    scatter: Int2
    part: Int1
    real_A: Float1
    real_L: Float1
    real_U: Float1
    real_D: Float1
    real_Y: Float1
    P: LUPattern
    past: Float2  # (4, nv + nx): stored accelerations of the method, and rates of x
    ends: Float2  # (2, nv): accelerations at the ends of the step
    turns: Int1  # first angular velocity of each quaternion


class VariationalStepWorkspace(NamedTuple):
    """Workspace of one run of the variational method; fields shared with `RadauStepWorkspace` mean the same."""

    count: ImplicitCounts  # type: ignore[assignment]
    real: ImplicitReals  # type: ignore[assignment]
    d: Float2
    v: Float2
    a: Float2
    lam: Float2
    found: Float1
    z: Float2
    rate: Float2
    ends: Float2  # (2, nv): accelerations at the ends of the step
    turns: Int1  # first angular velocity of each quaternion
    p: Float2  # (4, nv): momenta of the free motion, on arrival, at the start of the step and at its end
    f: Float2  # (3, nv): forces at its start, at its end, and assumed at its end
    g: Float1  # (nr,): violations
    rows: Float2  # (2, nG): G at the start and at the end
    steps: Float2  # (rows, nr): of the position iteration
    pushes: Float2  # (rows, nv): of the force iteration
