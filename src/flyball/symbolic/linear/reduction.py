"""Elimination of the constraints from linear equations, and the matrices A, B, C, D.

With the changes x of position, u = x' - N x of velocity, z of the controller states, l of the multipliers and w of the
inputs,

    M u' + D u + K x + r_z z + R l + r_w w = 0,    G x + g_w w = 0,    G u + V x + n_w w + g_w w' = 0,
    z' = s_x x + s_u u + s_z z + s_w w,

x = Z a + X w and u = Zv b + P a + U w + U1 w'. Multipliers are eliminated by Y with Y^T R = 0, which is Zv unless
friction depends on the reactions. Independent rows and coordinates are chosen by the values of the parameters,
with the pivoting of `Mechanism.linearize`; the basis consists of expressions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...derivatives.reduced_equations import massless_motion_error, pivot_rows
from ...errors import ModelError
from ...expression_graph.evaluation import substitute
from ...expression_graph.graph import Node, zero_objects
from ...numerics.rank import RANK_TOLERANCE, null_space, rank
from .derivatives import Perturbed, TracedMechanism
from .elimination import DependentEquations, is_zero, matrix_product, nominal_values, solve_equations

ROUNDING_TOLERANCE = 1e-13  # rows below this part of the largest are rounding


@dataclass
class Freedoms:
    """Free coordinates at a point, and independent constraints.

    Attributes
    ----------
    Z, Zv : ndarray (nv, f), (nv, fv)
        Bases of the changes of positions and velocities that the constraints allow, with the identity in the rows
        ``chosen`` and ``chosen_v``.
    rows, rows_v : ndarray of int
        Independent constraints on positions, and among all constraints; the others follow from these.
    held : ndarray of int
        Rotations of point masses, which are fixed.
    """

    Z: np.ndarray
    Zv: np.ndarray
    chosen: np.ndarray
    chosen_v: np.ndarray
    rows: np.ndarray
    rows_v: np.ndarray
    held: np.ndarray


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
    Z = _basis(G, rows, chosen, held)
    if len(which) == len(G):
        return Freedoms(Z, Z, chosen, chosen, rows, rows, held)
    chosen_v, rows_v = _chosen(m, G, np.arange(len(G)), held, None)
    return Freedoms(Z, _basis(G, rows_v, chosen_v, held), chosen, chosen_v, rows, rows_v, held)


def with_bases_of(f: Freedoms, p: Perturbed) -> Freedoms:
    """The same free coordinates and rows, with the bases of another state."""
    G = p.by["nv"]
    return replace(f, Z=_basis(G, f.rows, f.chosen, f.held), Zv=_basis(G, f.rows_v, f.chosen_v, f.held))


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


def _basis(G: np.ndarray, rows: np.ndarray, chosen: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Basis with the identity in the chosen rows; the other rows follow from the constraints."""
    nv = G.shape[1]
    others = np.setdiff1d(np.arange(nv), np.r_[chosen, held])
    Z = zero_objects(nv, len(chosen))
    Z[chosen, np.arange(len(chosen))] = 1.0
    if len(others) and len(chosen):
        Z[others] = solve_equations(G[np.ix_(rows, others)], -G[np.ix_(rows, chosen)])
    return Z


def _massless_velocities(p: Perturbed) -> np.ndarray:
    """Velocities without inertia, force and constraint."""
    empty = lambda X: np.array([all(is_zero(x) for x in row) for row in X], bool)  # noqa: E731
    out = empty(p.by["ra"]) & empty(p.by["rx"]) & empty(p.by["rv"]) & empty(p.by["nv"].T)
    return np.flatnonzero(out)


IMPROPER_TOLERANCE = (
    # Dependence of an output on an input's rate below this part of its total dependence is rounding.
    1e-12
)


@dataclass
class ReducedLinearEquations:
    """Linear equations in y = (a, b, z): columns are y, the inputs, their first and their second rates.

    Attributes
    ----------
    rate : ndarray (n, n + 3 m)
        y' as a linear function of the columns.
    position, velocity, acceleration, multipliers, states : ndarray
        Changes of all positions, velocities, accelerations, multipliers and controller states.
    M, D, K : ndarray (f, f) or None
        M a'' + D a' + K a = 0, where all constraints are on positions and there are no controller states.
    """

    rate: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    multipliers: np.ndarray
    states: np.ndarray
    M: np.ndarray | None
    D: np.ndarray | None
    K: np.ndarray | None


def reduce_linear(m: TracedMechanism, p: Perturbed, f: Freedoms) -> ReducedLinearEquations:
    """Eliminate the constraints.

    Raises
    ------
    ModelError
        If a free motion has no inertia.
    """
    by, nv, k = p.by, len(m.names), len(m.inputs)
    na, nb, nz = f.Z.shape[1], f.Zv.shape[1], len(m.s)
    X = -_dependent(f.rows, f.chosen, f.held, by["nv"], by["gw"])
    none, still = zero_objects(nv, k), zero_objects(nv, nz)
    holonomic = np.array([m.holonomic[i] for i in f.rows_v], bool)
    rates = zero_objects(len(by["gw"]), k)
    rates[f.rows_v[holonomic]] = by["gw"][f.rows_v[holonomic]]
    V = _clean(by["nx"])
    P, U, U1 = (
        -_dependent(f.rows_v, f.chosen_v, f.held, by["nv"], right)
        for right in (matrix_product(V, f.Z), _sum(matrix_product(V, X), by["nw"]), rates)
    )
    x = np.hstack([f.Z, zero_objects(nv, nb), still, X, none, none])
    u = np.hstack([P, f.Zv, still, U, U1, none])
    z = np.hstack([zero_objects(nz, na + nb), _identity(nz), zero_objects(nz, 3 * k)])
    a_dot = _sum(u, matrix_product(p.N, x))[f.chosen]
    known = _sum(matrix_product(P, a_dot), np.hstack([zero_objects(nv, na + nb + nz), none, U, U1]))
    others, z_dot = (
        _sum(
            matrix_product(by[f"{of}v"], u), matrix_product(by[f"{of}x"], x), matrix_product(by[f"{of}z"], z),
            np.hstack([zero_objects(n, na + nb + nz), by[f"{of}w"], zero_objects(n, 2 * k)]),
        )
        for of, n in (("r", nv), ("s", nz))
    )  # fmt: skip
    Y = _left_null_space(f, by["rl"])
    mass = matrix_product(Y.T, matrix_product(by["ra"], f.Zv))
    forces = matrix_product(Y.T, _sum(matrix_product(by["ra"], known), others))
    try:
        b_dot = -solve_equations(mass, forces) if nb else forces
    except DependentEquations as e:
        raise massless_motion_error(m.names[f.chosen_v[e.row]].name) from None
    acceleration = _sum(matrix_product(f.Zv, b_dot), known)
    left = _sum(matrix_product(by["ra"], acceleration), others)
    lam = zero_objects(len(m.multipliers), left.shape[1])
    if len(f.rows_v):
        rest = np.setdiff1d(np.arange(nv), np.r_[f.chosen_v, f.held])
        lam[f.rows_v] = -solve_equations(by["rl"][np.ix_(rest, f.rows_v)], left[rest])
    second: tuple[Any, Any, Any] = (None, None, None)
    if na == nb and len(f.rows) == len(f.rows_v) and not nz:
        turned = -matrix_product(p.N, f.Z)  # u = Z a' + turned a
        D = matrix_product(Y.T, _sum(matrix_product(by["ra"], turned), matrix_product(by["rv"], f.Z)))
        K = matrix_product(Y.T, _sum(matrix_product(by["rv"], turned), matrix_product(by["rx"], f.Z)))
        second = (mass, D, K)
    return ReducedLinearEquations(np.vstack([a_dot, b_dot, z_dot]), x, u, acceleration, lam, z, *second)


def _identity(n: int) -> np.ndarray:
    out = zero_objects(n, n)
    np.fill_diagonal(out, 1.0)
    return out


def _sum(*parts: np.ndarray) -> np.ndarray:
    total = parts[0].copy()
    for part in parts[1:]:
        for at, x in np.ndenumerate(part):
            if not is_zero(x):
                total[at] = total[at] + x
    return total


def _clean(A: np.ndarray) -> np.ndarray:
    """Replace identically zero expressions by 0."""
    out = zero_objects(*A.shape)
    for at, x in np.ndenumerate(A):
        if not is_zero(x):
            out[at] = x
    return out


def _dependent(rows: np.ndarray, chosen: np.ndarray, held: np.ndarray, G: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The x with G x = right that changes no chosen coordinate."""
    out = zero_objects(G.shape[1], right.shape[1])
    others = np.setdiff1d(np.arange(G.shape[1]), np.r_[chosen, held])
    if len(others) and right.shape[1]:
        out[others] = solve_equations(G[np.ix_(rows, others)], right[rows])
    return out


def _left_null_space(f: Freedoms, R: np.ndarray) -> np.ndarray:
    """Matrix Y with Y^T R = 0 and the identity in the chosen rows."""
    Y = zero_objects(*f.Zv.shape)
    Y[f.chosen_v, np.arange(len(f.chosen_v))] = 1.0
    rest = np.setdiff1d(np.arange(len(Y)), np.r_[f.chosen_v, f.held])
    if len(rest) and len(f.chosen_v):
        Y[rest] = -solve_equations(R[np.ix_(rest, f.rows_v)].T, R[np.ix_(f.chosen_v, f.rows_v)].T)
    return Y


def improper_output(parts: tuple[np.ndarray, np.ndarray, np.ndarray]) -> tuple[int, int, str] | None:
    """(output, input, rate) of an output that depends on the rate of an input; None if there is none."""
    D, D1, D2 = (nominal_values(x) for x in parts)
    size = np.abs(D) + np.abs(D1) + np.abs(D2) + np.abs(nominal_values(parts[0])).max(initial=0.0)
    for rate, part in (("rate", D1), ("second rate", D2)):
        bad = np.argwhere(np.abs(part) > IMPROPER_TOLERANCE * size)
        if len(bad):
            return int(bad[0][0]), int(bad[0][1]), rate
    return None


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
    m: TracedMechanism, p: Perturbed, f: Freedoms, r: ReducedLinearEquations, outputs: Sequence[tuple[str, str]]
) -> StateSpaceMatrices:
    """Matrices for the state in which rates of inputs are eliminated; ``outputs``: names and units."""
    k, n = len(m.inputs), len(r.rate)
    y = _outputs(p, r, n, k)
    A, (B, B1, B2) = r.rate[:, :n], _parts(r.rate, n, k)
    C, (D, D1, D2) = y[:, :n], _parts(y, n, k)
    shift = B1 + matrix_product(A, B2)
    why = ""
    if bad := improper_output((D, D1 + matrix_product(C, B2), D2)):
        output, i, rate = bad
        why = (
            f"output {outputs[output][0]!r} follows the {rate} of input {m.inputs[i].name!r}, which no state-space "
            "model describes; leave out one of the two, or use the transfer function"
        )
    here, rates = ([m.names[d] for d in of] for of in (f.chosen, f.chosen_v))
    still = [(s, 0.0) for s in m.added]
    new = lambda X: None if X is None else replaced(X, still)  # noqa: E731
    return StateSpaceMatrices(
        states=(*(x.name for x in here), *(f"{x.name} rate" for x in rates), *m.controls),
        state_units=(*(x.unit for x in here), *(f"{x.unit}/s" for x in rates), *("" for _ in m.controls)),
        inputs=tuple(i.name for i in m.inputs),
        input_units=tuple(i.unit for i in m.inputs),
        outputs=tuple(name for name, _ in outputs),
        output_units=tuple(unit for _, unit in outputs),
        A=replaced(A, still),
        B=replaced(B + matrix_product(A, shift), still),
        C=replaced(C, still),
        D=replaced(D + matrix_product(C, shift), still),
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


def _parts(x: np.ndarray, n: int, k: int) -> list[np.ndarray]:
    """Columns of the inputs, of their first rates and of their second rates."""
    return [x[:, n + i * k : n + (i + 1) * k] for i in range(3)]


def _outputs(p: Perturbed, r: ReducedLinearEquations, n: int, k: int) -> np.ndarray:
    """Derivatives of the outputs by the states, the inputs and their rates, (outputs, n + 3 k)."""
    y = matrix_product(p.by["yx"], r.position) + matrix_product(p.by["yv"], r.velocity)
    y = y + matrix_product(p.by["ya"], r.acceleration) + matrix_product(p.by["yl"], r.multipliers)
    y = y + matrix_product(p.by["yz"], r.states)
    y[:, n : n + k] = y[:, n : n + k] + p.by["yw"]
    return y
