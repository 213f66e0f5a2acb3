"""Where the numbers of an implicit integrator's Jacobian come from, and where they go in its sparse matrix."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....equations.engine import MOTION
from ....equations.tree import quaternion_at
from ....numerics.integrators.implicit.step import STAGES
from ....numerics.integrators.implicit.whole import PLAIN
from ....numerics.integrators.implicit.whole import SOFT as SOFTENED
from ....numerics.lu import Rows, analyse, constrained_order
from ....tables.specs import Structure
from ....tables.system import (
    FORCE_ALONG,
    FORCE_SWITCH,
    NV,
    PARENT,
    SCHUR,
    SLIDING,
    SOLVER,
    SWITCH_OTHER,
    SWITCH_ROW,
    System,
)
from ...compiled import Compiled
from ...linear.derivatives import grouped, grouped_sparsity, pattern
from ...linear.loads import pressing

THIN = 1e-6  # part of the largest inertia (turns by the mechanism's length) below which the metric sees none


class Layout:
    """Which numbers the Jacobian has and where they go in the matrix of one stage, (d, v, lam, mu, x).

    Parameters
    ----------
    s : Structure
    S : System
    index_3 : bool
        Whether only positions are held to the constraints: lam by g = 0, and no mu.
    """

    def __init__(self, s: Structure, S: System, index_3: bool = False) -> None:
        self.index_3 = index_3
        self.s, self.nv, self.nr = s, s.nv, len(s.rows)
        self.nx = len(s.controls) - len(s.sampled)
        self.n = 2 * (self.nv + self.nr) + self.nx
        self.width = self.nv + 3 * self.nr + 3 * len(s.measured) + self.nx
        self.touched, self.group = sparsity(s, self.width - self.nx, S)
        self.groups = int(self.group.max(initial=-1)) + 1
        self.pressing = np.union1d(pressing(s), pressed(S)).astype(np.int64)
        self.valued = np.array([r.holonomic for r in s.rows], np.int64).reshape(self.nr)
        self.turns = np.array([w for w in (quaternion_at(S, b)[1] for b in range(len(S.body_i))) if w >= 0], np.int64)
        self.row_p, self.col_i = S.row_p[: self.nr + 1], S.col_i[: S.row_p[self.nr]]
        self._entries()

    def _entries(self) -> None:
        """Entries (row, column, number) of F, of F' and of the regularisation; which numbers stand where."""
        nv, nr = self.nv, self.nr
        v, lam, mu = nv, 2 * nv, 2 * nv + nr
        all_rows, all_columns = self.touched.indices, np.repeat(np.arange(nv), np.diff(self.touched.indptr))
        r = all_rows < nv
        n = (all_rows >= nv + nr) & (all_rows < nv + 2 * nr)
        self.pick = np.concatenate([
            np.column_stack([self.group[all_columns[r]], all_rows[r]]),
            np.column_stack([self.group[all_columns[n]], all_rows[n]]),
            np.column_stack([self.groups + self.group[all_columns[r]], all_rows[r]]),
            *self._picked(all_rows, all_columns),
            np.column_stack([self.group[all_columns[r]], all_rows[r]]),
        ]).astype(np.int64)  # fmt: skip
        i, j = all_rows[r], all_columns[r]
        k, m = all_rows[n] - nv - nr, all_columns[n]
        a, b, nG = len(i), len(k), len(self.col_i)
        first = np.cumsum([1, len(self.pick) - a, a, nG, nG, nG, nr, 9 * len(self.turns), nv * len(self.pressing)])
        self.first = first.astype(np.int64)
        picked, mass, rows, metric, valued_rows, sizes, turns, presses, _ = first.tolist()
        self.spring = np.column_stack([i, j, picked + np.arange(a), mass + np.arange(a), picked + a + b + np.arange(a)])
        self.spring = self.spring.astype(np.int64)
        row = np.repeat(np.arange(nr), np.diff(self.row_p))
        held = self.valued[row] == 1
        pressed = np.isin(row, self.pressing)
        free = np.flatnonzero(self.valued == 0)
        ways = np.arange(nv)
        at = np.arange
        one = [
            (ways, v + ways, None),  # - v: see below
            (v + i, j, picked + at(a)),
            (lam + k, m, picked + a + at(b)),
            (v + i, v + j, picked + a + b + at(a)),
            (lam + row, v + self.col_i, rows + at(nG)),
            (self.col_i[held], mu + row[held], metric + at(nG)[held]),
            (mu + row[held], self.col_i[held], valued_rows + at(nG)[held]),
            (v + self.col_i[~pressed], lam + row[~pressed], None),
            (mu + free, mu + free, np.zeros(len(free), int)),
            *self._of_states(all_rows, all_columns, picked + 2 * a + b),
        ]
        for n_th, w in enumerate(self.turns.tolist()):
            x, y = np.meshgrid(at(3), at(3))
            one.append((w + x.ravel(), w + y.ravel(), turns + 9 * n_th + at(9)))
        for n_th, p in enumerate(self.pressing.tolist()):
            one.append((v + ways, np.full(nv, lam + p), presses + n_th * nv + at(nv)))
        if self.index_3:
            loose = ~np.isin(k, np.flatnonzero(self.valued == 1))
            one[2] = tuple(x[loose] for x in one[2])
            one[4] = (np.r_[lam + row[held], lam + row[~held]], np.r_[self.col_i[held], v + self.col_i[~held]],
                      rows + np.r_[at(nG)[held], at(nG)[~held]])  # fmt: skip
            one[5] = one[6] = (at(0),) * 3
            one[8] = (mu + at(nr), mu + at(nr), np.zeros(nr, int))
        own = 2 * (nv + nr) + at(self.nx)
        scaled = [(ways, ways, np.zeros(nv, int)), (v + i, v + j, mass + at(a)), (own, own, np.zeros(self.nx, int))]
        valued = np.flatnonzero(self.valued == 1)
        soft = [(lam + at(nr), lam + at(nr), sizes + at(nr))]
        if not self.index_3:
            soft.append((mu + valued, mu + valued, sizes + valued))
        self._place(one, scaled, soft, rows + at(nG)[~pressed])

    def _picked(self, rows: np.ndarray, columns: np.ndarray) -> list[np.ndarray]:
        """Step and residual of numbers that states x have: x' - f by d, by v; r by x; x' - f by x."""
        end, nx = self.width - self.nx, self.nx
        f = rows >= end
        own = 2 * self.groups + np.arange(nx)
        return [
            np.column_stack([self.group[columns[f]], rows[f]]),
            np.column_stack([self.groups + self.group[columns[f]], rows[f]]),
            np.column_stack([np.repeat(own, self.nv), np.tile(np.arange(self.nv), nx)]),
            np.column_stack([np.repeat(own, nx), np.tile(end + np.arange(nx), nx)]),
        ]

    def _of_states(self, rows: np.ndarray, columns: np.ndarray, first: int) -> list[tuple[np.ndarray, ...]]:
        """Entries of the same, in that order; their first number."""
        nv, nx, x, at = self.nv, self.nx, 2 * (self.nv + self.nr), np.arange
        f = rows >= self.width - nx
        i, j = x + rows[f] - (self.width - nx), columns[f]
        c, begin = len(i), first + 2 * len(i)
        return [
            (i, j, first + at(c)),
            (i, nv + j, first + c + at(c)),
            (np.tile(nv + at(nv), nx), x + np.repeat(at(nx), nv), begin + at(nx * nv)),
            (np.tile(x + at(nx), nx), x + np.repeat(at(nx), nx), begin + nx * nv + at(nx * nx)),
        ]

    def _place(self, one: list, scaled: list, soft: list, negative: np.ndarray) -> None:
        """Pattern and order of elimination; places of all entries in the matrix."""
        nv, n = self.nv, self.n
        minus = int(self.first[-1])  # numbers behind the others: -1, and the negative entries of rows
        self.negative = negative
        one[0] = (*one[0][:2], np.full(nv, minus))
        one[7] = (*one[7][:2], minus + 1 + np.arange(len(negative)))
        groups = [one, scaled, soft]
        i, j, number = (np.concatenate([e[k] for g in groups for e in g]).astype(np.int64) for k in range(3))
        count = [sum(len(e[0]) for e in g) for g in groups]
        self._whole(i, j, number, count)
        self.P, self.put = self._ordered(n, i, j, number, 1)
        self.part = np.cumsum(count)[:2].astype(np.int64)

    def _whole(self, i: np.ndarray, j: np.ndarray, number: np.ndarray, count: list[int]) -> None:
        """The same of all three stages at once: what F' has couples them."""
        n = self.n
        own, scaled = np.r_[: count[0], sum(count[:2]) : sum(count)], np.arange(count[0], sum(count[:2]))
        parts = [(own, k, k, np.where(own < count[0], PLAIN, SOFTENED)) for k in range(STAGES)]
        parts += [(scaled, k, m, np.full(len(scaled), m)) for k in range(STAGES) for m in range(STAGES)]
        at_i, at_j = (np.concatenate([x[p[0]] + n * p[w] for p in parts]) for x, w in ((i, 1), (j, 2)))
        self.whole_P, put = self._ordered(STAGES * n, at_i, at_j, np.concatenate([number[p[0]] for p in parts]), STAGES)
        stage = np.concatenate([np.full(len(p[0]), p[1]) for p in parts])
        self.whole_put = np.ascontiguousarray(
            np.column_stack([put[:, 0], stage, put[:, 1], np.concatenate([p[3] for p in parts])])
        ).astype(np.int64)

    def _ordered(
        self, n: int, i: np.ndarray, j: np.ndarray, number: np.ndarray, stages: int
    ) -> tuple[Rows, np.ndarray]:
        """Pattern of a matrix with such entries; places of these with the numbers that stand there.

        Increments come first: only a few of their own stand beside the diagonal, and what is left is half as large.
        """
        body_i = self.s.tables["body_i"]
        body, bodies = np.repeat(np.arange(len(body_i)), body_i[:, NV]), len(body_i)
        rows, states = bodies + np.arange(self.nr), bodies + self.nr + np.arange(self.nx)
        groups = np.tile(np.concatenate([body, body, rows, rows, states]), stages)
        order = constrained_order(groups, np.arange(bodies + self.nr + self.nx) >= bodies, i, j)
        one = np.r_[self._together(), self.nv + np.arange(n // stages - self.nv)]  # d of a quaternion go together
        first = np.tile(np.arange(n // stages) < self.nv, stages)
        place = np.empty(n, np.int64)
        place[np.lexsort((np.arange(n), np.where(first, np.tile(one, stages), order), ~first))] = np.arange(n)
        P, at = analyse(n, i, j, place)
        return P, np.ascontiguousarray(np.column_stack([at, number]))

    def _together(self) -> np.ndarray:
        """Of each velocity the first of those whose increments depend on each other."""
        out = np.arange(self.nv)
        for w in self.turns.tolist():
            out[w : w + 3] = w
        return out


def pressed(S: System) -> np.ndarray:
    """Rows of gaps of places of contact, whose multipliers the friction there follows."""
    sliding = S.force_i[S.force_i[:, FORCE_ALONG] == SLIDING, FORCE_SWITCH]
    return np.asarray(S.switch_i[S.switch_i[sliding, SWITCH_OTHER], SWITCH_ROW], np.int64)


def sparsity(s: Structure, width: int, S: System) -> tuple[Any, np.ndarray]:
    """What each velocity can change, sparse (width, nv), and groups of velocities that change nothing together, (nv,).

    In joint coordinates what acts on a body acts along the coordinates of all that it hangs on, and follows them.
    Behind the residuals stand the rates of controllers' states.
    """
    if not s.tree and len(s.controls) == len(s.sampled):
        return grouped_sparsity(s, width, S)
    from scipy.sparse import csc_matrix, vstack

    above: list[list[int]] = []
    for b, parent in enumerate(S.body_i[:, PARENT].tolist() if s.tree else []):
        above.append([b, *(above[parent] if parent >= 0 else ())])

    def found() -> tuple[Any, np.ndarray]:
        touched = csc_matrix(pattern(s, S, above))
        nm = len(s.measured)
        for x in s.controls[: len(s.controls) - len(s.sampled)]:
            read = sorted({s.slots[k] % nm for k in x.law.names if s.slots.get(k, 2 * nm) < 2 * nm})
            looks = touched[width - 3 * nm + np.array(read, np.int64)].sum(axis=0) > 0
            touched = csc_matrix(vstack([touched, csc_matrix(looks)]), dtype=bool)
        return touched, grouped(touched)

    return s.kept.get("sparsity of implicit methods", None, 1, found)


def layout(s: Structure, S: System, index_3: bool = False) -> Layout:
    """The same for every run of a structure."""
    return s.kept.get("implicit", index_3, 2, lambda: Layout(s, S, index_3))


def metric(c: Compiled, t: float, y: np.ndarray) -> np.ndarray:
    """Of each velocity the inverse of its inertia, (nv,), which is at least a small part of the largest."""
    s, S, W = c.structure, c.system, c.work
    if not len(s.rows):
        return np.ones(s.nv)
    if S.kinds[SOLVER] == SCHUR:
        inertia = c.mass().diagonal()
    else:
        c.at(t, y[: s.nq].copy(), y[s.nq : s.nq + s.nv].copy(), MOTION)
        own = S.mass_i[:, 0] == S.mass_i[:, 1]
        inertia = np.zeros(s.nv)
        inertia[S.mass_i[own, 0]] = W.M[own]
    size = c.sizes**2
    return 1.0 / (size * np.maximum(inertia / size, THIN * (inertia / size).max(initial=0.0)))
