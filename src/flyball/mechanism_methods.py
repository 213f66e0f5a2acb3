"""The methods of `flyball.Mechanism`: signature, defaults and meaning of every analysis, written once, here.

Each hands its arguments over as one frozen object, which checks them; the analysis works with that object, and
the subcommand of the same name is made from the signature and its docstring. Analyses are imported when they are
called.

Methods run with BLAS on one thread: matrices of mechanisms are small, and threads of BLAS wait for one another
longer than they work (on a shared machine a singular value decomposition of 400 x 400 takes sixty times as long
on two).
"""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import cache, wraps
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .assembly.assembled_state import Assembly
    from .model.model import Model
    from .results.equilibrium import Equilibrium
    from .results.equilibrium_series import EquilibriumSeries
    from .results.linear_model import LinearModel
    from .results.mechanism_report import MassReport, Report
    from .results.mobility import Mobility
    from .results.modes import Modes, RootLocus
    from .results.result import Result
    from .results.singularities import Branch, Singularities
else:
    Model = object  # a mechanism is one; signatures alone load nothing


def on_one_thread(method: Callable[..., Any], *, by_scipy: bool) -> Callable[..., Any]:
    """The same with BLAS on one thread; ``by_scipy``: SciPy's will be needed, which is loaded first.

    How many threads BLAS has is a setting of the process, so it is changed by Python's main thread only, and set back
    when the method ends.
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
    """What sets the threads of NumPy's library, and of SciPy's own, if that is loaded."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas")


class MobilityMethods(Model):
    """Positions, freedoms and masses of a mechanism."""

    def assemble(self, *, t: float | str = 0.0, parameters: Mapping[str, float | str] | None = None) -> Assembly:
        """Find positions and velocities that fulfil all constraints, near those described.

        Parameters
        ----------
        t : float or str [s]
            Time at which laws of drivers are taken.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.

        Returns
        -------
        Assembly

        Raises
        ------
        AssemblyError
            If no closed position, or no consistent velocity, is found; the message names the joints that disagree and
            by how much.
        """
        from .analysis_options import AssembleOptions
        from .assembly.assemble import assemble

        o = AssembleOptions.asked(locals())
        return assemble(self, t=o.t, parameters=o.parameters)

    def check(self) -> Report:
        """Freedoms, redundant joints, assembly, mass properties and warnings, without simulating.

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
        """Freedoms by name, redundant constraints and their cures, special dimensions and singular positions.

        Parameters
        ----------
        t : float or str [s]
            Time at which the mechanism is assembled. One that cannot be is looked at in the best position found: the
            constraints that contradict one another are those that depend on one another there.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        inertia : bool
            Refuse bodies that can move without any inertia: where forces are to move them, they could not.

        Returns
        -------
        Mobility

        Raises
        ------
        ModelError
            If a body can move without any inertia and may not.
        AssemblyError
            If velocities disagree though positions do not depend on one another.
        """
        from .analysis_options import MobilityOptions
        from .mobility.mobility import mobility

        o = MobilityOptions.asked(locals())
        return mobility(self, t=o.t, parameters=o.parameters, inertia=o.inertia)

    def mass_properties(
        self, *, drawn: bool = False, parameters: Mapping[str, float | str] | None = None
    ) -> MassReport:
        """Mass, centre of mass, inertia, principal moments and axes of every body and of all together.

        Parameters
        ----------
        drawn : bool
            Where bodies are: as drawn, or (if false) after assembly at t = 0.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.

        Returns
        -------
        MassReport

        Raises
        ------
        AssemblyError
            If it cannot be assembled; as drawn it can be looked at all the same.
        """
        from .check import MassOptions, mass_properties

        return mass_properties(self, MassOptions.asked(locals()))

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

        From the assembled position the curve of positions is followed by arc length, both ways, with the driver's law
        replaced by a value of its coordinate, until that leaves the range or the curve closes. Where the driver locks
        up the curve turns back, and is followed on the other side. Other drivers stay at what they ask for at ``t``.

        Parameters
        ----------
        driver : str
            Name of the driver whose coordinate is varied.
        range : (float or str, float or str)
            From and to, of the driver's coordinate [rad] or [m], or with a unit: ``("0 deg", "360 deg")``.
        t : float or str [s]
            Time at which laws are taken.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        branch : Branch or int, optional
            Start from the singular position that this branch was found at, along it; where the mechanism is drawn in a
            singular position, the number of its branch to follow (the first if not told).
        step : float [1]
            The longest step along the curve: radians, and lengths as parts of the mechanism's.
        steps : int
            The most steps in each direction.

        Returns
        -------
        Singularities

        Raises
        ------
        ModelError
            If there is no such driver, no such branch, the range is none, or constraints restrain velocities only.
        AssemblyError
            If the mechanism cannot be assembled as described.
        MobilityError
            If freedoms are left besides the driver, or none is left to it.
        SingularityError
            If the range is not reached, saying where the mechanism locks up.
        NotConverged
            If the curve cannot be followed.
        """
        from .singularities.singularities import SingularitiesOptions, singularities

        return singularities(self, SingularitiesOptions.asked(locals()))


if TYPE_CHECKING:
    from os import PathLike

    from .kinematics.prepared import Prepared
    from .model.model import Model
    from .results.comparison import Comparison
    from .results.inverse_dynamics import InverseDynamics
    from .results.result import Result
    from .simulation.integration_options import Stepping
else:
    Model = object  # a mechanism is one; signatures alone load nothing


class MotionMethods(Model):
    """Motions of a mechanism."""

    def simulate(
        self,
        t_end: float | str,
        *,
        t_start: float | str | None = None,
        outputs: int | Sequence[float] = 501,
        parameters: Mapping[str, float | str] | None = None,
        start: Result | None = None,
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

        Tolerances are of the error of a single step, and errors of steps add up. With the default ``rtol`` of 1e-7 the
        error at the end is about 1e-6 of the motion or less (displacements and turns by their largest, speeds by the
        fastest) for motions of some ten swings or turns: more than lengths and masses are ever known to. It grows with
        the square of the time where a period is slightly off, and faster where the motion itself is sensitive to its
        start (near singular positions, in chains that fly about, at ropes that go slack), which no tolerance changes.
        Ten times the tolerance is ten times the error, and costs a quarter less.

        Parameters
        ----------
        t_end : float or str [s]
            End of the motion, such as ``10`` or ``"500 ms"``.
        t_start : float or str [s], optional
            Its start: 0 if not given; where ``start`` ended if that is.
        outputs : int or sequence of float [s]
            Number of evenly spaced output times, or the times themselves.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        start : Result, optional
            Go on from where this result ended.
        coordinates : {"auto", "absolute", "joint"}
            Those of the equations; auto: those in which a right-hand side costs less. Results do not depend on it.
        method : {"auto", "dop853", "rk45", "radau", "generalised-alpha", "variational", "impulse"} or Stepping
            ``dop853``, ``rk45``: explicit Runge-Kutta pairs, of order 8 and 5, for smooth motions. ``radau``: implicit,
            Radau IIA of order 5, for stiff springs and strong damping. ``generalised-alpha``: implicit, of order 2, at
            fixed steps (``step``), which damps what they do not resolve (``rho_inf``). ``variational``: symplectic, of
            order 2, at fixed steps, for very long runs: energy and momenta do not drift. ``impulse``, or a `Stepping`
            with choices of its own: steps of fixed length by impulses, for contact with friction. auto: ``dop853``,
            which goes from touch to touch, and ``radau`` for as long as a long motion is stiff; steps by impulses
            where bodies may touch at many places, or in ways that it does not know: ``health.method`` says which,
            from when on, and why. Or the name of a Runge-Kutta method that `elements.runge_kutta` has defined.
        rtol : float [1]
            Tolerance of the error of a step relative to the state; 1e-13 at least, 0.1 at most.
        atol : float [m, rad, m/s, rad/s], optional
            Tolerance of the error of a step where the state is small. If not given a hundredth of ``rtol``, and less
            for mechanisms smaller than a metre: that times their length [m]; never less than rounding.
        max_step : float or str [s]
            Longest step. What a law does for less than a 20 000th of the time span can go unseen: give it there.
        max_steps : int
            Steps after which the integration gives up.
        stabilization : str
            How states are kept on the constraints: ``projection`` (in every stage), ``projection-steps`` (after every
            step), ``positions`` or ``velocities`` (only these), ``partitioning`` (dependent coordinates are solved
            for), ``baumgarte``, or ``none``. `compare` shows what they do.
        alpha : float [1/s], optional
            First rate of Baumgarte's method, 10 if not given.
        beta : float [1/s], optional
            Second rate of Baumgarte's method, 10 if not given.
        specialize : bool or "auto"
            True: by code that is made for this mechanism alone: three to five times as fast, after the seconds that it
            takes to make it, once for all values of its parameters, and kept on disk. False: by the engine that serves
            every mechanism. auto: whichever takes less time; what code is there already is used. Results agree within
            the tolerance, and not to the last digit, with those of the other; ``health.engine`` says which it was.
        step : float or str [s], optional
            Steps of this width, whose errors are then not looked at; one ends early at an event, the next begins there.
            ``rtol`` is then how exactly the equations of a step are solved.
        rho_inf : float [1], optional
            Of ``generalised-alpha``: what is left of a swing after a step that is far too long for it, 0 to 1; 0.8 if
            not given. 1 damps nothing.
        checkpoint : path, optional
            Where the motion is kept while it is computed (a result file): after an interrupt or a crash, which cost a
            minute of computing at most, the same call goes on from there, to the same digits. Where the motion is
            there to its end, it is what is returned.
        progress : bool or callable
            A bar on a terminal and in a notebook from two seconds on; a callable gets the fraction done some twenty
            times a second.

        Returns
        -------
        Result

        Raises
        ------
        ModelError
            If an option makes no sense, or has no effect beside the others.
        AssemblyError
            If the start cannot be made consistent.
        SimulationError
            If the integration cannot go on; its ``result`` holds the motion up to then.
        Interrupted
            If the user interrupts it; its ``result`` holds the motion up to then.
        """
        from .simulation.checkpoints import CheckpointOptions, simulate_with_checkpoints

        return simulate_with_checkpoints(self, CheckpointOptions.asked(locals()))

    def prepare(self, *, coordinates: str = "auto", parameters: Mapping[str, float | str] | None = None) -> Prepared:
        """The equations of motion as functions of plain arrays: mass matrix, accelerations, Jacobians, poses.

        For loops of your own: controllers, estimators, planners. Analyses need it not: what is made ready for one call
        serves the next, as long as the mechanism is the same.

        Parameters
        ----------
        coordinates : {"auto", "absolute", "joint"}
            Those of the arrays; auto: those in which a right-hand side costs less.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.

        Returns
        -------
        Prepared
            It does not change, and threads may share it.

        Raises
        ------
        AssemblyError
            If the mechanism cannot be assembled.
        """
        from .kinematics.prepared import PrepareOptions, prepare

        return prepare(self, PrepareOptions.asked(locals()))

    def compare(
        self,
        t_end: float | str,
        *,
        t_start: float | str | None = None,
        outputs: int | Sequence[float] = 201,
        formulations: Sequence[str] | None = None,
        repeats: int = 5,
        parameters: Mapping[str, float | str] | None = None,
        start: Result | None = None,
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
        coordinates unless their name says otherwise. Drivers are followed by integration here, also where they leave
        no freedom. Where states are not projected they are reported as they are.

        Parameters
        ----------
        t_end : float or str [s]
            End of the motion.
        t_start : float or str [s], optional
            Its start: 0 if not given; where ``start`` ended if that is.
        outputs : int or sequence of float [s]
            Number of times at which drift and energy are looked at, or the times themselves.
        formulations : sequence of str, optional
            Names out of ``none``, ``baumgarte``, ``positions``, ``velocities``, ``projection-steps``, ``projection``,
            ``partitioning``, ``coupled matrix`` and ``joint coordinates``; all of them by default. Besides methods that
            hold motions to the constraints themselves: ``radau``, ``generalised-alpha``, ``radau index 3``,
            ``generalised-alpha index 3``, ``variational``.
        repeats : int
            Times that each is run for its cost, fewer where that takes long; 0 for none.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        start : Result, optional
            Go on from where this result ended.
        method : {"dop853", "rk45"}
            Explicit Runge-Kutta pair, of order 8 or 5.
        step : float or str [s], optional
            Width of steps of ``radau``, which chooses it by itself if none is given, and of the other methods of that
            kind, which have to be given one.
        rtol : float [1]
            Tolerance of the error of a step relative to the state.
        atol : float [m, rad, m/s, rad/s], optional
            Tolerance of the error of a step where the state is small; as for `simulate`.
        max_step : float or str [s]
            Longest step.
        max_steps : int, optional
            Steps after which a formulation is given up; twenty times those of the reference if not given.
        alpha : float [1/s], optional
            First rate of Baumgarte's method, 10 if not given.
        beta : float [1/s], optional
            Second rate of Baumgarte's method, 10 if not given.
        progress : bool or callable
            As for `simulate`.

        Returns
        -------
        Comparison
            A formulation that fails is in it too, with its message and the motion up to then.

        Raises
        ------
        AssemblyError, ModelError
            If the start cannot be made consistent; for formulations or options that do not exist.
        """
        from .studies.formulation_comparison import CompareOptions, compare

        return compare(self, CompareOptions.asked(locals()))

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
        """Positions, velocities and accelerations of a mechanism whose drivers leave no freedom.

        Parameters
        ----------
        times : int or sequence of float [s]
            Number of evenly spaced times from ``t_start`` to ``t_end``, or ascending times themselves.
        t_end : float or str [s], optional
            End of the motion; needed if ``times`` is a number.
        t_start : float or str [s], optional
            When the mechanism is assembled as drawn; it is followed from there, so that it stays on its branch and
            whole turns count. 0 if not given, or the first time where that is earlier.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        coordinates : {"auto", "absolute", "joint"}
            Those of the equations; auto: those in which a right-hand side costs less.
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
            If drivers leave a freedom (``free`` names it), or prescribe what is prescribed already (``redundant``
            names the drivers).
        SingularityError
            If the mechanism locks, or begins where drivers do not decide its motion; ``where`` is the time,
            ``elements`` those whose constraints lose their independence, ``result`` holds the motion up to there.
        AssemblyError
            If no position fulfils all constraints at the start.
        SimulationError
            If a law cannot be followed, for instance because it jumps; its ``result`` holds the motion up to there.
        """
        from .kinematics.driven_motion import KinematicsOptions, kinematics

        return kinematics(self, KinematicsOptions.asked(locals()))

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
        """Forces and torques of drives, and reactions of all joints, for a given motion.

        Drivers prescribe it, with ``motion`` if that is given. Forces act: motors too, so that a drive has to do what
        they leave to be done.

        Parameters
        ----------
        times : int or sequence of float [s]
            Number of evenly spaced times from ``t_start`` to ``t_end``, or ascending times themselves.
        motion : mapping, optional
            Coordinate (``"A.angle"``, ``"slider.x"``) or sensor of one -> how it moves [rad] or [m]: an expression such
            as ``"0.3*sin(2*t)"``; samples at ``times``; or a pair (times of samples [s], samples). Through samples goes
            a cubic spline, whose second derivative is continuous. Initial conditions then play no part.
        t_end : float or str [s], optional
            End of the motion; needed if ``times`` is a number.
        t_start : float or str [s], optional
            As for `kinematics`; with samples the motion begins with the first one.
        parameters : mapping, optional
            Values of parameters in place of the model's, in SI units or with a unit.
        coordinates : {"auto", "absolute", "joint"}
            Those of the equations; auto: those in which a right-hand side costs less.
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
            If the motion names what does not exist or cannot be driven, or its samples make no curve.
        MobilityError, SingularityError, AssemblyError, SimulationError
            As for `kinematics`.
        """
        from .kinematics.inverse_dynamics import InverseDynamicsOptions, inverse_dynamics

        return inverse_dynamics(self, InverseDynamicsOptions.asked(locals()))


class StaticsMethods(Model):
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
        from .statics.equilibrium import EquilibriumOptions, equilibrium

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
        from .statics.equilibrium_series import EquilibriaOptions, equilibria

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
        from .linear.linearize import LinearizeOptions, linearize

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
        from .linear.modes import ModesOptions, modes

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
        from .linear.root_locus import RootLocusOptions, root_locus

        return root_locus(self, RootLocusOptions.asked(locals()))


if TYPE_CHECKING:
    from concurrent.futures import Executor
    from os import PathLike

    from .model.model import Model
    from .results.result import Result
    from .results.sensitivity_and_optimum import Optimum, Sensitivity
    from .results.study import Study
    from .simulation.integration_options import Stepping
else:
    Model = object  # a mechanism is one; signatures alone load nothing


class DesignMethods(Model):
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
        from .sensitivity.sensitivity import SensitivityOptions, sensitivity

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
        from .sensitivity.optimization import OptimizeOptions, optimize

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
        from .studies.study import StudyOptions, study

        return study(self, StudyOptions.asked(locals()))


if TYPE_CHECKING:
    from pathlib import Path

    from .model.model import Model
    from .symbolic.equations import Equations
    from .symbolic.export.code import Code
else:
    Model = object  # a mechanism is one; signatures alone load nothing


class SymbolicMethods(Model):
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
        from .symbolic.derivation import symbolic
        from .symbolic.equations import SymbolicOptions

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
        from .symbolic.export.export import ExportOptions, export

        return export(self, ExportOptions.asked(locals()))
