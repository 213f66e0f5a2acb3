"""Points, directions and orientations as users write them, moved, turned and reflected.

A component may be a number, a quantity or an expression of parameters: results are numbers where all parts are, else
expressions, so that a part placed elsewhere still depends on its parameters.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import ModelError
from .expressions import is_number_text, number
from .geometry import matrix_to_quaternion, orientation_matrix, rotation_about
from .names import is_plain

AXES = "xyz"
EXACT = 1e-15  # entries of a rotation that differ by less from 0, 1 or -1 are these
Written = Any
"""A number, or a text that is a quantity or an expression."""


def _plain(x: Written) -> Written:
    """Return a quantity as a number in SI units; numbers and expressions as they are."""
    return number(x, {}, None, repr(x)) if isinstance(x, str) and is_number_text(x) else x


def _enclosed(text: str) -> str:
    """Return an expression in parentheses, unless it is a name."""
    return text if is_plain(text) else f"({text})"


def scaled(factor: float, x: Written) -> Written:
    """Return a number, quantity or expression times a number."""
    if factor == 1.0:
        return x
    x = _plain(x)
    if not isinstance(x, str):
        return factor * x + 0.0
    return f"-{_enclosed(x)}" if factor == -1.0 else f"{factor!r}*{_enclosed(x)}"


def total(*terms: Written) -> Written:
    """Return the sum of numbers, quantities and expressions."""
    given = [x for x in terms if isinstance(x, str) or x != 0.0]
    if len(given) < 2:
        return given[0] if given else 0.0
    plain = [_plain(x) for x in given]
    constant = sum(x for x in plain if not isinstance(x, str))
    texts = [_enclosed(x) for x in plain if isinstance(x, str)]
    if not texts:
        return constant
    return " + ".join(texts + [repr(float(constant))] * (constant != 0.0))


def product(matrix: np.ndarray, values: Sequence[Written]) -> tuple[Written, ...]:
    """Return a matrix times a vector of two (in the plane) or three components, as many as were given."""
    n = len(values)
    rows = (zip(row[:n], values, strict=True) for row in matrix[:n].tolist())
    return tuple(total(*(scaled(a, x) for a, x in row if a != 0.0)) for row in rows)


def _times(a: Written, b: Written) -> Written:
    if isinstance(a, str) and isinstance(b, str):
        return f"{_enclosed(a)}*{_enclosed(b)}"
    return scaled(b, a) if isinstance(a, str) else scaled(a, b) if a != 0.0 else 0.0


def _quaternion_product(a: Sequence[Written], b: Sequence[Written]) -> tuple[Written, ...]:
    places = (
        ((0, 0, 1), (1, 1, -1), (2, 2, -1), (3, 3, -1)),
        ((0, 1, 1), (1, 0, 1), (2, 3, 1), (3, 2, -1)),
        ((0, 2, 1), (2, 0, 1), (3, 1, 1), (1, 3, -1)),
        ((0, 3, 1), (3, 0, 1), (1, 2, 1), (2, 1, -1)),
    )
    return tuple(total(*(scaled(float(s), _times(a[i], b[j])) for i, j, s in row)) for row in places)


def _quaternion(values: Sequence[Written]) -> tuple[Written, ...]:
    """Return an orientation, a quaternion or Bryant angles, as a quaternion."""
    plain = [_plain(x) for x in values]
    if not any(isinstance(x, str) for x in plain):
        return tuple(matrix_to_quaternion(orientation_matrix(plain, "orientation")).tolist())
    if len(plain) == 4:
        return tuple(plain)
    out: tuple[Written, ...] = (1.0, 0.0, 0.0, 0.0)
    for k, x in enumerate(plain):
        half = f"0.5*({x})" if isinstance(x, str) else 0.5 * x
        turn: list[Written] = [0.0] * 4
        turn[0] = f"cos({half})" if isinstance(half, str) else float(np.cos(half))
        turn[k + 1] = f"sin({half})" if isinstance(half, str) else float(np.sin(half))
        out = _quaternion_product(out, turn)
    return out


@dataclass(frozen=True)
class Placement:
    """A reflection at a coordinate plane, then a rotation, then a translation: x -> t + Q S x.

    The frame of a moved body has the axes Q S R S: a point that has the components r in the body's frame has S r in
    the frame of the body's image, and the inertia J becomes S J S.

    Attributes
    ----------
    translation : (3,) numbers or texts [m]
    rotation : (3, 3) array
        Q.
    mirror : str
        ``"x"``, ``"y"`` or ``"z"``: the coordinate that changes its sign; empty for none.
    """

    translation: tuple[Written, ...] = (0.0, 0.0, 0.0)
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    mirror: str = ""

    @property
    def reflection(self) -> np.ndarray:
        """Return S."""
        return np.diag([-1.0 if a == self.mirror else 1.0 for a in AXES])

    @property
    def sign(self) -> float:
        """Return the determinant of S: -1 for a reflection."""
        return -1.0 if self.mirror else 1.0

    @property
    def turned(self) -> bool:
        """Return whether directions change other than by a reflection."""
        return bool((self.rotation != np.eye(3)).any())

    @property
    def local(self) -> Placement:
        """Return the reflection alone, which transforms what is fixed in a body's frame."""
        return Placement(mirror=self.mirror)

    @property
    def polar(self) -> np.ndarray:
        """Return Q S, which transforms directions, velocities and forces."""
        return self.rotation @ self.reflection

    @property
    def axial(self) -> np.ndarray:
        """Return det(S) Q S, which transforms angular velocities, torques and axes of rotation."""
        return self.sign * self.polar

    @property
    def angle(self) -> float:
        """Return the angle of a rotation about z."""
        return float(np.arctan2(self.rotation[1, 0], self.rotation[0, 0]))

    def points(self, value: Any) -> Any:
        """Return a point, or a list of points."""
        if any(isinstance(x, tuple) for x in value):
            return tuple(self.points(x) for x in value)
        moved = product(self.polar, value)
        return tuple(total(x, t) for x, t in zip(moved, self.translation, strict=False))

    def directions(self, value: Any, axial: bool = False) -> Any:
        """Return a direction or another vector, or a list of these."""
        if any(isinstance(x, tuple) for x in value):
            return tuple(self.directions(x, axial) for x in value)
        return product(self.axial if axial else self.polar, value)

    def orientation(self, value: Sequence[Written] | None) -> tuple[Written, ...] | None:
        """Return an orientation R as Q S R S; None is the identity."""
        if value is not None and self.mirror:
            signs = [-x for x in np.diag(self.reflection).tolist()]
            value = tuple(scaled(s, x) for s, x in zip([1.0, *signs][-len(value) :], value, strict=True))
        if not self.turned:
            return None if value is None else tuple(value)
        turn = tuple(matrix_to_quaternion(self.rotation).tolist())
        return turn if value is None else _quaternion_product(turn, _quaternion(value))

    def plane_angle(self, value: Written) -> Written:
        """Return an angle of a frame in the plane."""
        return total(scaled(self.sign, value), self.angle)


def turned_over(value: Sequence[Written], axis: str) -> tuple[Written, ...]:
    """Return an orientation turned by half a turn about an axis of its own."""
    half = [0.0] * 4
    half[AXES.index(axis) + 1] = 1.0
    return _quaternion_product(_quaternion(value), half)


def rotation_of(orientation: Any, angle: Any, what: str) -> np.ndarray:
    """Return the rotation matrix of an orientation in space or an angle in the plane, exact for quarter turns.

    Raises
    ------
    ModelError
        If it depends on parameters, or is no orientation.
    """
    written = (angle,) if orientation is None else orientation
    try:
        values = [number(x, {}, "rad", what) for x in written]
    except ModelError as error:
        raise ModelError(f"{error}; give numbers here: a rotation does not follow parameters") from None
    R = rotation_about(2, values[0]) if orientation is None else orientation_matrix(values, what)
    for i, j in itertools.product(range(3), range(3)):
        if abs(R[i, j] - round(R[i, j])) < EXACT:
            R[i, j] = round(R[i, j])
    return R
