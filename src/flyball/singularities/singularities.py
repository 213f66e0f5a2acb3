"""Singular positions of a driven mechanism: located along its motion curve, and classified.

Source: H. Hahn, Rigid Body Dynamics of Mechanisms 1 (2002), section 3.1.3 (regular and singular positions of a
slider-crank); theory of branching after H. B. Keller (1977).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..analysis_options import AnalysisOptions, require_positive
from ..analysis_options import require_count as at_least
from ..errors import MobilityError, ModelError, SingularityError
from ..model.expressions import number
from ..model.model import Model
from ..model.names import curve_parts
from ..model.unsupported_elements import refuse_unsupported
from ..numerics.rank import null_space
from ..results.singularities import Branch, Singularities
from .classification import BranchCurve, branches_through, classify
from .continuation import (
    SAME_POINT,
    STATIONARY_DRIVER,
    CurveNode,
    CurvePoint,
    CurveTracer,
    ReleasedMechanism,
    TracedCurve,
    locate_branch_point,
    rank_limit,
    release_driver,
)

START_TOLERANCE = 1e-4  # a start nearer than this to a singular position is moved onto it [1]
RANGE_TOLERANCE = 1e-9  # distance beyond the ends of the range allowed for a singular position, relative to the range


@dataclass(frozen=True, kw_only=True)
class SingularitiesOptions(AnalysisOptions):
    """Arguments of `Mechanism.singularities`."""

    driver: str
    range: Sequence[float | str]
    t: float
    parameters: Mapping[str, float] | None
    branch: Branch | int | None
    step: float
    steps: int

    def __post_init__(self) -> None:
        super().__post_init__()
        require_positive(self.step, "step")
        at_least(self.steps, "steps")


def singularities(model: Model, o: SingularitiesOptions) -> Singularities:
    """Follow a driven motion through its singular positions: see `Mechanism.singularities`."""
    refuse_unsupported(model, "singularities", controlled=True)
    f = release_driver(model, o.driver, o.t, o.parameters)
    return _traced_singularities(
        f, CurveTracer(f.closure, o.step), _driver_range(f, o.range, o.parameters), o.branch, o.steps
    )


def _traced_singularities(
    f: ReleasedMechanism, tracer: CurveTracer, ends: tuple[float, float], branch: Branch | int | None, steps: int
) -> Singularities:
    """Trace the curve in both directions from its start, with its singular positions."""
    x, curve, first = _start_point(f, tracer, branch)
    low, high = min(*ends, x.a), max(*ends, x.a)
    room = RANGE_TOLERANCE * (high - low)

    def within(a: float) -> bool:
        return low - room <= a <= high + room

    ways = _traced_directions(tracer, x, curve, ends, within, steps)
    places = [(-s, y) for s, y in reversed(ways[1].found)] + ([(0.0, x)] if first else []) + ways[0].found
    nodes = _ordered_nodes(tracer, ways, low, high)
    _refuse_unreachable(f, nodes, x, ends, places)
    room += 1e-9
    allowed = [(s, y) for s, y in places if min(ends) - room <= y.a <= max(ends) + room]
    once = _distinct_points(f, allowed)
    out = _singularities_result(f, ends, [(n.s, n.x) for n in nodes], once, (ways[1].end, ways[0].end))
    out.points.extend(classify(f, tracer, y, s, _nearest_values(f, out, y, s)) for s, y in once)
    return out


def _driver_range(
    f: ReleasedMechanism, given: Sequence[float | str], parameters: Mapping[str, float] | None
) -> tuple[float, float]:
    if isinstance(given, str) or len(given) != 2:
        raise ModelError(f"range of {f.driver.title}: give two values (a0, a1), not {given!r}")
    env = f.model.environment(parameters)
    low, high = (float(number(x, env, f.unit, f"range of {f.driver.title}")) for x in given)
    if low == high:
        raise ModelError(f"range of {f.driver.title}: from {low:g} to {high:g} is no range")
    return low, high


def _start_point(
    f: ReleasedMechanism, tracer: CurveTracer, branch: Branch | int | None
) -> tuple[CurvePoint, BranchCurve | None, bool]:
    """Start point, the branch to follow if it is a singular position, and whether that is to be reported."""
    c = f.closure
    if isinstance(branch, Branch):
        x, curve = branch.origin
        return x, curve, True
    x = _snapped_to_singular(f, tracer, f.start)
    r = c.rank(x)
    free = r.below(rank_limit(r))
    if free == 0:
        raise _no_freedom_error(f)
    if free > 1:
        _refuse_extra_freedoms(f, x)
    elif abs(r.V[-1, -1]) > STATIONARY_DRIVER:
        if branch is not None:
            raise ModelError(f"{f.model.name!r} does not start in a singular position: there is but one branch")
        return x, None, False
    cross = branches_through(c, x, rank_limit(r))
    if isinstance(branch, int) and not 0 <= branch < len(cross.curves):
        raise ModelError(
            f"{f.model.name!r} starts where there are {len(cross.curves)} branches, none of number {branch}"
        )
    return x, cross.curves[branch or 0] if cross.curves else None, True


def _snapped_to_singular(f: ReleasedMechanism, tracer: CurveTracer, x: CurvePoint) -> CurvePoint:
    """The singular position at the start if it is that within the tolerance; else the start."""
    c = f.closure
    closed = c.project(x)
    if closed is not None and np.linalg.norm(c.way(x, closed[0])) < START_TOLERANCE:
        x = closed[0]
    r = c.rank(x)
    lost = int((r.values[: c.columns - 1] < START_TOLERANCE).sum())
    if lost:
        there = locate_branch_point(c, x, lost)
        return there if there is not None and np.linalg.norm(c.way(x, there)) < START_TOLERANCE else x
    node = tracer.node(0.0, x, r, r.V[:, -1])
    if abs(node.drive) < START_TOLERANCE and abs(node.drive) < START_TOLERANCE * abs(node.bend[-1]):
        for _ in (1, 2, 3):
            node = tracer.step_from(node, -node.drive / node.bend[-1]) or node
        return node.x
    return x


def _traced_directions(
    tracer: CurveTracer, x: CurvePoint, curve: BranchCurve | None, ends: tuple[float, float], within, steps: int
) -> list[TracedCurve]:
    """The curve from x forward, towards the end of the range, and backward."""
    c = tracer.c
    r = c.rank(x)
    toward = 1.0 if ends[1] > ends[0] else -1.0
    if curve is None and r.below(rank_limit(r)) > 1:
        return [TracedCurve(end="nothing leads away from here"), TracedCurve(end="nothing leads away from here")]
    if curve is not None:
        n, bend = curve.x[0], curve.x[1] if len(curve.x) > 1 else 0.0 * curve.x[0]
        starts = [tracer.node_after_step(x, d) for d in curve.ends]
        starts = starts or [tracer.off(x, side * n, bend) for side in (toward, -toward)]
        homes: list[CurveNode | None] = [None] * len(starts)
    else:
        start = tracer.node(0.0, x, r, r.V[:, -1] * toward * np.sign(r.V[-1, -1]))
        back = tracer.node(0.0, x, r, -start.t)
        starts, homes = [start, back], [start, None]
    ways = [tracer.follow(starts[0], within, steps, homes[0] or starts[0])]
    if ways[0].end == "closed" or len(starts) < 2:
        return [*ways, TracedCurve(end=ways[0].end)]
    return [*ways, tracer.follow(starts[1], within, steps, None)]


def _ordered_nodes(tracer: CurveTracer, curves: list[TracedCurve], low: float, high: float) -> list[CurveNode]:
    """All nodes in order; the last node of each direction is moved back to the end of the range."""
    forward, back = (_cut_to_range(tracer, way, low, high) for way in curves)
    backward = [CurveNode(-n.s, n.x, -n.t, n.bend, n.value, -n.slope) for n in reversed(back)]
    if backward and forward and backward[-1].s == forward[0].s == 0.0:
        backward.pop()
    return [*backward, *forward]


def _cut_to_range(tracer: CurveTracer, way: TracedCurve, low: float, high: float) -> list[CurveNode]:
    from scipy.optimize import brentq

    if way.end != "end of the range" or len(way.nodes) < 2:
        return way.nodes
    *inside, before, last = way.nodes
    goal = high if last.x.a > high else low

    def beyond(h: float) -> float:
        return (tracer.step_from(before, h) or last).x.a - goal if h > 0.0 else before.x.a - goal

    if beyond(0.0) * (last.x.a - goal) >= 0.0:  # the last but one node is the end
        return [*inside, before]
    h = brentq(beyond, 0.0, last.s - before.s, xtol=1e-13)
    return [*inside, before, tracer.step_from(before, h) or last]


def _refuse_unreachable(
    f: ReleasedMechanism,
    nodes: list[CurveNode],
    x: CurvePoint,
    ends: tuple[float, float],
    places: list[tuple[float, CurvePoint]],
) -> None:
    """Refuse a range that the curve does not reach."""
    least, most = min(ends), max(ends)
    values = [n.x.a for n in nodes] + [p.a for _, p in places] + [x.a]
    if min(values) <= most + RANGE_TOLERANCE and max(values) >= least - RANGE_TOLERANCE:
        return
    wall = max(values) if x.a < least else min(values)
    near = min(places, key=lambda p: abs(p[1].a - wall), default=(0.0, x))[1]
    r = f.closure.rank(near)
    u = r.U[:, int((r.values > rank_limit(r)).sum()) - (0 if r.below(rank_limit(r)) > 1 else 1) :]
    s = f.closure.c.structure
    weight = np.abs(u).max(axis=1, initial=0.0)[:-1]
    names = tuple(
        dict.fromkeys(s.rows[k].element.name for k in np.flatnonzero(weight > 1e-3 * weight.max(initial=0.0)))
    )
    raise SingularityError(
        f"{f.model.name!r}: driver {f.driver.name!r} cannot reach {least:g} .. {most:g} {f.unit} from the reference "
        f"configuration ({f.driver.coordinate} = {x.a:.6g}): it locks up at {wall:.6g} {f.unit}",
        where=float(wall),
        elements=names,
    )


def _distinct_points(f: ReleasedMechanism, places: list[tuple[float, CurvePoint]]) -> list[tuple[float, CurvePoint]]:
    out: list[tuple[float, CurvePoint]] = []
    for s, y in places:
        if all(np.linalg.norm(f.closure.way(y, z)) > SAME_POINT or abs(y.a - z.a) > 1e-3 for _, z in out):
            out.append((s, y))
    return out


def _no_freedom_error(f: ReleasedMechanism) -> MobilityError:
    others = [d.name for d in f.model.drivers if d.name != f.driver.name]
    beside = f"; the other drivers ({', '.join(others)}) prevent it" if others else ""
    return MobilityError(
        f"{f.model.name!r}: driver {f.driver.name!r} cannot move {f.driver.coordinate}, since no freedom "
        f"is left{beside}",
        redundant=tuple(others),
    )


def _refuse_extra_freedoms(f: ReleasedMechanism, x: CurvePoint) -> None:
    """Refuse freedoms besides the driver's that exist at nearby positions, too."""
    c = f.closure
    r = c.rank(x)
    kept = int((r.values > rank_limit(r)).sum())
    N = r.V[:, kept:]
    random = np.random.default_rng(0)
    least, extra = np.inf, np.zeros((c.columns, 0))
    for y in random.normal(size=(12, N.shape[1])):
        d = 0.05 * N @ (y / np.linalg.norm(y))
        near = c.project(c.at(c.moved(x, d)))
        if near is not None and np.linalg.norm(c.way(x, near[0])) > 0.015:
            free = near[1].below(1e-6 * near[1].values[0])
            if free < least:
                least, extra = free, near[1].V[:, c.columns - free :]
    if least == 1 or not extra.shape[1]:
        return
    held = extra @ null_space(extra[-1:], 0.0)  # freedoms that do not move the driver
    moving = np.max([np.abs(f.rates(x, d)) for d in held.T], axis=0)
    free_labels = [f.labels[k] for k in np.flatnonzero(moving > 1e-6 * moving.max())]
    joints = [k for k in free_labels if curve_parts(k)[0] in {j.name for j in f.model.joints}]
    bodies = list(dict.fromkeys(curve_parts(k)[0] for k in free_labels if k not in joints))
    count = held.shape[1]
    raise MobilityError(
        f"{f.model.name!r} has {count} freedom{'s' if count > 1 else ''} left besides driver {f.driver.name!r}: with "
        f"{f.driver.coordinate} at rest, {', '.join(bodies[:8])} can still move "
        f"({', '.join(joints[:8]) or 'no joint'}). Add a driver for each, or joints that remove them",
        free=tuple(joints or bodies),
    )


def _nearest_values(f: ReleasedMechanism, out: Singularities, x: CurvePoint, s: float) -> np.ndarray:
    """Coordinates of the node nearest to a singular position, for the whole turns of its angles."""
    k = int(np.argmin(np.abs(out.s - s)))
    return np.array([v[k] for v in out.values.values()])


def _singularities_result(
    f: ReleasedMechanism,
    ends: tuple[float, float],
    nodes: list[tuple[float, CurvePoint]],
    found: list[tuple[float, CurvePoint]],
    why: tuple[str, str],
) -> Singularities:
    c = f.closure
    own = [
        p for p in nodes if all(np.linalg.norm(c.way(p[1], x)) > SAME_POINT for s, x in found if abs(s - p[0]) < 0.01)
    ]
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
