"""Base class of tyre models, and the formulas for their load and rolling radius.

A model has three formulas. ``data[at]`` begins its numbers (`TyreModel.numbers`), `RADIUS`, `STIFFNESS` and `DAMPING`
first; forces, moments and angles are those of the W axes of ISO 8855 and TYDEX (`forces.tyre`).

- ``load(data, at, deflection, rate, spin, camber)``: load [N], positive, and effective rolling radius [m];
- ``relaxation(data, at, friction, load, camber)``: relaxation lengths along and across [m], and the slips beyond which
  the forces do not grow any more;
- ``slip_forces(data, at, friction, slip, tangent, camber, load, motion)``: Fx, Fy, Mx, My, Mz of the longitudinal slip,
  the tangent of the slip angle, and the sine of the camber angle. ``motion`` is (cosine of the slip angle, negative
  where the wheel runs backwards; longitudinal speed; spin).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

from ...compiler.formulas import formula
from ...math.scalar import choose, cubic_rise, maximum, minimum, sqrt
from ...model.element import Damping, Element, Length, Number, Stiffness, Unit, nonnegative, positive

RADIUS, STIFFNESS, DAMPING = range(3)
ONSET = 0.02  # of the radius: deflection up to which the damping grows to its value, so that no force jumps at contact
LEAST_RELAXATION = 0.1  # of the radius
SINKING = 1.0 / 3.0  # part of the deflection by which the effective rolling radius is smaller than the free one
Force = Annotated[Number, Unit("N")]


@formula
def damped_load(data, at, elastic, deflection, rate):
    """Return the load of an elastic force and of the damper; zero in the air, and never negative."""
    onset = ONSET * data[at + RADIUS]
    share = cubic_rise(minimum(maximum(deflection, 0.0 * deflection) / onset, 0.0 * deflection + 1.0))
    load = elastic + share * data[at + DAMPING] * rate
    o = 0.0 * load
    return choose(deflection, maximum(load, o), o)


@formula
def linear_load(data, at, deflection, rate, spin, camber):
    """Return the load k d + c d' and the rolling radius R0 - d/3, as for a thin ring (Pacejka 2012, section 1.2)."""
    load = damped_load(data, at, data[at + STIFFNESS] * deflection, deflection, rate)
    pressed = choose(deflection, deflection, 0.0 * deflection)
    return load, data[at + RADIUS] - SINKING * pressed


@dataclass(frozen=True)
class TyreModel(Element):
    """What a tyre does with its load and slips.

    Parameters
    ----------
    name : str
        Optional.
    """

    name: str = ""
    _: KW_ONLY

    category: ClassVar[str] = "tyre models"
    kind: ClassVar[int]
    load: ClassVar[Callable]
    relaxation: ClassVar[Callable]
    slip_forces: ClassVar[Callable]

    @property
    def title(self) -> str:
        """Kind, and name if it has one, for messages."""
        return f"{type(self).__name__} {self.name!r}" if self.name else type(self).__name__

    def numbers(self, n: SimpleNamespace) -> tuple[Any, ...]:
        """Return the numbers of its formulas: free radius, vertical stiffness, damping, then its own."""
        raise NotImplementedError

    def limits(self, n: SimpleNamespace) -> dict[str, tuple[float, float]]:
        """Return the ranges in which it is valid, by output of the tyre."""
        return {}


@dataclass(frozen=True)
class ScaledTyre(TyreModel):
    """A model whose stiffnesses are given at a nominal load, and proportional to the load."""

    _: KW_ONLY
    radius: Length
    stiffness: Stiffness
    nominal_load: Force
    damping: Damping = 0.0
    relaxation_length: Length = 0.3
    lateral_relaxation_length: Length | None = None
    slip_stiffness: Force
    cornering_stiffness: Force
    camber_stiffness: Force = 0.0
    trail: Length = 0.0
    rolling_resistance: Annotated[Number, Unit("1")] = 0.0

    load: ClassVar = staticmethod(linear_load)

    def check(self, n: SimpleNamespace) -> None:
        """Require constants of the right sign."""
        positive(self, n, "radius", "stiffness", "nominal_load", "relaxation_length", "lateral_relaxation_length")
        positive(self, n, "slip_stiffness", "cornering_stiffness")
        nonnegative(self, n, "damping", "camber_stiffness", "trail", "rolling_resistance")

    def numbers(self, n: SimpleNamespace) -> tuple[Any, ...]:
        """Return the numbers of its formulas; see `scaled`."""
        across = n.relaxation_length if n.lateral_relaxation_length is None else n.lateral_relaxation_length
        stiffness = (n.slip_stiffness, n.cornering_stiffness, n.camber_stiffness)
        scaled = (x / n.nominal_load for x in stiffness)
        return (n.radius, n.stiffness, n.damping, n.relaxation_length, across, *scaled, n.trail, n.rolling_resistance)


ALONG, ACROSS, SLIP, CORNERING, CAMBER, TRAIL, ROLLING, OWN = range(3, 11)
"""Places of the numbers of a `ScaledTyre`, and of the first one of its own."""
REST = 0.1  # m/s: speed below which the rolling resistance falls to zero


@formula
def rolling_direction(motion):
    """Return the direction of travel: 1 forwards, -1 backwards, and smooth in between, near standstill."""
    return smooth_sign(motion[1])


@formula
def spin_direction(radius, motion):
    """Return the sense in which the wheel turns, of which rolling resistance is the reverse: it heats a tyre that
    turns, not one that slides locked.
    """
    return smooth_sign(radius * motion[2])


@formula
def smooth_sign(speed):
    """Return the sign of a speed, smooth below `REST`."""
    return speed / sqrt(speed * speed + REST * REST)


@formula
def rolling_moment(data, at, load, motion):
    """Return the moment about the lateral axis: minus the coefficient times load and radius, against its turning."""
    radius = data[at + RADIUS]
    return -data[at + ROLLING] * load * radius * spin_direction(radius, motion)
