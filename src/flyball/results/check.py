"""What a look at a mechanism found out before any motion."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from .departure import Departure, summary
from .mass import directions, letters
from .numbers import tuple_of

EQUAL = 1e-9  # moments that differ by less than this part are the same


@dataclass(frozen=True)
class BodyReport:
    """Mass properties of a body as used."""

    mass: float  # [kg]
    com: tuple[float, ...]  # centre of mass in the reference frame [m]
    moments: tuple[float, ...]  # principal moments about the centre of mass [kg m^2], ascending; planar: one
    axes: tuple[tuple[float, ...], ...]  # their axes: three vectors in body axes; planar: none

    def line(self) -> str:
        """What a reader wants to see."""
        com = tuple_of(self.com)
        moments = ", ".join(f"{x:.4g}" for x in self.moments)
        text = f"{self.mass:.4g} kg, centre of mass {com} m, "
        if not self.axes:
            return text + f"inertia {moments} kg m^2"
        if self.moments[-1] - self.moments[0] <= EQUAL * self.moments[-1]:
            return text + f"inertia {self.moments[0]:.4g} kg m^2 about every axis"
        axes = np.array(self.axes).T
        if names := letters(axes):
            return text + f"inertia {moments} kg m^2 about {names}"
        return text + f"principal moments {moments} kg m^2 about {directions(axes)}"


@dataclass(frozen=True)
class Report:
    """What `Mechanism.check` found out."""

    name: str
    planar: bool
    bodies: dict[str, BodyReport]
    joints: int
    forces: int
    drivers: int
    gruebler: int  # freedoms by counting
    freedoms: int  # freedoms by rank
    redundant: tuple[str, ...]  # elements whose constraints depend on one another
    redundancy: int  # how many rows say nothing new
    undetermined: dict[str, tuple[str, ...]]  # joint -> reaction components
    moved: dict[str, float]  # body -> how far assembly moved its centre of mass [m]
    departures: tuple[Departure, ...]  # what of the description the assembled start does not have
    mass: float  # of all bodies together [kg]
    com: tuple[float, ...]  # their centre of mass in the world, assembled [m]
    warnings: tuple[str, ...] = field(default=())
    events: dict[str, str] = field(default_factory=dict)  # event -> when it is, and what it does
    cut: str = ""  # whether `redundant` and `undetermined` are not complete, in words

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self) | {"departures": [d.as_dict() for d in self.departures]}

    def lines(self) -> list[tuple[str, str]]:
        """Label and text of what a reader wants to see first."""
        plane = "planar" if self.planar else "spatial"
        counts = f"{_count(len(self.bodies), 'body', 'bodies')}, {_count(self.joints, 'joint')}"
        counts += f", {_count(self.forces, 'force')}, {_count(self.drivers, 'driver')}"
        out = [("mechanism", f"{self.name} ({plane}): {counts}"), ("freedoms", self._freedoms())]
        if self.redundant:
            names = ", ".join(self.redundant[:12]) + (", ..." if len(self.redundant) > 12 else "")
            out.append(("redundant", f"{_count(self.redundancy, 'constraint')} too many, among {names}"))
        if self.cut:
            out.append(("redundant", self.cut))
        if self.undetermined:
            first = list(self.undetermined.items())[:12]
            text = "; ".join(f"{k}: {', '.join(v)}" for k, v in first) + (
                "; ..." if len(self.undetermined) > 12 else ""
            )
            out.append(("reactions not determined", text))
        out.append(("assembly", summary(self.departures)))
        for name, b in list(self.bodies.items())[:30]:
            out.append((f"body {name}", b.line()))
        if len(self.bodies) > 30:
            out.append(("", f"... and {len(self.bodies) - 30} more bodies"))
        if len(self.bodies) > 1:
            out.append(("all together", f"{self.mass:.4g} kg, centre of mass at {tuple_of(self.com)} m"))
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


def _count(n: int, one: str, many: str = "") -> str:
    return f"{n} {one if n == 1 else many or one + 's'}"
