"""Is the description sound? Freedoms, redundancy, assembly and mass properties, looked at before any motion."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ..model.body import GROUND
from ..model.element import LawOf, fields_with
from ..model.force import CoordinateForce
from ..model.model import Model
from ..results.departure import Departure, changed_velocities, not_allowed, summary
from ..tables.values import Values
from .assemble import assemble
from .assembly.start import Assembly
from .mass import MassProperties, directions, letters, report
from .mobility import mobility
from .motion.ahead import missed_at_start

FAR = 30.0  # a radius of gyration this many times the body's size, or this part of it, is worth a look
EQUAL = 1e-9  # moments that differ by less than this part are the same
BARELY = 1e-3  # slack of the triangle inequality, as part of the largest moment, below which a body is all but flat


@dataclass(frozen=True)
class BodyReport:
    """Mass properties of a body as used."""

    mass: float  # [kg]
    com: tuple[float, ...]  # centre of mass in the reference frame [m]
    moments: tuple[float, ...]  # principal moments about the centre of mass [kg m^2], ascending; planar: one
    axes: tuple[tuple[float, ...], ...]  # their axes: three vectors in body axes; planar: none

    def line(self) -> str:
        """What a reader wants to see."""
        com = ", ".join(f"{x:.4g}" for x in self.com)
        moments = ", ".join(f"{x:.4g}" for x in self.moments)
        text = f"{self.mass:.4g} kg, centre of mass ({com}) m, "
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
            com = ", ".join(f"{x:.4g}" for x in self.com)
            out.append(("all together", f"{self.mass:.4g} kg, centre of mass at ({com}) m"))
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


def check(model: Model) -> Report:
    """Look a mechanism over without simulating it.

    Parameters
    ----------
    model : Model

    Returns
    -------
    Report

    Raises
    ------
    ModelError
        If the description is wrong: no bodies, or a body that can move without inertia.
    AssemblyError
        If no position or velocity fulfils all constraints.
    """
    a = assemble(model)
    m = mobility(model, a, inertia=True)
    x = a.compiled.values
    weights = report(model, x, a.q)
    bodies = {name: _body(b, model.planar) for name, b in weights.bodies.items()}
    return Report(
        name=model.name,
        planar=model.planar,
        bodies=bodies,
        joints=len(model.joints),
        forces=len(model.forces),
        drivers=len(model.drivers),
        gruebler=m.gruebler,
        freedoms=m.freedoms,
        redundant=m.redundant,
        redundancy=m.redundancy,
        undetermined=m.undetermined,
        moved=a.moved,
        departures=a.departures,
        mass=weights.total.mass,
        com=tuple(weights.total.com.tolist()),
        warnings=tuple(_warnings(model, a, bodies, m.freedoms)),
    )


def _body(b: MassProperties, planar: bool) -> BodyReport:
    axes = () if planar else tuple(map(tuple, b.axes.T.tolist()))
    return BodyReport(b.mass, tuple(b.com.tolist()), tuple(b.moments.tolist()), axes)


def _warnings(model: Model, a: Assembly, bodies: dict[str, BodyReport], freedoms: int) -> Iterator[str]:
    for b in model.bodies:
        yield from _of_inertia(a.compiled.values, b.name, bodies[b.name])
    yield from (not_allowed(d) for d in changed_velocities(a.departures))
    held, pushed = _touched(model)
    for b in model.bodies:
        if b.name not in held | pushed:
            kept = "; as_drawn keeps assembly from moving it, it does not weld it to ground" if b.as_drawn else ""
            yield f"body {b.name!r} has neither a joint nor a force: it moves on its own{kept}"
    if not model.gravity_told and not model.gravity_vector().any():
        example = "(0, -9.81)" if model.planar else "(0, 0, -9.81)"
        yield f"no gravity; if that is not meant, give gravity={example}"
    if model.drivers and freedoms == 0:
        yield "drivers take every freedom: the motion is prescribed, forces change only reactions and efforts"
    elif freedoms == 0:
        yield "no freedom is left: it is a structure and will not move"
    if any(x.beyond == "refuse" for x in model.tables) and (missed := missed_at_start(a)):
        yield missed.message
    used = _names_used(model)
    for name in model.parameters:
        if name not in used:
            yield f"parameter {name!r} is used nowhere"


def _touched(model: Model) -> tuple[set[str], set[str]]:
    """Bodies that some joint or driver holds, and bodies that some force acts on."""
    held, pushed = set(), set()
    for joint in model.joints:
        held |= {model.carrier(name, joint) for name in (joint.body_i, joint.body_j)}
    for driver in model.drivers:
        owner, _ = model.coordinate(driver.coordinate, driver)
        held |= {getattr(owner, "body", getattr(owner, "name", ""))}
    for force in model.forces:
        pushed |= {model.carrier(name, force) for name in force.ends().values()}
        if isinstance(force, CoordinateForce) and force.coordinate_text():
            owner, _ = model.coordinate(force.coordinate_text(), force)
            pushed |= {getattr(owner, "body", getattr(owner, "name", ""))}
    return held - {GROUND}, pushed - {GROUND}


def _of_inertia(x: Values, name: str, b: BodyReport) -> Iterator[str]:
    """Inertia against the body's size: where joints, forces and shapes attach, how far from the centre of mass."""
    k = x.structure.place[name]
    arms = x.system.frame_x[x.system.frame_i == k, :3]
    size = float(np.sqrt((arms**2).sum(axis=1)).max(initial=0.0))
    radius = float(np.sqrt(max(b.moments) / b.mass))
    if size > 0.0 and radius > FAR * size:
        yield (
            f"body {name!r}: its inertia is that of a body {radius:.3g} m across, but its joints lie within "
            f"{size:.3g} m of its centre of mass; check the unit (kg m^2) and inertia_about"
        )
    elif 0.0 < radius < size / FAR:
        yield (
            f"body {name!r}: its inertia is that of a body {radius:.3g} m across, but its joints lie {size:.3g} m "
            f"from its centre of mass; check the unit (kg m^2)"
        )
    if len(b.moments) == 3:
        p, q, r = b.moments
        numbers = f"body {name!r}: its principal moments {p:g}, {q:g}, {r:g} kg m^2"
        if p > 0.0 and p + q - r < -1e-15 * r:
            yield f"{numbers} break the triangle inequality, though within rounding"
        elif q - p > BARELY * r and abs(p + q - r) < BARELY * r and p > BARELY * r and not _flat(x, name):
            yield f"{numbers} are those of a flat plate (the first two add up to the third)"


def _flat(x: Values, name: str) -> bool:
    """Whether its inertia was computed from shapes, so that flatness is meant."""
    return x.numbers[name].inertia is None


def _names_used(model: Model) -> set[str]:
    """Every word in every text of the description: parameters that are used are among them."""
    import re

    from ..model.element import written

    text = repr([written(e) for e in model.elements()]) + repr(model.gravity) + repr(list(model.parameters.values()))
    return set(re.findall(r"\w+", text)).union(*(inspect.signature(f).parameters for f in _functions(model)))


def _functions(model: Model) -> Iterator[Callable]:
    """Python functions that are laws."""
    for e in model.elements():
        for name in fields_with(e.__class__, LawOf):
            value = getattr(e, name)
            yield from (law for law in (value if isinstance(value, tuple) else (value,)) if callable(law))
