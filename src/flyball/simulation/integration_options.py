"""Options of a simulation: integrator and tolerances, impulse time stepping (`Stepping`), output times."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from ..analysis_options import AnalysisOptions, names_of, require_count, require_positive, seconds
from ..engine import stabilization
from ..errors import ModelError
from ..numerics.complementarity.solver_choice import PIVOTING_SOLVER, solver_names
from ..numerics.integrators.butcher_tableaux import tableau
from .initial_state import refuse_unknown_coordinates as known_coordinates

STABILIZATION = {
    "projection": stabilization.STAGES,
    "projection-steps": stabilization.STEPS,
    "baumgarte": stabilization.BAUMGARTE,
    "none": stabilization.NONE,
    "positions": stabilization.POSITIONS,
    "velocities": stabilization.VELOCITIES,
    "partitioning": stabilization.PARTITIONING,
}
MOST_STEPS = 10_000_000  # steps
COPIES_IN_MEMORY = 2  # copies of a motion in memory while its parts are joined
LEAST_ROW_WIDTH = 4  # numbers stored for each output time of the smallest mechanism, one hinge
SMALL_MEMORY = 2**18  # [bytes]; below this the machine's memory is not checked
DOUBLE = np.dtype(float).itemsize
DEFAULT_MEMORY = 2**36  # [bytes], where the operating system does not report the memory
BAUMGARTE_RATE = 10.0  # default rate of Baumgarte's method [1/s]
FINEST_RTOL = 1e-13  # smallest relative tolerance; rounding is larger than smaller ones
ATOL_PER_RTOL = 1e-2  # default atol relative to rtol
COARSEST_RTOL = 0.1  # largest relative tolerance with a meaningful result
LEAST_ATOL = 1e-14  # smallest default atol


@dataclass(frozen=True, kw_only=True)
class Integration(AnalysisOptions):
    """Options of an integration, as stored in the result; `Mechanism.simulate` describes them."""

    coordinates: str
    method: str
    rtol: float
    atol: float | None
    max_step: float
    max_steps: int
    stabilization: str
    alpha: float | None
    beta: float | None
    step: float | None
    rho_inf: float | None

    def __post_init__(self) -> None:
        super().__post_init__()
        own = vars(self)
        for name in ("max_step", "step"):
            if isinstance(own[name], str):
                own[name] = seconds(own[name], name)
        for name in ("rtol", "atol", "max_step", "step"):
            if own[name] is not None or name in ("rtol", "max_step"):
                require_positive(own[name], name)
        if self.step is not None and self.max_step != np.inf:
            raise ModelError("max_step has no effect with fixed steps (step=); leave one of the two out")
        require_count(self.max_steps, "max_steps")
        if self.rtol < FINEST_RTOL:
            raise ModelError(
                f"rtol must not be smaller than {FINEST_RTOL:g}, got {self.rtol!r}: rounding is larger than that"
            )
        if self.rtol > COARSEST_RTOL:
            raise ModelError(
                f"rtol must not be larger than {COARSEST_RTOL:g}, got {self.rtol!r}: every step might have this "
                "relative error"
            )
        known_coordinates(self.coordinates)
        if self.stabilization not in STABILIZATION:
            known = ", ".join(STABILIZATION)
            raise ModelError(f"unknown stabilization {self.stabilization!r}; choose one of {known}")
        self._rates()
        self.check_method()

    def check_method(self) -> None:
        """Refuse unknown integrators."""
        try:
            tableau(self.method)
        except ValueError as error:
            raise ModelError(
                f"{error}; simulate also has implicit methods (radau for stiff mechanisms), and impulse, for contact"
            ) from None
        self.refuse_without_step()

    def refuse_without_step(self) -> None:
        """Refuse a method without error estimate if no step width is given."""
        if self.step is None and not tableau(self.method).E.any():
            raise ModelError(f"method={self.method!r} does not estimate its error: give the step size, step=")

    def _rates(self) -> None:
        """Set the default rates of Baumgarte's method; refuse rates with any other stabilization."""
        for name in ("alpha", "beta"):
            value = getattr(self, name)
            if self.stabilization == "baumgarte":
                value = BAUMGARTE_RATE if value is None else value
                require_positive(value, name)
                object.__setattr__(self, name, value)
            elif value is not None:
                raise ModelError(f"{name} is a rate of stabilization='baumgarte'; with {self.stabilization!r} it has "
                                 "no effect")  # fmt: skip

    def with_tolerance(self) -> Self:
        """Return the options with the default ``atol`` if none is given."""
        return self if self.atol is not None else self.known(atol=max(ATOL_PER_RTOL * self.rtol, LEAST_ATOL))

    def choices(self) -> dict[str, Any]:
        """Return the integration options by name, without the other arguments."""
        own = vars(self)
        return {name: own[name] for name in names_of(Integration)}


def default_integration(coordinates: str, rtol: float, atol: float, max_steps: int = MOST_STEPS) -> Integration:
    """Return the options with which other analyses integrate: the default method, with projection."""
    return Integration(
        coordinates=coordinates,
        method="dop853",
        rtol=rtol,
        atol=atol,
        max_step=np.inf,
        max_steps=max_steps,
        stabilization="projection",
        alpha=None,
        beta=None,
        step=None,
        rho_inf=None,
    )


def refuse_beyond_memory(outputs: int, width: int) -> None:
    """Refuse output times, of ``width`` numbers each, that exceed the memory of this machine.

    Raises
    ------
    ModelError
        With the bytes that they take, and how many times would fit.
    """
    each = COPIES_IN_MEMORY * width * DOUBLE
    if outputs * each > SMALL_MEMORY and outputs * each > (there := _memory_of_machine()):
        raise ModelError(
            f"outputs: {outputs:,} times take {outputs * each // 2**20:,} MiB of memory or more, and this machine has "
            f"{there // 2**20:,} MiB. Give fewer output times ({there // each:,} would fill it), or simulate in parts "
            "(start=)"
        )


def _memory_of_machine() -> int:
    """Return the memory of this machine [bytes]."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # not available on Windows
        return DEFAULT_MEMORY


def _evenly_spaced(t_start: float, t_end: float, n: int) -> np.ndarray:
    """Return evenly spaced times as ``np.linspace`` does, in a third of its computing time."""
    times = np.arange(n, dtype=float)
    times *= (t_end - t_start) / (n - 1)
    times += t_start
    times[-1] = t_end
    return times


def output_times(t_start: float, t_end: float, outputs: int | Sequence[float]) -> np.ndarray:
    """Ascending output times within the interval.

    Raises
    ------
    ModelError
        If the interval is empty or not finite, or the times are not ascending within it.
    """
    if not (math.isfinite(t_start) and math.isfinite(t_end)):
        raise ModelError(f"start and end time must be finite, got {t_start} and {t_end}")
    if not t_end > t_start:
        raise ModelError(f"the end time {t_end:g} s must be later than the start time {t_start:g} s")
    if isinstance(outputs, (int, np.integer)):
        if outputs < 2:
            raise ModelError(f"outputs must be at least 2 (start and end), got {outputs}")
        refuse_beyond_memory(int(outputs), LEAST_ROW_WIDTH)
        return _evenly_spaced(t_start, t_end, int(outputs))
    try:
        times = np.asarray(outputs, float)
    except (TypeError, ValueError):
        raise ModelError(f"outputs must be a number of times, or the times [s] themselves, not {outputs!r}") from None
    if times.ndim != 1 or not len(times) or not np.isfinite(times).all() or not (np.diff(times) > 0).all():
        interval = times.ndim == 0 and 0.0 < times < t_end - t_start
        remedy = (
            f"; for one every {float(times):g} s: outputs=np.arange({t_start:g}, {t_end:g}, {float(times):g})"
            if interval
            else ""
        )
        raise ModelError(f"outputs must be a number of times, or times in ascending order{remedy}")
    if times[0] < t_start or times[-1] > t_end:
        raise ModelError(f"output times must lie between {t_start:g} s and {t_end:g} s")
    return times


RESTITUTION_LAWS = ("poisson", "newton", "moreau")
CONVEX_ONLY_SOLVERS = ("barzilai-borwein",)
ALL_STEPS = "all"  # Stepping.history
PYRAMIDS, LEAST_DIRECTIONS, DEFAULT_DIRECTIONS = ("pyramid", PIVOTING_SOLVER), 3, 8
IMPACT_ORDERS = ("simultaneous", "sequential")


@dataclass(frozen=True, kw_only=True)
class Stepping:
    """Options of impulse time stepping: ``simulate(..., method=fb.Stepping(step="2 ms"))``.

    Every step solves for the velocities at its end, with all contacts and joints together. It then removes remaining
    overlaps of bodies without changing their velocities.

    Parameters
    ----------
    step : float or str [s], optional
        Longest step; steps are shortened so that they end at the output times. If not given it is 0.05 size / speed,
        or ``max_step`` if that is less, and where compliant contacts collide steps are divided until they resolve the
        impact. The size is the median radius of the bodies that have shapes (else a tenth of the mechanism's length),
        the speed is sqrt(g size), or half the speed of the fastest body at the start if that is more: 5 ms for bodies
        of 0.1 m. ``run.health.contact`` states it.
    solver : str
        Solver of the cone problem: ``auto`` (chosen for each island of bodies in contact), or one by name: see
        ``docs/contact_solvers.md``.
    iterations : int, optional
        Largest number of iterations of the velocity solve; by default it depends on the solver.
    position_iterations : int, optional
        Largest number of iterations of the position solve; by default it depends on the solver.
    tolerance : float [m/s], optional
        Residual of the velocities at which iterations stop; 1e-5 of that speed if not given. In very short steps it is
        a hundredth of the velocity that gravity adds in the step, where that is less.
    directions : int, optional
        Number of edges of the friction pyramid of ``solver="pyramid"`` and ``"lcp"``, at least 3; 8 if not given.
    coulomb : bool
        Whether to use Coulomb's law. If not, the convex approximation is solved, in which sliding bodies separate by
        friction coefficient times sliding speed times step.
    restitution : {"poisson", "newton", "moreau"}
        Law of simultaneous impacts; sequential impacts use Poisson's law.
    impacts : {"simultaneous", "sequential"}
        Whether simultaneous impacts are solved together, or one contact after the other, the fastest first, as in
        Newton's cradle.
    history : "all", int or (float, float) [s], optional
        Steps whose residuals over the iterations are kept in ``run.contacts.history``: all, every n-th, or those that
        end within a range of time. The motion does not change; each such solve is repeated with fewer iterations.
    threads : int, optional
        Number of threads that share the contacts of 2000 and more free bodies. The results are the same to the last bit
        for any number. If not given: the environment variable ``OMP_NUM_THREADS``, or the number of cores that the
        process may use; one in a study, which runs in threads of its own.
    """

    step: float | str | None = None
    solver: str = "auto"
    iterations: int | None = None
    position_iterations: int | None = None
    tolerance: float | None = None
    directions: int | None = None
    coulomb: bool = True
    restitution: str = "poisson"
    impacts: str = "simultaneous"
    history: str | int | tuple[float, float] | None = None
    threads: int | None = None

    limit: ClassVar[float] = math.inf  # of the default step [s]: max_step

    def __post_init__(self) -> None:
        if isinstance(self.step, str):
            object.__setattr__(self, "step", seconds(self.step, "step"))
        for name in ("step", "tolerance"):
            if getattr(self, name) is None:
                continue
            require_positive(getattr(self, name), name)
            if not math.isfinite(getattr(self, name)):
                raise ModelError(f"{name} of Stepping must be finite")
        for name in ("iterations", "position_iterations", "threads"):
            if getattr(self, name) is not None:
                require_count(getattr(self, name), name)
        for name, known in (("solver", solver_names()), ("restitution", RESTITUTION_LAWS), ("impacts", IMPACT_ORDERS)):
            if getattr(self, name) not in known:
                raise ModelError(
                    f"unknown {name} {getattr(self, name)!r} of Stepping; choose one of {', '.join(known)}"
                )
        if self.impacts == "sequential" and self.restitution != "poisson":
            raise ModelError(
                f"impacts='sequential' of Stepping uses Poisson's law, so restitution={self.restitution!r} has no "
                "effect; leave one of the two out"
            )
        self._check_history()
        if self.directions is not None and self.solver not in PYRAMIDS:
            which = " and ".join(f"solver={name!r}" for name in PYRAMIDS)
            raise ModelError(f"directions of Stepping is for {which}, not {self.solver!r}; leave it out")
        if self.directions is not None:
            require_count(self.directions, "directions", LEAST_DIRECTIONS)
        if self.solver in PYRAMIDS and not self.coulomb:
            raise ModelError(f"solver {self.solver!r} of Stepping solves Coulomb's law on a pyramid: leave coulomb out")
        for name in ("iterations", "position_iterations", "tolerance", "history"):
            if self.solver == PIVOTING_SOLVER and getattr(self, name) is not None:
                raise ModelError(
                    f"solver {self.solver!r} of Stepping finds the solution by pivoting, without a limit of its "
                    f"accuracy: leave {name} out"
                )
        if self.solver in CONVEX_ONLY_SOLVERS and self.coulomb:
            raise ModelError(
                f"solver {self.solver!r} of Stepping solves the convex problem only: give coulomb=False with it"
            )

    def _check_history(self) -> None:
        """Check the choice of steps whose residuals are kept."""
        x: Any = self.history
        if x is None or x == ALL_STEPS or (isinstance(x, int) and not isinstance(x, bool) and x > 0):
            return
        times = [seconds(t, "history") for t in x] if isinstance(x, (tuple, list)) else []
        if len(times) != 2 or not times[0] <= times[1]:
            raise ModelError(
                f"history of Stepping is {x!r}; give {ALL_STEPS!r}, a number n (every n-th step), or a range of time "
                "(from, to)"
            )
        object.__setattr__(self, "history", tuple(times))

    def refuse_history_outside(self, start: float, end: float) -> None:
        """Refuse a range of ``history`` in which a motion has no steps."""
        if isinstance(self.history, tuple) and not (self.history[0] <= end and start < self.history[1]):
            raise ModelError(
                f"history of Stepping is from {self.history[0]:g} s to {self.history[1]:g} s, and the motion from "
                f"{start:g} s to {end:g} s: no step of it is in that range"
            )

    def bounded(self, longest: float) -> Stepping:
        """Return the options with steps of at most ``longest`` seconds; default steps may still be divided."""
        if self.step is not None:
            return dataclasses.replace(self, step=min(float(self.step), longest))
        made = dataclasses.replace(self)
        object.__setattr__(made, "limit", longest)
        return made
