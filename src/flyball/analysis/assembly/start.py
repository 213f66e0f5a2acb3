"""A consistent start: closed positions and velocities near those described."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...model.body import Body, Driver, Frame
from ...model.element import LawOf
from ...model.expressions import Expression, number
from ...model.geometry import quaternion_to_matrix, rotation_about
from ...model.model import Model
from ...results.departure import Departure
from ...results.numbers import tuple_of
from ...tables.coordinates import BodyState
from ..compiled import Compiled, compiled, places
from .described import fast, not_kept
from .gaps import contradictory_velocities, disagreement, no_rate
from .positions import CLOSED, OPEN, close, misfit, newton, rounding
from .velocities import consistent, contradiction

MOST = 4  # assembled starts of the same numbers that are kept


@dataclass(repr=False)
class Assembly:
    """A consistent start: the compiled mechanism, its state, and what of the description could not be kept."""

    compiled: Compiled
    t: float
    q: np.ndarray
    v: np.ndarray
    moved: dict[str, float] = field(default_factory=dict)  # body -> how far its mass centre went [m]
    iterations: int = 0
    departures: tuple[Departure, ...] = ()  # changed positions, given velocities that cannot be, very large others

    def again(self) -> Assembly:
        """The same with arrays and scratch of its own."""
        c, q, v = self.compiled.again(), self.q.copy(), self.v.copy()
        return Assembly(c, self.t, q, v, dict(self.moved), self.iterations, self.departures)

    def of(self, c: Compiled) -> Assembly:
        """The same of a mechanism that differs in forces and controllers alone, whose states begin as these say."""
        a, n = self.again(), len(c.structure.controls)
        z = np.concatenate([c.z[:n], a.compiled.z[n:]])
        a.compiled = Compiled(c.values, z, c.parameters)
        return a

    @property
    def y(self) -> np.ndarray:
        """State vector with work states zero."""
        return np.concatenate([self.q, self.v, self.compiled.z])

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts for people: where every mass centre begins and how it moves, what could not be kept."""
        length = self.compiled.values.length
        out = [("assembled", f"{self.compiled.structure.model.name}, t = {self.t:g} s, {self.iterations} iterations")]
        bodies = self._bodies()
        fast, spin = (max(float(np.abs(x).max()) for x in (getattr(b, k) for b in bodies.values())) for k in "vw")
        for name, b in bodies.items():
            at, moves, spins = tuple_of(b.p, 6, length), tuple_of(b.v, 6, fast), tuple_of(b.w, 6, spin)
            out.append((name, f"mass centre {at} m, velocity {moves} m/s, turning {spins} rad/s"))
        out += [("moved", f"{name} by {way:.3g} m") for name, way in self.moved.items()]
        return [*out, *(("not kept", d.text) for d in self.departures)]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, world axes: the same."""
        bodies = {
            name: {"mass_centre": b.p.tolist(), "velocity": b.v.tolist(), "angular_velocity": b.w.tolist()}
            for name, b in self._bodies().items()
        }
        gone = [d.as_dict() for d in self.departures]
        return {"t": self.t, "iterations": self.iterations, "bodies": bodies, "moved": self.moved, "departures": gone}

    def __repr__(self) -> str:
        """The lines."""
        return "\n".join(f"{label:<12} {text}" for label, text in self.lines())

    def _bodies(self) -> dict[str, BodyState]:
        return self.compiled.moving(self.t, self.q, self.v)


Why = Callable[[Compiled, float, np.ndarray, np.ndarray, np.ndarray], str]
"""(mechanism, t, q, v, right-hand sides of its rows) -> why no velocities fulfil these; "" if that is not known."""


def assembled(
    model: Model, *, t: float = 0.0, parameters: Mapping[str, float] | None = None, why: Why | None = None
) -> Assembly:
    """Find positions and velocities that fulfil all constraints at time t, near those described.

    Raises
    ------
    AssemblyError
        If no closed position, or no consistent velocity, is found; the message names the joints that disagree and by
        how much.
    """
    plain = compiled(model, parameters=parameters)
    x = plain.values
    model, key = x.structure.model, float(t).hex()
    home = x if _own_places(plain) else x.unforced
    found = home.kept.get("assembled", key, MOST, lambda: _found(model, plain, t, parameters, why).again())
    return found.again() if found.compiled.values is x else found.of(plain)


def _own_places(c: Compiled) -> bool:
    """Whether turns and places as drawn are others than those of the values that differ in forces alone."""
    x, n = c.values, len(c.structure.controls)
    if (other := x.alike) is None:
        return True
    return not np.array_equal(c.z[n:], other.kept.get("places", None, 1, lambda: places(other))[n:])


def _found(
    model: Model, plain: Compiled, t: float, parameters: Mapping[str, float] | None, why: Why | None
) -> Assembly:
    env = plain.values.env
    values, initial_rates = told(model, env)
    known = dict(values) | driven(model, t, env)
    plain.follow(turns(plain, known))
    drawn = plain.values.q.copy()
    wind(plain, known, drawn)
    q, count = _closed(model, plain, t, drawn, values, parameters)
    plain.at(t, q, plain.values.v)
    if error := no_rate(plain, t):
        raise error
    v, wanted, c = consistent(model, plain, parameters, t, q, initial_rates)
    if gaps := contradiction(wanted, v):
        said = why(c, t, q, v, wanted.nu) if why is not None and not wanted.held else ""
        raise contradictory_velocities(c, gaps, Assembly(plain, t, q, v), said)
    plain.at(t, q, v)
    near = rounding(plain)
    rates = wanted.scale[: len(wanted.nu)] * wanted.nu
    departures = (*_repositioned(plain, drawn, q, near), *not_kept(plain, q, v), *fast(plain, q, v, rates))
    return Assembly(plain, t, q, v, _moved(plain, drawn, q, near), count, departures)


def _closed(
    model: Model,
    plain: Compiled,
    t: float,
    drawn: np.ndarray,
    values: Mapping[str, float],
    parameters: Mapping[str, float] | None,
) -> tuple[np.ndarray, int]:
    """A closed position near the drawn one, and how many iterations led there; ``plain`` follows its turns."""
    q, v = drawn.copy(), plain.values.v
    holds = [i for i in model.initial if i.name in values]
    near = plain
    if holds or not all(r.holonomic for r in plain.structure.rows):
        near = compiled(model, parameters=parameters, positions=True, holds=holds, held=values)
        near.follow(plain.hints)
    count = 0
    if misfit(near, t, q, v, 0.0) > CLOSED or _by_frames(model):  # as near as rounding allows, not only within it
        far = compiled(model, parameters=parameters, far=True, holds=holds, held=values)
        far.follow(plain.hints)
        if misfit(far, t, q, v) > OPEN:
            q, count = close(far, t, q, v)
            near.follow(far.hints)
        q, more = newton(near, t, q, v)
        count += more
        if misfit(near, t, q, v) > CLOSED or misfit(far, t, q, v) > OPEN:
            plain.follow(near.hints)
            raise disagreement(far, Assembly(plain, t, q, v))
    plain.follow(near.hints)
    return q, count


def _by_frames(model: Model) -> bool:
    """Whether some joint is given by frames, so that nothing says it is drawn closed."""
    return any(j.at is None for j in model.joints)


def _moved(c: Compiled, before: np.ndarray, after: np.ndarray, near: float) -> dict[str, float]:
    """Body -> how far its mass centre went, beyond rounding."""
    out: dict[str, float] = {}
    if np.array_equal(before, after):
        return out
    k = 2 if c.structure.model.planar else 3
    for name, b in c.structure.place.items():
        if b >= 0:
            at = slice(int(c.values.system.tree.q[b]), int(c.values.system.tree.q[b]) + k)
            d = float(np.linalg.norm(after[at] - before[at]))
            if d > 1e-12 * c.values.length + near:
                out[name] = d
    return out


def _repositioned(c: Compiled, before: np.ndarray, after: np.ndarray, near: float) -> list[Departure]:
    """Poses of reference frames that are not those drawn, beyond rounding."""
    out: list[Departure] = []
    if np.array_equal(before, after):
        return out
    x = c.values
    k = 2 if x.structure.model.planar else 3
    small = 1e-12 * x.length + near
    for name, b in x.structure.place.items():
        if b < 0:
            continue
        at, n = int(x.system.tree.q[b]), int(x.system.tree.nq[b])
        was, now = before[at : at + n], after[at : at + n]
        p, o = (_origin(z, x.bodies[name], k) for z in (was, now))
        what, unit = ("angle", "rad") if k == 2 else ("orientation", "1")
        turned = Departure(name, what, tuple(was[k:].tolist()), tuple(now[k:].tolist()), unit)
        if np.linalg.norm(o - p) > small:
            out.append(Departure(name, "position", tuple(p.tolist()), tuple(o.tolist()), "m"))
        if n > k and turned.distance > 1e-12:
            out.append(turned)
    return out


def _origin(q: np.ndarray, drawn: Any, k: int) -> np.ndarray:
    """Origin of a body's reference frame from its coordinates; a point mass stays turned as it is drawn."""
    R = drawn.R if len(q) == k else rotation_about(2, q[2]) if k == 2 else quaternion_to_matrix(q[3:7])
    return q[:k] - (R @ drawn.com)[:k]


# What is asked of the start besides the drawing: initial conditions, and what drivers say of it.


def turns(c: Compiled, known: Mapping[str, float]) -> dict[str, float]:
    """What the states that count turns begin near, where coordinates are told their value."""
    out = {}
    for name in set(known) & set(c.structure.state_at):
        joint, what = c.structure.model.coordinate(name, c.structure.model.bodies[0])
        coordinate = joint.coordinates[what] if hasattr(joint, "coordinates") else None
        sign = coordinate.sign if coordinate else 1.0
        offset = joint.offset(c.values.numbers[joint.name], what) if coordinate else 0.0
        out[name] = sign * (known[name] - offset)
    return out


def wind(c: Compiled, known: Mapping[str, float], q: np.ndarray) -> None:
    """Bodies in the plane that are told their angle begin with its whole turns."""
    s = c.structure
    for name, value in known.items():
        owner, what = s.model.coordinate(name, s.model.bodies[0])
        if what != "angle" or not isinstance(owner, (Body, Frame)):
            continue
        b = s.place[s.model.carrier(owner.name, owner)]
        if b >= 0:
            whole = np.round((value - c.values.poses.turned(owner)) / (2.0 * np.pi))
            q[s.tables["tree"].q[b] + 2] += 2.0 * np.pi * whole


def told(model: Model, env: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Values and rates that initial conditions ask for."""
    values, rates = {}, {}
    for i in model.initial:
        unit = model.unit(i.name, i)
        if i.value is not None:
            values[i.name] = number(i.value, env, unit, f"value of {i.title}")
        if i.rate is not None:
            rates[i.name] = number(i.rate, env, f"{unit}/s", f"rate of {i.title}")
    return values, rates


def _law(model: Model, d: Driver) -> Expression:
    return model.law(d.law, LawOf(model.unit(d.coordinate, d)), f"law of {d.title}")


def driven(model: Model, t: float, env: Mapping[str, float]) -> dict[str, float]:
    """What drivers' laws ask for at time t, as far as they follow time alone."""
    out = {}
    model = model.snapshot()
    tables = {x.name: x for x in model.tables}
    laws = model.kept.get("laws of drivers", None, 1, lambda: {d.name: _law(model, d) for d in model.drivers})
    for d in model.drivers:
        law = laws[d.name]
        if law.names <= {"t", *env}:
            out[d.coordinate] = law.evaluate({**env, "t": t}, tables=tables)
    return out
