"""Transfer functions of equations with their constraints left in, by Cramer's rule: nothing is divided or inverted.

With x(s) the changes of positions, u = (s - N) x those of velocities, l of the multipliers, w of the inputs,

    [(M s + D)(s - N) + K   R] [x]     [r_w]
    [G, or G (s - N) + V    0] [l] = - [g_w, n_w] w,    y = (y_a s + y_v)(s - N) x + y_x x + y_l l + y_w w

so that y / w = det [P b; c d] / det P. The determinant of P is the characteristic polynomial, times a factor without s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...graph.arrays import zeros
from .derivatives import Perturbed
from .free import Free
from .minors import determinant
from .ring import Ring
from .solve import is_zero, product
from .traced import Mechanics


@dataclass
class Pencil:
    """The polynomial matrix P(s) with a column for every input and a row for every output, as rows of polynomials."""

    ring: Ring
    P: list[list[Any]]  # (n, n + inputs)
    y: list[list[Any]]  # (outputs, n + inputs), times their denominators
    below: list[Any]  # the denominators of the outputs
    what: str

    def characteristic(self) -> Any:
        """Determinant of P."""
        n = len(self.P)
        return determinant([row[:n] for row in self.P], self.ring, self.what)

    def numerator(self, i: int, k: int) -> Any:
        """Of the transfer function from input i to output k, times the denominator of the output."""
        n = len(self.P)
        rows = [[*row[:n], row[n + i]] for row in [*self.P, self.y[k]]]
        return determinant(rows, self.ring, self.what)


def pencil(m: Mechanics, p: Perturbed, f: Free, positive: list[str]) -> Pencil:
    """Take linear equations into polynomials; the rows of constraints are those that do not follow from others."""
    kept = np.setdiff1d(np.arange(len(m.names)), f.held)
    parts = _powers(p, f, kept, m)
    ring = Ring(parts, m.model.name, positive)
    s = ring.s_element
    P, below = [], []
    (r0, r1, r2, c0, c1, y0, y1, y2) = ring.matrices
    whole = [
        *(r0 + r1 * s + r2 * (s * s)),
        *(c0 + c1 * s),
        *(y0 + y1 * s + y2 * (s * s)),
    ]
    for row in whole:
        common = ring.ring.one
        for x in row:
            common = common.lcm(x.denom)
        below.append(common)
        P.append(ring.cleared(list(row)))
    n = len(r0) + len(c0)
    return Pencil(ring, P[:n], P[n:], below[n:], m.model.name)


def _powers(p: Perturbed, f: Free, kept: np.ndarray, m: Mechanics) -> list[np.ndarray]:
    """Coefficients of the powers of s: of the equations of motion, constraints and outputs."""
    by, k = p.by, len(m.inputs)
    still = {s.index for s in m.added}

    def at_rest(X: np.ndarray) -> np.ndarray:
        from ...graph.derivative import replaced

        out = zeros(*X.shape)
        out.ravel()[:] = replaced(list(X.ravel()), [(s, 0.0) for s in m.added]) if still else list(X.ravel())
        return out

    l = f.rows_v

    def second(a: np.ndarray, v: np.ndarray, x: np.ndarray, more: np.ndarray, w: np.ndarray) -> list[np.ndarray]:
        """(a s + v) (s - N) + x, columns of multipliers and inputs behind."""
        n = len(a)
        first = _less(v, product(a, p.N))
        zeroth = _less(x, product(v, p.N))
        none = zeros(n, len(l) + k)
        return [np.hstack(X) for X in ((zeroth[:, kept], more, w), (first[:, kept], none), (a[:, kept], none))]

    r = second(by["ra"][kept], by["rv"][kept], by["rx"][kept], by["rl"][np.ix_(kept, l)], by["rw"][kept])
    holonomic = m.holonomic[l][:, None]
    zeroth = _less(by["nx"][l], product(by["nv"][l], p.N))
    none = zeros(len(l), len(l))
    c0 = np.hstack(
        [_either(holonomic, by["nv"][l], zeroth)[:, kept], none, _either(holonomic, by["gw"][l], by["nw"][l])]
    )
    c1 = np.hstack([_either(holonomic, zeros(*by["nv"][l].shape), by["nv"][l])[:, kept], none, zeros(len(l), k)])
    y = second(by["ya"], by["yv"], by["yx"], by["yl"][:, l], by["yw"])
    return [at_rest(X) for X in (*r, c0, c1, *y)]


def _either(which: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.where(which, a, b)


def _less(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    out = A.copy()
    for at, x in np.ndenumerate(B):
        if not is_zero(x):
            out[at] = out[at] - x
    return out
