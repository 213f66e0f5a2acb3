"""Constraints that depend on one another, told apart: the smallest sets, what contradicts, and what would cure them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ...model.body import Driver
from ...tables.system import G_VALUE, NU
from ..mobility import SHOWN as MANY
from ..mobility import TOLERANCE, scaled_jacobian, undetermined
from .cures import Cure, cures
from .supports import irreducible

if TYPE_CHECKING:
    from ..mobility import Found

WRONG = 1e-8  # a dependency of unit size that adds up to more than this part of the mechanism's length contradicts
SHOWN = 12  # elements that a line names
KINDS = {"position": "positions", "velocity": "velocities"}


@dataclass(frozen=True)
class RedundantSet:
    """Elements whose constraints depend on one another; without any one of them the others would not.

    Attributes
    ----------
    elements : tuple of str
    count : int
        Constraints too many.
    contradiction : str
        "" where they say the same twice; else what they disagree on, ``"position"`` or ``"velocity"``.
    gap : float
        By how much they disagree, seen at one of them if all others are fulfilled: [m], or radians times the
        mechanism's length; or that a second.
    here_only : bool
        Whether they depend on one another in this singular position only, and not next to it.
    undetermined : dict
        Joint -> reaction components (world axes, on ``body_j``) that this leaves undetermined.
    cure : Cure or None
        What to replace or leave out.
    """

    elements: tuple[str, ...]
    count: int
    contradiction: str = ""
    gap: float = 0.0
    here_only: bool = False
    undetermined: dict[str, tuple[str, ...]] = field(default_factory=dict)
    cure: Cure | None = None
    drivers: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """In words."""
        names = ", ".join(self.elements[:SHOWN])
        names += f" and {len(self.elements) - SHOWN} more" if len(self.elements) > SHOWN else ""
        how = "constraint" if self.count == 1 else "constraints"
        if self.contradiction:
            unit = "m" if self.contradiction == "position" else "m/s"
            return f"contradictory: {names} cannot agree on {KINDS[self.contradiction]}, {self.gap:.3g} {unit} apart"
        where = ", in this singular position only" if self.here_only else ""
        return f"{self.count} {how} too many among {names}{where}"

    @property
    def advice(self) -> str:
        """What to do about it."""
        if self.cure is not None:
            return f"cure: {self.cure.text}"
        if self.contradiction and self.drivers:
            return f"cure: leave out one of {', '.join(self.drivers)}, or make their laws agree with the rest"
        if self.here_only:
            return "cure: another position or other dimensions; it is no joint's fault"
        if self.contradiction:
            return "cure: correct the lengths, the points or the laws of these, so that all can be fulfilled"
        return "no cure by another joint was found"

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "elements": list(self.elements),
            "count": self.count,
            "contradiction": self.contradiction,
            "gap": self.gap,
            "here_only": self.here_only,
            "undetermined": {k: list(v) for k, v in self.undetermined.items()},
            "cure": None if self.cure is None else self.cure.as_dict(),
        }


def redundant_sets(there: Found, positions: list[np.ndarray], shaky: bool) -> tuple[RedundantSet, ...]:
    """The sets, smallest first. Cures hold in all these positions, and if those of the sets before are done too.

    ``shaky``: the mechanism can shake but not move, so that what depends on one another does so here only.
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
    found = irreducible(lam * size[:, None], groups)
    found.sort(key=lambda x: len(x[0]))
    g, nu = c.work.row[G_VALUE] / size, (c.sparse_jacobian() @ a.v - c.work.row[NU]) / size
    those = [tuple(names[e] for e in elements) for elements, _ in found]
    tried = cures(there, those, positions)
    out = []
    for elements, (numbers, basis), (cure, here_only) in zip(those, found, tried, strict=True):
        what, gap = _contradiction(basis, g, nu, c.values.length)
        loose = undetermined(a, basis / size[:, None], list(elements))
        drivers = tuple(n for n in elements if isinstance(s.model[n], Driver))
        loose = {k: v for k, v in loose.items() if k not in drivers}
        here_only = not what and (here_only or shaky)
        cure = None if what or here_only else cure
        count = basis.shape[1]
        if lam.shape[1] == MANY:  # of a large mechanism not all dependencies are there; those of a set's own rows are
            own = G[np.concatenate([groups[e] for e in numbers])].toarray()
            count = len(own) - int(np.linalg.matrix_rank(own, tol=TOLERANCE * np.linalg.norm(own, 2)))
        out.append(RedundantSet(elements, count, what, gap, here_only, loose, cure, drivers))
    return tuple(out)


def _contradiction(basis: np.ndarray, g: np.ndarray, nu: np.ndarray, length: float) -> tuple[str, float]:
    """What the rows of a dependency disagree on, and by how much."""
    unit = basis / np.abs(basis).max(axis=0)
    gap = float(np.abs(unit.T @ g).max())
    if gap > WRONG * length:
        return "position", gap
    gap = float(np.abs(unit.T @ nu).max())
    if gap > WRONG * max(length, float(np.abs(nu).max(initial=0.0))):
        return "velocity", gap
    return "", 0.0
