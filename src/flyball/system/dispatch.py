"""The only file that lists kinds: constraint terms and forces. Adding one adds one line here."""

from __future__ import annotations

from .. import forces as F
from .._jit import formula
from ..constraints import (
    alignment,
    along,
    angle,
    blade,
    coincident,
    curve,
    distance,
    perpendicular,
    rolling,
    skew,
    spin,
)
from .loads import each_effort, each_force
from .rows import begin, begin_biases, each_bias, each_value, end, end_biases


@formula
def each_kind(S, W, z, visit):
    """Visit the terms of every kind that motions are made of, with its formula."""
    visit(S, W, z, coincident.KIND, coincident.row)
    visit(S, W, z, along.KIND, along.row)
    visit(S, W, z, perpendicular.KIND, perpendicular.row)
    visit(S, W, z, distance.KIND, distance.row)
    visit(S, W, z, angle.KIND, angle.row)
    visit(S, W, z, skew.KIND, skew.row)
    visit(S, W, z, curve.KIND, curve.row)
    visit(S, W, z, rolling.KIND, rolling.row)
    visit(S, W, z, blade.KIND, blade.row)
    visit(S, W, z, spin.KIND, spin.row)


@formula
def row_values(S, W, t, z):
    """Values, Jacobian and rates of all constraint rows, from the poses; ``z`` are the states that angles lean on."""
    begin(W)
    each_kind(S, W, z, each_value)
    # for assembly only: these have no acceleration term
    each_value(S, W, z, alignment.KIND_AXIS, alignment.axis_row)
    each_value(S, W, z, alignment.KIND_FULL, alignment.full_row)
    end(S, W, t)


@formula
def row_biases(S, W, t, v, z):
    """Gamma of all constraint rows and rates of what is measured, from poses and velocities."""
    begin_biases(S, W, v)
    each_kind(S, W, z, each_bias)
    end_biases(S, W, t)


@formula
def forces(S, W, t, work):
    """Wrenches of all force elements on their bodies; the power of accounted elements in ``work``."""
    each_force(S, W, t, work, F.spring_damper.KIND, F.spring_damper.inputs, F.spring_damper.wrench)
    each_force(S, W, t, work, F.point_force.KIND, F.point_force.inputs, F.point_force.wrench)
    each_force(S, W, t, work, F.point_torque.KIND, F.point_torque.inputs, F.point_torque.wrench)
    each_force(S, W, t, work, F.bushing.KIND, F.bushing.inputs, F.bushing.wrench)


@formula
def efforts(S, W, t, work, f):
    """Forces along measured quantities, added to the generalised forces ``f``."""
    each_effort(S, W, t, work, f, F.coordinate_spring.KIND, F.coordinate_spring.effort)
    each_effort(S, W, t, work, f, F.rope.KIND, F.rope.effort)
    each_effort(S, W, t, work, f, F.joint_friction.KIND, F.joint_friction.effort)
