"""Statics and small motions: equilibria, linear equations, modes, and how these change with a parameter."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..model.model import Model
    from ..results.equilibria import EquilibriumSeries
    from ..results.equilibrium import Equilibrium
    from ..results.linear import LinearModel
    from ..results.modes import Modes
    from ..results.result import Result
    from ..results.root_locus import RootLocus
else:
    Model = object  # a mechanism is one; signatures alone load nothing


class Statics(Model):
    """Equilibria of a mechanism, and its small motions about them."""

    def equilibrium(
        self,
        *,
        t: float | str = 0.0,
        parameters: Mapping[str, float | str] | None = None,
        start: Equilibrium | Result | None = None,
        stable: bool = False,
        preload: Sequence[str] = (),
        turning: Sequence[str] = (),
    ) -> Equilibrium:
        """Find a static equilibrium near the mechanism as drawn, or a steady motion, and whether it is stable.

        Drivers hold their coordinates where they are at ``t``; velocities, dampers and inertia play no part at rest.
        With contact it is let come to rest from where it is described; ``stable``, ``preload`` and ``turning`` mean
        nothing then.

        Parameters
        ----------
        t : float or str [s]
            Time at which laws of forces and drivers are taken.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        start : Equilibrium or Result, optional
            Guess in place of the drawn positions, and of controllers' initial states: an equilibrium of the same
            mechanism, or a motion of it, whose end is taken. Described speeds stay; time is ``t``, not the motion's.
        stable : bool
            Go on from an unstable equilibrium to a stable one. Not with ``preload`` or ``turning``.
        preload : sequence of str
            Forces, by the names that `linearize` takes for inputs: find what has to be added to them for the mechanism
            to be in equilibrium where it is drawn. Not with ``turning``.
        turning : sequence of str
            Joints' coordinates that turn evenly while all others stand still, such as the spindle of a governor: a
            steady motion is found. Speeds stay as described where nothing else decides them.

        Returns
        -------
        Equilibrium

        Raises
        ------
        AssemblyError
            If the mechanism cannot be assembled.
        ModelError
            If a name does not exist, or options say nothing beside each other.
        NotConverged
            If none is found: the message says what is left unbalanced, ``residuals`` the force or torque by name.
        SingularityError
            If it is found where a force jumps, or has a kink whose sides leave its stability open.
        """
        from ..analysis.equilibrium import EquilibriumOptions, equilibrium

        return equilibrium(self, EquilibriumOptions.asked(locals()))

    def equilibria(
        self,
        parameter: str,
        values: Sequence[float],
        *,
        t: float | str = 0.0,
        parameters: Mapping[str, float | str] | None = None,
        start: Equilibrium | Result | None = None,
        stable: bool = False,
        progress: bool | Callable[[float], None] = True,
    ) -> EquilibriumSeries:
        """Follow an equilibrium over values of a parameter, each from the one before.

        Where the branch ends, the series goes on from where the forces then lead; such jumps are told.

        Parameters
        ----------
        parameter : str
            A parameter of the model, or ``"t"``: drivers and forces then change as their laws say.
        values : sequence of float
            Its values in SI units, in the order in which they are gone through.
        t : float or str [s]
            Time at which laws of forces and drivers are taken.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        start : Equilibrium or Result, optional
            Guess for the first value, in place of the drawn positions; of a motion its end.
        stable : bool
            Leave a branch where it becomes unstable; else it is followed on. Not with controllers.
        progress : bool or callable
            A bar on a terminal and in a notebook from two seconds on; a callable gets the fraction done.

        Returns
        -------
        EquilibriumSeries

        Raises
        ------
        NotConverged
            If no equilibrium can be found at a value, or none that is stable; ``series`` holds those before.
        ModelError
            If there is no such parameter, or a value is not finite.
        AssemblyError
            If the mechanism cannot be assembled at the first value.
        """
        from ..analysis.equilibria import EquilibriaOptions, equilibria

        return equilibria(self, EquilibriaOptions.asked(locals()))

    def linearize(
        self,
        inputs: Sequence[str] = (),
        outputs: Sequence[str] = (),
        *,
        about: Result | Equilibrium | None = None,
        t: float | str | None = None,
        parameters: Mapping[str, float | str] | None = None,
        coordinates: str = "auto",
        frozen: bool = False,
    ) -> LinearModel:
        """Linear equations about an equilibrium or a steady motion: x' = A x + B u, y = C x + D u.

        Exact: the stiffness includes what reactions, inertia and gyroscopic terms do when positions change, constraints
        are eliminated. About a motion that turns evenly the equations are those seen from the evenly turning frame in
        which it is steady. Closed contacts stay closed: what sticks rolls where it is round, what is smooth slides.

        Parameters
        ----------
        inputs : sequence of str
            Forces, torques and motors that have a law (``"push.x"`` where it has components): what is added to it;
            drivers: what is added to their law; parameters.
        outputs : sequence of str
            Sensors, or curves of a result: ``"A.angle"``, ``"slider.vx"``, ``"A.fx"``, ``"energy.kinetic"``. Works and
            the energy's balance count from the start of a motion on, and are refused.
        about : Result or Equilibrium, optional
            Where: the end of a motion, or an equilibrium; else as drawn and assembled at ``t``.
        t : float or str [s], optional
            Time, 0 if not given; ``about`` has its own.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        coordinates : {"auto", "absolute", "joint"}
            Those that the states are changes of. With more than 150 freedoms, or 600 velocities, at rest what is dense
            is made when it is asked for, and `LinearModel.descriptor` is in absolute coordinates.
        frozen : bool
            The equations of this very instant, of a motion that need not be steady: their eigenvalues tell little.

        Returns
        -------
        LinearModel

        Raises
        ------
        AnalysisError
            If the state is neither an equilibrium nor a steady motion, or an output follows the rate of an input.
        SingularityError
            At a singular position, or where a force has a kink or jumps.
        ModelError
            If a name does not exist, something moves without inertia, or redundancy leaves an output undetermined.
        """
        from ..analysis.linearize import LinearizeOptions, linearize

        return linearize(self, LinearizeOptions.asked(locals()))

    def modes(
        self,
        *,
        about: Result | Equilibrium | None = None,
        t: float | str | None = None,
        parameters: Mapping[str, float | str] | None = None,
        coordinates: str = "auto",
        count: int | None = None,
        frozen: bool = False,
    ) -> Modes:
        """Natural frequencies, damping and shapes of motions about an equilibrium or a steady motion.

        Parameters
        ----------
        about : Result or Equilibrium, optional
            Where: the end of a motion, or an equilibrium; else as drawn and assembled at ``t``.
        t : float or str [s], optional
            Time, 0 if not given; ``about`` has its own.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        coordinates : {"auto", "absolute", "joint"}
            Those that the linear equations are made in; absolute ones with more than 600 velocities at rest,
            or 150 freedoms where ``count`` is given and few of them.
        count : int, optional
            How many, slowest first; all, or of large mechanisms the ten slowest, if not given.
        frozen : bool
            The modes of this very instant, of a motion that need not be steady: they tell little.

        Returns
        -------
        Modes

        Raises
        ------
        AnalysisError, SingularityError, ModelError
            As for `linearize`.
        """
        from ..analysis.modes import ModesOptions, modes

        return modes(self, ModesOptions.asked(locals()))

    def root_locus(
        self,
        parameter: str,
        values: Sequence[float],
        *,
        equilibrium: bool = False,
        about: Result | None = None,
        t: float | str | None = None,
        parameters: Mapping[str, float | str] | None = None,
        coordinates: str = "auto",
        frozen: bool = False,
        progress: bool | Callable[[float], None] = True,
    ) -> RootLocus:
        """Eigenvalues over values of a parameter, as branches, and where stability changes.

        Between two values every change of where eigenvalues lie (in the left or right half plane, on an axis, at zero)
        is bracketed and found to rounding; where branches meet, values are added. What leaves a half plane and comes
        back between two values goes unseen, unless the branch heads for the axis: give more values.

        Parameters
        ----------
        parameter : str
            A parameter of the model, or ``"t"``.
        values : sequence of float
            Its values in SI units.
        equilibrium : bool
            About the equilibrium at each value, each following from the one before; else as drawn at each value.
        about : Result, optional
            About the end of this motion at every value.
        t : float or str [s], optional
            Time, 0 if not given; ``about`` has its own.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        coordinates : {"auto", "absolute", "joint"}
            Those that the linear equations are made in.
        frozen : bool
            The eigenvalues of this very instant, of a motion that need not be steady: they tell little.
        progress : bool or callable
            A bar on a terminal and in a notebook from two seconds on; a callable gets the fraction done.

        Returns
        -------
        RootLocus

        Raises
        ------
        NotConverged
            If the mechanism cannot be linearised at a value; ``series`` holds what was found before.
        ModelError
            If there is no such parameter, or ``about`` is an equilibrium, which is one of other values.
        """
        from ..analysis.root_locus import RootLocusOptions, root_locus

        return root_locus(self, RootLocusOptions.asked(locals()))
