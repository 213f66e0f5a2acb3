"""What the constraints leave free at a state: bases of positions' and velocities' changes, with coordinates to tell
them by.

A basis Z of the motions that G allows is made the identity in as many rows as there are freedoms, so that the numbers
that multiply its columns are changes of named coordinates. These rows are those that Gaussian elimination with complete
pivoting would choose: QR with column pivoting of an orthonormal basis (Businger and Golub 1965).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...equations.tree import retract
from ...errors import SingularityError
from ...numerics.rank import TOLERANCE, null_space, parts
from ...numerics.saddle import null_basis, surely_independent
from ...numerics.sparse_rank import rank as rank_of
from ...tables.names import Named, velocity_names
from ..compiled import Compiled
from .derivatives import Equations

DENSE = 150  # rows up to which singular values decide; of more, where they may depend on one another
ROUNDED = 1e-14  # entries of a basis below this are none, where its largest are about 1
NOTHING = 1e-13  # part of the largest that rounding makes of no force, or no constraint
CLOSED = 1e-10  # of the mechanism's length
PASSES = 20
STEP = 1e-2  # part of a radian that the mechanism is moved by to see whether its rank is the usual one


@dataclass
class Free:
    """Freedoms at a state.

    Attributes
    ----------
    names : list of Named
        Of all velocities.
    holonomic, rows : ndarray
        Constraints on positions (n, nv), and those on velocities, which they are among (m, nv); prescribed coordinates
        are constraints here.
    Z, Zv : ndarray (nv, f), (nv, fv)
        Bases of what they allow, turns that mean nothing (`void`) left out: the identity in the rows ``chosen`` and
        ``chosen_v``.
    """

    names: list[Named]
    holonomic: np.ndarray
    rows: np.ndarray
    Z: np.ndarray
    Zv: np.ndarray
    chosen: np.ndarray
    chosen_v: np.ndarray
    scale: np.ndarray
    left: np.ndarray  # (f, nv): takes the chosen coordinates' changes from those of all
    left_v: np.ndarray  # the same for velocities
    on_positions: np.ndarray  # (m,): which rows are constraints on positions

    @property
    def labels(self) -> list[str]:
        """Names of the chosen coordinates."""
        return [self.names[d].name for d in self.chosen]

    def turned(self, T: np.ndarray, later: Equations) -> Free:
        """The same motions turned by T (nv, nv), under the constraints of a later instant."""
        other = free(later)
        back = np.linalg.inv(T)
        bases = {"Z": T @ self.Z, "Zv": T @ self.Zv, "left": self.left @ back, "left_v": self.left_v @ back}
        return replace(self, holonomic=other.holonomic, rows=other.rows, **bases)

    def solve(self, right: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
        """The smallest x (nv, n) with rows x = right; the rows are all of them if not given."""
        A = self.rows if rows is None else rows
        return self.scale[:, None] * np.linalg.lstsq(A * self.scale, right, rcond=TOLERANCE)[0]

    @staticmethod
    def unseen(x: np.ndarray, basis: np.ndarray, left: np.ndarray) -> np.ndarray:
        """The x that differs by the basis' motions and changes no chosen coordinate."""
        return x - basis @ (left @ x)


def free(e: Equations, like: Free | None = None) -> Free:
    """Freedoms at the state of some equations, told by the coordinates that those of another are told by, if given."""
    c = e.state.c
    s = c.structure
    names = velocity_names(s)
    scale = c.sizes / c.values.length
    G = e.by_velocity[e.at["n"]].toarray()
    which = np.array([r.holonomic for r in s.rows], bool)
    given = prescribed(c)
    holonomic, rows = np.vstack([G[which], given]), np.vstack([G, given])
    still = _taking(void(e), s.nv)
    Z, chosen = _basis(np.vstack([holonomic, still]), scale, None if like is None else like.chosen)
    Zv, chosen_v = Z, chosen
    if not which.all():
        Zv, chosen_v = _basis(np.vstack([rows, still]), scale, None if like is None else like.chosen_v)
    left = _taking(chosen, s.nv)
    left_v = left if chosen_v is chosen else _taking(chosen_v, s.nv)
    on_positions = np.r_[which, np.ones(len(given), bool)]
    return Free(names, holonomic, rows, Z, Zv, chosen, chosen_v, scale, left, left_v, on_positions)


def _taking(which: np.ndarray, n: int) -> np.ndarray:
    """Unit rows (m, n) that take some of n numbers."""
    out = np.zeros((len(which), n))
    out[np.arange(len(which)), which] = 1.0
    return out


def void(e: Equations) -> np.ndarray:
    """Velocities that mean nothing: turns of point masses, which have no inertia and on which nothing acts."""
    M, D, K = (X[e.at["r"]] for X in (e.by_acceleration, e.by_velocity, e.by_position))
    none = np.flatnonzero(M.diagonal() == 0.0)
    if not len(none):
        return none
    size, G = e.state.c.sizes, e.by_velocity[e.at["n"]]
    force = abs(D) + abs(K)
    acts = np.maximum((force @ size) * size, size * (force.T @ size))
    held = (abs(G).T @ np.ones(G.shape[0])) * size
    return np.array([d for d in none if all(x[d] <= NOTHING * x.max(initial=0.0) for x in (acts, held))], int)


def prescribed(c: Compiled) -> np.ndarray:
    """Unit rows (n, nv) for the coordinates that drivers prescribe, in the order of the structure's."""
    tree = c.structure.tables["tree"]
    out = np.zeros((len(c.structure.prescribed), c.structure.nv))
    for k, b in enumerate(c.structure.prescribed.values()):
        assert tree.law[b] >= 0
        out[k, tree.v[b]] = 1.0
    return out


def rank(G: np.ndarray, scale: np.ndarray) -> int:
    """Rank of constraint rows."""
    return rank_of(compared(G, scale)) if len(G) else 0


def _null(G: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Orthonormal basis of the scaled motions that rows allow."""
    import scipy.sparse as sp

    A = compared(G, scale)
    if DENSE < len(A) < len(scale) and surely_independent(own := sp.csr_matrix(A)):
        return null_basis(own)
    return null_space(A)


def compared(G: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Rows of unit size, turns counted in lengths."""
    A = G * scale
    size = np.sqrt((A * A).sum(axis=1))
    return A / np.where(size > 0.0, size, 1.0)[:, None]


def gaps(g: np.ndarray, G: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Values of rows as lengths, whatever they are in: what is left of each, by the size of its row."""
    size = np.linalg.norm(G * scale, axis=1)
    return np.asarray(g / np.where(size > 0.0, size, 1.0))


def _basis(G: np.ndarray, scale: np.ndarray, chosen: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    N = _null(G, scale)
    if not N.shape[1]:
        return N, np.zeros(0, int)
    if chosen is None or len(chosen) != N.shape[1]:
        chosen = pivoted(N)
    Z = scale[:, None] * N
    Z = Z @ np.linalg.inv(Z[chosen])
    Z[np.abs(Z) <= ROUNDED * scale[:, None] / scale[chosen]] = 0.0
    Z[chosen] = np.eye(len(chosen))
    return Z, chosen


def pivoted(N: np.ndarray) -> np.ndarray:
    """Rows of an orthonormal basis (nv, f) that tell the others, (f,): as complete pivoting would choose them."""
    from scipy.linalg import qr

    if not N.shape[1]:
        return np.zeros(0, int)
    *_, order = qr(N.T, mode="economic", pivoting=True)
    return np.sort(order[: N.shape[1]])


def refuse_singular(e: Equations, f: Free) -> None:
    """Refuse a position where the constraints lose rank: nothing linear holds there.

    Raises
    ------
    SingularityError
        Naming the elements whose rows depend on each other here and do not nearby.
    """
    c, x = e.state.c, e.state
    if not len(f.holonomic) or not f.Z.shape[1]:
        return
    here = rank(f.holonomic, f.scale)
    rng = np.random.default_rng(0)
    for _ in range(2):
        a = f.Z @ (f.scale[f.chosen] * rng.standard_normal(f.Z.shape[1]))
        a *= STEP / np.abs(a / f.scale).max()
        G = _nearby(c, x.t, x.q, a, f.scale)
        if G is not None and rank(G, f.scale) > here:
            names = _lost(f, G, c)
            raise singular(x.t, names)


def singular(t: float, names: tuple[str, ...]) -> SingularityError:
    """The error that names the elements whose constraints lose rank at a position."""
    return SingularityError(
        f"the mechanism is in a singular position at t = {t:.6g} s: the constraints of {', '.join(names)} "
        f"depend on each other here and not nearby, so that there is no linear model; move it away from there",
        t,
        names,
    )


def _nearby(c: Compiled, t: float, q: np.ndarray, step: np.ndarray, scale: np.ndarray) -> np.ndarray | None:
    """Rows of the constraints on positions at the closed position near a step away; None if none is found."""
    z, q, still = c.z.copy(), q.copy(), np.zeros(len(step))
    which = np.array([r.holonomic for r in c.structure.rows], bool)
    G = np.zeros((0, len(step)))
    try:
        for _ in range(PASSES):
            retract(c.values.system, q, step)
            c.at(t, q, still)
            G, g = c.jacobian()[which], c.work.rows.value[which]
            if np.abs(g).max(initial=0.0) < CLOSED * c.values.length:
                return np.vstack([G, prescribed(c)])
            step = (
                -scale
                * np.linalg.lstsq(
                    np.vstack([G, prescribed(c)]) * scale, np.r_[g, np.zeros(len(prescribed(c)))], rcond=TOLERANCE
                )[0]
            )
        return None
    finally:
        c.z = z


def _lost(f: Free, G: np.ndarray, c: Compiled) -> tuple[str, ...]:
    """Elements whose rows take part in dependencies that are not there nearby."""
    here, there = parts(compared(f.holonomic, f.scale)).dependencies, parts(compared(G, f.scale)).span
    part = np.abs(here @ (here.T @ there)).max(axis=1)
    of = [r.element.name for r in c.structure.rows if r.holonomic] + list(c.structure.prescribed)
    return tuple(dict.fromkeys(n for n, p in zip(of, part, strict=True) if p > 1e-3))
