"""Motions: simulated, compared by formulation, prescribed by drivers, and what drives must do for them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from os import PathLike

    from ..analysis.motion.impulse.settings import Stepping
    from ..analysis.prepared import Prepared
    from ..model.model import Model
    from ..results.comparison import Comparison
    from ..results.inverse import InverseDynamics
    from ..results.result import Result
else:
    Model = object  # a mechanism is one; signatures alone load nothing


class Motions(Model):
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
        from ..analysis.checkpointed import CheckpointOptions, checkpointed

        return checkpointed(self, CheckpointOptions.asked(locals()))

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
        from ..analysis.prepared import PrepareOptions, prepare

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
        from ..analysis.compare import CompareOptions, compare

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
        from ..analysis.kinematics import KinematicsOptions, kinematics

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
        from ..analysis.inverse_dynamics import InverseDynamicsOptions, inverse_dynamics

        return inverse_dynamics(self, InverseDynamicsOptions.asked(locals()))
