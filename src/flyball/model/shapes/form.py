"""What a shape is where it touches others: one of the kinds that contact knows, or several."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

LENGTHS = {"HULL": (0,), "FIELD": (2, 3), "SOLID": (7,)}  # parameters that grow with the shape; of other kinds all do


@dataclass(frozen=True, eq=False)
class Form:
    """A convex part of a shape, of a kind that contact knows by name (`contact/kinds.py`).

    Attributes
    ----------
    kind : str
        ``"SPHERE"``, ``"BOX"``, ...; ``"MESH"`` is a closed surface, whose triangles stand in ``face``, and ``"HULL"``
        with one parameter the hull of ``vertex``: `tables/contact/solids.py` makes finished hulls of these.
    par : tuple of float
        Parameters of its kind.
    reach : float
        Radius [m] of a sphere about its origin that holds it; inf for what is unbounded.
    place : (3,)
        Its origin [m] in the shape's own frame.
    axes : (3, 3)
        Its axes (columns) in the shape's own.
    vertex : (k, 3)
        Corners [m] in its own axes, of what has them, and whatever else its kind keeps there.
    face : (l,)
        Faces of what has them: count of corners, then the corners counter-clockwise seen from outside, and so on.
    corners : int
        How many of the rows of ``vertex`` are corners; all if not given. The others do not grow with the shape.
    sides : int
        How many faces there are.
    owner : type
        The class of a ``"SOLID"``, which has its support function.
    """

    kind: str
    par: tuple[Any, ...]
    reach: Any
    place: np.ndarray = field(default_factory=lambda: np.zeros(3))
    axes: np.ndarray = field(default_factory=lambda: np.eye(3))
    vertex: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    face: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    corners: int | None = None
    sides: int = 0
    owner: type | None = None

    def carried(self, p: np.ndarray, R: np.ndarray) -> Form:
        """The same, in a frame in which the shape's own lies at p with the axes R."""
        return replace(self, place=p + R @ self.place, axes=R @ self.axes)

    def grown(self, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Parameters (n, k) and, one below the other, ``vertex`` of the same in n sizes."""
        par = np.tile(np.real(np.array(self.par, complex)), (len(sizes), 1))
        lengths = list(LENGTHS.get(self.kind, range(len(self.par))))
        par[:, lengths] *= sizes[:, None]
        vertex = np.tile(np.asarray(self.vertex, float), (len(sizes), 1, 1))
        vertex[:, : self.corners] *= sizes[:, None, None]
        return par, vertex.reshape(-1, 3)


def surface_form(surface: tuple[np.ndarray, np.ndarray]) -> Form:
    """What a closed surface, vertices (k, 3) and triangles (m, 3), is a description of; not yet in convex parts."""
    v, f = np.real(surface[0]), np.asarray(surface[1], np.int64)
    return Form("MESH", (), np.sqrt((v**2).sum(axis=1)).max(), vertex=v, face=f.ravel())
