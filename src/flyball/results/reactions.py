"""Reactions of joints over time, and impulses of an event by element.

A body needs the wrench (m (a - g), I alpha + w x I w) about its centre of mass. The part that forces and rows do not
supply must come from its tree joint; the demand of its children passes through it too. Summed from the leaves to the
roots with the true accelerations, that is the wrench through every tree joint (recursive Newton-Euler: Luh, Walker and
Paul 1980; Featherstone 2008, table 5.1). FREE and PLANAR joints transmit nothing: the residual of the equations of
motion.

Impulses of an event come from the same sweep, with jumps of velocities in place of accelerations. Gravity and
finite forces have no part in them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..engine.loads import apply_wrench, euler_moment
from ..errors import ModelError
from ..laws.bytecode import STACK_RESERVE, evaluate_jet
from ..math.vec import add, cross, load3, load9, mtv, mv, neg, scale, store3, sub
from ..model.body import GROUND
from ..model.contact_point import Touch
from ..model.force import CoordinateForce
from ..model.joint import Joint
from ..model.messages import listing, suggest
from ..tables.constraint_rows import reacting_element
from ..tables.table_definitions import Wrenches
from .motion_record import (
    Wrench,
    gravity_over_time,
    term_coefficient,
    term_over_time,
    unit_effort_wrench,
    zero_wrench,
    zero_wrenches,
)

if TYPE_CHECKING:
    from ..tables.structure_definition import Structure
    from .events import Moment
    from .result import Result


class JointReactions:
    """Wrenches over time, world axes, arrays (n,) for each number."""

    def __init__(self, result: Result) -> None:
        self._result = result
        self._known: dict[str, Wrench] = {}

    def of(self, joint: str) -> Wrench:
        """Force [N] on a joint's ``body_j`` at M's origin and torque [N m] about it.

        The effort of a driver along a coordinate of the joint is not included.
        """
        if joint not in self._known:
            force, torque = self._of_rows(joint)
            if joint in self._result.values.structure.tree_joints:
                more = self._of_tree(joint)
                force, torque = add(force, more[0]), add(torque, more[1])
            self._known[joint] = force, torque
        return self._known[joint]

    def in_axes(self, e: Joint, axes: str, on: str | None) -> tuple[np.ndarray, np.ndarray]:
        """Force [N] and torque [N m] of a joint on one of its bodies in named axes, (n, 3) each.

        Raises
        ------
        ModelError
            If the joint has no such axes, or does not act on that body.
        """
        names = [self._result.values.structure.model.carrier(name, e) for name in (e.body_i, e.body_j)]
        on = names[1] if on is None else on
        if on not in names:
            raise ModelError(f"{e.title} joins {names[0]!r} and {names[1]!r}, not {on!r}{suggest(str(on), names)}")
        force, torque = self.of(e.name)
        if axes != "world":
            R = self.axes(e, axes)
            force, torque = mtv(R, force), mtv(R, torque)
        sign = 1.0 if on == names[1] else -1.0
        return sign * np.stack(force, axis=1), sign * np.stack(torque, axis=1)

    def axes(self, e: Joint, axes: str) -> tuple:
        """Rotation, world from the axes ``"joint"`` or those of one of the joint's two bodies, row by row."""
        records, s = self._result.records, self._result.values.structure
        if axes == "joint":
            return records.frame(s.frame_at[e.name, "F", ""])[1]
        names = [s.model.carrier(name, e) for name in (e.body_i, e.body_j)]
        if axes not in names:
            known = ["world", "joint", *names]
            raise ModelError(f"{e.title} has no axes {axes!r}{suggest(str(axes), known)}; {listing(known)}")
        return records.named(axes)[1] if axes != GROUND else tuple(np.eye(3).ravel())

    def _of_rows(self, joint: str) -> Wrench:
        """Return the wrench of the joint's own rows."""
        result, s = self._result, self._result.values.structure
        force, torque = zero_wrench(result.records)
        for k in s.terms_of.get(joint, ()):
            t = s.terms[k]
            _, _, (_, f, tM, tF, _) = term_over_time(result, k)
            if s.frames[t.M].role != "M":  # measured from M to F
                f, tM = neg(f), tF
            lam = term_coefficient(result, k) * result.multipliers[:, t.row]
            force, torque = add(force, scale(lam, f)), add(torque, scale(lam, tM))
        return force, torque

    def _of_tree(self, name: str) -> Wrench:
        """Return the wrench through a tree joint, without the efforts of drivers that prescribe its coordinates."""
        result, s = self._result, self._result.values.structure
        joint, tree = s.model[name], s.tree_joints[name]
        force, torque = load3(self.through.force, tree.child, 0), load3(self.through.torque, tree.child, 0)
        at = result.records.frame(s.frame_at[name, "M", ""])[0]
        torque = add(torque, cross(sub(result.records.body(tree.child)[0], at), force))
        if tree.reversed:
            force, torque = neg(force), neg(torque)
        for driver in s.prescribed:
            owner, what = s.model.coordinate(s.model[driver].coordinate, s.model[driver])
            if owner is joint:
                f, t = unit_effort_wrench(result, joint, what)
                effort = result.multipliers[:, s.slices[driver].start]
                force, torque = sub(force, scale(effort, f)), sub(torque, scale(effort, t))
        return force, torque

    @cached_property
    def through(self) -> Wrenches:
        """Return the wrench of every body's tree joint on the body, (nb, 6, n).

        Force [N], and torque [N m] about the body's centre of mass, world axes.
        """
        S = self._result.values.system
        W = self._acting()
        for b in range(len(S.tree.parent) - 1, -1, -1):
            parent = int(S.tree.parent[b])
            if parent >= 0:
                force, torque = load3(W.body_wrenches.force, b, 0), load3(W.body_wrenches.torque, b, 0)
                apply_wrench(W, parent, 1.0, force, torque, load3(W.bodies.position, b, 0))
        return -W.body_wrenches  # type: ignore[no-any-return]

    def _acting(self) -> SimpleNamespace:
        """Kinematics, and the wrenches on every body except those of tree joints: gravity, inertia, forces, rows."""
        result, s = self._result, self._result.values.structure
        W = self._inertial()
        for f in s.forces:
            if not isinstance(f, CoordinateForce):
                self._between(W, f.name)
        efforts = self._efforts()
        for k, t in enumerate(s.terms):
            c = term_coefficient(result, k)
            effort = efforts[t.row - len(s.rows)] if t.measured else result.multipliers[:, t.row]
            if c != 0.0 and effort.any():
                self._term(W, k, c * effort)
        return W

    def _inertial(self) -> SimpleNamespace:
        """Return kinematics, and gravity minus the inertia forces of each body."""
        S, records = self._result.values.system, self._result.records
        W = SimpleNamespace(bodies=records.W.bodies, body_wrenches=zero_wrenches(records))
        gravity = gravity_over_time(self._result)
        for b in range(len(S.tree.parent)):
            _, R, w, _, alpha, a = records.body(b)
            store3(W.body_wrenches.force, b, 0, scale(S.bodies.mass[b], sub(gravity, a)))
            moment = euler_moment(load9(S.bodies.inertia, b, 0), mtv(R, w), mtv(R, alpha))
            store3(W.body_wrenches.torque, b, 0, neg(mv(R, moment)))
        return W

    def _between(self, W: SimpleNamespace, name: str) -> None:
        """Add the wrench of a force between frames: on M's body, with the reverse at the same point on F's."""
        (i, j), at, force, torque = self._result[name].acts()
        if j >= 0:
            apply_wrench(W, j, 1.0, force, torque, at)
        if i >= 0:
            apply_wrench(W, i, -1.0, force, torque, at)

    def _term(self, W: SimpleNamespace, k: int, effort: np.ndarray) -> None:
        """Add the wrench of a term of a row or of a measured quantity with an effort."""
        t = self._result.values.structure.terms[k]
        F, M, (_, force, torque_M, torque_F, _) = term_over_time(self._result, k)
        i, j = (int(self._result.values.system.frame_body[frame]) for frame in (t.F, t.M))
        if j >= 0:
            apply_wrench(W, j, effort, force, torque_M, M[0])
        if i >= 0:
            apply_wrench(W, i, effort, neg(force), torque_F, F[0])

    def _efforts(self) -> list[np.ndarray]:
        """Return the effort along every measured quantity: of forces, and of rows whose laws depend on it.

        The row of such a driver is q - f(t, s): along s it acts with -df/ds times its multiplier; that of an
        equation of a coupling is -f(t, s).
        """
        result, s = self._result, self._result.values.structure
        out = [result.records.zeros() for _ in s.measured]
        for f in s.forces:
            if isinstance(f, CoordinateForce):
                m, effort = result[f.name].pushes()
                out[m] = out[m] + effort
        for k, row in enumerate(s.rows):
            for slot in row.sensors:
                out[slot] = out[slot] - result.multipliers[:, k] * self.law_slope(row.law, slot)
        return out

    def law_slope(self, law: int, slot: int) -> np.ndarray:
        """Return the derivative of a row's law with respect to a sensor."""
        result, S = self._result, self._result.values.system
        sensed = result.measured.slots
        stack = np.zeros((result.values.structure.depth + 1 + STACK_RESERVE, 3), result.records.dtype)
        slopes = [
            evaluate_jet(S.code, S.const, law, stack, float(t), sensed[:, :, i], slot)[1]
            for i, t in enumerate(result.t)
        ]
        return np.array(slopes)


AppliedImpulse = tuple[Any, ...]
IMPULSE_COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")
"""Components of an impulse and of its moment in world axes."""
PLANAR_COMPONENTS = {"fx": "fx", "fy": "fy", "tz": "torque"}
"""Their names in the plane."""


class EventImpulses(Mapping):
    """Element -> its impulse.

    An element that acts along one coordinate (limits, ropes, friction, clutches, drivers, an event's ``Impulse`` along
    a coordinate) has a number [N s] or [N m s], and so has a coordinate that an event locks, by its name: it is part of
    the impulse of its joint. A coupling has such a number for each of its coordinates, by their names. A joint has six:
    force and torque about the joint's point on ``body_j``, on that body, world axes. A contact has ``normal``,
    ``friction`` (its magnitude), and ``fx``, ``fy``, ``fz``, the impulse on its second side, world axes. An event's
    ``Impulse`` on a body, by the name of the event, has ``fx`` to ``tz``, the moment about the body's centre of mass;
    in the plane ``fx``, ``fy`` and ``torque``.

    Parameters
    ----------
    own : mapping
        Impulses of elements that act along a coordinate.
    rows : ndarray
        Impulses of all rows, then of drivers that prescribe coordinates.
    blows : sequence
        Applied impulses: ``("body", row, force, torque about its centre of mass, event)``, or ``("along", measured
        quantity, impulse, event)``.
    """

    def __init__(
        self, along_coordinates: Mapping[str, float], rows: np.ndarray, applied: Sequence[AppliedImpulse] = ()
    ) -> None:
        self._own, self._rows, self._blows = dict(along_coordinates), rows, tuple(applied)
        self._moments: tuple[Moment, Moment] | None = None

    def bound(self, before: Moment, after: Moment) -> EventImpulses:
        """Return the impulses of all elements, computed with the states before and after."""
        made = EventImpulses(self._own, self._rows, self._blows)
        made._moments = before, after
        return made

    def loose(self) -> EventImpulses:
        """Return the impulses without the states of a result."""
        return EventImpulses(self._own, self._rows, self._blows)

    def as_plain_data(self) -> dict[str, Any]:
        """Return plain data: the arguments of the class."""
        return {"own": self._own, "rows": self._rows.tolist(), "blows": self._blows}

    def on(self, body: str) -> dict[str, np.ndarray]:
        """Return the impulse of each element on a body: their sum is the change of its momentum.

        Parameters
        ----------
        body : str

        Returns
        -------
        dict
            Element -> impulse [N s] and its moment about the body's centre of mass [N m s], world axes, (6,). Elements
            without effect on it are left out.

        Raises
        ------
        ModelError
            If there is no such body.
        """
        assert self._moments is not None
        places = self._moments[1].values.structure.place
        known = [name for name, b in places.items() if b >= 0]
        if body not in known:
            raise ModelError(f"impulses on a body: there is no body named {body!r}{suggest(body, known)}")
        found = {name: wrenches[places[body], :, 0] for name, wrenches in self._reactions.by_element.items()}
        return {name: x for name, x in found.items() if x.any()}

    @cached_property
    def _reactions(self) -> ImpulseReactions:
        """Return the impulses of all elements, computed on demand."""
        assert self._moments is not None
        return ImpulseReactions(*self._moments, self._rows, self._blows)

    @cached_property
    def _names(self) -> tuple[str, ...]:
        """Return all elements: joints and the like always, and limits, contacts and similar ones if they took part."""
        if self._moments is None:
            return tuple(self._own)
        s = self._moments[1].values.structure
        struck = {t.element.name for t in s.terms if not t.measured and self._rows[t.row] != 0.0}
        return (
            *self._own,
            *(f.name for f in s.model.forces if isinstance(f, Touch) and f.name in struck),
            *(j.name for j in s.model.joints if j.name in s.terms_of or j.name in s.tree_joints),
            *(x.name for x in (*s.model.couplings, *s.model.drivers) if x.name in s.slices),
            *applied_by_event(self._blows),
        )

    def __getitem__(self, name: str) -> Any:
        if name in self._own:
            return self._own[name]
        if name not in self._names:
            raise KeyError(name)
        blows = applied_by_event(self._blows)
        return (
            applied_impulse_value(blows[name], self._structure)
            if name in blows
            else self._reactions.event_impulse(name)
        )

    @property
    def _structure(self) -> Structure:
        assert self._moments is not None
        return self._moments[1].values.structure

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return repr(dict(self))

    def __getstate__(self) -> dict[str, Any]:
        """Return the state with the states before and after, which `on` needs; derived data are computed again."""
        return {k: getattr(self, k) for k in ("_own", "_rows", "_blows", "_moments")}


def sum_impulses(every: Sequence[EventImpulses]) -> EventImpulses:
    """Return the sum of impulses of consecutive jumps at one instant."""
    own: Counter[str] = Counter()
    for x in every:
        own.update(x._own)
    return EventImpulses(own, np.sum([x._rows for x in every], axis=0), tuple(b for x in every for b in x._blows))


def impulse_data(impulse: Any) -> Any:
    """Return the impulse of an element as plain data."""
    return dict(impulse) if isinstance(impulse, Mapping) else np.asarray(impulse).tolist()


def applied_by_event(applied: Sequence[AppliedImpulse]) -> dict[str, AppliedImpulse]:
    """Return applied impulses by the names of their events, numbered if an event has several."""
    count = Counter(b[-1] for b in applied)
    seen: Counter[str] = Counter()
    out = {}
    for b in applied:
        seen[b[-1]] += 1
        out[b[-1] if count[b[-1]] == 1 else f"{b[-1]}-{seen[b[-1]]}"] = b
    return out


def applied_impulse_value(applied: AppliedImpulse, s: Structure) -> Any:
    """Return an applied impulse in its reported form: a number along a coordinate, components on a body."""
    if applied[0] == "along":
        return float(applied[2])
    parts = dict(zip(IMPULSE_COMPONENTS, map(float, (*applied[2], *applied[3])), strict=True))
    return {PLANAR_COMPONENTS[k]: x for k, x in parts.items() if k in PLANAR_COMPONENTS} if s.model.planar else parts


class ImpulseReactions(JointReactions):
    """Reactions at an instant: impulses in place of forces."""

    def __init__(self, before: Moment, after: Moment, rows: np.ndarray, applied: Sequence[AppliedImpulse]) -> None:
        came, went = before.single_time_result, after.single_time_result
        made = type(came)(
            came.model, went.values, came.t, came.q, came.v, came.states, came.vdot, rows[None, :], came.health,
        )  # fmt: skip
        made.wound = came.wound
        super().__init__(made)
        self._after, self._blows = went, applied

    def event_impulse(self, name: str) -> Any:
        """Return the impulse of a contact, joint, coupling or driver; see `EventImpulses`."""
        result, s = self._result, self._result.values.structure
        e = s.model[name]
        if e.category == "joints":
            force, torque = self.of(name)
            return np.array([np.asarray(x, float).ravel()[0] for x in (*force, *torque)])
        if e.category == "couplings":
            return {text: float(result[name].effort(text)[0]) for text in e.coupled()}
        if isinstance(e, Touch):
            return self._of_contact(name)
        return float(result.multipliers[0, s.slices[name].start])

    def _of_contact(self, name: str) -> dict[str, float]:
        """Return the components of a contact's impulse; the first of its rows is the gap."""
        result, s = self._result, self._result.values.structure
        gap = s.slices[name].start
        force = {True: np.zeros(3), False: np.zeros(3)}
        for k in s.terms_of[name]:
            row = s.terms[k].row
            push = term_coefficient(result, k) * result.multipliers[0, row]
            force[row == gap] += [push * float(np.ravel(x)[0]) for x in term_over_time(result, k)[2][1]]
        parts = dict(zip(IMPULSE_COMPONENTS, (force[True] + force[False]).tolist(), strict=False))
        axes = {k: x for k, x in parts.items() if k in PLANAR_COMPONENTS or not s.model.planar}
        normal = float(result.multipliers[0, gap])
        return {"normal": normal, "friction": float(np.linalg.norm(force[False]))} | axes

    @cached_property
    def by_element(self) -> dict[str, np.ndarray]:
        """Return the effect of every element on every body: force, and torque about its centre of mass, (nb, 6, 1)."""
        result, s = self._result, self._result.values.structure
        out = dict(self._by_rows)
        for name, tree in s.tree_joints.items():
            W = self._onto(out, name)
            force, torque = load3(self.through.force, tree.child, 0), load3(self.through.torque, tree.child, 0)
            at, parent = load3(W.bodies.position, tree.child, 0), int(result.values.system.tree.parent[tree.links[0]])
            apply_wrench(W, tree.child, 1.0, force, torque, at)
            if parent >= 0:
                apply_wrench(W, parent, -1.0, force, torque, at)
        for driver in s.prescribed:  # the impulse through a joint includes that of its driver
            owner, what = s.model.coordinate(s.model[driver].coordinate, s.model[driver])
            force, torque = unit_effort_wrench(result, owner, what)
            effort = result.multipliers[:, s.slices[driver].start]
            F, M = (s.frame_at[owner.name, role, ""] for role in "FM")
            at = result.records.frame(M)[0]
            for name, sign in ((driver, 1.0), (owner.name, -1.0)):
                for frame, way in ((M, sign), (F, -sign)):
                    if (b := int(result.values.system.frame_body[frame])) >= 0:
                        apply_wrench(self._onto(out, name), b, way, scale(effort, force), scale(effort, torque), at)
        return out

    @cached_property
    def _by_rows(self) -> dict[str, np.ndarray]:
        """Return the same for rows and for applied impulses."""
        result, s = self._result, self._result.values.structure
        out: dict[str, np.ndarray] = {}
        for k, t in enumerate(s.terms):
            if not t.measured:
                self._push(out, reacting_element(t).name, k, result.multipliers[:, t.row])
        for row, x in enumerate(s.rows):  # rows whose laws depend on measured quantities
            for slot in x.sensors:
                self._along(out, x.element.name, slot, -result.multipliers[:, row] * self.law_slope(x.law, slot))
        for name, (kind, at, impulse, *more) in applied_by_event(self._blows).items():
            if kind == "along":
                self._along(out, name, at, impulse + result.records.zeros())
            elif at >= 0:
                W = self._onto(out, name)
                apply_wrench(W, at, 1.0, tuple(impulse), tuple(more[0]), load3(W.bodies.position, at, 0))
        return out

    def _onto(self, out: dict[str, np.ndarray], name: str) -> SimpleNamespace:
        """Return kinematics, and the accumulated effect of an element on the bodies."""
        records = self._result.records
        wrenches = out.setdefault(name, zero_wrenches(records))
        return SimpleNamespace(bodies=records.W.bodies, body_wrenches=wrenches)

    def _along(self, out: dict[str, np.ndarray], name: str, slot: int, effort: np.ndarray) -> None:
        """Add an impulse along a measured quantity."""
        s = self._result.values.structure
        for k, t in enumerate(s.terms):
            if t.measured and t.row - len(s.rows) == slot:
                self._push(out, name, k, effort)

    def _push(self, out: dict[str, np.ndarray], name: str, k: int, effort: np.ndarray) -> None:
        """Add an impulse along term k."""
        c = term_coefficient(self._result, k)
        if c != 0.0 and effort.any():
            self._term(self._onto(out, name), k, c * effort)

    def _inertial(self) -> SimpleNamespace:
        """Return kinematics, and the momentum that each body lost, about its centre of mass."""
        S, records = self._result.values.system, self._result.records
        W = SimpleNamespace(bodies=records.W.bodies, body_wrenches=zero_wrenches(records))
        for b in range(len(S.tree.parent)):
            _, R, w, v, _, _ = records.body(b)
            _, _, w_after, v_after, _, _ = self._after.records.body(b)
            store3(W.body_wrenches.force, b, 0, scale(S.bodies.mass[b], sub(v, v_after)))
            gained = mv(load9(S.bodies.inertia, b, 0), mtv(R, sub(w_after, w)))
            store3(W.body_wrenches.torque, b, 0, neg(mv(R, gained)))
        return W

    def _acting(self) -> SimpleNamespace:
        """Return the same with rows, applied impulses, and the momentum that rotors lost."""
        W = self._inertial()
        s, S = self._result.values.structure, self._result.values.system
        for rotor, d in s.rotors:
            lost = S.rotor_inertia[d] * (self._result.v[:, d] - self._after.v[:, d])
            for k, t in enumerate(s.terms):
                if t.measured and t.row - len(s.rows) == s.measured[rotor.coordinate]:
                    self._term(W, k, term_coefficient(self._result, k) * lost)
        for wrenches in self._by_rows.values():
            W.body_wrenches += wrenches
        return W
