"""Constraint rows and measured quantities of joints, couplings, drivers, events and switches.

Switches (stops, friction, ropes, ratchets, locks, contacts) are rows with modes and a fixed sparsity pattern, and
guards: functions whose zeros end a mode. Only the tables of a motion have them (`Choices.switches`); in analyses of
positions they are no constraints. Events add rows that actions lock and release, and guards of their expressions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..compiler.kernels import CodeTable, code_table
from ..constraints.blocks import ConstraintRow, Row
from ..constraints.registry import SIGNATURES
from ..constraints.switches.lock import EVENT_DRIVER, LOCK
from ..constraints.switches.switch_kind import (
    DISC,
    G_LAW,
    G_OWN,
    G_SHARED,
    INTERVAL,
    NO_ROW,
)
from ..constraints.switches.switch_kind import SIGNATURES as SWITCH_SIGNATURES
from ..model.body import Body, Driver, Frame, Initial, Located
from ..model.contact_point import Touch
from ..model.element import Element, LawOf
from ..model.event import Event, Impulse, Lock, Release
from ..model.event_validation import LockTarget, coordinate_of, lock_target
from ..model.expression_parser import SyntaxNode
from ..model.expressions import Expression
from ..model.force import Force, Switch
from ..model.joint import Coordinate, Coupling, Joint
from ..model.model import Model
from .forest import coordinate_row
from .structure_definition import RowSpec, Structure, TermSpec, frame_index, integer_table
from .table_definitions import (
    ARTICULATED,
    COUPLED,
    EITHER,
    FALLING,
    OF_RATE,
    RISING,
    SCHUR,
    TERM_KINDS,
    Angles,
    Forces,
    Guards,
    Rows,
    Sizes,
    Switches,
    SwitchNumbers,
)


def add_constraint_rows(s: Structure, holds: Sequence[Initial]) -> None:
    """Add rows of joints, couplings, drivers and held coordinates, and states that count the turns of angles."""
    for joint in s.model.joints:
        _add_joint_rows(s, joint)
    for coupling in s.model.couplings:
        _add_coupling(s, coupling)
    for driver in s.model.drivers:
        _add_driver(s, driver)
    for hold in holds:
        _add_coordinate_row(s, hold, hold.name, s.law(Expression.parse("0"), ()))
    _count_turns(s)


def _add_joint_rows(s: Structure, joint: Joint) -> None:
    F, M = frame_index(s, joint, "F"), frame_index(s, joint, "M")
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
            coordinate_term(s, f"{joint.name}.{what}", joint, len(s.rows), with_turns=True)
        s.rows.append(RowSpec(joint, ("n" if row.world else "") + row.axes, holonomic=row.holonomic))
    s.slices[joint.name] = slice(first, len(s.rows))


def coordinates_in_equations(model: Model) -> dict[str, Coupling]:
    """Coordinates in equations of couplings, each with a coupling that uses it."""
    return {text: e for e in model.couplings if e.equation(model) is not None for text in e.coupled()}


def _add_coupling(s: Structure, e: Coupling) -> None:
    first = len(s.rows)
    s.slices[e.name] = slice(first, first + 1)
    if (equation := e.equation(s.model)) is None:
        for k, text in enumerate(e.coupled()):
            coordinate_term(s, text, e, first, with_turns=True).index = k
        s.rows.append(RowSpec(e, "coupling"))
        return
    # a row without terms of its own: its value is the law of the row with the reverse sign
    law = s.law(replace(equation, tree=SyntaxNode("neg", (equation.tree,))), (), e, derivatives=True)
    sensors = tuple(sorted({s.slots[text] for text in e.coupled()}))
    work = s.state(f"{e.name}.work") if "t" in equation.names and not s.far else -1
    s.rows.append(RowSpec(e, "coupling", law, work=work, sensors=sensors))


def _add_driver(s: Structure, driver: Driver) -> None:
    law = s.model.law(driver.law, LawOf(s.model.unit(driver.coordinate, driver)), f"law of {driver.title}", driver=True)
    if driver.of_rate and s.positions:
        return
    at = s.law(law, (), driver, derivatives=True)
    sensors = tuple(sorted({s.slots[name] for name in law.names & set(s.slots)}))
    link = _prescribed_row(s, driver)
    if link is not None and not sensors:
        s.prescribed[driver.name] = link
        tree = s.tables["tree"]
        tree.law[link], tree.work[link] = at, s.state(f"{driver.name}.work")
        return
    row = _add_coordinate_row(s, driver, driver.coordinate, at)
    row.sensors = () if driver.of_rate else sensors
    row.holonomic = not driver.of_rate
    if not s.far:
        row.work = s.state(f"{driver.name}.work")


def _prescribed_row(s: Structure, driver: Driver) -> int | None:
    """Row of the body table whose one coordinate a driver prescribes; None for a coordinate that needs a row."""
    owner, what = s.model.coordinate(driver.coordinate, driver)
    alone = sum(d.coordinate == driver.coordinate for d in s.model.drivers) == 1
    if driver.of_rate or not isinstance(owner, Joint) or not alone or driver in released_drivers(s.model):
        return None
    return coordinate_row(s, owner.name, what)


def _add_coordinate_row(s: Structure, e: Driver | Initial, text: str, law: int) -> RowSpec:
    """Add the row of a coordinate that follows a law."""
    first = len(s.rows)
    term = coordinate_term(s, text, e, first)
    s.rows.append(RowSpec(e, text, law, wrap=term.formula.of_kind.turns))
    s.slices[e.name] = slice(first, first + 1)
    return s.rows[-1]


def coordinate_frames(s: Structure, owner: Joint | Located, what: str) -> tuple[int, int, Coordinate]:
    """Frames that a coordinate of a joint, body or frame is measured between."""
    c = owner.coordinates[what]
    first, second = (frame_index(s, owner, role, what if len(getattr(c, f"turn_{role}")) else "") for role in c.frames)
    return first, second, c


def coordinate_term(
    s: Structure, text: str, e: Element, row: int, *, with_turns: bool = False, measured: bool = False
) -> TermSpec:
    """Add a coordinate to a row or to a measured quantity; ``with_turns``: including the whole turns of angles."""
    owner, what = s.model.coordinate(text, e)
    F, M, c = coordinate_frames(s, owner, what)
    term = TermSpec(row, F, M, c.row, c.sign, e, owner, what, measured)
    if c.row.of_kind.turns and (with_turns or measured):
        term.hint = turn_state(s, owner, what, F, M)
    elif c.row.of_kind.place:
        term.hint = s.state(f"{owner.name}.place")
    s.terms.append(term)
    return term


def turn_state(s: Structure, owner: Any, what: str, F: int, M: int) -> int:
    """State that counts the turns of an angle."""
    name = f"{owner.name}.{what}"
    known = name in s.state_at
    at = s.state(name)
    if not known:
        s.angles.append((F, M, at))
    return at


def _count_turns(s: Structure) -> None:
    """Add states that count the turns of angles.

    In space every joint angle needs one, unless it has singular positions, near which its rate has no bound; in the
    plane only angles of drivers and `Initial` elements, as the bodies' own angles count turns; these need one in space
    too. Coordinates of the forest count their own turns.
    """
    told: dict[str, Element] = {d.coordinate: d for d in s.model.drivers} | {i.name: i for i in s.model.initial}
    needed = [s.model.coordinate(text, e) for text, e in told.items()]
    if s.model.planar:
        needed = [(owner, what) for owner, what in needed if isinstance(owner, Joint)]
    else:
        needed = [(joint, what) for joint in s.model.joints for what in joint.independent(False)] + needed
    for owner, what in needed:
        if owner.coordinates[what].row.of_kind.turns and coordinate_row(s, owner.name, what) is None:
            turn_state(s, owner, what, *coordinate_frames(s, owner, what)[:2])


def measured_term(s: Structure, m: int, F: int, M: int, formula: Row, sign: float, e: Element) -> None:
    """Add a term to a measured quantity."""
    s.terms.append(TermSpec(m, F, M, formula, sign, e, measured=True))
    if formula.of_kind.place:
        s.terms[-1].hint = s.state(f"{e.name}.place")


def reacting_element(t: TermSpec) -> Element:
    """Element that carries the reaction of a term's row: where an event locks a joint's coordinate, that joint."""
    return t.owner if isinstance(t.element, Event) and isinstance(t.owner, Joint) else t.element


def term_from_side_M(s: Structure, k: int) -> int:
    """Code of a term in `LoadTerms`: its number, plus the number of terms if it is seen from the joint's other side."""
    return k if s.frames[s.terms[k].M].role == "M" else len(s.terms) + k


def sort_terms(s: Structure) -> None:
    """Sort terms by kind, and frames: on ground first, those that no loop uses last; set the offsets of every kind."""
    used = _used_frames(s)
    order = sorted(range(len(s.frames)), key=lambda k: 0 if s.frames[k].body < 0 else 1 if k in used else 2)
    new = np.empty(len(order), np.int64)
    new[order] = np.arange(len(order))
    s.frames = [s.frames[k] for k in order]
    s.terms.sort(key=lambda t: t.formula.kind)
    s.term_code = [_user_formula(t.formula) for t in s.terms]
    for t in s.terms:
        t.F, t.M = int(new[t.F]), int(new[t.M])
        if t.measured:
            t.row += len(s.rows)
    for k, t in enumerate(s.terms):
        if not t.measured:
            s.terms_of.setdefault(reacting_element(t).name, []).append(k)
    angles = integer_table(Angles, s.angles)
    s.frame_at = {key: int(new[k]) for key, k in s.frame_at.items()}
    s.tables["angles"] = Angles(new[angles.F], new[angles.M], angles.state)
    s.prescribed = dict(sorted(s.prescribed.items(), key=lambda x: x[1]))
    for k, name in enumerate(s.prescribed):
        s.slices[name] = slice(len(s.rows) + k, len(s.rows) + k + 1)
    s.tables["frame_body"] = np.array([f.body for f in s.frames], np.int64)
    s.tables["rows"] = integer_table(
        Rows, [(r.law, r.wrap if r.holonomic or r.law < 0 else OF_RATE, r.work) for r in s.rows]
    )
    terms = np.searchsorted([t.formula.kind for t in s.terms], np.arange(TERM_KINDS + 1))
    ground = int((s.tables["frame_body"] < 0).sum())
    absolute = not s.tree_joints and not s.coupled
    solver = SCHUR if absolute else COUPLED if s.rows or s.coupled else ARTICULATED
    moving = ground + sum(s.frames[new[k]].body >= 0 for k in used)
    s.tables["kind_terms"] = terms.astype(np.int64)
    s.tables["sizes"] = np.array([solver, s.nq, moving, ground], np.int64).view(Sizes)
    _renumber_force_frames(s, new)


def _user_formula(row: Row) -> CodeTable | None:
    """Formula of a user-defined row."""
    return code_table(type(row), SIGNATURES, SIGNATURES) if isinstance(row, ConstraintRow) else None


def force_frames(s: Structure, e: Force) -> tuple[np.ndarray, ...]:
    """Fields of the force table that hold frames; for other forces they hold measured quantities."""
    table: Forces = s.tables["forces"]
    return () if isinstance(e, Touch) else (table.M,) if hasattr(e, "effort") else (table.F, table.M)


def _used_frames(s: Structure) -> set[int]:
    """Frames that the compiled loops use; those of tree joints are often needed by results only."""
    used = {k for t in s.terms for k in (t.F, t.M)} | {k for angle in s.angles for k in angle[:2]}
    for k, e in enumerate(s.forces):
        used |= {int(column[k]) for column in force_frames(s, e)}
    return used - {-1}  # forces along a measured quantity have no frame of their own


def _renumber_force_frames(s: Structure, new: np.ndarray) -> None:
    """Renumber the frames in the force table."""
    for k, e in enumerate(s.forces):
        for column in force_frames(s, e):
            if column[k] >= 0:
                column[k] = new[column[k]]


DIRECTIONS = {"rising": RISING, "falling": FALLING, "either": EITHER}


def lock_switches(model: Model) -> list[tuple[Event, Switch]]:
    """Lock switches: a row for each coordinate that events lock or release, owned by the first of these events."""
    out: dict[str, tuple[Event, Switch]] = {}
    for e in model.events:
        for a in e.do:
            if isinstance(a, (Lock, Release)):
                for text in lock_target(model, e, a).coordinates:
                    out.setdefault(text, (e, Switch(LOCK, label=text, along=(text,))))
    return list(out.values())


def released_joints(model: Model) -> list[Joint]:
    """Joints that some event releases: their own rows are switched off, so they cannot be tree joints."""
    return [model[name] for name in dict.fromkeys(x.joint for x in _lock_targets(model)) if name]


def released_drivers(model: Model) -> list[Driver]:
    """Drivers that some event releases: their rows are switched off, so they cannot prescribe a coordinate directly."""
    return [model[name] for name in dict.fromkeys(x.driver for x in _lock_targets(model)) if name]


def _lock_targets(model: Model) -> list[LockTarget]:
    """All that events lock or release."""
    return [lock_target(model, e, a) for e in model.events for a in e.do if isinstance(a, (Lock, Release))]


def released_row_name(e: Element, k: int) -> str:
    """Name of the measured quantity that is the k-th row of a joint or driver."""
    return f"{e.name}:row {k}"


def measure_released_rows(s: Structure) -> None:
    """Measure the quantities of rows of joints and drivers that events may release."""
    for driver in released_drivers(s.model):
        m = s.measured[released_row_name(driver, 0)] = len(s.measured)
        coordinate_term(s, driver.coordinate, driver, m, measured=True)
    for joint in released_joints(s.model):
        F, M = frame_index(s, joint, "F"), frame_index(s, joint, "M")
        for k, row in enumerate(joint.rows(s.model.planar)):
            m = s.measured[released_row_name(joint, k)] = len(s.measured)
            term = TermSpec(m, F, M, row, 1.0, joint, measured=True)
            if hasattr(joint, "nearest"):
                term.hint = s.state(f"{joint.name}.place")
            s.terms.append(term)
            for what in row.plus:
                coordinate_term(s, f"{joint.name}.{what}", joint, m, measured=True)


def event_names(model: Model) -> dict[str, Event]:
    """Names in event expressions and coordinates with impacts, each with an event that uses it."""
    out: dict[str, Event] = {}
    for e in model.events:
        for where, law in e.laws():
            out |= dict.fromkeys(model.law(law, e.of, where).names, e)
        for a in e.do:
            if isinstance(a, Impulse) and not isinstance(model.find(a.on), (Body, Frame)):
                out[coordinate_of(model, e, a)] = e
    return out


def add_event_guards(s: Structure) -> None:
    """Add guards for the expressions of events; `Structure.events` maps guards to events."""
    for e in s.model.events:
        if not e.at_start:
            s.events[len(s.guards)] = e
            at = s.law(s.model.law(e.law, e.of, f"when of {e.title}"), ())
            s.guards.append((G_LAW, at, DIRECTIONS[e.direction]))


@dataclass
class SwitchSpec:
    """One switch of a structure."""

    element: Element
    switch: Switch
    row: int = -1
    measured: int = -1
    force: int = -1
    law: int = -1
    other: int = -1
    partner: int = -1
    held: bool = False  # initially


def declared_switches(model: Model) -> list[tuple[Element, Switch]]:
    """All switches that the model's elements declare."""
    return [*((e, w) for e in model.elements() for w in e.switches()), *lock_switches(model)]


def switch_quantity(e: Element, w: Switch) -> str:
    """Name of the measured quantity that a switch acts along."""
    if w.along and not w.summed:
        return w.along[0]
    return f"{e.name}:{w.label or 'length'}"


def measure_switches(s: Structure) -> None:
    """Number the quantities that switches act along, before those of forces."""
    for e, w in declared_switches(s.model):
        key = switch_quantity(e, w)
        if key in s.measured:
            continue
        m = s.measured[key] = len(s.measured)
        for k, text in enumerate(w.along):
            coordinate_term(s, text, e, m, measured=True).index = k
            s.terms[-1].switch = w.label if w.summed else None
        for a, b, formula in w.measured or w.path:
            measured_term(s, m, frame_index(s, e, a), frame_index(s, e, b), formula, 1.0, e)


def add_switch_rows(s: Structure) -> None:
    """Add the rows of switches behind all others."""
    for e, w in declared_switches(s.model):
        if w.kind.forces == NO_ROW:
            s.switches.append(SwitchSpec(e, w, -1, s.measured[switch_quantity(e, w)]))
            continue
        row, first = len(s.rows), len(s.rows)
        for k, text in enumerate(w.along):
            coordinate_term(s, text, e, row, with_turns=True).index = k
            s.terms[-1].switch = w.label if w.summed else None
        for a, b, formula in w.path:
            measured_term(s, row, frame_index(s, e, a), frame_index(s, e, b), formula, 1.0, e)
            s.terms[-1].measured = False
        s.rows.append(RowSpec(e, w.label or "switch", holonomic=all(x.holonomic for _, _, x in w.path)))
        s.slices[e.name] = slice(s.slices[e.name].start if e.name in s.slices else first, len(s.rows))
        s.switches.append(SwitchSpec(e, w, row, s.measured[switch_quantity(e, w)]))
    for k, spec in enumerate(s.switches):
        if spec.switch.other:
            one = [i for i, x in enumerate(s.switches) if x.element is spec.element]
            spec.other = next(i for i in one if s.switches[i].switch.label == spec.switch.other)
            like = [i for i in one if i != k and s.switches[i].switch.kind.forces == spec.switch.kind.forces == DISC]
            spec.partner = like[0] if like else -1

    for e in (*released_joints(s.model), *released_drivers(s.model)):
        at, kind = s.slices[e.name], LOCK if isinstance(e, Joint) else EVENT_DRIVER
        for k, row in enumerate(range(at.start, at.stop)):
            spec = SwitchSpec(e, Switch(kind, f"row {k}"), row, s.measured[released_row_name(e, k)])
            spec.held = True
            s.switches.append(spec)


def fill_switch_tables(s: Structure) -> None:
    """Fill in the integers of switches and guards, once forces are numbered."""
    for k, spec in enumerate(s.switches):
        if spec.switch.slides:
            spec.force = next(i for i, f in enumerate(s.forces) if f is spec.element)
            s.tables["forces"].switch[spec.force] = k
        s.guards += [(kind, k, FALLING) for kind in _guards_of(k, spec)]
        if hasattr(spec.switch.kind, "guard"):
            s.guards.append((G_OWN, k, FALLING))
    if _may_be_indeterminate(s):
        s.guards.append((G_SHARED, 0, FALLING))
    s.tables["switches"] = integer_table(
        Switches, [(x.row, x.measured, x.switch.kind.forces, x.force, x.law, x.partner, x.other) for x in s.switches]
    )
    s.tables["guards"] = integer_table(Guards, s.guards)
    s.guard_code = [
        code_table(type(s.switches[of].switch.kind), SWITCH_SIGNATURES, SWITCH_SIGNATURES) if kind == G_OWN else None
        for kind, of, _ in s.guards
    ]


def _may_be_indeterminate(s: Structure) -> bool:
    """Whether forces of friction may be indeterminate, because several constraints can be active together."""
    gaps = {x.other for x in s.switches if x.switch.kind.forces == DISC}
    holding = [x for k, x in enumerate(s.switches) if x.row >= 0 and k not in gaps and not -1 < x.partner < k]
    return len(holding) > 1 and any(x.switch.kind.forces in (INTERVAL, DISC) for x in holding)


def _guards_of(k: int, x: SwitchSpec) -> tuple[int, ...]:
    """Guards of a switch; of the two tangents of a contact point, the first has those of both."""
    return () if -1 < x.partner < k else x.switch.kind.guards


def fill_switch_numbers(s: Structure, of: Any, table: SwitchNumbers, asks: Any, separation: Any) -> None:
    """Fill in the numbers of switches from those of their elements; ``separation``: distance of an element's points."""
    for k, spec in enumerate(s.switches):
        kind, of_law = spec.switch.kind, spec.law >= 0
        if not (of_law or asks(spec.element)):
            continue
        given = (
            () if of_law else spec.element.switched(of[spec.element.name], spec.switch.label, separation(spec.element))
        )
        named = kind.initial_numbers(dict(zip(kind.numbers, given, strict=False)))
        for name, column in zip(table._fields, table, strict=True):
            column[k] = named.get(name, {"lower": -np.inf, "upper": np.inf}.get(name, 0.0))
