"""Records the residuals of the velocity solves of chosen steps; it takes the solver's place in the step loop."""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING

import numpy as np

from ...numerics.complementarity.solve_history import COLUMNS, solve_history
from ...results.convergence import RESIDUALS, Convergence
from ...tables.table_definitions import copied

if TYPE_CHECKING:
    from .impulse_stepper import ImpulseStepper

SOLVER_CALL = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 5, ctypes.c_int64)
SAME_TIME = 1e-9  # of a step: tolerance of the ends of a time range


class SolveRecorder:
    """Calls the solver of the velocities, and records its residuals over the iterations where they are wanted.

    The last solve of a step counts: compliant contacts need several, and a step is repeated when tables were too small.

    Parameters
    ----------
    stepper : ImpulseStepper
    wanted : "all", int or (float, float)
        All steps, every n-th step, or those that end within a time range [s].
    """

    def __init__(self, stepper: ImpulseStepper, wanted: str | int | tuple[float, float]) -> None:
        self.stepper, self.wanted = stepper, wanted
        self.histories: dict[int, tuple[float, np.ndarray]] = {}  # by the number of the step: its end, residuals
        self._callback = SOLVER_CALL(self._solve)
        self.address = int(ctypes.cast(self._callback, ctypes.c_void_p).value or 0)
        self._solver = 0
        self._error: BaseException | None = None

    def raise_error(self) -> None:
        """Raise what went wrong while a solve was recorded; compiled code cannot pass it on."""
        if self._error is not None:
            raise self._error

    def attach(self) -> None:
        """Take the solver's place; again after tables were enlarged, because they bind the solver anew."""
        addresses = self.stepper.state.addresses
        if int(addresses.velocities) != self.address:
            self._solver = int(addresses.velocities)
            addresses.velocities = self.address

    def _is_wanted(self, step: int, end: float) -> bool:
        if isinstance(self.wanted, str):
            return True
        if isinstance(self.wanted, int):
            return step % self.wanted == 0
        slack = SAME_TIME * float(self.stepper.state.times.step)
        return self.wanted[0] - slack <= end <= self.wanted[1] + slack

    def _solve(self, *words: int) -> int:
        """Solve, as the solver would: called by the step loop."""
        s, r = self.stepper, self.stepper.workspaces
        step, end = int(s.state.counts.steps_taken), float(s.state.times.now + s.state.times.step)
        try:
            if (r.P.size[0] or r.P.size[3]) and self._is_wanted(step, end):
                self.histories[step] = end, solve_history(s.solver, r.P, copied(r.X), r.O)
        except BaseException as error:  # Ctrl-C too: an exception in a callback would be lost
            self._error = error
        return int(SOLVER_CALL(self._solver)(*words))

    def convergence(self) -> Convergence:
        """Return all residuals recorded."""
        found = list(self.histories.values())
        rows = np.concatenate([np.zeros((0, COLUMNS)), *(rows for _, rows in found)])
        begin = np.cumsum([0, *(len(rows) for _, rows in found)])
        ends = np.array([end for end, _ in found])
        columns = dict(zip(("iteration", *RESIDUALS), rows.T, strict=True))
        return Convergence(ends, begin, solver=self.stepper.solver, **columns)
