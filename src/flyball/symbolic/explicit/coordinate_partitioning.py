"""Coordinate partitioning: which coordinates are independent, and which constraints determine the others.

Independent coordinates are named by the user, or chosen by QR with column pivoting of an orthonormal basis of the
motions that the constraints allow (Businger and Golub 1965; for mechanisms: Wehage and Haug 1982). Velocities are
chosen; a tree joint's coordinates follow its velocities, one by one or, for a quaternion, all together.
Constraints are the rows and the coordinates of tree joints that drivers prescribe; their rank is found from
values at and near the initial position.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...derivatives.reduced_equations import gap_lengths, lost_constraints, normalised_rows
from ...errors import ModelError, SingularityError
from ...expression_graph.evaluation import evaluate, evaluate_array
from ...expression_graph.tracing import TracedEquations
from ...model.model import listing, suggest
from ...numerics.rank import RANK_TOLERANCE, null_space, rank
from ...tables.structure_definition import Structure, velocity_names
from .zero_test import Probe


@dataclass(frozen=True)
class Constraints:
    """Equations g = 0, G v = nu, G vdot = gamma as expressions.

    Attributes
    ----------
    elements : list of str
        Element of each constraint.
    holonomic : ndarray of bool
        Which are constraints on positions.
    """

    elements: list[str]
    holonomic: np.ndarray
    g: np.ndarray
    G: np.ndarray
    nu: np.ndarray
    gamma: np.ndarray


def collect_constraints(x: TracedEquations) -> Constraints:
    """Constraints of equations that have rows for prescribed coordinates (`with_prescribed_rows`)."""
    s = x.structure
    elements = [*(r.element.name for r in s.rows), *s.prescribed]
    holonomic = np.array([*(r.holonomic for r in s.rows), *(True for _ in s.prescribed)], bool)
    return Constraints(elements, holonomic, x.g, x.G, x.nu, x.gamma)


DEPENDENCE_TOLERANCE = 1e-8  # smallest motion of an independent coordinate, relative to the largest


@dataclass(frozen=True)
class Partition:
    """Partition of the coordinates at one position.

    Attributes
    ----------
    chosen : list of int
        Independent velocities.
    rows : list of int
        A set of independent constraints.
    """

    chosen: list[int]
    rows: list[int]

    def dependent(self, nv: int) -> list[int]:
        """Indices of the dependent velocities."""
        return [d for d in range(nv) if d not in self.chosen]


def choose_independent(
    G: np.ndarray, scale: np.ndarray, requested: Sequence[int] = (), only: bool = False
) -> Partition:
    """Choose independent velocities and constraints.

    Parameters
    ----------
    G : ndarray (nr, nv)
        Jacobian at one position.
    scale : ndarray (nv,)
        Natural step size along each velocity.
    requested : sequence of int
        Velocities that must be independent.
    only : bool
        Whether only these may be independent.

    Raises
    ------
    ValueError
        With the index of a velocity that depends on the ones before it.
    """
    from scipy.linalg import qr

    A = normalised_rows(G, scale)
    N = null_space(A) if len(A) else np.eye(len(scale))
    f = N.shape[1]
    chosen: list[int] = []
    left = N.copy()
    largest = float(np.sqrt((N * N).sum(axis=1)).max(initial=0.0))
    for d in requested:
        along = left[d]
        if len(chosen) == f or np.linalg.norm(along) <= DEPENDENCE_TOLERANCE * largest:
            raise ValueError(d)
        e = along / np.linalg.norm(along)
        left = left - np.outer(left @ e, e)
        chosen.append(d)
    if not only and len(chosen) < f:
        *_, order = qr(left.T, mode="economic", pivoting=True)
        chosen += [int(d) for d in order if d not in chosen][: f - len(chosen)]
    rank = len(scale) - f
    rows: list[int] = []
    if rank:
        *_, order = qr(A.T, mode="economic", pivoting=True)
        rows = sorted(int(k) for k in order[:rank])
    return Partition(sorted(chosen), rows)


def velocities_by_name(names: Sequence[str], requested: Sequence[str], model: str) -> list[int]:
    """Indices of velocities by name.

    Raises
    ------
    ModelError
        If there is no such coordinate; the message lists all coordinates.
    """
    at = {n: k for k, n in enumerate(names)}
    for n in requested:
        if n not in at:
            known = f"{suggest(n, at)}; {listing(list(at))}"
            raise ModelError(f"{model!r} has no coordinate {n!r} in these coordinates{known}")
        if list(requested).count(n) > 1:
            raise ModelError(f"independent names {n!r} twice")
    return [at[n] for n in requested]


def position_groups(s: Structure) -> list[tuple[list[int], list[int]]]:
    """Groups of coordinates and their velocities: one and one, or a quaternion and its angular velocities."""
    out = []
    tree = s.tables["tree"]
    for q, v, nq, nv in zip(*(x.tolist() for x in (tree.q, tree.v, tree.nq, tree.nv)), strict=True):
        single = nv if nq == nv else nv - 3
        out += [([q + k], [v + k]) for k in range(single)]
        if nq > nv:
            out.append((list(range(q + single, q + nq)), list(range(v + single, v + nv))))
    return out


def singular_start_error(names: Sequence[str], t: float) -> SingularityError:
    """The error for an initial position where the constraints lose rank."""
    return SingularityError(
        f"the mechanism is in a singular position at t = {t:.6g} s: the constraints of {', '.join(names)} are "
        "dependent here and not nearby, so that independent coordinates cannot be chosen; choose another position",
        t,
        tuple(names),
    )


NEARBY_STEP = (
    # Distance [rad, or relative to the mechanism's length] of the nearby position whose rank is compared.
    1e-2
)
MAX_ITERATIONS = 20
CLOSURE_TOLERANCE = 1e-10  # relative to the mechanism's length


class ConstraintValues:
    """Values of the constraints at and near the initial position.

    Parameters
    ----------
    x : TracedEquations
    c : Constraints
    start : mapping
        Values of time, coordinates and velocities by symbol name; others are zero.
    """

    def __init__(self, x: TracedEquations, c: Constraints, start: Mapping[str, float]) -> None:
        self.x, self.c = x, c
        others = {s.data.name: 0.0 for s in (*x.z, *x.lam, *x.loads)}
        self.values: dict[str, float] = others | {name: float(y) for name, y in start.items()}
        self.probe = Probe(self.values)
        length = float(getattr(x.system.scales.length, "value", x.system.scales.length))
        units = [n.unit for n in velocity_names(x.structure)]
        self.length = length
        self.scale = np.array([1.0 if u == "m" else 1.0 / length for u in units])
        self.G = self.jacobian(self.values)

    def jacobian(self, values: Mapping[str, float]) -> np.ndarray:
        """Jacobian G at these values; entries within rounding are 0."""
        G = np.array(evaluate_array(self.c.G, values), float).reshape(self.c.G.shape)
        size = np.abs(G * self.scale).max(axis=1, initial=0.0, keepdims=True)
        G[np.abs(G * self.scale) <= 1e-13 * size] = 0.0
        return G

    def refuse_singular(self, f: Partition) -> None:
        """Refuse an initial position where the constraints lose rank.

        Raises
        ------
        SingularityError
            With the names of the elements whose constraints are dependent here and independent nearby.
        """
        which = np.flatnonzero(self.c.holonomic)
        if not f.chosen or not len(which):
            return
        here = normalised_rows(self.G[which], self.scale)
        rng = np.random.default_rng(0)
        for _ in range(2):
            G = self._nearby(rng, which)
            there = here if G is None else normalised_rows(G, self.scale)
            if rank(there) > rank(here):
                lost = lost_constraints(here, there, [self.c.elements[k] for k in which])
                raise singular_start_error(lost, self.values[self.x.t.data.name])

    def _nearby(self, rng: np.random.Generator, which: np.ndarray) -> np.ndarray | None:
        """Jacobian of the position constraints at the assembled position near a random step; None if assembly fails."""
        null = null_space(normalised_rows(self.G[which], self.scale))
        a = null @ rng.standard_normal(null.shape[1])
        step = NEARBY_STEP * self.scale * self.length * a / np.abs(a).max()
        values = dict(self.values)
        for _ in range(MAX_ITERATIONS):
            self._moved(values, step)
            G = self.jacobian(values)[which]
            g = gap_lengths(np.array(evaluate(list(self.c.g[which]), values), float), G, self.scale)
            if np.abs(g).max(initial=0.0) < CLOSURE_TOLERANCE * self.length:
                return G
            step = -self.scale * np.linalg.lstsq(normalised_rows(G, self.scale), g, rcond=RANK_TOLERANCE)[0]
        return None

    def _moved(self, values: dict[str, float], step: np.ndarray) -> None:
        """Move the coordinates along the velocities and normalise quaternions."""
        T = np.array(evaluate_array(self.x.T, values), float).reshape(self.x.T.shape)
        dq = T @ step
        names = [s.data.name for s in self.x.q]
        for q, v in position_groups(self.x.structure):
            moved = np.array([values[names[k]] + dq[k] for k in q])
            if len(q) > len(v):
                moved /= np.linalg.norm(moved)
            values |= {names[k]: float(y) for k, y in zip(q, moved, strict=True)}
