"""Transfer: a transfer function as a controller."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any

from ..errors import ModelError
from ..model.controller import Controller, ControlState, numbered_names
from ..model.element import Law, Numbers, Unit, element


@element
class Transfer(Controller):
    """A proper transfer function y / u = num(s) / den(s), initially at rest; with a period num(z) / den(z).

    Parameters
    ----------
    name : str
    of : expression
        The signal u: an expression of ``t``, parameters, sensors, curves such as ``A.angle``, and controllers.
    num, den : lists of numbers
        Coefficients from the highest power of s, or of z: ``num=[1], den=[0.1, 1]`` is 1 / (0.1 s + 1).
    period, offset : number [s], optional
        It is sampled at offset, offset + period, ...

    Notes
    -----
    States are those of the controllable canonical form, the first of them the highest derivative.
    """

    of: Law
    num: Annotated[Numbers, Unit(None)]
    den: Annotated[Numbers, Unit(None)]

    def check(self, n: SimpleNamespace) -> None:
        """Refuse an improper transfer function."""
        super().check(n)
        if not n.den:
            raise ModelError(f"{self.title}: den has no coefficients; den=[1] makes num=[k] a gain")
        if n.den[0] == 0.0:
            raise ModelError(f"{self.title}: the first coefficient of den is zero; leave leading zeros out")
        if not self.num:
            raise ModelError(f"{self.title}: num has no coefficients; num=[0] has no effect")
        if len(self.num) > len(self.den):
            raise ModelError(
                f"{self.title}: num is of order {len(self.num) - 1}, den of order {len(self.den) - 1}; a transfer "
                "function that differentiates has no state-space form: add a filter, a factor (1 + T s) in den"
            )

    @property
    def _x(self) -> tuple[str, ...]:
        return numbered_names("x", len(self.den) - 1)

    def given(self) -> dict[str, Any]:
        """Return the input and the coefficients."""
        lists = {"num": (0.0,) * (len(self.den) - len(self.num)) + self.num, "den": self.den}
        return {"of": self.of} | {f"{k}_{i}": x for k, xs in lists.items() for i, x in enumerate(xs)}

    def called(self, given: str) -> str:
        """Return the name of a coefficient."""
        name, _, k = given.partition("_")
        return (
            f"coefficient {int(k) - (len(self.den) - len(self.num)) * (name == 'num') + 1} of {name}"
            if k
            else super().called(given)
        )

    def signals(self) -> dict[str, str]:
        """Return output and input."""
        terms = [f"num_{k}*{x}" for k, x in enumerate(("highest", *self._x)) if self.given()[f"num_{k}"] != 0.0]
        less = "".join(f" - den_{k + 1}*{x}" for k, x in enumerate(self._x))
        return {"output": " + ".join(terms) or "0", "input": "of", "highest": f"(of{less})/den_0"}

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Return the states of the canonical form."""
        return tuple(ControlState(x, before) for x, before in zip(self._x, ("highest", *self._x), strict=False))
