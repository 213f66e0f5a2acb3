"""The equations of motion of a mechanism as expressions, in its own names."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from .expressions import Expressions
from .linear.face import Linear
from .quantities import Quantities
from .shown import Shown
from .symbols import Symbols

if TYPE_CHECKING:
    from .explicit.explicit import ExplicitEquations
    from .explicit.states import StateEquations
    from .export.code import Code
    from .lagrange import Lagrange
    from .textbook import Textbook


class Equations(Shown, Linear, Symbols):
    """Equations of motion of a mechanism in one kind of coordinates.

        qdot = T v,   M vdot = f + G^T lam,   g = 0,   G v = nu,   G vdot = gamma

    Symbols are called as in results: ``"A.angle"``, its rate ``"A.angle'"``, parameters by their names. Everything is
    an `Expressions`: ``eq.M[0, 0]``, ``eq.f.sympy()``, ``eq.g.at({"A.angle": 0.3})``. Whatever a result has can be
    asked for by its name: ``eq["slider.x"]``, ``eq["A.force"]``, ``eq["energy.kinetic"]``, ``eq["spring.power"]``.

    Attributes
    ----------
    model : Mechanism
    coordinates : str
        Which they are, and why.
    q, v, vdot : Expressions
        The symbols of coordinates, velocities and accelerations. A body that is free in space has the Euler parameters
        ``e0`` to ``e3`` in q, and in v the angular velocity ``w_x``, ``w_y``, ``w_z`` along its own axes.
    lam : Expressions
        The symbols of the multipliers, one for each row of g; of a driver or a coupling its effort.
    loads : Expressions
        What presses the surfaces of joints with friction together: symbols in f. What they are when multipliers are
        known is ``load_values``.
    T, M, f, g, nu, G, gamma : Expressions
        f has all forces but reactions, gyroscopic terms included. Rows of drivers are rows as all others.
    """

    # -- what results have

    @cached_property
    def quantities(self) -> Quantities:
        """A motion at one instant, of expressions."""
        return Quantities(self)

    def __getitem__(self, name: str) -> Expressions:
        """Anything that a result has, by its name, or a symbol.

        Quantities of joints and drivers are in the multipliers, of joints whose coordinates the equations are in, in
        the accelerations too.

        Raises
        ------
        ModelError
            If there is nothing of that name, or it is no function of the state: works, energy balances.
        """
        return self.expression(name) if name in self.named else self.quantities.quantity(name)

    def reaction(self, joint: str, *, axes: str = "world", on: str | None = None) -> tuple[Expressions, Expressions]:
        """Force [N] and torque [N m] of a joint, as `JointView.reaction`: in lam, and in vdot for tree joints.

        Parameters
        ----------
        joint : str
        axes : str
            ``"world"``, ``"joint"``, or the name of one of the two bodies.
        on : str, optional
            The body on which it acts; the second one if not given. The torque is about the joint's point on that.
        """
        return self.quantities.reaction(joint, axes, on)

    # -- without constraints

    def explicit(self, independent: Sequence[str] = (), *, closed: bool = False) -> ExplicitEquations:
        """Equations of motion without constraints and multipliers, in independent coordinates.

        Parameters
        ----------
        independent : sequence of str
            Coordinates such as ``"A.angle"``, as many as there are freedoms; chosen by pivoting at the start if not
            given.
        closed : bool
            Whether to refuse mechanisms whose loops have no closed form; else what has none is an implicit function.

        Raises
        ------
        ModelError
            If a name does not exist, or the coordinates named depend on one another, are too many or too few.
        SingularityError
            If the mechanism is drawn in a singular position.
        """
        from .explicit.explicit import explicit

        return explicit(self, independent, closed)

    def state_space(
        self, outputs: Sequence[str] = (), *, independent: Sequence[str] = (), closed: bool = False
    ) -> StateEquations:
        """The nonlinear state space x' = f(x, u, t), y = h(x, u, t); the inputs u are those of `Mechanism.symbolic`.

        Parameters
        ----------
        outputs : sequence of str
            Anything that a result has: coordinates, sensors, reactions such as ``"A.fx"``, energies.
        independent, closed
            As for `explicit`.

        Raises
        ------
        ModelError
            As for `explicit`; if an output does not exist or is not determined.
        SingularityError
            If the mechanism is drawn in a singular position.
        """
        from .explicit.states import StateEquations

        return StateEquations(self.explicit(independent, closed=closed), outputs)

    def joint(self, name: str, *, orientation: str = "quaternion") -> Textbook:
        """A joint's own equations between two free frames, with the building blocks that they come from.

        Parameters
        ----------
        name : str
        orientation : {"quaternion", "bryant"}
            How the symbols say in which way the frames are turned.
        """
        from .textbook import textbook

        return textbook(self._start.assembly.compiled.values, name, orientation)

    def lagrange(self) -> Lagrange:
        """The same equations from the energies, by Lagrange's formalism; in quasi-velocities where bodies turn."""
        from .lagrange import Lagrange

        return Lagrange(self)

    def export(
        self,
        folder: str | Path | None = None,
        *,
        language: str = "c",
        functions: Sequence[str] = (),
        outputs: Sequence[str] = (),
        name: str = "",
    ) -> Code:
        """Functions of these equations as code: see `Mechanism.export`."""
        from .export.code import exported

        return exported(self, folder, language=language, functions=functions, outputs=outputs, name=name)

    def __repr__(self) -> str:
        return f"<equations of {self.model.name!r} in {self.coordinates.partition(':')[0]} coordinates>"
