"""The only file that lists kinds: constraint terms and forces. Adding a force adds one line here."""

from __future__ import annotations

from .. import forces as F
from .._jit import formula
from ..constraints import alignment, along, angle, coincident, distance, perpendicular
from .loads import each_force
from .rows import begin, each_bias, each_value, end
from .tables import GAMMA, NU_DOT


@formula
def each_kind(S, W, visit):
    """Visit the terms of every kind that motions are made of, with its formula."""
    visit(S, W, coincident.KIND, coincident.row)
    visit(S, W, along.KIND, along.row)
    visit(S, W, perpendicular.KIND, perpendicular.row)
    visit(S, W, distance.KIND, distance.row)
    visit(S, W, angle.KIND, angle.row)


@formula
def row_values(S, W, t):
    """Values, Jacobian and rates of all constraint rows, from the poses."""
    begin(S, W, t)
    each_kind(S, W, each_value)
    # for assembly only: these have no acceleration term
    each_value(S, W, alignment.KIND_AXIS, alignment.axis_row)
    each_value(S, W, alignment.KIND_FULL, alignment.full_row)
    end(S, W)


@formula
def row_biases(S, W):
    """Gamma of all constraint rows, from poses and velocities."""
    for k in range(S.row_i.shape[0]):
        W.row[GAMMA, k] = W.row[NU_DOT, k]
    each_kind(S, W, each_bias)


@formula
def forces(S, W, t, z, work):
    """Wrenches of all force elements on their bodies; the power of accounted elements in ``work``."""
    each_force(S, W, t, z, work, F.spring_damper.KIND, F.spring_damper.inputs, F.spring_damper.wrench)
    each_force(S, W, t, z, work, F.torsional_spring.KIND, F.torsional_spring.inputs, F.torsional_spring.wrench)
    each_force(S, W, t, z, work, F.point_force.KIND, F.point_force.inputs, F.point_force.wrench)
    each_force(S, W, t, z, work, F.point_torque.KIND, F.point_torque.inputs, F.point_torque.wrench)
    each_force(S, W, t, z, work, F.motor.KIND, F.motor.inputs, F.motor.wrench)
