"""Mass, centre of mass and inertia of a body from whatever the user gave; physically impossible ones are refused."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..math.products import inner, product
from ..math.scalar import real_parts
from .element import positive
from .geometry import orientation_matrix, vector
from .weighing import checked, shifted, weighed

if TYPE_CHECKING:
    from .body import Body

TRIANGLE = 1e-9
SAME = 1e-9  # a centre of mass that differs by less than this part of the body's size is the same


@dataclass(frozen=True)
class MassProperties:
    """Mass [kg], centre of mass [m] from the body's reference point, inertia [kg m^2] about it; body axes."""

    mass: float
    com: np.ndarray
    inertia: np.ndarray
    volume: float | None = None  # of the shapes [m^3], where these give the inertia


def mass_properties(body: Body, n: SimpleNamespace, env: Any, planar: bool) -> MassProperties:
    """Mass properties of a body with resolved fields ``n``.

    Either mass and inertia are given, and shapes are for looks only; or the shapes that are not for looks only give
    the centre of mass and the inertia, and the mass unless it is given. In a planar mechanism only the inertia about
    z counts, and the centre of mass in the plane.

    Raises
    ------
    ModelError
        If mass or inertia is missing, given in two ways, negative, not symmetric, or breaks the triangle inequality
        by more than 1e-9 of its size; if a shape makes no sense.
    """
    if n.mass is not None and not n.mass.real > 0.0 and not _nothing(n):
        why = (
            "A ring or link without mass, which joints hold, has inertia=0 too; a massless link is also a Distance"
            if n.mass == 0.0
            else "Check its sign and unit"
        )
        raise ModelError(f"{body.title}: mass is {n.mass:g} kg; a mass must be greater than 0. {why}")
    positive(body, n, "density")
    shapes = checked(body, env, planar)
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


def _nothing(n: SimpleNamespace) -> bool:
    """Whether a body has neither mass nor inertia: a part that only joins others."""
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
    """Centre of mass and inertia from the shapes."""
    if not heavy:
        hint = "inertia=0.01" if planar else "inertia=(Ixx, Iyy, Izz)"
        why = "its shapes are for looks only; " if body.shapes() else ""
        raise ModelError(f"{body.title}: its inertia is missing; {why}give {hint}, 0 for a point mass, or a shape")
    for field in ("inertia_about", "inertia_axes"):
        if getattr(n, field) is not None:
            raise ModelError(f"{body.title}: {field} says how inertia= is counted, which is not given; leave it out")
    found = weighed(body, n, heavy)
    com = found.com * np.array([1.0, 1.0, 0.0]) if planar else found.com
    if n.com is not None:
        given = vector(n.com, planar, f"com of {body.title}")
        size = np.sqrt(abs(np.trace(found.inertia)) / abs(found.mass)) + np.sqrt(abs(inner(com, com)))
        if np.sqrt(abs(inner(given - com, given - com))) > SAME * size:
            raise ModelError(
                f"{body.title}: com is {_numbers(given)} m, but the centre of mass of its shapes is {_numbers(com)} m. "
                f"Leave com out, or give mass and inertia as well: the shapes are then for looks only"
            )
    return MassProperties(found.mass, com, found.inertia, found.volume)


def _from_numbers(body: Body, n: SimpleNamespace, planar: bool, heavy: list) -> MassProperties:
    """What is given; nothing that shapes say of masses may stand beside it."""
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
    """The inertia given, turned to the body's axes and moved to the centre of mass."""
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
            J = product(product(T, J), T.T)
    if n.inertia_about is not None:
        about = vector(n.inertia_about, planar, f"inertia_about of {body.title}")
        J = J - shifted(n.mass, about - com)
        if planar:
            J[:2] = 0.0
    return J


def _matrix(body: Body, n: SimpleNamespace) -> np.ndarray:
    """Three moments or a symmetric matrix, as a matrix."""
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
    """Refuse an inertia that no body of positive mass has."""
    a, b, c = _moments(found.inertia)
    slack = TRIANGLE * max(abs(c), abs(a))
    inside = "Its holes must lie inside the other shapes" if n.inertia is None else ""
    if a < -slack:
        why = inside or _doubt(n)
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


def _doubt(n: SimpleNamespace) -> str:
    """What of the given inertia may be wrong."""
    if n.inertia_about is not None:
        return "Check whether inertia_about is the point that it is about"
    if isinstance(n.inertia, tuple) and isinstance(n.inertia[0], tuple):
        return "Terms off the diagonal are minus the products of inertia, Ixy = -sum of m x y: check their signs"
    return "Check its sign"


def _numbers(p: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:g}" for x in p) + ")"
