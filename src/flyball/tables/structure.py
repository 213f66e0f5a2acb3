"""Structure of a mechanism in integers: incidence of bodies and rows, matrix patterns, laws.

Everything that does not change with a parameter is decided here, once: bodies in `forest`, rows and measured quantities
in `constraint_rows`, forces in tables/forces.py, and the sparsity patterns of the Jacobian and of the matrix that is
factored in this module. `values` computes the numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ModelError
from ..model.body import Initial
from ..model.model import Model
from ..numerics.sparse_factorisation import analyse_ldl
from . import constraint_rows, forces, law_inputs
from .constraint_rows import term_from_side_M
from .forest import body_table, point_masses
from .law_inputs import NonsmoothPoints, force_reading_entries, resolve_columns
from .structure_definition import FrameSpec, Structure, integer_table
from .table_definitions import (
    COUPLED,
    SCHUR,
    Blocks,
    LoadTerms,
    MassEntries,
    Pairs,
    Segments,
    SensorDrivers,
    Terms,
    Tree,
)


def set_patterns(s: Structure, solved: bool = True) -> None:
    """Set the patterns of G and (if something is ``solved``) of the factored matrix, and which terms add to them."""
    tree = s.tables["tree"]
    parents = tree.parent.tolist()
    ways = [tree_paths(parents, s.frames[t.F].body, s.frames[t.M].body) for t in s.terms]
    touched = _row_bodies(s, ways)
    at, row_start, column, blocks = _jacobian_entries(tree, touched, len(s.rows))
    terms: list[tuple] = []
    segments: list[tuple] = []
    for t, (on_F, on_M) in zip(s.terms, ways, strict=True):
        first = len(segments)
        segments += [(b, 1, at[t.row, b]) for b in on_M]
        segments += [(b, -1, at[t.row, b]) for b in on_F]
        terms.append((t.row, t.F, t.M, first, len(segments), t.hint))
    following = [
        (k, m, at[k, b], at[len(s.rows) + m, b], tree.nv[b])
        for k, r in enumerate(s.rows)
        for m in r.sensors
        for b in sorted(touched[len(s.rows) + m])
    ]
    loads = [(2 * len(s.measured) + k, n) for k, e in enumerate(s.loads) for n in _load_terms(s, e)]
    loads += force_reading_entries(s)
    s.tables |= {
        "terms": integer_table(Terms, terms),
        "segments": integer_table(Segments, segments),
        "row_start": np.array(row_start, np.int64),
        "column": np.array(column, np.int64),
        "blocks": integer_table(Blocks, blocks),
        "sensor_drivers": integer_table(SensorDrivers, following),
        "load_terms": integer_table(LoadTerms, loads),
    }
    solver = s.tables["sizes"].solver
    if not solved:
        _no_matrix(s)
    elif solver == SCHUR:
        _schur_pattern(s)
    elif solver == COUPLED:
        _coupled_pattern(s, parents)
    else:
        _no_matrix(s)


def _load_terms(s: Structure, e: Any) -> list[int]:
    """Terms whose reactions make up a load; -1 for the multiplier of a row that presses two sides together."""
    return [term_from_side_M(s, k) for k in s.terms_of.get(e.joint, [])] if hasattr(e, "joint") else [-1]


def _row_bodies(s: Structure, paths: list[tuple[list[int], list[int]]]) -> list[set[int]]:
    """Bodies that each row, then each measured quantity, depends on."""
    touched: list[set[int]] = [set() for _ in range(len(s.rows) + len(s.measured))]
    for t, (on_F, on_M) in zip(s.terms, paths, strict=True):
        touched[t.row].update(on_F, on_M)
    for k, r in enumerate(s.rows):
        for m in r.sensors:
            touched[k] |= touched[len(s.rows) + m]
        # a row between two bodies that the forest connects rigidly is redundant
        if not touched[k] and not s.tree_joints:
            raise ModelError(f"{r.element.title} constrains no body that can move")
    return touched


def _jacobian_entries(
    tree: Tree, touched: list[set[int]], rows: int
) -> tuple[dict[tuple[int, int], int], list[int], list[int], list[tuple]]:
    """First entry in G of each (row, body); first entries of rows; velocities of entries; blocks of the rows."""
    blocks: list[tuple] = []
    row_start, at = [0], {}
    column: list[int] = []
    for k, bodies in enumerate(touched):
        for b in sorted(bodies):
            at[k, b] = len(column)
            if k < rows:
                blocks.append((b, len(column), k))
            column.extend(range(tree.v[b], tree.v[b] + tree.nv[b]))
        row_start.append(len(column))
    return at, row_start, column, blocks


def tree_paths(parents: list[int], F: int, M: int) -> tuple[list[int], list[int]]:
    """Bodies on the path from F and from M to their common ancestor (excluded), parents first."""
    on_F: list[int] = []
    on_M: list[int] = []
    while F != M:  # parents have smaller numbers
        if F > M:
            on_F.append(F)
            F = parents[F]
        else:
            on_M.append(M)
            M = parents[M]
    return on_F[::-1], on_M[::-1]


def _schur_pattern(s: Structure) -> None:
    """Pattern of S = G M^-1 G^T: for each body, every pair of its rows."""
    order = np.argsort(s.tables["blocks"].body, kind="stable")
    blocks = Blocks(*(x[order] for x in s.tables["blocks"]))
    first, count = np.unique(blocks.body, return_index=True, return_counts=True)[1:]
    one, other = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for n in np.unique(count).tolist():  # bodies with equally many rows have the same pairs
        i, j = np.tril_indices(n)
        starts = first[count == n, None]
        one.append((starts + i).ravel())
        other.append((starts + j).ravel())
    a, b = np.concatenate(one), np.concatenate(other)
    s.ldl, place = analyse_ldl(len(s.rows), blocks.row[a], blocks.row[b])
    table = Pairs(blocks.entry[a], blocks.entry[b], s.tables["tree"].nv[blocks.body[a]], place[: len(a)])
    order = np.argsort(blocks.body[a], kind="stable")
    order = order[np.argsort(table.place[order], kind="stable")]
    s.tables["pairs"] = Pairs(*(x[order] for x in table))
    s.tables["mass_entries"] = integer_table(MassEntries, [])


def _coupled_pattern(s: Structure, parents: list[int]) -> None:
    """Pattern of [M G^T; G -delta]: entries of M in the order of ``mass_entries``, then those of G.

    Entries that couple a prescribed velocity to others go to a place behind the matrix that is never read: it is no
    unknown.
    """
    tree = s.tables["tree"]
    own = [range(v0, v0 + n) for v0, n in zip(tree.v.tolist(), tree.nv.tolist(), strict=True)]
    entries = []
    for b in range(len(own)):
        for k in own[b]:
            a = b
            while a >= 0:
                entries += [(k, i) for i in own[a] if i <= k]
                a = parents[a]
    row_start, nv = s.tables["row_start"][: len(s.rows) + 1], s.nv
    column = s.tables["column"][: row_start[-1]]
    rows = np.repeat(np.arange(len(s.rows)), np.diff(row_start)) + nv
    row_of_M, column_of_M = np.array(entries, np.int64).reshape(-1, 2).T
    i, j = np.r_[row_of_M, rows], np.r_[column_of_M, column]
    unknown = np.ones(nv + len(s.rows), bool)
    unknown[tree.v[tree.law >= 0]] = False
    counted = (unknown[i] & unknown[j]) | (i == j)
    s.ldl, found = analyse_ldl(nv + len(s.rows), i[counted], j[counted])
    place = np.full(len(i), len(s.ldl.Ai))
    place[counted] = found[: counted.sum()]
    n, e = len(entries), np.arange(len(column))
    s.tables["mass_entries"] = MassEntries(*map(np.ascontiguousarray, (row_of_M, column_of_M, place[:n])))
    s.tables["pairs"] = Pairs(e, e, np.ones_like(e), place[n:].copy())


def _no_matrix(s: Structure) -> None:
    """Empty pattern: a forest of tree joints without rows is solved by articulated bodies and needs no matrix."""
    s.ldl, _ = analyse_ldl(0, np.zeros(0, int), np.zeros(0, int))
    s.tables["pairs"], s.tables["mass_entries"] = integer_table(Pairs, []), integer_table(MassEntries, [])


MAX_STRUCTURES = 8  # structures that are cached for each mechanism


@dataclass(frozen=True, kw_only=True)
class Choices:
    """Options of a mechanism's tables.

    Attributes
    ----------
    far : bool
        Use the rows that converge from a distant start (assembly) in place of those of motion.
    positions : bool
        Leave out rows that restrain velocities only, which do not matter in assembly.
    holds : tuple of Initial
        Coordinates to be held at a value, as further rows.
    tree : tuple of str
        Names of joints that become tree joints instead of rows.
    coupled : bool
        Solve through the coupled matrix also where M is constant and block diagonal, to compare the cost.
    solved : bool
        Whether accelerations are needed; if not, no matrix pattern is prepared for factorisation.
    switches : bool
        With rows that have modes: those of a motion.
    outputs : tuple of str
        Names of sensors that are measured although no law uses them.
    """

    far: bool = False
    positions: bool = False
    holds: tuple[Initial, ...] = ()
    tree: tuple[str, ...] = ()
    coupled: bool = False
    solved: bool = True
    switches: bool = False
    outputs: tuple[str, ...] = ()


DEFAULT_CHOICES = Choices()


def structure(model: Model, choices: Choices = DEFAULT_CHOICES) -> Structure:
    """Structure of a mechanism: computed once for each of its snapshots, cached, not to be changed.

    Raises
    ------
    ModelError
        If there are no bodies.
    """
    model = model.snapshot()
    key = choices, point_masses(model)
    found = model.cache.get("structure", key, MAX_STRUCTURES, lambda: _built(model, choices))
    if is_outdated(found):
        model.cache.drop("structure", key)
        found = model.cache.get("structure", key, MAX_STRUCTURES, lambda: _built(model, choices))
    return found


def is_outdated(s: Structure) -> bool:
    """Whether a Python function in it (a law, or a formula of a user-defined class) has changed since."""
    return any(f.native.stale for f in s.functions) or any(x.stale for x in s.code_tables)


def _built(model: Model, choices: Choices) -> Structure:
    if not model.bodies and not model.bulk:
        raise ModelError(f"{model.name!r} has no bodies; add at least one")
    c = choices
    s = Structure(model, c.far, c.tree, c.positions or c.far, c.coupled)
    s.const = [0.0] * len(model.parameters)
    for table in model.law_tables().values():
        s.table_at[table.name] = len(s.const)
        s.const += table.data()
    law_inputs.add_controller_states(s)
    body_table(s)
    s.frames.append(FrameSpec(-1, None, "world"))
    if c.switches:
        s.branches = NonsmoothPoints(s)
        s.branches.quantities()
        constraint_rows.measure_switches(s)
        constraint_rows.measure_released_rows(s)
    in_events = constraint_rows.event_names(model) if c.switches else {}
    outputs = {name: model[name] for name in c.outputs}
    named = outputs | constraint_rows.coordinates_in_equations(model) | law_inputs.controller_names(model) | in_events
    forces.measure_quantities(s, named)
    law_inputs.add_controller_slots(s)
    if c.switches:
        law_inputs.number_force_readings(s)
    constraint_rows.add_constraint_rows(s, c.holds)
    if c.switches:
        constraint_rows.add_switch_rows(s)
    forces.fill_force_table(s)
    forces.fill_surfaces(s)
    forces.place_rotors(s)
    law_inputs.add_controller_laws(s)
    law_inputs.add_gravity_laws(s)
    if c.switches:
        constraint_rows.add_event_guards(s)
    constraint_rows.fill_switch_tables(s)
    for e in s.loads:
        if (joint := getattr(e, "joint", "")) in s.tree_joints:
            raise ModelError(f"{e.title} needs the reaction of {joint!r}, which must then be rows, not a tree joint")
    constraint_rows.sort_terms(s)
    set_patterns(s, c.solved)
    resolve_columns(s)
    s.tables["code"] = np.array(s.code or [0], np.int64)
    return s
