"""A mechanism's equations as expressions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from ..model.model import Model
    from ..symbolic.equations import Equations
    from ..symbolic.export.code import Code
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
        names : {"parameters", "all", "none"}
            Which numbers are symbols: parameters; or every number of the description, called after its field:
            ``"rod.mass"``; none: numbers stay numbers.

        Returns
        -------
        Equations

        Raises
        ------
        ModelError
            If the mechanism has contacts, or a name does not exist.
        """
        from ..symbolic.asked import symbolic
        from ..symbolic.symbols import SymbolicOptions

        return symbolic(self, SymbolicOptions.asked(locals()))

    def export(
        self,
        folder: str | Path | None = None,
        *,
        language: str = "c",
        functions: Sequence[str] = (),
        outputs: Sequence[str] = (),
        inputs: Sequence[str] = (),
        coordinates: str = "auto",
        parameters: Mapping[str, float | str] | None = None,
        name: str = "",
    ) -> Code:
        """Write the equations of motion as code: C, Python that needs NumPy only, CasADi or Numba.

        Functions are straight-line code of time, state, inputs and parameters, made from the formulas that the program
        itself runs on. `Code` says in which order their arguments are.

        Parameters
        ----------
        folder : str or Path, optional
            Where the files are written; none are if it is left out.
        language : {"c", "python", "casadi", "numba"}
            C99 with a header, a Python module, functions of CasADi with a module that reads them, or a module of
            functions that Numba compiles.
        functions : sequence of str
            Which of kinematics, velocities, T, M, f, g, nu, G, gamma, residual, right_hand_side, energies and, with
            outputs, outputs; all of them if not given.
        outputs : sequence of str
            Quantities of results by name that the function ``outputs`` gives, such as ``"slider.x"``, ``"A.force_x"``.
        inputs : sequence of str
            As for `linearize`: what is added to laws of forces, motors and drivers, as the argument ``u``.
        coordinates : {"auto", "absolute", "joint"}
            Those of the equations, as for `symbolic`.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit. They are arguments all the same.
        name : str
            What files are called and names in C begin with; the mechanism's if not given.

        Returns
        -------
        Code

        Raises
        ------
        ModelError
            If a name does not exist, a law is a Python function that the language cannot call, or the equations are too
            large for straight-line code: the message says how large.
        AssemblyError
            If the mechanism cannot be assembled.
        ImportError
            If CasADi is asked for and not there.
        """
        from ..symbolic.export.export import ExportOptions, export

        return export(self, ExportOptions.asked(locals()))
