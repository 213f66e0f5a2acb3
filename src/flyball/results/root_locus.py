"""Eigenvalues over values of a parameter of the model."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

STILL = 1e-7  # part of the largest eigenvalue below which growth is rounding


class Crossing(NamedTuple):
    """Where an eigenvalue crosses the imaginary axis."""

    value: float
    eigenvalue: complex


@dataclass(repr=False)
class RootLocus:
    """Eigenvalues of the linear equations over values of a parameter.

    Attributes
    ----------
    parameter : str
    values : ndarray (m,)
    eigenvalues : ndarray (m, n) complex [1/s]
        Each column is a branch.
    crossings : list of Crossing
        Values at which an eigenvalue passes from one half plane into the other, of a pair the upper one; found to
        rounding, not interpolated.
    """

    name: str
    parameter: str
    values: np.ndarray
    eigenvalues: np.ndarray
    crossings: list[Crossing] = field(default_factory=list)

    @property
    def unstable(self) -> np.ndarray:
        """How many eigenvalues have a positive real part, (m,)."""
        largest = np.abs(self.eigenvalues).max(initial=0.0)
        return (self.eigenvalues.real > STILL * largest).sum(axis=1)

    def lines(self) -> list[tuple[str, str]]:
        """A table for people."""
        out = [(self.parameter, f"{'unstable':>8}  largest real part [1/s], with imaginary part [rad/s]")]
        for value, w, n in zip(self.values, self.eigenvalues, self.unstable, strict=True):
            top = max(w, key=lambda x: (x.real, x.imag)) if len(w) else 0j
            out.append((f"{value:.6g}", f"{n:8d}  {top.real:.6g}, {abs(top.imag):.6g}"))
        for c in self.crossings:
            at = f"{self.parameter} = {c.value:.9g}, imaginary part {c.eigenvalue.imag:.6g} rad/s"
            out.append(("stability changes", at))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        return {
            "name": self.name,
            "parameter": self.parameter,
            "values": self.values.tolist(),
            "eigenvalues": [[[float(x.real), float(x.imag)] for x in row] for row in self.eigenvalues],
            "crossings": [
                {"value": c.value, "eigenvalue": [c.eigenvalue.real, c.eigenvalue.imag]} for c in self.crossings
            ],
        }

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Branches in the complex plane; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.linear import root_locus

        title = f"{self.name}: eigenvalues over {self.parameter}"
        return root_locus(self.eigenvalues, self.values, self.parameter, title, path, known=self.crossings)

    def __repr__(self) -> str:
        return "\n".join(f"{a:>18}  {b}" for a, b in self.lines())
