"""Velocities that bodies are told, as velocities of joints' coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import ModelError
from ...graph.arrays import zeros
from ...graph.derivative import jacobian, replaced
from ...graph.node import Node
from ...numerics.rank import TOLERANCE
from .solve import is_zero, numbers, product, solved
from .traced import Mechanics

SAME = 1e-9  # of the largest: velocities that differ by less are the same


def velocities(m: Mechanics, q: Sequence[tuple[Node, Any]]) -> list[Any]:
    """Velocities (nv,) with which bodies move as they are told; zero where nothing is.

    Parameters
    ----------
    m : Mechanics
        In joint coordinates.
    q : sequence of (symbol, expression)
        The position.

    Raises
    ------
    ModelError
        If the tree joints do not allow them.
    """
    nv = len(m.names)
    wanted, has = [], []
    for name, b in m.values.structure.place.items():
        told = m.values.bodies[name]
        if b >= 0 and not all(is_zero(x) for x in (*told.v, *told.w)):
            wanted += [*told.w, *told.v]
            has += list(m.x.work.BK[b, 12:18])
    if not wanted:
        return m.values.v.tolist()
    nodes = [m.graph.node(x) for x in has]
    J = jacobian(nodes, m.x.v)
    A = zeros(*J.shape)
    A.ravel()[:] = replaced(list(J.ravel()), q)
    right = zeros(len(wanted), 1)
    right[:, 0] = wanted
    rows, columns = _independent(numbers(A) * m.scale), _independent(numbers(A).T)
    v = zeros(nv, 1)
    v[columns] = solved(A[np.ix_(rows, columns)], right[rows])
    missed = numbers(product(A, v)) - numbers(right)
    if np.abs(missed).max() > SAME * np.abs(numbers(right)).max():
        raise ModelError(
            f"the joints of {m.model.name!r} do not allow the velocities that its bodies are told; give "
            f"at=m.equilibrium(turning=[...])"
        )
    return list(v[:, 0])


def completed(m: Mechanics, at: Sequence[tuple[Node, Any]], v: Sequence[Any]) -> list[Any]:
    """Velocities that fulfil the constraints: those that are zero are found, where the others ask for it.

    Parameters
    ----------
    m : Mechanics
    at : sequence of (symbol, expression)
        The position and the time.
    v : sequence
        Those that are told are not zero.
    """
    told = np.array([not is_zero(x) for x in v], bool)
    still = [(s, 0.0) for s in m.x.v]
    left = replaced(replaced(list(m.n), [(s, x) for s, x in zip(m.x.v, v, strict=True) if not is_zero(x)]), at)
    right = zeros(len(left), 1)
    right[:, 0] = replaced(left, still)
    if np.abs(numbers(right)).max(initial=0.0) == 0.0:
        return list(v)
    J = jacobian(list(m.n), [m.x.v[d] for d in np.flatnonzero(~told)])
    A = zeros(*J.shape)
    A.ravel()[:] = replaced(list(J.ravel()), at)
    columns = _independent((numbers(A) * m.scale[~told]).T)
    rows = _independent(numbers(A[:, columns]) * m.scale[~told][columns])
    out = list(v)
    for d, x in zip(np.flatnonzero(~told)[columns], -solved(A[np.ix_(rows, columns)], right[rows]), strict=True):
        out[d] = x[0]
    return out


def _independent(A: np.ndarray) -> np.ndarray:
    """Rows that the others depend on."""
    from scipy.linalg import qr

    if not A.any():
        return np.zeros(0, int)
    _, R, order = qr(A.T, mode="economic", pivoting=True)
    d = np.abs(np.diag(R))
    return np.sort(order[: int((d > TOLERANCE * d[0]).sum())])
