"""A driven mechanism with one driver's law taken away: the equations that its coordinate's value is a parameter of.

All coordinates of joints and bodies become rows behind the mechanism's own, so that their values, gradients and
accelerations come from the formulas that the motion uses, and every vector is told by names.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...errors import ModelError
from ...model.body import Driver, Initial
from ...model.element import LawOf
from ...model.joint import Joint
from ...model.model import Model, listing, suggest
from ..assemble import assemble
from ..assembly.start import Assembly
from ..compiled import compiled
from .closure import Closure, Place


@dataclass
class Freed:
    """The equations, where the mechanism starts, and the names of what moves."""

    model: Model
    driver: Driver
    closure: Closure
    start: Place
    labels: list[str]  # of coordinates, then of the angular velocities of spatial bodies
    units: list[str]  # of coordinates ("m" or "rad"); of angular velocities "rad"
    row_of: list[int]  # row of each coordinate
    coordinates: int  # how many labels are coordinates

    @property
    def unit(self) -> str:
        """Unit of the driver's coordinate."""
        return self.units[self.labels.index(self.driver.coordinate)]

    def values(self, x: Place, near: np.ndarray | None = None) -> np.ndarray:
        """Values of the coordinates; angles are those next to ``near``."""
        self.closure.residual(x)
        out = self.closure.c.work.rows.value[self.row_of].copy()
        if near is not None:
            turns = 2.0 * np.pi * np.round((near - out) / (2.0 * np.pi))
            out += np.where([u == "rad" for u in self.units[: self.coordinates]], turns, 0.0)
        return out

    def rates(self, x: Place, d: np.ndarray, e: np.ndarray | None = None) -> np.ndarray:
        """Rates of the labels at the velocity d; with ``e``, their accelerations at the acceleration e."""
        k = self.closure
        v = d[:-1] * k.scale
        k.residual(x, v)
        W, S = k.c.work, k.c.values.system
        bias = -W.rows.gamma[self.row_of]
        v = v if e is None else e[:-1] * k.scale
        out = (k.c.jacobian() @ v)[self.row_of]
        if e is not None:
            out += bias
        turning = []
        for b, (v0, nv) in enumerate(zip(S.tree.v, S.tree.nv, strict=True)):
            if nv == 6:
                turning.append(W.BK[b, 3:12].reshape(3, 3) @ v[v0 + 3 : v0 + 6])
        return np.r_[out, np.concatenate(turning)] if turning else out

    def outline(self, x: Place) -> list[tuple[str, str, np.ndarray]]:
        """(body, joint, point in the world) of everything that a joint attaches to."""
        self.closure.at(x)
        s = self.closure.c.structure
        names = {b: name for name, b in s.place.items()}
        return [
            (names[spec.body], spec.element.name, self.closure.c.work.FK[k, :3].copy())
            for k, spec in enumerate(s.frames)
            if spec.role in ("F", "M") and isinstance(spec.element, Joint) and not spec.coordinate
        ]


def freed(model: Model, driver: str, t: float, parameters: Mapping[str, float] | None) -> Freed:
    """Assemble as described, then take the driver's law away; the other drivers stay where they are at time t.

    Raises
    ------
    ModelError
        If there is no such driver, or constraints restrain velocities only.
    AssemblyError
        If the start cannot be assembled.
    """
    names = [d.name for d in model.drivers]
    if driver not in names:
        known = listing(names) if names else "it has none; add a Driver of the coordinate that is to be varied"
        raise ModelError(f"{model.name!r} has no driver {driver!r}{suggest(driver, names)}; {known}")
    a = assemble(model, t=t, parameters=parameters)
    own = a.compiled.structure
    if loose := sorted({r.element.name for r in own.rows if not r.holonomic}):
        raise ModelError(
            f"{model.name!r}: {', '.join(loose)} restrain velocities only, so where the mechanism is depends on its "
            f"way there, and positions cannot be followed over a driver's coordinate"
        )
    env = model.environment(parameters)
    copy = model.copy()
    copy.drivers = [_stopped(model, d, t, env) for d in model.drivers if d.name != driver]
    copy.forces, copy.sensors = [], [x for x in model.sensors if _named(x.name, copy.drivers)]
    labels = _coordinates(model)
    copy.initial = [Initial(name, value=0.0) for name in labels]
    c = compiled(copy, parameters=parameters, holds=copy.initial)
    c.follow(a.compiled.hints)
    rows = [c.structure.slices[name].start for name in labels]
    mine = model[driver]
    if mine.coordinate not in labels:
        raise ModelError(f"{mine.title}: its coordinate {mine.coordinate!r} cannot be varied")
    closure = Closure(c, min(rows), rows[labels.index(mine.coordinate)])
    units = [model.unit(name, mine) for name in labels]
    count = len(labels)
    if not model.planar:
        bodies = sorted((b for b, k in c.structure.place.items() if k >= 0), key=lambda b: c.structure.place[b])
        labels = [
            *labels,
            *(f"{b}.omega_{axis}" for b in bodies for axis in "xyz"),
        ]
        units = [*units, *["rad"] * (3 * len(bodies))]
    out = Freed(model, mine, closure, Place(a.q, 0.0, c.z.copy()), labels, units, rows, count)
    value = float(out.values(out.start)[labels.index(mine.coordinate)])
    return replace(out, start=Place(a.q, _turned(out, a, value, t, env), out.start.z))


def _coordinates(model: Model) -> list[str]:
    """Every coordinate that a driver could drive: of joints, of bodies, and what drivers drive beside."""
    axes = ("x", "y", "angle") if model.planar else ("x", "y", "z")
    out = [f"{j.name}.{what}" for j in model.joints for what in j.measured(model.planar)]
    out += [f"{b.name}.{axis}" for b in model.bodies for axis in axes]
    return list(dict.fromkeys([*out, *(d.coordinate for d in model.drivers)]))


def _named(name: str, drivers: list[Driver]) -> bool:
    return any(isinstance(d.law, str) and re.search(rf"\b{re.escape(name)}\b", d.law) for d in drivers)


def _stopped(model: Model, d: Driver, t: float, env: Mapping[str, float]) -> Driver:
    """A driver that stays at what it asks for at time t; one that follows sensors goes on doing so."""
    law = model.law(d.law, LawOf(model.unit(d.coordinate, d)), f"law of {d.title}", driver=True)
    if law.names <= {"t", *env}:
        return replace(d, law=float(law.evaluate({**env, "t": t}, tables={x.name: x for x in model.tables})))
    return replace(d, law=re.sub(r"\bt\b", f"({t!r})", str(law)))


def _turned(f: Freed, a: Assembly, value: float, t: float, env: Mapping[str, float]) -> float:
    """The driver's coordinate at the start with the whole turns of its law."""
    law = f.model.law(f.driver.law, LawOf(f.unit), f"law of {f.driver.title}", driver=True)
    if f.unit != "rad" or not law.names <= {"t", *env}:
        return value
    told = float(law.evaluate({**env, "t": t}, tables={x.name: x for x in f.model.tables}))
    return value + 2.0 * np.pi * np.round((told - value) / (2.0 * np.pi))
