"""Linear tyre: forces proportional to slips and load, without a limit of friction."""

from __future__ import annotations

from typing import ClassVar

from ...compiler.formulas import formula
from ...math.scalar import atan
from ...model.element import element
from .tyre_model import ACROSS, ALONG, CAMBER, CORNERING, SLIP, TRAIL, ScaledTyre, rolling_moment

KIND = 0
UNLIMITED = 100.0  # slip up to which the deflections may grow at standstill


@formula
def relaxation(data, at, friction, load, camber):
    """Return the given relaxation lengths, and no limit of slips."""
    none = 0.0 * load + UNLIMITED
    return data[at + ALONG] + 0.0 * load, data[at + ACROSS] + 0.0 * load, none, none


@formula
def slip_forces(data, at, friction, slip, tangent, camber, load, motion):
    """Return Fx = Ck k, Fy = -Ca alpha - Cg gamma and Mz = -t Fy, with stiffnesses proportional to the load."""
    fx = data[at + SLIP] * load * slip
    fy = -data[at + CORNERING] * load * atan(tangent) - data[at + CAMBER] * load * camber
    o = 0.0 * fy
    return fx, fy, o, rolling_moment(data, at, load, motion), -data[at + TRAIL] * motion[0] * fy


@element
class LinearTyre(ScaledTyre):
    """A linear tyre, for small slips: stiffnesses at a nominal load, proportional to the load.

    The load is stiffness times deflection plus damping, never negative; the forces are Fx = C_k kappa, Fy = -C_a alpha
    - C_g sin(gamma), Mz = -trail Fy, each times load / nominal_load.

    Parameters
    ----------
    name : str
        Optional.
    radius : number [m]
        Of the free tyre.
    stiffness, damping : number [N/m], [N s/m]
        In the radial direction.
    nominal_load : number [N]
        Load to which the following stiffnesses belong.
    slip_stiffness : number [N]
        Slope of the longitudinal force by the longitudinal slip.
    cornering_stiffness : number [N/rad]
        Slope of the lateral force by the slip angle; positive.
    camber_stiffness : number [N/rad]
        Slope of the lateral force by the camber angle; positive.
    relaxation_length, lateral_relaxation_length : number [m]
        Way over which slips develop; the lateral one equals the other if not given.
    trail : number [m]
        Pneumatic trail.
    rolling_resistance : number [1]
        Ratio of the resistance to the load.
    """

    kind: ClassVar[int] = KIND
    relaxation: ClassVar = staticmethod(relaxation)
    slip_forces: ClassVar = staticmethod(slip_forces)
