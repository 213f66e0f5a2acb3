"""Which entries G has, which the matrix that is factored, and who adds to them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ModelError
from ..numerics.ldl import analyse
from .reads import entries
from .specs import Structure, integers
from .system import COUPLED, SCHUR, Blocks, LoadTerms, MassEntries, Pairs, Segments, SensorDrivers, Terms, Tree
from .terms import on_second


def patterns(s: Structure, solved: bool = True) -> None:
    """Entries of G, of the matrix that is factored (if something is ``solved``), and who adds to them."""
    tree = s.tables["tree"]
    parents = tree.parent.tolist()
    ways = [apart(parents, s.frames[t.F].body, s.frames[t.M].body) for t in s.terms]
    touched = _touched(s, ways)
    at, row_start, column, blocks = _entries(tree, touched, len(s.rows))
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
    loads = [(2 * len(s.measured) + k, n) for k, e in enumerate(s.loads) for n in _pressing(s, e)]
    loads += entries(s)
    s.tables |= {
        "terms": integers(Terms, terms),
        "segments": integers(Segments, segments),
        "row_start": np.array(row_start, np.int64),
        "column": np.array(column, np.int64),
        "blocks": integers(Blocks, blocks),
        "sensor_drivers": integers(SensorDrivers, following),
        "load_terms": integers(LoadTerms, loads),
    }
    solver = s.tables["sizes"].solver
    if not solved:
        _nothing(s)
    elif solver == SCHUR:
        _schur(s)
    elif solver == COUPLED:
        _coupled(s, parents)
    else:
        _nothing(s)


def _pressing(s: Structure, e: Any) -> list[int]:
    """Terms whose reactions are a load; -1 for the multiplier of the row that presses two sides together."""
    return [on_second(s, k) for k in s.terms_of.get(e.joint, [])] if hasattr(e, "joint") else [-1]


def _touched(s: Structure, ways: list[tuple[list[int], list[int]]]) -> list[set[int]]:
    """Bodies that each row, then each measured quantity, depends on."""
    touched: list[set[int]] = [set() for _ in range(len(s.rows) + len(s.measured))]
    for t, (on_F, on_M) in zip(s.terms, ways, strict=True):
        touched[t.row].update(on_F, on_M)
    for k, r in enumerate(s.rows):
        for m in r.sensors:
            touched[k] |= touched[len(s.rows) + m]
        if not touched[k] and not s.tree_joints:  # where a forest is rigid between two bodies, the row is redundant
            raise ModelError(f"{r.element.title} restrains nothing that can move")
    return touched


def _entries(
    tree: Tree, touched: list[set[int]], rows: int
) -> tuple[dict[tuple[int, int], int], list[int], list[int], list[tuple]]:
    """Where each (row, body) begins in G; first entries of rows; velocities of entries; blocks of the rows."""
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


def apart(parents: list[int], F: int, M: int) -> tuple[list[int], list[int]]:
    """Bodies that one of two hangs on and the other does not, themselves included, parents first: of F, of M."""
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


def _schur(s: Structure) -> None:
    """S = G M^-1 G^T: for each body, every pair of its rows."""
    order = np.argsort(s.tables["blocks"].body, kind="stable")
    blocks = Blocks(*(x[order] for x in s.tables["blocks"]))
    first, count = np.unique(blocks.body, return_index=True, return_counts=True)[1:]
    one, other = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for n in np.unique(count).tolist():  # bodies with as many rows have the same pairs
        i, j = np.tril_indices(n)
        starts = first[count == n, None]
        one.append((starts + i).ravel())
        other.append((starts + j).ravel())
    a, b = np.concatenate(one), np.concatenate(other)
    s.ldl, place = analyse(len(s.rows), blocks.row[a], blocks.row[b])
    table = Pairs(blocks.entry[a], blocks.entry[b], s.tables["tree"].nv[blocks.body[a]], place[: len(a)])
    order = np.argsort(blocks.body[a], kind="stable")
    order = order[np.argsort(table.place[order], kind="stable")]
    s.tables["pairs"] = Pairs(*(x[order] for x in table))
    s.tables["mass_entries"] = integers(MassEntries, [])


def _coupled(s: Structure, parents: list[int]) -> None:
    """[M G^T; G -delta]: entries of M in the order in which ``mass_entries`` makes them, then those of G.

    What couples a prescribed velocity to others goes to an entry behind the matrix that nobody reads: it is no unknown.
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
    s.ldl, found = analyse(nv + len(s.rows), i[counted], j[counted])
    place = np.full(len(i), len(s.ldl.Ai))
    place[counted] = found[: counted.sum()]
    n, e = len(entries), np.arange(len(column))
    s.tables["mass_entries"] = MassEntries(*map(np.ascontiguousarray, (row_of_M, column_of_M, place[:n])))
    s.tables["pairs"] = Pairs(e, e, np.ones_like(e), place[n:].copy())


def _nothing(s: Structure) -> None:
    """No rows on a forest of tree joints: sweeps over articulated bodies need no matrix."""
    s.ldl, _ = analyse(0, np.zeros(0, int), np.zeros(0, int))
    s.tables["pairs"], s.tables["mass_entries"] = integers(Pairs, []), integers(MassEntries, [])
