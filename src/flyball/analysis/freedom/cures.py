"""What to replace in an overconstrained mechanism so that no constraint says what others say, and no freedom is added.

Joints of weaker kinds are tried in the place of those that take part: their rows are computed beside those that are
there, in one compilation, and a choice is a cure if its rows are independent and allow the same motions as before, here
and in positions next to this one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import TYPE_CHECKING, Any

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
from ..compiled import compiled
from ..mobility import TOLERANCE, scaled_jacobian

if TYPE_CHECKING:
    from ..mobility import Found

WEAKER = {  # kind of joint -> kinds that fulfil part of what it does, in space
    "Revolute": ("Spherical", "Cylindrical", "Universal", "PointOnLine", "PointInPlane"),
    "Prismatic": ("Cylindrical", "PointOnLine", "PointInPlane"),
    "Cylindrical": ("PointOnLine", "PointInPlane"),
    "Universal": ("Spherical", "PointInPlane"),
    "Spherical": ("PointOnLine", "PointInPlane"),
    "Fixed": ("Revolute", "Universal", "Spherical", "Cylindrical", "PointOnLine", "PointInPlane"),
    "Screw": ("Cylindrical",),
    "PointOnLine": ("PointInPlane",),
    "Planar": ("PointInPlane",),
}
IN_PLANE = {"Revolute": ("PinInSlot",), "Prismatic": ("PinInSlot",), "Fixed": ("Revolute", "PinInSlot")}
COST = {"PointOnLine": 2.1, "PinInSlot": 1.1, "PointInPlane": 2.2}  # of a joint that is put in; others 1
OMITTED = {"joints": 3.5, "couplings": 2.0, "drivers": 0.5, "Fixed": 1.5}  # of an element that is left out
WORDS = {"PointOnLine": "a ball in a groove (PointOnLine)", "PinInSlot": "a pin in a slot (PinInSlot)"}
MOST = 4  # elements that a cure changes
ELEMENTS = 12  # of a set that are tried
TESTS = 20_000
VERTICAL = 1e-9


@dataclass(frozen=True)
class Change:
    """One element that a cure changes: what it is replaced by, or None where it is left out."""

    name: str
    kind: str
    by: Joint | None

    @property
    def text(self) -> str:
        """In words."""
        if self.by is None:
            return f"leave out {self.kind} {self.name!r}"
        new = type(self.by).__name__
        axis = getattr(self.by, "axes", None) or self.by.axis
        along = "" if axis is None else f" with {'axes' if hasattr(self.by, 'axes') else 'axis'} {_written(axis)}"
        return f"replace {self.kind} {self.name!r} by {WORDS.get(new, 'a ' + new.lower() + ' joint')}{along}"


@dataclass(frozen=True)
class Cure:
    """Changes that take away what is too many and add no freedom."""

    changes: tuple[Change, ...]

    @property
    def text(self) -> str:
        """In words."""
        return " and ".join(c.text for c in self.changes)

    def applied(self, model: Model) -> Any:
        """A copy of the mechanism with the changes made."""
        return model.changed({c.name: c.by for c in self.changes})

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        changes = [{"name": c.name, "by": None if c.by is None else type(c.by).__name__} for c in self.changes]
        return {"text": self.text, "changes": changes}


@dataclass
class Option:
    """A change that is tried, and its rows in every position."""

    change: Change | None
    cost: float
    rows: list[np.ndarray]


def cures(
    there: Found, sets: Sequence[tuple[str, ...]], positions: Sequence[np.ndarray]
) -> list[tuple[Cure | None, bool]]:
    """A cure for each set of elements, one after the other: those before are taken as done.

    Beside it whether the set depends on itself here only, and not in all the other positions.
    """
    options = _options(there, list(dict.fromkeys(name for s in sets for name in s[:ELEMENTS])), positions)
    now = {name: tried[0] for name, tried in options.items()}
    whole = _rows_of(there, [name for s in sets for name in s], positions)
    out: list[tuple[Cure | None, bool]] = []
    for names in sets:
        own = {name: now.get(name) or Option(None, 0.0, whole[name]) for name in names}
        spans = [_rank(np.vstack([whole[n][p] for n in names])) for p in range(len(positions) + 1)]
        chosen = _cheapest(own, {n: options.get(n, []) for n in names}, len(positions) + 1)
        now |= chosen
        changes = tuple(o.change for o in chosen.values() if o.change is not None)
        out.append((Cure(changes) if changes else None, max(spans) > spans[0]))
    return out


def _cheapest(now: dict[str, Option], options: dict[str, list[Option]], places: int) -> dict[str, Option]:
    """The least that makes the rows of a set independent and leaves their span; nothing if there is no such thing."""
    spans = [_rank(np.vstack([o.rows[p] for o in now.values()])) for p in range(places)]
    surplus = [sum(len(o.rows[p]) for o in now.values()) - spans[p] for p in range(places)]
    if surplus[0] <= 0 or len(set(surplus)) > 1:
        return {}
    fresh = {n: tried for n, tried in options.items() if now[n].change is None}
    choices = sorted(_choices(now, fresh, surplus[0]), key=lambda x: x[0])
    again = sorted(_choices(now, options, surplus[0]), key=lambda x: x[0]) if len(fresh) < len(options) else []
    for _, chosen in (choices + again)[:TESTS]:
        tried = {**now, **chosen}
        rows = (np.vstack([o.rows[p] for o in tried.values()]) for p in range(places))
        if all(_rank(r) == span for r, span in zip(rows, spans, strict=True)):
            return chosen
    return {}


def _choices(
    now: dict[str, Option], options: dict[str, list[Option]], surplus: int
) -> Iterator[tuple[float, dict[str, Option]]]:
    """Changes of up to `MOST` elements that take away so many rows, with what they cost."""
    names = [n for n, tried in options.items() if len(tried) > 1]
    count = 0
    for k in range(1, MOST + 1):
        for some in combinations(names, k):
            freed = [[(len(now[n].rows[0]) - len(o.rows[0]), o) for o in options[n] if o.change] for n in some]
            for picked in product(*[[x for x in f if 0 < x[0] <= surplus] for f in freed]):
                if sum(x[0] for x in picked) == surplus:
                    count += 1
                    yield sum(x[1].cost for x in picked), dict(zip(some, (x[1] for x in picked), strict=True))
                    if count > TESTS:
                        return


def _rank(rows: np.ndarray) -> int:
    d = np.linalg.svd(rows, compute_uv=False)
    return int((d > TOLERANCE * d.max(initial=1e-300)).sum())


def _rows_of(there: Found, names: Sequence[str], positions: Sequence[np.ndarray]) -> dict[str, list[np.ndarray]]:
    """Rows of elements as they are, in every position."""
    c, a = there.assembly.compiled, there.assembly
    out: dict[str, list[np.ndarray]] = {name: [] for name in names}
    for q in (a.q, *positions):
        c.at(a.t, q, a.v)
        G = scaled_jacobian(c)[0]
        for name in out:
            out[name].append(G[c.structure.slices[name]].toarray())
    c.at(a.t, a.q, a.v)
    return out


def _options(there: Found, names: list[str], positions: Sequence[np.ndarray]) -> dict[str, list[Option]]:
    """What could stand in the place of each element, as it is first; all rows come from one compilation."""
    a = there.assembly
    model = a.compiled.structure.model
    env = a.compiled.values.told
    probe = model.snapshot()
    candidates: dict[str, list[Joint]] = {}
    directions = _directions(model, names, env)
    for name in names:
        candidates[name] = []
        for joint in _weaker(model, model[name], env, directions):
            stand_in = dataclasses.replace(joint, name=f"{name}:{len(candidates[name])}")
            try:
                probe.add(stand_in)
            except FlyballError:
                continue
            candidates[name].append(joint)
    c = compiled(probe, parameters=env)
    c.follow(a.compiled.hints)
    every = {n: [n, *(f"{n}:{k}" for k in range(len(candidates[n])))] for n in names}
    rows: dict[str, list[np.ndarray]] = {n: [] for tried in every.values() for n in tried}
    for q in (a.q, *positions):
        c.at(a.t, q, a.v)
        G = scaled_jacobian(c)[0]
        for n in rows:
            rows[n].append(G[c.structure.slices[n]].toarray())
    out = {}
    for name in names:
        e = model[name]
        kind = type(e).__name__.lower()
        out[name] = [Option(None, 0.0, rows[name])]
        for k, joint in enumerate(candidates[name]):
            cost = COST.get(type(joint).__name__, 1.0)
            out[name].append(Option(Change(name, kind, joint), cost, rows[f"{name}:{k}"]))
        if not _named(model, e):
            nothing = [r[:0] for r in rows[name]]
            out[name].append(
                Option(Change(name, kind, None), OMITTED.get(type(e).__name__, OMITTED[e.category]), nothing)
            )
    return out


def _weaker(model: Model, e: Element, env: dict[str, float], directions: list[tuple]) -> Iterator[Joint]:
    """Joints that fulfil part of what a joint does, in its place."""
    if not isinstance(e, Joint):
        return
    wanted = _named(model, e)
    for kind in (IN_PLANE if model.planar else WEAKER).get(type(e).__name__, ()):
        cls: Any = Element.registry[kind]
        if not wanted <= set(cls.coordinates):
            continue
        common: dict[str, Any] = {"at": e.at} if e.at is not None else {}
        kept = {k: getattr(e, k) for k in ("angle", "displacement") if hasattr(e, k) and hasattr(cls, k)}
        ends = (e.name, e.body_i, e.body_j)
        for more in _oriented(model, cls, e, env, directions):
            try:
                yield cls(*ends, **common, **kept, **more)
            except FlyballError:
                continue


def _oriented(model: Model, cls: Any, e: Any, env: dict[str, float], directions: list[tuple]) -> Iterator[dict]:
    """The axes that a joint of that kind may have there."""
    own = e.axis
    if hasattr(cls, "axes"):
        if own is not None and e.at is not None:
            z = vector(resolve(e, env).axis, False, f"axis of {e.title}", direction=True)
            R = triad(z)
            for k in (0, 1):
                yield {"axes": (own, tuple(R[:, k].tolist()))}
        return
    if not cls.needs_axis or (model.planar and cls.planar_normal == "z"):
        yield {}
        return
    if own is not None:
        yield {"axis": own}
    if e.at is None:
        return
    if own is None or cls.drawn in ("point_on_line", "point_in_plane"):  # else only the axis that is there fits
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
        if all(abs(abs(x @ y) - 1.0) > VERTICAL for y in kept) and len(kept) < ELEMENTS:
            kept.append(x)
    return [tuple((x[:d] + 0.0).tolist()) for x in kept]


def _named(model: Model, e: Any) -> set[str]:
    """Coordinates of a joint that drivers, couplings, forces, sensors or initial conditions name."""
    texts = [d.coordinate for d in model.drivers] + [i.name for i in model.initial]
    texts += [x for c in model.couplings if isinstance(c, Coupling) for x in c.coupled()]
    texts += [f.coordinate_text() for f in model.forces if isinstance(f, CoordinateForce)]
    texts += [x.of for x in model.sensors if isinstance(x, Sensor)]
    if isinstance(e, Driver):
        return set()
    return {what for owner, _, what in (t.partition(".") for t in texts if t) if owner == e.name}


def _written(axis: Any) -> str:
    if isinstance(axis[0], (tuple, list)):
        return " and ".join(_written(a) for a in axis)
    return "(" + ", ".join(f"{x:.4g}" if isinstance(x, float) else str(x) for x in axis) + ")"
