"""What one right-hand side costs, in nanoseconds, from the tables: by this the coordinates are chosen.

The weights are fitted to measured times of the examples in both coordinate layers (``benchmarks/costs.py``). They say
which of two forms of one mechanism is faster, not how long a motion will take.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..model.model import Model
from .forest import body_table
from .specs import Structure
from .system import ARTICULATED, POINT, SCHUR

BODY, LINK, TERM, ENTRY, ARTICULATE = 315.0, 112.0, 40.0, 28.0, 12.0
FACTOR = 1.0  # a product of the factorisation: seen only where a forest's matrix is dense and large


def counts(s: Structure) -> dict[str, float]:
    """How much there is of each kind of work."""
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


def cost(s: Structure) -> float:
    """Estimated time of one right-hand side [ns]."""
    return estimate(counts(s))


def estimate(n: dict[str, float]) -> float:
    """The same from the counts."""
    return (
        BODY * n["bodies"]
        + LINK * n["links"]
        + TERM * n["terms"]
        + ENTRY * n["entries"]
        + FACTOR * n["factor"]
        + ARTICULATE * n["articulated"]
    )


def least(model: Model, tree: Sequence[str]) -> float:
    """What a right-hand side costs at least [ns] in a forest of these tree joints: links, and M and its factor.

    For each velocity M has those of all that its body hangs on: deep trees with many loops are seen from here, without
    their tables.
    """
    s = Structure(model, False, tuple(tree))
    body_table(s)
    table = s.tables["tree"]
    if len(tree) == len(model.joints):
        return 0.0
    above = [0] * (len(table.parent) + 1)  # the last one: of ground
    entries = 0
    for b, (parent, n) in enumerate(zip(table.parent.tolist(), table.nv.tolist(), strict=True)):
        above[b] = above[parent] + n
        entries += n * above[parent] + n * (n + 1) // 2
    return LINK * float((table.joint > POINT).sum()) + ENTRY * float(2 * entries - table.nv.sum())
