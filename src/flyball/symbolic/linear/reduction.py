"""Elimination of the constraints from linear equations of expressions, and the matrices A, B, C, D.

`derivatives/linear_reduction` has the equations. Independent rows and coordinates are chosen by the values of the
parameters, with the pivoting of `Mechanism.linearize`; the basis consists of expressions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...derivatives.linear_reduction import (
    InputTerms,
    ReducedEquations,
    acting_terms,
    constrained_changes,
    product,
    state_names,
)
from ...derivatives.reduced_equations import massless_motion_error, pivot_rows
from ...errors import ModelError
from ...expression_graph.evaluation import substitute
from ...expression_graph.graph import Node, zero_objects
from ...numerics.rank import RANK_TOLERANCE, null_space, rank
from ..explicit.linear_systems import DependentEquations, is_zero, nominal_values, solve_equations
from .derivatives import Perturbed, TracedMechanism

ROUNDING_TOLERANCE = 1e-13  # rows below this part of the largest are rounding


@dataclass
class Freedoms:
    """Free coordinates at a point, and independent constraints.

    Attributes
    ----------
    G : ndarray (rows, nv)
        All constraints, along the velocities.
    chosen, chosen_v : ndarray of int
        Free coordinates, and free velocities.
    rows, rows_v : ndarray of int
        Independent constraints on positions, and among all constraints; the others follow from these.
    held : ndarray of int
        Rotations of point masses, which are fixed.
    on_positions : ndarray of bool (rows,)
        Which constraints are on positions.
    """

    G: np.ndarray
    chosen: np.ndarray
    chosen_v: np.ndarray
    rows: np.ndarray
    rows_v: np.ndarray
    held: np.ndarray
    on_positions: np.ndarray

    @cached_property
    def Z(self) -> np.ndarray:
        """Basis of the changes of positions, (nv, f), with the identity in the rows ``chosen``."""
        return self._basis(self.rows, self.chosen)

    @cached_property
    def Zv(self) -> np.ndarray:
        """Basis of the changes of velocities, (nv, fv), with the identity in the rows ``chosen_v``."""
        return self.Z if self.chosen_v is self.chosen else self._basis(self.rows_v, self.chosen_v)

    def dependent_positions(self, right: np.ndarray) -> np.ndarray:
        """See `FreeMotions`."""
        every = zero_objects(len(self.G), right.shape[1])
        every[self.on_positions] = right
        return self._dependent(self.rows, self.chosen, every)

    def dependent_velocities(self, right: np.ndarray) -> np.ndarray:
        """See `FreeMotions`."""
        return self._dependent(self.rows_v, self.chosen_v, right)

    def coordinates(self, x: np.ndarray) -> np.ndarray:
        """See `FreeMotions`."""
        return x[self.chosen]

    @property
    def dependent_v(self) -> np.ndarray:
        """Velocities that depend on the chosen ones."""
        return self._others(self.chosen_v)

    def _others(self, chosen: np.ndarray) -> np.ndarray:
        return np.setdiff1d(np.arange(self.G.shape[1]), np.r_[chosen, self.held])

    def _dependent(self, rows: np.ndarray, chosen: np.ndarray, right: np.ndarray) -> np.ndarray:
        out, others = zero_objects(self.G.shape[1], right.shape[1]), self._others(chosen)
        if len(others) and right.shape[1]:
            out[others] = -solve_equations(self.G[np.ix_(rows, others)], right[rows])
        return out

    def _basis(self, rows: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        identity = np.eye(self.G.shape[1]).astype(object)
        return identity[:, chosen] + self._dependent(rows, chosen, self.G[:, chosen])


def find_freedoms(m: TracedMechanism, p: Perturbed, requested: Sequence[str] = ()) -> Freedoms:
    """Freedoms at a point; ``requested`` names the independent coordinates.

    Raises
    ------
    ModelError
        If the requested coordinates do not determine the others.
    """
    G = p.by["nv"]
    held = _massless_velocities(p)
    which = np.flatnonzero(m.holonomic)
    chosen, rows = _chosen(m, G, which, held, _indices(m, requested))
    chosen_v, rows_v = chosen, rows
    if len(which) < len(G):
        chosen_v, rows_v = _chosen(m, G, np.arange(len(G)), held, None)
    return Freedoms(G, chosen, chosen_v, rows, rows_v, held, m.holonomic)


def _indices(m: TracedMechanism, requested: Sequence[str]) -> np.ndarray | None:
    known = [n.name for n in m.names]
    for name in requested:
        if name not in known:
            raise ModelError(f"there is no coordinate {name!r} among those that can be independent: {', '.join(known)}")
    return np.sort([known.index(name) for name in requested]) if requested else None


def scaled_rows(G: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Values of rows scaled to unit norm, rotations scaled to lengths."""
    A = nominal_values(G) * scale
    size = np.sqrt((A * A).sum(axis=1))
    least = ROUNDING_TOLERANCE * size.max(initial=0.0)
    return np.where(size > least, 1.0 / np.where(size > least, size, 1.0), 0.0)[:, None] * A


def _chosen(
    m: TracedMechanism, G: np.ndarray, which: np.ndarray, held: np.ndarray, requested: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Independent coordinates and independent rows."""
    from scipy.linalg import qr

    still = np.eye(len(m.names))[held]
    A = np.vstack([scaled_rows(G[which], m.scale), still])
    N = null_space(A)
    chosen = pivot_rows(N)
    if requested is not None:
        if len(requested) != len(chosen) or rank(N[requested]) < len(chosen):
            raise ModelError(
                f"{', '.join(m.names[d].name for d in requested)} do not determine the other coordinates there: "
                f"{len(chosen)} that do are {', '.join(m.names[d].name for d in chosen)}"
            )
        chosen = requested
    if not len(which):
        return chosen, which
    _, R, order = qr(A[: len(which)].T, mode="economic", pivoting=True)
    d = np.abs(np.diag(R))
    return chosen, np.sort(which[order[: int((d > RANK_TOLERANCE * d[0]).sum())]])


def _massless_velocities(p: Perturbed) -> np.ndarray:
    """Velocities without inertia, force and constraint."""
    empty = lambda X: np.array([all(is_zero(x) for x in row) for row in X], bool)  # noqa: E731
    out = empty(p.by["ra"]) & empty(p.by["rx"]) & empty(p.by["rv"]) & empty(p.by["nv"].T)
    return np.flatnonzero(out)


def reduce_linear(m: TracedMechanism, p: Perturbed, f: Freedoms) -> ReducedEquations:
    """Eliminate the constraints.

    Raises
    ------
    ModelError
        If a free motion has no inertia.
    """
    by, nb = p.by, f.Zv.shape[1]
    c = constrained_changes(f, InputTerms(by["rw"], by["gw"][m.holonomic], by["nw"], by["sw"]), by["nx"], p.N)
    others, laws = (acting_terms(c, *(by[f"{row}{of}"] for of in "vxzw")) for row in "rs")
    Y = _left_null_space(f, by["rl"])
    mass = product(Y.T, product(by["ra"], f.Zv))
    forces = product(Y.T, product(by["ra"], c.known) + others)
    try:
        b_dot = -solve_equations(mass, forces) if nb else forces
    except DependentEquations as e:
        raise massless_motion_error(m.names[f.chosen_v[e.row]].name) from None
    acceleration = product(f.Zv, b_dot) + c.known
    left = product(by["ra"], acceleration) + others
    lam = zero_objects(len(m.multipliers), left.shape[1])
    if len(f.rows_v):
        rest = f.dependent_v
        lam[f.rows_v] = -solve_equations(by["rl"][np.ix_(rest, f.rows_v)], left[rest])
    rate = np.vstack([c.a_dot, b_dot, laws])
    out = ReducedEquations(rate, c.x, c.u, acceleration, lam, c.z, laws, np.ones(len(laws)))
    out.add_second_order(f, Y, mass, [by[f"r{of}"] for of in "avx"], p.N)
    return out


def _left_null_space(f: Freedoms, R: np.ndarray) -> np.ndarray:
    """Matrix Y with Y^T R = 0 and the identity in the chosen rows."""
    Y = zero_objects(*f.Zv.shape)
    Y[f.chosen_v, np.arange(len(f.chosen_v))] = 1.0
    rest = f.dependent_v
    if len(rest) and len(f.chosen_v):
        Y[rest] = -solve_equations(R[np.ix_(rest, f.rows_v)].T, R[np.ix_(f.chosen_v, f.rows_v)].T)
    return Y


@dataclass
class StateSpaceMatrices:
    """State space matrices as arrays of nodes or numbers.

    Attributes
    ----------
    improper : str
        Reason why there are no B, C and D: an output depends on the rate of an input; else empty.
    """

    states: tuple[str, ...]
    state_units: tuple[str, ...]
    inputs: tuple[str, ...]
    input_units: tuple[str, ...]
    outputs: tuple[str, ...]
    output_units: tuple[str, ...]
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    mass: np.ndarray | None
    damping: np.ndarray | None
    stiffness: np.ndarray | None
    improper: str = ""


def state_space_matrices(
    m: TracedMechanism, p: Perturbed, f: Freedoms, r: ReducedEquations, outputs: Sequence[tuple[str, str]]
) -> StateSpaceMatrices:
    """Matrices for the state in which rates of inputs are eliminated; ``outputs``: names and units."""
    (A, B, C, D), improper = r.state_space(_outputs(p, r))
    why = ""
    if improper:
        output, i, rate = improper
        why = (
            f"output {outputs[output][0]!r} follows the {rate} of input {m.inputs[i].name!r}, which no state-space "
            "model describes; leave out one of the two, or use the transfer function"
        )
    states, units = state_names(m.names, f, m.controls)
    still = [(s, 0.0) for s in m.added]
    new = lambda X: None if X is None else replaced(X, still)  # noqa: E731
    return StateSpaceMatrices(
        states=states,
        state_units=units,
        inputs=tuple(i.name for i in m.inputs),
        input_units=tuple(i.unit for i in m.inputs),
        outputs=tuple(name for name, _ in outputs),
        output_units=tuple(unit for _, unit in outputs),
        A=replaced(A, still),
        B=replaced(B, still),
        C=replaced(C, still),
        D=replaced(D, still),
        mass=new(r.M),
        damping=new(r.D),
        stiffness=new(r.K),
        improper=why,
    )


def replaced(X: np.ndarray, pairs: Sequence[tuple[Node, float]]) -> np.ndarray:
    """A matrix with symbols replaced."""
    out = X.copy()
    out.ravel()[:] = substitute(list(X.ravel()), pairs)
    return out


def _outputs(p: Perturbed, r: ReducedEquations) -> np.ndarray:
    """Derivatives of the outputs by the states, the inputs and their rates, (outputs, n + 3 k)."""
    n, k = len(r.rate), p.by["yw"].shape[1]
    y = product(p.by["yx"], r.position) + product(p.by["yv"], r.velocity)
    y = y + product(p.by["ya"], r.acceleration) + product(p.by["yl"], r.multipliers)
    y = y + product(p.by["yz"], r.states)
    y[:, n : n + k] = y[:, n : n + k] + p.by["yw"]
    return y
