"""What `Equations` say of small motions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ...errors import ModelError

if TYPE_CHECKING:
    from ...model.model import Model
    from ...results.equilibrium import Equilibrium
    from ...results.result import Result
    from .equations import LinearEquations


class Linear:
    """The linear part of `Equations`."""

    described: Model  # without the inputs
    tree: tuple[str, ...]
    _asked: Any

    def linear(
        self,
        outputs: Sequence[str] = (),
        *,
        at: Equilibrium | Result | Mapping[str, Any] | None = None,
        independent: Sequence[str] = (),
        balanced_by: Sequence[str] = (),
    ) -> LinearEquations:
        """Linear equations x' = A x + B u, y = C x + D u whose entries are expressions of the parameters.

        They are made of the constrained equations by derivatives at the point, reactions that turn with the bodies
        included; transfer functions and conditions of stability follow from them. The inputs u are those of
        `Mechanism.symbolic`. The point is an equilibrium, or a motion in which coordinates of joints turn evenly while
        all others stand still.

        Parameters
        ----------
        outputs : sequence of str
            Anything that a result has: coordinates, sensors, reactions such as ``"A.fx"``, energies.
        at : Equilibrium, Result or mapping, optional
            Where. As drawn, if not given: then the point has the parameters by which the mechanism is drawn. A mapping
            gives coordinates, and as ``"A.angle rate"`` or ``"A.angle'"`` their rates: numbers, texts with a unit,
            expressions of the mechanism's parameters; what it does not give is as drawn, or moved so that loops close.
            Of an equilibrium, or the end of a motion, the coordinates are numbers.
        independent : sequence of str
            Coordinates that the states are changes of; chosen by pivoting if not given.
        balanced_by : sequence of str
            Parameters that take the values with which the point is an equilibrium, as many as there are conditions.

        Raises
        ------
        ModelError
            If a name does not exist, the point cannot be closed, is singular or no equilibrium, or something moves
            without inertia.
        AnalysisError
            If the linear equations change with time.
        """
        from .linear import Asked, about

        for name in balanced_by:
            if name in self._asked.inputs:
                raise ModelError(
                    f"balanced_by names {name!r}, an input, which is what is added at the point: let its element "
                    f"have a parameter of its own ({name!r} with torque='tau' or force='F', 'tau' and 'F' among the "
                    f"mechanism's parameters), and name that: balanced_by=['tau']"
                )
        if isinstance(at, Mapping):
            at = {_rate(name): x for name, x in at.items()}

        return about(
            self.described,
            Asked(
                inputs=self._asked.inputs, outputs=outputs, at=at, coordinates="joint" if self.tree else "absolute",
                independent=independent, balanced_by=balanced_by, parameters=self._asked.parameters, tree=self.tree,
            ),
        )  # fmt: skip


def _rate(name: Any) -> Any:
    """``"A.angle rate"``, as states are called, for the symbol ``"A.angle'"``."""
    return f"{name[:-1]} rate" if isinstance(name, str) and name.endswith("'") else name
