"""Choices of a motion by steps of impulses."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

from ....errors import ModelError
from ....numerics.cone.registry import names
from ...options import count, positive, seconds

RESTITUTION = ("poisson", "newton", "moreau")
CONVEX_ONLY = ("barzilai-borwein",)
IMPACTS = ("simultaneous", "sequential")


@dataclass(frozen=True, kw_only=True)
class Stepping:
    """How a motion with contact is stepped: ``simulate(..., method=fb.Stepping(step="2 ms"))``.

    Every step solves for the velocities at its end, with all contacts and joints at once, and then moves bodies out of
    what overlap is left without giving them velocity.

    Parameters
    ----------
    step : float or str [s], optional
        Longest step; steps are shortened so that they end at the output times. If not given it is 5 ms, or
        ``max_step`` if that is less, and where compliant contacts collide steps are divided until they resolve the
        impact.
    solver : str
        Of the cone problem: ``auto`` (chosen for each island of bodies that touch), or one by name: see
        ``docs/contact_solvers.md``.
    iterations : int, optional
        Most iterations of the solve for velocities; a number that suits the solver if not given.
    position_iterations : int, optional
        Most iterations of the solve for positions; the same.
    tolerance : float [m/s]
        Residual of the velocities at which iterations stop. In very short steps it is a hundredth of the velocity that
        gravity adds in the step, where that is less.
    coulomb : bool
        Coulomb's law. If not, the convex problem that approximates it, in which what slides floats up by friction
        coefficient times sliding speed times step.
    restitution : {"poisson", "newton", "moreau"}
        Law of impacts that come together; one after the other they go by Poisson's.
    impacts : {"simultaneous", "sequential"}
        Whether what is hit at once is solved at once, or one contact after the other, the fastest first, as in Newton's
        cradle.
    """

    step: float | str | None = None
    solver: str = "auto"
    iterations: int | None = None
    position_iterations: int | None = None
    tolerance: float = 1e-5
    coulomb: bool = True
    restitution: str = "poisson"
    impacts: str = "simultaneous"

    usual: ClassVar[float] = 5e-3  # longest step [s] where none is given

    def __post_init__(self) -> None:
        if isinstance(self.step, str):
            object.__setattr__(self, "step", seconds(self.step, "step"))
        for name in ("step", "tolerance"):
            if getattr(self, name) is None:
                continue
            positive(getattr(self, name), name)
            if not math.isfinite(getattr(self, name)):
                raise ModelError(f"{name} of Stepping must be finite")
        for name in ("iterations", "position_iterations"):
            if getattr(self, name) is not None:
                count(getattr(self, name), name)
        for name, known in (("solver", names()), ("restitution", RESTITUTION), ("impacts", IMPACTS)):
            if getattr(self, name) not in known:
                raise ModelError(
                    f"unknown {name} {getattr(self, name)!r} of Stepping; choose one of {', '.join(known)}"
                )
        if self.impacts == "sequential" and self.restitution != "poisson":
            raise ModelError(
                f"impacts='sequential' of Stepping go by Poisson's law, so restitution={self.restitution!r} would do "
                f"nothing; leave one of the two out"
            )

        if self.solver in CONVEX_ONLY and self.coulomb:
            raise ModelError(
                f"solver {self.solver!r} of Stepping solves the convex problem only: give coulomb=False with it"
            )

    @property
    def longest(self) -> float:
        """The longest step [s]."""
        return self.usual if self.step is None else float(self.step)

    def bounded(self, longest: float) -> Stepping:
        """With steps of at most ``longest`` seconds; where no step is given they may still be divided."""
        if longest >= self.longest:
            return self
        made = dataclasses.replace(self, step=None if self.step is None else longest)
        object.__setattr__(made, "usual", longest)
        return made
