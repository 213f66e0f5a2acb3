"""The methods of `flyball.Mechanism`: the only place with signature, defaults and description of every analysis.

Each method passes its arguments to the analysis as one frozen options object, which checks them. The subcommand of the
same name is made from the method's signature and docstring. Analyses are imported when they are called.

Methods run with BLAS on one thread: matrices of mechanisms are small, and BLAS threads would spend more time waiting
for one another than computing (on a shared machine a singular value decomposition of 400 x 400 takes sixty times as
long on two threads).
"""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import cache, wraps
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from concurrent.futures import Executor
    from os import PathLike
    from pathlib import Path

    from .assembly.assembled_state import Assembly
    from .kinematics.prepared import Prepared
    from .model.model import Model
    from .results.comparison import Comparison
    from .results.equilibrium import Equilibrium, EquilibriumSeries
    from .results.inverse_dynamics import InverseDynamics
    from .results.linear_model import LinearModel
    from .results.mechanism_report import MassReport, Report
    from .results.mobility import Mobility
    from .results.modes import Modes, RootLocus
    from .results.result import Result
    from .results.sensitivity_and_optimum import Fit, Optimum, Sensitivity
    from .results.singularities import Branch, Singularities
    from .results.study import Study
    from .simulation.integration_options import Stepping
    from .simulation.stepper import Stepper
    from .symbolic.equations import Equations
    from .symbolic.export import Code
else:
    Model = object  # a mixin of Mechanism; this import is for type checkers only


def on_one_thread(method: Callable[..., Any], *, by_scipy: bool) -> Callable[..., Any]:
    """Wrap a method so that it runs with BLAS on one thread; ``by_scipy``: it needs SciPy's BLAS, to be loaded first.

    The number of BLAS threads is a setting of the process. Only Python's main thread changes it, and restores it when
    the method ends.
    """

    @wraps(method)
    def limited(*args: Any, **named: Any) -> Any:
        if threading.current_thread() is not threading.main_thread():
            return method(*args, **named)
        if by_scipy:
            import scipy.linalg  # noqa: F401
        found = _blas_libraries("scipy.linalg" in sys.modules)
        if all(library.num_threads == 1 for library in found.lib_controllers):
            return method(*args, **named)
        with found.limit(limits=1):
            return method(*args, **named)

    return limited


@cache
def _blas_libraries(with_scipy: bool) -> Any:
    """Return the thread controls of NumPy's BLAS, and of SciPy's own, if that is loaded."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas")


class MobilityMethods(Model):
    """Positions, degrees of freedom and masses of a mechanism."""

    def assemble(self, *, t: float | str = 0.0, parameters: Mapping[str, float | str] | None = None) -> Assembly:
        """Find positions and velocities that satisfy all constraints, near those described.

        Parameters
        ----------
        t : float or str [s]
            Time at which the laws of drivers are evaluated.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.

        Returns
        -------
        Assembly

        Raises
        ------
        AssemblyError
            If no closed position, or no consistent velocity, is found; the message names the joints that cannot be
            closed and their gaps.
        """
        from .analysis_options import AssembleOptions
        from .assembly.assemble import assemble

        o = AssembleOptions.from_arguments(locals())
        return assemble(self, t=o.t, parameters=o.parameters)

    def check(self) -> Report:
        """Report degrees of freedom, redundant joints, assembly, mass properties and warnings, without simulating.

        Returns
        -------
        Report

        Raises
        ------
        AssemblyError
            If the mechanism cannot be assembled.
        """
        from .check import check

        return check(self)

    def mobility(
        self,
        *,
        t: float | str = 0.0,
        parameters: Mapping[str, float | str] | None = None,
        inertia: bool = False,
    ) -> Mobility:
        """Degrees of freedom by name, redundant constraints and remedies, special dimensions and singular positions.

        Parameters
        ----------
        t : float or str [s]
            Time at which the mechanism is assembled. If assembly fails, the best position found is analysed: the
            contradicting constraints are those that are linearly dependent there.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        inertia : bool
            Refuse bodies that can move without any inertia: forces could not determine their acceleration.

        Returns
        -------
        Mobility

        Raises
        ------
        ModelError
            If ``inertia`` is true and a body can move without any inertia.
        AssemblyError
            If velocity conditions contradict one another although the position constraints are independent.
        """
        from .analysis_options import MobilityOptions
        from .mobility.mobility import mobility

        o = MobilityOptions.from_arguments(locals())
        return mobility(self, t=o.t, parameters=o.parameters, inertia=o.inertia)

    def mass_properties(
        self, *, drawn: bool = False, parameters: Mapping[str, float | str] | None = None
    ) -> MassReport:
        """Mass, centre of mass, inertia, principal moments and axes of every body and of all together.

        Parameters
        ----------
        drawn : bool
            Positions of bodies: the reference configuration, or (if false) those assembled at t = 0.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.

        Returns
        -------
        MassReport

        Raises
        ------
        AssemblyError
            If the mechanism cannot be assembled; the reference configuration needs no assembly.
        """
        from .check import MassOptions, mass_properties

        return mass_properties(self, MassOptions.from_arguments(locals()))

    def singularities(
        self,
        driver: str,
        range: Sequence[float | str],
        *,
        t: float | str = 0.0,
        parameters: Mapping[str, float | str] | None = None,
        branch: Branch | int | None = None,
        step: float = 0.1,
        steps: int = 5000,
    ) -> Singularities:
        """Follow a driven motion and find every position where the driven Jacobian loses rank.

        The curve of positions is followed by arc length in both directions from the assembled position, until the
        driver's coordinate leaves the range or the curve closes; the coordinate is varied freely in place of the
        driver's law. Where the driver locks up, the curve turns back and is followed further. Other drivers keep their
        values at ``t``.

        Parameters
        ----------
        driver : str
            Name of the driver whose coordinate is varied.
        range : (float or str, float or str)
            First and last value of the driver's coordinate [rad] or [m], or with a unit: ``("0 deg", "360 deg")``.
        t : float or str [s]
            Time at which laws are evaluated.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        branch : Branch or int, optional
            Start along this branch, from the singular position where it was found. If the reference configuration is
            singular: the number of the branch to follow (the first if not given).
        step : float [1]
            Longest step along the curve: radians, and lengths relative to the mechanism's length.
        steps : int
            Largest number of steps in each direction.

        Returns
        -------
        Singularities

        Raises
        ------
        ModelError
            If there is no such driver or branch, the range is invalid, or there are non-holonomic constraints.
        AssemblyError
            If the mechanism cannot be assembled as described.
        MobilityError
            If degrees of freedom remain besides the driver, or the driver has none to move.
        SingularityError
            If the range is not reached; the message says where the mechanism locks up.
        NotConverged
            If the curve cannot be followed.
        """
        from .singularities.singularities import SingularitiesOptions, singularities

        return singularities(self, SingularitiesOptions.from_arguments(locals()))


class MotionMethods(Model):
    """Motions of a mechanism."""

    def simulate(
        self,
        t_end: float | str,
        *,
        t_start: float | str | None = None,
        outputs: int | Sequence[float] = 501,
        parameters: Mapping[str, float | str] | None = None,
        start: Result | Equilibrium | None = None,
        coordinates: str = "auto",
        method: str | Stepping = "auto",
        rtol: float = 1e-7,
        atol: float | None = None,
        max_step: float | str = math.inf,
        max_steps: int = 10_000_000,
        stabilization: str = "projection",
        alpha: float | None = None,
        beta: float | None = None,
        specialize: bool | str = "auto",
        step: float | str | None = None,
        rho_inf: float | None = None,
        checkpoint: str | PathLike[str] | None = None,
        progress: bool | Callable[[float], None] = True,
    ) -> Result:
        """Integrate the equations of motion.

        Tolerances limit the error of a single step; the errors of steps accumulate. With the default ``rtol`` of 1e-7
        the error at the end is about 1e-6 of the motion or less (relative to the largest displacement, rotation or
        speed) for motions of some ten oscillations or revolutions: lengths and masses are never known more accurately.
        It grows with the square of the time where a period is slightly wrong, and faster where the motion is sensitive
        to its initial state (near singular positions, in free chains, in ropes that go slack); no tolerance changes
        that. Ten times the tolerance gives ten times the error and costs a quarter less.

        Parameters
        ----------
        t_end : float or str [s]
            End of the motion, such as ``10`` or ``"500 ms"``.
        t_start : float or str [s], optional
            Start of the motion. If not given: the end of ``start``, or 0 without ``start``.
        outputs : int or sequence of float [s]
            Number of evenly spaced output times, or the times themselves.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        start : Equilibrium or Result, optional
            Continue from the end of this result, or start in this equilibrium or steady motion.
        coordinates : {"auto", "absolute", "joint"}
            Coordinates of the equations; auto: those with the cheaper right-hand side. Results do not depend on it.
        method : {"auto", "dop853", "rk45", "radau", "generalised-alpha", "variational", "impulse"} or Stepping
            ``dop853``, ``rk45``: explicit Runge-Kutta pairs, of order 8 and 5, for smooth motions. ``radau``: implicit,
            Radau IIA of order 5, for stiff springs and strong damping. ``generalised-alpha``: implicit, of order 2, at
            fixed steps (``step``), with damping of unresolved frequencies (``rho_inf``). ``variational``: symplectic,
            of order 2, at fixed steps, for very long runs: energy and momenta do not drift. ``impulse``, or a
            `Stepping` with its own options: impulse time stepping with fixed steps, for contact with friction. auto:
            ``dop853`` with event detection, and ``radau`` while a long motion is stiff; impulse time stepping if bodies
            may touch at many points or in ways that event-driven integration does not support. ``health.method`` states
            the method, from what time, and why. Or the name of a Runge-Kutta method defined by `elements.runge_kutta`.
        rtol : float [1]
            Tolerance of the error of a step relative to the state; 1e-13 at least, 0.1 at most.
        atol : float [1], optional
            Tolerance of the error of a step where the state is small: relative to the mechanism's length or to a
            radian, of velocities times its characteristic rate. If not given: ``rtol`` / 100, at least 1e-14.
        max_step : float or str [s]
            Longest step. Changes of a law that last less than 1/20 000 of the time span can be missed: then limit the
            step.
        max_steps : int
            Number of steps after which the integration fails.
        stabilization : str
            How constraint drift is removed: ``projection`` (in every stage), ``projection-steps`` (after every step),
            ``positions`` or ``velocities`` (only these are projected), ``partitioning`` (dependent coordinates are
            solved for), ``baumgarte``, or ``none``. `compare` shows their effects.
        alpha : float [1/s], optional
            First rate of Baumgarte's method, 10 if not given.
        beta : float [1/s], optional
            Second rate of Baumgarte's method, 10 if not given.
        specialize : bool or "auto"
            True: use code generated for this mechanism. It is three to five times as fast; generation takes some
            seconds, once for all parameter values, and the code is stored on disk. False: use the general engine. auto:
            whichever takes less time; existing code is used. The results of both are equal to the last bit;
            ``health.engine`` says which was used.
        step : float or str [s], optional
            Fixed step, without error control; a step ends early at an event, and the next begins there. ``rtol`` is
            then the tolerance of the solution of a step's equations.
        rho_inf : float [1], optional
            Of ``generalised-alpha``: spectral radius at infinite frequency, 0 to 1 (the factor by which a step reduces
            an oscillation much faster than the step); 0.8 if not given. 1: no damping.
        checkpoint : path, optional
            Result file to which the motion is saved while it is computed. After an interrupt or a crash (at most a
            minute of computing is lost) the same call continues from there, with identical digits. If the file contains
            the whole motion, that is returned.
        progress : bool or callable
            A bar on a terminal and in a notebook from two seconds on; a callable gets the fraction done some twenty
            times a second.

        Returns
        -------
        Result

        Raises
        ------
        ModelError
            If an option is invalid, or has no effect in combination with the others.
        AssemblyError
            If no consistent initial state is found.
        SimulationError
            If the integration cannot continue; its ``result`` contains the motion up to then.
        Interrupted
            If the user interrupts it; its ``result`` contains the motion up to then.
        """
        from .simulation.checkpoints import CheckpointOptions, simulate_with_checkpoints

        return simulate_with_checkpoints(self, CheckpointOptions.from_arguments(locals()))

    def prepare(
        self,
        *,
        coordinates: str = "auto",
        parameters: Mapping[str, float | str] | None = None,
        specialize: bool = False,
    ) -> Prepared:
        """The equations of motion as functions of plain arrays: mass matrix, accelerations, Jacobians, poses.

        For loops of your own: controllers, estimators, planners. Analyses do not need it: what one call prepares is
        reused by the next, as long as the mechanism is unchanged.

        Parameters
        ----------
        coordinates : {"auto", "absolute", "joint"}
            Coordinates of the arrays; auto: those with the cheaper right-hand side.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        specialize : bool
            Generate machine code of the recursive dynamics (`rnea`, `aba`, `mass_matrix` and the derivatives) for this
            mechanism when each is first used, and keep it on disk: 2 to 6 times faster at many states, after a second
            of compiling for an arm, half a minute for the derivatives of a humanoid.

        Returns
        -------
        Prepared
            Immutable; threads may share it.

        Raises
        ------
        AssemblyError
            If the mechanism cannot be assembled.
        """
        from .kinematics.prepared import PrepareOptions, prepare

        return prepare(self, PrepareOptions.from_arguments(locals()))

    def stepper(
        self,
        dt: float | str,
        *,
        inputs: Sequence[str] = (),
        outputs: Sequence[str] = (),
        method: str | Stepping = "auto",
        rtol: float | None = None,
        step: float | str | None = None,
        coordinates: str = "auto",
        parameters: Mapping[str, float | str] | None = None,
        t_start: float | str = 0.0,
        copies: int | None = None,
        threads: int = 1,
    ) -> Stepper:
        """A mechanism that a program advances step by step: for control loops and reinforcement learning.

        Parameters
        ----------
        dt : float or str [s]
            Duration of a step. Inputs are constant during a step.
        inputs : sequence of str
            Forces and motors, to whose laws the input is added (``"push.x"`` where there are components), and
            parameters that laws read; as in `linearize`.
        outputs : sequence of str
            Sensors, and positions, angles, lengths and their rates by name, such as ``"A.angle"``, ``"A.angle_rate"``,
            ``"tip.x"``.
        method : str or Stepping
            ``"auto"``: impulse time stepping if there are contacts, stops, friction or ropes, else an integrator. An
            explicit integrator by name; ``"impulse"``, or a `Stepping` with its options.
        rtol : float [1], optional
            Relative tolerance of the integrator, by default 1e-6.
        step : float or str [s], optional
            Fixed step of the integrator; by default it adapts to ``rtol``.
        coordinates : {"auto", "absolute", "joint"}
            Coordinates of an integrated motion.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        t_start : float or str [s]
            Time at the start.
        copies : int, optional
            Number of independent copies; inputs and outputs then are arrays with a leading axis for the copies.
        threads : int
            Number of threads among which the copies are divided.

        Returns
        -------
        Stepper

        Raises
        ------
        ModelError
            If there is no such input or output, or the method does not support the mechanism: events and sampled
            controllers are not supported, other controllers not together with contact.
        """
        from .simulation.stepper import StepperOptions, make_stepper

        return make_stepper(self, StepperOptions.from_arguments(locals()))

    def live(
        self,
        t_end: float | str = 5.0,
        *,
        outputs: int = 501,
        ranges: Mapping[str, Sequence[float | str]] | None = None,
        port: int = 0,
        no_open: bool = False,
    ) -> Any:
        """Show the mechanism in the browser while it is computed: sliders for parameters, stepping, dragging.

        In a notebook the page is a widget, and this returns at once. Elsewhere it is served to this machine only, under
        an address with a random token, until the user interrupts.

        Parameters
        ----------
        t_end : float or str [s]
            Duration of the motion that is computed again whenever a slider moves.
        outputs : int
            Number of output times of that motion.
        ranges : mapping, optional
            Parameter to its least and largest value on its slider, in SI units or with a unit. Others get a range about
            their value, and the page says so.
        port : int
            Port of the server; 0 selects a free one.
        no_open : bool
            Only print the address; open no browser.

        Returns
        -------
        widget or None
            In a notebook the widget; elsewhere nothing.

        Raises
        ------
        ModelError
            If a range is invalid, or the package websockets (in a notebook anywidget) is not installed.
        """
        from .live import LiveOptions, show_live

        return show_live(self, LiveOptions.from_arguments(locals()))

    def compare(
        self,
        t_end: float | str,
        *,
        t_start: float | str | None = None,
        outputs: int | Sequence[float] = 201,
        formulations: Sequence[str] | None = None,
        repeats: int = 5,
        parameters: Mapping[str, float | str] | None = None,
        start: Result | Equilibrium | None = None,
        method: str = "dop853",
        step: float | str | None = None,
        rtol: float = 1e-7,
        atol: float | None = None,
        max_step: float | str = math.inf,
        max_steps: int | None = None,
        alpha: float | None = None,
        beta: float | None = None,
        progress: bool | Callable[[float], None] = True,
    ) -> Comparison:
        """Integrate the same motion by several formulations: drift, energy and cost of each.

        All start from the same consistent state, with the same integrator and the same tolerances, in absolute
        coordinates unless their name says otherwise. Driven motions are integrated as well, also where drivers leave no
        degree of freedom. States that are not projected are reported with their drift.

        Parameters
        ----------
        t_end : float or str [s]
            End of the motion.
        t_start : float or str [s], optional
            Start of the motion. If not given: the end of ``start``, or 0 without ``start``.
        outputs : int or sequence of float [s]
            Number of times at which drift and energy are evaluated, or the times themselves.
        formulations : sequence of str, optional
            Names out of ``none``, ``baumgarte``, ``positions``, ``velocities``, ``projection-steps``, ``projection``,
            ``partitioning``, ``coupled matrix`` and ``joint coordinates``; all of them by default. Also methods that
            satisfy the constraints by themselves: ``radau``, ``generalised-alpha``, ``radau index 3``,
            ``generalised-alpha index 3``, ``variational``.
        repeats : int
            Number of runs for measuring the cost, fewer if they take long; 0 for none.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        start : Equilibrium or Result, optional
            Continue from the end of this result, or start in this equilibrium or steady motion.
        method : {"dop853", "rk45"}
            Explicit Runge-Kutta pair, of order 8 or 5.
        step : float or str [s], optional
            Step size of ``radau`` (chosen automatically if not given) and of the other such methods (required).
        rtol : float [1]
            Tolerance of the error of a step relative to the state.
        atol : float [1], optional
            Tolerance of the error of a step where the state is small; as for `simulate`.
        max_step : float or str [s]
            Longest step.
        max_steps : int, optional
            Number of steps after which a formulation fails; twenty times those of the reference if not given.
        alpha : float [1/s], optional
            First rate of Baumgarte's method, 10 if not given.
        beta : float [1/s], optional
            Second rate of Baumgarte's method, 10 if not given.
        progress : bool or callable
            As for `simulate`.

        Returns
        -------
        Comparison
            Contains failed formulations too, with the message and the motion up to then.

        Raises
        ------
        AssemblyError, ModelError
            If no consistent initial state is found; for formulations or options that do not exist.
        """
        from .studies.formulation_comparison import CompareOptions, compare

        return compare(self, CompareOptions.from_arguments(locals()))

    def kinematics(
        self,
        times: int | Sequence[float] = 501,
        *,
        t_end: float | str | None = None,
        t_start: float | str | None = None,
        parameters: Mapping[str, float | str] | None = None,
        coordinates: str = "auto",
        specialize: bool | str = "auto",
        progress: bool | Callable[[float], None] = True,
    ) -> Result:
        """Positions, velocities and accelerations of a mechanism whose drivers leave no degree of freedom.

        Parameters
        ----------
        times : int or sequence of float [s]
            Number of evenly spaced times from ``t_start`` to ``t_end``, or ascending times themselves.
        t_end : float or str [s], optional
            End of the motion; needed if ``times`` is a number.
        t_start : float or str [s], optional
            Time at which the mechanism is assembled near the reference configuration. The motion is followed from
            there, so that it stays on one branch and full turns are counted. If not given: 0, or the first time if
            earlier.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        coordinates : {"auto", "absolute", "joint"}
            Coordinates of the equations; auto: those with the cheaper right-hand side.
        specialize : bool or "auto"
            As for `simulate`.
        progress : bool or callable
            As for `simulate`.

        Returns
        -------
        Result

        Raises
        ------
        MobilityError
            If drivers leave a degree of freedom (``free`` names it), or are redundant (``redundant`` names them).
        SingularityError
            If the mechanism locks, or begins where drivers do not determine its motion; ``where`` is the time,
            ``elements`` those whose constraints become dependent, ``result`` contains the motion up to there.
        AssemblyError
            If no position satisfies all constraints at the start.
        SimulationError
            If a law cannot be followed, for instance because it jumps; its ``result`` contains the motion up to there.
        """
        from .kinematics.driven_motion import KinematicsOptions, kinematics

        return kinematics(self, KinematicsOptions.from_arguments(locals()))

    def inverse_dynamics(
        self,
        times: int | Sequence[float] = 501,
        motion: Mapping[str, Any] | None = None,
        *,
        t_end: float | str | None = None,
        t_start: float | str | None = None,
        parameters: Mapping[str, float | str] | None = None,
        coordinates: str = "auto",
        specialize: bool | str = "auto",
        progress: bool | Callable[[float], None] = True,
    ) -> InverseDynamics:
        """Drive forces and torques, and reactions of all joints, for a given motion.

        The motion is prescribed by drivers and by ``motion``. Forces and motors act; a drive supplies the remainder.

        Parameters
        ----------
        times : int or sequence of float [s]
            Number of evenly spaced times from ``t_start`` to ``t_end``, or ascending times themselves.
        motion : mapping, optional
            Coordinate (``"A.angle"``, ``"slider.x"``) or its sensor -> its motion [rad] or [m]: an expression such as
            ``"0.3*sin(2*t)"``; samples at ``times``; or a pair (times of samples [s], samples). Samples are
            interpolated by a cubic spline with continuous second derivative. Initial conditions then have no effect.
        t_end : float or str [s], optional
            End of the motion; needed if ``times`` is a number.
        t_start : float or str [s], optional
            As for `kinematics`; with samples the motion begins with the first one.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        coordinates : {"auto", "absolute", "joint"}
            Coordinates of the equations; auto: those with the cheaper right-hand side.
        specialize : bool or "auto"
            As for `simulate`.
        progress : bool or callable
            As for `simulate`.

        Returns
        -------
        InverseDynamics

        Raises
        ------
        ModelError
            If the motion names something that does not exist or cannot be driven, or its samples are invalid.
        MobilityError, SingularityError, AssemblyError, SimulationError
            As for `kinematics`.
        """
        from .kinematics.inverse_dynamics import InverseDynamicsOptions, inverse_dynamics

        return inverse_dynamics(self, InverseDynamicsOptions.from_arguments(locals()))


class StaticsMethods(Model):
    """Equilibria of a mechanism, and small motions about them."""

    def equilibrium(
        self,
        *,
        t: float | str = 0.0,
        parameters: Mapping[str, float | str] | None = None,
        start: Result | Equilibrium | None = None,
        stable: bool = False,
        preload: Sequence[str] = (),
        turning: Sequence[str] = (),
    ) -> Equilibrium:
        """Find a static equilibrium near the reference configuration, or a steady motion, and whether it is stable.

        Drivers hold their coordinates at the values for ``t``; velocities, dampers and inertia have no effect at rest.
        A mechanism with contact is simulated from the reference configuration until it is at rest; ``stable``,
        ``preload`` and ``turning`` do not apply then. With controllers it is not: contacts and stops that are closed in
        the reference configuration, or at the end of the motion ``start``, stay closed.

        Parameters
        ----------
        t : float or str [s]
            Time at which laws of forces and drivers are evaluated.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        start : Equilibrium or Result, optional
            Initial guess in place of the reference configuration and of controllers' initial states: an equilibrium of
            the same mechanism, or a motion, whose final state is used. Described speeds are kept; the time is ``t``,
            not the motion's.
        stable : bool
            Continue from an unstable equilibrium to a stable one. Not with ``preload`` or ``turning``.
        preload : sequence of str
            Forces, by the names that `linearize` takes for inputs: find the force offsets that make the reference
            configuration an equilibrium. Not with ``turning``.
        turning : sequence of str
            Joint coordinates that rotate at constant speed while all others are constant, such as the spindle of a
            governor: a steady motion is found. Speeds are as described unless something else determines them.

        Returns
        -------
        Equilibrium

        Raises
        ------
        AssemblyError
            If the mechanism cannot be assembled.
        ModelError
            If a name does not exist, or options cannot be combined.
        NotConverged
            If none is found: the message gives the largest residuals, ``residuals`` all forces or torques by name.
        SingularityError
            If a force jumps there, or has a kink and its one-sided derivatives do not decide the stability.
        """
        from .statics.equilibrium import EquilibriumOptions, equilibrium

        return equilibrium(self, EquilibriumOptions.from_arguments(locals()))

    def equilibria(
        self,
        parameter: str,
        values: Sequence[float],
        *,
        t: float | str = 0.0,
        parameters: Mapping[str, float | str] | None = None,
        start: Result | Equilibrium | None = None,
        stable: bool = False,
        progress: bool | Callable[[float], None] = True,
    ) -> EquilibriumSeries:
        """Follow an equilibrium over values of a parameter, each starting from the one before.

        Where the branch ends, the series continues at the equilibrium to which the forces then lead; jumps are
        reported.

        Parameters
        ----------
        parameter : str
            A parameter of the model, or ``"t"``: drivers and forces then follow their laws.
        values : sequence of float
            Its values in SI units, in the order of evaluation.
        t : float or str [s]
            Time at which laws of forces and drivers are evaluated.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        start : Equilibrium or Result, optional
            Initial guess for the first value, in place of the reference configuration; of a motion its final state.
        stable : bool
            Leave a branch where it becomes unstable; otherwise it is followed further. Not with controllers.
        progress : bool or callable
            A bar on a terminal and in a notebook from two seconds on; a callable gets the fraction done.

        Returns
        -------
        EquilibriumSeries

        Raises
        ------
        NotConverged
            If no equilibrium can be found at a value, or none that is stable; ``series`` contains those before.
        ModelError
            If there is no such parameter, or a value is not finite.
        AssemblyError
            If the mechanism cannot be assembled at the first value.
        """
        from .statics.equilibrium_series import EquilibriaOptions, equilibria

        return equilibria(self, EquilibriaOptions.from_arguments(locals()))

    def linearize(
        self,
        inputs: Sequence[str] = (),
        outputs: Sequence[str] = (),
        *,
        about: Result | Equilibrium | None = None,
        t: float | str | None = None,
        parameters: Mapping[str, float | str] | None = None,
        coordinates: str = "auto",
        independent: Sequence[str] = (),
        frozen: bool = False,
    ) -> LinearModel:
        """Linear equations about an equilibrium or a steady motion: x' = A x + B u, y = C x + D u.

        The linearisation is exact: the stiffness includes the changes of reactions, inertia forces and gyroscopic terms
        with position; constraints are eliminated. About a steady rotation the equations are those in the uniformly
        rotating frame in which the motion is steady. Closed contacts stay closed: sticking round bodies roll,
        frictionless ones slide.

        Parameters
        ----------
        inputs : sequence of str
            Forces, torques and motors that have a law (``"push.x"`` for one of several components), and drivers: the
            input is added to the law; parameters.
        outputs : sequence of str
            Sensors, or curves of a result: ``"A.angle"``, ``"slider.vx"``, ``"A.fx"``, ``"energy.kinetic"``. Work and
            the energy balance are refused, since they are counted from the start of a motion.
        about : Result or Equilibrium, optional
            Operating point: a motion at ``t``, or an equilibrium; if not given: the mechanism assembled at ``t``.
        t : float or str [s], optional
            Time, 0 if not given; an output time of a motion, its end if not given.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        coordinates : {"auto", "absolute", "joint"}
            Coordinates whose deviations are the states. At rest, with more than 150 degrees of freedom or 600
            velocities, dense matrices are computed on demand, and `LinearModel.descriptor` uses absolute coordinates.
        independent : sequence of str
            Coordinates whose changes are the states, by pivoting if not given: the same at all times of a motion.
        frozen : bool
            Linearise at one instant of a motion that need not be steady: A(t), B(t), C(t), D(t) of the equations along
            the motion. The eigenvalues of A(t) then mean little.

        Returns
        -------
        LinearModel

        Raises
        ------
        AnalysisError
            If the state is neither an equilibrium nor a steady motion, or an output depends on the rate of an input.
        SingularityError
            At a singular position, or where a force has a kink or jumps.
        ModelError
            If a name does not exist, a body can move without inertia, or redundancy leaves an output undetermined.
        """
        from .linear.linearize import LinearizeOptions, linearize

        return linearize(self, LinearizeOptions.from_arguments(locals()))

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
            Operating point: a motion at ``t``, or an equilibrium; if not given: the mechanism assembled at ``t``.
        t : float or str [s], optional
            Time, 0 if not given; an output time of a motion, its end if not given.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        coordinates : {"auto", "absolute", "joint"}
            Coordinates of the linear equations; absolute ones are used at rest with more than 600 velocities, or with
            more than 150 degrees of freedom if ``count`` is given and small.
        count : int, optional
            Number of modes, slowest first; if not given all, or the ten slowest of large mechanisms.
        frozen : bool
            Modes at one instant of a motion that need not be steady: they then mean little.

        Returns
        -------
        Modes

        Raises
        ------
        AnalysisError, SingularityError, ModelError
            As for `linearize`.
        """
        from .linear.modes import ModesOptions, modes

        return modes(self, ModesOptions.from_arguments(locals()))

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

        Every change in the location of eigenvalues (left or right half plane, on an axis, at zero) between two values
        is bracketed and found to rounding; values are added where branches meet. An eigenvalue that leaves a half plane
        and returns between two values can be missed, unless its branch heads for the axis: give more values.

        With sampled controllers they are the multipliers of a deviation in one cycle, which are stable within the unit
        circle.

        Parameters
        ----------
        parameter : str
            A parameter of the model, or ``"t"``.
        values : sequence of float
            Its values in SI units.
        equilibrium : bool
            Linearise about the equilibrium at each value, found from the one before; else about the assembled position.
        about : Result, optional
            Linearise about the end of this motion at every value.
        t : float or str [s], optional
            Time, 0 if not given; not with ``about``, which has its own.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        coordinates : {"auto", "absolute", "joint"}
            Coordinates of the linear equations.
        frozen : bool
            Eigenvalues at one instant of a motion that need not be steady: they then mean little.
        progress : bool or callable
            A bar on a terminal and in a notebook from two seconds on; a callable gets the fraction done.

        Returns
        -------
        RootLocus

        Raises
        ------
        NotConverged
            If the mechanism cannot be linearised at a value; ``series`` contains what was found before.
        ModelError
            If there is no such parameter, or ``about`` is an equilibrium (it would not be one at other values).
        """
        from .linear.root_locus import RootLocusOptions, root_locus

        return root_locus(self, RootLocusOptions.from_arguments(locals()))


class DesignMethods(Model):
    """Parameter derivatives, optimisation, and studies of many runs."""

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
        """Derivatives of kinematics, reactions, equilibria, eigenvalues or a motion with respect to parameters.

        Derivatives are exact: complex steps through the formulas, along the change of state given by the linearised
        equations. The derivative of the matrix whose eigenvalues are computed, and that of an assembled initial state,
        use finite differences of sixth order.

        Parameters
        ----------
        of : sequence of str
            Sensors, or curves of a result (``"slider.x"``). None for ``"modes"``: all eigenvalues are taken.
        to : sequence of str
            Parameters; all of the model's if none is named.
        analysis : {"instant", "motion", "equilibrium", "modes"}
            State at ``t``; motion from ``t`` to ``t_end``; equilibrium; eigenvalues.
        t : float or str [s]
            Time of an instant, start of a motion.
        t_end : float or str [s], optional
            End of a motion.
        outputs : int or sequence of float [s], optional
            Number of times of a motion, 51 if not given, or the times themselves.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        about : {"equilibrium"}, optional
            For modes: about the static equilibrium; else about the assembled position.
        rtol : float [1], optional
            Tolerance of the error of a step of a motion relative to the state, 1e-9 if not given.
        atol : float [1], optional
            Tolerance of the error of a step of a motion where the state is small, 1e-11 if not given. Both tolerances
            apply to the motion and to its change for a relative parameter change of 1.
        coordinates : {"auto", "absolute", "joint"}
            Coordinates in which a motion is computed, as for `simulate`.
        verify : bool
            Also compute the derivatives by central differences of the whole analysis.

        Returns
        -------
        Sensitivity

        Raises
        ------
        ModelError
            If a name does not exist, an option has no effect in this analysis, a reaction is left undetermined by
            redundancy, or a law jumps during a motion.
        SingularityError
            If the derivative does not exist there, for instance at a kink of a force.
        """
        from .sensitivity.sensitivity import SensitivityOptions, sensitivity

        return sensitivity(self, SensitivityOptions.from_arguments(locals()))

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
        """Find parameters that bring quantities closest to a target, or minimise a function of them.

        Least squares by a trust region with the exact Jacobian (Branch, Coleman and Li 1999), minimisation by L-BFGS-B
        (Byrd et al. 1995), both SciPy's; derivatives as in `sensitivity`.

        Parameters
        ----------
        of : sequence of str
            Quantities, as in `sensitivity`; for modes none.
        to : sequence of str, or mapping of str to (lowest, highest)
            Parameters to be changed, with their bounds (None: none).
        target : array
            Target values of the quantities, in SI units or with units: one number each, or (times, quantities) of a
            motion. Eigenvalues [1/s] in any order, one of each complex pair.
        minimize : callable, in place of ``target``
            A smooth function of the quantities (times, of) to be minimised.
        weights : float or array
            Factors of the differences from the target.
        analysis : {"instant", "motion", "equilibrium", "modes"}
            As for `sensitivity`.
        t : float or str [s]
            Time of an instant, start of a motion.
        t_end : float or str [s], optional
            End of a motion.
        outputs : int or sequence of float [s], optional
            Number of times of a motion, or the times themselves.
        parameters : mapping, optional
            Initial values, in place of the model's.
        about : {"equilibrium"}, optional
            For modes: about the static equilibrium; else about the assembled position.
        rtol : float [1], optional
            As for `sensitivity`.
        atol : float [1], optional
            As for `sensitivity`.
        coordinates : {"auto", "absolute", "joint"}
            As for `sensitivity`.
        evaluations : int
            Largest number of analyses.
        tolerance : float [1]
            Relative changes of cost and parameters below which the search ends.
        progress : bool or callable
            A bar on a terminal and in a notebook from two seconds on; a callable gets the fraction of ``evaluations``
            done.

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
            If the user interrupts it; its ``result`` is the best found by then.
        """
        from .sensitivity.optimization import OptimizeOptions, optimize

        return optimize(self, OptimizeOptions.from_arguments(locals()))

    def fit(
        self,
        data: str | PathLike | Mapping[str, Any],
        to: Sequence[str] | Mapping[str, tuple[float | str | None, float | str | None]],
        *,
        noise: Mapping[str, float | str] | None = None,
        confidence: float = 0.95,
        parameters: Mapping[str, float | str] | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        coordinates: str = "auto",
        evaluations: int = 200,
        tolerance: float = 1e-10,
        progress: bool | Callable[[float], None] = True,
    ) -> Fit:
        """Fit parameters to a measured motion by least squares, with confidence intervals.

        Deviations of each curve are weighted by its noise: as given, or estimated from the residuals of a first fit.
        Derivatives are exact, as in `sensitivity`. Intervals follow from the linearised model and Student's
        distribution (Seber and Wild, Nonlinear Regression, 1989, section 5.1).

        Parameters
        ----------
        data : str, path, or mapping of str to array
            A table (.csv) with a heading line, or arrays by heading: times ``t [s]``, and measured curves such as
            ``slider.x [mm]``; without a unit in SI. An empty entry or nan is a value that was not measured. The motion
            starts at t = 0, or at the first time if that is earlier.
        to : sequence of str, or mapping of str to (lowest, highest)
            Parameters to be fitted, with their bounds (None: none).
        noise : mapping of str to number, optional
            Standard deviation of the measurements of every curve.
        confidence : float
            Probability that an interval contains the true value.
        parameters : mapping, optional
            Initial values, in place of the model's.
        rtol : float [1], optional
            As for `sensitivity`.
        atol : float [1], optional
            As for `sensitivity`.
        coordinates : {"auto", "absolute", "joint"}
            As for `sensitivity`.
        evaluations : int
            Largest number of analyses of each fit.
        tolerance : float [1]
            Relative changes of cost and parameters below which the search ends.
        progress : bool or callable
            As for `optimize`.

        Returns
        -------
        Fit

        Raises
        ------
        ModelError
            If a quantity or parameter does not exist, or the data are no table of numbers.
        AnalysisError
            If the data do not determine the parameters.
        """
        from .sensitivity.optimization import FitOptions, fit

        return fit(self, FitOptions.from_arguments(locals()))

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
        start: Result | Equilibrium | None = None,
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
        """Run an analysis for many parameter values, on all cores: grids, samples, Monte Carlo, Sobol' indices.

        Each run is bit for bit equal to the single analysis (``m.simulate(**study.question(k))``), with the same
        diagnostics. A failed run is left out, and the study gives the reason.

        Parameters
        ----------
        vary : mapping
            Parameter -> its values (grid, list); or the distribution to sample from: (low, high), a distribution of
            ``scipy.stats``, or ``"normal(mean, sd)"``, ``"uniform(low, high)"``, ``"loguniform(low, high)"``,
            ``"lognormal(median, sd of the logarithm)"``.
        of : sequence of str, or mapping of str to callable
            Curves of a result (``"slider.x"``), or one number of each: ``"end(slider.x)"``, ``max``, ``min``, ``mean``,
            ``rms``: of the curve at the output times, ``mean`` and ``rms`` over time by the trapezoidal rule, so that
            the spacing of times does not matter; both are inaccurate if the times are too far apart. Of an equilibrium
            also ``"least"`` (its lowest stiffness eigenvalue) and ``"stable"`` (1 or 0); of modes ``"frequency[0]"``,
            ``"omega[0]"``, ``"damping_ratio[0]"``, slowest first, and ``"stable"``; of linear models ``"gain(output,
            input)"``, with an angular frequency [rad/s] as third also ``phase``, and ``"abscissa"``, the largest real
            part of an eigenvalue [1/s]; of sampled models ln(abs(z)) / period of the largest multiplier z. Or name ->
            function of a run's result that returns a number.
        analysis : {"motion", "kinematics", "instant", "equilibrium", "modes", "linearize"} or callable
            The analysis of each run: `simulate`, `kinematics`, `assemble` with accelerations and reactions,
            `equilibrium`, `modes`, `linearize`; or a function of the mechanism and its parameter values for any other
            analysis.
        t_end : float or str [s], optional
            End of motions and kinematics.
        t_start : float or str [s], optional
            Their start. If not given: the end of ``start``, or 0 without ``start``.
        outputs : int or sequence of float [s], optional
            Output times, as for `simulate`; if not given 501, or 17 if only final values are requested.
        t : float or str [s], optional
            Time of an instant, of an equilibrium or of small motions: 0 if not given.
        about : {"equilibrium"}, optional
            For modes and linear models: about the equilibrium; else about the assembled position.
        design : {"grid", "list", "random", "latin", "sobol", "saltelli"}
            ``grid``: all combinations of the values; ``list``: the first value of every parameter, the second of every
            parameter, and so on. ``random``: Monte Carlo; ``latin``: a Latin hypercube; ``sobol``: scrambled points of
            Sobol; ``saltelli``: the runs that `Study.indices` needs.
        samples : int, optional
            Number of samples; a power of two for ``sobol`` and ``saltelli``. The latter makes (parameters + 2) times as
            many runs.
        seed : int, optional
            Seed of the samples: 0 if not given, so that the same call gives the same samples.
        parameters : mapping, optional
            Values of other parameters in place of the model's, in SI units or with a unit.
        start : Equilibrium or Result, optional
            Every run continues from the end of this result, or starts in this equilibrium or steady motion.
        coordinates : {"auto", "absolute", "joint"}
            As for `simulate`.
        method : {"auto", "dop853", "rk45", "radau", "generalised-alpha", "variational", "impulse"} or Stepping
            As for `simulate`.
        rtol : float [1]
            As for `simulate`.
        atol : float [1], optional
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
            File to which the study is saved while it runs (NetCDF, read by `load_study`): the same call with the same
            file continues where it was interrupted or killed.
        executor : concurrent.futures.Executor, optional
            Executor of the runs, for instance processes or ``client.get_executor()`` of Dask; threads if not given.
        threads : int, optional
            Number of threads; one for each core if not given.
        progress : bool or callable
            As for `simulate`: the fraction of the runs done.

        Returns
        -------
        Study

        Raises
        ------
        ModelError
            If a parameter, quantity, distribution or option does not exist or has no effect, the analysis does not
            support an element of the mechanism, or the file belongs to another study.
        AnalysisError
            If the executor fails.
        Interrupted
            If the user interrupts it; its ``result`` is the study with the runs computed so far.
        """
        from .studies.study import StudyOptions, study

        return study(self, StudyOptions.from_arguments(locals()))


class SymbolicMethods(Model):
    """Symbolic equations of a mechanism, and code made of them."""

    def symbolic(
        self,
        *,
        coordinates: str = "auto",
        inputs: Sequence[str] = (),
        parameters: Mapping[str, float | str] | None = None,
        names: str = "parameters",
    ) -> Equations:
        """The equations of motion as expressions in the mechanism's own names: M, f, g, G, gamma, reactions, energies.

        The engine's own formulas are evaluated on symbols: nothing is derived a second time. Every quantity of a result
        is available: ``eq["slider.x"]``, ``eq["A.force"]``, ``eq["energy.kinetic"]``.

        Parameters
        ----------
        coordinates : {"auto", "absolute", "joint"}
            Coordinates of the equations; auto: joint coordinates, unless friction requires absolute ones.
        inputs : sequence of str
            As for `linearize`: terms added to laws of forces, motors and drivers, as symbols.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit. They remain symbols.
        names : {"parameters", "all", "none"}
            Numbers that become symbols: parameters; or every number of the description, named by its field:
            ``"rod.mass"``; or none.

        Returns
        -------
        Equations

        Raises
        ------
        ModelError
            If the mechanism has contacts or sampled controllers, or a name does not exist.
        """
        from .symbolic.derivation import symbolic
        from .symbolic.equations import SymbolicOptions

        return symbolic(self, SymbolicOptions.from_arguments(locals()))

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
        """Write the equations of motion as code: C, Python that needs NumPy only, CasADi, Numba, or as an FMU.

        Functions are straight-line code of time, state, inputs and parameters, made from the formulas that flyball
        itself uses. `Code` gives the order of their arguments.

        Parameters
        ----------
        folder : str or Path, optional
            Folder for the files; no files are written if not given.
        language : {"c", "python", "casadi", "numba", "fmu", "fmu2"}
            C99 with a header, a Python module, functions of CasADi with a module that reads them, a module of functions
            that Numba compiles, or a functional mock-up unit of FMI 3.0 (``fmu``) or 2.0 for other simulators.
        functions : sequence of str
            Functions to write, out of kinematics, velocities, T, M, f, g, nu, G, gamma, residual, right_hand_side,
            energies and, with outputs, outputs; all of them if not given.
        outputs : sequence of str
            Names of result quantities that the function ``outputs`` returns, such as ``"slider.x"``, ``"A.fx"``.
        inputs : sequence of str
            As for `linearize`: terms added to laws of forces, motors and drivers; the argument ``u``.
        coordinates : {"auto", "absolute", "joint"}
            Coordinates of the equations, as for `symbolic`.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit. They remain arguments.
        name : str
            Name of the files and prefix of names in C; the mechanism's name if not given.

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
            If CasADi is required and not installed.
        """
        from .symbolic.derivation import ExportOptions, export

        return export(self, ExportOptions.from_arguments(locals()))
