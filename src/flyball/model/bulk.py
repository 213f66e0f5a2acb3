"""Many equal bodies at once, as arrays."""

from __future__ import annotations

import os
from dataclasses import field, fields
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator

from ..errors import ModelError
from ..math.vec import quaternion_matrix
from ..rotations.checks import unit_quaternions
from .body import Body, Inertia, Shapes, listed
from .element import LARGEST, Density, Element, Mass, Name, element
from .inertia import MassProperties, mass_properties
from .shapes import Solid
from .shapes.mesh import folder


def _read(path: Path) -> np.ndarray:
    """The array in a file of NumPy, or in a text with commas."""
    kind = path.suffix.lower()
    if kind not in (".npy", ".csv"):
        raise ValueError("give an array of numbers, or the path of a file '*.npy' or '*.csv' that holds one")
    try:
        return np.load(path, allow_pickle=False) if kind == ".npy" else np.loadtxt(path, delimiter=",", ndmin=1)
    except OSError as error:
        raise ValueError(f"cannot read {os.fspath(path)!r}: {error.strerror or error}") from None
    except ValueError as error:
        raise ValueError(f"{os.fspath(path)!r} holds no array of numbers: {error}") from None


def _numbers(value: Any) -> Any:
    """An array of numbers of its own, not to be changed."""
    if isinstance(value, (str, os.PathLike)):
        value = _read(folder() / value)
    try:
        a = np.array(value)
    except ValueError:
        raise ValueError("give an array of numbers, as long in every row") from None
    if a.dtype.kind not in "iuf":
        raise ValueError("give an array of numbers, in SI units")
    a = np.array(a, float, order="C")
    a.setflags(write=False)
    return a


Array = Annotated[Any, BeforeValidator(_numbers)]
ARRAYS = ("position", "angle", "orientation", "velocity", "angular_velocity", "scale")


@element
class Bodies(Element):
    """Many bodies of one shape, on nothing but gravity and contact: grains, balls, bricks.

    Their numbers are arrays in SI units with a row for each body: 100,000 take no longer to describe than one. In place
    of an array the path of a file that holds it will do, ``"grains.npy"`` or ``"grains.csv"``, counted from the folder
    of the model file; it is read at once, and what is saved holds the numbers. In messages and results the eighteenth
    of ``"balls"`` is ``"balls[17]"``. Joints, drivers and forces act on a `Body`.

    Parameters
    ----------
    name : str
    shape : shape or list of shapes
        Of each of them, in its own reference frame.
    position : (n, 3) numbers [m]
        Origins of their reference frames, in the world; in a planar mechanism (n, 2) will do.
    density : number [kg/m^3]
        Of shapes without a mass or density of their own, as for a `Body`.
    mass, inertia : number [kg], [kg m^2]
        Of each of them, as for a `Body`.
    angle : n numbers [rad]
        Planar: orientations of the reference frames; 0 if not given. One number holds for all.
    orientation : (n, 4) numbers
        Spatial: quaternions, scalar first; the world's axes if not given. One row holds for all.
    velocity : (n, 3) numbers [m/s]
        At the start, of the reference frames' origins, world axes; 0 if not given. One row holds for all.
    angular_velocity : (n, 3) numbers [rad/s]
        At the start, world axes; in a planar mechanism n numbers. 0 if not given. One row holds for all.
    scale : n numbers [1]
        Size of each relative to ``shape``: lengths grow with it, masses with its cube, inertias with its fifth power.
    material : str
        `Material` of the shapes that name none of their own.
    color : str
        Colour in pictures.
    """

    shape: Shapes = field(kw_only=True)
    position: Array = field(kw_only=True, repr=False)
    density: Density | None = None
    mass: Mass | None = None
    inertia: Inertia | None = None
    angle: Array | None = field(default=None, repr=False)
    orientation: Array | None = field(default=None, repr=False)
    velocity: Array | None = field(default=None, repr=False)
    angular_velocity: Array | None = field(default=None, repr=False)
    scale: Array | None = field(default=None, repr=False)
    material: Name | None = None
    color: str | None = None

    category: ClassVar[str] = "bulk"

    def __eq__(self, other: object) -> bool:
        """Equal if everything is, to the bit."""
        return isinstance(other, Bodies) and all(
            _same(getattr(self, f.name), getattr(other, f.name)) for f in fields(self)
        )

    def __hash__(self) -> int:
        return hash((self.name, self.shape, self.position.tobytes()))

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        for name in ARRAYS:
            if getattr(self, name) is not None:
                getattr(self, name).setflags(write=False)

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.position)

    @cached_property
    def one(self) -> Body:
        """One of them, with ``scale`` 1 and at the origin."""
        return Body(
            self.name,
            shape=self.shape,
            density=self.density,
            mass=self.mass,
            inertia=self.inertia,
            material=self.material,
            color=self.color,
        )

    def shapes(self) -> tuple[Solid, ...]:
        """Its shapes, as a tuple."""
        return listed(self.shape)

    def check(self, n: SimpleNamespace) -> None:
        """Arrays of as many finite numbers as there are bodies; what depends on the plane is looked at later."""
        self.one.check(n)
        if not self.shapes():
            raise ModelError(f"{self.title}: it has no shape; give shape=Sphere(radius=...) or another")
        if self.position.ndim != 2 or not len(self.position):
            raise ModelError(
                f"{self.title}: position has the shape {self.position.shape}; give an array (n, 3), a row for each body"
            )
        for name in ARRAYS:
            a = getattr(self, name)
            if a is not None and not (np.abs(a) <= LARGEST).all():
                k = np.argwhere(~(np.abs(a) <= LARGEST))[0]
                raise ModelError(
                    f"{self.title}: {name}[{', '.join(map(str, k))}] is {a[tuple(k)]:g}; give finite numbers, "
                    f"{LARGEST:g} at most"
                )
        if self.scale is not None and not (self.scale > 0.0).all():
            k = int(np.argmin(self.scale > 0.0))
            raise ModelError(f"{self.title}: scale[{k}] is {self.scale.flat[k]:g}; it must be greater than 0")

    def weight(self, n: SimpleNamespace, env: Any, planar: bool) -> MassProperties:
        """Mass properties of one of them with ``scale`` 1.

        Raises
        ------
        ModelError
            If a shape makes no sense, or it has no mass or inertia.
        """
        given = {name: getattr(n, name) for name in ("mass", "density", "inertia")}
        given |= dict.fromkeys(("inertia_about", "inertia_axes", "com"))
        found = mass_properties(self.one, SimpleNamespace(**given), env, planar)
        if not found.mass.real > 0.0:
            raise ModelError(f"{self.title}: its mass is 0, and what touches needs one")
        return found

    def start(self, planar: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Positions (n, 3), rotations (n, 3, 3), velocities (n, 3) of the origins and angular velocities (n, 3).

        Raises
        ------
        ModelError
            If an array has another shape than it must.
        """
        n = self.count
        p = _rows(self, "position", n, (3, 2) if planar else (3,))
        v = _rows(self, "velocity", n, (3, 2) if planar else (3,))
        if planar:
            if self.orientation is not None:
                raise ModelError(f"{self.title}: in a planar mechanism give angle=, not orientation=")
            if (np.abs(p[:, 2]) + np.abs(v[:, 2])).any():
                raise ModelError(f"{self.title}: the mechanism is planar; z of position and velocity must be 0")
            turn, w = _line(self, "angle", n), np.zeros((n, 3))
            w[:, 2] = _line(self, "angular_velocity", n)
            R = np.zeros((n, 3, 3))
            R[:, 0, 0] = R[:, 1, 1] = np.cos(turn)
            R[:, 1, 0] = np.sin(turn)
            R[:, 0, 1] = -R[:, 1, 0]
            R[:, 2, 2] = 1.0
            return p, R, v, w
        if self.angle is not None:
            raise ModelError(f"{self.title}: in a spatial mechanism give orientation=, not angle=")
        return p, self._turned(n), v, _rows(self, "angular_velocity", n, (3,))

    def _turned(self, n: int) -> np.ndarray:
        if self.orientation is None:
            return np.broadcast_to(np.eye(3), (n, 3, 3))
        e = unit_quaternions(_rows(self, "orientation", n, (4,)), f"orientation of {self.title}")
        return np.stack(quaternion_matrix(*e.T), axis=1).reshape(n, 3, 3)

    def sizes(self) -> np.ndarray:
        """Scale (n,) of each."""
        return np.ones(self.count) if self.scale is None else _line(self, "scale", self.count)


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.shape == b.shape and a.tobytes() == b.tobytes()
    return type(a) is type(b) and bool(a == b)


def _rows(e: Bodies, name: str, n: int, widths: tuple[int, ...]) -> np.ndarray:
    """An array (n, 3 or 4) of a field: as given, one row for all, or zeros."""
    out = np.zeros((n, widths[0]))
    a = getattr(e, name)
    if a is None:
        return out
    if a.shape[-1:] not in {(w,) for w in widths} or a.ndim > 2 or (a.ndim == 2 and len(a) != n):
        wanted = " or ".join(f"({n}, {w})" for w in widths)
        raise ModelError(f"{e.title}: {name} has the shape {a.shape}; it must be {wanted}, a row for each body")
    out[:, : a.shape[-1]] = a
    return out


def _line(e: Bodies, name: str, n: int) -> np.ndarray:
    """An array (n,) of a field: as given, one number for all, or zeros."""
    a = getattr(e, name)
    if a is not None and a.shape not in ((), (n,)):
        raise ModelError(f"{e.title}: {name} has the shape {a.shape}; it must be ({n},), a number for each body")
    return np.zeros(n) if a is None else np.broadcast_to(a, (n,))
