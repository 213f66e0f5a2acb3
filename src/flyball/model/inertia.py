"""Mass, centre of mass and inertia of a body, from numbers or from its shapes.

Physically impossible values are refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..math.scalar import real_parts
from ..math.vec import inner_product, matrix_product
from .element import positive, resolve
from .geometry import orientation_matrix, vector
from .shapes import Solid

if TYPE_CHECKING:
    from .body import Body, Ground


@dataclass(frozen=True)
class ShapeMasses:
    """Mass [kg], centre [m], inertia [kg m^2] about it and volume [m^3] of a body's shapes; body axes."""

    mass: Any
    com: np.ndarray
    inertia: np.ndarray
    volume: Any


def parallel_axis_term(mass: Any, d: np.ndarray) -> np.ndarray:
    """Return the inertia of a point mass at d: m (d.d 1 - d d^T), the parallel axis term (Hahn, eq. 4.26)."""
    return mass * (inner_product(d, d) * np.eye(3) - np.outer(d, d))


def checked_shapes(body: Body | Ground, env: Any, planar: bool) -> list[tuple[Solid, SimpleNamespace, str]]:
    """Return the shapes of a body (or ground), checked, each with its numbers and its title for messages."""
    out = []
    shapes = body.shapes()
    for k, s in enumerate(shapes, 1):
        where = f"{body.title}: " if len(shapes) == 1 else f"{body.title}, shape {k}: "
        with _errors_located(where):
            n = resolve(s, env)
            for field in () if planar else s.points:
                if len(getattr(n, field)) != 3:
                    value = getattr(n, field)
                    raise ModelError(f"{field} of {s.title}: expected 3 components, got {len(value)}: {value}")
            s.check(n)
        out.append((s, n, where))
    return out


@contextmanager
def _errors_located(where: str) -> Iterator[None]:
    """Context manager that adds the location to error messages."""
    try:
        yield
    except ModelError as error:
        raise type(error)(f"{where}{error}") from None


def shape_masses(body: Body, n: SimpleNamespace, shapes: list[tuple[Solid, SimpleNamespace, str]]) -> ShapeMasses:
    """Add up the shapes that have a mass.

    Raises
    ------
    ModelError
        If a shape has no mass, has one in two ways, or the holes weigh more than the rest.
    """
    _consistent(body, n, shapes)
    parts = []
    for s, x, where in shapes:
        with _errors_located(where):
            volume = s.volume(x)
            centre, gyration = s.placed(x)
        density = next((d for d in (x.density, n.density) if d is not None), 1.0)
        mass = volume * density if x.mass is None else x.mass
        sign = -1.0 if s.hole else 1.0
        parts.append((sign * mass, centre, gyration, sign * volume))
    total, volume = sum(m for m, *_ in parts), sum(v for *_, v in parts)
    if not (total.real > 0.0 and volume.real > 0.0):
        raise ModelError(
            f"{body.title}: its holes take more than there is: {volume:g} m^3 are left. Holes must lie inside the "
            f"other shapes"
        )
    com = sum(m * c for m, c, *_ in parts) / total
    inertia = sum(m * k + parallel_axis_term(m, c - com) for m, c, k, _ in parts)
    if n.mass is not None:
        total, inertia = n.mass, inertia * (n.mass / total)
    return ShapeMasses(total, com, inertia, volume)


def _consistent(body: Body, n: SimpleNamespace, shapes: list[tuple[Solid, SimpleNamespace, str]]) -> None:
    """Require one source of mass for every shape, and no fields without effect."""
    own = [x.mass is not None or x.density is not None for _, x, _ in shapes]
    if n.mass is not None:
        if n.density is not None:
            raise ModelError(
                f"{body.title}: mass {n.mass:g} kg and density {n.density:g} kg/m^3 are both given; leave one out "
                f"(a mass is shared out by volume; for shapes of different materials give each its density)"
            )
        for _, x, where in shapes:
            if x.mass is not None:
                raise ModelError(
                    f"{where}it has a mass of its own, {x.mass:g} kg, and so has the body, {n.mass:g} kg; leave one out"
                )
        if any(own) and not all(own):
            raise ModelError(
                f"{shapes[own.index(False)][2]}it has no density, but others have. The body's mass is shared out by "
                f"volume times density: give a density to all of its shapes or to none"
            )
    elif n.density is None and not all(own):
        raise ModelError(
            f"{shapes[own.index(False)][2]}its mass is missing; give mass=... or density=... of the body or the shape"
        )
    elif n.density is not None and all(own):
        raise ModelError(
            f"{body.title}: density {n.density:g} kg/m^3 has no effect, since all its shapes have a mass or density of "
            f"their own; leave it out"
        )


TRIANGLE_TOLERANCE = 1e-9
SYMMETRY_TOLERANCE = 1e-9  # centres of mass that differ by less than this part of the body's size count as equal


@dataclass(frozen=True)
class MassProperties:
    """Mass [kg], centre of mass [m] from the body's reference point, inertia [kg m^2] about it; body axes."""

    mass: float
    com: np.ndarray
    inertia: np.ndarray
    volume: float | None = None  # volume of the shapes [m^3], if these give the inertia


def mass_properties(body: Body, n: SimpleNamespace, env: Any, planar: bool) -> MassProperties:
    """Mass properties of a body with resolved fields ``n``.

    Either mass and inertia are given, and shapes are for display only; or the shapes (except display shapes) give the
    centre of mass and the inertia, and the mass unless it is given. In a planar mechanism only the inertia about z and
    the in-plane centre of mass are used.

    Raises
    ------
    ModelError
        If mass or inertia is missing, given in two ways, negative, not symmetric, or breaks the triangle inequality by
        more than 1e-9 of its size; if a shape is invalid.
    """
    if n.mass is not None and not n.mass.real > 0.0 and not _is_massless(n):
        why = (
            "A massless ring or link between joints has inertia=0 too; a massless link is also a Distance"
            if n.mass == 0.0
            else "Check its sign and unit"
        )
        raise ModelError(f"{body.title}: mass is {n.mass:g} kg; a mass must be greater than 0. {why}")
    positive(body, n, "density")
    shapes = checked_shapes(body, env, planar)
    heavy = [s for s in shapes if not s[0].looks]
    if n.inertia is not None:
        found = _from_numbers(body, n, planar, heavy)
    else:
        found = _from_shapes(body, n, planar, heavy)
    if not planar:
        _check(body, n, found)
    elif not found.inertia[2, 2].real >= 0.0:
        raise ModelError(f"{body.title}: inertia is {found.inertia[2, 2]:g} kg m^2; it must be zero or greater")
    return found


def _is_massless(n: SimpleNamespace) -> bool:
    """Return whether a body has neither mass nor inertia: a massless connecting part."""
    return (
        n.mass == 0.0
        and n.inertia is not None
        and n.inertia_about is None
        and not np.any(np.asarray(n.inertia, object) != 0)
    )


def principal(J: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments and axes of an inertia.

    Parameters
    ----------
    J : (3, 3)

    Returns
    -------
    moments : (3,)
        Ascending.
    axes : (3, 3)
        A rotation: its columns are the principal axes, in the order of the moments. The largest component of the
        first and of the second is positive; the third completes a right-handed frame. Axes of equal moments are not
        unique: those nearest to the axes of ``J`` are taken.
    """
    w, V = np.linalg.eigh(J)
    near = 1e-9 * max(abs(w[2]), abs(w[0]))
    if w[2] - w[0] <= near:
        return w, np.eye(3)
    if w[1] - w[0] <= near or w[2] - w[1] <= near:
        lone = 2 if w[1] - w[0] <= near else 0
        z = V[:, lone]
        across = np.eye(3) - np.outer(z, z)  # columns: the axes of J, projected into the plane of equal moments
        j, k = np.argsort(-np.round(np.diag(across), 9), kind="stable")[:2]
        x = across[:, j] / np.sqrt(across[j, j])
        pair = (x, np.cross(z, x)) if j < k else (np.cross(x, z), x)
        at = 0 if lone == 2 else 1
        V[:, at], V[:, at + 1] = pair
    for k in (0, 1):
        V[:, k] *= np.sign(V[np.argmax(np.round(np.abs(V[:, k]), 9)), k])
    V[:, 2] = np.cross(V[:, 0], V[:, 1])
    return w, V


def _from_shapes(body: Body, n: SimpleNamespace, planar: bool, heavy: list) -> MassProperties:
    """Return centre of mass and inertia from the shapes."""
    if not heavy:
        hint = "inertia=0.01" if planar else "inertia=(Ixx, Iyy, Izz)"
        why = "its shapes are for looks only; " if body.shapes() else ""
        raise ModelError(f"{body.title}: its inertia is missing; {why}give {hint}, 0 for a point mass, or a shape")
    for field in ("inertia_about", "inertia_axes"):
        if getattr(n, field) is not None:
            raise ModelError(f"{body.title}: {field} is the reference of inertia=, which is not given; leave it out")
    found = shape_masses(body, n, heavy)
    com = found.com * np.array([1.0, 1.0, 0.0]) if planar else found.com
    if n.com is not None:
        given = vector(n.com, planar, f"com of {body.title}")
        size = np.sqrt(abs(np.trace(found.inertia)) / abs(found.mass)) + np.sqrt(abs(inner_product(com, com)))
        if np.sqrt(abs(inner_product(given - com, given - com))) > SYMMETRY_TOLERANCE * size:
            raise ModelError(
                f"{body.title}: com is {_numbers(given)} m, but the centre of mass of its shapes is {_numbers(com)} m. "
                f"Leave com out, or give mass and inertia as well: the shapes are then for looks only"
            )
    return MassProperties(found.mass, com, found.inertia, found.volume)


def _from_numbers(body: Body, n: SimpleNamespace, planar: bool, heavy: list) -> MassProperties:
    """Return the given values; mass data of shapes are then refused."""
    if n.mass is None:
        why = "; inertia is given, so the shapes are for looks only: give" if heavy else "; give"
        raise ModelError(f"{body.title}: its mass is missing{why} mass=..., or leave inertia out and give a density")
    if n.density is not None:
        raise ModelError(f"{body.title}: density has no effect, since mass and inertia are given; leave it out")
    for s, x, where in heavy:
        for field in ("mass", "density", "hole"):
            if getattr(x, field):
                raise ModelError(
                    f"{where}{field} of {s.title} has no effect, since mass and inertia of the body are given: its "
                    f"shapes are for looks only; leave it out"
                )
    com = vector(n.com or (0, 0, 0), planar, f"com of {body.title}")
    return MassProperties(n.mass, com, _given(body, n, planar, com))


def _given(body: Body, n: SimpleNamespace, planar: bool, com: np.ndarray) -> np.ndarray:
    """Return the given inertia in the body's axes about the centre of mass."""
    if planar:
        if isinstance(n.inertia, tuple):
            raise ModelError(f"{body.title}: in a planar mechanism inertia is one number, got {n.inertia}")
        if n.inertia_axes is not None:
            raise ModelError(f"{body.title}: in a planar mechanism inertia is about z; leave inertia_axes out")
        J = np.zeros((3, 3), np.result_type(type(n.inertia), float))
        J[2, 2] = n.inertia
    else:
        J = _matrix(body, n)
        if n.inertia_axes is not None:
            T = orientation_matrix(n.inertia_axes, f"inertia_axes of {body.title}")
            J = matrix_product(matrix_product(T, J), T.T)
    if n.inertia_about is not None:
        about = vector(n.inertia_about, planar, f"inertia_about of {body.title}")
        J = J - parallel_axis_term(n.mass, about - com)
        if planar:
            J[:2] = 0.0
    return J


def _matrix(body: Body, n: SimpleNamespace) -> np.ndarray:
    """Return three moments or a symmetric matrix as a matrix."""
    ragged = isinstance(n.inertia, tuple) and len({isinstance(x, tuple) and len(x) for x in n.inertia}) > 1
    a = np.zeros(0) if ragged else np.asarray(n.inertia)
    a = np.full(3, a) if a.shape == () and a == 0 else a
    if a.shape not in ((3,), (3, 3)):
        six = "; six numbers are written ((Ixx, Ixy, Ixz), (Ixy, Iyy, Iyz), (Ixz, Iyz, Izz))" if a.size == 6 else ""
        raise ModelError(
            f"{body.title}: inertia of a spatial body is three principal moments or a 3x3 matrix "
            f"(0 for a point mass), got {n.inertia}{six}"
        )
    J = np.diag(a) if a.shape == (3,) else a
    if not _symmetric(J):
        raise ModelError(f"{body.title}: its inertia matrix is not symmetric: {a.tolist()}")
    return J


def _check(body: Body, n: SimpleNamespace, found: MassProperties) -> None:
    """Refuse an inertia that is impossible for a body of positive mass."""
    a, b, c = _moments(found.inertia)
    slack = TRIANGLE_TOLERANCE * max(abs(c), abs(a))
    inside = "Its holes must lie inside the other shapes" if n.inertia is None else ""
    if a < -slack:
        why = inside or _suspect_inertia(n)
        raise ModelError(
            f"{body.title}: its inertia has a negative principal moment: {a:g}, {b:g}, {c:g} kg m^2. {why}"
        )
    if a + b < c - slack:
        why = inside or "Check whether they are about the centre of mass (inertia_about=) and in the right unit"
        raise ModelError(
            f"{body.title}: principal moments {a:g}, {b:g}, {c:g} kg m^2 break the triangle inequality "
            f"({a:g} + {b:g} < {c:g}); no body of positive mass has them. {why}"
        )


def _symmetric(J: np.ndarray) -> bool:
    return all(np.abs(A - A.T).max() <= 1e-12 * np.abs(A).max() for A in (real_parts(J), J.imag))


def _moments(J: np.ndarray) -> np.ndarray:
    """Principal moments, ascending."""
    return np.linalg.eigvalsh(real_parts(J))


def _suspect_inertia(n: SimpleNamespace) -> str:
    """Return the likely error in the given inertia."""
    if n.inertia_about is not None:
        return "Check whether inertia_about is the point that it is about"
    if isinstance(n.inertia, tuple) and isinstance(n.inertia[0], tuple):
        return "Terms off the diagonal are minus the products of inertia, Ixy = -sum of m x y: check their signs"
    return "Check its sign"


def _numbers(p: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:g}" for x in p) + ")"
