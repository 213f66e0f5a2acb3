"""Coordinate partitioning: the choice of independent coordinates, and the elimination of constraints and multipliers.

    w = w(u, t),  w' = G_w^-1 (nu - G_u u'),  w'' = G_w^-1 (gamma - G_u u'')
    Z^T M Z u'' = Z^T (f - M b),  Z = [1; -G_w^-1 G_u],  b = [0; G_w^-1 gamma]
    G_w^T lam = (M v' - f)_w

(Wehage and Haug 1982, J. Mech. Des. 104; Hahn, *Rigid Body Dynamics of Mechanisms 1*, eq. 4.84). No matrix is
inverted: see `linear_systems`. Dependent coordinates come from the position constraints by formulas where these
exist, else from equations.

Independent coordinates are named by the user, or chosen by QR with column pivoting of an orthonormal basis of the
motions that the constraints allow (Businger and Golub 1965). Velocities are chosen; a tree joint's coordinates follow
its velocities, one by one or, for a quaternion, all together. Constraints are the rows and the coordinates of tree
joints that drivers prescribe; their rank is found from values at and near the initial position.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...derivatives.linearized_equations import gap_lengths, lost_constraints, normalised_rows, product
from ...errors import ModelError, SingularityError
from ...expression_graph.graph import Node, evaluate, evaluate_array, jacobian, nodes_in_order, symbols_of, zero_objects
from ...expression_graph.tracing import TracedEquations
from ...model.model import listing, suggest
from ...numerics.rank import RANK_TOLERANCE, fundamental_subspaces, null_space, rank
from ...tables.structure_definition import Structure, velocity_names
from .closed_form_loops import MAX_OPERATIONS, MAX_UNKNOWNS, LoopSolver, follow_whole_turns
from .definitions import Definition, FormulaSubstitution, Probe
from .linear_systems import (
    Determinants,
    nonzero_pattern,
    solution_blocks,
    solve_blocks,
    solve_symmetric,
    transposed_blocks,
)


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


# Residual of formulas in the equations that counts as zero, relative to the terms.
AGREEMENT_TOLERANCE = 1e-9
RANDOM_STEP = 0.02  # random steps [rad or m] of the positions where this is tested
TRIALS = 6


@dataclass
class SolvedPositions:
    """Dependent coordinates.

    Attributes
    ----------
    definitions : list of Definition
        Definitions in an order in which each depends on earlier ones only.
    never : list of (name, Node)
        Expressions that must not vanish, or become negative, for a formula to be valid.
    notes : list of str
        Reasons why coordinates have no formula.
    """

    definitions: list[Definition]
    never: list[tuple[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def solve_positions(
    x: TracedEquations,
    place: ConstraintValues,
    what: tuple[list[int], list[int]],
    places: Sequence[tuple[Node, Any]] = (),
) -> SolvedPositions:
    """Find definitions of dependent coordinates.

    Parameters
    ----------
    x : TracedEquations
    place : ConstraintValues
    what : (list of int, list of int)
        Constraints, and the coordinates q that they determine; unit norms of quaternions are added.
    places : sequence of (Node, Node)
        Curve parameters, and their equations.
    """
    (rows, unknown), c = what, place.c
    g = [x.graph.node(y) for y in c.g[rows]]
    for q, v in position_groups(x.structure):
        if len(q) > len(v) and q[0] in unknown:
            g.append(x.graph.node(sum((x.q[k] * x.q[k] for k in q), -1.0)))
    w = [*(x.q[k] for k in unknown), *(s for s, _ in places)]
    g += [x.graph.node(y) for _, y in places]
    elements = [c.elements[k] for k in rows]
    count = len(nodes_in_order(g))
    if len(w) > MAX_UNKNOWNS or count > MAX_OPERATIONS:
        note = f"{len(w)} dependent coordinates in equations of {count} expressions: too many to look for formulas"
        note += f" (up to {MAX_UNKNOWNS} in {MAX_OPERATIONS})"
        return SolvedPositions(_implicit(g, w, place.probe), [], [note] if w else [])
    pool = LoopSolver(g, w, [s for k, s in enumerate(x.q) if k not in unknown], Probe(place.values))
    pool.run()
    left = _implicit(pool.equations, pool.unknowns, pool.probe)
    order = [*pool.found, *left, *reversed(pool.later)]
    turned = [_with_reference_turns(d, pool.probe) for d in order]
    if None in turned or not _fulfil_equations(g, [d for d in turned if d is not None], place):
        note = "formulas were found that are wrong: please report this mechanism"
        return SolvedPositions(_implicit(g, w, place.probe), [], [note])
    known = _given(x, unknown)
    done = follow_whole_turns([d for d in turned if d is not None], known, pool.probe.start)
    return SolvedPositions(done, pool.never, [_reason(d, elements) for d in left])


def _given(x: TracedEquations, unknown: Sequence[int]) -> list[Node]:
    """Coordinates that are given; if drivers move all, the coordinate of a driver."""
    known = [s for k, s in enumerate(x.q) if k not in unknown]
    return known or [x.q[x.system.tree.q[b]] for b in x.structure.prescribed.values()]


def _implicit(g: Sequence[Node], w: Sequence[Node], probe: Probe) -> list[Definition]:
    """Blocks of equations for Newton's method."""
    J = probe.cleaned(jacobian(g, w))
    order = solution_blocks(nonzero_pattern(J)) if len(w) else []
    if order is None:
        order = [(list(range(len(g))), list(range(len(w))))]
    return [Definition(tuple(w[k] for k in b), (), tuple(g[k] for k in a)) for a, b in order]


def _reason(d: Definition, elements: Sequence[str]) -> str:
    n = len(d.symbols)
    of = ", ".join(dict.fromkeys(elements))
    if n == 1:
        return f"{d.names[0]}: no formula for its equation of {of}; Newton's method solves it"
    return f"{', '.join(d.names)}: no formulas; {n} equations of {of} determine them, solved by Newton's method"


def _with_reference_turns(d: Definition, probe: Probe) -> Definition | None:
    """Add the whole turns of the reference configuration; None if the formula does not hold there."""
    values = []
    for w, y in zip(d.symbols, d.values, strict=False):
        missing = probe.start[w.data.name] - probe.at_start(y)
        if not math.isfinite(missing):  # a formula that divides by zero there, as at a dead centre
            return None
        turns = round(missing / (2.0 * math.pi))
        if not abs(missing - 2.0 * math.pi * turns) <= 1e-7 * (1.0 + abs(missing)):
            return None
        values.append(y + 2.0 * math.pi * turns if turns else y)
    return replace(d, values=tuple(values))


def _fulfil_equations(g: Sequence[Node], definitions: Sequence[Definition], place: ConstraintValues) -> bool:
    """Whether formulas fulfil the equations at random positions near the reference configuration."""
    others = {w.data.name for d in definitions if not d.closed for w in d.symbols}
    if others:  # remaining equations are tested separately
        return True
    if not definitions:
        return True
    nodes = FormulaSubstitution(definitions)(g)
    rng = np.random.default_rng(1)
    values: dict[str, Any] = dict(place.values)
    for s in symbols_of(nodes):
        if s.moving:
            name = s.data.name
            values[name] = values.get(name, 0.0) + RANDOM_STEP * rng.uniform(-1.0, 1.0, TRIALS)
    with np.errstate(all="ignore"):
        found = np.array([np.broadcast_to(y, TRIALS) for y in evaluate(nodes, values)], float)
    there = np.isfinite(found).all(axis=0)
    return bool(
        there.any() and np.abs(found[:, there]).max(initial=0.0) <= AGREEMENT_TOLERANCE * max(1.0, place.length)
    )


@dataclass(frozen=True)
class ExtraSymbols:
    """Symbols of equations other than coordinates, velocities and multipliers.

    Attributes
    ----------
    vdot : list of Node
        Symbols of the accelerations.
    places : list of (Node, Node)
        Symbols of curve parameters, and their equations.
    """

    vdot: Sequence[Node] = ()
    places: Sequence[tuple[Node, Any]] = ()


NO_EXTRA_SYMBOLS = ExtraSymbols()


@dataclass(repr=False)
class IndependentEquations:
    """Equations of motion in independent coordinates; see `reduce_equations`.

    Attributes
    ----------
    names : tuple of str
        Names of velocities: those of the coordinates whose rates they are.
    known : list of int
        Indices of the given coordinates q: the independent ones; of quaternions all four.
    chosen : list of int
        Indices of the independent velocities v.
    definitions : list of Definition
        Dependent coordinates, velocities, accelerations, multipliers and joint loads, each from earlier ones.
    M, f : ndarray of Node (n, n), (n,)
        Reduced equations M a = f with the accelerations a of the independent coordinates.
    accelerations : ndarray of Node (nv,)
        All accelerations; free of dependent symbols if all coordinates have formulas.
    """

    traced: TracedEquations
    place: ConstraintValues
    start: dict[str, float]
    names: tuple[str, ...]
    known: list[int]
    chosen: list[int]
    dependent: list[int]
    positions: list[Definition]
    definitions: list[Definition]
    M: np.ndarray
    f: np.ndarray
    Z: np.ndarray
    accelerations: np.ndarray
    multipliers: np.ndarray
    determinants: dict[str, Any] = field(default_factory=dict)
    undetermined: tuple[str, ...] = ()
    notes: list[str] = field(default_factory=list)

    @property
    def independent(self) -> tuple[str, ...]:
        """Names of the independent coordinates."""
        return tuple(self.names[d] for d in self.chosen)

    @cached_property
    def formulas(self) -> FormulaSubstitution:
        """Substitution of all formulas."""
        return FormulaSubstitution(self.definitions)

    def __repr__(self) -> str:
        return f"<equations solved for the accelerations of {', '.join(self.independent) or 'nothing free'}>"

    def inlined(self, nodes: Sequence[Any]) -> list[Any]:
        """Expressions of q, v, lam in terms of the independent coordinates, their rates, and what has no formula."""
        return self.formulas(nodes)


def reduce_equations(
    x: TracedEquations,
    start: Mapping[str, float],
    independent: Sequence[str] = (),
    more: ExtraSymbols = NO_EXTRA_SYMBOLS,
) -> IndependentEquations:
    """Solve a mechanism's equations for the accelerations of independent coordinates.

    Parameters
    ----------
    x : TracedEquations
    start : mapping
        An assembled position: values of t, q and v by symbol name. It determines the branch of every
        dependent coordinate.
    independent : sequence of str
        Coordinates such as ``"A.angle"``; chosen by pivoting at the start if none are named.
    more : ExtraSymbols
        Further symbols of the equations.

    Raises
    ------
    ModelError
        If a name does not exist, the coordinates named depend on one another, or are too many or too few.
    SingularityError
        If the start is singular.
    """
    c = collect_constraints(x)
    place = ConstraintValues(x, c, start)
    names = tuple(v.data.name.removesuffix("'") for v in x.v)
    if x.v and not x.v[0].data.element:  # numbered symbols
        names = tuple(n.name for n in velocity_names(x.structure))
    chosen, rows = _chosen(x, place, names, independent)
    known, holonomic, unknown = _positions(x, place, chosen)
    solved = solve_positions(x, place, (holonomic, unknown), more.places)
    return _Reduction(x, names, place, more).equations(known, chosen, rows, solved)


def _chosen(
    x: TracedEquations, place: ConstraintValues, names: Sequence[str], requested: Sequence[str]
) -> tuple[list[int], list[int]]:
    """Independent velocities, and constraints that determine the others."""
    model = x.structure.model.name
    if isinstance(requested, str):
        requested = [requested]
    at = velocities_by_name(names, requested, model)
    G = place.G
    for name, d in zip(requested, at, strict=True):
        if any(G[k, d] and np.count_nonzero(G[k]) == 1 for k in range(len(G))):
            by = [place.c.elements[k] for k in range(len(G)) if G[k, d] and np.count_nonzero(G[k]) == 1]
            raise ModelError(f"{name!r} is not independent: {by[0]!r} gives it; name another coordinate")
    try:
        found = choose_independent(G, place.scale, at, only=bool(requested))
    except ValueError as error:
        d = int(error.args[0])
        others = [n for n in requested if n != names[d]]
        what = f"of {', '.join(others)}" if others else "at the start: nothing moves along it"
        best = [names[k] for k in choose_independent(G, place.scale).chosen]
        raise ModelError(
            f"{names[d]!r} is not independent {what}; {listing(best) if best else 'drivers leave no freedom'}"
        ) from None
    freedoms = len(names) - len(found.rows)
    if requested and len(found.chosen) < freedoms:
        best = [names[k] for k in choose_independent(G, place.scale, at).chosen if k not in at]
        raise ModelError(
            f"{model!r} has {freedoms} freedoms, and independent names {len(at)}; add others, such as {', '.join(best)}"
        )
    place.refuse_singular(found)
    return found.chosen, found.rows


def _positions(
    x: TracedEquations, place: ConstraintValues, chosen: list[int]
) -> tuple[list[int], list[int], list[int]]:
    """Given coordinates, constraints that determine the others, and these others."""
    which = np.flatnonzero(place.c.holonomic)
    free_places = set(choose_independent(place.G[which], place.scale, chosen).chosen)
    known: list[int] = []
    unknown: list[int] = []
    moved: list[int] = []
    for q, v in position_groups(x.structure):
        if any(d in free_places for d in v):
            known += q
        else:
            unknown += q
            moved += v
    G = place.G[np.ix_(which, np.array(moved, int))]
    rows = choose_independent(G, place.scale[moved]).rows
    return known, which[rows].tolist(), unknown


@dataclass
class _Reduction:
    """Steps from constraints to explicit equations, with the names of expressions that must not vanish."""

    x: TracedEquations
    names: tuple[str, ...]
    place: ConstraintValues
    more: ExtraSymbols
    singular: dict[str, Any] = field(default_factory=dict)

    def equations(
        self, known: list[int], chosen: list[int], rows: list[int], solved: SolvedPositions
    ) -> IndependentEquations:
        x, nv = self.x, len(self.names)
        for name, value in solved.never:
            self.singular[f"positions of {name}"] = value
        c = self.place.c
        dependent = [d for d in range(nv) if d not in chosen]
        G = self.place.probe.cleaned(c.G[rows])
        Gw, order = G[:, dependent], solution_blocks(nonzero_pattern(G[:, dependent]))
        right = np.concatenate([G[:, chosen], c.nu[rows][:, None], c.gamma[rows][:, None]], axis=1)
        dets = Determinants()
        X = solve_blocks(Gw, right, dets, order)
        self._record_singular("constraints for", dets, [self.names[d] for d in dependent])
        n = len(chosen)
        Z, b = zero_objects(nv, n), zero_objects(nv)
        Z[chosen] = np.eye(n)
        Z[dependent], b[dependent] = -X[:, :n], X[:, n + 1]
        u = np.array([x.v[d] for d in chosen], object)
        w = X[:, n] + product(Z[dependent], u)
        definitions = [*solved.definitions, *self._each([x.v[d] for d in dependent], w, "constraints on velocities")]
        M = product(Z.T, product(x.M, Z))
        f = product(Z.T, x.f - product(x.M, b))
        pivots = Determinants()
        a = solve_symmetric(M, f[:, None], pivots)[:, 0] if n else zero_objects(0)
        self._record_singular("inertia of", pivots, [self.names[d] for d in chosen])
        vdot = product(Z, a) + b
        dets = Determinants()
        missing = (product(x.M, vdot) - x.f)[dependent]
        lam = solve_blocks(Gw.T, missing[:, None], dets, transposed_blocks(order or []))[:, 0]
        definitions += self._multipliers(rows, lam)
        definitions += self._each(self.more.vdot, vdot, "accelerations") if self.more.vdot else []
        return IndependentEquations(
            x, self.place, self.place.values, self.names, known, chosen, dependent, solved.definitions, definitions, M,
            f, Z, vdot, self._all(rows, lam), self.singular, self._undetermined(), solved.notes,
        )  # fmt: skip

    def _each(self, symbols: Sequence[Node], values: Any, how: str) -> list[Definition]:
        return [Definition((s,), (y,), (), how) for s, y in zip(symbols, values, strict=True)]

    def _multipliers(self, rows: list[int], lam: np.ndarray) -> list[Definition]:
        """Multipliers of rows (0 for redundant rows), and the loads that follow from them."""
        x = self.x
        all_ = self._all(rows, lam)
        out: list[Definition] = []
        if x.loads:  # loads are in f, and therefore in the multipliers
            into: Mapping[int, Any] = dict(enumerate(all_))
            found = Definition(tuple(x.lam), tuple(into[k] for k in range(len(x.lam))))
            returned = FormulaSubstitution([found])([x.graph.node(y) for y in x.returned])
            gaps = tuple(s - y for s, y in zip(x.loads, returned, strict=True))
            out.append(Definition(tuple(x.loads), (), gaps, "loads of joints that return themselves"))
        return out + self._each(x.lam, all_[: len(x.lam)], "reactions")

    def _all(self, rows: list[int], lam: np.ndarray) -> np.ndarray:
        out = zero_objects(len(self.place.c.elements))
        out[rows] = lam
        return out

    def _undetermined(self) -> tuple[str, ...]:
        """Elements whose reactions are undetermined because of redundant constraints."""
        y = fundamental_subspaces(normalised_rows(self.place.G, self.place.scale)).dependencies
        open_ = np.abs(y).max(axis=1, initial=0.0) > 1e-8
        return tuple(dict.fromkeys(e for e, yes in zip(self.place.c.elements, open_, strict=True) if yes))

    def _record_singular(self, what: str, dets: Determinants, names: Sequence[str]) -> None:
        for columns, value in dets.found:
            self.singular[f"{what} {', '.join(names[k] for k in columns)}"] = value
