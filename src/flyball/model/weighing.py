"""What shapes weigh together: masses from densities, shares of a given mass, holes taken away."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError
from ..math.products import inner
from .element import resolve
from .shapes import Solid

if TYPE_CHECKING:
    from .body import Body
    from .ground import Ground


@dataclass(frozen=True)
class Weighed:
    """Mass [kg], centre [m], inertia [kg m^2] about it and volume [m^3] of a body's shapes; body axes."""

    mass: Any
    com: np.ndarray
    inertia: np.ndarray
    volume: Any


def shifted(mass: Any, d: np.ndarray) -> np.ndarray:
    """Inertia of a point mass at d: m (d.d 1 - d d^T), the term of the parallel axis theorem (Hahn, eq. 4.26)."""
    return mass * (inner(d, d) * np.eye(3) - np.outer(d, d))


def checked(body: Body | Ground, env: Any, planar: bool) -> list[tuple[Solid, SimpleNamespace, str]]:
    """The body's (or ground's) shapes with their numbers and what to call them in messages, every one checked."""
    out = []
    shapes = body.shapes()
    for k, s in enumerate(shapes, 1):
        where = f"{body.title}: " if len(shapes) == 1 else f"{body.title}, shape {k}: "
        with _placed(where):
            n = resolve(s, env)
            for field in () if planar else s.points:
                if len(getattr(n, field)) != 3:
                    value = getattr(n, field)
                    raise ModelError(f"{field} of {s.title}: expected 3 components, got {len(value)}: {value}")
            s.check(n)
        out.append((s, n, where))
    return out


@contextmanager
def _placed(where: str) -> Iterator[None]:
    """Errors in here say where they happened."""
    try:
        yield
    except ModelError as error:
        raise type(error)(f"{where}{error}") from None


def weighed(body: Body, n: SimpleNamespace, shapes: list[tuple[Solid, SimpleNamespace, str]]) -> Weighed:
    """Add up the shapes that have a mass.

    Raises
    ------
    ModelError
        If a shape has no mass, has one in two ways, or the holes weigh more than the rest.
    """
    _consistent(body, n, shapes)
    parts = []
    for s, x, where in shapes:
        with _placed(where):
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
    inertia = sum(m * k + shifted(m, c - com) for m, c, k, _ in parts)
    if n.mass is not None:
        total, inertia = n.mass, inertia * (n.mass / total)
    return Weighed(total, com, inertia, volume)


def _consistent(body: Body, n: SimpleNamespace, shapes: list[tuple[Solid, SimpleNamespace, str]]) -> None:
    """Every shape has a mass in one way, and nothing that is given has no effect."""
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
