"""Residuals of the contact solves of a motion over the iterations, step by step."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..errors import ModelError
from ..model.expressions import number

RESIDUALS = {"velocity": "m/s", "force": "1", "primal": "m/s", "complementarity": "J", "energy": "J"}


@dataclass(frozen=True, eq=False, repr=False)
class Convergence:
    """Residuals of the velocity solves of steps, over the iterations: ``run.contacts.history``.

    The rows of step ``k`` are ``begin[k]`` to ``begin[k + 1]``. Each row belongs to the impulses p with which the
    solver ends after that many iterations, and their velocities u = N p + b.

    Attributes
    ----------
    t : ndarray (n,) [s]
        Ends of the steps.
    begin : ndarray (n + 1,) of int
    iteration : ndarray (k,)
        Number of iterations; with several islands the largest of any.
    velocity : ndarray (k,) [m/s]
        Largest residual of the natural map p = P(p - s u), as a velocity.
    force : ndarray (k,)
        The same as a force: missing impulse over the largest impulse.
    primal : ndarray (k,) [m/s]
        Largest speed with which a contact would go on to overlap.
    complementarity : ndarray (k,) [J]
        Largest size of p . (u + mu u_s n) of a contact, u_s the sliding speed, which vanishes for Coulomb's law (De
        Saxce and Feng 1998); of p . u in the convex form.
    energy : ndarray (k,) [J]
        1/2 p' N p + b' p, the objective of the convex form.
    solver : str
    """

    t: np.ndarray
    begin: np.ndarray
    iteration: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    primal: np.ndarray
    complementarity: np.ndarray
    energy: np.ndarray
    solver: str = ""

    units: ClassVar[dict[str, str]] = RESIDUALS

    def __post_init__(self) -> None:
        """Refuse columns that do not fit together."""
        sizes = {len(getattr(self, name)) for name in ("iteration", *RESIDUALS)}
        if len(self.begin) != len(self.t) + 1 or sizes != {int(self.begin[-1])}:
            raise ValueError(f"convergence: columns of {sorted(sizes)} rows, {len(self.t)} steps")

    def __len__(self) -> int:
        return len(self.t)

    def __iter__(self) -> Iterator[Convergence]:
        return (self[k] for k in range(len(self)))

    def __getitem__(self, k: int) -> Convergence:
        """The residuals of the step number ``k`` of those recorded."""
        if not -len(self) <= k < len(self):
            raise IndexError(f"there are the residuals of {len(self)} steps")
        k %= len(self)
        rows = slice(int(self.begin[k]), int(self.begin[k + 1]))
        own: dict[str, Any] = {name: getattr(self, name)[rows] for name in ("iteration", *RESIDUALS)}
        return Convergence(self.t[k : k + 1], np.array([0, rows.stop - rows.start]), solver=self.solver, **own)

    def __repr__(self) -> str:
        if not len(self):
            return "<residuals of no contact solve>"
        last = float(self.velocity[np.asarray(self.begin[1:]) - 1].max())
        times = f"{self.t[0]:g} s" if len(self) == 1 else f"{len(self)} steps from {self.t[0]:g} s to {self.t[-1]:g} s"
        most = int(self.iterations.max())
        return f"<residuals of {times}, solver {self.solver}: at most {most} iterations, {last:.2g} m/s at their ends>"

    def at(self, t: float | str) -> Convergence:
        """The residuals of the recorded step that ends nearest to ``t`` [s].

        Raises
        ------
        ModelError
            If no step was recorded, or ``t`` is not a time.
        """
        t = float(number(t, {}, "s", "t"))
        if not len(self):
            raise ModelError("no step with contacts was recorded, so there are no residuals to read")
        return self[int(np.abs(self.t - t).argmin())]

    @property
    def iterations(self) -> np.ndarray:
        """Iterations of each step's solve, (n,)."""
        return self.iteration[np.asarray(self.begin[1:]) - 1].astype(int)

    def as_dict(self) -> dict[str, Any]:
        """Plain lists."""
        columns = ("t", "begin", "iteration", *RESIDUALS)
        return {"solver": self.solver} | {k: np.asarray(getattr(self, k)).tolist() for k in columns}

    def plot(self, path: str | os.PathLike | None = None, *others: Convergence) -> Any:
        """Draw all residuals over the iterations, a curve for each step.

        Parameters
        ----------
        path : path, optional
            Write a PNG, SVG or PDF file, by the suffix, instead of returning the figure.
        *others : Convergence
            Drawn beside it, such as those of other solvers.

        Returns
        -------
        Figure, or None where a file was written.
        """
        from ..view.force_plots import plot_convergence

        return plot_convergence([self, *others], path)


def concatenate_histories(every: Sequence[Convergence]) -> Convergence | None:
    """Concatenate the residuals of consecutive motions; None if there are none."""
    if not every:
        return None
    columns = {k: np.concatenate([getattr(h, k) for h in every]) for k in ("t", "iteration", *RESIDUALS)}
    begin = np.concatenate([[0], *(np.diff(h.begin) for h in every)]).cumsum()
    return Convergence(begin=begin, solver=every[0].solver, **columns)
