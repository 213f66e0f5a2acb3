"""Brush tyre of Fiala with combined slip and friction.

With the normalised slip s = (Ck kappa, -Ca tan(alpha) - Cg gamma) / ((1 + kappa) mu Fz) and r = |s|, the force is mu Fz
s (1 - r/3 + r^2/27), or mu Fz s / r where all of the patch slides, r >= 3 (Fiala 1954; combined slip: Pacejka, *Tire
and Vehicle Dynamics*, 2012, section 3.2.3, Hindiyeh and Gerdes 2014). A wheel that runs backwards has 1 - kappa. The
pneumatic trail falls from its value at zero slip by t / t0 = (1 - r/3)^3 / (1 - r/3 + r^2/27) (ibid., equation 3.13).
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

from ...compiler.formulas import formula
from ...math.scalar import choose, maximum, sqrt
from ...model.element import Number, Unit, element, positive
from .tyre_model import (
    ACROSS,
    ALONG,
    CAMBER,
    CORNERING,
    OWN,
    SLIP,
    TRAIL,
    ScaledTyre,
    rolling_direction,
    rolling_moment,
)

KIND = 1
FRICTION = OWN
SLIDING = 3.0  # normalised slip from which on all of the patch slides
LOCKED = 0.02  # least 1 + kappa, of a locked wheel
SMALL = 1e-9  # normalised slip that counts as none


@formula
def relaxation(data, at, friction, load, camber):
    """Return the given relaxation lengths, and the slips at which all of the patch slides."""
    strength = SLIDING * friction * data[at + FRICTION]
    o = 0.0 * load
    return (
        data[at + ALONG] + o,
        data[at + ACROSS] + o,
        strength / data[at + SLIP] + o,
        strength / data[at + CORNERING] + o,
    )


@formula
def slip_forces(data, at, friction, slip, tangent, camber, load, motion):
    """Return forces and moments; see the module's docstring."""
    mu = friction * data[at + FRICTION]
    o = 0.0 * (slip + tangent)
    rolled = mu * maximum(slip * rolling_direction(motion) + 1.0, o + LOCKED)
    x = data[at + SLIP] * slip / rolled
    y = -(data[at + CORNERING] * tangent + data[at + CAMBER] * camber) / rolled
    r = sqrt(x * x + y * y + SMALL * SMALL)
    partly = 1.0 - r / 3.0 + r * r / 27.0
    share = mu * load * choose(SLIDING - r, partly, 1.0 / r)
    adhering = choose(SLIDING - r, 1.0 - r / 3.0, o)
    trail = data[at + TRAIL] * motion[0] * adhering * adhering * adhering / partly
    fy = share * y
    return share * x, fy, o, rolling_moment(data, at, load, motion), -trail * fy


@element
class FialaTyre(ScaledTyre):
    """A brush tyre with parabolic pressure: few numbers, friction limit, combined slip.

    Parameters
    ----------
    name : str
        Optional.
    radius : number [m]
        Of the free tyre.
    stiffness, damping : number [N/m], [N s/m]
        In the radial direction.
    nominal_load : number [N]
        Load to which the following stiffnesses belong; they are proportional to the load.
    slip_stiffness : number [N]
        Slope of the longitudinal force by the longitudinal slip.
    cornering_stiffness : number [N/rad]
        Slope of the lateral force by the slip angle; positive.
    camber_stiffness : number [N/rad]
        Slope of the lateral force by the camber angle; positive.
    friction : number [1]
        Coefficient of friction, times that of the road.
    relaxation_length, lateral_relaxation_length : number [m]
        Way over which slips develop; the lateral one equals the other if not given.
    trail : number [m]
        Pneumatic trail at small slips: a sixth of the length of the contact patch.
    rolling_resistance : number [1]
        Ratio of the resistance to the load.
    """

    friction: Annotated[Number, Unit("1")] = 1.0

    kind: ClassVar[int] = KIND
    relaxation: ClassVar = staticmethod(relaxation)
    slip_forces: ClassVar = staticmethod(slip_forces)

    def check(self, n: SimpleNamespace) -> None:
        """Require friction besides the other constants."""
        super().check(n)
        positive(self, n, "friction")

    def numbers(self, n: SimpleNamespace) -> tuple[Any, ...]:
        """Return the numbers of its formulas."""
        return (*super().numbers(n), n.friction)
