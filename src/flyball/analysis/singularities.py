"""Singular positions of driven mechanisms: found along the curve that the driver leads through, told what they are.

Source: H. Hahn, Rigid Body Dynamics of Mechanisms 1 (2002), section 3.1.3 (regular and singular positions of a
slider-crank); theory of branching after H. B. Keller (1977).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import MobilityError, ModelError, SingularityError
from ..model.expressions import number
from ..model.model import Model
from ..numerics.rank import null_space
from ..results.singularities import Branch, Singularities
from .options import Options, positive
from .options import count as at_least
from .singular.branches import Curve, crossing
from .singular.classify import point
from .singular.closure import Place
from .singular.freed import Freed, freed
from .singular.locate import branch_point, limit
from .singular.trace import SAME, STILL, Node, Tracer, Way
from .untouched import refuse_contact

NEAR = 1e-4  # a start this near to a singular position is drawn there [1]
EDGE = 1e-9  # of the range: how far beyond its ends a singular position may lie


@dataclass(frozen=True, kw_only=True)
class SingularitiesOptions(Options):
    """What `Mechanism.singularities` is asked."""

    driver: str
    range: Sequence[float | str]
    t: float
    parameters: Mapping[str, float] | None
    branch: Branch | int | None
    step: float
    steps: int

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(self.step, "step")
        at_least(self.steps, "steps")


def singularities(model: Model, o: SingularitiesOptions) -> Singularities:
    """Follow a driven motion through its singular positions: see `Mechanism.singularities`."""
    refuse_contact(model, "singularities", controlled=True)
    f = freed(model, o.driver, o.t, o.parameters)
    return _followed(f, Tracer(f.closure, o.step), _range(f, o.range, o.parameters), o.branch, o.steps)


def _followed(
    f: Freed, tracer: Tracer, ends: tuple[float, float], branch: Branch | int | None, steps: int
) -> Singularities:
    """The curve both ways from its start, and what is singular on it."""
    x, curve, first = _start(f, tracer, branch)
    low, high = min(*ends, x.a), max(*ends, x.a)
    room = EDGE * (high - low)

    def within(a: float) -> bool:
        return low - room <= a <= high + room

    ways = _ways(tracer, x, curve, ends, within, steps)
    places = [(-s, y) for s, y in reversed(ways[1].found)] + ([(0.0, x)] if first else []) + ways[0].found
    nodes = _nodes(tracer, ways, low, high)
    _in_range(f, nodes, x, ends, places)
    room += 1e-9
    allowed = [(s, y) for s, y in places if min(ends) - room <= y.a <= max(ends) + room]
    once = _once(f, allowed)
    out = _result(f, ends, [(n.s, n.x) for n in nodes], once, (ways[1].end, ways[0].end))
    out.points.extend(point(f, tracer, y, s, _near(f, out, y, s)) for s, y in once)
    return out


def _range(f: Freed, given: Sequence[float | str], parameters: Mapping[str, float] | None) -> tuple[float, float]:
    if isinstance(given, str) or len(given) != 2:
        raise ModelError(f"range of {f.driver.title}: give two values (a0, a1), not {given!r}")
    env = f.model.environment(parameters)
    low, high = (float(number(x, env, f.unit, f"range of {f.driver.title}")) for x in given)
    if low == high:
        raise ModelError(f"range of {f.driver.title}: from {low:g} to {high:g} is no range")
    return low, high


def _start(f: Freed, tracer: Tracer, branch: Branch | int | None) -> tuple[Place, Curve | None, bool]:
    """Where to start, along which curve if it is a singular position, and whether it is to be reported."""
    c = f.closure
    if isinstance(branch, Branch):
        x, curve = branch.origin
        return x, curve, True
    x = _onto(f, tracer, f.start)
    r = c.rank(x)
    free = r.below(limit(r))
    if free == 0:
        raise _overdriven(f)
    if free > 1:
        _mobile(f, x)
    elif abs(r.V[-1, -1]) > STILL:
        if branch is not None:
            raise ModelError(f"{f.model.name!r} does not start in a singular position: there is but one branch")
        return x, None, False
    cross = crossing(c, x, limit(r))
    if isinstance(branch, int) and not 0 <= branch < len(cross.curves):
        raise ModelError(
            f"{f.model.name!r} starts where there are {len(cross.curves)} branches, none of number {branch}"
        )
    return x, cross.curves[branch or 0] if cross.curves else None, True


def _onto(f: Freed, tracer: Tracer, x: Place) -> Place:
    """The singular position that the start is drawn at, up to rounding; else the start."""
    c = f.closure
    closed = c.close(x)
    if closed is not None and np.linalg.norm(c.way(x, closed[0])) < NEAR:
        x = closed[0]
    r = c.rank(x)
    lost = int((r.values[: c.columns - 1] < NEAR).sum())
    if lost:
        there = branch_point(c, x, lost)
        return there if there is not None and np.linalg.norm(c.way(x, there)) < NEAR else x
    node = tracer.node(0.0, x, r, r.V[:, -1])
    if abs(node.drive) < NEAR and abs(node.drive) < NEAR * abs(node.bend[-1]):
        for _ in (1, 2, 3):
            node = tracer.ahead(node, -node.drive / node.bend[-1]) or node
        return node.x
    return x


def _ways(tracer: Tracer, x: Place, curve: Curve | None, ends: tuple[float, float], within, steps: int) -> list[Way]:
    """The curve from x forward, to where the range leads, and backward."""
    c = tracer.c
    r = c.rank(x)
    toward = 1.0 if ends[1] > ends[0] else -1.0
    if curve is None and r.below(limit(r)) > 1:
        return [Way(end="nothing leads away from here"), Way(end="nothing leads away from here")]
    if curve is not None:
        n, bend = curve.x[0], curve.x[1] if len(curve.x) > 1 else 0.0 * curve.x[0]
        starts = [tracer.onto(x, d) for d in curve.ends]
        starts = starts or [tracer.off(x, side * n, bend) for side in (toward, -toward)]
        homes: list[Node | None] = [None] * len(starts)
    else:
        start = tracer.node(0.0, x, r, r.V[:, -1] * toward * np.sign(r.V[-1, -1]))
        back = tracer.node(0.0, x, r, -start.t)
        starts, homes = [start, back], [start, None]
    ways = [tracer.follow(starts[0], within, steps, homes[0] or starts[0])]
    if ways[0].end == "closed" or len(starts) < 2:
        return [*ways, Way(end=ways[0].end)]
    return [*ways, tracer.follow(starts[1], within, steps, None)]


def _nodes(tracer: Tracer, ways: list[Way], low: float, high: float) -> list[Node]:
    """All nodes in order; the last of each way is drawn back to the end of the range."""
    forward, back = (_cut(tracer, way, low, high) for way in ways)
    backward = [Node(-n.s, n.x, -n.t, n.bend, n.value, -n.slope) for n in reversed(back)]
    if backward and forward and backward[-1].s == forward[0].s == 0.0:
        backward.pop()
    return [*backward, *forward]


def _cut(tracer: Tracer, way: Way, low: float, high: float) -> list[Node]:
    from scipy.optimize import brentq

    if way.end != "end of the range" or len(way.nodes) < 2:
        return way.nodes
    *inside, before, last = way.nodes
    goal = high if last.x.a > high else low

    def beyond(h: float) -> float:
        return (tracer.ahead(before, h) or last).x.a - goal if h > 0.0 else before.x.a - goal

    if beyond(0.0) * (last.x.a - goal) >= 0.0:  # the last but one is the end
        return [*inside, before]
    h = brentq(beyond, 0.0, last.s - before.s, xtol=1e-13)
    return [*inside, before, tracer.ahead(before, h) or last]


def _in_range(
    f: Freed, nodes: list[Node], x: Place, ends: tuple[float, float], places: list[tuple[float, Place]]
) -> None:
    """Refuse a range that the curve never comes to."""
    least, most = min(ends), max(ends)
    values = [n.x.a for n in nodes] + [p.a for _, p in places] + [x.a]
    if min(values) <= most + EDGE and max(values) >= least - EDGE:
        return
    wall = max(values) if x.a < least else min(values)
    near = min(places, key=lambda p: abs(p[1].a - wall), default=(0.0, x))[1]
    r = f.closure.rank(near)
    u = r.U[:, int((r.values > limit(r)).sum()) - (0 if r.below(limit(r)) > 1 else 1) :]
    s = f.closure.c.structure
    weight = np.abs(u).max(axis=1, initial=0.0)[:-1]
    names = tuple(
        dict.fromkeys(s.rows[k].element.name for k in np.flatnonzero(weight > 1e-3 * weight.max(initial=0.0)))
    )
    raise SingularityError(
        f"{f.model.name!r}: driver {f.driver.name!r} cannot come to {least:g} .. {most:g} {f.unit} from where the "
        f"mechanism is drawn ({f.driver.coordinate} = {x.a:.6g}): it locks up at {wall:.6g} {f.unit}",
        where=float(wall),
        elements=names,
    )


def _once(f: Freed, places: list[tuple[float, Place]]) -> list[tuple[float, Place]]:
    out: list[tuple[float, Place]] = []
    for s, y in places:
        if all(np.linalg.norm(f.closure.way(y, z)) > SAME or abs(y.a - z.a) > 1e-3 for _, z in out):
            out.append((s, y))
    return out


def _overdriven(f: Freed) -> MobilityError:
    others = [d.name for d in f.model.drivers if d.name != f.driver.name]
    beside = f"; the other drivers ({', '.join(others)}) hold it" if others else ""
    return MobilityError(
        f"{f.model.name!r}: driver {f.driver.name!r} cannot move {f.driver.coordinate}, since no freedom "
        f"is left{beside}",
        redundant=tuple(others),
    )


def _mobile(f: Freed, x: Place) -> None:
    """Refuse freedoms besides the driver's: positions nearby have them too."""
    c = f.closure
    r = c.rank(x)
    kept = int((r.values > limit(r)).sum())
    N = r.V[:, kept:]
    random = np.random.default_rng(0)
    least, extra = np.inf, np.zeros((c.columns, 0))
    for y in random.normal(size=(12, N.shape[1])):
        d = 0.05 * N @ (y / np.linalg.norm(y))
        near = c.close(c.at(c.moved(x, d)))
        if near is not None and np.linalg.norm(c.way(x, near[0])) > 0.015:
            free = near[1].below(1e-6 * near[1].values[0])
            if free < least:
                least, extra = free, near[1].V[:, c.columns - free :]
    if least == 1 or not extra.shape[1]:
        return
    held = extra @ null_space(extra[-1:], 0.0)  # those that leave the driver where it is
    moving = np.max([np.abs(f.rates(x, d)) for d in held.T], axis=0)
    free_labels = [f.labels[k] for k in np.flatnonzero(moving > 1e-6 * moving.max())]
    joints = [k for k in free_labels if k.partition(".")[0] in {j.name for j in f.model.joints}]
    bodies = list(dict.fromkeys(k.partition(".")[0] for k in free_labels if k not in joints))
    count = held.shape[1]
    raise MobilityError(
        f"{f.model.name!r} has {count} freedom{'s' if count > 1 else ''} left besides driver {f.driver.name!r}: with "
        f"{f.driver.coordinate} held, {', '.join(bodies[:8])} can still move ({', '.join(joints[:8]) or 'no joint'}). "
        f"Add a driver for each, or joints that take them away",
        free=tuple(joints or bodies),
    )


def _near(f: Freed, out: Singularities, x: Place, s: float) -> np.ndarray:
    """Coordinates next to which those of a singular position are, for the whole turns of angles."""
    k = int(np.argmin(np.abs(out.s - s)))
    return np.array([v[k] for v in out.values.values()])


def _result(
    f: Freed,
    ends: tuple[float, float],
    nodes: list[tuple[float, Place]],
    found: list[tuple[float, Place]],
    why: tuple[str, str],
) -> Singularities:
    c = f.closure
    own = [p for p in nodes if all(np.linalg.norm(c.way(p[1], x)) > SAME for s, x in found if abs(s - p[0]) < 0.01)]
    along = sorted([*own, *found], key=lambda p: p[0])
    values = np.zeros((len(along), f.coordinates))
    distance = np.zeros(len(along))
    near = None
    for k, (_, x) in enumerate(along):
        values[k] = near = f.values(x, near)
        distance[k] = np.linalg.svd(c.jacobian(x)[:, :-1], compute_uv=False)[c.columns - 2]
    return Singularities(
        model=f.model.name,
        driver=f.driver.name,
        coordinate=f.driver.coordinate,
        unit=f.unit,
        range=ends,
        points=[],
        s=np.array([s for s, _ in along]),
        a=np.array([x.a for _, x in along]),
        values=dict(zip(f.labels, values.T, strict=False)),
        distance=distance,
        ends=why,
        planar=f.model.planar,
    )
