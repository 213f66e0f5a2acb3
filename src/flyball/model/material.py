"""What surfaces are made of, for contact: friction, restitution, resistance to rolling, a surface that moves."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator

from ..errors import ModelError
from .element import (
    Damping,
    Direction,
    Element,
    Length,
    Name,
    Ratio,
    Unit,
    Velocity,
    element,
    nonnegative,
    plain,
)
from .penalty import Dissipation, NormalLaw, NormalStiffness, Pressure, check_elasticity, check_law

Friction = Annotated[float | str | tuple[float | str, ...], BeforeValidator(plain), Unit("1")]
NUMBERS = ("friction", "static_friction", "restitution", "rolling_friction", "spinning_friction")


def check_restitution(e: Element, n: SimpleNamespace) -> None:
    """Refuse a restitution that is not from 0 to 1."""
    nonnegative(e, n, "restitution")
    if n.restitution is not None and not n.restitution.real <= 1.0:
        raise ModelError(
            f"{e.title}: restitution is {n.restitution:g}; it must be from 0 to 1, since no impact makes energy"
        )


def check_surface(e: Element, n: SimpleNamespace) -> None:
    """Refuse numbers that no surface has.

    Raises
    ------
    ModelError
        If friction or a length is negative, restitution not from 0 to 1, or static friction below that of sliding.
    """
    nonnegative(e, n, "static_friction", "rolling_friction", "spinning_friction")
    check_restitution(e, n)
    for x in pair(n.friction):
        if x is not None and not x.real >= 0.0:
            raise ModelError(f"{e.title}: friction is {x:g}; it must be zero or greater")
    if n.static_friction is not None:
        if n.friction is None:
            raise ModelError(f"{e.title}: static_friction needs friction, that of sliding, which is not greater")
        sliding = pair(n.friction)[0]
        if n.static_friction.real < sliding.real:
            raise ModelError(
                f"{e.title}: static_friction is {n.static_friction:g}, below friction (that of sliding), {sliding:g}; "
                f"what slides would stop and what rests would slide"
            )


def pair(x: Any) -> tuple[Any, Any]:
    """Along the grain and across it."""
    return (x[0], x[1]) if isinstance(x, tuple) else (x, x)


@element
class Material(Element):
    """A surface, as bodies and shapes name it: ``Body(..., material="rubber")``.

    What touches has a material on either side. Of friction and restitution the geometric mean of both holds, so that
    what is slippery or dead on one side is on both (as in Box2D and Jolt); of the lengths of rolling and spinning
    friction the greater, since the softer gives way (as in MuJoCo); surface velocities add up. What a material leaves
    out is that of the `Contact`, or else that of the other side. Where a pair is known by measurement, a
    `MaterialPair` says it.

    Parameters
    ----------
    name : str
    friction : number, or two numbers [1]
        Coefficient of sliding friction. Two: along the grain (greater than 0) and across it.
    static_friction : number [1]
        Of what sticks, not less; the same as ``friction`` if not given. With a grain: along it; across it greater or
        smaller as ``friction`` is.
    restitution : number [1]
        From 0 (dead) to 1 (elastic); 0 if nothing says it.
    rolling_friction : number [m]
        Lever arm of the resistance to rolling: the greatest torque over the normal force.
    spinning_friction : number [m]
        The same about the normal: about two thirds of friction times the radius of the spot that touches.
    grain : direction
        Of the first of two numbers of friction, in the reference frame of the body; where it stands square on the
        surface, the second number holds all around.
    surface_velocity : vector [m/s]
        Of the surface relative to the body, in the body's reference frame: of a conveyor belt. Only its part along
        the surface counts.
    youngs_modulus : number [Pa]
        Of the solid, for a `Contact` whose ``law`` is that of Hertz or of Hunt and Crossley and says no stiffness.
    poissons_ratio : number [1]
        The same; both or none.
    """

    friction: Friction | None = None
    static_friction: Ratio | None = None
    restitution: Ratio | None = None
    rolling_friction: Length | None = None
    spinning_friction: Length | None = None
    grain: Direction | None = None
    surface_velocity: Velocity | None = None
    youngs_modulus: Pressure | None = None
    poissons_ratio: Ratio | None = None

    category: ClassVar[str] = "materials"

    def check(self, n: SimpleNamespace) -> None:
        """Numbers that a surface can have; a grain where, and only where, two numbers of friction ask for it."""
        two = isinstance(n.friction, tuple)
        if two and (len(n.friction) != 2 or any(isinstance(x, tuple) for x in n.friction)):
            raise ModelError(
                f"{self.title}: friction must be one number, or two, along the grain and across it; got {n.friction}"
            )
        check_surface(self, n)
        check_elasticity(self, n)
        if two and not n.friction[0].real > 0.0:
            raise ModelError(
                f"{self.title}: friction along the grain is 0; it must be greater than 0. What is smooth one way only "
                f"has its grain the other way: swap the numbers and turn the grain"
            )
        if two != (n.grain is not None):
            raise ModelError(
                f"{self.title}: friction has two numbers; say the direction of the first: grain=(1, 0, 0)"
                if two
                else f"{self.title}: grain has no effect, since friction is one number; leave it out"
            )
        if two and not any(abs(x) > 0.0 for x in n.grain):
            raise ModelError(f"{self.title}: grain has no length; a direction must not be zero")


@element
class MaterialPair(Element):
    """What two materials are to each other, in place of what follows from each of them.

    Parameters
    ----------
    first, second : str
        Names of the materials; both may be the same.
    friction, static_friction, restitution : number [1]
        As for `Material`; what is not given follows from the materials.
    rolling_friction, spinning_friction : number [m]
    law, stiffness, exponent, dissipation, damping
        How they give way to each other, as for `Contact`; restitution is of what is hard.
    name : str
        Made of those of the materials if not given.
    """

    name: str = field(default="", kw_only=True)
    first: Name = field(kw_only=False)
    second: Name = field(kw_only=False)
    friction: Ratio | None = None
    static_friction: Ratio | None = None
    restitution: Ratio | None = None
    rolling_friction: Length | None = None
    spinning_friction: Length | None = None
    law: NormalLaw | None = None
    stiffness: NormalStiffness | None = None
    exponent: Ratio | None = None
    dissipation: Dissipation | None = None
    damping: Damping | None = None

    category: ClassVar[str] = "material_pairs"

    def __post_init__(self) -> None:
        """A name."""
        if not self.name:
            object.__setattr__(self, "name", f"{self.first} on {self.second}")

    def check(self, n: SimpleNamespace) -> None:
        """Numbers that surfaces can have, one at least."""
        check_surface(self, n)
        check_law(self, n)
        if all(getattr(n, k) is None for k in (*NUMBERS, "law")):
            raise ModelError(f"{self.title}: it says nothing; give friction=, restitution= or another of {NUMBERS}")
