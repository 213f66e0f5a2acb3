"""Mass properties of bodies and of a whole mechanism, and the report of `Mechanism.check`."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np

from ..errors import ModelError
from ..model.messages import listing, suggest
from .health import InitialDeviation, deviation_summary
from .wording import tuple_text

AXIS_TOLERANCE = 1e-9  # a principal axis that differs by less from an axis of the body counts as that axis


@dataclass(frozen=True, eq=False)
class PrincipalMassProperties:
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
        return {f.name: _as_data(getattr(self, f.name)) for f in fields(self)}


@dataclass(frozen=True, eq=False)
class MassReport:
    """Result of `Mechanism.mass_properties`: ``report["crank"].moments``, ``report.total.mass``; printed as a table.

    Attributes
    ----------
    name : str
        Of the mechanism.
    bodies : dict of MassProperties
        By name of the body.
    total : MassProperties
        All bodies together, in the initial position.
    """

    name: str
    planar: bool
    bodies: dict[str, PrincipalMassProperties]
    total: PrincipalMassProperties

    def __getitem__(self, name: str) -> PrincipalMassProperties:
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
            axes = "z" if self.planar else axis_letters(b.axes) or axis_directions(b.axes)
            out.append(
                (name, f"{b.mass:.5g} kg at {_vector_text(b.position)} m, {_list_text(b.moments)} kg m^2 about {axes}")
            )
        return out

    def __str__(self) -> str:
        what = "moment about z" if self.planar else "principal moments"
        head = ["", "mass [kg]", "com, body [m]", "com, world [m]", f"{what} [kg m^2]", "axes"]
        head += ["radius of gyration [m]", "volume [m^3]"]
        rows, below = [head], []
        for name, b in [*self.bodies.items(), ("all together", self.total)]:
            axes = "z" if self.planar else axis_letters(b.axes)
            if not axes:
                axes = "below"
                below.append(f"principal axes of {name}: {axis_directions(b.axes)}")
            volume = "" if b.volume is None else f"{b.volume:.5g}"
            com = "" if b is self.total else _vector_text(b.com)
            row = [
                name,
                f"{b.mass:.5g}",
                com,
                _vector_text(b.position),
                _list_text(b.moments),
                axes,
                _list_text(b.gyration),
                volume,
            ]
            rows.append(row)
        drop = {k for k in range(len(head)) if self.planar and head[k] == "axes"}
        width = [max(len(row[k]) for row in rows) for k in range(len(head))]
        lines = ["  ".join(f"{row[k]:<{width[k]}}" for k in range(len(head)) if k not in drop) for row in rows]
        return "\n".join([x.rstrip() for x in lines] + below)


def axis_letters(axes: np.ndarray) -> str:
    """Return the body's axes that are principal axes, such as "z, x, y"; empty if they differ."""
    size = np.abs(axes).T
    if np.abs(size.max(axis=1) - 1.0).max() > AXIS_TOLERANCE or np.sort(size, axis=1)[:, :2].max() > AXIS_TOLERANCE:
        return ""
    return ", ".join("xyz"[k] for k in size.argmax(axis=1))


def axis_directions(axes: np.ndarray) -> str:
    """The principal axes as vectors."""
    return ", ".join(_vector_text(np.where(np.abs(a) < AXIS_TOLERANCE, 0.0, a)) for a in axes.T)


def _vector_text(p: np.ndarray) -> str:
    """Return components in brackets; negligible ones are 0."""
    return tuple_text(p, 5)


def _list_text(p: np.ndarray) -> str:
    return ", ".join(f"{x:.5g}" for x in p)


def _as_data(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


EQUAL_MOMENTS = 1e-9  # moments that differ by less than this fraction count as equal


@dataclass(frozen=True)
class BodyReport:
    """Mass properties of a body as used."""

    mass: float  # [kg]
    com: tuple[float, ...]  # centre of mass in the reference frame [m]
    moments: tuple[float, ...]  # principal moments about the centre of mass [kg m^2], ascending; planar: one
    axes: tuple[tuple[float, ...], ...]  # their axes: three vectors in body axes; planar: none

    def line(self) -> str:
        """What a reader wants to see."""
        com = tuple_text(self.com)
        moments = ", ".join(f"{x:.4g}" for x in self.moments)
        text = f"{self.mass:.4g} kg, centre of mass {com} m, "
        if not self.axes:
            return text + f"inertia {moments} kg m^2"
        if self.moments[-1] - self.moments[0] <= EQUAL_MOMENTS * self.moments[-1]:
            return text + f"inertia {self.moments[0]:.4g} kg m^2 about every axis"
        axes = np.array(self.axes).T
        if names := axis_letters(axes):
            return text + f"inertia {moments} kg m^2 about {names}"
        return text + f"principal moments {moments} kg m^2 about {axis_directions(axes)}"


@dataclass(frozen=True)
class Report:
    """Result of `Mechanism.check`."""

    name: str
    planar: bool
    bodies: dict[str, BodyReport]
    joints: int
    forces: int
    drivers: int
    gruebler: int  # degrees of freedom by counting
    freedoms: int  # degrees of freedom by rank
    redundant: tuple[str, ...]  # elements with dependent constraints
    redundancy: int  # number of redundant rows
    undetermined: dict[str, tuple[str, ...]]  # joint -> reaction components
    moved: dict[str, float]  # body -> displacement of its centre of mass by assembly [m]
    departures: tuple[InitialDeviation, ...]  # numbers of the description that the assembled state does not satisfy
    mass: float  # of all bodies together [kg]
    com: tuple[float, ...]  # their centre of mass in the world, assembled [m]
    warnings: tuple[str, ...] = field(default=())
    events: dict[str, str] = field(default_factory=dict)  # event -> description of its condition and actions
    cut: str = ""  # why `redundant` and `undetermined` are incomplete, if so

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self) | {"departures": [d.as_dict() for d in self.departures]}

    def lines(self) -> list[tuple[str, str]]:
        """Label and text of what a reader wants to see first."""
        plane = "planar" if self.planar else "spatial"
        counts = f"{_count_text(len(self.bodies), 'body', 'bodies')}, {_count_text(self.joints, 'joint')}"
        counts += f", {_count_text(self.forces, 'force')}, {_count_text(self.drivers, 'driver')}"
        out = [("mechanism", f"{self.name} ({plane}): {counts}"), ("freedoms", self._freedoms())]
        if self.redundant:
            names = ", ".join(self.redundant[:12]) + (", ..." if len(self.redundant) > 12 else "")
            out.append(("redundant", f"{_count_text(self.redundancy, 'constraint')} too many, among {names}"))
        if self.cut:
            out.append(("redundant", self.cut))
        if self.undetermined:
            first = list(self.undetermined.items())[:12]
            text = "; ".join(f"{k}: {', '.join(v)}" for k, v in first) + (
                "; ..." if len(self.undetermined) > 12 else ""
            )
            out.append(("reactions not determined", text))
        out.append(("assembly", deviation_summary(self.departures)))
        for name, b in list(self.bodies.items())[:30]:
            out.append((f"body {name}", b.line()))
        if len(self.bodies) > 30:
            out.append(("", f"... and {len(self.bodies) - 30} more bodies"))
        if len(self.bodies) > 1:
            out.append(("all together", f"{self.mass:.4g} kg, centre of mass at {tuple_text(self.com)} m"))
        out += [(f"event {name}", text) for name, text in list(self.events.items())[:12]]
        if len(self.events) > 12:
            out.append(("", f"... and {len(self.events) - 12} more events"))
        return out + [("warning", w) for w in self.warnings]

    def _freedoms(self) -> str:
        text = f"{self.freedoms} at this position"
        if self.gruebler != self.freedoms:
            text += f" (counting gives {self.gruebler})"
        return text

    def __str__(self) -> str:
        width = max(len(k) for k, _ in self.lines())
        return "\n".join(f"{k:<{width}}  {v}" for k, v in self.lines())


def _count_text(n: int, one: str, many: str = "") -> str:
    return f"{n} {one if n == 1 else many or one + 's'}"
