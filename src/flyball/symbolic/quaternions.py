"""Which coordinates are unit quaternions: what makes expressions shorter."""

from __future__ import annotations

from ..graph.node import Node
from ..tables.system import FREE, Q0, SPHERICAL, TREE
from .formulated import Formulated


def quaternions(x: Formulated) -> list[list[Node]]:
    """The symbols of every quaternion, four each."""
    out = []
    for row in x.traced.system.body_i:
        if row[TREE] in (FREE, SPHERICAL):
            first = int(row[Q0]) + (3 if row[TREE] == FREE else 0)
            out.append(list(x.traced.q[first : first + 4]))
    return out
