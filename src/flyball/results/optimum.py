"""What an optimisation found."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .numbers import plain


@dataclass
class Optimum:
    """Parameters that fit best.

    Attributes
    ----------
    parameters : dict
        The best values, in SI units; use them as ``parameters=`` of any analysis.
    start : dict
        Where the search began.
    cost : float
        Half the sum of squares, or the value of the function that was minimised.
    start_cost : float
    success : bool
    message : str
        Why the search ended.
    evaluations : int
        Analyses that were made.
    of, units : tuple of str
        The quantities, and their units.
    t : ndarray (n,) [s]
    values, start_values : ndarray (n, of)
        The quantities at the optimum, and where the search began.
    target : ndarray (n, of) or None
        What they should be; None where a function was minimised.
    at_bound : tuple of str
        Parameters that ended at one of their bounds.
    """

    parameters: dict[str, float]
    start: dict[str, float]
    cost: float
    start_cost: float
    success: bool
    message: str
    evaluations: int
    of: tuple[str, ...]
    t: np.ndarray
    values: np.ndarray = field(repr=False)
    at_bound: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    start_values: np.ndarray | None = field(default=None, repr=False)
    target: np.ndarray | None = field(default=None, repr=False)

    def lines(self) -> list[tuple[str, str]]:
        """A table for people."""
        out = [("found" if self.success else "stopped", self.message)]
        out.append(("cost", f"{self.start_cost:.6g} at the start, {self.cost:.6g} now"))
        for name, value in self.parameters.items():
            note = ", at its bound" if name in self.at_bound else ""
            out.append(("parameter", f"{name}: {self.start[name]:.8g} -> {value:.8g}{note}"))
        return [*out, ("analyses", str(self.evaluations))]

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        kept = ("parameters", "start", "cost", "start_cost", "success", "message", "evaluations")
        out = {k: getattr(self, k) for k in kept} | {"at_bound": list(self.at_bound), "t": self.t.tolist()}
        parts = {"values": self.values, "start_values": self.start_values, "target": self.target}
        columns = {
            k: None if v is None else {n: plain(v[:, i]) for i, n in enumerate(self.of)} for k, v in parts.items()
        }
        return out | {"units": dict(zip(self.of, self.units, strict=False))} | columns

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """The quantities where the search began, at the optimum, and the target; the figure, or written to ``path``."""
        from ..view.optimum import optimum

        return optimum(self, path)

    def __repr__(self) -> str:
        return "\n".join(f"{a}: {b}" for a, b in self.lines())
