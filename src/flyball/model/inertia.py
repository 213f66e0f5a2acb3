"""Mass, centre of mass and inertia of a body from whatever the user gave; physically impossible ones are refused."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from .element import resolve
from .geometry import orientation_matrix, vector

if TYPE_CHECKING:
    from .body import Body

TRIANGLE = 1e-9


@dataclass(frozen=True)
class MassProperties:
    """Mass [kg], centre of mass [m] from the body's reference point, inertia [kg m^2] about it; body axes."""

    mass: float
    com: np.ndarray
    inertia: np.ndarray


def shifted(mass: float, d: np.ndarray) -> np.ndarray:
    """Inertia of a point mass at d: m (d.d 1 - d d^T), the term of the parallel axis theorem (Hahn, eq. 4.26)."""
    return mass * ((d @ d) * np.eye(3) - np.outer(d, d))


def mass_properties(body: Body, n: SimpleNamespace, env: Any, planar: bool) -> MassProperties:
    """Mass properties of a body with resolved fields ``n``.

    Raises
    ------
    ModelError
        If mass or inertia is missing, negative, not symmetric, or breaks the triangle inequality by more than 1e-9
        of its size.
    """
    if n.mass is not None and not n.mass.real > 0.0:
        why = "For a massless link use Distance" if n.mass == 0.0 else "Check its sign and unit"
        raise ModelError(f"{body.title}: mass is {n.mass:g} kg; a mass must be greater than 0. {why}")
    solids = body.solids()
    if n.inertia is None and not solids:
        hint = "inertia=0.01" if planar else "inertia=(Ixx, Iyy, Izz)"
        raise ModelError(f"{body.title}: its inertia is missing; give {hint}, 0 for a point mass, or a shape")
    if n.mass is None and (n.density is None or not solids):
        raise ModelError(f"{body.title}: its mass is missing; give mass=..., or a shape and a density")
    shape: Any = _of_solids(solids, n, env) if solids else None
    mass = n.mass if n.mass is not None else shape.mass
    if n.com is None and n.inertia is None and shape is not None:
        com = shape.com  # shapes that do not give the inertia are for looks only, and give no centre of mass either
    else:
        com = vector(n.com or (0, 0, 0), planar, f"com of {body.title}")
    if n.inertia is None:
        moved = shape.com - com  # a mass of its own scales the shape's inertia; the parallel axis theorem moves it
        inertia = shape.inertia * (mass / shape.mass) + shifted(mass, moved)
    else:
        inertia = _given(body, n, planar, mass, com)
    if not planar:
        _check(body, inertia)
    elif not inertia[2, 2].real >= 0.0:
        raise ModelError(f"{body.title}: inertia is {inertia[2, 2]:g} kg m^2; it must be zero or greater")
    return MassProperties(mass, com, inertia)


def _of_solids(solids: tuple, n: SimpleNamespace, env: Any) -> MassProperties:
    density = 1.0 if n.density is None else n.density
    parts = []
    for s in solids:
        m = resolve(s, env)
        s.check(m)
        p, R = s.pose(m)
        mass = density * s.volume(m)
        parts.append((mass, p + R[:, 2] * s.centre(m), R @ np.diag(s.gyration(m)) @ R.T * mass))
    total = sum(p[0] for p in parts)
    com = sum(p[0] * p[1] for p in parts) / total
    inertia = sum(J + shifted(m, c - com) for m, c, J in parts)
    return MassProperties(total, com, inertia)


def _given(body: Body, n: SimpleNamespace, planar: bool, mass: float, com: np.ndarray) -> np.ndarray:
    if planar:
        if isinstance(n.inertia, tuple):
            raise ModelError(f"{body.title}: in a planar mechanism inertia is one number, got {n.inertia}")
        J = np.zeros((3, 3), np.result_type(type(n.inertia), float))
        J[2, 2] = n.inertia
    else:
        ragged = isinstance(n.inertia, tuple) and len({isinstance(x, tuple) and len(x) for x in n.inertia}) > 1
        a = np.zeros(0) if ragged else np.asarray(n.inertia)
        a = np.full(3, a) if a.shape == () and a == 0 else a
        if a.shape not in ((3,), (3, 3)):
            raise ModelError(
                f"{body.title}: inertia of a spatial body is three principal moments or a 3x3 matrix "
                f"(0 for a point mass), got {n.inertia}"
            )
        J = np.diag(a) if a.shape == (3,) else a
        if np.abs(J - J.T).max() > 1e-12 * np.abs(J).max():
            raise ModelError(f"{body.title}: its inertia matrix is not symmetric: {a.tolist()}")
        T = orientation_matrix(n.inertia_axes, f"inertia_axes of {body.title}")
        J = T @ J @ T.T
    if n.inertia_about is not None:
        J = J - shifted(mass, vector(n.inertia_about, planar, f"inertia_about of {body.title}") - com)
    return J


def _check(body: Body, J: np.ndarray) -> None:
    a, b, c = np.linalg.eigvalsh(J.real)
    slack = TRIANGLE * max(abs(c), abs(a))
    if a < -slack:
        raise ModelError(f"{body.title}: its inertia has a negative principal moment: {a:g}, {b:g}, {c:g} kg m^2")
    if a + b < c - slack:
        raise ModelError(
            f"{body.title}: principal moments {a:g}, {b:g}, {c:g} kg m^2 break the triangle inequality "
            f"({a:g} + {b:g} < {c:g}); no body of positive mass has them. Check whether they are about the centre "
            f"of mass (inertia_about=) and in the right unit"
        )
