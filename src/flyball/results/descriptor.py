"""A linear model with the constraints left in: sparse, however large the mechanism is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import AnalysisError, ModelError
from ..numerics.pencil import Pencil
from ..numerics.saddle import saddle


@dataclass(repr=False)
class Descriptor:
    """Sparse linear equations E z' = A z + B u, y = C z + D u (a descriptor system, of index 3).

    The states z are changes of all positions along the mechanism's velocities, of these velocities, of the
    accelerations, and of the multipliers of the constraints: of such as do not depend on others. Inputs and outputs are
    those of the `LinearModel`; inputs that move the mechanism stand in the constraints, and act through their rates.

    Attributes
    ----------
    mass, damping, stiffness : sparse (nv, nv)
        M, D and K in K x + D v + M a = G^T l + (inputs).
    constraints : sparse (m, nv)
        G; constraints on positions say G x = 0.
    on_positions : ndarray (m,) of bool
        Others are on velocities: G v + V x = 0.
    by_position : sparse (m, nv)
        V.
    kinematic, turning : sparse (nv, nv) [1/s]
        N - H and H in x' = (N - H) x + v, v' = a - H v: how changes turn with the frame that they are seen from; zero
        at rest.
    forces, gaps : ndarray (nv, inputs), (m, inputs)
        What inputs do in the equations of motion, on their left, and in the constraints.
    C : sparse (outputs, 3 nv + m)
    D : ndarray (outputs, inputs)
    coordinates, units : tuple of str
        Of what each position is a change.
    rows : tuple of str
        The element that each constraint is of.
    scale : ndarray (nv,)
        1 for metres, 1 / length of the mechanism for radians.
    """

    mass: Any
    damping: Any
    stiffness: Any
    constraints: Any
    on_positions: np.ndarray
    by_position: Any
    kinematic: Any
    turning: Any
    forces: np.ndarray
    gaps: np.ndarray
    C: Any
    D: np.ndarray
    coordinates: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[str, ...]
    scale: np.ndarray = field(repr=False)

    @property
    def E(self) -> Any:
        """Sparse (3 nv + m,) square: ones for x' and v'."""
        import scipy.sparse as sp

        nv, m = self.mass.shape[0], len(self.rows)
        return sp.diags(np.r_[np.ones(2 * nv), np.zeros(nv + m)]).tocsr()

    @property
    def A(self) -> Any:
        """Sparse (3 nv + m,) square."""
        import scipy.sparse as sp

        nv, G = self.mass.shape[0], self.constraints
        one, m = sp.identity(nv), len(self.rows)
        held, moving = sp.diags(1.0 * self.on_positions), sp.diags(1.0 * ~self.on_positions)
        lines = [
            [self.kinematic, one, None, None],
            [None, -self.turning, one, None],
            [self.stiffness, self.damping, self.mass, -G.T],
        ]
        if m:
            lines.append([held @ G + moving @ self.by_position, moving @ G, None, sp.csr_matrix((m, m))])
        else:
            lines = [line[:3] for line in lines]
        return sp.bmat(lines).tocsr()

    @property
    def B(self) -> Any:
        """Sparse (3 nv + m, inputs)."""
        import scipy.sparse as sp

        return sp.csr_matrix(
            np.vstack([np.zeros((2 * len(self.forces), self.forces.shape[1])), self.forces, self.gaps])
        )

    @property
    def states(self) -> tuple[str, ...]:
        """Names of z."""
        rates = (f"{name}{what}" for what in ("", " rate", " acceleration") for name in self.coordinates)
        return (*rates, *(f"{row} multiplier" for row in self.rows))

    def __repr__(self) -> str:
        nv, m = self.mass.shape[0], len(self.rows)
        return f"descriptor form: {3 * nv + m} states ({nv} positions, {m} constraints), {self.A.nnz} entries in A"

    def response(self, omega: Sequence[float], input: int, output: int) -> np.ndarray:
        """Frequency response of an output by an input, by their places, at angular frequencies [rad/s]; complex, (n,).

        At an undamped pole it is infinite.
        """
        return np.array([self._at(1j * w, input, output) for w in np.atleast_1d(omega)])

    def _at(self, s: complex, i: int, k: int) -> complex:
        """G(s)."""
        import scipy.sparse as sp

        nv = self.mass.shape[0]
        one = sp.identity(nv)
        first = (s * one - self.kinematic).tocsr()  # v = first x, a = second v
        second = s * one + self.turning
        held, moving = sp.diags(1.0 * self.on_positions), sp.diags(1.0 * ~self.on_positions)
        P = self.stiffness + self.damping @ first + self.mass @ (second @ first)
        rows = (held @ self.constraints + moving @ (self.constraints @ first + self.by_position)).tocsr()
        unit = sp.diags(self.scale)
        try:
            solve = saddle((unit @ P @ unit).tocsc(), (self.constraints @ unit).tocsr(), (rows @ unit).tocsr())
        except AnalysisError:
            return complex(np.inf)
        x, lam = solve(-self.scale * self.forces[:, i], -self.gaps[:, i])
        x = self.scale * x
        v = first @ x
        z = np.concatenate([x, v, second @ v, lam])
        return complex((self.C[[k]] @ z)[0] + self.D[k, i])

    def nearest(self, count: int = 10, near: complex = 0.0) -> np.ndarray:
        """Eigenvalues [1/s] next to a number, by shift and invert, (k,) complex: ``count`` and what belongs to them.

        Parameters
        ----------
        count : int
        near : complex [1/s]

        Raises
        ------
        ModelError
            If the mechanism moves, or has constraints on velocities: ask `LinearModel.eigenvalues`; or if these are
            no such numbers.
        AnalysisError
            If they are not found.
        """
        import scipy.sparse as sp

        if not isinstance(count, (int, np.integer)) or count < 1:
            raise ModelError(f"count must be a whole number of at least 1, got {count!r}")
        if not np.isfinite(near):
            raise ModelError(f"near must be a finite number, got {near!r}")
        if not self.on_positions.all() or self.kinematic.nnz or self.turning.nnz:
            raise ModelError(
                "few eigenvalues of the descriptor form are found at rest, of constraints on positions; ask for all of "
                "them: eigenvalues"
            )
        S = sp.diags(self.scale)
        G = self.constraints @ S
        size = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
        own = (S @ self.mass @ S, S @ self.damping @ S, S @ self.stiffness @ S, sp.diags(1.0 / size) @ G)
        return Pencil(*(X.tocsr() for X in own)).nearest(count, near)[0]

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names; matrices by their entries that are not zero."""
        matrices = {k: _entries(getattr(self, k)) for k in ("E", "A", "B", "C")}
        return {"states": list(self.states), "units": list(self.units), **matrices, "D": self.D.tolist()}


def _entries(X: Any) -> dict[str, Any]:
    X = X.tocoo()
    return {"shape": list(X.shape), "row": X.row.tolist(), "column": X.col.tolist(), "value": X.data.tolist()}
