"""Rotation residuals for assembly: the component, along one axis of F, of the rotation that aligns M with F.

They replace ``perpendicular`` rows when a joint is far from closed: their size is the true angle, so they converge from
everywhere to the parallel (never the antiparallel) position. Their torque is the gradient to first order, which is
sufficient for a Newton iteration; they are not used in motions.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import atan2, sqrt
from ..math.vec import col, cross, dot, mm, mtv, mv, neg, scale, transpose

KIND_AXIS = 5
KIND_FULL = 6


@formula
def axis_row(par, F, M, hint, data):
    """Angle between the z axes of F and M, as a rotation vector, along the axis (par[0:3]) of F."""
    f = col(F[1], 2)
    m = col(M[1], 2)
    e = mtv(F[1], cross(f, m))
    c = dot(f, m)
    s = sqrt(dot(e, e))
    o = 0.0 * par[0]
    n = (par[0], par[1], par[2])
    if s.real < 1e-9:
        # parallel: zero; antiparallel: half a turn about F's x axis, or y, whichever the row measures
        value = o if c.real > 0.0 else o + 3.141592653589793 * par[0]
    else:
        value = atan2(s, c) / s * dot(n, e)
    return finish(value, n, F, o)


@formula
def full_row(par, F, M, hint, data):
    """Rotation vector from F's axes to M's, along the axis (par[0:3]) of F, through the quaternion."""
    R = mm(transpose(F[1]), M[1])
    o = 0.0 * par[0]
    n = (par[0], par[1], par[2])
    trace = R[0] + R[4] + R[8]
    e = (0.5 * (R[7] - R[5]), 0.5 * (R[2] - R[6]), 0.5 * (R[3] - R[1]))  # sin(angle) times the axis
    s = sqrt(dot(e, e))
    c = 0.5 * (trace - 1.0)
    if s.real < 1e-9:
        value = o if c.real > 0.0 else 3.141592653589793 * dot(n, half_turn(R))
    else:
        value = atan2(s, c) / s * dot(n, e)
    return finish(value, n, F, o)


@formula
def half_turn(R):
    """Return the axis of a rotation by half a turn, R = 2 e e^T - 1, from its largest column."""
    if R[0].real >= R[4].real and R[0].real >= R[8].real:
        e = (R[0] + 1.0, R[3], R[6])
    elif R[4].real >= R[8].real:
        e = (R[1], R[4] + 1.0, R[7])
    else:
        e = (R[2], R[5], R[8] + 1.0)
    return scale(1.0 / sqrt(dot(e, e)), e)


@formula
def finish(value, n, F, o):
    """Return the row's result: a torque along F's axis n, no acceleration term."""
    t = mv(F[1], n)
    return value, (o, o, o), t, neg(t), o


ROWS = {KIND_AXIS: axis_row, KIND_FULL: full_row}
