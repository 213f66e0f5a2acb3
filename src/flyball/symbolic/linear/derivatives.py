"""Derivatives of the equations by everything, in any state, and their values at a point: expressions or numbers.

    r = M vdot - f - G^T lam,  g,  n = G v - nu,  y

are differentiated by positions (along the velocities, so that quaternions have three directions), velocities,
accelerations, multipliers and inputs. Multipliers are held: what reactions do when the bodies that carry them move,
d(G^T lam)/dx, is in dr/dx.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...equations.tree import quaternion_at
from ...graph.arrays import zeros
from ...graph.derivative import replaced, tangents
from ...graph.node import Node
from ...graph.values import evaluate
from .traced import Mechanics

BY = ("x", "v", "a", "l", "w")


@dataclass
class Perturbed:
    """Values and derivatives of the equations at a point; objects: expressions of parameters, or numbers.

    Attributes
    ----------
    value : dict
        ``"r"``, ``"g"``, ``"n"``, ``"y"`` -> values.
    by : dict
        ``"rx"`` -> derivatives of r by positions, and so on: rows ``r``, ``g``, ``n``, ``y``, columns `BY`.
    N : ndarray (nv, nv)
        (rate of a change of position) = (change of velocity) + N (change of position).
    T : ndarray (nq, nv)
        Qdot = T v.
    """

    value: dict[str, np.ndarray]
    by: dict[str, np.ndarray]
    N: np.ndarray
    T: np.ndarray

    def replaced(self, pairs: Sequence[tuple[Node, Node]]) -> Perturbed:
        """With other expressions in place of parameters."""

        def new(X: np.ndarray) -> np.ndarray:
            out = X.copy()
            out.ravel()[:] = replaced(list(X.ravel()), pairs)
            return out

        value, by = ({k: new(X) for k, X in of.items()} for of in (self.value, self.by))
        return Perturbed(value, by, new(self.N), new(self.T))


class Derivatives:
    """Everything once, as expressions of the state.

    Parameters
    ----------
    m : Mechanics
    outputs : sequence of Node
    """

    def __init__(self, m: Mechanics, outputs: Sequence[Node]) -> None:
        self.m = m
        self.blocks: dict[str, np.ndarray] = {"r": m.r, "g": m.g, "n": m.n, "y": _row(outputs)}
        self.ends = np.cumsum([0, *(len(b) for b in self.blocks.values())])
        nodes = [x for b in self.blocks.values() for x in b]
        self.nodes = nodes
        x = m.x
        along = [list(zip(x.q, x.T[:, d], strict=True)) for d in range(len(x.v))]
        seeds = {"x": [[(q, t) for q, t in a if t != 0.0] for a in along]}
        seeds |= {k: [[(s, 1.0)] for s in of] for k, of in zip(
            BY[1:], (x.v, m.vdot, m.multipliers, m.pushed), strict=True
        )}  # fmt: skip
        self.columns = {k: [tangents(nodes, s) for s in of] for k, of in seeds.items()}
        self.N = _turning(m)

    @property
    def all(self) -> list[Any]:
        """Every expression, in the order in which `at` takes their values."""
        columns = [x for of in self.columns.values() for column in of for x in column]
        return [*self.nodes, *columns, *self.N.ravel(), *self.m.x.T.ravel()]

    def at(self, point: Sequence[tuple[Node, Any]]) -> Perturbed:
        """With other expressions in place of the state's symbols."""
        return self._sorted(replaced(self.all, point))

    def near(self, point: Mapping[str, float]) -> Perturbed:
        """In numbers; symbol's name -> value."""
        return self._sorted(evaluate(self.all, point))

    def _sorted(self, found: list[Any]) -> Perturbed:
        rows = len(self.nodes)
        value = self._parted(_row(found[:rows]))
        at, by = rows, dict[str, np.ndarray]()
        for k in BY:
            count = len(self.columns[k])
            J = zeros(rows, count)
            for c in range(count):
                J[:, c] = found[at : at + rows]
                at += rows
            by |= {f"{name}{k}": part for name, part in self._parted(J).items()}
        nv, nq = len(self.m.x.v), len(self.m.x.q)
        N = _row(found[at : at + nv * nv]).reshape(nv, nv)
        T = _row(found[at + nv * nv :]).reshape(nq, nv)
        return Perturbed(value, by, N, T)

    def _parted(self, J: np.ndarray) -> dict[str, np.ndarray]:
        return {k: J[i:j] for k, i, j in zip(self.blocks, self.ends[:-1], self.ends[1:], strict=True)}


def _row(x: Sequence[Any]) -> np.ndarray:
    out = zeros(len(x))
    out[:] = list(x)
    return out


def _turning(m: Mechanics) -> np.ndarray:
    """N: changes of rotations have components along axes that turn."""
    nv = len(m.x.v)
    N = zeros(nv, nv)
    for b in range(len(m.x.system.tree.parent)):
        _, w0 = quaternion_at(m.x.system, b)
        if w0 >= 0:
            x, y, z = m.x.v[w0 : w0 + 3]
            N[w0 : w0 + 3, w0 : w0 + 3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]  # -(w x)
    return N
