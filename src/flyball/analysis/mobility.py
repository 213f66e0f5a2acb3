"""Freedoms and redundancy: Gruebler's count, the true rank, and the names of the joints that say the same twice.

The counts are found at once, since every motion begins with them. What takes longer is found when it is asked for: the
sets of constraints that depend on one another and their cures (``sets``), the free motions by name (``motions``), and
what the mobility rests on (``geometry``).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import AssemblyError, ModelError
from ..model.model import Model
from ..numerics.sparse_rank import DENSE, null_spaces, sparse_null_space
from ..results.freedoms import FreeMotion, Geometry, RedundantSet
from ..results.mobility import Mobility
from ..tables.points import points
from .assembly.start import Assembly, assembled
from .freedom.freedoms import free_motions
from .freedom.geometry import geometry
from .freedom.jacobian import Found, few, scaled_jacobian
from .freedom.redundancy import redundant_sets
from .freedom.stresses import undetermined
from .untouched import left_out

SHOWN = 64  # free motions of a large mechanism that are named; counted are all


class Sought(Found):
    """What a count found, and how more is found when it is asked for."""

    @property
    def name(self) -> str:
        """Of the mechanism."""
        return self.assembly.compiled.structure.model.name

    def sets(self, m: Mobility) -> tuple[RedundantSet, ...]:
        """See `Mobility.sets`."""
        if self.gap:
            return redundant_sets(self, [], False, m.redundancy)
        g = m.geometry
        return redundant_sets(self, g.positions, g.singular and not g.positions, m.redundancy)

    def motions(self, m: Mobility) -> tuple[FreeMotion, ...]:
        """See `Mobility.motions`."""
        a = self.assembly
        a.compiled.at(a.t, a.q, a.v)  # turns are named by where bodies are
        large = max(m.rows, m.velocities) > DENSE
        return free_motions(a, self.velocities[:, : SHOWN if large else None])

    def geometry(self, m: Mobility) -> Geometry:
        """See `Mobility.geometry`."""
        return geometry(m, self)


def mobility(
    model: Model,
    a: Assembly | None = None,
    *,
    t: float = 0.0,
    parameters: Mapping[str, float] | None = None,
    inertia: bool = False,
) -> Mobility:
    """Freedoms and redundancy at a position.

    Parameters
    ----------
    model : Model
    a : Assembly, optional
        Where; assembled at time ``t`` if not given. A mechanism that cannot be assembled is then looked at in the best
        position found: the constraints that contradict one another are those that depend on one another there.
    t : float [s]
    parameters : mapping, optional
        Values of parameters in SI units, in place of the model's.
    inertia : bool
        Refuse bodies that can move without any inertia: where forces are to move them, they could not.

    Returns
    -------
    Mobility

    Raises
    ------
    ModelError
        If a body can move without any inertia and may not.
    AssemblyError
        If velocities disagree though positions do not depend on one another.
    """
    gap = ""
    if a is None:
        try:
            a = assembled(model, t=t, parameters=parameters)
        except AssemblyError as error:
            if error.best is None:
                raise
            a, gap = error.best, str(error)
    c = a.compiled
    if c.structure.rows:  # else nothing is asked of where it is, and the engine need not be compiled
        c.at(a.t, a.q, a.v)
    s, S = c.structure, c.values.system
    G, size, scale = scaled_jacobian(c, few(c))
    nr, nv = (int(n) for n in G.shape)
    rank, dependent, motions = null_spaces(G)
    if inertia and S.scales.semidefinite > 0.0:
        check_inertia(model, a, massless(a, G, scale) if motions is None else motions * scale[:, None])
    names: list[str] = []
    for k in np.flatnonzero(np.abs(dependent).max(axis=1, initial=0.0) > 1e-6).tolist():
        if (name := s.rows[k].element.name) not in names:
            names.append(name)
    lam = dependent / np.maximum(size, 1e-300)[:, None]
    there = Sought(a, lam, None if motions is None else motions * scale[:, None], gap)
    without = left_out(model)
    loose = undetermined(a, lam, names) if len(names) else {}
    return Mobility(nv, nr, rank, tuple(names), loose, without, there, lam.shape[1])


# Motions without inertia: the constraints allow them and no mass resists, so that nothing determines them.


FEW = 1e-3  # part of a motion that is no turn


def massless(a: Assembly, G: Any, scale: np.ndarray) -> np.ndarray:
    """Motions (nv, k) that the constraints allow and no mass resists, from M + G^T G."""
    import scipy.sparse as sp

    M = sp.diags(scale) @ a.compiled.mass() @ sp.diags(scale)
    return sparse_null_space(M / M.diagonal().max() + G.T @ G)[1] * scale[:, None]


def check_inertia(model: Model, a: Assembly, motions: np.ndarray) -> None:
    """Refuse motions that no mass resists.

    Raises
    ------
    ModelError
        Naming the body that could move without inertia.
    """
    if not motions.shape[1]:
        return
    i, j, M = a.compiled.mass_entries()
    K = motions[i].T @ (M[:, None] * motions[j])
    w, V = np.linalg.eigh(K)
    if w[0] > 1e-9 * max(w[-1], 1e-300):
        return
    motion = motions @ V[:, 0]
    tree = a.compiled.values.system.tree
    size = [np.abs(motion[v0 : v0 + n]).max() for v0, n in zip(tree.v, tree.nv, strict=True)]
    b = int(np.argmax(size))
    name = next(k for k, v in a.compiled.structure.place.items() if v == b)
    v0, n = int(tree.v[b]), int(tree.nv[b])
    shifts = 2 if model.planar else 3
    turns = motion[v0 + shifts : v0 + n]
    if np.abs(turns).max(initial=0.0) < FEW * size[b]:
        raise ModelError(
            f"body {name!r} can move without any mass resisting it, so its motion is not determined. Give it a "
            f"mass, or joints that make it move with bodies that have one"
        )
    about = "turn" if shifts == 2 else f"turn about ({', '.join(f'{x:.3g}' for x in turns / np.linalg.norm(turns))})"
    why = points(model).get(name, "")
    raise ModelError(
        f"body {name!r} can {about} (its own axes) without any inertia resisting it, so its motion is not determined. "
        f"Give it a moment of inertia, or joints that prevent this motion"
        + (f"; it is no point mass, which would not turn, since {why}" if why else "")
    )
