"""Elimination of constraints and of input rates from linear equations, the same for numbers and for expressions.

Let x be a change of position along the velocities, u a change of velocity, both seen from an evenly turning frame (see
`steady_motion`), z a change of the controller states, w the inputs. The perturbed kinematics, equations of motion,
constraints and controllers at a state are

    x' + H x = u + N x,    M (u' + H u) + D u + K x + R z + r_w w = G^T l,
    G x + g_w w = 0,       G u + V x + n_w w + g_w w' = 0,    z' = s_x x + s_u u + s_z z + s_w w

K contains the change of forces, inertia and *reactions* when positions change. Joint forces turn with the bodies, so K
is not only the stiffness of the springs. With x = Z a + X w and u = Zv b + P a + U w + U1 w' the multipliers drop out
of the equations along Zv. Joint friction depends on the reactions, adds F to -G^T, and needs another projection.
Inputs that move the mechanism act through their rates, too. The change of state y~ = y - B2 w' - (B1 + A B2) w
eliminates these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..tables.structure_definition import VelocityName

# Dependence of an output on an input's rate below this part of its total dependence on the input is rounding.
IMPROPER_TOLERANCE = 1e-12


def product(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Product A B; of expressions without products of zeros."""
    if object not in (A.dtype, B.dtype):
        return np.asarray(A @ B)
    C = B if B.ndim == 2 else B[:, None]
    out = np.zeros((len(A), C.shape[1]), object)
    for row, a in zip(out, A, strict=True):
        for k in np.flatnonzero(a != 0.0):
            for j in np.flatnonzero(C[k] != 0.0):
                row[j] = row[j] + a[k] * C[k, j]
    return out.reshape(len(A), *B.shape[1:])


class FreeMotions(Protocol):
    """Motions that the constraints allow.

    ``chosen`` and ``chosen_v`` are the free coordinates and velocities; ``on_positions`` says which constraints are on
    positions.
    """

    chosen: np.ndarray
    chosen_v: np.ndarray
    on_positions: np.ndarray

    @property
    def Z(self) -> np.ndarray:
        """Basis of the changes of positions, (nv, f), with the identity in the rows ``chosen``."""

    @property
    def Zv(self) -> np.ndarray:
        """Basis of the changes of velocities, (nv, fv), with the identity in the rows ``chosen_v``."""

    def dependent_positions(self, right: np.ndarray) -> np.ndarray:
        """Changes x with G x + right = 0 that change no chosen coordinate; G: constraints on positions."""

    def dependent_velocities(self, right: np.ndarray) -> np.ndarray:
        """Changes u with G u + right = 0 that change no chosen velocity."""

    def coordinates(self, x: np.ndarray) -> np.ndarray:
        """Changes of the chosen coordinates in changes x."""


@dataclass
class InputTerms:
    """Derivatives of the equations by m inputs at a fixed state.

    r_w (nv, m), g_w (holonomic, m), n_w (rows, m), s_w (nz, m).
    """

    r: np.ndarray
    g: np.ndarray
    n: np.ndarray
    s: np.ndarray


class ConstrainedChanges(NamedTuple):
    """Changes that keep the constraints; columns as in `ReducedEquations`.

    Attributes
    ----------
    x, u, z : ndarray
        Changes of positions, velocities and controller states.
    a_dot : ndarray
        Rates of the changes of the free coordinates.
    known : ndarray
        The part of the accelerations that does not depend on b'.
    """

    x: np.ndarray
    u: np.ndarray
    z: np.ndarray
    a_dot: np.ndarray
    known: np.ndarray


def constrained_changes(f: FreeMotions, w: InputTerms, V: np.ndarray, turning: np.ndarray) -> ConstrainedChanges:
    """Changes that keep the constraints; ``turning`` is N - H, ``V`` as in the module."""
    nv, nz, m = len(V.T), *w.s.shape
    kind = f.Z.dtype
    none, still, rates = np.zeros((nv, m), kind), np.zeros((nv, nz), kind), np.zeros((len(V), m), kind)
    rates[f.on_positions] = w.g
    X = f.dependent_positions(w.g)
    P, U, U1 = (f.dependent_velocities(b) for b in (product(V, f.Z), product(V, X) + w.n, rates))
    x = np.hstack([f.Z, np.zeros(f.Zv.shape, kind), still, X, none, none])
    u = np.hstack([P, f.Zv, still, U, U1, none])
    z = np.zeros((nz, x.shape[1]), kind)
    free = f.Z.shape[1] + f.Zv.shape[1]
    np.fill_diagonal(z[:, free:], 1.0)
    a_dot = f.coordinates(u + product(turning, x))
    return ConstrainedChanges(
        x, u, z, a_dot, product(P, a_dot) + np.hstack([np.zeros((nv, free + nz), kind), none, U, U1])
    )


def acting_terms(
    c: ConstrainedChanges, by_velocity: np.ndarray, by_position: np.ndarray, by_state: np.ndarray, by_input: np.ndarray
) -> np.ndarray:
    """Changes of forces, or of rates of controller states, along the columns."""
    n, m = by_input.shape
    free = c.x.shape[1] - by_state.shape[1] - 3 * m
    direct = [np.zeros((n, free), c.x.dtype), by_state, by_input, np.zeros((n, 2 * m), c.x.dtype)]
    return product(by_velocity, c.u) + product(by_position, c.x) + np.hstack(direct)


@dataclass
class ReducedEquations:
    """Linear equations in the changes y = (a, b, z) of free coordinates, velocities and controller states, and inputs.

    The columns of every array belong to y (n), the inputs, and their first and second rates (m each).

    Attributes
    ----------
    rate : ndarray (n, n + 3 m)
        y' as a linear function of y and the inputs.
    position, velocity, acceleration, multipliers, states : ndarray
        Changes of all positions, velocities, accelerations, multipliers and efforts of prescribed coordinates, and
        controller states.
    laws : ndarray (nz, n + 3 m)
        Changes of the rates of the controller states; for sampled ones of the values from the next instant on.
    changes : ndarray (nz,)
        Large changes of the controller states.
    M, D, K : ndarray (f, f) or None
        Matrices of M a'' + D a' + K a = 0; None unless all constraints are on positions and there are no states z.
    uncertainty : MatrixUncertainty
        Uncertainty of A due to rounding.
    """

    rate: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    multipliers: np.ndarray
    states: np.ndarray
    laws: np.ndarray
    changes: np.ndarray
    M: np.ndarray | None = None
    D: np.ndarray | None = None
    K: np.ndarray | None = None
    uncertainty: Any = None

    @property
    def A(self) -> np.ndarray:
        """System matrix, y' = A y without inputs."""
        return self.rate[:, : len(self.rate)]

    def inputs(self, part: np.ndarray) -> list[np.ndarray]:
        """Columns of the inputs, of their first rates and of their second rates."""
        return np.split(part[:, len(self.rate) :], 3, axis=1)

    def add_second_order(
        self, f: FreeMotions, Y: np.ndarray, mass: np.ndarray, whole: Sequence[np.ndarray], turning: np.ndarray
    ) -> None:
        """Set M, D and K: ``mass``, and from M, M H + D, K of all velocities; Y^T eliminates the multipliers."""
        if f.Zv.shape != f.Z.shape or len(self.states):
            return
        M, D, K = whole
        turned = -product(turning, f.Z)  # u = Z a' + turned a
        self.M = mass
        self.D = product(Y.T, product(M, turned) + product(D, f.Z))
        self.K = product(Y.T, product(D, turned) + product(K, f.Z))

    def state_space(self, y: np.ndarray) -> tuple[list[np.ndarray], tuple[int, int, str] | None]:
        """A, B, C, D for the state in which the rates of inputs are eliminated, of outputs ``y`` along the columns.

        And (output, input, rate) of an output that depends on the rate of an input; None if there is none.
        """
        A, n = self.A, len(self.rate)
        B, B1, B2 = self.inputs(self.rate)
        C, (D, D1, D2) = y[:, :n], self.inputs(y)
        shift = B1 + product(A, B2)
        size = sum(_sizes(X) for X in (D, D1, D2)) + _sizes(C) @ sum(_sizes(X) for X in (B, B1, B2))
        improper = None
        for rate, part in (("rate", D1 + product(C, B2)), ("second rate", D2)):
            for k, i in np.argwhere(_sizes(part) > IMPROPER_TOLERANCE * size)[:1]:
                improper = improper or (int(k), int(i), rate)
        return [A, B + product(A, shift), C, D + product(C, shift)], improper


def _sizes(X: np.ndarray) -> Any:
    """Absolute values of numbers, or of expressions with the parameters' own values."""
    return np.abs(np.array([x.real for x in X.ravel()], float).reshape(X.shape))


def state_names(
    names: Sequence[VelocityName], f: FreeMotions, controls: Sequence[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of the states y."""
    a, b = ([names[d] for d in of] for of in (f.chosen, f.chosen_v))
    units = (*(n.unit for n in a), *(f"{n.unit}/s" for n in b), *("" for _ in controls))
    return (*(n.name for n in a), *(f"{n.name} rate" for n in b), *controls), units
