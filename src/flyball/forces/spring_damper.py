"""Spring, damper and actuator between two points."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Annotated, ClassVar

from ..compiler.formulas import formula
from ..math.scalar import absolute, choose, divide, unless_zero
from ..math.vec import add, dot, neg, norm, scale, sub
from ..model.element import Damping, Law, LawOf, Length, Stiffness, element, nonnegative
from ..model.force import TwoPointForce
from .coordinate_spring import refuse_without_stiffness

KIND = 0


@formula
def inputs(par, F, M):
    """Return the length and its rate; if both points coincide, the rate at which the length begins to grow."""
    d, u = sub(M[0], F[0]), sub(M[3], F[3])
    length = norm(d)
    return length, unless_zero(length, divide(dot(d, u), length), norm(u))


@formula
def wrench(par, F, M, laws, values):
    """Force on M: -k d - (c rate + s) e with e = d / |d|, and s = F - k times free length.

    If both points coincide, e is the direction in which they move apart; without a relative velocity it is undefined,
    and the force nan if s is not zero.
    """
    length, rate = values
    d, u = sub(M[0], F[0]), sub(M[3], F[3])
    o = 0.0 * par[0]
    s = laws[0] - par[0] * par[2]
    e = scale(divide(1.0, length), d)
    t = par[1] * rate + s
    speed = norm(u)
    way = scale(divide(1.0, unless_zero(speed, speed, o + 1.0)), u)
    undefined = choose(absolute(s), o + math.nan, o)
    x = unless_zero(length, t * e[0], par[1] * u[0] + unless_zero(speed, s * way[0], undefined))
    y = unless_zero(length, t * e[1], par[1] * u[1] + unless_zero(speed, s * way[1], undefined))
    z = unless_zero(length, t * e[2], par[1] * u[2] + unless_zero(speed, s * way[2], undefined))
    return neg(add(scale(par[0], d), (x, y, z))), (o, o, o)


@formula
def energy(par, F, M):
    """Potential energy k (length - free length)^2 / 2 [J]."""
    x = inputs(par, F, M)[0] - par[2]
    return 0.5 * par[0] * x * x


@element
class SpringDamper(TwoPointForce):
    """Spring, damper and actuator between a point of one body and a point of another.

    The tension k (l - l0) + c ldot + F pulls the two points together where it is positive. Both points may
    coincide where they move apart, and where the tension is zero there (``length=0``, no F): there the damper acts
    against the relative velocity.

    Parameters
    ----------
    name : str
    body_i, body_j : str
        Bodies or frames with the two points; ``"ground"`` is the world.
    at : pair of points [m]
        The two points, in world coordinates of the drawn configuration. Not given: the origins of the frames.
    stiffness : number [N/m]
    damping : number [N s/m]
    length : number [m]
        Unloaded length of the spring; the length in the reference configuration if not given.
    force : law [N]
        Added tension, an expression of ``t``, ``length``, ``rate`` and parameters.
    """

    stiffness: Stiffness = 0.0
    damping: Damping = 0.0
    length: Length | None = None
    force: Annotated[Law | None, LawOf("N", ("length", "rate"))] = None

    kind: ClassVar[int] = KIND
    inputs: ClassVar = staticmethod(inputs)
    wrench: ClassVar = staticmethod(wrench)
    energy: ClassVar = staticmethod(energy)
    outputs: ClassVar[dict[str, str]] = {"length": "m", "rate": "m/s", "force": "N"}
    symbol: ClassVar[str] = "spring"
    fails: ClassVar[str] = (
        "Its two points coincide at rest, where a force along the line between them has no direction; give length=0, "
        "or an initial velocity or a position that moves them apart"
    )

    def check(self, n: SimpleNamespace) -> None:
        """Stiffness, damping and free length must not be negative."""
        nonnegative(self, n, "stiffness", "damping", "length")
        refuse_without_stiffness(self, "length", None)

    def parameters(self, n: SimpleNamespace, separation: float) -> tuple[float, ...]:
        """Return the parameters of the formulas."""
        return (n.stiffness, n.damping, separation if n.length is None else n.length)

    def laws(self) -> tuple[Law | None, ...]:
        """Return the laws of the formulas."""
        return (self.force,)

    def conservative(self) -> bool:
        """Return whether it has no damping and no law, so that it only exchanges stored energy."""
        return self.force is None and self.damping == 0.0
