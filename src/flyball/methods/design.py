"""Design: what parameters change, and which serve best."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from concurrent.futures import Executor
    from os import PathLike

    from ..analysis.motion.impulse.settings import Stepping
    from ..model.model import Model
    from ..results.optimum import Optimum
    from ..results.result import Result
    from ..results.sensitivity import Sensitivity
    from ..results.study import Study
else:
    Model = object  # a mechanism is one; signatures alone load nothing


class Design(Model):
    """Derivatives by parameters, the best of them, and many runs."""

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
        Interrupted
            If the user interrupts it; its ``result`` is the best by then.
        """
        from ..analysis.optimize import OptimizeOptions, optimize

        return optimize(self, OptimizeOptions.asked(locals()))

    def study(
        self,
        vary: Mapping[str, Any],
        of: Sequence[str] | Mapping[str, Callable[[Any], float]],
        *,
        analysis: str | Callable[[Any, dict[str, float]], Any] = "motion",
        t_end: float | str | None = None,
        t_start: float | str | None = None,
        outputs: int | Sequence[float] | None = None,
        t: float | str | None = None,
        about: str | None = None,
        design: str = "grid",
        samples: int | None = None,
        seed: int | None = None,
        parameters: Mapping[str, float | str] | None = None,
        start: Result | None = None,
        coordinates: str = "auto",
        method: str | Stepping = "auto",
        rtol: float = 1e-7,
        atol: float | None = None,
        max_step: float | str = math.inf,
        step: float | str | None = None,
        rho_inf: float | None = None,
        max_steps: int = 10_000_000,
        stabilization: str = "projection",
        alpha: float | None = None,
        beta: float | None = None,
        specialize: bool | str = "auto",
        file: str | PathLike[str] | None = None,
        executor: Executor | None = None,
        threads: int | None = None,
        progress: bool | Callable[[float], None] = True,
    ) -> Study:
        """Analyse at many values of parameters, on all cores: grids, samples, Monte Carlo, Sobol' indices.

        Each run is to the last bit what the analysis by itself makes of it (``m.simulate(**study.question(k))``), and
        doubtful where that is. One that fails is left out, and the study says why.

        Parameters
        ----------
        vary : mapping
            Parameter -> its values (grid, list); or what samples of it are drawn from: (low, high), a distribution of
            ``scipy.stats``, or ``"normal(mean, sd)"``, ``"uniform(low, high)"``, ``"loguniform(low, high)"``,
            ``"lognormal(median, sd of the logarithm)"``.
        of : sequence of str, or mapping of str to callable
            Curves of a result (``"slider.x"``), or one number of each: ``"end(slider.x)"``, ``max``, ``min``, ``mean``,
            ``rms``: of the curve at the output times, ``mean`` and ``rms`` over time by the trapezoidal rule, so that
            it matters not how times are spread; where they are far apart for what the curve does, both are as rough.
            Of an equilibrium also ``"least"`` (its least stiffness) and ``"stable"`` (1 or 0); of modes
            ``"frequency[0]"``, ``"omega[0]"``, ``"damping_ratio[0]"``, slowest first, and ``"stable"``; of linear
            models ``"gain(output, input)"``, with an angular frequency [rad/s] as third also ``phase``, and
            ``"abscissa"``, the largest real part of an eigenvalue [1/s]; of sampled models ln(abs(z)) / period of the
            largest multiplier z.
            Or name -> function of a run's answer that returns a number.
        analysis : {"motion", "kinematics", "instant", "equilibrium", "modes", "linearize"} or callable
            What each run is: `simulate`, `kinematics`, `assemble` with accelerations and reactions, `equilibrium`,
            `modes`, `linearize`; or a function of the mechanism and the values of its parameters, of any other.
        t_end : float or str [s], optional
            End of motions and kinematics.
        t_start : float or str [s], optional
            Their start: 0 if not given; where ``start`` ended if that is.
        outputs : int or sequence of float [s], optional
            Output times, as for `simulate`; if not given 501, or 17 where ends are all that is looked at.
        t : float or str [s], optional
            Time of an instant, of an equilibrium or of small motions: 0 if not given.
        about : {"equilibrium"}, optional
            Of modes and linear models: about the equilibrium; else where the mechanism is drawn.
        design : {"grid", "list", "random", "latin", "sobol", "saltelli"}
            ``grid``: all combinations of the values; ``list``: the first of all, the second of all, and so on.
            ``random``: Monte Carlo; ``latin``: a Latin hypercube; ``sobol``: scrambled points of Sobol; ``saltelli``:
            the runs that `Study.indices` needs.
        samples : int, optional
            How many are drawn; a power of two for ``sobol`` and ``saltelli``, which makes (parameters + 2) times as
            many runs.
        seed : int, optional
            Of the samples: 0 if not given, so that the same call draws the same.
        parameters : mapping, optional
            Values of other parameters in place of the model's, in SI units or with a unit.
        start : Result, optional
            Every run goes on from where this result ended.
        coordinates : {"auto", "absolute", "joint"}
            As for `simulate`.
        method : {"auto", "dop853", "rk45", "radau", "generalised-alpha", "variational", "impulse"} or Stepping
            As for `simulate`.
        rtol : float [1]
            As for `simulate`.
        atol : float [m, rad, m/s, rad/s], optional
            As for `simulate`.
        max_step : float or str [s]
            As for `simulate`.
        step : float or str [s], optional
            As for `simulate`.
        rho_inf : float [1], optional
            As for `simulate`.
        max_steps : int
            As for `simulate`.
        stabilization : str
            As for `simulate`.
        alpha : float [1/s], optional
            As for `simulate`.
        beta : float [1/s], optional
            As for `simulate`.
        specialize : bool or "auto"
            As for `simulate`; auto is decided once, for all runs together.
        file : path, optional
            Where the study is kept while it runs (NetCDF, by `load_study` read back): the same call with the same file
            goes on where it was interrupted or killed.
        executor : concurrent.futures.Executor, optional
            Who computes the runs, for instance processes or ``client.get_executor()`` of Dask; threads if not given.
        threads : int, optional
            How many; one for each core if not given.
        progress : bool or callable
            As for `simulate`: the part of the runs that are done.

        Returns
        -------
        Study

        Raises
        ------
        ModelError
            If a parameter, quantity, distribution or option does not exist or does nothing, the analysis does not know
            something that the mechanism has, or the file is of another study.
        AnalysisError
            If the executor fails.
        Interrupted
            If the user interrupts it; its ``result`` is the study with what was computed.
        """
        from ..analysis.study import StudyOptions, study

        return study(self, StudyOptions.asked(locals()))
