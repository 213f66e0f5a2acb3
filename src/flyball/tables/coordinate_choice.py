"""Choice of coordinates: which joints become tree joints, and the estimated cost of the equations.

A joint is worth as many rows as its chain saves. In every loop the joint that saves least is cut (a maximum spanning
tree, Prim 1957), and among equals the one farthest from ground. Chains then stay short: cost grows with their length.

Costs are nanoseconds of one right-hand side, computed from the tables; the weights are fitted to measured times of the
examples in absolute and in joint coordinates (``benchmarks/costs.py``). They compare two formulations of one mechanism;
they do not predict the duration of a motion.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Sequence

import numpy as np

from ..errors import ModelError
from ..model.body import GROUND
from ..model.force import CoordinateForce
from ..model.joint import Joint
from ..model.model import Model
from ..model.names import curve_parts
from .constraint_rows import released_joints
from .forest import body_table, joint_bodies, point_masses
from .law_inputs import forces_in_events
from .structure_definition import Structure
from .table_definitions import ARTICULATED, POINT, SCHUR

MAX_JOINT_ROWS = 6  # rows that a joint can have
MAX_FORESTS = 8  # choices that are cached for each mechanism


def rows_saved(joint: Joint, planar: bool) -> int:
    """Number of rows that a joint saves as a tree joint."""
    return len(joint.rows(planar)) - len(joint.loose(planar))


def tree_candidates(model: Model, avoided: Collection[str] = ()) -> dict[str, int]:
    """Joints that can be tree joints -> rows saved.

    A joint with the inertia of a rotor is chosen before all others. Excluded are joints whose reaction a friction
    or an event needs, those that an event releases, and those of point masses, which have no rotation.
    """
    needed = {getattr(f, "joint", "") for f in model.forces if hasattr(f, "load")}
    needed |= {joint.name for joint in released_joints(model)} | {
        x.element.name for x in forces_in_events(model).values()
    }
    alone = point_masses(model)
    turning = {curve_parts(f.coordinate_text())[0] for f in rotors(model)}
    out = {}
    for joint in model.joints:
        worth = rows_saved(joint, model.planar)
        a, b = joint_bodies(model, joint)
        if worth > 0 and a != b and alone.isdisjoint((a, b)) and joint.name not in needed and joint.name not in avoided:
            out[joint.name] = worth + (MAX_JOINT_ROWS if joint.name in turning else 0)
    return out


def rotors(model: Model) -> list[CoordinateForce]:
    """Elements that add inertia along a coordinate, which must then be one of the joint coordinates."""
    return [f for f in model.forces if isinstance(f, CoordinateForce) and f.adds_inertia]


def require_rotor_coordinates(s: Structure) -> None:
    """Refuse to solve for accelerations where the inertia of a rotor is not along a velocity.

    Raises
    ------
    ModelError
        Naming the element, its coordinate and the remedy.
    """
    for e in s.rotors_without_velocity:
        text = e.coordinate_text()
        if not s.tree:
            raise ModelError(
                f"{e.title} adds inertia along {text!r}, whose rate is a velocity in joint coordinates only; "
                "choose coordinates='joint'"
            )
        raise ModelError(
            f"{e.title} adds inertia along {text!r}, whose rate is no velocity of the joint coordinates: the loop is "
            "cut at its joint, or a friction or an event needs the reaction of that joint. Describe the rotor as a "
            "Body on a Revolute joint, with a GearPair"
        )


def spanning_joints(model: Model, avoided: Collection[str] = ()) -> tuple[str, ...]:
    """Names of the tree joints of a mechanism, in the order of the model.

    Parameters
    ----------
    model : Model
    avoided : collection of str
        Joints that must stay rows.
    """
    model = model.snapshot()
    return model.cache.get(
        "spanning", (tuple(avoided), point_masses(model)), MAX_FORESTS, lambda: _spanning_forest(model, avoided)
    )


def _spanning_forest(model: Model, avoided: Collection[str]) -> tuple[str, ...]:
    worth = tree_candidates(model, avoided)
    near: dict[str, list[tuple[str, str]]] = {GROUND: []}
    near |= {b.name: [] for b in model.bodies}
    for name in worth:
        a, b = joint_bodies(model, model[name])
        near[a].append((name, b))
        near[b].append((name, a))
    seen: set[str] = set()
    chosen: set[str] = set()
    roots = [GROUND, *(b.name for b in sorted(model.bodies, key=lambda b: -len(near[b.name])))]
    for root in roots:
        if root not in seen:
            _grow(near, worth, root, seen, chosen)
    return tuple(j.name for j in model.joints if j.name in chosen)


def _grow(near: dict, worth: dict[str, int], root: str, reached: set[str], chosen: set[str]) -> None:
    """Connect all reachable bodies to the root: the joints that save most rows first, among equals the nearest."""
    reached.add(root)
    count = 0
    queue: list[tuple[int, int, int, str, str]] = []

    def offer(body: str, depth: int) -> None:
        nonlocal count
        for name, other in near[body]:
            if other not in reached:
                heapq.heappush(queue, (-worth[name], depth, count, name, other))
                count += 1

    offer(root, 0)
    while queue:
        _, depth, _, name, other = heapq.heappop(queue)
        if other not in reached:
            reached.add(other)
            chosen.add(name)
            offer(other, depth + 1)


def cut_joints_text(model: Model, tree: Collection[str]) -> str:
    """Return '; loops are cut at A, B' with the joints whose rows close loops; empty if there are none."""
    cut = [j.name for j in model.joints if j.name not in tree and j.rows(model.planar)]
    more = f" and {len(cut) - 8} more" if len(cut) > 8 else ""
    return f"; loops are cut at {', '.join(cut[:8])}{more}" if cut else ""


BODY_COST, LINK_COST, TERM_COST, ENTRY_COST, ARTICULATED_COST = 315.0, 112.0, 40.0, 28.0, 12.0
FACTOR_COST = 1.0  # a product of the factorisation: matters only where a forest's matrix is dense and large


def work_counts(s: Structure) -> dict[str, float]:
    """Operation counts of each kind of work."""
    t = s.tables
    tree, solver = t["tree"], t["sizes"].solver
    column = np.diff(s.ldl.Lp).astype(float)
    free = tree.joint <= POINT
    return {
        "constant": 1.0,
        "bodies": float(free.sum()),
        "links": float((~free).sum()),
        "terms": float(len(t["terms"].row)),
        "parts": float(len(t["segments"].body)),
        "entries": float(len(t["column"]) + len(t["mass_entries"].row) + column.sum()),
        "factor": float((column * (column + 3.0)).sum() / 2.0),
        "pairs": float(len(t["pairs"].first) if solver == SCHUR else 0.0),
        "articulated": float(len(free) if solver == ARTICULATED else 0.0),
    }


def right_hand_side_cost(s: Structure) -> float:
    """Estimated time of one right-hand side [ns]."""
    return estimated_time(work_counts(s))


def estimated_time(n: dict[str, float]) -> float:
    """Estimated time of one right-hand side [ns] from the operation counts."""
    return (
        BODY_COST * n["bodies"]
        + LINK_COST * n["links"]
        + TERM_COST * n["terms"]
        + ENTRY_COST * n["entries"]
        + FACTOR_COST * n["factor"]
        + ARTICULATED_COST * n["articulated"]
    )


def least_cost(model: Model, tree: Sequence[str]) -> float:
    """Lower bound of the time of one right-hand side [ns] with these tree joints: links, and M and its factor.

    Each velocity has entries in M with those of all its ancestors, so deep trees with many loops are recognised without
    their tables.
    """
    s = Structure(model, False, tuple(tree))
    body_table(s)
    table = s.tables["tree"]
    if len(tree) == len(model.joints):
        return 0.0
    above = [0] * (len(table.parent) + 1)  # the last entry: ground
    entries = 0
    for b, (parent, n) in enumerate(zip(table.parent.tolist(), table.nv.tolist(), strict=True)):
        above[b] = above[parent] + n
        entries += n * above[parent] + n * (n + 1) // 2
    return LINK_COST * float((table.joint > POINT).sum()) + ENTRY_COST * float(2 * entries - table.nv.sum())
