"""Eigenvalues and shapes at one value of a parameter, and which of them go on as which at another.

Branches are told by their shapes as much as by their eigenvalues: two that pass each other keep theirs. Shapes are
compared as changes of all positions and velocities (the modal assurance criterion: Allemang and Brown 1982), so that it
does not matter which coordinates the equations are reduced to at each value.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...results.growth import beyond_axis
from .free import Free
from .reduced import Frame, Reduced
from .spectrum import spectrum


@dataclass
class Sample:
    """Eigenvalues at a place along the values of a parameter.

    Attributes
    ----------
    place : float
        Index in the values; between two a fraction.
    value : float
        The parameter's.
    w, raw : ndarray (n,) complex
        Eigenvalues without what is rounding, and as computed.
    shapes : ndarray (2 nv, n) complex
        Unit vectors of changes of positions and velocities in natural units.
    told : str
        The frame that they are seen from.
    """

    place: float
    value: float
    w: np.ndarray
    raw: np.ndarray
    shapes: np.ndarray
    told: str

    @cached_property
    def kinds(self) -> np.ndarray:
        """Where each eigenvalue lies: ``"zero"``, ``"+real"``, ``"-real"``, ``"axis"``, ``"+pair"``, ``"-pair"``, (n,).

        ``""`` stands for the lower one of a pair.
        """
        w = self.w
        real = beyond_axis(w)
        alone = np.where(real > 0, "+real", "-real")
        pair = np.where(real > 0, "+pair", np.where(real < 0, "-pair", "axis"))
        return np.where(w == 0.0, "zero", np.where(w.imag == 0.0, alone, np.where(w.imag > 0.0, pair, "")))

    @cached_property
    def sides(self) -> np.ndarray:
        """Which half plane each eigenvalue lies in, (n,): 1, -1, or 0 for the axis."""
        return beyond_axis(self.w)

    @cached_property
    def counts(self) -> dict[str, int]:
        """How many eigenvalues, one of each pair, lie where."""
        names, n = np.unique(self.kinds[self.kinds != ""], return_counts=True)
        return dict(zip(names.tolist(), n.tolist(), strict=True))

    @property
    def growing(self) -> int:
        """How many eigenvalues have a positive real part."""
        return self.counts.get("+real", 0) + 2 * self.counts.get("+pair", 0)


def sample(place: float, value: float, f: Free, frame: Frame, r: Reduced) -> Sample:
    """Eigenvalues and shapes of reduced linear equations."""
    own = spectrum(r.A, r.doubt)
    n = len(r.A)
    fast = float(np.abs(own.values).max(initial=0.0)) or 1.0
    shapes = np.vstack([r.position[:, :n] / f.scale[:, None], r.velocity[:, :n] / f.scale[:, None] / fast])
    shapes = shapes @ own.vectors
    shapes /= np.maximum(np.linalg.norm(shapes, axis=0), 1e-300)
    return Sample(place, value, own.values, own.raw, shapes, frame.told)


def match(a: Sample, b: Sample) -> np.ndarray:
    """Indices (n,) of b's eigenvalues that a's go on as."""
    from scipy.optimize import linear_sum_assignment

    size = np.abs(a.w)[:, None] + np.abs(b.w)
    apart = np.abs(a.w[:, None] - b.w) / np.where(size > 0.0, size, 1.0)
    alike = np.abs(a.shapes.conj().T @ b.shapes) ** 2
    return linear_sum_assignment(apart + 1.0 - alike)[1]
