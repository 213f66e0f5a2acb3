"""What stands on ground."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ..errors import ModelError
from .body import Shapes, listed
from .color import check_color
from .element import Angle, Element, Name, Point, element
from .geometry import orientation_matrix, rotation_about
from .orientation import Orientation
from .shapes import Solid


@element
class Ground(Element):
    """Shapes that stand still: a floor, a wall, a box without a lid.

    Parameters
    ----------
    name : str
        Of this part of ground, such as ``"floor"``.
    shape : shape or list of shapes
        What is seen, and touched where a `Contact` says so. Masses of shapes mean nothing here.
    position : point [m]
        Origin of its frame, in the world.
    angle : number [rad]
        Planar: orientation of its frame.
    orientation : quaternion (scalar first), Bryant angles (x-y-z) [rad], rotation object or 3x3 matrix
        Spatial: orientation of its frame.
    material : str
        `Material` of the shapes that name none of their own.
    color : str
        Colour in pictures.
    """

    shape: Shapes = field(kw_only=True)
    position: Point = (0.0, 0.0, 0.0)
    angle: Angle = 0.0
    orientation: Orientation | None = None
    material: Name | None = None
    color: str | None = None

    category: ClassVar[str] = "ground"

    def shapes(self) -> tuple[Solid, ...]:
        """Its shapes, as a tuple."""
        return listed(self.shape)

    def rotation(self, n: Any) -> np.ndarray:
        """Rotation matrix of its frame."""
        if n.orientation is not None:
            return orientation_matrix(n.orientation, f"orientation of {self.title}")
        return rotation_about(2, n.angle)

    def check(self, n: SimpleNamespace) -> None:
        """A shape, and nothing that has no effect on ground."""
        if self.color is not None:
            check_color(self.color, self.title)
        if not self.shapes():
            raise ModelError(f"{self.title}: it has no shape; give shape=Plane() or another")
        for s in self.shapes():
            _check_weightless(self, s)


def _check_weightless(e: Ground, s: Solid) -> None:
    for name in ("mass", "density"):
        if getattr(s, name) is not None:
            raise ModelError(f"{e.title}: {s.title} has a {name}, which means nothing on ground; leave it out")
    if s.hole:
        raise ModelError(f"{e.title}: {s.title} is a hole, which takes away mass only; leave it out")


def frame_of(e: Ground, n: SimpleNamespace) -> tuple[np.ndarray, np.ndarray]:
    """Origin and axes of its frame, in the world."""
    p = np.zeros(3)
    p[: len(n.position)] = np.real(n.position)
    return p, np.real(e.rotation(n))
