"""The linear equations with the constraints taken out, as expressions: see `analysis/linear/reduced.py` for the way.

With x a change of position, u = x' - N x one of velocity, l of the multipliers and w of the inputs,

    M u' + D u + K x + R l + r_w w = 0,    G x + g_w w = 0,    G u + V x + n_w w + g_w w' = 0,

x = Z a + X w and u = Zv b + P a + U w + U1 w'. Multipliers drop out along Y with Y^T R = 0, which is Zv unless friction
follows the reactions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...analysis.linear.reduced import without_inertia
from ...graph.arrays import zeros
from .derivatives import Perturbed
from .free import Free
from .solve import Dependent, is_zero, numbers, product, solved
from .traced import Mechanics

IMPROPER = 1e-12  # part of what makes an output follow an input at all, below which its rate's part is rounding


@dataclass
class Reduced:
    """Linear equations in s = (a, b): columns are s, the inputs, their first and their second rates.

    Attributes
    ----------
    rate : ndarray (n, n + 3 m)
        s'.
    position, velocity, acceleration, multipliers : ndarray
        Changes of everything.
    M, D, K : ndarray (f, f) or None
        M a'' + D a' + K a = 0, where all constraints are on positions.
    """

    rate: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    multipliers: np.ndarray
    M: np.ndarray | None
    D: np.ndarray | None
    K: np.ndarray | None


def reduced(m: Mechanics, p: Perturbed, f: Free) -> Reduced:
    """Take the constraints out.

    Raises
    ------
    ModelError
        If something free moves without inertia.
    """
    by, nv, k = p.by, len(m.names), len(m.inputs)
    na, nb = f.Z.shape[1], f.Zv.shape[1]
    X = -_dependent(f.rows, f.chosen, f.held, by["nv"], by["gw"])
    none = zeros(nv, k)
    holonomic = np.array([m.holonomic[i] for i in f.rows_v], bool)
    rates = zeros(len(by["gw"]), k)
    rates[f.rows_v[holonomic]] = by["gw"][f.rows_v[holonomic]]
    V = _clean(by["nx"])
    P, U, U1 = (
        -_dependent(f.rows_v, f.chosen_v, f.held, by["nv"], right)
        for right in (product(V, f.Z), _sum(product(V, X), by["nw"]), rates)
    )
    x = np.hstack([f.Z, zeros(nv, nb), X, none, none])
    u = np.hstack([P, f.Zv, U, U1, none])
    a_dot = _sum(u, product(p.N, x))[f.chosen]
    known = _sum(product(P, a_dot), np.hstack([zeros(nv, na + nb), none, U, U1]))
    acting = np.hstack([zeros(nv, na + nb), by["rw"], none, none])
    others = _sum(product(by["rv"], u), product(by["rx"], x), acting)
    Y = _left(f, by["rl"])
    mass = product(Y.T, product(by["ra"], f.Zv))
    forces = product(Y.T, _sum(product(by["ra"], known), others))
    try:
        b_dot = -solved(mass, forces) if nb else forces
    except Dependent as e:
        raise without_inertia(m.names[f.chosen_v[e.row]].name) from None
    acceleration = _sum(product(f.Zv, b_dot), known)
    left = _sum(product(by["ra"], acceleration), others)
    lam = zeros(len(m.multipliers), left.shape[1])
    if len(f.rows_v):
        rest = np.setdiff1d(np.arange(nv), np.r_[f.chosen_v, f.held])
        lam[f.rows_v] = -solved(by["rl"][np.ix_(rest, f.rows_v)], left[rest])
    second: tuple[Any, Any, Any] = (None, None, None)
    if na == nb and len(f.rows) == len(f.rows_v):
        turned = -product(p.N, f.Z)  # u = Z a' + turned a
        D = product(Y.T, _sum(product(by["ra"], turned), product(by["rv"], f.Z)))
        K = product(Y.T, _sum(product(by["rv"], turned), product(by["rx"], f.Z)))
        second = (mass, D, K)
    return Reduced(np.vstack([a_dot, b_dot]), x, u, acceleration, lam, *second)


def _sum(*parts: np.ndarray) -> np.ndarray:
    total = parts[0].copy()
    for part in parts[1:]:
        for at, x in np.ndenumerate(part):
            if not is_zero(x):
                total[at] = total[at] + x
    return total


def _clean(A: np.ndarray) -> np.ndarray:
    """Zeros where there are no expressions."""
    out = zeros(*A.shape)
    for at, x in np.ndenumerate(A):
        if not is_zero(x):
            out[at] = x
    return out


def _dependent(rows: np.ndarray, chosen: np.ndarray, held: np.ndarray, G: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The x with G x = right that changes no chosen coordinate."""
    out = zeros(G.shape[1], right.shape[1])
    others = np.setdiff1d(np.arange(G.shape[1]), np.r_[chosen, held])
    if len(others) and right.shape[1]:
        out[others] = solved(G[np.ix_(rows, others)], right[rows])
    return out


def _left(f: Free, R: np.ndarray) -> np.ndarray:
    """Y, the identity in the chosen rows, with Y^T R = 0."""
    Y = zeros(*f.Zv.shape)
    Y[f.chosen_v, np.arange(len(f.chosen_v))] = 1.0
    rest = np.setdiff1d(np.arange(len(Y)), np.r_[f.chosen_v, f.held])
    if len(rest) and len(f.chosen_v):
        Y[rest] = -solved(R[np.ix_(rest, f.rows_v)].T, R[np.ix_(f.chosen_v, f.rows_v)].T)
    return Y


def improper(parts: tuple[np.ndarray, np.ndarray, np.ndarray]) -> tuple[int, int, str] | None:
    """Which output follows the rate of which input, if one does: from its parts by inputs and their rates."""
    D, D1, D2 = (numbers(x) for x in parts)
    size = np.abs(D) + np.abs(D1) + np.abs(D2) + np.abs(numbers(parts[0])).max(initial=0.0)
    for rate, part in (("rate", D1), ("second rate", D2)):
        bad = np.argwhere(np.abs(part) > IMPROPER * size)
        if len(bad):
            return int(bad[0][0]), int(bad[0][1]), rate
    return None
