"""The terms of every constraint row and measured quantity: joints, couplings, drivers, held coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..compiler.by_address import CodeTable, code_table
from ..constraints.blocks import ANGLE, ConstraintRow, Row, point_coordinate
from ..constraints.registry import SIGNATURES
from ..model.body import Driver, Initial
from ..model.element import Element, LawOf
from ..model.event import Event
from ..model.expressions import Expression
from ..model.force import Force
from ..model.joint import Coordinate, Joint
from ..model.touch import Touch
from .forest import step_of
from .specs import RowSpec, Structure, TermSpec, frame, integers
from .system import ARTICULATED, COUPLED, SCHUR, TERM_KINDS, Angles, Forces, Rows, Sizes


def rows(s: Structure, holds: Sequence[Initial]) -> None:
    """Rows of joints, couplings, drivers and held coordinates; states that count the turns of angles."""
    for joint in s.model.joints:
        _joint_rows(s, joint)
    for coupling in s.model.couplings:
        first = len(s.rows)
        for k, text in enumerate(coupling.coupled()):
            term = coordinate_term(s, text, coupling, first, counted=True)
            term.index = k
        s.rows.append(RowSpec(coupling, "coupling"))
        s.slices[coupling.name] = slice(first, first + 1)
    for driver in s.model.drivers:
        _driver_row(s, driver)
    for hold in holds:
        _told_row(s, hold, hold.name, s.law(Expression.parse("0"), ()))
    _turning(s)


def _joint_rows(s: Structure, joint: Joint) -> None:
    F, M = frame(s, joint, "F"), frame(s, joint, "M")
    first = len(s.rows)
    tree = joint.name in s.tree_joints
    for row in joint.loose(s.model.planar) if tree else joint.rows(s.model.planar):
        if not (row.holonomic or not s.positions):
            continue
        used = row.far if s.far and row.far is not None else row
        term = TermSpec(len(s.rows), F, M, used, 1.0, joint)
        if used.of_kind.place:
            term.hint = s.state(f"{joint.name}.place")
        s.terms.append(term)
        for what in row.plus:
            coordinate_term(s, f"{joint.name}.{what}", joint, len(s.rows), counted=True)
        s.rows.append(RowSpec(joint, ("n" if row.world else "") + row.axes, holonomic=row.holonomic))
    s.slices[joint.name] = slice(first, len(s.rows))


def _driver_row(s: Structure, driver: Driver) -> None:
    law = s.model.law(driver.law, LawOf(s.model.unit(driver.coordinate, driver)), f"law of {driver.title}", driver=True)
    at = s.law(law, (), driver, derivatives=True)
    sensors = tuple(sorted({s.slots[name] for name in law.names & set(s.slots)}))
    link = _prescribes(s, driver)
    if link is not None and not sensors:
        s.prescribed[driver.name] = link
        tree = s.tables["tree"]
        tree.law[link], tree.work[link] = at, s.state(f"{driver.name}.work")
        return
    row = _told_row(s, driver, driver.coordinate, at)
    row.sensors = sensors
    if not s.far:
        row.work = s.state(f"{driver.name}.work")


def _prescribes(s: Structure, driver: Driver) -> int | None:
    """Row of the body table whose one coordinate a driver prescribes; none for coordinates that rows must drive."""
    owner, what = s.model.coordinate(driver.coordinate, driver)
    if not isinstance(owner, Joint) or sum(d.coordinate == driver.coordinate for d in s.model.drivers) > 1:
        return None
    return step_of(s, owner.name, what)


def _told_row(s: Structure, e: Driver | Initial, text: str, law: int) -> RowSpec:
    """The row of a coordinate that follows a law."""
    first = len(s.rows)
    term = coordinate_term(s, text, e, first)
    s.rows.append(RowSpec(e, text, law, wrap=term.formula.of_kind.turns))
    s.slices[e.name] = slice(first, first + 1)
    return s.rows[-1]


def coordinate_frames(s: Structure, owner: Joint, what: str) -> tuple[int, int, Coordinate]:
    """Frames that a joint's coordinate is measured between."""
    c = owner.coordinates[what]
    first, second = (frame(s, owner, role, what if len(getattr(c, f"turn_{role}")) else "") for role in c.frames)
    return first, second, c


def coordinate_term(
    s: Structure, text: str, e: Element, row: int, *, counted: bool = False, measured: bool = False
) -> TermSpec:
    """Add a coordinate to a row or to a measured quantity; ``counted``: with the whole turns of angles."""
    owner, what = s.model.coordinate(text, e)
    if isinstance(owner, Joint):
        F, M, c = coordinate_frames(s, owner, what)
        formula, sign = c.row, c.sign
    else:
        F, M, sign = 0, frame(s, owner, "M"), 1.0
        formula = ANGLE if what == "angle" else point_coordinate(what)
    term = TermSpec(row, F, M, formula, sign, e, owner, what, measured)
    if formula.of_kind.turns and (counted or measured):
        term.hint = count(s, owner, what, F, M)
    s.terms.append(term)
    return term


def count(s: Structure, owner: Any, what: str, F: int, M: int) -> int:
    """The state that counts the turns of an angle."""
    name = f"{owner.name}.{what}"
    known = name in s.state_at
    at = s.state(name)
    if not known:
        s.angles.append((F, M, at))
    return at


def _turning(s: Structure) -> None:
    """In space the turns of every joint angle are counted; in the plane the bodies' own angles count them, unless
    somebody says how many there are at the start. Angles that are coordinates of the forest count their own.
    """
    told = {d.coordinate for d in s.model.drivers} | {i.name for i in s.model.initial}
    for joint in s.model.joints:
        for what, c in joint.measured(s.model.planar).items():
            needed = not s.model.planar or f"{joint.name}.{what}" in told
            if c.row.of_kind.turns and needed and step_of(s, joint.name, what) is None:
                count(s, joint, what, *coordinate_frames(s, joint, what)[:2])


def measured_term(s: Structure, m: int, F: int, M: int, formula: Row, sign: float, e: Element) -> None:
    """Add a term to a measured quantity."""
    s.terms.append(TermSpec(m, F, M, formula, sign, e, measured=True))
    if formula.of_kind.place:
        s.terms[-1].hint = s.state(f"{e.name}.place")


def carrier(t: TermSpec) -> Element:
    """The element that carries what the row of a term does: where an event locks a joint's coordinate, that joint."""
    return t.owner if isinstance(t.element, Event) and isinstance(t.owner, Joint) else t.element


def on_second(s: Structure, k: int) -> int:
    """Number of a term of a joint's rows, and the number of terms more where it is seen from the joint's other side."""
    return k if s.frames[s.terms[k].M].role == "M" else len(s.terms) + k


def sort(s: Structure) -> None:
    """Terms by kind, frames on ground first, those that no loop asks for last; offsets of every kind."""
    used = _used(s)
    order = sorted(range(len(s.frames)), key=lambda k: 0 if s.frames[k].body < 0 else 1 if k in used else 2)
    new = np.empty(len(order), np.int64)
    new[order] = np.arange(len(order))
    s.frames = [s.frames[k] for k in order]
    s.terms.sort(key=lambda t: t.formula.kind)
    s.term_code = [_code(t.formula) for t in s.terms]
    for t in s.terms:
        t.F, t.M = int(new[t.F]), int(new[t.M])
        if t.measured:
            t.row += len(s.rows)
    for k, t in enumerate(s.terms):
        if not t.measured:
            s.terms_of.setdefault(carrier(t).name, []).append(k)
    angles = integers(Angles, s.angles)
    s.frame_at = {key: int(new[k]) for key, k in s.frame_at.items()}
    s.tables["angles"] = Angles(new[angles.F], new[angles.M], angles.state)
    for k, name in enumerate(sorted(s.prescribed, key=s.prescribed.__getitem__)):
        s.slices[name] = slice(len(s.rows) + k, len(s.rows) + k + 1)
    s.tables["frame_body"] = np.array([f.body for f in s.frames], np.int64)
    s.tables["rows"] = integers(Rows, [(r.law, r.wrap, r.work) for r in s.rows])
    terms = np.searchsorted([t.formula.kind for t in s.terms], np.arange(TERM_KINDS + 1))
    ground = int((s.tables["frame_body"] < 0).sum())
    absolute = not s.tree_joints and not s.coupled
    solver = SCHUR if absolute else COUPLED if s.rows or s.coupled else ARTICULATED
    moving = ground + sum(s.frames[new[k]].body >= 0 for k in used)
    s.tables["kind_terms"] = terms.astype(np.int64)
    s.tables["sizes"] = np.array([solver, s.nq, moving, ground], np.int64).view(Sizes)
    _force_frames(s, new)


def _code(row: Row) -> CodeTable | None:
    """The formula of a row of a user's own."""
    return code_table(type(row), SIGNATURES, SIGNATURES) if isinstance(row, ConstraintRow) else None


def frames_of(s: Structure, e: Force) -> tuple[np.ndarray, ...]:
    """Fields of the force table in which a force has frames; others have what is measured there."""
    table: Forces = s.tables["forces"]
    return () if isinstance(e, Touch) else (table.M,) if hasattr(e, "effort") else (table.F, table.M)


def _used(s: Structure) -> set[int]:
    """Frames that the compiled loops ask for; those of tree joints often only results do."""
    used = {k for t in s.terms for k in (t.F, t.M)} | {k for angle in s.angles for k in angle[:2]}
    for k, e in enumerate(s.forces):
        used |= {int(column[k]) for column in frames_of(s, e)}
    return used - {-1}  # forces along a measured quantity that have no frame of their own


def _force_frames(s: Structure, new: np.ndarray) -> None:
    """New numbers of frames in the force table."""
    for k, e in enumerate(s.forces):
        for column in frames_of(s, e):
            if column[k] >= 0:
                column[k] = new[column[k]]
