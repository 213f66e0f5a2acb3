"""A flat bar with round ends."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ...errors import ModelError
from ...math.vec import inner_product, matrix_product
from ..element import Direction, Length, Point, element, positive
from ..geometry import vector
from .geometry import ALIGNMENT_TOLERANCE, OBLIQUE_REMEDY, ConvexPart, arc, extrude, polygon_outline
from .rod import ends
from .solid import RESOLUTION, Solid


@element
class Link(Solid):
    """A flat bar from ``start`` to ``end`` with round ends about these points, the pins of a link.

    Its own frame has its origin in the middle, x along the bar and z along its thickness.

    Parameters
    ----------
    start, end : point [m]
        In the body's reference frame.
    width : number [m]
        Across the bar; the ends are half circles of this diameter.
    thickness : number [m]
    normal : direction
        Direction of the thickness, in the body's reference frame; only its component perpendicular to the bar is used.
        If not given: z, or x for a bar along z.
    """

    start: Point
    end: Point
    width: Length
    thickness: Length
    normal: Direction | None = None

    symmetric: ClassVar[str] = "xyz"
    points: ClassVar[tuple[str, ...]] = ("position", "start", "end")

    def check(self, n: SimpleNamespace) -> None:
        """Lengths greater than zero, two different ends and a normal that is not along the bar."""
        positive(self, n, "width", "thickness")
        super().check(n)

    def pose(self, n: SimpleNamespace) -> tuple[np.ndarray, np.ndarray]:
        """The middle, and axes along the bar, across it and along its thickness."""
        p, R = super().pose(n)
        middle, x, _ = ends(self, n)
        if n.normal is None:
            z = np.array([1.0, 0, 0] if (x[:2].real ** 2).sum() < 1e-12 else [0, 0, 1.0])
        else:
            z = vector(n.normal, False, f"normal of {self.title}", direction=True)
        z = z - inner_product(z, x) * x
        if not inner_product(z, z).real > 1e-12:
            raise ModelError(f"{self.title}: its normal {tuple(n.normal)} points along the bar; it must point across")
        z = z / np.sqrt(inner_product(z, z))
        return p + matrix_product(R, middle), matrix_product(R, np.column_stack([x, np.cross(z, x), z]))

    def volume(self, n: SimpleNamespace) -> Any:
        """V = (l w + pi r^2) t, with r = w / 2."""
        return (ends(self, n)[2] * n.width + pi * n.width**2 / 4) * n.thickness

    def gyration(self, n: SimpleNamespace) -> Any:
        """Second moments of a rectangle l x w and two half discs of radius r = w / 2 at its ends.

        A half disc has the area pi r^2 / 2 and about its diameter the moments 2 r^3 / 3 and pi r^4 / 8; its diameter
        lies l / 2 from the middle.
        """
        length, w, r = ends(self, n)[2], n.width, n.width / 2
        area = length * w + pi * r**2
        y2 = (length * w**3 / 12 + pi * r**4 / 4) / area
        x2 = (w * length**3 / 12 + length**2 * pi * r**2 / 4 + 4 / 3 * length * r**3 + pi * r**4 / 4) / area
        z2 = n.thickness**2 / 12
        return y2 + z2, x2 + z2, x2 + y2

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """The bar between the centres of its ends, and a disc about either."""
        h, r, t = ends(self, n)[2] / 2, n.width / 2, n.thickness / 2
        middle = ConvexPart("BOX", (h, r, t), np.sqrt(h * h + r * r + t * t))
        return middle, *(
            ConvexPart("CYLINDER", (r, t), np.sqrt(r * r + t * t), np.array([x, 0.0, 0.0])) for x in (-h, h)
        )

    def outlines(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Return a segment with round ends, or a rectangle if seen from the side."""
        p, R = self.pose(n)
        flat = np.hypot(*R[:2, 2]) < ALIGNMENT_TOLERANCE
        if not flat and np.sort(np.abs(R[2]))[1] < ALIGNMENT_TOLERANCE:  # from the side
            return (polygon_outline(self.mesh(n)[0]),)
        if not flat:
            raise ModelError(f"{self.title}: {OBLIQUE_REMEDY}")
        return (polygon_outline(np.array([p + s * R[:, 0] * ends(self, n)[2] / 2 for s in (-1.0, 1.0)]), n.width / 2),)

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Length between the ends' centres, width and thickness."""
        return ends(self, n)[2], n.width, n.thickness

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """The outline, extruded."""
        h, r, half = ends(self, n)[2] / 2, n.width / 2, max(fine // 2, 1)
        round_ends = arc((h, 0), r, -pi / 2, pi / 2, half), arc((-h, 0), r, pi / 2, 3 * pi / 2, half)
        return extrude(np.vstack(round_ends), n.thickness)
