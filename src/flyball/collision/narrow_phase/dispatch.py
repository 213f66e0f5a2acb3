"""Dispatch of the narrow phase: the formula for a pair of kinds, and the kernels that the contact search calls.

The list of special pairs comes from the files of `special_pairs`; any other pair is a generic convex pair
(`distance`). Kernels are compiled separately from the search, in variants for fewer kinds, so that shapes that do
not occur are not compiled. A kernel writes the contacts of the two shapes named in its workspace to
`Search.narrow_phase_contacts`, and returns their number.
"""

from __future__ import annotations

from math import inf

from ...compiler.formulas import formula, generated_formula
from ...compiler.kernels import Kernel, kernel
from ...math.vec import add, dot, load3, load9, mm, mv, sub
from ..shape_kinds import FIELD, PLANAR
from ..tables import Geometry, Movers, Search
from .distance import generic_pair
from .special_pairs.registry import PAIR_FORMULAS

ALL_KINDS = {kind for pair in PAIR_FORMULAS for kind in pair}


def _by_kinds(name, kinds, otherwise):
    """Generate the formula that selects the contact formula of a pair of kinds."""
    names, lines = {"any_pair": generic_pair}, []
    for number, pair in enumerate(sorted(PAIR_FORMULAS, key=lambda p: (p[1] is None, p))):
        if pair[0] in kinds and (pair[1] is None or pair[1] in kinds):
            names[f"way_{number}"] = PAIR_FORMULAS[pair]
            test = f"a == {pair[0]}" + ("" if pair[1] is None else f" and b == {pair[1]}")
            lines += [f"if {test}:", f"    return way_{number}(G, i, j, A, B, reach, room)"]
    return generated_formula(__name__, name, "a, b, G, i, j, A, B, reach, room", [*lines, f"return {otherwise}"], names)


_by_kinds_all = _by_kinds("by_kinds", ALL_KINDS, "any_pair(G, i, j, A, B, reach, room)")
_by_kinds_convex = _by_kinds("by_kinds_convex", ALL_KINDS - {FIELD}, "any_pair(G, i, j, A, B, reach, room)")
_by_kinds_planar = _by_kinds("by_kinds_planar", PLANAR, "0")


@formula
def shape_pose(G, M, i):
    """Origin of a shape, and its axes (rows convert its components to the world's)."""
    m = G.shape.mover[i]
    p, R = load3(G.dimensions.place, i, 0), load9(G.dimensions.axes, i, 0)
    if m < 0:
        return p, R
    Q = load9(M.pose, m, 3)
    return add(load3(M.pose, m, 0), mv(Q, p)), mm(Q, R)


@formula
def _collide_by(by_kinds, G, M, i, j, reach, scratch):
    """Find contacts of two shapes with a formula that selects by kind."""
    a, b = G.shape.kind[i], G.shape.kind[j]
    turned = a > b
    if turned:
        i, j, a, b = j, i, b, a
    p, R = shape_pose(G, M, i)
    q, Q = shape_pose(G, M, j)
    d = sub(q, p)
    if not dot(d, d) < inf:  # nan
        return 0
    count = by_kinds(a, b, G, i, j, ((0.0, 0.0, 0.0), R), (d, Q), reach, scratch)
    for k in range(count):
        for c in range(3):
            scratch[k, c] += p[c]
            if turned:
                scratch[k, 3 + c] = -scratch[k, 3 + c]
    return count


@formula
def collide(G, M, i, j, reach, scratch):
    """Find contacts of shapes i and j; writes them to the first rows of ``scratch`` and returns their number.

    A row is a point midway between the surfaces, the unit normal from i to j, the gap and the feature: a whole number
    that identifies the points of this pair from step to step. Points with a gap above ``reach`` are omitted.

    Parameters
    ----------
    G : Geometry
    M : Movers
    i, j : int
        Two shapes.
    reach : float
        Largest gap [m].
    scratch : array (SCRATCH_ROWS, 8)
        Contacts come first; the rest is scratch (`primitives`).
    """
    return _collide_by(_by_kinds_all, G, M, i, j, reach, scratch)


@formula
def collide_planar(G, M, i, j, reach, scratch):
    """Find contacts as `collide`, for the kinds of planar mechanisms only; compiles in a third of the time."""
    return _collide_by(_by_kinds_planar, G, M, i, j, reach, scratch)


@formula
def collide_convex(G, M, i, j, reach, scratch):
    """Find contacts as `collide`, without height fields; compiles in three quarters of the time."""
    return _collide_by(_by_kinds_convex, G, M, i, j, reach, scratch)


@kernel
def between(G: Geometry, M: Movers, B: Search, C: Search, D: Search, task: int) -> int:
    """Contacts of shapes of any kind."""
    return collide(G, M, B.count.query_shape_1, B.count.query_shape_2, B.real.query_reach, B.narrow_phase_contacts)


@kernel
def between_convex(G: Geometry, M: Movers, B: Search, C: Search, D: Search, task: int) -> int:
    """Contacts of convex shapes."""
    return collide_convex(
        G, M, B.count.query_shape_1, B.count.query_shape_2, B.real.query_reach, B.narrow_phase_contacts
    )


@kernel
def between_planar(G: Geometry, M: Movers, B: Search, C: Search, D: Search, task: int) -> int:
    """Contacts of shapes of planar mechanisms."""
    return collide_planar(
        G, M, B.count.query_shape_1, B.count.query_shape_2, B.real.query_reach, B.narrow_phase_contacts
    )


@kernel
def no_pair_contacts(G: Geometry, M: Movers, B: Search, C: Search, D: Search, task: int) -> int:
    """Return no contacts; used in place of `between` if no pair needs it."""
    return 0


def kernel_for_kinds(kinds: set[int]) -> Kernel:
    """Kernel to compile for shapes of these kinds."""
    if kinds <= PLANAR:
        return between_planar
    return between if FIELD in kinds else between_convex
