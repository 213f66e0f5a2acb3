"""Solids: what a body looks like and, with a density or a mass, how it is loaded.

Inertia formulas of homogeneous solids about their centres of mass: any textbook, e.g. Meriam and Kraige, *Dynamics*.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from math import pi
from types import SimpleNamespace
from typing import Annotated, ClassVar

import numpy as np

from .element import Element, Length, Numbers, Point, Unit, element, positive
from .geometry import orientation_matrix, vector

Orientation = Annotated[Numbers, Unit("rad")]


@dataclass(frozen=True)
class Solid(Element):
    """A homogeneous solid placed on a body: its own centre at ``position``, its z axis turned by ``orientation``."""

    name: str = ""
    _: KW_ONLY
    position: Point = (0.0, 0.0, 0.0)
    orientation: Orientation = (1.0, 0.0, 0.0, 0.0)

    category: ClassVar[str] = "shapes"

    def check(self, n: SimpleNamespace) -> None:
        """Every length must be greater than zero."""
        lengths = [k for k in ("radius", "length", "height") if hasattr(n, k)]
        positive(self, n, *lengths)

    def volume(self, n: SimpleNamespace) -> float:
        """Volume [m^3]."""
        raise NotImplementedError

    def gyration(self, n: SimpleNamespace) -> tuple[float, float, float]:
        """Principal inertias per unit mass [m^2] about the centre of mass, along the solid's own axes."""
        raise NotImplementedError

    def centre(self, n: SimpleNamespace) -> float:
        """Height of the centre of mass above the solid's own origin, along its z axis [m]."""
        return 0.0

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Numbers for drawing it."""
        raise NotImplementedError

    def pose(self, n: SimpleNamespace) -> tuple[np.ndarray, np.ndarray]:
        """Origin and axes in the body's reference frame."""
        where = f"{type(self).__name__} shape"
        return vector(n.position, False, f"position of {where}"), orientation_matrix(n.orientation, where)


@element
class Box(Solid):
    """A box with edges ``size`` = (x, y, z) [m]."""

    edges: Point = (1.0, 1.0, 1.0)

    def check(self, n: SimpleNamespace) -> None:
        """Three edges greater than zero."""
        from ..errors import ModelError

        if len(n.edges) != 3 or not all(x > 0 for x in n.edges):
            raise ModelError(f"Box: edges must be three lengths greater than 0, got {n.edges}")

    def volume(self, n: SimpleNamespace) -> float:
        """V = x y z."""
        x, y, z = n.edges
        return x * y * z

    def gyration(self, n: SimpleNamespace) -> tuple[float, float, float]:
        """(y^2 + z^2) / 12 and so on."""
        x, y, z = n.edges
        return (y * y + z * z) / 12, (x * x + z * z) / 12, (x * x + y * y) / 12

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """The edges."""
        return tuple(n.edges)


@element
class Sphere(Solid):
    """A ball of the given ``radius`` [m]."""

    radius: Length = 1.0

    def volume(self, n: SimpleNamespace) -> float:
        """V = 4/3 pi r^3."""
        return 4 / 3 * pi * n.radius**3

    def gyration(self, n: SimpleNamespace) -> tuple[float, float, float]:
        """2/5 r^2."""
        k = 0.4 * n.radius**2
        return k, k, k

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """The radius."""
        return (n.radius,)


@element
class Cylinder(Solid):
    """A cylinder of ``radius`` and ``length`` [m] along its z axis, its centre at its origin."""

    radius: Length = 1.0
    length: Length = 1.0

    def volume(self, n: SimpleNamespace) -> float:
        """V = pi r^2 l."""
        return pi * n.radius**2 * n.length

    def gyration(self, n: SimpleNamespace) -> tuple[float, float, float]:
        """(3 r^2 + l^2) / 12 across, r^2 / 2 along."""
        k = (3 * n.radius**2 + n.length**2) / 12
        return k, k, n.radius**2 / 2

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Radius and length."""
        return n.radius, n.length


@element
class Capsule(Cylinder):
    """A cylinder of ``radius`` and ``length`` [m] along its z axis with a half ball on either end."""

    def volume(self, n: SimpleNamespace) -> float:
        """V = pi r^2 l + 4/3 pi r^3."""
        return pi * n.radius**2 * (n.length + 4 / 3 * n.radius)

    def gyration(self, n: SimpleNamespace) -> tuple[float, float, float]:
        """Cylinder and two half balls, each moved by the parallel axis theorem."""
        r, length = n.radius, n.length
        rod, balls = length / (length + 4 / 3 * r), 4 / 3 * r / (length + 4 / 3 * r)
        across = rod * (3 * r**2 + length**2) / 12 + balls * (0.4 * r**2 + length**2 / 4 + 3 / 8 * length * r)
        return across, across, rod * r**2 / 2 + balls * 0.4 * r**2


@element
class Cone(Solid):
    """A cone of base ``radius`` and ``height`` [m]: base at its origin, tip at +z."""

    radius: Length = 1.0
    height: Length = 1.0

    def volume(self, n: SimpleNamespace) -> float:
        """V = pi r^2 h / 3."""
        return pi * n.radius**2 * n.height / 3

    def gyration(self, n: SimpleNamespace) -> tuple[float, float, float]:
        """3/20 r^2 + 3/80 h^2 across, 3/10 r^2 along."""
        k = 0.15 * n.radius**2 + 0.0375 * n.height**2
        return k, k, 0.3 * n.radius**2

    def centre(self, n: SimpleNamespace) -> float:
        """A quarter of the height."""
        return n.height / 4

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Radius and height."""
        return n.radius, n.height


@element
class Ellipsoid(Solid):
    """An ellipsoid with the given ``semi_axes`` = (a, b, c) [m]."""

    semi_axes: Point = (1.0, 1.0, 1.0)

    def check(self, n: SimpleNamespace) -> None:
        """Three semi-axes greater than zero."""
        from ..errors import ModelError

        if len(n.semi_axes) != 3 or not all(x > 0 for x in n.semi_axes):
            raise ModelError(f"Ellipsoid: semi_axes must be three lengths greater than 0, got {n.semi_axes}")

    def volume(self, n: SimpleNamespace) -> float:
        """V = 4/3 pi a b c."""
        a, b, c = n.semi_axes
        return 4 / 3 * pi * a * b * c

    def gyration(self, n: SimpleNamespace) -> tuple[float, float, float]:
        """(b^2 + c^2) / 5 and so on."""
        a, b, c = n.semi_axes
        return (b * b + c * c) / 5, (a * a + c * c) / 5, (a * a + b * b) / 5

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """The semi-axes."""
        return tuple(n.semi_axes)
