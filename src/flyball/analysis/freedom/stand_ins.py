"""What could stand in the place of elements: joints that hold less, or nothing; and the rows of all these.

Which kinds come into question, at what cost and under what name, their classes say (``replaceable``, ``stand_in``,
``omission``, ``called``). Whether one really holds a part of what is there, its rows show (`cures`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from ...errors import FlyballError
from ...model.body import Driver
from ...model.coupling import Coupling
from ...model.element import Element, resolve
from ...model.force import CoordinateForce
from ...model.geometry import triad, vector
from ...model.joint import Joint
from ...model.model import Model
from ...model.sensor import Sensor
from ...results.freedoms import Change
from ..compiled import Compiled, compiled
from .jacobian import Found, lengths

DIRECTIONS = 12  # that are tried for the axes of joints that are put in
PARALLEL = 1e-9


class Rows(NamedTuple):
    """Rows of an element in every position, of unit size, turns counted in lengths."""

    columns: np.ndarray  # velocities that they speak of, (w,)
    values: np.ndarray  # (positions, n, w)


@dataclass(frozen=True)
class Option:
    """An element as it is (no change), or a change that is tried; what it costs; its rows."""

    change: Change | None
    cost: float
    rows: Rows


def rows_of(c: Compiled, there: Found, names: Sequence[str], positions: Sequence[np.ndarray]) -> dict[str, Rows]:
    """Rows of elements of a compiled mechanism in the position where it was looked at, and in those next to it."""
    a = there.assembly
    S, still = c.values.system, np.zeros(c.structure.nv)
    ends, scale = S.row_start[: len(S.rows.law) + 1], lengths(c)
    columns = S.column[: ends[-1]]
    numbers = np.repeat(np.arange(len(ends) - 1), np.diff(ends))
    values = np.zeros((len(positions) + 1, len(columns)))
    for p, q in enumerate((a.q, *positions)):
        c.at(a.t, q, still if p else a.v)
        x = c.work.G[: ends[-1]] * scale[columns]
        size = np.sqrt(np.bincount(numbers, x * x, len(ends) - 1))
        values[p] = x / np.maximum(size, 1e-300)[numbers]
    out = {}
    for name in names:
        rows = c.structure.slices[name]
        n, first, last = rows.stop - rows.start, ends[rows.start], ends[rows.stop]
        own = np.unique(columns[first:last])
        dense = np.zeros((len(values), n, len(own)))
        dense[:, numbers[first:last] - rows.start, np.searchsorted(own, columns[first:last])] = values[:, first:last]
        out[name] = Rows(own, dense)
    return out


def options(there: Found, names: list[str], positions: Sequence[np.ndarray]) -> dict[str, list[Option]]:
    """What could stand in the place of each element, as it is first, then by cost; all rows from one compilation."""
    own = there.assembly.compiled
    model, env = own.structure.model, own.values.told
    probe = model.copy()
    found: dict[str, list[tuple[str, Joint]]] = {name: [] for name in names}
    directions = _directions(model, names, env)
    for name in names:
        for k, joint in enumerate(_weaker(model, model[name], env, directions)):
            try:
                probe.add(dataclasses.replace(joint, name=f"{name}:{k}"))
            except FlyballError:
                continue
            found[name].append((f"{name}:{k}", joint))
    c = compiled(probe, parameters=env, solved=False)
    c.follow(own.hints)
    rows = rows_of(c, there, [x for n in names for x in (n, *(k for k, _ in found[n]))], positions)
    out = {}
    for name in names:
        e = model[name]
        kind = type(e).__name__.lower()
        out[name] = [Option(Change(name, kind, joint), joint.stand_in, rows[k]) for k, joint in found[name]]
        if not _used(model, e):
            nothing = Rows(rows[name].columns, rows[name].values[:, :0])
            out[name].append(Option(Change(name, kind, None), e.omission, nothing))
        out[name] = [Option(None, 0.0, rows[name]), *sorted(out[name], key=lambda o: o.cost)]
    return out


def _weaker(model: Model, e: Element, env: dict[str, float], directions: list[tuple]) -> Iterator[Joint]:
    """Joints with fewer rows than a joint has, in its place."""
    if not isinstance(e, Joint) or not e.replaceable:
        return
    wanted = _used(model, e)
    for cls in _kinds(model.planar):
        if not wanted <= set(cls.coordinates):
            continue
        common: dict[str, Any] = {"at": e.at} if e.at is not None else {}
        kept = {k: getattr(e, k) for k in ("angle", "displacement") if hasattr(e, k) and hasattr(cls, k)}
        for more in _oriented(model, cls, e, env, directions):
            try:
                made = cls(e.name, e.body_i, e.body_j, **common, **kept, **more)
            except FlyballError:
                continue
            if len(made.rows(model.planar)) < len(e.rows(model.planar)):
                yield made


def _kinds(planar: bool) -> list[Any]:
    """Kinds of joints that say they may be put in, the cheapest first, then those with the fewest rows."""
    every: list[Any] = [c for c in Element.registry.values() if issubclass(c, Joint)]
    flat = {c.in_space for c in every if not c.spatial} if planar else set()  # in the plane their own kinds serve
    kinds = [c for c in every if c.stand_in and (c.planar_normal if planar else c.spatial) and c.__name__ not in flat]
    return sorted(kinds, key=lambda c: (c.stand_in, len(c.blocks), c.__name__))


def _oriented(model: Model, cls: Any, e: Any, env: dict[str, float], directions: list[tuple]) -> Iterator[dict]:
    """The axes that a joint of that kind may have there."""
    own = e.axis
    if hasattr(cls, "axes"):
        if own is not None and e.at is not None:
            R = triad(vector(resolve(e, env).axis, False, f"axis of {e.title}", direction=True))
            for k in (0, 1):
                yield {"axes": (own, tuple(R[:, k].tolist()))}
        return
    if not cls.needs_axis or (model.planar and cls.planar_normal == "z"):
        yield {}
        return
    if own is not None:
        yield {"axis": own}
    turns_freely = any(p.kind == "S" for p in cls.chain or ())
    if e.at is not None and (own is None or turns_freely):  # else only the axis that is there fits
        for d in directions:
            yield {"axis": d}


def _directions(model: Model, names: Sequence[str], env: dict[str, float]) -> list[tuple]:
    """Directions worth a try: the axes of joints of the sets, from joint to joint, and the axes of the world."""
    d = 2 if model.planar else 3
    out: list[np.ndarray] = []
    points = []
    for name in names:
        e = model[name]
        if isinstance(e, Joint) and e.at is not None:
            n = resolve(e, env)
            if np.ndim(n.at) == 1:
                points.append(vector(n.at, model.planar, name))
            if e.axis is not None and not (model.planar and e.planar_normal == "z"):
                out.append(vector(n.axis, model.planar, name, direction=True))
    lines = [q - p for p, q in combinations(points, 2)]
    out += [x / np.linalg.norm(x) for x in lines if np.linalg.norm(x) > 1e-9]
    out += list(np.eye(3)[:d])
    kept: list[np.ndarray] = []
    for x in out:
        if all(abs(abs(x @ y) - 1.0) > PARALLEL for y in kept) and len(kept) < DIRECTIONS:
            kept.append(x)
    return [tuple((x[:d] + 0.0).tolist()) for x in kept]


def _used(model: Model, e: Any) -> set[str]:
    """Coordinates of a joint that drivers, couplings, forces, sensors or initial conditions name."""
    texts = [d.coordinate for d in model.drivers] + [i.name for i in model.initial]
    texts += [x for c in model.couplings if isinstance(c, Coupling) for x in c.coupled()]
    texts += [x for f in model.forces if isinstance(f, CoordinateForce) for x in f.along()]
    texts += [x.of for x in model.sensors if isinstance(x, Sensor)]
    if isinstance(e, Driver):
        return set()
    return {what for owner, _, what in (t.partition(".") for t in texts if t) if owner == e.name}
