"""Linear equations of a large mechanism at rest: sparse, in absolute coordinates, the constraints left in.

    M x'' + D x' + K x = G^T l,   G x = 0

G has independent rows only, so that the equations have one solution; what depends on these says nothing else. Refused
is what `linearize` refuses of small ones, found by sparse means.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...equations.tree import retract
from ...errors import AnalysisError, SingularityError
from ...numerics.pencil import Pencil
from ...numerics.sparse_rank import weak_pivots
from ...tables.names import velocity_names
from ..assembly.positions import closed_near
from ..freedom.jacobian import scaled_jacobian
from .derivatives import Equations, State
from .free import STEP as AWAY
from .free import singular, void
from .kinks import kinks, refused
from .least import least
from .loads import feels
from .reduced import without_inertia
from .steady import SAME, SWING, balanced, changing, timed

DENSE = 600  # velocities up to which the constraints are taken out and all is dense, and
FREE = 150  # freedoms, as counted: what is dense of more takes longer than all that is sparse
PART = 1e-3  # of a dependency: elements with less have none in it
LOST = 1e-6  # of rows of unit size: dependencies that nearby rows change by as much are none there
MASSLESS = 1e12  # motion that forces make, where every inertia is one by itself: some motion has none


def are_many(free: int, velocities: int, rows: int) -> bool:
    """Whether there are more velocities, or freedoms as counted than ``free``, than dense equations are made for."""
    return velocities > DENSE or velocities - rows > free


def is_large(x: State, free: int) -> bool:
    """Whether the linear equations at a state are sparse: of many velocities, at rest, constraints on positions."""
    s = x.c.structure
    many = are_many(DENSE if s.loads else free, s.nv, len(s.rows))  # friction by reactions is for dense ones
    return many and not s.tree and not np.any(x.v) and all(r.holonomic for r in s.rows)


@dataclass
class Large:
    """Sparse linear equations.

    Attributes
    ----------
    e : Equations
    scale : ndarray (nv,)
        1 for metres, 1 / length of the mechanism for radians: what velocities are divided by.
    rows : ndarray (m,)
        The constraint that each row of G is; beyond the constraints: that a turn which means nothing is none.
    G : sparse (m, nv)
    """

    e: Equations
    scale: np.ndarray
    rows: np.ndarray
    G: Any

    @cached_property
    def matrices(self) -> tuple[Any, Any, Any]:
        """M, D and K, sparse (nv, nv)."""
        r = self.e.at["r"]
        return tuple(X[r] for X in (self.e.by_acceleration, self.e.by_velocity, self.e.by_position))  # type: ignore

    @cached_property
    def pencil(self) -> Pencil:
        """The same in units in which all compares."""
        import scipy.sparse as sp

        S = sp.diags(self.scale)
        M, D, K = ((S @ X @ S).tocsr() for X in self.matrices)
        return Pencil(M, D, K, unit_rows(self.G @ S)[0])

    @classmethod
    def at(cls, x: State, frozen: bool, to: Sequence[str] = ()) -> Large:
        """At a state that `is_large`; ``to`` are parameters that inputs are.

        Raises
        ------
        AnalysisError, SingularityError, ModelError
            As `linearize`.
        """
        import scipy.sparse as sp

        e = Equations(x)
        if x.c.structure.loads and feels(x, *e.complex_tables):
            raise AnalysisError(
                f"{x.c.structure.model.name!r} has {len(x.v)} velocities, and friction that follows its joints' "
                f"reactions; linear equations of so large a mechanism are made without such friction only"
            )
        x.c.at(x.t, x.q, x.v)
        G, _, scale = scaled_jacobian(x.c)
        weak, vectors = weak_pivots(G @ G.T)
        if len(weak):
            _refuse_singular(x, G, weak, vectors, scale)
        rows = np.setdiff1d(np.arange(G.shape[0]), weak)
        still = void(e)
        one = sp.csr_matrix((np.ones(len(still)), (np.arange(len(still)), still)), shape=(len(still), len(x.v)))
        whole = sp.vstack([e.by_velocity[e.at["n"]][rows], one]).tocsr()
        found = cls(e, scale, np.r_[rows, G.shape[0] + np.arange(len(still))], whole)
        found._refuse_kinks(to)
        if not frozen:
            balanced(x, e)
        found._refuse_massless()
        if not frozen and timed(x.c.values.system):
            found._refuse_changing()
        return found

    def freed(self, way: np.ndarray) -> np.ndarray:
        """The part of changes of positions that the constraints allow."""
        G = self.pencil.G
        along = way / self.scale
        return self.scale * (along - least(G, G @ along)) if G.shape[0] else way

    def _refuse_kinks(self, to: Sequence[str]) -> None:
        """Refuse forces with a kink that a free motion crosses."""
        found = []
        for k in kinks(self.e, to):
            ways = [self.scale**2 * part for part in k.along]  # steepest, in units that compare
            dq, dv = (self.freed(way) for way in ways)
            if k.felt(np.stack([dq, 0.0 * dq], 1), np.stack([0.0 * dv, dv], 1)):
                found.append(k)
        if found:
            raise refused(found, self.e.state.t, "there are no linear equations")

    def _refuse_massless(self) -> None:
        """Refuse free motions without inertia."""
        import scipy.sparse as sp

        p = self.pencil
        if not p.freedoms:
            return
        own = p.M.diagonal()
        unit = sp.diags(1.0 / np.sqrt(np.where(own > 0.0, own, own.max())))
        M, G = (unit @ p.M @ unit).tocsr(), unit_rows(p.G @ unit)[0]
        force = np.random.default_rng(0).standard_normal(len(own))
        try:
            moved = Pencil(M, M, M, G).solver(0.0)(force, np.zeros(G.shape[0]))
        except AnalysisError:
            moved = np.where(own > 0.0, 0.0, np.inf)
        if not np.abs(moved).max() <= MASSLESS:
            d = int(np.argmax(np.abs(moved)))
            raise without_inertia(velocity_names(self.e.state.c.structure)[d].name)

    def _refuse_changing(self) -> None:
        """Refuse equations that are others a moment later, though the mechanism rests."""
        x, r = self.e.state, self.e.at["r"]
        z = x.c.z.copy()
        then = Equations(State.moving(x.c, x.t + SWING / self.pencil.fastest, x.q, x.v))
        for now, later in ((self.e.by_velocity, then.by_velocity), (self.e.by_position, then.by_position)):
            if abs(later[r] - now[r]).max() > SAME * abs(now[r]).max():
                raise changing()
        x.c.at(x.t, x.q, x.v)
        x.c.z = z


def unit_rows(G: Any) -> tuple[Any, np.ndarray]:
    """Rows of unit size, and what they were divided by."""
    import scipy.sparse as sp

    size = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
    size = np.where(size > 0.0, size, 1.0)
    return (sp.diags(1.0 / size) @ G).tocsr(), size


def _refuse_singular(x: State, G: Any, weak: np.ndarray, vectors: np.ndarray, scale: np.ndarray) -> None:
    """Refuse a position where rows depend on one another that do not nearby."""
    c = x.c
    z, random = c.z.copy(), np.random.default_rng(0).standard_normal(len(x.v))
    for _ in range(2):
        way = random - least(G, G @ random)
        q = x.q.copy()
        retract(c.values.system, q, AWAY * scale * way * c.values.length / np.abs(way).max())
        near = closed_near(c, x.t, q)
        if near is not None:
            c.at(x.t, near, 0.0 * x.v)
            H = scaled_jacobian(c)[0]
            if len(weak_pivots(H @ H.T)[0]) < len(weak):
                raise _singular(x, H.T @ vectors, vectors)
        random = np.random.default_rng(1).standard_normal(len(x.v))
    c.at(x.t, x.q, x.v)
    c.z = z


def _singular(x: State, left: np.ndarray, vectors: np.ndarray) -> SingularityError:
    """The error that names the elements of dependencies of which something is left nearby."""
    _, d, Vt = np.linalg.svd(left, full_matrices=False)
    lost = np.abs(vectors @ Vt[d > LOST].T).max(axis=1, initial=0.0)
    rows = x.c.structure.rows
    names = tuple(dict.fromkeys(r.element.name for r, part in zip(rows, lost, strict=True) if part > PART))
    return singular(x.t, names)
