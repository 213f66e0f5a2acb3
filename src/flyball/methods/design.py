"""Design: what parameters change, and which serve best."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..model.model import Model
    from ..results.optimum import Optimum
    from ..results.sensitivity import Sensitivity
else:
    Model = object  # a mechanism is one; signatures alone load nothing


class Design(Model):
    """Derivatives by parameters, and the best of them."""

    def sensitivity(
        self,
        of: Sequence[str] = (),
        to: Sequence[str] = (),
        *,
        analysis: str = "instant",
        t: float | str = 0.0,
        t_end: float | str | None = None,
        outputs: int | Sequence[float] | None = None,
        parameters: Mapping[str, float | str] | None = None,
        about: str | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        coordinates: str = "auto",
        verify: bool = False,
    ) -> Sensitivity:
        """Derivatives of kinematics, reactions, equilibria, eigenvalues or a motion by parameters.

        Exact: complex steps through the formulas, along the change that the linearised equations prescribe. How the
        matrix behind eigenvalues changes, and a start that assembly had to find, comes from differences of sixth order.

        Parameters
        ----------
        of : sequence of str
            Sensors, or curves of a result (``"slider.x"``). For ``"modes"`` none: all eigenvalues.
        to : sequence of str
            Parameters; all of the model's if none is named.
        analysis : {"instant", "motion", "equilibrium", "modes"}
            At ``t``; from ``t`` to ``t_end``; at the equilibrium; of the eigenvalues.
        t : float or str [s]
            Time of an instant, start of a motion.
        t_end : float or str [s], optional
            End of a motion.
        outputs : int or sequence of float [s], optional
            Number of times of a motion, 51 if not given, or the times themselves.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        about : {"equilibrium"}, optional
            For modes: about the static equilibrium; else where the mechanism is drawn.
        rtol : float [1], optional
            Tolerance of the error of a step of a motion relative to the state, 1e-9 if not given.
        atol : float [m, rad, m/s, rad/s], optional
            Tolerance of the error of a step of a motion where the state is small, 1e-11 if not given. Both go for the
            motion and for what a change of a parameter by the whole of it changes.
        coordinates : {"auto", "absolute", "joint"}
            In which a motion is computed, as for `simulate`.
        verify : bool
            Also by central differences of the whole analysis.

        Returns
        -------
        Sensitivity

        Raises
        ------
        ModelError
            If a name does not exist, an option has no effect in this analysis, a reaction is left undetermined by
            redundancy, or a law jumps during a motion.
        SingularityError
            If what is asked has no derivative there: at a kink of a force, for instance.
        """
        from ..analysis.sensitivity import SensitivityOptions, sensitivity

        return sensitivity(self, SensitivityOptions.asked(locals()))

    def optimize(
        self,
        of: Sequence[str],
        to: Sequence[str] | Mapping[str, tuple[float | str | None, float | str | None]],
        *,
        target: Any = None,
        minimize: Callable[[Any], float] | None = None,
        weights: Any = 1.0,
        analysis: str = "instant",
        t: float | str = 0.0,
        t_end: float | str | None = None,
        outputs: int | Sequence[float] | None = None,
        parameters: Mapping[str, float | str] | None = None,
        about: str | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        coordinates: str = "auto",
        evaluations: int = 200,
        tolerance: float = 1e-10,
        progress: bool | Callable[[float], None] = True,
    ) -> Optimum:
        """Find parameters for which quantities come nearest to a target, or a function of them is smallest.

        Least squares by a trust region with the exact Jacobian (Branch, Coleman and Li 1999), minimisation by L-BFGS-B
        (Byrd et al. 1995), both SciPy's; derivatives as in `sensitivity`.

        Parameters
        ----------
        of : sequence of str
            Quantities, as in `sensitivity`; for modes none.
        to : sequence of str, or mapping of str to (lowest, highest)
            Parameters to be changed, with their bounds (None: none).
        target : array
            What the quantities should be, in SI units or with units: one number each, or (times, quantities) of a
            motion. Eigenvalues [1/s] in any order, one of each complex pair.
        minimize : callable, in place of ``target``
            A smooth function of the quantities (times, of) that is to be smallest.
        weights : float or array
            Multiply the differences from the target.
        analysis : {"instant", "motion", "equilibrium", "modes"}
            As for `sensitivity`.
        t : float or str [s]
            Time of an instant, start of a motion.
        t_end : float or str [s], optional
            End of a motion.
        outputs : int or sequence of float [s], optional
            Number of times of a motion, or the times themselves.
        parameters : mapping, optional
            Values to begin with, in place of the model's.
        about : {"equilibrium"}, optional
            For modes: about the static equilibrium; else where the mechanism is drawn.
        rtol : float [1], optional
            As for `sensitivity`.
        atol : float [m, rad, m/s, rad/s], optional
            As for `sensitivity`.
        coordinates : {"auto", "absolute", "joint"}
            As for `sensitivity`.
        evaluations : int
            Most analyses to be made.
        tolerance : float [1]
            Relative changes of cost and parameters below which the search ends.
        progress : bool or callable
            A bar on a terminal and in a notebook from two seconds on; a callable gets the part of ``evaluations`` made.

        Returns
        -------
        Optimum

        Raises
        ------
        ModelError
            If a quantity, parameter or option does not exist, or a bound is not met at the start.
        AnalysisError
            If the mechanism cannot be analysed at the start.
        """
        from ..analysis.optimize import OptimizeOptions, optimize

        return optimize(self, OptimizeOptions.asked(locals()))
