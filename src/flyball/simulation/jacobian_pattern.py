"""Sparsity of an implicit integrator's Jacobian: dependences of each term, and their places in the matrix."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism
from ..derivatives.equation_derivatives import column_groups, friction_load_rows
from ..engine.entry_point import MOTION
from ..engine.kinematics import quaternion_at
from ..numerics.integrators.radau import REGULARISATION as SOFTENED
from ..numerics.integrators.radau import UNSCALED
from ..numerics.integrators.radau_stages import STAGES
from ..numerics.sparse_factorisation import LUPattern, analyse_lu, constrained_order
from ..tables.structure_definition import Structure
from ..tables.table_definitions import ALONG, BETWEEN, SCHUR, SLIDING, System

Dependence = tuple[np.ndarray, np.ndarray]
"""Equations of a term, and the variables that it depends on: velocities (and the positions along them), followed by
states of controllers. Equations have the same numbers; those of the states are followed by rates of the rows."""


class TermDerivatives(NamedTuple):
    """A sparse matrix of derivatives, assembled as sums of finite differences (complex steps)."""

    i: np.ndarray  # equations and velocities of its entries
    j: np.ndarray
    pick: np.ndarray  # (n, 3): entry, step, index in the residual terms; an entry is the sum over its rows here
    group: np.ndarray  # (nv + nx,): the step in which each velocity and state is perturbed

    @property
    def groups(self) -> int:
        """Number of steps."""
        return int(self.group.max(initial=-1)) + 1


class DependencePattern:
    """Dependences of all terms of a mechanism, in the order in which `engine/residual.py` writes them.

    Parameters
    ----------
    s : Structure
    S : System
    nx : int
        Number of controller states that are unknowns.
    """

    def __init__(self, s: Structure, S: System, nx: int) -> None:
        self.S, self.nv, self.nr, self.nx = S, s.nv, len(S.rows.law), nx
        nm = len(S.row_start) - 1 - self.nr
        self.body = np.repeat(np.arange(len(S.tree.parent)), S.tree.nv)
        self.chain: list[np.ndarray] = []
        for parent, v, nv in zip(S.tree.parent, S.tree.v, S.tree.nv, strict=True):
            own = np.arange(v, v + nv)
            self.chain.append(np.r_[own, self.chain[parent]] if parent >= 0 else own)
        self.entries = [S.column[S.row_start[k] : S.row_start[k + 1]] for k in range(self.nr + nm)]
        self.row = [self._velocities_of_bodies(np.unique(self.body[e])) for e in self.entries]
        states = s.nv + np.arange(nx)
        self.law_columns = np.r_[self._velocities_of_names(s, s.slots, nm), states]
        self.bodies = [(c, np.unique(c)) for c in self.chain]
        self.all = [
            *self.bodies,
            *self._two_point_forces(),
            *zip(self.entries[: self.nr], self.row[: self.nr], strict=True),
        ]
        self.all += self._coordinate_forces()
        laws = [x.law.names for x in s.controls[:nx]]
        self.states = [
            (states[n : n + 1], np.r_[self._velocities_of_names(s, names, nm), states]) for n, names in enumerate(laws)
        ]
        self.rates = [(np.array([s.nv + nx + k]), row) for k, row in enumerate(self.row[: self.nr])]

    def _velocities_of_names(self, s: Structure, names: Iterable[str], nm: int) -> np.ndarray:
        """Return the velocities on which measured quantities depend, given the names used in laws."""
        columns = {s.slots[name] for name in names if name in s.slots}
        return _union_of([self.row[self.nr + m % nm] for m in sorted(columns) if m < 2 * nm])

    def _velocities_of_bodies(self, bodies: Sequence[int] | np.ndarray) -> np.ndarray:
        """Return the velocities of bodies and of all bodies that carry them."""
        return _union_of([self.chain[b] for b in bodies])

    def _law(self, k: int, velocities: np.ndarray) -> np.ndarray:
        """Return these velocities with those that the laws of force k depend on."""
        return np.union1d(velocities, self.law_columns) if (self.S.forces.laws[k] >= 0).any() else velocities

    def _two_point_forces(self) -> list[Dependence]:
        out, forces = [], self.S.forces
        for k, family in enumerate(forces.family):
            if family == BETWEEN:
                ends = [b for b in self.S.frame_body[[forces.M[k], forces.F[k]]] if b >= 0]
                depends = self._law(k, self._velocities_of_bodies(ends))
                out += [(self.chain[b], depends) for b in ends]
        return out

    def _coordinate_forces(self) -> list[Dependence]:
        out, forces = [], self.S.forces
        for k, family in enumerate(forces.family):
            if family not in (ALONG, SLIDING):
                continue
            measured = [forces.F[k], forces.M[k]] if family == SLIDING else [forces.F[k]]
            lines = [self.nr + m for m in measured if m >= 0]
            pressing = zip(*self.S.load_terms, strict=True)
            loading = [self.S.terms.row[x] for n, x in pressing if n == forces.load[k] and x >= 0]
            depends = self._law(k, _union_of([self.row[n] for n in [*lines, *loading]]))
            out += [(self.entries[n], depends) for n in lines]
        return out

    def terms(self, some: Sequence[Dependence], first: np.ndarray) -> TermDerivatives:
        """Return the derivatives of the sums of some terms, whose entries begin at ``first``."""
        group = self._groups([depends for _, depends in some])
        none = np.zeros(0, np.int64)
        i = np.concatenate([none, *(np.repeat(e, len(d)) for e, d in some)])
        j = np.concatenate([none, *(np.tile(d, len(e)) for e, d in some)])
        places = zip(first.tolist(), some, strict=False)
        at = np.concatenate([none, *(np.repeat(n + np.arange(len(e)), len(d)) for n, (e, d) in places)])
        n = max(self.nv + self.nx, 1)
        keys, entry = np.unique(i * n + j, return_inverse=True)
        pick = np.column_stack([entry, group[j], at])
        return TermDerivatives(keys // n, keys % n, pick.astype(np.int64), group)

    def _groups(self, together: Sequence[np.ndarray]) -> np.ndarray:
        """Return a number for each variable, equal for variables that no term depends on together, (nv + nx,)."""
        from scipy.sparse import csc_matrix

        part = np.repeat(np.arange(len(together)), [len(d) for d in together])
        velocity = np.concatenate([np.zeros(0, np.int64), *together])
        touched = csc_matrix((np.ones(len(part), bool), (part, velocity)), shape=(len(together), self.nv + self.nx))
        return column_groups(touched)


def _union_of(some: Sequence[np.ndarray]) -> np.ndarray:
    return np.unique(np.concatenate([np.zeros(0, np.int64), *some]))


EXPENSIVE_FACTOR = 50  # products per unknown from which on a factorization costs more than a step
NO_INERTIA, SLIGHT_INERTIA = 1e-14, 1e-8  # relative inertia that counts as zero, and its substitute
THIN_METRIC = 1e-6  # smallest inertia in the metric, relative to the largest (displacements in mechanism's lengths)


class JacobianLayout:
    """Entries of the Jacobian and their places in the matrix of one stage, with the unknowns (d, v, lam, mu, x).

    Parameters
    ----------
    s : Structure
    S : System
    index_3 : bool
        Whether only positions are kept on the constraints: lam by g = 0, and no mu.
    """

    def __init__(self, s: Structure, S: System, index_3: bool = False) -> None:
        self.index_3 = index_3
        self.s, self.nv, self.nr = s, s.nv, len(s.rows)
        self.nx = len(s.controls) - len(s.sampled)
        self.n = 2 * (self.nv + self.nr) + self.nx
        self.width = self.nv + 3 * self.nr + 3 * len(s.measured) + self.nx
        parts = DependencePattern(s, S, self.nx)
        at = np.cumsum([self.width, *(len(equations) for equations, _ in parts.all)])
        of_states, of_rows = self.width - self.nx + np.arange(self.nx), self.nv + self.nr + np.arange(self.nr)
        self.terms = parts.terms([*parts.all, *parts.states, *parts.rates], np.r_[at[:-1], of_states, of_rows])
        self.mass = parts.terms(parts.bodies, at)
        self.places, self.groups = int(at[-1]), self.terms.groups
        self.pressing = np.union1d(friction_load_rows(s), pressing_rows(S)).astype(np.int64)
        self.valued = np.array([r.holonomic for r in s.rows], np.int64).reshape(self.nr)
        self.turns = np.array(
            [w for w in (quaternion_at(S, b)[1] for b in range(len(S.tree.parent))) if w >= 0], np.int64
        )
        self.row_p, self.col_i = S.row_start[: self.nr + 1], S.column[: S.row_start[self.nr]]
        self._entries()
        P = self.P
        self.expensive = bool((np.diff(P.Up)[P.Lj]).sum() > EXPENSIVE_FACTOR * self.n)

    def _entries(self) -> None:
        """Set the entries (row, column, number) of F, of F' and of the regularisation, and the order of the numbers."""
        nv, nr = self.nv, self.nr
        v, lam, mu = nv, 2 * nv, 2 * nv + nr
        i, j, pick = self.terms.i, self.terms.j, self.terms.pick
        ways, at, end = np.arange(nv), np.arange, nv + self.nx
        own = 2 * (nv + nr) + at(self.nx)
        both = (i < end) & (j < nv)  # terms that depend on velocities too; the dependence of G v is known
        again = np.cumsum(both) - 1 + len(i)
        more = pick[both[pick[:, 0]]]
        self.pick = np.r_[pick, np.column_stack([again[more[:, 0]], self.groups + more[:, 1], more[:, 2]])]
        rows_at = np.r_[v + ways, own, lam + at(nr)]
        columns_at = np.r_[ways, own]
        a, c, nG = len(i), len(self.mass.i), len(self.col_i)
        first = np.cumsum([1, a + both.sum(), c, nG, nG, nG, nr, 9 * len(self.turns), nv * len(self.pressing)])
        self.first = first.astype(np.int64)
        picked, mass, rows, metric, valued_rows, sizes, turns, presses, _ = first.tolist()
        inertia_entry = mass + np.flatnonzero(self.mass.i == self.mass.j)  # one for each velocity, in order
        self.inertia_entry = inertia_entry.astype(np.int64)
        e = np.flatnonzero((i < nv) & (j < nv))
        self.spring = np.column_stack([i[e], j[e], picked + e, inertia_entry[i[e]], picked + again[e]]).astype(np.int64)
        row = np.repeat(np.arange(nr), np.diff(self.row_p))
        held = self.valued[row] == 1
        pressed = np.isin(row, self.pressing)
        free = np.flatnonzero(self.valued == 0)
        one = [
            (ways, v + ways, None),  # - v: see below
            (rows_at[i], columns_at[j], picked + at(a)),
            (rows_at[i[both]], v + j[both], picked + a + at(both.sum())),
            (lam + row, v + self.col_i, rows + at(nG)),
            (self.col_i[held], mu + row[held], metric + at(nG)[held]),
            (mu + row[held], self.col_i[held], valued_rows + at(nG)[held]),
            (v + self.col_i[~pressed], lam + row[~pressed], None),
            (mu + free, mu + free, np.zeros(len(free), int)),
        ]
        for n_th, w in enumerate(self.turns.tolist()):
            x, y = np.meshgrid(at(3), at(3))
            one.append((w + x.ravel(), w + y.ravel(), turns + 9 * n_th + at(9)))
        for n_th, p in enumerate(self.pressing.tolist()):
            one.append((v + ways, np.full(nv, lam + p), presses + n_th * nv + at(nv)))
        if self.index_3:
            loose = ~np.isin(i - end, np.flatnonzero(self.valued == 1))
            one[1] = tuple(x[loose] for x in one[1])
            one[3] = (np.r_[lam + row[held], lam + row[~held]], np.r_[self.col_i[held], v + self.col_i[~held]],
                      rows + np.r_[at(nG)[held], at(nG)[~held]])  # fmt: skip
            one[4] = one[5] = (at(0),) * 3
            one[7] = (mu + at(nr), mu + at(nr), np.zeros(nr, int))
        scaled = [(ways, ways, np.zeros(nv, int)), (v + self.mass.i, v + self.mass.j, mass + at(c)),
                  (own, own, np.zeros(self.nx, int))]  # fmt: skip
        valued = np.flatnonzero(self.valued == 1)
        soft = [(lam + at(nr), lam + at(nr), sizes + at(nr))]
        if not self.index_3:
            soft.append((mu + valued, mu + valued, sizes + valued))
        self._place(one, scaled, soft, rows + at(nG)[~pressed])

    def _place(self, one: list, scaled: list, soft: list, negative: np.ndarray) -> None:
        """Set pattern and elimination order, and the places of all entries in the matrix."""
        nv, n = self.nv, self.n
        minus = int(self.first[-1])  # numbers behind the others: -1, and the negative entries of rows
        self.negative = negative
        one[0] = (*one[0][:2], np.full(nv, minus))
        one[6] = (*one[6][:2], minus + 1 + np.arange(len(negative)))
        groups = [one, scaled, soft]
        i, j, number = (np.concatenate([e[k] for g in groups for e in g]).astype(np.int64) for k in range(3))
        count = [sum(len(e[0]) for e in g) for g in groups]
        self._coupled_stages(i, j, number, count)
        self.P, self.scatter = self._ordered(n, i, j, number, 1)
        self.part = np.cumsum(count)[:2].astype(np.int64)

    def _coupled_stages(self, i: np.ndarray, j: np.ndarray, number: np.ndarray, count: list[int]) -> None:
        """Set the same for all three stages at once, which F' couples."""
        n = self.n
        own, scaled = np.r_[: count[0], sum(count[:2]) : sum(count)], np.arange(count[0], sum(count[:2]))
        parts = [(own, k, k, np.where(own < count[0], UNSCALED, SOFTENED)) for k in range(STAGES)]
        parts += [(scaled, k, m, np.full(len(scaled), m)) for k in range(STAGES) for m in range(STAGES)]
        at_i, at_j = (np.concatenate([x[p[0]] + n * p[w] for p in parts]) for x, w in ((i, 1), (j, 2)))
        self.whole_P, put = self._ordered(STAGES * n, at_i, at_j, np.concatenate([number[p[0]] for p in parts]), STAGES)
        stage = np.concatenate([np.full(len(p[0]), p[1]) for p in parts])
        self.whole_scatter = np.ascontiguousarray(
            np.column_stack([put[:, 0], stage, put[:, 1], np.concatenate([p[3] for p in parts])])
        ).astype(np.int64)

    def _ordered(
        self, n: int, i: np.ndarray, j: np.ndarray, number: np.ndarray, stages: int
    ) -> tuple[LUPattern, np.ndarray]:
        """Return the pattern of a matrix with these entries, and their places with the numbers stored there.

        Increments are eliminated first: they have only few entries beside the diagonal, and the rest is half as large.
        """
        nv = self.s.tables["tree"].nv
        body, bodies = np.repeat(np.arange(len(nv)), nv), len(nv)
        rows, states = bodies + np.arange(self.nr), bodies + self.nr + np.arange(self.nx)
        groups = np.tile(np.concatenate([body, body, rows, rows, states]), stages)
        order = constrained_order(groups, np.arange(bodies + self.nr + self.nx) >= bodies, i, j)
        one = np.r_[
            self._quaternion_groups(), self.nv + np.arange(n // stages - self.nv)
        ]  # those of a quaternion together
        first = np.tile(np.arange(n // stages) < self.nv, stages)
        place = np.empty(n, np.int64)
        place[np.lexsort((np.arange(n), np.where(first, np.tile(one, stages), order), ~first))] = np.arange(n)
        P, at = analyse_lu(n, i, j, place)
        return P, np.ascontiguousarray(np.column_stack([at, number]))

    def _quaternion_groups(self) -> np.ndarray:
        """Return for each velocity the first of those whose increments are coupled."""
        out = np.arange(self.nv)
        for w in self.turns.tolist():
            out[w : w + 3] = w
        return out


def pressing_rows(S: System) -> np.ndarray:
    """Return the rows of contact gaps on whose multipliers friction depends."""
    sliding = S.forces.switch[S.forces.family == SLIDING]
    return np.asarray(S.switches.row[S.switches.other[sliding]], np.int64)


def jacobian_layout(s: Structure, S: System, index_3: bool = False) -> JacobianLayout:
    """Return the layout, cached for all runs of a structure."""
    return s.cache.get("implicit", index_3, 2, lambda: JacobianLayout(s, S, index_3))


def inverse_inertias(c: CompiledMechanism, t: float, y: np.ndarray) -> np.ndarray:
    """Return the inverse inertia along each velocity, (nv,), with a lower bound on the inertia."""
    s, S, W = c.structure, c.system, c.work
    if S.sizes.solver == SCHUR:
        inertia = c.mass().diagonal()
    else:
        c.at(t, y[: s.nq].copy(), y[s.nq : s.nq + s.nv].copy(), MOTION)
        own = S.mass_entries.row == S.mass_entries.column
        inertia = np.zeros(s.nv)
        inertia[S.mass_entries.row[own]] = W.M[own]
    per_unit = c.sizes**2 * inertia
    return c.sizes**2 / np.maximum(per_unit, THIN_METRIC * per_unit.max(initial=0.0))


def substitute_inertias(c: CompiledMechanism) -> np.ndarray:
    """Return substitute inertias in Jacobians for bodies without inertia about some axis, (nv,); empty if there are
    none.

    Bodies are eliminated without pivoting before the rows that hold them. Newton's iteration removes the effect of the
    substitute, which is a small part of the body's mass times the mechanism's length squared.
    """
    S, out = c.system, np.zeros(c.structure.nv)
    if S.sizes.solver != SCHUR:  # in joint coordinates the masses of carried bodies count too
        return out[:0]
    inertia, mass = S.bodies.inertia.reshape(-1, 3, 3), S.bodies.mass
    if c.structure.model.planar:
        inertia = inertia[:, 2:, 2:]
    own = np.linalg.eigvalsh(inertia)
    missing = (own[:, 0] <= NO_INERTIA * own[:, -1]) | (mass == 0.0)
    if not missing.any():
        return out[:0]
    least = mass[mass > 0.0].min() if mass.any() else 1.0
    for b in np.flatnonzero(missing):
        at = slice(S.tree.v[b], S.tree.v[b] + S.tree.nv[b])
        out[at] = SLIGHT_INERTIA * max(mass[b], least) * (c.values.length / c.sizes[at]) ** 2
    return out
