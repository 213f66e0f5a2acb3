"""The only file that lists kinds: constraint terms and forces. Adding one adds one case here."""

from __future__ import annotations

from .. import forces as element
from ..compiler.jit import formula
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
from ..tables.system import TERM_KINDS
from .rows import begin, begin_biases, each_bias, each_value, end, end_biases, rare_biases, rare_values

RARE = 5  # kinds below have loops of their own; from here on they share one: nearly as fast, much less to compile


@formula
def rare(kind, par, F, M, hint, data):
    """The formula of one of the other kinds."""
    if kind == alignment.KIND_AXIS:
        return alignment.axis_row(par, F, M, hint, data)
    if kind == alignment.KIND_FULL:
        return alignment.full_row(par, F, M, hint, data)
    if kind == skew.KIND:
        return skew.row(par, F, M, hint, data)
    if kind == curve.KIND:
        return curve.row(par, F, M, hint, data)
    if kind == rolling.KIND:
        return rolling.row(par, F, M, hint, data)
    if kind == blade.KIND:
        return blade.row(par, F, M, hint, data)
    return spin.row(par, F, M, hint, data)


@formula
def row_values(S, W, t, z):
    """Values, Jacobian and rates of all constraint rows, from the poses; ``z`` are the states that angles lean on."""
    begin(S, W)
    each_value(S, W, z, coincident.KIND, coincident.row)
    each_value(S, W, z, along.KIND, along.row)
    each_value(S, W, z, perpendicular.KIND, perpendicular.row)
    each_value(S, W, z, distance.KIND, distance.row)
    each_value(S, W, z, angle.KIND, angle.row)
    rare_values(S, W, z, RARE, TERM_KINDS, rare)
    end(S, W, t)


@formula
def row_biases(S, W, t, v, z):
    """Gamma of all constraint rows and rates of what is measured, from poses and velocities."""
    begin_biases(S, W, v)
    each_bias(S, W, z, coincident.KIND, coincident.row)
    each_bias(S, W, z, along.KIND, along.row)
    each_bias(S, W, z, perpendicular.KIND, perpendicular.row)
    each_bias(S, W, z, distance.KIND, distance.row)
    each_bias(S, W, z, angle.KIND, angle.row)
    rare_biases(S, W, z, RARE, TERM_KINDS, rare)
    end_biases(S, W, t)


@formula
def inputs(kind, par, F, M):
    """What the laws of a force between frames may depend on."""
    if kind == element.spring_damper.KIND:
        return element.spring_damper.inputs(par, F, M)
    return element.point_force.inputs(par, F, M)


@formula
def wrench(kind, par, F, M, laws, values):
    """Wrench of a force between frames on M."""
    if kind == element.spring_damper.KIND:
        return element.spring_damper.wrench(par, F, M, laws, values)
    if kind == element.point_force.KIND:
        return element.point_force.wrench(par, F, M, laws, values)
    if kind == element.point_torque.KIND:
        return element.point_torque.wrench(par, F, M, laws, values)
    return element.bushing.wrench(par, F, M, laws, values)


@formula
def effort(kind, par, x, rate, laws, load):
    """Force along a measured quantity."""
    if kind == element.coordinate_spring.KIND:
        return element.coordinate_spring.effort(par, x, rate, laws, load)
    if kind == element.rope.KIND:
        return element.rope.effort(par, x, rate, laws, load)
    return element.joint_friction.effort(par, x, rate, laws, load)
