"""The forest: which body hangs on which, by which chain of tree joints; the body table.

Bodies that no tree joint reaches from ground hang there by FREE or PLANAR, one for each part that is connected, and
point masses by POINT, each of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ModelError
from ..model.body import GROUND
from ..model.joint import Joint, Primitive
from ..model.model import Model
from .points import single
from .system import FREE, PLANAR, POINT, PRISMATIC, REVOLUTE, SPHERICAL, TREE_NQ, TREE_NV, WELD, Tree

if TYPE_CHECKING:
    from .specs import Structure

KINDS = {"R": REVOLUTE, "P": PRISMATIC, "S": SPHERICAL}


@dataclass(frozen=True)
class TreeJoint:
    """A joint whose freedoms are coordinates: where its chain stands in the body table."""

    joint: Joint
    reversed: bool  # the body beyond it carries frame F
    links: tuple[int, ...]  # rows of the body table, from the parent on; all but the last are massless
    primitives: tuple[Primitive, ...]  # in the order of the links; none for a weld

    @property
    def child(self) -> int:
        """Row of the body beyond it."""
        return self.links[-1]


@dataclass(frozen=True)
class Hung:
    """A body and the joint that it hangs by: none for one that hangs on ground by FREE or PLANAR."""

    body: str
    joint: Joint | None = None
    parent: str = GROUND
    reversed: bool = False


def ends(model: Model, joint: Joint) -> tuple[str, str]:
    """Names of the bodies that carry a joint's frames F and M."""
    return model.carrier(joint.body_i, joint), model.carrier(joint.body_j, joint)


def hung(model: Model, tree: Sequence[str]) -> list[Hung]:
    """Every body with what it hangs by, parents first.

    Raises
    ------
    ModelError
        If the tree joints close a loop.
    """
    near: dict[str, list[tuple[Joint, str, bool]]] = {GROUND: []}
    near |= {b.name: [] for b in model.bodies}
    for name in tree:
        joint = model[name]
        a, b = ends(model, joint)
        near[a].append((joint, b, False))
        near[b].append((joint, a, True))
    out: list[Hung] = []
    seen = {GROUND}
    _reach(near, GROUND, seen, out)
    for body in model.bodies:
        if body.name not in seen:
            root = _middle(near, body.name)
            out.append(Hung(root))
            seen.add(root)
            _reach(near, root, seen, out)
    if sum(h.joint is not None for h in out) != len(tree):
        raise ModelError("the tree joints close a loop")
    return out


def _reach(near: dict, root: str, seen: set[str], out: list[Hung]) -> None:
    """Append all that hangs on the root, one chain after the other."""
    stack = [(root, iter(near[root]))]
    while stack:
        here, ways = stack[-1]
        for joint, there, turned in ways:
            if there not in seen:
                seen.add(there)
                out.append(Hung(there, joint, here, turned))
                stack.append((there, iter(near[there])))
                break
        else:
            stack.pop()


def _middle(near: dict, start: str) -> str:
    """The body of a connected part from which the farthest is nearest: chains are shortest from there."""

    def farthest(root: str) -> list[str]:
        way, order = {root: root}, [root]
        for here in order:
            for _, there, _ in near[here]:
                if there not in way and there != GROUND:
                    way[there] = here
                    order.append(there)
        last, path = order[-1], []
        while last != root:
            path.append(last)
            last = way[last]
        return [*path, root]

    if not near[start]:
        return start
    path = farthest(farthest(start)[0])
    return path[len(path) // 2]


def body_table(s: Structure) -> None:
    """Decide rows of bodies and massless links, their coordinates and velocities."""
    model = s.model
    plain = PLANAR if model.planar else FREE
    s.points = single(model)
    rows: list[tuple[int, int]] = []  # parent, kind
    place = {GROUND: -1}
    for h in hung(model, s.tree) if s.tree else [Hung(b.name) for b in model.bodies]:
        if h.joint is None:
            rows.append((-1, POINT if h.body in s.points else plain))
        else:
            steps = h.joint.primitives(model.planar)
            steps = steps[::-1] if h.reversed else steps
            first = len(rows)
            parent = place[h.parent]
            for kind in [KINDS[p.kind] for p in steps] or [WELD]:
                rows.append((parent, kind))
                parent = len(rows) - 1
            s.tree_joints[h.joint.name] = TreeJoint(h.joint, h.reversed, tuple(range(first, len(rows))), steps)
        place[h.body] = len(rows) - 1
    s.place = place
    kinds = np.array([kind for _, kind in rows], np.int64)
    nq, nv = np.array(TREE_NQ)[kinds], np.array(TREE_NV)[kinds]
    if model.planar:
        nq[kinds == POINT] = nv[kinds == POINT] = 2
    parents, none = np.array([parent for parent, _ in rows], np.int64), np.full(len(rows), -1, np.int64)
    s.tables["tree"] = Tree(parents, kinds, np.cumsum(nq) - nq, np.cumsum(nv) - nv, nq, nv, none, none.copy())


def steps(s: Structure) -> Iterator[tuple[TreeJoint, int, Primitive]]:
    """Every step of every tree joint with its row of the body table."""
    for t in s.tree_joints.values():
        for row, p in zip(t.links, t.primitives, strict=False):  # a weld has no step
            yield t, row, p


def step_of(s: Structure, joint: str, coordinate: str) -> int | None:
    """Row of the body table whose one coordinate is that coordinate of a joint, if there is one."""
    found = s.tree_joints.get(joint)
    if found is None:
        return None
    for row, p in zip(found.links, found.primitives, strict=False):
        if p.coordinate == coordinate and p.kind != "S":
            return row
    return None
