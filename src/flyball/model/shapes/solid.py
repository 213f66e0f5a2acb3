"""Base classes of shapes: pose, volume, centre of mass, inertia, collision geometry, surface for display."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ...errors import ModelError
from ...math.vec import matrix_product
from ..element import Density, Element, Flag, Mass, Name, Point, positive
from ..geometry import Orientation, orientation_matrix, vector
from ..placement import Placement, turned_over
from .geometry import ConvexPart, arc, lathe, snapped_to_axis


def three_lengths(solid: Solid, field: str, value: Any) -> None:
    """Refuse anything but three lengths greater than zero."""
    if len(value) != 3 or any(isinstance(x, tuple) or not x.real > 0 for x in value):
        raise ModelError(f"{solid.title}: {field} must be three lengths greater than 0, got {value}")


def smaller(solid: Solid, field: str, value: Any, other: str, limit: Any) -> None:
    """Refuse a length that is not smaller than another."""
    if not value.real < limit.real:
        raise ModelError(f"{solid.title}: {field} is {value:g} m; it must be smaller than its {other}, {limit:g} m")


RESOLUTION = 32  # corners of a circle for display
MAX_PARAMETERS = 7  # largest number of parameters of a convex solid
DIRECTIONS = tuple(d for d in itertools.product((-1.0, 0.0, 0.6, 1.0), repeat=3) if any(d))
"""Directions in which a support function is tested: along axes, in their planes, and others."""
CONTACT_REMEDY = (
    "give it contact=False, and the body simpler shapes in its place, such as Cylinder(..., looks=True, contact=True)"
)


@dataclass(frozen=True)
class Solid(Element):
    """A homogeneous solid on a body: its own frame is at ``position``, rotated by ``orientation``.

    It contributes to the body's mass its own ``mass``, or its volume times its own ``density``, or its volume times the
    body's density. A given ``mass`` of the body is distributed over its shapes by volume, or by volume times density if
    all of them have a density of their own.

    Parameters
    ----------
    name : str
        Optional.
    position : point [m]
        Origin of its own frame, in the body's reference frame. In a planar mechanism two components suffice.
    orientation : quaternion (scalar first), Bryant angles (x-y-z) [rad], rotation object or 3x3 matrix
        Of its own frame, relative to the body's reference frame.
    density : number [kg/m^3]
    mass : number [kg]
    looks : bool
        For display only, without mass.
    hole : bool
        A cut-out of the other shapes: its mass is subtracted, and it is not drawn. It must lie inside them; only the
        resulting mass and inertia are checked.
    material : str
        Name of its `Material` in contact; that of its body if not given.
    contact : bool
        Whether it takes part in contact, if a `Contact` applies to its body. If not given: yes, unless it is for
        display only. Holes are not cut out of the contact geometry.
    """

    name: str = ""
    _: KW_ONLY
    position: Point = (0.0, 0.0, 0.0)
    orientation: Orientation = (1.0, 0.0, 0.0, 0.0)
    density: Density | None = None
    mass: Mass | None = None
    looks: Flag = False
    hole: Flag = False
    material: Name | None = None
    contact: Flag | None = None

    category: ClassVar[str] = "shapes"
    points: ClassVar[tuple[str, ...]] = ("position",)  # fields that are points of the body
    symmetric: ClassVar[str] = ""  # coordinates that may change their sign without changing the solid in its own frame

    @property
    def title(self) -> str:
        """Kind, and name if it has one, for messages."""
        return f"{type(self).__name__} {self.name!r}" if self.name else type(self).__name__

    def check(self, n: SimpleNamespace) -> None:
        """Refuse invalid numbers.

        Raises
        ------
        ModelError
            If a mass or density is not greater than zero, both are given, or it is for display only.
        """
        if n.density == 0.0 or n.mass == 0.0:
            zero = "density" if n.density == 0.0 else "mass"
            raise ModelError(f"{self.title}: its {zero} is 0; a shape that is only seen is given by looks=True")
        positive(self, n, "density", "mass")
        if n.density is not None and n.mass is not None:
            raise ModelError(
                f"{self.title}: mass {n.mass:g} kg and density {n.density:g} kg/m^3 are both given; leave one out"
            )
        if self.looks:
            for field in ("density", "mass", "hole"):
                if getattr(n, field):
                    raise ModelError(f"{self.title}: it is for looks only, so leave out looks or {field}")
        if self.hole and self.contact is not None:
            raise ModelError(f"{self.title}: a hole touches nothing; leave out contact")
        self.pose(n)

    @property
    def touches(self) -> bool:
        """Return whether it takes part in contact."""
        return not (self.hole or self.looks) if self.contact is None else self.contact

    def mirrored(self, axis: str) -> Solid:
        """Return its mirror image in the body's reference frame: ``axis`` is the coordinate that changes its sign.

        Raises
        ------
        ModelError
            If its own geometry has no mirror image of the same kind.
        """
        place = Placement(mirror=axis)
        changed: dict[str, Any] = {name: place.points(getattr(self, name)) for name in self.points}
        changed["orientation"] = place.orientation(self.orientation)
        if (normal := getattr(self, "normal", None)) is not None:
            changed["normal"] = place.directions(normal)
        if axis not in self.symmetric:
            changed |= self.reflected(axis, changed["orientation"])
        if changed["orientation"] == self.orientation:
            del changed["orientation"]
        return dataclasses.replace(self, **changed)

    def reflected(self, axis: str, orientation: Any) -> dict[str, Any]:
        """Return the fields of a solid that is not symmetric: its reflected geometry, or another orientation."""
        if not self.symmetric:
            raise ModelError(f"{self.title}: a {type(self).__name__} has no mirror image; give its body another shape")
        third = next(a for a in "xyz" if a not in (axis, self.symmetric[0]))
        return {"orientation": turned_over(orientation, third)}

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Return its spatial contact geometry: convex parts, in its own frame.

        Raises
        ------
        ModelError
            If it has none.
        """
        raise ModelError(f"{self.title}: {type(self).__name__} is not supported by contact detection; {CONTACT_REMEDY}")

    def outlines(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Return its planar contact geometry: convex parts of its outline, seen along z.

        They are in the body's reference frame, at z = 0.

        Raises
        ------
        ModelError
            If it has none.
        """
        raise ModelError(f"{self.title}: {type(self).__name__} has no outline for contact detection; {CONTACT_REMEDY}")

    def volume(self, n: SimpleNamespace) -> Any:
        """Volume [m^3]."""
        raise NotImplementedError

    def centre(self, n: SimpleNamespace) -> Any:
        """Centre of mass [m] in its own frame."""
        return 0.0, 0.0, 0.0

    def gyration(self, n: SimpleNamespace) -> Any:
        """Return the inertia per unit mass [m^2] about the centre of mass, in its own axes.

        Three moments, or a 3x3 matrix where its own axes are not principal.
        """
        raise NotImplementedError

    def size(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Return the dimensions for drawing it [m]."""
        raise NotImplementedError

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """Return vertices (k, 3) [m] in its own frame and triangles (m, 3), counter-clockwise seen from outside.

        ``fine`` is the number of corners of a circle; the surface is closed for any value.
        """
        raise NotImplementedError

    def pose(self, n: SimpleNamespace) -> tuple[np.ndarray, np.ndarray]:
        """Origin and axes of its own frame in the body's reference frame."""
        return spatial_point(n.position, f"position of {self.title}"), orientation_matrix(
            n.orientation, f"orientation of {self.title}"
        )

    def placed(self, n: SimpleNamespace) -> tuple[np.ndarray, np.ndarray]:
        """Centre of mass [m] and inertia per unit mass [m^2] about it, in the body's reference frame."""
        p, R = self.pose(n)
        k = np.asarray(self.gyration(n))
        inertia = matrix_product(matrix_product(R, np.diag(k) if k.ndim == 1 else k), R.T)
        return p + matrix_product(R, np.asarray(self.centre(n))), inertia

    def mesh(self, n: SimpleNamespace) -> tuple[np.ndarray, np.ndarray]:
        """Its surface for drawing: vertices (k, 3) [m] in the body's reference frame and triangles (m, 3)."""
        p, R = self.pose(n)
        v, f = self.surface(n)
        return p + v @ R.T, f


@dataclass(frozen=True)
class ConvexSolid(Solid):
    """A user-defined convex shape, described by its support function.

    A subclass defines `parameters` and the static method ``support(par, d)``: the point of the solid (x, y, z), in its
    own frame, that is farthest along the direction d, of any length but zero. In spatial contact it touches other
    shapes at one point: for a solid with flat sides use a hull. A body with this shape needs ``mass`` and ``inertia``,
    unless the class also defines ``volume`` and ``gyration`` (and ``centre``).
    """

    support: ClassVar[Callable[..., Any]]

    def parameters(self, n: SimpleNamespace) -> tuple[Any, ...]:
        """Return up to seven numbers for the support function; ``n`` has the fields in SI units."""
        return ()

    def forms(self, n: SimpleNamespace) -> tuple[ConvexPart, ...]:
        """Return the solid itself, with a sphere about its bounding box.

        Raises
        ------
        ModelError
            If the support function is not finite in some direction, or there are too many parameters.
        """
        par = self.par(n)
        for d in DIRECTIONS:
            self._point(par, d)
        box = np.array([[self._point(par, tuple(s * e))[k] for s in (-1.0, 1.0)] for k, e in enumerate(np.eye(3))])
        return (ConvexPart("SOLID", (*par, 1.0), np.linalg.norm(np.abs(box).max(axis=1)), owner=type(self)),)

    def volume(self, n: SimpleNamespace) -> Any:
        """Raise an error: the volume is unknown.

        Raises
        ------
        ModelError
            Unless a subclass defines it.
        """
        raise ModelError(
            f"{self.title}: {type(self).__name__} defines no volume and gyration, so it has no mass; give mass= and "
            f"inertia= of the body"
        )

    def surface(self, n: SimpleNamespace, fine: int = RESOLUTION) -> tuple[np.ndarray, np.ndarray]:
        """Points that are farthest along directions all around."""
        par = self.par(n)
        v, f = lathe(snapped_to_axis(arc((0, 0), 1.0, -np.pi / 2, np.pi / 2, fine // 2)), fine)
        return np.array([self._point(par, tuple(d)) for d in v.tolist()]), f

    def par(self, n: SimpleNamespace) -> tuple[float, ...]:
        """Return the parameters of the support function: seven real numbers.

        Raises
        ------
        ModelError
            If there are more.
        """
        par = tuple(float(np.real(x)) for x in self.parameters(n))
        if len(par) > MAX_PARAMETERS:
            raise ModelError(f"{self.title}: parameters() gives {len(par)} numbers; a shape has up to {MAX_PARAMETERS}")
        return (*par, *(0.0,) * (MAX_PARAMETERS - len(par)))

    def _point(self, par: tuple[float, ...], d: tuple[float, ...]) -> tuple[float, ...]:
        x: Any
        try:
            with np.errstate(all="ignore"):
                x = type(self).support(par, d)
        except ArithmeticError as error:
            x = error
        if not isinstance(x, tuple) or len(x) != 3 or not np.isfinite(x).all():
            raise ModelError(
                f"{self.title}: {type(self).__name__}.support gives {x!r} for the direction {d} and par = {par}; it "
                f"must give a point, a tuple of three finite numbers, for every direction"
            )
        return x


@dataclass(frozen=True)
class Surface(Solid):
    """A shape that does not enclose a volume, for ground or for bodies with given mass and inertia."""

    def volume(self, n: SimpleNamespace) -> Any:
        """Raise an error: there is no volume.

        Raises
        ------
        ModelError
            Always.
        """
        raise ModelError(f"{self.title}: it has no volume and so no mass; give mass= and inertia= of the body")


def spatial_point(values: Any, what: str) -> np.ndarray:
    """Return three components of a point given by three, or by two in the plane z = 0."""
    return vector((*values, 0.0) if len(values) == 2 else values, False, what)
