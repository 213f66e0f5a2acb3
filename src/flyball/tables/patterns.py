"""Which entries G has, which the matrix that is factored, and who adds to them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ModelError
from ..numerics.ldl import analyse
from .reads import entries
from .specs import Structure, ints
from .system import BODY_LAW, COUPLED, NV, SCHUR, SOLVER, V0
from .terms import on_second


def patterns(s: Structure, solved: bool = True) -> None:
    """Entries of G, of the matrix that is factored (if something is ``solved``), and who adds to them."""
    body_i = s.tables["body_i"]
    parents = body_i[:, 0].tolist()
    ways = [apart(parents, s.frames[t.F].body, s.frames[t.M].body) for t in s.terms]
    touched = _touched(s, ways)
    at, row_p, col_i, block_i = _entries(body_i, touched, len(s.rows))
    term_i: list[tuple] = []
    seg_i: list[tuple] = []
    for t, (on_F, on_M) in zip(s.terms, ways, strict=True):
        first = len(seg_i)
        seg_i += [(b, 1, at[t.row, b]) for b in on_M]
        seg_i += [(b, -1, at[t.row, b]) for b in on_F]
        term_i.append((t.row, t.F, t.M, first, len(seg_i), t.hint))
    mix_i = [
        (k, m, at[k, b], at[len(s.rows) + m, b], body_i[b, 5])
        for k, r in enumerate(s.rows)
        for m in r.sensors
        for b in sorted(touched[len(s.rows) + m])
    ]
    load_i = [(2 * len(s.measured) + k, n) for k, e in enumerate(s.loads) for n in _pressing(s, e)]
    load_i += entries(s)
    s.tables |= {
        "term_i": ints(term_i, 6),
        "seg_i": ints(seg_i, 3),
        "row_p": np.array(row_p, np.int64),
        "col_i": np.array(col_i, np.int64),
        "block_i": ints(block_i, 3),
        "mix_i": ints(mix_i, 5),
        "load_i": ints(load_i, 2),
    }
    solver = s.tables["kinds"][SOLVER]
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
    body_i: np.ndarray, touched: list[set[int]], rows: int
) -> tuple[dict[tuple[int, int], int], list[int], list[int], list[tuple]]:
    """Where each (row, body) begins in G; first entries of rows; velocities of entries; blocks of the rows."""
    block_i: list[tuple] = []
    row_p, at = [0], {}
    col_i: list[int] = []
    for k, bodies in enumerate(touched):
        for b in sorted(bodies):
            at[k, b] = len(col_i)
            if k < rows:
                block_i.append((b, len(col_i), k))
            col_i.extend(range(body_i[b, 3], body_i[b, 3] + body_i[b, 5]))
        row_p.append(len(col_i))
    return at, row_p, col_i, block_i


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
    body_i = s.tables["body_i"]
    block_i = s.tables["block_i"]
    block_i = block_i[np.argsort(block_i[:, 0], kind="stable")]
    first, count = np.unique(block_i[:, 0], return_index=True, return_counts=True)[1:]
    one, other = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for n in np.unique(count).tolist():  # bodies with as many rows have the same pairs
        i, j = np.tril_indices(n)
        starts = first[count == n, None]
        one.append((starts + i).ravel())
        other.append((starts + j).ravel())
    a, b = block_i[np.concatenate(one)], block_i[np.concatenate(other)]
    s.ldl, place = analyse(len(s.rows), a[:, 2], b[:, 2])
    table = np.column_stack([a[:, 1], b[:, 1], body_i[a[:, 0], NV], place[: len(a)]])
    table = table[np.argsort(a[:, 0], kind="stable")]
    s.tables["pair_i"] = np.ascontiguousarray(table[np.argsort(table[:, 3], kind="stable")])
    s.tables["mass_i"] = np.zeros((0, 3), np.int64)


def _coupled(s: Structure, parents: list[int]) -> None:
    """[M G^T; G -delta]: entries of M in the order in which ``mass_entries`` makes them, then those of G.

    What couples a prescribed velocity to others goes to an entry behind the matrix that nobody reads: it is no unknown.
    """
    body_i = s.tables["body_i"]
    own = [range(v0, v0 + n) for v0, n in zip(body_i[:, V0].tolist(), body_i[:, NV].tolist(), strict=True)]
    entries = []
    for b in range(len(body_i)):
        for k in own[b]:
            a = b
            while a >= 0:
                entries += [(k, i) for i in own[a] if i <= k]
                a = parents[a]
    row_p, nv = s.tables["row_p"][: len(s.rows) + 1], s.nv
    col_i = s.tables["col_i"][: row_p[-1]]
    rows = np.repeat(np.arange(len(s.rows)), np.diff(row_p)) + nv
    M = ints(entries, 2)
    i, j = np.r_[M[:, 0], rows], np.r_[M[:, 1], col_i]
    unknown = np.ones(nv + len(s.rows), bool)
    unknown[body_i[body_i[:, BODY_LAW] >= 0, 3]] = False
    counted = (unknown[i] & unknown[j]) | (i == j)
    s.ldl, found = analyse(nv + len(s.rows), i[counted], j[counted])
    place = np.full(len(i), len(s.ldl.Ai))
    place[counted] = found[: counted.sum()]
    s.tables["mass_i"] = np.ascontiguousarray(np.column_stack([M, place[: len(M)]]))
    e = np.arange(len(col_i))
    s.tables["pair_i"] = np.ascontiguousarray(np.column_stack([e, e, 0 * e + 1, place[len(M) :]]))


def _nothing(s: Structure) -> None:
    """No rows on a forest of tree joints: sweeps over articulated bodies need no matrix."""
    s.ldl, _ = analyse(0, np.zeros(0, int), np.zeros(0, int))
    s.tables["pair_i"], s.tables["mass_i"] = np.zeros((0, 4), np.int64), np.zeros((0, 3), np.int64)
