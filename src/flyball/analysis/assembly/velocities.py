"""Consistent velocities at a closed position.

In this order: the constraints are fulfilled, with what drivers and initial rates ask for; what is described is kept
exactly where that allows it, else as nearly, measured by the kinetic energy of the difference; what is left free has
the least kinetic energy of the whole, so that what nothing determines rests (Thomson's theorem: as blows would
start it).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...model.model import Model
from ...numerics.rank import svd
from ..compiled import Compiled, compiled
from .described import Given, described, deviation, given, gradient
from .positions import DENSE, ITERATIONS, NO_PART, NO_PIVOT, row_scales

CONSISTENT = 1e-13  # part of the terms of a row that its residual may be
WRONG = 1e-9  # the same, above which rows contradict one another
BLOCKED = 1e-8  # given velocities that the constraints allow by less than this part only are held by them
PATIENCE = 5  # steps of large mechanisms that may gain nothing: multipliers swing before they settle
NOTHING = 1e-200  # terms below this have no digits to compare
SMALL = 100  # velocities up to which matrices are dense
SOFT = 1e-10  # of large mechanisms: how much what is free is held in each iteration, compared with what is given


@dataclass
class Wanted:
    """Rows that velocities must fulfil (hard), and those that they should (soft), at a position.

    ``root``: R with R R^T the inverse mass matrix, zero for bodies whose motion is given and must not change. Soft
    rows are weighted so that the sum of their squares is twice the kinetic energy of the difference. Hard rows times
    ``scale`` are rates in 1/s all of them, so that what is small does not depend on the unit of length.
    """

    c: Compiled
    q: np.ndarray
    nu: np.ndarray
    G: Any  # dense up to `SMALL` velocities
    free: np.ndarray  # 0 for velocities that are given and must not change, else 1
    scale: np.ndarray  # of the hard rows
    held: list[Given]  # hard, besides the constraints
    soft: list[Given]

    @cached_property
    def root(self) -> Any:
        """See above; dense up to `SMALL` velocities."""
        return self.c.inverse_mass_root(self.free, dense=self.c.structure.nv <= SMALL)

    @cached_property
    def weights(self) -> dict[str, np.ndarray]:
        """Of the soft rows."""
        root = self.root
        return {g.name: _weight(_plain(root[g.at : g.at + g.n, g.at : g.at + g.n]), g) for g in self.soft}

    @classmethod
    def at(cls, c: Compiled, q: np.ndarray, nu: np.ndarray, still: np.ndarray | None = None) -> Wanted:
        """At the position last evaluated, q, for rows with the right-hand sides nu."""
        told = given(c.values)
        small = c.structure.nv <= SMALL
        free = np.ones(c.structure.nv)
        for g in told:
            if g.as_drawn and g.whole:
                free[g.at : g.at + g.n] = 0.0
        held = [g for g in told if g.as_drawn and not g.whole]
        soft = [g for g in told if not g.as_drawn]
        G = c.jacobian() if small else c.sparse_jacobian()
        if held:
            G = _above(G, _stacked(c, q, held, {}))
        scale = np.concatenate([row_scales(c), *(_inverse_sizes(c, g) for g in held)])
        return cls(c, q, nu, G, free, scale, held, soft)

    @property
    def determined(self) -> bool:
        """Whether these rows leave no velocity free."""
        A = np.vstack([_plain(x) / (_norm(_plain(x)) or 1.0) for x in self._whitened()])
        free = (abs(self.root).sum(axis=0) > 0.0).sum()
        return bool(np.linalg.matrix_rank(A, tol=BLOCKED * _norm(A)) == free) if A.size else free == 0

    def _whitened(self, soft: bool = True) -> tuple[Any, Any]:
        """Both kinds of rows, by velocities whose squares are twice the kinetic energy."""
        return _times(self.scale, self.G) @ self.root, _stacked(
            self.c, self.q, self.soft if soft else [], self.weights
        ) @ self.root

    def missed(self, v: np.ndarray) -> np.ndarray:
        """Of the hard rows."""
        n = len(self.nu)
        return np.r_[self.nu - self.G[:n] @ v, *(-deviation(self.c.values, g, self.q, v) for g in self.held)]

    def lost(self, v: np.ndarray) -> np.ndarray:
        """Of the soft rows."""
        x = self.c.values
        parts = [-self.weights[g.name] @ deviation(x, g, self.q, v) for g in self.soft]
        return np.concatenate(parts) if parts else np.zeros(0)

    def steps(self, soft: bool = True) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
        """(missed, lost) -> the change of velocities that takes them away; without soft rows only what is missed."""
        A, C = self._whitened(soft)
        solve = _dense(A, C) if A.shape[0] + C.shape[0] <= DENSE else _sparse(A, C)
        return lambda missed, lost: self.root @ solve(self.scale * missed, lost)


def _weight(R: np.ndarray, g: Given) -> np.ndarray:
    """Square root of the mass matrix of a body, the part that its given velocities speak of."""
    W = np.linalg.inv(R)
    return W if g.whole else W[: g.shifts, : g.shifts] if g.origin else W[g.shifts :, g.shifts :]


def _inverse_sizes(c: Compiled, g: Given) -> np.ndarray:
    """Factors that make the given velocities of a body rates in 1/s."""
    shifts = np.full(g.shifts if g.origin else 0, 1.0 / c.values.length)
    return np.r_[shifts, np.ones(g.turns if g.turning else 0)]


def _times(scale: np.ndarray, A: Any) -> Any:
    """Rows of a matrix, each times a factor."""
    if isinstance(A, np.ndarray):
        return scale[:, None] * A
    import scipy.sparse as sp

    return (sp.diags(scale) @ A).tocsr()


def _stacked(c: Compiled, q: np.ndarray, told: list[Given], weights: Mapping[str, np.ndarray]):
    """Derivatives of the (weighted) deviations of bodies by all velocities; dense up to `SMALL` of these."""
    i, j, x, n = [], [], [], 0
    for g in told:
        T = gradient(c.values, g, q)
        T = weights[g.name] @ T if g.name in weights else T
        rows, columns = np.indices(T.shape)
        i.append(n + rows.ravel())
        j.append(g.at + columns.ravel())
        x.append(T.ravel())
        n += len(T)
    nv = c.structure.nv
    if nv <= SMALL:
        dense = np.zeros((n, nv), np.result_type(float, *x))
        if n:
            dense[np.concatenate(i), np.concatenate(j)] = np.concatenate(x)
        return dense
    import scipy.sparse as sp

    if not n:
        return sp.csr_matrix((0, nv))
    entries = (np.concatenate(x), (np.concatenate(i), np.concatenate(j)))
    return sp.csr_matrix(entries, shape=(n, nv))


def _dense(A, C) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Least x of those with |C x - s| least of those with A x = r, by singular values of A and of what it leaves of C.

    Golub and Van Loan, *Matrix Computations*, section 6.2 (least squares with equality constraints).
    """
    used = np.flatnonzero(_used(A) | _used(C))
    n = A.shape[1]
    A, C = _plain(A[:, used]), _plain(C[:, used])
    V, inverse = _pseudo_inverse(A, NO_PART * _norm(A))
    left = C - (C @ V) @ V.T
    inverse_left = _pseudo_inverse(left, BLOCKED * _norm(C))[1]

    def solve(r: np.ndarray, s: np.ndarray) -> np.ndarray:
        x = np.zeros(n)
        x[used] = inverse @ r
        x[used] += inverse_left @ (s - C @ x[used])
        return x

    return solve


def _plain(A: Any) -> np.ndarray:
    return A if isinstance(A, np.ndarray) else A.toarray()


def _used(A: Any) -> np.ndarray:
    """Which columns are not empty."""
    if isinstance(A, np.ndarray):
        return np.asarray(A.any(axis=0))
    used = np.zeros(A.shape[1], bool)
    used[A.indices] = True
    return used


def _above(A: Any, B: Any) -> Any:
    if isinstance(A, np.ndarray):
        return np.vstack([A, B])
    import scipy.sparse as sp

    return sp.vstack([A, B]).tocsr()


def _norm(A: np.ndarray) -> float:
    """Largest singular value."""
    return float(np.linalg.norm(A, 2)) if A.size else 0.0


def _pseudo_inverse(A: np.ndarray, none: float) -> tuple[np.ndarray, np.ndarray]:
    """(basis of the row space, pseudo-inverse); singular values up to ``none`` are none."""
    U, s, Vt = svd(A)
    keep = s > none
    V = Vt[keep].T
    return V, (V / s[keep]) @ U[:, keep].T


def _sparse(A, C) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """One step of the proximal method of multipliers towards the same; iterations lead there.

    Least e |x|^2 + |C x - s|^2 with A x = r, by [e 1, C^T, A^T; C, -1, 0; A, 0, -d], rows of unit size: the multipliers
    that are kept from one step to the next take d out again (Rockafellar, Math. Oper. Res. 1, 1976).
    """
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu

    n, m, k = A.shape[1], A.shape[0], C.shape[0]
    size_A, size_C = (np.sqrt(np.asarray(X.multiply(X).sum(axis=1)).max(initial=0.0)) or 1.0 for X in (A, C))
    A, C = A / size_A, C / size_C
    d = NO_PIVOT / SOFT
    K = splu(
        sp.bmat(
            [
                [SOFT * sp.identity(n), C.T, A.T],
                [C, -sp.identity(k), None],
                [A, None, -d * sp.identity(m)],
            ],
            format="csc",
        )
    )
    multipliers = np.zeros(m)

    def solve(r: np.ndarray, s: np.ndarray) -> np.ndarray:
        x = K.solve(np.r_[np.zeros(n), s / size_C, r / size_A - d * multipliers])
        multipliers[:] = x[n + k :]
        return x[:n]

    return solve


def consistent(
    model: Model, plain: Compiled, parameters: Mapping | None, t: float, q: np.ndarray, rates: Mapping[str, float]
) -> tuple[np.ndarray, Wanted, Compiled]:
    """Velocities at the closed position q, and what was wanted of them.

    Parameters
    ----------
    model : Model
    plain : Compiled
        In absolute coordinates.
    parameters : mapping or None
        Values in place of the model's.
    t : float
    q : ndarray
    rates : mapping
        Initial conditions for rates.

    Returns
    -------
    v : ndarray (nv,)
        Where rows contradict one another, those that miss them least; `contradiction` tells.
    wanted : Wanted
    c : Compiled
        The mechanism whose rows these are: with those of the initial rates.
    """
    holds = [i for i in model.initial if i.name in rates]
    c = compiled(model, parameters=parameters, holds=holds, held={}) if holds else plain
    c.follow(plain.hints)
    v = described(c.values, q)
    c.at(t, q, v)
    nu = c.work.rows.nu.copy()
    for i in holds:
        nu[c.structure.slices[i.name]] = rates[i.name]
    w = Wanted.at(c, q, nu)
    if not w.G.shape[0] or np.abs(w.scale * w.missed(v)).max() <= CONSISTENT * terms(w, v):
        return v, w, c
    v = _approach(w, v)
    if w.soft and np.abs(w.scale * w.missed(v)).max() > CONSISTENT * terms(w, v):  # soft rows pull at the others
        v = _approach(w, v, soft=False)
    return v, w, c


def terms(w: Wanted, v: np.ndarray) -> float:
    """What terms of the scaled hard rows may be [1/s].

    A body that spins fast about its own axis leaves rounding in them all.
    """
    sizes = w.c.sizes
    largest = float(_times(w.scale, _times(sizes, abs(w.G).T).T).max()) if w.G.shape[0] else 0.0
    asked = float(np.abs(w.scale[: len(w.nu)] * w.nu).max(initial=0.0))
    return max(largest * float(np.abs(v / sizes).max(initial=0.0)), asked, NOTHING)


def _approach(w: Wanted, v: np.ndarray, soft: bool = True) -> np.ndarray:
    """Step after step, each from the residuals that the last one has left, down to rounding."""
    step = w.steps(soft)
    last = moved = np.inf
    patience = 1 if isinstance(w.G, np.ndarray) or w.G.shape[0] <= DENSE else PATIENCE
    best, left, sizes = v, patience, w.c.sizes
    for _ in range(ITERATIONS):
        missed = w.missed(v)
        d = step(missed, w.lost(v) if soft else np.zeros(0))
        worst, way = float(np.abs(w.scale * missed).max()), float(np.abs(d / sizes).max(initial=0.0))
        if worst > 0.9 * last and way > 0.9 * moved:
            left -= 1
        else:
            best, last, moved, left = v, worst, way, patience
        if left == 0 or way <= CONSISTENT * float(np.abs(v / sizes).max(initial=0.0)):
            break
        v = v + d
    return v if patience == 1 else best


def contradiction(w: Wanted, v: np.ndarray) -> dict[str, float]:
    """Elements whose rows the velocities miss, and by how much; none where they are consistent."""
    r = np.abs(w.missed(v))
    scaled, limit = w.scale * r, WRONG * terms(w, v)
    parts = dict(w.c.structure.slices)
    at = len(w.nu)
    for g in w.held:
        n = len(gradient(w.c.values, g, w.q))
        parts[g.name] = slice(at, at + n)
        at += n
    missed = {k: float(scaled[rows].max(initial=0.0)) for k, rows in parts.items()}
    found = sorted((k for k in missed if missed[k] > limit), key=lambda k: -missed[k])
    return {k: float(r[parts[k]].max()) for k in found}
