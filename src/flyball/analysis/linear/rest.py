"""A mechanism held at rest: what is left unbalanced there, and steps towards where nothing is.

Everything is in units of energy: translations count as parts of the mechanism's length.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...equations.tree import retract
from ...errors import AnalysisError
from ...tables.names import velocity_names
from ..compiled import Compiled
from .balance import acting, settled, unbalanced
from .derivatives import Equations, State
from .free import free
from .kinks import kinks, refused
from .least import DENSE, least


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
    verdict: Any = field(default=None, repr=False)  # on its stability, once asked for

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
        return self.c.sizes

    @cached_property
    def G(self):
        """All constraints, those on velocities too: none of them lets a displacement through. Unit rows; sparse."""
        import scipy.sparse as sp

        return sp.diags(self.per_row) @ self.equations.by_velocity[self.equations.at["n"]] @ sp.diags(self.scale)

    @cached_property
    def per_row(self) -> np.ndarray:
        """What makes the rows' length one."""
        G = self.equations.by_velocity[self.equations.at["n"]]
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
        """Constraints' violations, scaled as G; those on velocities have none."""
        which = np.array([r.holonomic for r in self.c.structure.rows], bool)
        return np.where(which, self.per_row * self.equations.block("g"), 0.0)

    @cached_property
    def size(self) -> float:
        """The largest energy that acts or that stiffness makes of a step of one."""
        most = np.abs(self.scale * acting(self.equations)).max(initial=0.0)
        return float(max(most, np.abs(self.K.data).max(initial=0.0), 1e-300))

    @cached_property
    def turns(self) -> np.ndarray:
        """Which velocities turn, (nv,) bool."""
        return np.array([n.unit == "rad" for n in velocity_names(self.c.structure)], bool)

    def missing(self) -> float:
        """What is left of the forces, of what acts, and the largest gap of the constraints."""
        return float(np.abs(self.r).max(initial=0.0) / self.size + np.abs(self.g).max(initial=0.0))

    def settled(self, part: float) -> bool:
        """Whether every equation is balanced, but for a part of what acts in it."""
        return settled(self.equations, part)

    def unbalanced(self) -> float:
        """The largest force that the best multipliers leave, of those that act in its equation."""
        return unbalanced(Rest(self.c, self.t, self.q, self.balancing()).equations)

    def pushed(self) -> str:
        """The largest force that is left along a free coordinate, in words."""
        f = free(self.equations)
        force = -f.Zv.T @ self.equations.block("r")
        if not len(force):
            return "no force"
        size = self.scale[f.chosen_v]
        k = int(np.argmax(np.abs(force * size)))
        name = f.names[f.chosen_v[k]]
        return f"{force[k]:.3g} {'N' if name.unit == 'm' else 'N*m'} push along {name.name}"

    def open(self) -> float:
        """The largest gap, of the mechanism's length or in radians."""
        return float(np.abs(self.equations.block("g")).max(initial=0.0)) / self.c.values.length

    def balancing(self) -> np.ndarray:
        """Multipliers that leave the least of the forces."""
        if not len(self.g):
            return self.lam
        return self.lam + self.per_row * least(self.G.T, self.r)

    def step(self, damping: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Newton's step, scaled, and the change of multipliers; damped by so many times the identity.

        Raises
        ------
        SingularityError
            If a law has no value or no slope there.
        """
        try:
            return self._solve(self.r, self.g, damping)
        except AnalysisError:
            if found := kinks(self.equations):
                raise refused(found, self.t, "where it rests is open") from None
            raise

    def solved(self, r: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Changes of positions along the velocities and of multipliers that make up for changes r and g."""
        step, lam = self._solve(self.scale * r, self.per_row * g, 0.0)
        return self.scale * step, lam

    def _solve(self, r: np.ndarray, g: np.ndarray, damping: float) -> tuple[np.ndarray, np.ndarray]:
        """The linear equations, every row and column by its own stiffness: soft directions beside stiff ones count."""
        import scipy.sparse as sp

        n = len(self.scale)
        if n + len(g) <= DENSE:
            return self._solve_dense(r, g, damping)
        K = (self.K + damping * self.size * sp.identity(n)).tocsr()
        stiff = np.asarray(abs(K).max(axis=1).todense()).ravel() if n else np.zeros(0)
        weakest = 1e-14 * stiff.max(initial=0.0)
        own = 1.0 / np.sqrt(np.where(stiff > weakest, stiff, stiff.max(initial=1e-300) or 1.0))
        D = sp.diags(own)
        if not len(g):
            return own * least(D @ K @ D, -own * r), np.zeros(0)
        G = self.G @ D
        rows = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
        rows = 1.0 / np.where(rows > 0.0, rows, 1.0)
        G = sp.diags(rows) @ G
        x = least(sp.bmat([[D @ K @ D, -G.T], [G, None]]), np.r_[-own * r, -rows * g])
        return own * x[:n], rows * x[n:] * self.per_row

    def _solve_dense(self, r: np.ndarray, g: np.ndarray, damping: float) -> tuple[np.ndarray, np.ndarray]:
        """The same of a small mechanism, in arrays: sparse ones take longer to be made than to be solved."""
        n = len(self.scale)
        K = self.K.toarray() + damping * self.size * np.eye(n)
        stiff = np.abs(K).max(axis=1, initial=0.0)
        most = float(stiff.max(initial=0.0))
        own = 1.0 / np.sqrt(np.where(stiff > 1e-14 * most, stiff, most or 1.0))
        K = own[:, None] * K * own
        if not len(g):
            return own * least(K, -own * r), np.zeros(0)
        G = self.G.toarray() * own
        rows = np.sqrt((G * G).sum(axis=1))
        rows = 1.0 / np.where(rows > 0.0, rows, 1.0)
        G = rows[:, None] * G
        x = least(np.block([[K, -G.T], [G, np.zeros((len(g), len(g)))]]), np.r_[-own * r, -rows * g])
        return own * x[:n], rows * x[n:] * self.per_row

    def moved(self, step: np.ndarray, lam: np.ndarray) -> Rest:
        """A scaled step on."""
        q = self.q.copy()
        retract(self.c.values.system, q, self.scale * step)
        return Rest(self.c, self.t, q, self.lam + lam)

    def closed(self) -> Rest:
        """Back on the constraints, with the multipliers that balance best."""
        now = self
        for _ in range(8):
            if not len(now.g) or np.abs(now.g).max() < 1e-12 * self.c.values.length:
                break
            now = now.moved(least(now.G, -now.g), 0.0 * now.lam)
        return Rest.at(now.c, now.t, now.q)
