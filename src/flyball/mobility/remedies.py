"""Remedies for redundant constraints: which joints to replace by weaker ones without adding a freedom.

Let the columns of N be the multipliers without effect. An element's rows R are replaced by weaker ones, T R, and T
drops the directions Z (T Z = 0): of N the combinations z with Z^T N_e z = 0 remain. So a choice of changes is a remedy
where the blocks Z^T N_e of its elements, stacked, are square and regular: as many rows are dropped as there are
vectors, and no vector remains. Since all new rows lie in the span of the old ones, the same motions are allowed as
before. All this must hold here and in nearby positions.

Sets that share elements are treated one after the other, each together with those before; if some then have no remedy,
once more with these first. The cheapest choice is found by branch and bound. Which kinds of joints can be replacements,
and at what cost, is given by class attributes (``replaceable``, ``stand_in``, ``omission``, ``called``).
"""

from __future__ import annotations

import dataclasses
import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ..errors import FlyballError
from ..model.body import Driver
from ..model.controller import Sensor
from ..model.element import Element, resolve
from ..model.force import CoordinateForce
from ..model.geometry import triad, vector
from ..model.joint import Coupling, Joint
from ..model.messages import kind_in_words
from ..model.model import Model
from ..model.names import curve_parts
from ..numerics.rank import column_space, fundamental_subspaces, null_space
from ..results.mobility import JointChange, Remedy
from .null_spaces import ConstraintNullSpaces, velocity_scales

MAX_CHANGES = 4  # largest number of elements that a choice changes
MAX_TESTS_PER_SET = 200_000  # largest number of choices tested for one set
MAX_TESTS = 400_000  # the same for all sets of a mechanism
SINGULAR_BLOCK_TOLERANCE = 1e-6  # a block with a smaller singular value is singular


@dataclass
class SearchBudget:
    """Number of choices that may still be tested."""

    tests: int = MAX_TESTS


class CandidateChange(NamedTuple):
    """A change of one element: orthonormal rows (positions, f, s) of the multipliers that it releases, and its cost."""

    element: int
    number: int
    cost: float
    block: np.ndarray

    @property
    def released_rows(self) -> int:
        """Number of rows that it releases."""
        return self.block.shape[1]


def cheapest_combination(
    items: Sequence[CandidateChange], surplus: int, search_budget: SearchBudget
) -> tuple[list[CandidateChange] | None, str]:
    """Return the cheapest choice with square and regular blocks in every position; among equal ones the first by
    elements.

    Partial choices are expanded in the order of their cost; those that cannot improve on the best one are dropped.
    """
    if not items:
        return None, ""
    groups = _by_released_rows(items)
    least, widest = min(i.cost for i in items), max(groups)
    budget = start = min(MAX_TESTS_PER_SET, search_budget.tests)
    best: Combination | None = None
    heap = [Combination(0.0, 0, (), ())]
    while heap and budget > 0:
        now = heapq.heappop(heap)
        if best is not None and (now.cost + least, now.changes + 1, now.elements) > best[:3]:
            continue
        free = _remaining_multipliers([items[i] for i in now.items], surplus, len(items[0].block))
        for f, (numbers, blocks) in groups.items():
            after = free.shape[2] - f
            if not 0 <= after <= widest * (MAX_CHANGES - now.changes - 1):
                continue
            begin = sum(items[n].element <= now.elements[-1] for n in numbers) if now.elements else 0
            budget -= len(numbers) - begin
            for k in _regular_blocks(blocks[begin:], free):
                new = now.extended(numbers[begin + k], items)
                if after:
                    heapq.heappush(heap, new)
                elif best is None or new < best:
                    best = new
    search_budget.tests -= start - budget
    if best is not None:
        return [items[i] for i in best.items], ""
    return None, f"after {start - budget} choices" if heap else ""


class Combination(NamedTuple):
    """Chosen items; the fields are in the order in which choices are compared."""

    cost: float
    changes: int
    elements: tuple[int, ...]
    items: tuple[int, ...]

    def extended(self, i: int, items: Sequence[CandidateChange]) -> Combination:
        """Return the combination with one more item, of a later element."""
        new = items[i]
        return Combination(self.cost + new.cost, self.changes + 1, (*self.elements, new.element), (*self.items, i))


def _by_released_rows(items: Sequence[CandidateChange]) -> dict[int, tuple[list[int], np.ndarray]]:
    """Return, by number of released rows, the numbers of the items and their blocks (items, positions, f, s)."""
    out = {}
    for f in sorted({i.released_rows for i in items}):
        numbers = [k for k, i in enumerate(items) if i.released_rows == f]
        out[f] = numbers, np.stack([items[k].block for k in numbers])
    return out


def _remaining_multipliers(chosen: Sequence[CandidateChange], surplus: int, positions: int) -> np.ndarray:
    """Return bases (positions, s, left) of the multipliers that remain after a choice."""
    if not chosen:
        return np.broadcast_to(np.eye(surplus), (positions, surplus, surplus))
    blocks = np.concatenate([i.block for i in chosen], axis=1)
    return np.stack([null_space(b, SINGULAR_BLOCK_TOLERANCE, 1.0) for b in blocks])


def _regular_blocks(blocks: np.ndarray, free: np.ndarray) -> list[int]:
    """Return which blocks (items, positions, f, s) have full rank on the remaining multipliers in every position."""
    if not len(blocks):
        return []
    shown = blocks @ free
    if shown.shape[2] == 1:
        least = np.sqrt((shown**2).sum(axis=3))[:, :, 0]
    else:
        least = np.linalg.svd(shown, compute_uv=False)[..., -1]
    return np.flatnonzero(least.min(axis=1) > SINGULAR_BLOCK_TOLERANCE).tolist()


MAX_DIRECTIONS = 12  # directions tried for the axes of replacement joints
PARALLEL_TOLERANCE = 1e-9


class ElementRows(NamedTuple):
    """Rows of an element in every position, of unit size, with rotations times length."""

    columns: np.ndarray  # velocities with nonzero entries, (w,)
    values: np.ndarray  # (positions, n, w)


@dataclass(frozen=True)
class Replacement:
    """An element unchanged (no change), or a possible change; its cost and its rows."""

    change: JointChange | None
    cost: float
    rows: ElementRows


def element_rows(
    c: CompiledMechanism, spaces: ConstraintNullSpaces, names: Sequence[str], positions: Sequence[np.ndarray]
) -> dict[str, ElementRows]:
    """Return the rows of elements of a compiled mechanism at the examined position and at nearby ones."""
    a = spaces.assembly
    S, still = c.values.system, np.zeros(c.structure.nv)
    ends, scale = S.row_start[: len(S.rows.law) + 1], velocity_scales(c)
    columns = S.column[: ends[-1]]
    numbers = np.repeat(np.arange(len(ends) - 1), np.diff(ends))
    values = np.zeros((len(positions) + 1, len(columns)))
    for p, q in enumerate((a.q, *positions)):
        c.at(a.t, q, still if p else a.v)
        x = c.work.G[: ends[-1]] * scale[columns]
        size = np.sqrt(np.bincount(numbers, x * x, len(ends) - 1))
        values[p] = x / np.maximum(size, 1e-300)[numbers]
    out = {}
    for name in names:
        rows = c.structure.slices[name]
        n, first, last = rows.stop - rows.start, ends[rows.start], ends[rows.stop]
        own = np.unique(columns[first:last])
        dense = np.zeros((len(values), n, len(own)))
        dense[:, numbers[first:last] - rows.start, np.searchsorted(own, columns[first:last])] = values[:, first:last]
        out[name] = ElementRows(own, dense)
    return out


def possible_replacements(
    spaces: ConstraintNullSpaces, names: list[str], positions: Sequence[np.ndarray]
) -> dict[str, list[Replacement]]:
    """Return the possible replacements of each element, unchanged first, then by cost, from one compilation."""
    own = spaces.assembly.compiled
    model, env = own.structure.model, own.values.parameter_values
    probe = model.copy()
    found: dict[str, list[tuple[str, Joint]]] = {name: [] for name in names}
    directions = _candidate_directions(model, names, env)
    for name in names:
        for k, joint in enumerate(_weaker_joints(model, model[name], env, directions)):
            try:
                probe.add(dataclasses.replace(joint, name=f"{name}:{k}"))
            except FlyballError:
                continue
            found[name].append((f"{name}:{k}", joint))
    c = compile_mechanism(probe, parameters=env, solved=False)
    c.follow(own.hints)
    rows = element_rows(c, spaces, [x for n in names for x in (n, *(k for k, _ in found[n]))], positions)
    out = {}
    for name in names:
        e = model[name]
        kind = kind_in_words(type(e))
        out[name] = [Replacement(JointChange(name, kind, joint), joint.stand_in, rows[k]) for k, joint in found[name]]
        if not _used_coordinates(model, e):
            nothing = ElementRows(rows[name].columns, rows[name].values[:, :0])
            out[name].append(Replacement(JointChange(name, kind, None), e.omission, nothing))
        out[name] = [Replacement(None, 0.0, rows[name]), *sorted(out[name], key=lambda o: o.cost)]
    return out


def _weaker_joints(model: Model, e: Element, env: dict[str, float], directions: list[tuple]) -> Iterator[Joint]:
    """Yield joints with fewer rows than the given one, in its place."""
    if not isinstance(e, Joint) or not e.replaceable:
        return
    wanted = _used_coordinates(model, e)
    for cls in _replacement_kinds(model.planar):
        if not wanted <= set(cls.coordinates):
            continue
        common: dict[str, Any] = {"at": e.at} if e.at is not None else {}
        kept = {k: getattr(e, k) for k in ("angle", "displacement") if hasattr(e, k) and hasattr(cls, k)}
        for more in _axis_choices(model, cls, e, env, directions):
            try:
                made = cls(e.name, e.body_i, e.body_j, **common, **kept, **more)
            except FlyballError:
                continue
            if len(made.rows(model.planar)) < len(e.rows(model.planar)):
                yield made


def _replacement_kinds(planar: bool) -> list[Any]:
    """Return the kinds of joints that may serve as replacements, cheapest first, then those with the fewest rows."""
    every: list[Any] = [c for c in Element.registry.values() if issubclass(c, Joint)]
    flat = {c.in_space for c in every if not c.spatial} if planar else set()  # in the plane the planar kinds are used
    kinds = [c for c in every if c.stand_in and (c.planar_normal if planar else c.spatial) and c.__name__ not in flat]
    return sorted(kinds, key=lambda c: (c.stand_in, len(c.blocks), c.__name__))


def _axis_choices(model: Model, cls: Any, e: Any, env: dict[str, float], directions: list[tuple]) -> Iterator[dict]:
    """Yield the axes that a joint of that kind may have there."""
    own = e.axis
    if hasattr(cls, "axes"):
        if own is not None and e.at is not None:
            R = triad(vector(resolve(e, env).axis, False, f"axis of {e.title}", direction=True))
            for k in (0, 1):
                yield {"axes": (own, tuple(R[:, k].tolist()))}
        return
    if not cls.needs_axis or (model.planar and cls.planar_normal == "z"):
        yield {}
        return
    if own is not None:
        yield {"axis": own}
    turns_freely = any(p.kind == "S" for p in cls.chain or ())
    if e.at is not None and (own is None or turns_freely):  # otherwise only the present axis fits
        for d in directions:
            yield {"axis": d}


def _candidate_directions(model: Model, names: Sequence[str], env: dict[str, float]) -> list[tuple]:
    """Return directions to try: axes of the sets' joints, directions from joint to joint, and the world axes."""
    d = 2 if model.planar else 3
    out: list[np.ndarray] = []
    points = []
    for name in names:
        e = model[name]
        if isinstance(e, Joint) and e.at is not None:
            n = resolve(e, env)
            if np.ndim(n.at) == 1:
                points.append(vector(n.at, model.planar, name))
            if e.axis is not None and not (model.planar and e.planar_normal == "z"):
                out.append(vector(n.axis, model.planar, name, direction=True))
    lines = [q - p for p, q in combinations(points, 2)]
    out += [x / np.linalg.norm(x) for x in lines if np.linalg.norm(x) > 1e-9]
    out += list(np.eye(3)[:d])
    kept: list[np.ndarray] = []
    for x in out:
        if all(abs(abs(x @ y) - 1.0) > PARALLEL_TOLERANCE for y in kept) and len(kept) < MAX_DIRECTIONS:
            kept.append(x)
    return [tuple((x[:d] + 0.0).tolist()) for x in kept]


def _used_coordinates(model: Model, e: Any) -> set[str]:
    """Return the coordinates of a joint that drivers, couplings, forces, sensors or initial conditions name."""
    texts = [d.coordinate for d in model.drivers] + [i.name for i in model.initial]
    texts += [x for c in model.couplings if isinstance(c, Coupling) for x in c.coupled()]
    texts += [x for f in model.forces if isinstance(f, CoordinateForce) for x in f.along()]
    texts += [x.of for x in model.sensors if isinstance(x, Sensor)]
    if isinstance(e, Driver):
        return set()
    return {what for owner, what in (curve_parts(t) for t in texts if t) if owner == e.name}


MAX_ELEMENTS = 40  # largest number of elements of a set that are tried
SPAN_TOLERANCE = 1e-6  # residual within which unit rows lie in a span; smaller singular values count as zero


class RemedySearch(NamedTuple):
    """Result of the search for a set."""

    cure: Remedy | None
    here_only: bool  # whether the set is dependent here only, and not in all other positions
    cut: str  # extent of the search, where it found none and was not complete


class WeakerElement(NamedTuple):
    """An option, and its rows in terms of the present ones in every position: T, and Z with T Z = 0."""

    option: Replacement
    T: np.ndarray  # (positions, m, n)
    Z: np.ndarray  # (positions, n, n - m)


def find_remedies(
    spaces: ConstraintNullSpaces, sets: Sequence[tuple[str, ...]], positions: Sequence[np.ndarray]
) -> list[RemedySearch]:
    """Return a remedy for each set of elements, one after the other, with the earlier remedies applied."""
    tried = possible_replacements(
        spaces, list(dict.fromkeys(name for s in sets for name in s[:MAX_ELEMENTS])), positions
    )
    every = list(dict.fromkeys(name for s in sets for name in s))
    rows = element_rows(spaces.assembly.compiled, spaces, every, positions)
    spaces.assembly.compiled.at(spaces.assembly.t, spaces.assembly.q, spaces.assembly.v)
    budget = SearchBudget()
    out: dict[int, RemedySearch] = {}
    for group in _sets_with_common_elements(sets):
        names = list(dict.fromkeys(name for k in group for name in sets[k]))
        own = {n: rows[n] for n in names}
        found = _remedies_in_order(group, sets, CoupledSets(own, tried), budget)
        if failed := [k for k in group if found[k].cure is None and not found[k].here_only]:
            order = [*failed, *(k for k in group if k not in failed)]
            again = _remedies_in_order(order, sets, CoupledSets(own, tried), budget)
            found = min(found, again, key=lambda x: sum(search.cure is None for search in x.values()))
        out |= found
    return [out[k] for k in range(len(sets))]


def _remedies_in_order(
    order: Sequence[int], sets: Sequence[tuple[str, ...]], coupled: CoupledSets, budget: SearchBudget
) -> dict[int, RemedySearch]:
    """Return the remedies of sets in this order: a choice for one limits the choices for those after it."""
    return {k: coupled.remedy_for(sets[k], budget) for k in order}


def _sets_with_common_elements(sets: Sequence[tuple[str, ...]]) -> list[list[int]]:
    """Return the numbers of the sets that share elements, directly or through others."""
    groups: list[tuple[set[str], list[int]]] = []
    for k, names in enumerate(sets):
        touched = [g for g in groups if g[0] & set(names)]
        groups = [g for g in groups if g not in touched]
        groups.append((set(names).union(*(g[0] for g in touched)), sorted(sum((g[1] for g in touched), [k]))))
    return [numbers for _, numbers in groups]


class CoupledSets:
    """Sets that share elements: their rows after the changes chosen so far, and the rows released by these.

    In every position the multipliers without effect are combinations z of the columns of N; after the changes those
    with ``dropped_rows`` z = 0 remain.
    """

    def __init__(self, rows: dict[str, ElementRows], tried: dict[str, list[Replacement]]) -> None:
        self.rows, self.tried = dict(rows), tried
        ends = np.cumsum([r.values.shape[1] for r in rows.values()])[:-1]
        self.first = [dict(zip(rows, np.split(N, ends), strict=True)) for N in _dependencies(list(rows.values()))]
        self.blocks = [dict(blocks) for blocks in self.first]  # rows of N by element, in terms of the new rows
        self.dropped_rows = [np.zeros((0, _combination_count(blocks))) for blocks in self.first]
        self.treated = [
            np.zeros((_combination_count(blocks), 0)) for blocks in self.first
        ]  # combinations of the sets treated so far
        self.changed: set[str] = set()
        self.weaker_elements: dict[str, list[WeakerElement]] = {}

    def remedy_for(self, names: Sequence[str], budget: SearchBudget) -> RemedySearch:
        """Return the cheapest changes that leave no multipliers to this set together with the sets treated before."""
        own = [_combinations_within(N, set(names)) for N in self.first]
        counts = [sum(len(N[n]) for n in names) - z.shape[1] for N, z in zip(self.first, own, strict=True)]
        here_only = max(counts) > counts[0]
        every = [column_space(np.hstack(z), SPAN_TOLERANCE, 1.0) for z in zip(self.treated, own, strict=True)]
        free = [z @ null_space(gone @ z, SPAN_TOLERANCE, 1.0) for gone, z in zip(self.dropped_rows, every, strict=True)]
        if any(z.shape[1] != free[0].shape[1] for z in free):
            return RemedySearch(None, here_only, "")
        chosen, cut = self._chosen(names, free, budget)
        if chosen is None:
            limit = f"at the first {MAX_ELEMENTS} of {len(names)} elements" if len(names) > MAX_ELEMENTS else ""
            return RemedySearch(None, here_only, " and ".join(x for x in (cut, limit) if x))
        self._change(chosen)
        self.treated = every
        return RemedySearch(Remedy(tuple(w.option.change for w in chosen.values() if w.option.change)), here_only, "")

    def _chosen(
        self, names: Sequence[str], free: list[np.ndarray], budget: SearchBudget
    ) -> tuple[dict[str, WeakerElement] | None, str]:
        """Return the cheapest changes of elements that leave none of the multipliers ``free`` (combinations z)."""
        if not free[0].shape[1]:
            return {}, ""
        fresh, again = [], []  # elements changed already are kept if possible
        for k, name in enumerate(names):
            N = np.stack([block[name] @ Y for block, Y in zip(self.blocks, free, strict=True)])
            items = _candidate_changes(k, self._weaker(name), N)
            again += items
            fresh += items if name not in self.changed else []
        cut = ""
        for some in (fresh, again) if len(fresh) < len(again) else (again,):
            chosen, cut = cheapest_combination(some, free[0].shape[1], budget)
            if chosen is not None:
                return {names[i.element]: self._weaker(names[i.element])[i.number] for i in chosen}, ""
        return None, cut

    def _weaker(self, name: str) -> list[WeakerElement]:
        """Return the possible replacements of an element as it is now."""
        if name not in self.weaker_elements:
            own = self.rows[name]
            inverse = np.linalg.pinv(own.values, rcond=SPAN_TOLERANCE)
            found = (_weaker_element(own, option, inverse) for option in self.tried.get(name, [])[1:])
            self.weaker_elements[name] = [w for w in found if w is not None]
        return self.weaker_elements[name]

    def _change(self, chosen: dict[str, WeakerElement]) -> None:
        """Replace rows, and express the remaining multipliers by the new ones."""
        for p, blocks in enumerate(self.blocks):
            for name, w in chosen.items():
                self.dropped_rows[p] = np.vstack([self.dropped_rows[p], w.Z[p].T @ blocks[name]])
                blocks[name] = np.linalg.pinv(w.T[p]).T @ blocks[name]
        for name, w in chosen.items():
            self.rows[name] = w.option.rows
            self.weaker_elements.pop(name)
        self.changed |= set(chosen)


def _combination_count(blocks: dict[str, np.ndarray]) -> int:
    return next(iter(blocks.values())).shape[1]


def _combinations_within(blocks: dict[str, np.ndarray], names: set[str]) -> np.ndarray:
    """Return the combinations of the multipliers that involve these elements only."""
    others = [B for n, B in blocks.items() if n not in names]
    return null_space(np.vstack(others), SPAN_TOLERANCE, 1.0) if others else np.eye(_combination_count(blocks))


def _dependencies(blocks: Sequence[ElementRows]) -> list[np.ndarray]:
    """Return multipliers (n, s) without effect of the stacked rows of elements, in every position."""
    columns = np.unique(np.concatenate([b.columns for b in blocks]))
    first = np.cumsum([0, *(b.values.shape[1] for b in blocks)])
    rows = np.zeros((len(blocks[0].values), first[-1], len(columns)))
    for k, b in enumerate(blocks):
        rows[:, first[k] : first[k + 1], np.searchsorted(columns, b.columns)] = b.values
    return [fundamental_subspaces(x).dependencies for x in rows]


def _weaker_element(current: ElementRows, option: Replacement, inverse: np.ndarray) -> WeakerElement | None:
    """Return an option's rows in terms of the present ones; None if that is impossible, or they are dependent."""
    new = option.rows
    if not np.isin(new.columns, current.columns).all():
        return None
    wide = np.zeros((*new.values.shape[:2], len(current.columns)))
    wide[:, :, np.searchsorted(current.columns, new.columns)] = new.values
    T = wide @ inverse
    n, m = current.values.shape[1], T.shape[1]
    if m >= n or np.abs(T @ current.values - wide).max(initial=0.0) > SPAN_TOLERANCE:
        return None
    if not m:
        return WeakerElement(option, T, np.broadcast_to(np.eye(n), (len(T), n, n)))
    _, d, V = np.linalg.svd(T, full_matrices=True)
    return None if d.min() < SPAN_TOLERANCE else WeakerElement(option, T, V[:, m:].transpose(0, 2, 1))


def _candidate_changes(k: int, weaker: Sequence[WeakerElement], N: np.ndarray) -> list[CandidateChange]:
    """Return the possible changes for multipliers N (p, n, s); of options that release the same rows only the first."""
    out: list[CandidateChange] = []
    known: set[tuple[int, bytes]] = set()
    for number, w in enumerate(weaker):
        if w.Z.shape[2] > N.shape[2]:
            continue
        _, d, V = np.linalg.svd(w.Z.transpose(0, 2, 1) @ N, full_matrices=False)
        same = w.Z.shape[2], np.round(V.transpose(0, 2, 1) @ V + 0.0, 5).tobytes()
        if d.min() > SPAN_TOLERANCE and same not in known:
            known.add(same)
            out.append(CandidateChange(k, number, w.option.cost, V))
    return out
