"""The only file that lists kinds: constraint terms and forces. Adding a force adds one line here."""

from __future__ import annotations

from .. import forces as F
from .._jit import formula
from ..constraints import alignment, along, angle, coincident, distance, perpendicular
from .loads import each_force
from .rows import begin, each_term, end


@formula
def rows(S, W, t):
    """Values, Jacobian, rates and acceleration terms of all constraint rows."""
    begin(S, W, t)
    each_term(S, W, coincident.KIND, coincident.row)
    each_term(S, W, along.KIND, along.row)
    each_term(S, W, perpendicular.KIND, perpendicular.row)
    each_term(S, W, distance.KIND, distance.row)
    each_term(S, W, angle.KIND, angle.row)
    each_term(S, W, alignment.KIND_AXIS, alignment.axis_row)
    each_term(S, W, alignment.KIND_FULL, alignment.full_row)
    end(S, W)


@formula
def forces(S, W, t, z, work):
    """Wrenches of all force elements on their bodies; the power of accounted elements in ``work``."""
    each_force(S, W, t, z, work, F.spring_damper.KIND, F.spring_damper.inputs, F.spring_damper.wrench)
    each_force(S, W, t, z, work, F.torsional_spring.KIND, F.torsional_spring.inputs, F.torsional_spring.wrench)
    each_force(S, W, t, z, work, F.point_force.KIND, F.point_force.inputs, F.point_force.wrench)
    each_force(S, W, t, z, work, F.point_torque.KIND, F.point_torque.inputs, F.point_torque.wrench)
    each_force(S, W, t, z, work, F.motor.KIND, F.motor.inputs, F.motor.wrench)
