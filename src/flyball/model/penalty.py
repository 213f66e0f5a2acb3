"""Contact that gives way: the laws of its normal force, and the numbers that each of them takes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any

from pydantic import BeforeValidator

from ..errors import ModelError
from .element import Element, Number, Unit, nonnegative, positive
from .units import split_quantity, to_si

HARD, LINEAR, HERTZ, HUNT_CROSSLEY = "hard", "linear", "hertz", "hunt-crossley"
NUMBERS = {  # that a law takes
    HARD: (),
    LINEAR: ("stiffness", "damping"),
    HERTZ: ("stiffness",),
    HUNT_CROSSLEY: ("stiffness", "exponent", "dissipation"),
}
ALL = ("stiffness", "exponent", "dissipation", "damping")
EXPONENT = 1.5  # of Hertz' law


def _law(value: Any) -> Any:
    if not isinstance(value, str) or value not in NUMBERS:
        raise ValueError(f"give one of {', '.join(NUMBERS)}")
    return value


NormalLaw = Annotated[str, BeforeValidator(_law)]
NormalStiffness = Annotated[Number, Unit(None)]
Dissipation = Annotated[Number, Unit("s/m")]
Pressure = Annotated[Number, Unit("Pa")]


def check_law(e: Element, n: SimpleNamespace) -> None:
    """Refuse laws of the normal force without their numbers, and numbers without their law.

    Raises
    ------
    ModelError
        If a number is missing, belongs to another law, is out of its range or has another unit.
    """
    for name in ALL:
        if getattr(n, name) is not None and (n.law is None or name not in NUMBERS[n.law]):
            laws = [law for law, names in NUMBERS.items() if name in names]
            raise ModelError(
                f"{e.title}: {name} has no effect with law={n.law or HARD!r}; it is a number of {', '.join(laws)}"
            )
    if n.law in (None, HARD):
        return
    positive(e, n, "stiffness", "exponent")
    nonnegative(e, n, "damping", "dissipation")
    if n.exponent is not None and not 1.0 <= n.exponent.real <= 4.0:
        raise ModelError(f"{e.title}: exponent is {n.exponent:g}; it must be from 1 (linear) to 4; 1.5 is Hertz'")
    if n.law == LINEAR and n.stiffness is None:
        raise ModelError(f"{e.title}: law='linear' needs stiffness=..., a number in N/m")
    if getattr(n, "restitution", None) is not None:
        how = {LINEAR: "damping=", HUNT_CROSSLEY: "dissipation="}.get(n.law)
        remedy = f"say what is lost by {how}" if how else "take law='hunt-crossley', which loses some"
        raise ModelError(f"{e.title}: restitution is of hard contact; with law={n.law!r} {remedy}")
    _check_unit(e, unit_of_stiffness(n))


def unit_of_stiffness(n: SimpleNamespace) -> str:
    """N over the metre to the law's power."""
    power = 1.0 if n.law == LINEAR else EXPONENT if n.exponent is None else float(n.exponent.real)
    return "N/m" if power == 1.0 else f"N/m^{power:g}"


def _check_unit(e: Element, unit: str) -> None:
    """The unit of stiffness follows from the exponent."""
    given = e.stiffness  # type: ignore[attr-defined]
    if isinstance(given, str):
        parts = split_quantity(given)
        if parts is not None and parts[1]:
            try:
                to_si(given, unit)
            except ModelError as error:
                raise type(error)(f"{e.title}: stiffness: {error}") from None


def check_elasticity(e: Element, n: SimpleNamespace) -> None:
    """Refuse elastic constants that no isotropic solid has, and one without the other.

    Raises
    ------
    ModelError
        If Young's modulus is not positive or Poisson's ratio not above -1 and at most 1/2.
    """
    positive(e, n, "youngs_modulus")
    if (n.youngs_modulus is None) != (n.poissons_ratio is None):
        names = ("youngs_modulus", "poissons_ratio")
        given, other = names if n.poissons_ratio is None else names[::-1]
        raise ModelError(f"{e.title}: {given} needs {other} as well: how a surface gives way follows from both")
    if n.poissons_ratio is not None and not -1.0 < n.poissons_ratio.real <= 0.5:
        raise ModelError(
            f"{e.title}: poissons_ratio is {n.poissons_ratio:g}; it must be above -1 and at most 0.5, as 0.3 of steel"
        )
