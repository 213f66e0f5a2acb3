"""Constraint: an equation between coordinates and time, as the user writes it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any

from ..errors import ModelError
from ..model.element import LawOf, element
from ..model.expressions import Expression
from ..model.joint import Coupling

if TYPE_CHECKING:
    from ..model.model import Model

LAW = LawOf(None, curves=True)
_COORDINATE = re.compile(r"(?<![\w.])[^\W\d]\w*(?:\.[^\W\d]\w*)+")


@element
class Constraint(Coupling):
    """An equation g = 0 between coordinates and time: a holonomic constraint of any form.

    Its rows of position, velocity and acceleration are g = 0, (dg/dq) qdot + dg/dt = 0 and the derivative of that;
    derivatives of the law are exact. ``run["name.effort_1"]`` is the reaction along the first coordinate that the law
    names: the multiplier times the derivative of g by that coordinate. If the law names ``t``, ``run["name.work"]`` is
    the work that the constraint does on the mechanism.

    Parameters
    ----------
    name : str
    law : expression
        g, in SI units and radians: an expression of coordinates such as ``A.angle`` (of joints) and ``slider.x`` (of
        bodies and frames), of ``t``, parameters and tables. Where g = 0, some derivative of it by a coordinate must
        differ from 0: write ``A.angle - B.angle``, not its square.
    """

    law: Annotated[str, LAW] = field(kw_only=False)

    def coupled(self) -> tuple[str, ...]:
        """Return the coordinates that the law names, in the order of the text."""
        return tuple(dict.fromkeys(_COORDINATE.findall(self.law)))

    def equation(self, model: Model) -> Expression:
        """Return g as an expression of known names."""
        return model.law(self.law, LAW, f"law of {self.title}", driver=True)  # type: ignore[no-any-return]

    def factors(self, n: SimpleNamespace, model: Model, axes: Callable[[str], Any]) -> tuple[float, ...]:
        """Return no weights: it is no weighted sum."""
        return ()

    def examine(self, model: Model) -> None:
        """Require coordinates, by their own names."""
        law = self.equation(model)
        sensors = sorted(law.names & {x.name for x in model.sensors})
        if sensors:
            of = model[sensors[0]].of
            raise ModelError(f"{self.title}: its law names sensor {sensors[0]!r}; write what it measures, {of!r}")
        if not self.coupled():
            raise ModelError(
                f"{self.title}: its law {self.law!r} names no coordinate, so it constrains nothing; write for instance "
                f"'A.angle - 2*B.angle'"
            )
