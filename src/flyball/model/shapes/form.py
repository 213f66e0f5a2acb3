"""What a shape is where it touches others: one of the kinds that contact knows, or several."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class Form:
    """A convex part of a shape, of a kind that contact knows by name (`contact/kinds.py`).

    Attributes
    ----------
    kind : str
        ``"SPHERE"``, ``"BOX"``, ...
    par : tuple of float
        Parameters of its kind.
    reach : float
        Radius [m] of a sphere about its origin that holds it; inf for what is unbounded.
    place : (3,)
        Its origin [m] in the shape's own frame.
    axes : (3, 3)
        Its axes (columns) in the shape's own.
    vertex : (k, 3)
        Corners [m] in its own axes, of what has them.
    face : (l,)
        Faces of what has them: count of corners, then the corners counter-clockwise seen from outside, and so on.
    """

    kind: str
    par: tuple[Any, ...]
    reach: Any
    place: np.ndarray = field(default_factory=lambda: np.zeros(3))
    axes: np.ndarray = field(default_factory=lambda: np.eye(3))
    vertex: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    face: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))

    def carried(self, p: np.ndarray, R: np.ndarray) -> Form:
        """The same, in a frame in which the shape's own lies at p with the axes R."""
        return Form(self.kind, self.par, self.reach, p + R @ self.place, R @ self.axes, self.vertex, self.face)
