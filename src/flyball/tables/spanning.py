"""Which joints become tree joints: a forest that leaves few velocities, few rows and short chains.

A joint is worth as many rows as its chain saves. Of every loop the joint that saves least is cut (a maximum spanning
tree, Prim 1957), and of equals the one farthest from ground, so chains stay short: cost grows with their length.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection

from ..model.body import GROUND
from ..model.joint import Joint
from ..model.model import Model
from .events import parting
from .forest import ends
from .points import single
from .reads import read

MOST = 8  # choices that are kept of a mechanism


def saved(joint: Joint, planar: bool) -> int:
    """How many rows a joint needs less where it is a tree joint."""
    return len(joint.rows(planar)) - len(joint.loose(planar))


def candidates(model: Model, avoided: Collection[str] = ()) -> dict[str, int]:
    """Joints that can be tree joints -> rows saved. Those whose reaction a friction or an event needs must be rows,
    those that an event releases, and those of point masses, which turn with nothing.
    """
    needed = {getattr(f, "joint", "") for f in model.forces if hasattr(f, "load")}
    needed |= {joint.name for joint in parting(model)} | {x.element.name for x in read(model).values()}
    alone = single(model)
    out = {}
    for joint in model.joints:
        worth = saved(joint, model.planar)
        a, b = ends(model, joint)
        if worth > 0 and a != b and alone.isdisjoint((a, b)) and joint.name not in needed and joint.name not in avoided:
            out[joint.name] = worth
    return out


def spanning(model: Model, avoided: Collection[str] = ()) -> tuple[str, ...]:
    """Names of the tree joints of a mechanism, in the order of the model.

    Parameters
    ----------
    model : Model
    avoided : collection of str
        Joints that must stay rows.
    """
    model = model.snapshot()
    return model.kept.get("spanning", (tuple(avoided), single(model)), MOST, lambda: _forest(model, avoided))


def _forest(model: Model, avoided: Collection[str]) -> tuple[str, ...]:
    worth = candidates(model, avoided)
    near: dict[str, list[tuple[str, str]]] = {GROUND: []}
    near |= {b.name: [] for b in model.bodies}
    for name in worth:
        a, b = ends(model, model[name])
        near[a].append((name, b))
        near[b].append((name, a))
    seen: set[str] = set()
    chosen: set[str] = set()
    roots = [GROUND, *(b.name for b in sorted(model.bodies, key=lambda b: -len(near[b.name])))]
    for root in roots:
        if root not in seen:
            _grow(near, worth, root, seen, chosen)
    return tuple(j.name for j in model.joints if j.name in chosen)


def _grow(near: dict, worth: dict[str, int], root: str, seen: set[str], chosen: set[str]) -> None:
    """Hang on the root all that can be reached, the joints that save most first, of equals the nearest."""
    seen.add(root)
    count = 0
    queue: list[tuple[int, int, int, str, str]] = []

    def offer(body: str, depth: int) -> None:
        nonlocal count
        for name, other in near[body]:
            if other not in seen:
                heapq.heappush(queue, (-worth[name], depth, count, name, other))
                count += 1

    offer(root, 0)
    while queue:
        _, depth, _, name, other = heapq.heappop(queue)
        if other not in seen:
            seen.add(other)
            chosen.add(name)
            offer(other, depth + 1)
