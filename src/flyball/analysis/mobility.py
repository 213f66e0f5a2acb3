"""Freedoms and redundancy: Gruebler's count, the true rank, and the names of the joints that say the same twice."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..errors import ModelError
from ..model.model import Model
from ..system.tables import SEMIDEFINITE
from .assemble import Assembly

TOLERANCE = 1e-8  # singular values below this part of the largest count as zero; rows scaled to unit length
DENSE = 1500  # velocities up to which the rank comes from a singular value decomposition
WEAK = 1e-10  # pivots of a large matrix with unit rows below this count as zero
SHOWN = 64  # dependencies of a large mechanism whose elements are named


@dataclass(frozen=True)
class Mobility:
    """Count of freedoms at a position."""

    velocities: int
    rows: int
    rank: int
    redundant: tuple[str, ...] = ()  # elements whose rows take part in a dependency
    undetermined: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def gruebler(self) -> int:
        """Freedoms by counting rows."""
        return self.velocities - self.rows

    @property
    def freedoms(self) -> int:
        """Freedoms by rank."""
        return self.velocities - self.rank

    @property
    def redundancy(self) -> int:
        """Rows that say nothing new."""
        return self.rows - self.rank


def mobility(model: Model, a: Assembly) -> Mobility:
    """Freedoms and redundant joints at an assembled position.

    Raises
    ------
    ModelError
        If a body can move without any inertia.
    """
    c = a.compiled
    c.at(a.t, a.q, a.v)
    s, S = c.structure, c.values.system
    G = c.sparse_jacobian()
    nr, nv = (int(n) for n in G.shape)
    scale = np.ones(nv)
    for v0, n in zip(S.body_i[:, 3], S.body_i[:, 5], strict=True):
        k = {3: 2, 6: 3}.get(int(n), 0)
        scale[v0 + k : v0 + n] = 1.0 / c.values.length
    import scipy.sparse as sp

    G = G @ sp.diags(scale)
    size = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
    G = sp.diags(1.0 / np.maximum(size, 1e-300)) @ G
    rank, dependent, motions = _dense(G.toarray()) if max(nr, nv) <= DENSE else _sparse(G)
    if S.glob[SEMIDEFINITE] > 0.0:
        _check_inertia(model, a, _massless(a, G, scale) if motions is None else motions * scale[:, None])
    names: list[str] = []
    for k in np.flatnonzero(np.abs(dependent).max(axis=1, initial=0.0) > 1e-6).tolist():
        if (name := s.rows[k].element.name) not in names:
            names.append(name)
    lam = dependent / np.maximum(size, 1e-300)[:, None]
    return Mobility(nv, nr, rank, tuple(names), _undetermined(a, lam, names) if len(names) else {})


def _dense(G: np.ndarray) -> tuple[int, np.ndarray, np.ndarray]:
    """Rank, basis of the dependencies among rows (nr, nr - rank), basis of the free motions (nv, nv - rank)."""
    if not len(G):
        return 0, np.zeros((0, 0)), np.eye(G.shape[1])
    U, d, Vt = np.linalg.svd(G, full_matrices=True)
    rank = int((d > TOLERANCE * d[0]).sum())
    return rank, U[:, rank:], Vt[rank:].T


def _sparse(G) -> tuple[int, np.ndarray, None]:
    """The same for a large mechanism: the null space of G G^T; of the free motions there would be too many."""
    count, dependent = _null_space(G @ G.T)
    return G.shape[0] - count, dependent, None


def _null_space(A) -> tuple[int, np.ndarray]:
    """Dimension of the null space of a sparse positive semidefinite matrix, and up to `SHOWN` vectors of its basis.

    From A = L D L^T in a pattern and order of its own: where a pivot is nothing but what was added to the diagonal,
    L^T x = e_k gives a vector of the null space.
    """
    import scipy.sparse as sp
    from scipy.sparse.linalg import spsolve_triangular

    from ..numerics.ldl import analyse

    A = A.tocoo()
    n = A.shape[0]
    P, place = analyse(n, A.row, A.col)
    upper = P.perm[A.row] <= P.perm[A.col]  # each pair of entries counts once
    x = np.zeros(len(P.Ai))
    np.add.at(x, place[: A.nnz][upper], A.data[upper])
    x[P.Ap[1:] - 1] += 1e-13
    D, L = np.zeros(n), np.zeros(len(P.Li))
    _factor_entry()(P, x, L, D, np.zeros(n))
    weak = np.flatnonzero(~(1.0 / D > WEAK))
    ends = np.zeros((n, min(len(weak), SHOWN)))
    ends[weak[: ends.shape[1]], np.arange(ends.shape[1])] = 1.0
    if len(weak):
        transposed = (sp.csc_matrix((L, P.Li, P.Lp), shape=(n, n)) + sp.identity(n, format="csc")).T.tocsr()
        ends = spsolve_triangular(transposed, ends, lower=False)
    return len(weak), ends[P.perm] / np.maximum(np.abs(ends).max(axis=0, initial=0.0), 1e-300)


def _factor_entry():
    from .entry import factor_kernel

    return factor_kernel


def _massless(a: Assembly, G, scale: np.ndarray) -> np.ndarray:
    """Motions (nv, k) that the constraints allow and no mass resists, from M + G^T G."""
    import scipy.sparse as sp

    M = sp.diags(scale) @ a.compiled.mass() @ sp.diags(scale)
    return _null_space(M / M.diagonal().max() + G.T @ G)[1] * scale[:, None]


def _check_inertia(model: Model, a: Assembly, motions: np.ndarray) -> None:
    """Massless motions are refused, naming who could move without inertia."""
    if not motions.shape[1]:
        return
    K = motions.T @ (a.compiled.mass() @ motions)
    w, V = np.linalg.eigh(K)
    if w[0] > 1e-9 * max(w[-1], 1e-300):
        return
    motion = motions @ V[:, 0]
    body_i = a.compiled.values.system.body_i
    size = [np.abs(motion[v0 : v0 + n]).max() for v0, n in zip(body_i[:, 3], body_i[:, 5], strict=True)]
    b = int(np.argmax(size))
    name = next(k for k, v in a.compiled.structure.place.items() if v == b)
    v0, n = int(body_i[b, 3]), int(body_i[b, 5])
    turns = motion[v0 + (2 if n == 3 else 3) : v0 + n]
    about = "turn" if n == 3 else f"turn about ({', '.join(f'{x:.3g}' for x in turns / np.linalg.norm(turns))})"
    raise ModelError(
        f"body {name!r} can {about} (its own axes) without any inertia resisting it, so its motion is not determined. "
        f"Give it a moment of inertia, or joints that prevent this motion"
    )


def _undetermined(a: Assembly, lam: np.ndarray, names: list[str]) -> dict[str, tuple[str, ...]]:
    """Reaction components (world axes, on body_j) that a self-stress can change."""
    from ..constraints.registry import FORMULAS
    from ..system.records import load
    from ..system.rows import parameters

    c = a.compiled
    s, S, W = c.structure, c.values.system, c.work
    out = {}
    planar = s.model.planar
    labels = ["force x", "force y", "force z", "torque x", "torque y", "torque z"]
    wrenches: dict[str, np.ndarray] = {n: np.zeros((6, lam.shape[1])) for n in names}
    for name in names:
        for k in s.terms_of[name]:
            t = s.terms[k]
            par = parameters(S.term_x, k)
            hint = c.z[t.hint] if t.hint >= 0 else 0.0
            _, f, tM, _, _ = FORMULAS[t.formula.kind](par, load(W.FK, t.F), load(W.FK, t.M), hint, S.const)
            w = np.r_[f, np.array(tM) / c.values.length] * par[7]
            wrenches[name] += np.outer(w, lam[t.row])
    largest = max(np.abs(w).max() for w in wrenches.values())
    for name, w in wrenches.items():
        free = np.abs(w).max(axis=1) > 1e-6 * largest
        if planar:
            free[[2, 3, 4]] = False
        text = tuple(
            x if not planar else x.replace("torque z", "torque") for x, f in zip(labels, free, strict=True) if f
        )
        if text:
            out[name] = text
    return out
