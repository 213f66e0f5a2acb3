"""Mechanism -> integers: who touches whom, which row, which entry goes where. Numbers come later (``values``).

Everything that a change of a parameter leaves alone is decided here, once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import forces
from ..constraints import angle
from ..constraints.blocks import FORMULAS, Row, point_coordinate
from ..errors import ModelError
from ..model.body import GROUND, Frame, Initial
from ..model.element import Element, LawOf, fields_with
from ..model.expressions import Expression
from ..model.force import Force, JointForce
from ..model.joint import Coordinate, Joint
from ..model.model import Model
from ..numerics.ldl import Pattern, analyse
from .program import compile_law
from .tables import TERM_KINDS
from .tree import FREE, NQ, NV, PLANAR, REVOLUTE

if len(FORMULAS) != TERM_KINDS:
    raise RuntimeError("TERM_KINDS in system/tables.py must count the formulas in constraints/blocks.py")

FORCE_KINDS = 1 + max(f.kind for f in forces.ALL)


@dataclass(frozen=True)
class FrameSpec:
    """A frame that some element needs: on which body (-1 ground), whose, and which of its frames."""

    body: int
    element: Any
    role: str  # "F", "M"; "world" for ground itself
    coordinate: str = ""  # turned for that coordinate of a joint


@dataclass
class TermSpec:
    """One term of a constraint row."""

    row: int
    F: int
    M: int
    formula: Row
    sign: float
    element: Element


@dataclass
class RowSpec:
    """One constraint row: whose it is, and the law it follows."""

    element: Element
    label: str
    law: int = -1
    wrap: bool = False
    work: int = -1


@dataclass
class Structure:
    """All that is decided about a mechanism before its numbers are known."""

    model: Model
    far: bool
    tree: tuple[str, ...]
    order: list[int] = field(default_factory=list)  # model's bodies in the table's order
    place: dict[str, int] = field(default_factory=dict)  # body name -> row of the body table
    frames: list[FrameSpec] = field(default_factory=list)
    frame_at: dict[tuple[str, str, str], int] = field(default_factory=dict)  # (element, role, coordinate) -> frame
    terms: list[TermSpec] = field(default_factory=list)
    rows: list[RowSpec] = field(default_factory=list)
    slices: dict[str, slice] = field(default_factory=dict)  # element name -> its rows
    forces: list[Force] = field(default_factory=list)
    states: list[str] = field(default_factory=list)  # names of the work and turn states
    tables: dict[str, np.ndarray] = field(default_factory=dict)
    code: list[int] = field(default_factory=list)
    const: list[float] = field(default_factory=list)
    depth: int = 1
    ldl: Pattern = None  # type: ignore[assignment]

    @property
    def nq(self) -> int:
        """Number of coordinates."""
        return int(self.tables["body_i"][:, 4].sum())

    @property
    def nv(self) -> int:
        """Number of velocities."""
        return int(self.tables["body_i"][:, 5].sum())


def structure(model: Model, *, far: bool = False, holds: Sequence[Initial] = (), tree: Sequence[str] = ()) -> Structure:
    """Decide the tables of a mechanism.

    Parameters
    ----------
    model : Model
    far : bool
        Use the rows that lead from a far start (assembly) in place of those of motion.
    holds : sequence of Initial
        Coordinates to be held at a value, as further rows.
    tree : sequence of str
        Names of joints that become tree joints instead of rows.

    Raises
    ------
    ModelError
        If there are no bodies.
    """
    if not model.bodies:
        raise ModelError(f"{model.name!r} has no bodies; add at least one")
    s = Structure(model, far, tuple(tree))
    s.const = [0.0] * len(model.parameters)
    tree_joint = _body_table(s)
    _frames_and_rows(s, holds)
    _forces(s)
    _sort(s)
    _patterns(s, tree_joint)
    s.tables["code"] = np.array(s.code or [0], np.int64)
    return s


def _body_table(s: Structure) -> dict[int, Joint]:
    """Order bodies parents first; choose each one's tree joint."""
    model = s.model
    hung = {}
    for name in s.tree:
        joint: Any = model[name]
        hung[model.carrier(joint.body_j, joint)] = (joint, model.carrier(joint.body_i, joint))
    names = [b.name for b in model.bodies]
    done: dict[str, int] = {GROUND: -1}
    while len(done) <= len(names):
        ready = [n for n in names if n not in done and (n not in hung or hung[n][1] in done)]
        if not ready:
            raise ModelError("the tree joints close a loop")
        for n in ready:
            done[n] = len(done) - 1
    s.place = done
    s.order = [names.index(n) for n in list(done)[1:]]
    body_i = np.zeros((len(names), 6), np.int64)
    q0 = v0 = 0
    joints = {}
    for name, b in done.items():
        if b < 0:
            continue
        kind = REVOLUTE if name in hung else PLANAR if model.planar else FREE
        parent = done[hung[name][1]] if name in hung else -1
        body_i[b] = parent, kind, q0, v0, NQ[kind], NV[kind]
        q0, v0 = q0 + NQ[kind], v0 + NV[kind]
        if name in hung:
            joints[b] = hung[name][0]
    s.tables["body_i"] = body_i
    return joints


def _frames_and_rows(s: Structure, holds: Sequence[Initial]) -> None:
    model = s.model
    s.frames.append(FrameSpec(-1, None, "world"))
    for joint in model.joints:
        F, M = frame(s, joint, "F"), frame(s, joint, "M")
        first = len(s.rows)
        if joint.name not in s.tree:
            for formula in joint.rows(model.planar):
                used = formula.far if s.far and formula.far is not None else formula
                label = ("n" if formula.world else "") + formula.axes
                s.terms.append(TermSpec(len(s.rows), F, M, used, 1.0, joint))
                s.rows.append(RowSpec(joint, label))
        s.slices[joint.name] = slice(first, len(s.rows))
    for driver in model.drivers:
        law = model.law(driver.law, LawOf(model.unit(driver.coordinate, driver)), f"law of {driver.title}")
        _coordinate_row(s, driver, driver.coordinate, _compile(s, law, (), driver), work=not s.far)
    for hold in holds:
        law = Expression.parse("0")
        _coordinate_row(s, hold, hold.name, _compile(s, law, (), hold))


def coordinate_frames(s: Structure, owner: Joint, what: str) -> tuple[int, int, Coordinate]:
    """Frames that a joint's coordinate is measured between."""
    c = owner.coordinates[what]
    first, second = (frame(s, owner, role, what if len(getattr(c, f"turn_{role}")) else "") for role in c.frames)
    return first, second, c


def _coordinate_row(s: Structure, e: Element, text: str, law: int, work: bool = False) -> None:
    owner, what = s.model.coordinate(text, e)
    if isinstance(owner, Joint):
        F, M, c = coordinate_frames(s, owner, what)
        formula, sign = c.row, c.sign
    else:
        F, M, formula, sign = 0, frame(s, owner, "M"), point_coordinate(what), 1.0
    first = len(s.rows)
    spec = RowSpec(e, what, law, wrap=formula.kind == angle.KIND)
    if work:
        spec.work = len(s.states)
        s.states.append(f"{e.name}.work")
    s.terms.append(TermSpec(first, F, M, formula, sign, e))
    s.rows.append(spec)
    s.slices[e.name] = slice(first, first + 1)


def frame(s: Structure, e: Any, role: str, coordinate: str = "") -> int:
    """Index of a frame of an element, made when first asked for."""
    key = (e.name, role, coordinate)
    if key not in s.frame_at:
        s.frame_at[key] = len(s.frames)
        s.frames.append(FrameSpec(s.place[_carrier(s.model, e, role)], e, role, coordinate))
    return s.frame_at[key]


def _carrier(model: Model, e: Any, role: str) -> str:
    if isinstance(e, Frame):
        return e.body
    if hasattr(e, "body_i"):
        return model.carrier(e.body_i if role == "F" else e.body_j, e)
    return model.carrier(getattr(e, "body", e.name), e)


def _compile(s: Structure, law: Expression, inputs: tuple[str, ...], e: Element) -> int:
    at, depth = compile_law(law, ("t", *inputs), list(s.model.parameters), s.code, s.const)
    s.depth = max(s.depth, depth)
    return at


def _forces(s: Structure) -> None:
    """Force table: frames, laws, work and turn states."""
    s.forces = sorted(s.model.forces, key=lambda f: f.kind)
    table = np.full((len(s.forces), 7), -1, np.int64)
    angles: list[tuple[Joint, str]] = []
    turns: dict[tuple[str, str], int] = {}

    def counted(joint: Joint, what: str) -> int:
        if (joint.name, what) not in turns:
            turns[joint.name, what] = len(angles)
            angles.append((joint, what))
        return turns[joint.name, what]

    for k, e in enumerate(s.forces):
        if isinstance(e, JointForce):
            joint = s.model[e.joint]
            table[k, :2] = frame(s, joint, "F"), frame(s, joint, "M")
            table[k, 6] = counted(joint, "angle")
        else:
            table[k, :2] = frame(s, e, "F") if hasattr(e, "body_i") else 0, frame(s, e, "M")
        for name, of in fields_with(e.__class__, LawOf).items():
            for slot, law in enumerate(e.laws()):
                if law is not None:
                    expression = s.model.law(law, of, f"{name} of {e.title}")
                    table[k, 2 + slot] = _compile(s, expression, of.inputs, e)
        if not e.conservative():
            table[k, 5] = len(s.states)
            s.states.append(f"{e.name}.work")
    told = {d.coordinate for d in s.model.drivers} | {i.name for i in s.model.initial}
    for joint in s.model.joints:
        for what, c in joint.coordinates.items():
            # in the plane the bodies' own angles count turns, unless somebody says how many there are at the start
            if c.row.kind == angle.KIND and (not s.model.planar or f"{joint.name}.{what}" in told):
                counted(joint, what)
    angle_i = np.zeros((len(angles), 3), np.int64)
    for k, (joint, what) in enumerate(angles):
        angle_i[k] = *coordinate_frames(s, joint, what)[:2], len(s.states)
        s.states.append(f"{joint.name}.{what}")
    for row in table:
        if row[6] >= 0:
            row[6] = angle_i[row[6], 2]
    s.tables["force_i"], s.tables["angle_i"] = table, angle_i


def _sort(s: Structure) -> None:
    """Terms by kind, frames on ground first; offsets of every kind."""
    order = sorted(range(len(s.frames)), key=lambda k: s.frames[k].body >= 0)
    new = np.empty(len(order), np.int64)
    new[order] = np.arange(len(order))
    s.frames = [s.frames[k] for k in order]
    s.terms.sort(key=lambda t: t.formula.kind)
    for t in s.terms:
        t.F, t.M = int(new[t.F]), int(new[t.M])
    s.tables["force_i"][:, :2] = new[s.tables["force_i"][:, :2]]
    s.tables["angle_i"][:, :2] = new[s.tables["angle_i"][:, :2]]
    s.frame_at = {key: int(new[k]) for key, k in s.frame_at.items()}
    s.tables["frame_i"] = np.array([f.body for f in s.frames], np.int64)
    terms = np.searchsorted([t.formula.kind for t in s.terms], np.arange(TERM_KINDS + 1))
    forces = np.searchsorted([f.kind for f in s.forces], np.arange(FORCE_KINDS + 1))
    ground = int((s.tables["frame_i"] < 0).sum())
    s.tables["kinds"] = np.r_[terms, forces, s.nq, ground].astype(np.int64)
    s.tables["row_i"] = np.array([(r.law, r.wrap, r.work) for r in s.rows], np.int64).reshape(-1, 3)


def _patterns(s: Structure, tree_joint: dict[int, Joint]) -> None:
    """Entries of G, of the matrix that is factored, and who adds to them."""
    body_i = s.tables["body_i"]
    touched: list[set[int]] = [set() for _ in s.rows]
    chains = _chains(body_i)
    for t in s.terms:
        F, M = s.frames[t.F].body, s.frames[t.M].body
        touched[t.row] |= chains[F] ^ chains[M]
    for r, bodies in zip(s.rows, touched, strict=True):
        if not bodies:
            raise ModelError(f"{r.element.title} restrains nothing that can move")
    block_i: list[tuple] = []
    row_p, at = [0], {}
    col_i: list[int] = []
    for k, bodies in enumerate(touched):
        for b in sorted(bodies):
            at[k, b] = len(col_i)
            block_i.append((b, len(col_i), k))
            col_i.extend(range(body_i[b, 3], body_i[b, 3] + body_i[b, 5]))
        row_p.append(len(col_i))
    term_i: list[tuple] = []
    seg_i: list[tuple] = []
    for t in s.terms:
        on_F, on_M = chains[s.frames[t.F].body], chains[s.frames[t.M].body]
        first = len(seg_i)
        seg_i += [(b, 1, at[t.row, b]) for b in sorted(on_M - on_F)]
        seg_i += [(b, -1, at[t.row, b]) for b in sorted(on_F - on_M)]
        term_i.append((t.row, t.F, t.M, first, len(seg_i)))
    s.tables |= {
        "term_i": _ints(term_i, 5),
        "seg_i": _ints(seg_i, 3),
        "row_p": np.array(row_p, np.int64),
        "col_i": np.array(col_i, np.int64),
        "block_i": _ints(block_i, 3),
    }
    if (body_i[:, 0] < 0).all() and not tree_joint:
        _schur(s)
    else:
        _kkt(s, chains)


def _chains(body_i: np.ndarray) -> dict[int, frozenset[int]]:
    """Each body and all it hangs on."""
    chains: dict[int, frozenset[int]] = {-1: frozenset()}
    for b, parent in enumerate(body_i[:, 0].tolist()):
        chains[b] = chains[parent] | {b}
    return chains


def _schur(s: Structure) -> None:
    """S = G M^-1 G^T: for each body, every pair of its rows."""
    body_i = s.tables["body_i"]
    of_body: dict[int, list[tuple[int, int]]] = {}
    for b, at, row in s.tables["block_i"].tolist():
        of_body.setdefault(b, []).append((row, at))
    pairs = [
        (i, j, int(body_i[b, 5]), at, to)
        for b, blocks in of_body.items()
        for k, (i, at) in enumerate(blocks)
        for j, to in blocks[: k + 1]
    ]
    table = _ints(pairs, 5)
    s.ldl, place = analyse(len(s.rows), table[:, 0], table[:, 1])
    table = np.column_stack([table[:, 3], table[:, 4], table[:, 2], place[: len(table)]])
    s.tables["pair_i"] = np.ascontiguousarray(table[np.argsort(table[:, 3], kind="stable")])
    s.tables["mass_i"] = np.zeros((0, 3), np.int64)


def _kkt(s: Structure, chains: dict[int, frozenset[int]]) -> None:
    """[M G^T; G -delta]: entries of M in the order in which ``mass_entries`` makes them, then those of G."""
    body_i = s.tables["body_i"]
    entries = []
    for b in range(len(body_i)):
        for k in range(body_i[b, 3], body_i[b, 3] + body_i[b, 5]):
            for a in sorted(chains[b], reverse=True):
                entries += [(k, i) for i in range(body_i[a, 3], body_i[a, 3] + body_i[a, 5]) if i <= k]
    row_p, col_i, nv = s.tables["row_p"], s.tables["col_i"], s.nv
    rows = np.repeat(np.arange(len(s.rows)), np.diff(row_p)) + nv
    M = _ints(entries, 2)
    s.ldl, place = analyse(nv + len(s.rows), np.r_[M[:, 0], rows], np.r_[M[:, 1], col_i])
    s.tables["mass_i"] = np.ascontiguousarray(np.column_stack([M, place[: len(M)]]))
    e = np.arange(len(col_i))
    s.tables["pair_i"] = np.ascontiguousarray(np.column_stack([e, e, 0 * e + 1, place[len(M) : len(M) + len(e)]]))


def _ints(rows: list, width: int) -> np.ndarray:
    return np.array(rows, np.int64).reshape(-1, width)
