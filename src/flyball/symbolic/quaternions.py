"""Which coordinates are unit quaternions: what makes expressions shorter."""

from __future__ import annotations

from ..graph.node import Node
from ..tables.system import FREE, SPHERICAL
from .formulated import Formulated


def quaternions(x: Formulated) -> list[list[Node]]:
    """The symbols of every quaternion, four each."""
    out = []
    tree = x.traced.system.tree
    for kind, q in zip(tree.joint.tolist(), tree.q.tolist(), strict=True):
        if kind in (FREE, SPHERICAL):
            first = q + (3 if kind == FREE else 0)
            out.append(list(x.traced.q[first : first + 4]))
    return out
