"""A mechanism held at rest: what is left unbalanced there, and steps towards where nothing is.

Everything is in units of energy: translations count as parts of the mechanism's length.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...system.names import velocity_names
from ...system.tables import G_VALUE, MASS
from ...system.tree import retract
from ..compiled import Compiled
from .derivatives import Equations, State

DENSE = 1200  # unknowns up to which a step is one of least squares
LEAST = 1e-11  # singular values of the equations below this part of the largest are none
NOTHING = 1e-9  # acceleration [m/s^2] of the whole mechanism that is none
WEAK = 1e-10  # what is added to the sparse equations' diagonal, of their entries


@dataclass
class Rest:
    """A state at rest with multipliers.

    Attributes
    ----------
    c : Compiled
        In absolute coordinates.
    t : float [s]
    q, lam : ndarray
    """

    c: Compiled
    t: float
    q: np.ndarray
    lam: np.ndarray

    @classmethod
    def at(cls, c: Compiled, t: float, q: np.ndarray) -> Rest:
        """With the multipliers that balance the forces best."""
        bare = cls(c, t, q, np.zeros(len(c.structure.rows)))
        return cls(c, t, q, bare.balancing())

    @cached_property
    def equations(self) -> Equations:
        """The equations there."""
        return Equations(State.resting(self.c, self.t, self.q, self.lam))

    @cached_property
    def scale(self) -> np.ndarray:
        """Size of a step of one along every velocity: the mechanism's length, or a radian."""
        return np.array([self.c.values.length if n.unit == "m" else 1.0 for n in velocity_names(self.c.structure)])

    @cached_property
    def holonomic(self) -> np.ndarray:
        """Which rows are constraints on positions."""
        return np.array([r.holonomic for r in self.c.structure.rows], bool)

    @cached_property
    def G(self):
        """Constraints on positions, scaled to unit rows; sparse."""
        import scipy.sparse as sp

        G = self.equations.by_position[self.equations.at["g"]][self.holonomic] @ sp.diags(self.scale)
        return sp.diags(self.per_row) @ G

    @cached_property
    def per_row(self) -> np.ndarray:
        """What makes the rows' length one."""
        G = self.equations.by_position[self.equations.at["g"]][self.holonomic]
        size = np.sqrt(np.asarray((G.multiply(G)) @ (self.scale**2)).ravel())
        return 1.0 / np.where(size > 0.0, size, 1.0)

    @cached_property
    def K(self):
        """Stiffness, scaled, sparse."""
        import scipy.sparse as sp

        d = sp.diags(self.scale)
        return d @ self.equations.by_position[self.equations.at["r"]] @ d

    @cached_property
    def r(self) -> np.ndarray:
        """What is left of the forces under these multipliers, scaled."""
        return self.scale * self.equations.block("r")

    @cached_property
    def g(self) -> np.ndarray:
        """Constraints' violations, scaled as G."""
        return self.per_row * self.equations.block("g")[self.holonomic]

    @cached_property
    def size(self) -> float:
        """Energy that small ones are compared with: what acts, and what stiffness makes of a step of one."""
        acting = np.abs(self.r + self.G.T @ (self.lam[self.holonomic] / self.per_row)).max(initial=0.0)
        nothing = NOTHING * float(self.c.values.system.body_x[:, MASS].sum()) * self.c.values.length
        return float(max(acting, np.abs(self.K.data).max(initial=0.0), nothing))

    def unbalanced(self) -> float:
        """The largest force that the best multipliers leave, of those that act."""
        best = Rest(self.c, self.t, self.q, self.balancing())
        return float(np.abs(best.r).max(initial=0.0)) / self.size

    def open(self) -> float:
        """The largest gap, of the mechanism's length or in radians."""
        self.c.at(self.t, self.q, np.zeros_like(self.scale))
        return float(np.abs(self.c.work.row[G_VALUE][self.holonomic]).max(initial=0.0)) / self.c.values.length

    def balancing(self) -> np.ndarray:
        """Multipliers that leave the least of the forces."""
        out = self.lam.copy()
        if self.holonomic.any():
            out[self.holonomic] += self.per_row * _least(self.G.T, self.r)
        return out

    def step(self, damping: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Newton's step, scaled, and the change of multipliers; damped by so many times the identity."""
        return self._solve(self.r, self.g, damping)

    def solved(self, r: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Changes of positions along the velocities and of multipliers that make up for changes r and g."""
        step, lam = self._solve(self.scale * r, self.per_row * g[self.holonomic], 0.0)
        return self.scale * step, lam

    def _solve(self, r: np.ndarray, g: np.ndarray, damping: float) -> tuple[np.ndarray, np.ndarray]:
        import scipy.sparse as sp

        n = len(self.scale)
        K = self.K + damping * self.size * sp.identity(n)
        A = sp.bmat([[K, -self.G.T * self.size], [self.G * self.size, None]]) if len(g) else K
        x = _least(A, np.r_[-r, -g * self.size])
        lam = np.zeros_like(self.lam)
        lam[self.holonomic] = x[n:] * self.size * self.per_row
        return x[:n], lam

    def moved(self, step: np.ndarray, lam: np.ndarray) -> Rest:
        """A scaled step on."""
        q = self.q.copy()
        retract(self.c.values.system, q, self.scale * step)
        return Rest(self.c, self.t, q, self.lam + lam)

    def closed(self) -> Rest:
        """Back on the constraints, with the multipliers that balance best."""
        now = self
        for _ in range(8):
            if now.open() < 1e-12 or not len(now.g):
                break
            now = now.moved(_least(now.G, -now.g), 0.0 * now.lam)
        return Rest.at(now.c, now.t, now.q)


def _least(A, b: np.ndarray) -> np.ndarray:
    """The smallest x that leaves the least of A x = b."""
    import scipy.sparse as sp
    from scipy.sparse.linalg import spsolve

    if max(A.shape) <= DENSE:
        return np.linalg.lstsq(A.toarray(), b, rcond=LEAST)[0]
    # large: the normal form [-e I, A; A^T, e I], refined once for what the e leave
    m, n = A.shape
    e = WEAK * np.abs(A.data).max()
    N = sp.bmat([[-e * sp.identity(m), A], [A.T, e * sp.identity(n)]]).tocsc()
    x = spsolve(N, np.r_[b, np.zeros(n)])
    return x[m:] + spsolve(N, np.r_[b - A @ x[m:], np.zeros(n)])[m:]
