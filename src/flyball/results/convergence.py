"""How far the solves of contacts went: residuals of every step, or of every iteration of one solve."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class Convergence:
    """Residuals of solves, one row each.

    Attributes
    ----------
    x : ndarray (n,)
        Time at the end of the step [s], or number of the iteration.
    velocity : ndarray (n,) [m/s]
        What is left of velocities that should vanish.
    force : ndarray (n,)
        What is left of an impulse, over the largest one.
    iterations : ndarray (n,) of int
        Iterations of each solve; of one solve's own history those up to the row.
    over : str
        What ``x`` is: ``"time"`` or ``"iteration"``.
    solver : str
        Which solver it was.
    objective : ndarray (n,) or None
        1/2 p' N p + b' p [J], of one solve's own history.
    """

    x: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    iterations: np.ndarray
    over: str = "time"
    solver: str = ""
    objective: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Refuse columns of other lengths."""
        sizes = {len(a) for a in (self.x, self.velocity, self.force, self.iterations)}
        if len(sizes) != 1 or self.over not in ("time", "iteration"):
            raise ValueError(f"convergence: columns of {sorted(sizes)} rows over {self.over!r}")

    def __len__(self) -> int:
        return len(self.x)

    def as_dict(self) -> dict[str, Any]:
        """Plain lists."""
        columns = {k: np.asarray(getattr(self, k)).tolist() for k in ("x", "velocity", "force", "iterations")}
        return {"over": self.over, "solver": self.solver} | columns

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Plot both residuals, in logarithmic scale; returns the figure, or writes it to ``path``."""
        from ..view.contacts import plot_convergence

        return plot_convergence([self], path)
