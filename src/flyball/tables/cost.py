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
from .system import ARTICULATED, NV, PARENT, POINT, SCHUR, SOLVER, TREE

BODY, LINK, TERM, ENTRY, ARTICULATE = 315.0, 112.0, 40.0, 28.0, 12.0
FACTOR = 1.0  # a product of the factorisation: seen only where a forest's matrix is dense and large


def counts(s: Structure) -> dict[str, float]:
    """How much there is of each kind of work."""
    t = s.tables
    body_i, solver = t["body_i"], t["kinds"][SOLVER]
    column = np.diff(s.ldl.Lp).astype(float)
    free = body_i[:, TREE] <= POINT
    return {
        "constant": 1.0,
        "bodies": float(free.sum()),
        "links": float((~free).sum()),
        "terms": float(len(t["term_i"])),
        "parts": float(len(t["seg_i"])),
        "entries": float(len(t["col_i"]) + len(t["mass_i"]) + column.sum()),
        "factor": float((column * (column + 3.0)).sum() / 2.0),
        "pairs": float(len(t["pair_i"]) if solver == SCHUR else 0.0),
        "articulated": float(len(body_i) if solver == ARTICULATED else 0.0),
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
    body_i = s.tables["body_i"]
    if len(tree) == len(model.joints):
        return 0.0
    above = [0] * (len(body_i) + 1)  # the last one: of ground
    entries = 0
    for b, (parent, n) in enumerate(body_i[:, [PARENT, NV]].tolist()):
        above[b] = above[parent] + n
        entries += n * above[parent] + n * (n + 1) // 2
    return LINK * float((body_i[:, TREE] > POINT).sum()) + ENTRY * float(2 * entries - body_i[:, NV].sum())
