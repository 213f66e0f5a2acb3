"""Constraints that depend on one another, told apart: the smallest sets, what contradicts, and what would cure them."""

from __future__ import annotations

import numpy as np

from ...model.body import Driver
from ...numerics.rank import rank
from ...numerics.sparse_rank import DENSE
from ...results.freedoms import RedundantSet
from ..compiled import Compiled
from .cures import cures
from .jacobian import Found, scaled_jacobian
from .stresses import undetermined
from .supports import irreducible

WRONG = 1e-8  # a dependency of unit size that adds up to more than this part of the mechanism's length contradicts

SHOWN = 64  # constraints too many that are connected with one another, of which sets are sought in a large mechanism
SHARE = 1e-3  # part of the largest share in a dependency that a driver must have for the gap to be seen at it


def redundant_sets(there: Found, positions: list[np.ndarray], shaky: bool, redundancy: int) -> tuple[RedundantSet, ...]:
    """The sets, smallest first. Cures hold in all these positions, and if those of the sets before are done too.

    ``shaky``: the mechanism can shake but not move, so that what depends on one another does so here only.
    ``redundancy``: constraints too many. Of a large mechanism in which more than `SHOWN` of them are connected with one
    another, the sets found are not all there are.
    """
    lam, a = there.dependencies, there.assembly
    if not lam.shape[1]:
        return ()
    c = a.compiled
    s = c.structure
    c.at(a.t, a.q, a.v)
    G, size, _ = scaled_jacobian(c)
    size = np.maximum(size, 1e-300)
    names = list(s.slices)
    groups = [np.arange(r.start, r.stop) for r in s.slices.values()]
    most = SHOWN if max(G.shape) > DENSE else lam.shape[1]
    found = irreducible(lam * size[:, None], groups, most)
    all_found = sum(basis.shape[1] for _, basis in found) == redundancy
    found.sort(key=lambda x: len(x[0]))
    g, nu = c.work.rows.value / size, (c.sparse_jacobian() @ a.v - c.work.rows.nu) / size
    those = [tuple(names[e] for e in elements) for elements, _ in found]
    tried = cures(there, those, positions)
    out = []
    for elements, (numbers, basis), (cure, here_only, cut) in zip(those, found, tried, strict=True):
        what, gap, unit = _contradiction(basis, g, nu, size, c)
        loose = undetermined(a, basis / size[:, None], list(elements))
        drivers = tuple(n for n in elements if isinstance(s.model[n], Driver))
        loose = {k: v for k, v in loose.items() if k not in drivers}
        here_only = not what and (here_only or shaky)
        cure = None if what or here_only else cure
        count = basis.shape[1]
        if not all_found:  # those of a set's own rows are
            own = G[np.concatenate([groups[e] for e in numbers])].toarray()
            count = len(own) - rank(own)
        out.append(RedundantSet(elements, count, what, gap, here_only, loose, cure, drivers, cut, unit))
    return tuple(out)


def _contradiction(
    basis: np.ndarray, g: np.ndarray, nu: np.ndarray, size: np.ndarray, c: Compiled
) -> tuple[str, float, str]:
    """What the rows of a dependency disagree on, by how much, and the unit of that.

    Seen at the first driver among them, or at the row with the largest share.
    """
    unit, length = basis / np.abs(basis).max(axis=0), c.values.length
    for what, off, scale, per in (
        ("position", g, length, ""),
        ("velocity", nu, max(length, float(np.abs(nu).max(initial=0.0))), "/s"),
    ):
        gaps = np.abs(unit.T @ off)
        if gaps.max() > WRONG * scale:
            j = int(gaps.argmax())
            share = np.abs(unit[:, j])
            driven = np.array([isinstance(r.element, Driver) for r in c.structure.rows]) & (share > SHARE)
            k = int(np.argmax(driven)) if driven.any() else int(share.argmax())
            return what, float(gaps[j] / share[k] * size[k]), ("m" if c.metric[k] else "rad") + per
    return "", 0.0, ""
