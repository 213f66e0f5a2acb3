"""Eigenvalues over values of a parameter of the model."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from .growth import beyond_axis


class Crossing(NamedTuple):
    """Where stability changes: eigenvalues pass from one half plane into the other.

    Attributes
    ----------
    value : float
        The parameter's.
    eigenvalue : complex [1/s]
        On the imaginary axis; of a pair the upper one.
    kind : str
        ``"flutter"`` where oscillations begin to grow or cease to, ``"divergence"`` at zero.
    change : int
        How many eigenvalues more have a positive real part beyond it.
    """

    value: float
    eigenvalue: complex
    kind: str
    change: int


@dataclass(repr=False)
class RootLocus:
    """Eigenvalues of the linear equations over values of a parameter.

    Attributes
    ----------
    parameter : str
    values : ndarray (m,)
    eigenvalues : ndarray (m, n) complex [1/s]
        Each column is a branch, followed by eigenvalues and shapes; parts that are rounding are 0.
    crossings : list of Crossing
        Every change of stability between the values, found to rounding, not interpolated.
    path_values, path : ndarray (p,), (p, n) complex
        The same branches with the values that were added where something happens, as they are drawn.
    seen_from : tuple of str
        Frames from which motions along it are steady, in words; empty at rest.
    """

    name: str
    parameter: str
    values: np.ndarray
    eigenvalues: np.ndarray
    crossings: list[Crossing] = field(default_factory=list)
    path_values: np.ndarray = field(default_factory=lambda: np.zeros(0))
    path: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), complex))
    seen_from: tuple[str, ...] = ()

    @property
    def unstable(self) -> np.ndarray:
        """How many eigenvalues have a positive real part, (m,)."""
        return (beyond_axis(self.eigenvalues) > 0).sum(axis=1)

    def lines(self) -> list[tuple[str, str]]:
        """A table for people."""
        out = [(self.parameter, f"{'unstable':>8}  largest real part [1/s], with imaginary part [rad/s]")]
        for value, w, n in zip(self.values, self.eigenvalues, self.unstable, strict=True):
            top = max(w, key=lambda x: (x.real, x.imag)) if len(w) else 0j
            out.append((f"{value:.6g}", f"{n:8d}  {top.real:.6g}, {abs(top.imag):.6g}"))
        for c in self.crossings:
            at = f"{self.parameter} = {c.value:.9g}, imaginary part {c.eigenvalue.imag:.6g} rad/s"
            now = f"{abs(c.change)} {'more' if c.change > 0 else 'fewer'} unstable"
            out.append(("stability changes", f"{at}: {c.kind}, {now}"))
        out += [("seen from", text) for text in self.seen_from]
        return out

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        return {
            "name": self.name,
            "parameter": self.parameter,
            "values": self.values.tolist(),
            "eigenvalues": [[[float(x.real), float(x.imag)] for x in row] for row in self.eigenvalues],
            "crossings": [c._asdict() | {"eigenvalue": [c.eigenvalue.real, c.eigenvalue.imag]} for c in self.crossings],
            "unstable": self.unstable.tolist(),
            "seen_from": list(self.seen_from),
        }

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Branches in the complex plane; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.linear import root_locus

        title = f"{self.name}: eigenvalues over {self.parameter}"
        return root_locus(self.path, self.path_values, self.parameter, title, path, known=self.crossings)

    def __repr__(self) -> str:
        return "\n".join(f"{a:>18}  {b}" for a, b in self.lines())
