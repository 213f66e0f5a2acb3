"""Workspaces of the implicit integrators: named arrays, counts and tolerances.

The equations are those of the second order on a manifold, with constraints (Gear, Gupta and Leimkuhler 1985):

    d' = T(d) (v + D G^T mu),  r(t, q0 (+) d, v, v', lam, x) = 0,  G v = nu,  g = 0,  x' = f(t, q0 (+) d, v, x)

d is the increment from the state at which a step begins; x, states of the first order, are the first of the
integrals. Unknowns are ordered d, v, lam, mu, x, equations as written.
"""

from __future__ import annotations

from typing import NamedTuple

from ...compiler.struct_layout import Complex1, Complex2, Float1, Float2, Int1, Int2, Record
from ..sparse_factorisation import LUPattern

STEP_START = 3  # row of the state at which a step begins, and of the error estimate


class ImplicitCounts(Record, kind="Int"):
    """What an implicit method has done, and how it goes about it."""

    iterations: int
    jacobians: int
    factors: int
    fresh: int  # whether the Jacobian is that of the present state (1), serves (0) or not (-1)
    before: int  # whether there is a polynomial of the step before
    refine: int  # refinements of each linear solve
    least: int  # iterations of a step at least
    whole: int  # iterations of all stages together
    index_3: int  # whether velocities are not held to the constraints
    shared: int  # where the sizes of rows begin in the Jacobian, if forces depend on multipliers
    infinite_slopes: int  # whether slopes of laws may be infinite (`radau_stages.confirm_convergence`)


class ImplicitReals(Record, kind="Float"):
    """Tolerances and rates of an implicit method."""

    rtol: float  # as the error estimate needs it
    atol: float
    newton: float  # bound of the iteration
    theta: float  # its last ratio
    rate: float
    width: float  # of the step that is factored for
    last_h: float  # width and error of the step before
    last_error: float
    asked: float  # what the last step asks for: iterations it took, or the factor of its width
    soft: float  # regularization
    rounding_size: float  # size of corrections that are taken for rounding where they do not fall any more
    reuse_rate: float  # rate of the iteration up to which a Jacobian serves on
    stays: float  # what a step could be wider by and is not, since its factors serve on
    correction: float  # size of the last correction of the iteration


class RadauStepWorkspace(NamedTuple):
    """Scratch and tables of one run."""

    count: ImplicitCounts  # type: ignore[assignment]
    real: ImplicitReals  # type: ignore[assignment]
    d: Float2  # (4, nv): increments at the stages; last: of the estimate
    v: Float2  # (4, nv)
    dd: Float2  # (4, nv): rates of both
    a: Float2  # (4, nv)
    lam: Float2  # (4, nr): multipliers; last: at the begin of the step
    found: Float1  # (nr,): multipliers at the state last arrived at
    proximal_point: Float2  # (3, nr): multipliers that rows, where they are soft, give way beyond (`share`)
    mu: Float2  # (4, nr): of the stabilisation
    z: Float2  # (4, nz): x and integrals of the motion at the stages; last: at the begin of the step
    rate: Float2  # (4, nz): their rates, as the equations say
    xd: Float2  # (4, nx): rates of x as stage values say
    out: Float2  # (4, n): what the equations miss
    previous_v: Float2  # (4, nv): of the step before: stages, and where it began
    previous_lam: Float2  # (3, nr)
    previous_x: Float2  # (4, nx)
    tol: Float2  # (2, nv): tolerances of d and v in this step
    tol_x: Float1  # (nx,): and of x
    place: Int1  # (nv,): component of the state that a velocity is the rate of, or -1: a turn
    x: Float2  # (3, n): solution, right-hand side, product
    w: Complex2  # (3, n), complex
    J: Float2  # (4, n): numbers of the Jacobian at the stages and where the step begins; the first is 1
    spring: Int2  # (entries, 5): equation and velocity; numbers of the Jacobian by increment, rate, velocity
    put: Int2  # (entries, 2): place in the matrix, number of the Jacobian: times 1, h-scale, its inverse
    part: Int1  # (2,): ends of the first two groups of these
    real_A: Float1  # the real matrix and its factors
    real_L: Float1
    real_U: Float1
    real_D: Float1
    real_Y: Float1
    pair_A: Complex1  # the complex one
    pair_L: Complex1
    pair_U: Complex1
    pair_D: Complex1
    pair_Y: Complex1
    P: LUPattern
    whole_put: Int2  # (entries, 4): place in the matrix of all stages, row of J, number, what it is multiplied by
    whole_x: Float2  # (3, 3 n)
    whole_A: Float1
    whole_L: Float1
    whole_U: Float1
    whole_D: Float1
    whole_Y: Float1
    whole_P: LUPattern


class AlphaStepWorkspace(NamedTuple):
    """Scratch and tables of one run; of the generalised-alpha method; what has the same name in `RadauStepWorkspace` is the same."""

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
    put: Int2
    part: Int1
    real_A: Float1
    real_L: Float1
    real_U: Float1
    real_D: Float1
    real_Y: Float1
    P: LUPattern
    past: Float2  # (4, nv + nx): accelerations that the method remembers, and rates of x
    ends: Float2  # (2, nv): accelerations at the ends of the step
    turns: Int1  # first angular velocity of each quaternion


class VariationalStepWorkspace(NamedTuple):
    """Scratch of one run of the variational method; what has the same name in `RadauStepWorkspace` is the same."""

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
    p: Float2  # (4, nv): momenta of the free way, on arrival, at the begin of the step and at its end
    f: Float2  # (3, nv): forces at its begin, at its end, and as they were thought to be there
    g: Float1  # (nr,): violations
    rows: Float2  # (2, nG): G at the begin and at the end
    steps: Float2  # (KEPT, nr): of the iteration for positions
    pushes: Float2  # (KEPT, nv): and of that for forces
