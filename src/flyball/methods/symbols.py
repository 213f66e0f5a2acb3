"""A mechanism's equations as expressions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..model.model import Model
    from ..symbolic.equations import Equations
else:
    Model = object  # a mechanism is one; signatures alone load nothing


class Symbols(Model):
    """Equations of a mechanism as expressions."""

    def symbolic(
        self,
        *,
        coordinates: str = "auto",
        inputs: Sequence[str] = (),
        parameters: Mapping[str, float | str] | None = None,
        names: str = "parameters",
    ) -> Equations:
        """The equations of motion as expressions in the mechanism's own names: M, f, g, G, gamma, reactions, energies.

        They are what the engine computes with, run on symbols: nothing is derived a second time. Whatever a result
        has can be asked for: ``eq["slider.x"]``, ``eq["A.force"]``, ``eq["energy.kinetic"]``.

        Parameters
        ----------
        coordinates : {"auto", "absolute", "joint"}
            Those of the equations; auto: those of the joints, wherever friction allows it.
        inputs : sequence of str
            As for `linearize`: what is added to laws of forces, motors and drivers, as symbols.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit. They are symbols all the same.
        names : {"parameters", "all"}
            Which numbers are symbols: parameters; or every number of the description, called after its field:
            ``"rod.mass"``.

        Returns
        -------
        Equations

        Raises
        ------
        ModelError
            If the mechanism has contacts, or a name does not exist.
        AssemblyError
            If the mechanism cannot be assembled.
        """
        from ..symbolic.equations import SymbolicOptions, symbolic

        return symbolic(self, SymbolicOptions.asked(locals()))
