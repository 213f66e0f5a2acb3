"""Which reactions a motion determines, position by position: what no self-stress can change."""

from __future__ import annotations

import numpy as np

from ...model.body import Driver
from ...model.coupling import Coupling
from ...numerics.rank import parts
from ...results.result import Result
from ..assembly.start import Assembly
from ..compiled import Compiled, compiled
from .jacobian import DENSE, lengths, scaled_jacobian, sparse_null_space
from .stresses import CHANGED, self_stresses

LEAST = 1e-6  # part of the largest entry of a dependency that makes a row part of it


class Determinacy:
    """Self-stresses of a mechanism along its motion.

    Attributes
    ----------
    count : ndarray (n,) of int
        Constraints too many at every time.
    least : ndarray (n,)
        The smallest singular value of the constraints that counts, of the largest: near zero near a singular position.
    wrenches : dict
        Joint -> what independent self-stresses do to its reaction, (n, 6, k): force and torque / length, world axes,
        on ``body_j`` at the joint's point there. Joints that none touches are left out.
    efforts : dict
        Driver or coupling -> whether its effort is undetermined, (n,) of bool; the same.
    """

    def __init__(self, n: int) -> None:
        self.least = np.ones(n)
        self.count = np.zeros(n, np.int64)
        self.wrenches: dict[str, np.ndarray] = {}
        self.efforts: dict[str, np.ndarray] = {}


def determinacy(result: Result) -> Determinacy:
    """The self-stresses at every output time of a motion."""
    n = len(result.t)
    out = Determinacy(n)
    own = compiled(result.model, parameters=result.values.told, tree=result.values.structure.tree)
    base = own if not own.structure.tree else compiled(result.model, parameters=own.values.told)
    if not len(base.structure.rows):
        return out
    found: list[tuple[int, dict[str, np.ndarray]]] = []
    for k in range(n):
        q, v = result.q[k].copy(), result.v[k].copy()
        own.z = result.states[k].copy()
        if base is not own:
            q, v = base.take(own, result.t[k], q, v)
        base.at(result.t[k], q, v)
        lam, out.least[k] = _dependencies(base)
        out.count[k] = lam.shape[1]
        if lam.shape[1]:
            found.append((k, _stresses(Assembly(base, result.t[k], q, v), lam, out, k)))
    width = int(out.count.max(initial=0))
    for k, wrenches in found:
        for name, w in wrenches.items():
            out.wrenches.setdefault(name, np.zeros((n, 6, width)))[k, :, : w.shape[1]] = w
    return out


def _dependencies(c: Compiled) -> tuple[np.ndarray, float]:
    """Multipliers (nr, k) that act on nothing, at the position last evaluated; the least singular value that counts."""
    S = c.values.system
    nr, nv = len(S.row_i), c.structure.nv
    if max(nr, nv) > DENSE:
        G, size, _ = scaled_jacobian(c)
        return sparse_null_space(G @ G.T)[1] / np.maximum(size, 1e-300)[:, None], 1.0
    row_p = S.row_p[: nr + 1]
    G = np.zeros((nr, nv))
    np.add.at(G, (np.repeat(np.arange(nr), np.diff(row_p)), S.col_i[: row_p[-1]]), c.work.G[: row_p[-1]])
    G *= lengths(c)
    size = np.maximum(np.sqrt((G * G).sum(axis=1)), 1e-300)
    p = parts(G / size[:, None])
    return p.dependencies / size[:, None], float(p.values[-1] / p.values[0]) if p.rank else 1.0


def _stresses(a: Assembly, lam: np.ndarray, out: Determinacy, k: int) -> dict[str, np.ndarray]:
    """What self-stresses do to joints; efforts of drivers and couplings that they change are noted."""
    s = a.compiled.structure
    part = np.abs(lam).max(axis=1) > LEAST * np.abs(lam).max()
    names = [name for name, rows in s.slices.items() if part[rows].any()]
    joints = [name for name in names if not isinstance(s.model[name], (Driver, Coupling))]
    for name in names:
        if name not in joints:
            out.efforts.setdefault(name, np.zeros(len(out.count), bool))[k] = True
    wrenches = self_stresses(a, lam, joints)
    largest = max((np.abs(w).max() for w in wrenches.values()), default=0.0)
    return {name: w / largest for name, w in wrenches.items() if np.abs(w).max() > CHANGED * largest}
