"""Freedoms and redundancy: Gruebler's count, the true rank, and the names of the joints that say the same twice.

The counts are found at once, since every motion begins with them. What takes longer is found when it is asked for: the
sets of constraints that depend on one another and their cures (``redundancy``), the free motions by name
(``freedoms``), and what the mobility rests on (``geometry``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import AssemblyError, ModelError
from ..model.model import Model
from ..tables.system import SEMIDEFINITE
from .assemble import Assembly, assemble
from .compiled import Compiled

if TYPE_CHECKING:
    from .freedom.freedoms import FreeMotion
    from .freedom.geometry import Geometry
    from .freedom.redundancy import RedundantSet

TOLERANCE = 1e-8  # singular values below this part of the largest count as zero; rows scaled to unit length
DENSE = 1500  # velocities up to which the rank comes from a singular value decomposition
WEAK = 1e-10  # pivots of a large matrix with unit rows below this count as zero
ADDED = 1e-13  # to the diagonal of such a matrix
SHOWN = 64  # dependencies of a large mechanism whose elements are named
CHANGED = 1e-6  # part of the largest that a self-stress does to a component, below which it leaves it alone
COMPONENTS = ("force x", "force y", "force z", "torque x", "torque y", "torque z")
LINES = 12  # of a kind that are printed


@dataclass(frozen=True)
class Found:
    """Where a mechanism was looked at, and what the null spaces of its Jacobian are there."""

    assembly: Assembly
    dependencies: np.ndarray  # multipliers (nr, k) that act on nothing; of a large mechanism up to `SHOWN` of them
    motions: np.ndarray | None  # velocities (nv, f) that the rows allow; None where there may be very many
    gap: str = ""  # why it cannot be assembled, if it cannot


@dataclass(frozen=True)
class Mobility:
    """Freedoms and redundancy of a mechanism at a position.

    Attributes
    ----------
    velocities, rows, rank : int
        Velocities of all bodies, constraint rows, and how many of these are independent.
    redundant : tuple of str
        Elements whose rows take part in a dependency.
    undetermined : dict
        Joint -> reaction components (world axes, on ``body_j``) that redundancy leaves undetermined.
    """

    velocities: int
    rows: int
    rank: int
    redundant: tuple[str, ...] = ()
    undetermined: dict[str, tuple[str, ...]] = field(default_factory=dict)
    found: Found | None = field(default=None, compare=False, repr=False)

    @property
    def gruebler(self) -> int:
        """Freedoms by counting rows (Gruebler and Kutzbach)."""
        return self.velocities - self.rows

    @property
    def freedoms(self) -> int:
        """Freedoms by rank, at this position."""
        return self.velocities - self.rank

    @property
    def redundancy(self) -> int:
        """Rows that say nothing new."""
        return self.rows - self.rank

    @cached_property
    def sets(self) -> tuple[RedundantSet, ...]:
        """The independent sets of constraints that depend on one another, each as small as can be, with cures."""
        from .freedom.redundancy import redundant_sets

        if self._there.gap:
            return redundant_sets(self._there, [], False)
        g = self.geometry
        return redundant_sets(self._there, g.positions, g.singular and not g.positions)

    @cached_property
    def motions(self) -> tuple[FreeMotion, ...]:
        """The free motions by name; of a large mechanism up to `SHOWN`."""
        from .freedom.freedoms import free_motions

        return free_motions(self._there.assembly, motions_of(self._there))

    @cached_property
    def geometry(self) -> Geometry:
        """What the freedoms rest on: counting, special dimensions, or a singular position."""
        from .freedom.geometry import geometry

        return geometry(self)

    @property
    def _there(self) -> Found:
        if self.found is None:
            raise ValueError("this count was made without its mechanism")
        return self.found

    def lines(self) -> list[tuple[str, str]]:
        """Label and text of what a reader wants to see first."""
        there = self._there
        out = [("mechanism", there.assembly.compiled.structure.model.name)]
        if there.gap:
            out.append(("not closed", there.gap))
        out.append(("freedoms", f"{self.freedoms} at this position; counting gives {self.gruebler}"))
        out += [("freedoms", m.text) for m in self.motions[:LINES]]
        if self.freedoms > LINES:
            out.append(("freedoms", f"... and {self.freedoms - LINES} more"))
        if not there.gap:
            out.append(("geometry", self.geometry.text))
        for s in self.sets[:LINES]:
            out += [("redundant", s.text), ("redundant", s.advice)]
        if (left := self.redundancy - sum(s.count for s in self.sets[:LINES])) > 0:
            out.append(("redundant", f"... and {left} more"))
        if self.undetermined:
            text = "; ".join(f"{k}: {', '.join(v)}" for k, v in list(self.undetermined.items())[:LINES])
            out.append(("reactions not determined", text))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "name": self._there.assembly.compiled.structure.model.name,
            "closed": not self._there.gap,
            "velocities": self.velocities,
            "rows": self.rows,
            "rank": self.rank,
            "gruebler": self.gruebler,
            "freedoms": self.freedoms,
            "redundancy": self.redundancy,
            "redundant": list(self.redundant),
            "undetermined": {k: list(v) for k, v in self.undetermined.items()},
            "motions": [m.as_dict() for m in self.motions],
            "sets": [s.as_dict() for s in self.sets],
            "geometry": None if self._there.gap else self.geometry.as_dict(),
        }

    def __str__(self) -> str:
        lines = self.lines()
        width = max(len(k) for k, _ in lines)
        labels = [k if not i or k != lines[i - 1][0] else "" for i, (k, _) in enumerate(lines)]
        return "\n".join(f"{k:<{width}}  {v}" for k, (_, v) in zip(labels, lines, strict=True))


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
            a = assemble(model, t=t, parameters=parameters)
        except AssemblyError as error:
            if error.best is None:
                raise
            a, gap = error.best, str(error)
    c = a.compiled
    c.at(a.t, a.q, a.v)
    s, S = c.structure, c.values.system
    G, size, scale = scaled_jacobian(c)
    nr, nv = (int(n) for n in G.shape)
    rank, dependent, motions = _dense(G.toarray()) if max(nr, nv) <= DENSE else _sparse(G)
    if inertia and S.glob[SEMIDEFINITE] > 0.0:
        _check_inertia(model, a, _massless(a, G, scale) if motions is None else motions * scale[:, None])
    names: list[str] = []
    for k in np.flatnonzero(np.abs(dependent).max(axis=1, initial=0.0) > 1e-6).tolist():
        if (name := s.rows[k].element.name) not in names:
            names.append(name)
    lam = dependent / np.maximum(size, 1e-300)[:, None]
    there = Found(a, lam, None if motions is None else motions * scale[:, None], gap)
    return Mobility(nv, nr, rank, tuple(names), undetermined(a, lam, names) if len(names) else {}, there)


def scaled_jacobian(c: Compiled) -> tuple[Any, np.ndarray, np.ndarray]:
    """The Jacobian last evaluated with turns counted in lengths and rows of unit size, and both scales.

    Returns
    -------
    G : sparse (nr, nv)
    size : ndarray (nr,)
        What rows were divided by.
    scale : ndarray (nv,)
        What columns were multiplied with: velocities are ``scale`` times those that G takes.
    """
    import scipy.sparse as sp

    scale = lengths(c)
    G = c.sparse_jacobian() @ sp.diags(scale)
    size = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
    return sp.diags(1.0 / np.maximum(size, 1e-300)) @ G, size, scale


def lengths(c: Compiled) -> np.ndarray:
    """1 for velocities that are metres a second, 1 / length of the mechanism for those that are radians."""
    return c.sizes / c.values.length


def rank_of(c: Compiled) -> int:
    """Rank of the Jacobian last evaluated."""
    G = scaled_jacobian(c)[0]
    if max(G.shape) > DENSE:
        return _sparse(G)[0]
    d = np.linalg.svd(G.toarray(), compute_uv=False)
    return int((d > TOLERANCE * d.max(initial=1e-300)).sum())


def motions_of(there: Found) -> np.ndarray:
    """Velocities (nv, f) that the rows allow; of a large mechanism up to `SHOWN`."""
    if there.motions is not None:
        return there.motions
    a = there.assembly
    a.compiled.at(a.t, a.q, a.v)
    G, _, scale = scaled_jacobian(a.compiled)
    return _null_space((G.T @ G).tocsr())[1] * scale[:, None]


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
    L^T x = e_k gives a vector of the null space. Its pivot is x^T A x, so that of a vector spread over very many
    entries is larger by their number: there the quotient of Rayleigh decides.
    """
    import scipy.sparse as sp
    from scipy.sparse.linalg import spsolve_triangular

    from ..numerics.ldl import analyse

    n = A.shape[0]
    size = np.sqrt(np.where(A.diagonal() > 0.0, A.diagonal(), 1.0))
    A = (sp.diags(1.0 / size) @ A @ sp.diags(1.0 / size)).tocoo()
    P, place = analyse(n, A.row, A.col)
    upper = P.perm[A.row] <= P.perm[A.col]  # each pair of entries counts once
    x = np.zeros(len(P.Ai))
    np.add.at(x, place[: A.nnz][upper], A.data[upper])
    x[P.Ap[1:] - 1] += ADDED
    D, L = np.zeros(n), np.zeros(len(P.Li))
    _factor_entry()(P, x, L, D, np.zeros(n))
    transposed = (sp.csc_matrix((L, P.Li, P.Lp), shape=(n, n)) + sp.identity(n, format="csc")).T.tocsr()

    def vectors(pivots: np.ndarray) -> np.ndarray:
        ends = np.zeros((n, len(pivots)))
        ends[pivots, np.arange(len(pivots))] = 1.0
        return spsolve_triangular(transposed, ends, lower=False) if len(pivots) else ends

    with np.errstate(divide="ignore"):
        pivots = 1.0 / D
    sure, doubtful = ~(pivots > WEAK), (pivots > WEAK) & (pivots < 10.0 * ADDED * n)
    which = np.flatnonzero(doubtful)
    quotients = pivots[which] / np.maximum((vectors(which) ** 2).sum(axis=0), 1.0)
    weak = np.sort(np.r_[np.flatnonzero(sure), which[quotients < 10.0 * ADDED]])
    ends = vectors(weak[:SHOWN])[P.perm] / size[:, None]
    return len(weak), ends / np.maximum(np.abs(ends).max(axis=0, initial=0.0), 1e-300)


def _factor_entry():
    from ..numerics.ldl import factor_kernel

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


def self_stresses(a: Assembly, lam: np.ndarray, names: list[str]) -> dict[str, np.ndarray]:
    """Wrenches (6, k) on ``body_j`` at the joint's point there that each of the self-stresses ``lam`` (nr, k) makes.

    World axes, torques divided by the mechanism's length. The mechanism has been evaluated at the position.
    """
    from ..constraints.registry import KINDS
    from ..equations.records import load
    from ..equations.rows import parameters

    c = a.compiled
    s, S, W = c.structure, c.values.system, c.work
    out = {n: np.zeros((6, lam.shape[1])) for n in names}
    for name in names:
        for k in s.terms_of[name]:
            t = s.terms[k]
            par = parameters(S.term_x, k)
            hint = c.z[t.hint] if t.hint >= 0 else 0.0
            _, f, tM, tF, _ = KINDS[t.formula.kind].row(par, load(W.FK, t.F), load(W.FK, t.M), hint, S.const)
            force, torque = np.array(f), np.array(tM)
            if s.frames[t.M].role != "M":  # measured from M to F
                force, torque = -force, np.array(tF)
            out[name] += np.outer(np.r_[force, torque / c.values.length] * par[7], lam[t.row])
    return out


def undetermined(a: Assembly, lam: np.ndarray, names: list[str]) -> dict[str, tuple[str, ...]]:
    """Reaction components (world axes, on body_j) that self-stresses ``lam`` (nr, k) can change, of these elements."""
    planar = a.compiled.structure.model.planar
    wrenches = self_stresses(a, lam, names)
    largest = max(np.abs(w).max() for w in wrenches.values())
    out = {}
    for name, w in wrenches.items():
        free = np.abs(w).max(axis=1) > CHANGED * largest
        if planar:
            free[[2, 3, 4]] = False
        text = tuple(
            x if not planar else x.replace("torque z", "torque") for x, f in zip(COMPONENTS, free, strict=True) if f
        )
        if text:
            out[name] = text
    return out
