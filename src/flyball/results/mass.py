"""Mass properties of bodies and of a mechanism as a whole."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ..errors import ModelError
from ..model.words import listing, suggest
from .numbers import tuple_of

ALIGNED = 1e-9  # a principal axis that differs by less from an axis of the body is that axis


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass properties of a body, or of all bodies together.

    Attributes
    ----------
    mass : float
        [kg].
    com : (3,)
        Centre of mass in the body's reference frame [m]; of all bodies together as ``position``. Planar: (2,).
    position : (3,)
        Centre of mass in the world [m]. Planar: (2,).
    inertia : (3, 3)
        Inertia tensor about the centre of mass [kg m^2], in body axes (of all bodies together: in world axes). Off
        the diagonal it holds minus the products of inertia. Planar: the moment about z, a float.
    moments : (3,)
        Principal moments [kg m^2], ascending. Planar: (1,).
    axes : (3, 3)
        Rotation from principal to body axes (of all together: to world axes): its columns are the principal axes, in
        the order of the moments, right-handed. The largest component of the first and of the second is positive.
        Principal axes of equal moments are not unique: those nearest to the body's axes are given. Planar: identity.
    gyration : (3,)
        Radii of gyration about the principal axes, sqrt(moment / mass) [m]. Planar: (1,).
    volume : float or None
        Volume of the shapes, holes taken away [m^3], where they give the inertia; of all together if all have one.
    """

    mass: float
    com: np.ndarray
    position: np.ndarray
    inertia: Any
    moments: np.ndarray
    axes: np.ndarray
    gyration: np.ndarray
    volume: float | None

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {f.name: _plain(getattr(self, f.name)) for f in fields(self)}


@dataclass(frozen=True, eq=False)
class MassReport:
    """What `Mechanism.mass_properties` found: ``report["crank"].moments``, ``report.total.mass``; printed as a table.

    Attributes
    ----------
    name : str
        Of the mechanism.
    bodies : dict of MassProperties
        By name of the body.
    total : MassProperties
        All bodies together, where they are at the start.
    """

    name: str
    planar: bool
    bodies: dict[str, MassProperties]
    total: MassProperties

    def __getitem__(self, name: str) -> MassProperties:
        """Mass properties of a body."""
        if name not in self.bodies:
            known = list(self.bodies)
            raise ModelError(f"{self.name!r} has no body named {name!r}{suggest(name, known)}; {listing(known)}")
        return self.bodies[name]

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        bodies = {k: b.as_dict() for k, b in self.bodies.items()}
        return {"name": self.name, "planar": self.planar, "bodies": bodies, "total": self.total.as_dict()}

    def lines(self) -> list[tuple[str, str]]:
        """Label and text of what a reader wants to see first."""
        out = [("mechanism", self.name)]
        for name, b in [*((f"body {k}", b) for k, b in self.bodies.items()), ("all together", self.total)]:
            axes = "z" if self.planar else letters(b.axes) or directions(b.axes)
            out.append((name, f"{b.mass:.5g} kg at {_tuple(b.position)} m, {_list(b.moments)} kg m^2 about {axes}"))
        return out

    def __str__(self) -> str:
        what = "moment about z" if self.planar else "principal moments"
        head = ["", "mass [kg]", "com, body [m]", "com, world [m]", f"{what} [kg m^2]", "axes"]
        head += ["radius of gyration [m]", "volume [m^3]"]
        rows, below = [head], []
        for name, b in [*self.bodies.items(), ("all together", self.total)]:
            axes = "z" if self.planar else letters(b.axes)
            if not axes:
                axes = "below"
                below.append(f"principal axes of {name}: {directions(b.axes)}")
            volume = "" if b.volume is None else f"{b.volume:.5g}"
            com = "" if b is self.total else _tuple(b.com)
            row = [name, f"{b.mass:.5g}", com, _tuple(b.position), _list(b.moments), axes, _list(b.gyration), volume]
            rows.append(row)
        drop = {k for k in range(len(head)) if self.planar and head[k] == "axes"}
        width = [max(len(row[k]) for row in rows) for k in range(len(head))]
        lines = ["  ".join(f"{row[k]:<{width[k]}}" for k in range(len(head)) if k not in drop) for row in rows]
        return "\n".join([x.rstrip() for x in lines] + below)


def letters(axes: np.ndarray) -> str:
    """The body's axes that the principal ones are, such as "z, x, y"; nothing if they are others."""
    size = np.abs(axes).T
    if np.abs(size.max(axis=1) - 1.0).max() > ALIGNED or np.sort(size, axis=1)[:, :2].max() > ALIGNED:
        return ""
    return ", ".join("xyz"[k] for k in size.argmax(axis=1))


def directions(axes: np.ndarray) -> str:
    """The principal axes as vectors."""
    return ", ".join(_tuple(np.where(np.abs(a) < ALIGNED, 0.0, a)) for a in axes.T)


def _tuple(p: np.ndarray) -> str:
    """Components in brackets; what is only rounding beside the others is 0."""
    return tuple_of(p, 5)


def _list(p: np.ndarray) -> str:
    return ", ".join(f"{x:.5g}" for x in p)


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value
