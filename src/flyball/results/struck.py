"""Impulses of an instant by element: those of rows as they were found, those of tree joints by a sweep.

The sweep is that of `reactions`, with jumps of velocities in place of accelerations: what a body's momentum changes by,
less what rows and given impulses do to it, its tree joint must have done. Gravity and finite forces have no part in it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..equations.loads import act
from ..errors import ModelError
from ..math.vec import load3, load9, mtv, mv, neg, put3, scale, sub
from ..model.touch import Touch
from ..model.words import suggest
from ..tables.terms import carrier
from .reactions import Reactions
from .terms import along, coefficient, term

if TYPE_CHECKING:
    from ..tables.specs import Structure
    from .moment import Moment

Blow = tuple[Any, ...]
COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")
"""Components of an impulse and of its moment along the world's axes."""
IN_THE_PLANE = {"fx": "fx", "fy": "fy", "tz": "torque"}
"""Those of them that there are in the plane, and what they are called there."""


class Struck(Mapping):
    """Element -> its impulse.

    What acts along one coordinate (limits, ropes, friction, clutches, drivers, an event's ``Impulse`` along a
    coordinate) has a number [N s] or [N m s], and so has a coordinate that an event locks, by its name: it is part of
    what its joint carries. A coupling has such a number for each of its coordinates, by their names. A joint has six:
    force and torque about the joint's point on ``body_j``, on that body, world axes. A contact has ``normal``,
    ``friction`` (its magnitude), and ``fx``, ``fy``, ``fz``, the impulse on its second side, world axes. An event's
    ``Impulse`` on a body, by the name of the event, has ``fx`` to ``tz``, the moment about the body's centre of mass;
    in the plane ``fx``, ``fy`` and ``torque``.

    Parameters
    ----------
    own : mapping
        Those of elements that act along a coordinate.
    rows : ndarray
        Impulses of all rows, then of drivers that prescribe coordinates.
    blows : sequence
        Impulses that were given: ``("body", row, force, torque about its centre of mass, event)``, or ``("along",
        measured quantity, impulse, event)``.
    """

    def __init__(self, own: Mapping[str, float], rows: np.ndarray, blows: Sequence[Blow] = ()) -> None:
        self._own, self._rows, self._blows = dict(own), rows, tuple(blows)
        self._moments: tuple[Moment, Moment] | None = None

    def bound(self, before: Moment, after: Moment) -> Struck:
        """With all elements, for which the states before and after are needed."""
        made = Struck(self._own, self._rows, self._blows)
        made._moments = before, after
        return made

    def loose(self) -> Struck:
        """As it was found, without the states of its result."""
        return Struck(self._own, self._rows, self._blows)

    def plain(self) -> dict[str, Any]:
        """What it is made of, as plain data: arguments of the class."""
        return {"own": self._own, "rows": self._rows.tolist(), "blows": self._blows}

    def on(self, body: str) -> dict[str, np.ndarray]:
        """What each element did to a body: their sum is the change of its momentum.

        Parameters
        ----------
        body : str

        Returns
        -------
        dict
            Element -> impulse [N s] and its moment about the body's centre of mass [N m s], world axes, (6,). Elements
            that did nothing to it are left out.

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
        """What everything carried, found when first asked for."""
        assert self._moments is not None
        return ImpulseReactions(*self._moments, self._rows, self._blows)

    @cached_property
    def _names(self) -> tuple[str, ...]:
        """All elements: those that are always told, and of limits, contacts and their like those that took part."""
        if self._moments is None:
            return tuple(self._own)
        s = self._moments[1].values.structure
        struck = {t.element.name for t in s.terms if not t.measured and self._rows[t.row] != 0.0}
        return (
            *self._own,
            *(f.name for f in s.model.forces if isinstance(f, Touch) and f.name in struck),
            *(j.name for j in s.model.joints if j.name in s.terms_of or j.name in s.tree_joints),
            *(x.name for x in (*s.model.couplings, *s.model.drivers) if x.name in s.slices),
            *given(self._blows),
        )

    def __getitem__(self, name: str) -> Any:
        if name in self._own:
            return self._own[name]
        if name not in self._names:
            raise KeyError(name)
        blows = given(self._blows)
        return blow_of(blows[name], self._structure) if name in blows else self._reactions.told(name)

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
        """With the states before and after, which `on` needs; what was made of them is made again."""
        return {k: getattr(self, k) for k in ("_own", "_rows", "_blows", "_moments")}


def summed(every: Sequence[Struck]) -> Struck:
    """The impulses of jumps that follow one another at an instant, as those of one."""
    own: Counter[str] = Counter()
    for x in every:
        own.update(x._own)
    return Struck(own, np.sum([x._rows for x in every], axis=0), tuple(b for x in every for b in x._blows))


def plain(impulse: Any) -> Any:
    """An impulse of an element as plain data."""
    return dict(impulse) if isinstance(impulse, Mapping) else np.asarray(impulse).tolist()


def given(blows: Sequence[Blow]) -> dict[str, Blow]:
    """Blows by the names of their events, numbered where an event has several."""
    count = Counter(b[-1] for b in blows)
    seen: Counter[str] = Counter()
    out = {}
    for b in blows:
        seen[b[-1]] += 1
        out[b[-1] if count[b[-1]] == 1 else f"{b[-1]}-{seen[b[-1]]}"] = b
    return out


def blow_of(blow: Blow, s: Structure) -> Any:
    """A blow as it is told: a number along a coordinate, components of one on a body."""
    if blow[0] == "along":
        return float(blow[2])
    parts = dict(zip(COMPONENTS, map(float, (*blow[2], *blow[3])), strict=True))
    return {IN_THE_PLANE[k]: x for k, x in parts.items() if k in IN_THE_PLANE} if s.model.planar else parts


class ImpulseReactions(Reactions):
    """Reactions of an instant: impulses in place of forces."""

    def __init__(self, before: Moment, after: Moment, rows: np.ndarray, blows: Sequence[Blow]) -> None:
        came, went = before.alone, after.alone
        made = type(came)(
            came.model, went.values, came.t, came.q, came.v, came.states, came.vdot, rows[None, :], came.health,
        )  # fmt: skip
        made.wound = came.wound
        super().__init__(made)
        self._after, self._blows = went, blows

    def told(self, name: str) -> Any:
        """The impulse of a contact, joint, coupling or driver; see `Struck`."""
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
        """Its components; the first of its rows is the gap."""
        result, s = self._result, self._result.values.structure
        gap = s.slices[name].start
        force = {True: np.zeros(3), False: np.zeros(3)}
        for k in s.terms_of[name]:
            row = s.terms[k].row
            push = coefficient(result, k) * result.multipliers[0, row]
            force[row == gap] += [push * float(np.ravel(x)[0]) for x in term(result, k)[2][1]]
        parts = dict(zip(COMPONENTS, (force[True] + force[False]).tolist(), strict=False))
        axes = {k: x for k, x in parts.items() if k in IN_THE_PLANE or not s.model.planar}
        normal = float(result.multipliers[0, gap])
        return {"normal": normal, "friction": float(np.linalg.norm(force[False]))} | axes

    @cached_property
    def by_element(self) -> dict[str, np.ndarray]:
        """What every element does to every body: force, and torque about its centre of mass, (nb, 6, 1)."""
        result, s = self._result, self._result.values.structure
        out = dict(self._by_rows)
        for name, tree in s.tree_joints.items():
            W = self._onto(out, name)
            force, torque = load3(self.through, tree.child, 0), load3(self.through, tree.child, 3)
            at, parent = load3(W.BK, tree.child, 0), int(result.values.system.tree.parent[tree.links[0]])
            act(W, tree.child, 1.0, force, torque, at)
            if parent >= 0:
                act(W, parent, -1.0, force, torque, at)
        for driver in s.prescribed:  # what passes through a joint is in part what its driver does
            owner, what = s.model.coordinate(s.model[driver].coordinate, s.model[driver])
            force, torque = along(result, owner, what)
            effort = result.multipliers[:, s.slices[driver].start]
            F, M = (s.frame_at[owner.name, role, ""] for role in "FM")
            at = result.records.frame(M)[0]
            for name, sign in ((driver, 1.0), (owner.name, -1.0)):
                for frame, way in ((M, sign), (F, -sign)):
                    if (b := int(result.values.system.frame_body[frame])) >= 0:
                        act(self._onto(out, name), b, way, scale(effort, force), scale(effort, torque), at)
        return out

    @cached_property
    def _by_rows(self) -> dict[str, np.ndarray]:
        """The same of rows and of what was given."""
        result, s = self._result, self._result.values.structure
        out: dict[str, np.ndarray] = {}
        for k, t in enumerate(s.terms):
            if not t.measured:
                self._push(out, carrier(t).name, k, result.multipliers[:, t.row])
        for row, x in enumerate(s.rows):  # drivers whose laws follow what is measured
            for slot in x.sensors:
                self._along(out, x.element.name, slot, -result.multipliers[:, row] * self._slope(x.law, slot))
        for name, (kind, at, impulse, *more) in given(self._blows).items():
            if kind == "along":
                self._along(out, name, at, impulse + result.records.zeros())
            elif at >= 0:
                W = self._onto(out, name)
                act(W, at, 1.0, tuple(impulse), tuple(more[0]), load3(W.BK, at, 0))
        return out

    def _onto(self, out: dict[str, np.ndarray], name: str) -> SimpleNamespace:
        """Kinematics, and what an element does to the bodies so far, to be added to."""
        records = self._result.records
        FB = out.setdefault(name, records.zeros(len(self._result.values.system.tree.parent), 6))
        return SimpleNamespace(BK=records.W.BK, FB=FB)

    def _along(self, out: dict[str, np.ndarray], name: str, slot: int, effort: np.ndarray) -> None:
        """An impulse along a measured quantity."""
        s = self._result.values.structure
        for k, t in enumerate(s.terms):
            if t.measured and t.row - len(s.rows) == slot:
                self._push(out, name, k, effort)

    def _push(self, out: dict[str, np.ndarray], name: str, k: int, effort: np.ndarray) -> None:
        """An impulse along term k."""
        c = coefficient(self._result, k)
        if c != 0.0 and effort.any():
            self._term(self._onto(out, name), k, c * effort)

    def _inertial(self) -> SimpleNamespace:
        """Kinematics, and the momentum that each body lost, about its centre of mass."""
        S, records = self._result.values.system, self._result.records
        W = SimpleNamespace(BK=records.W.BK, FB=records.zeros(len(S.tree.parent), 6))
        for b in range(len(S.tree.parent)):
            _, R, w, v, _, _ = records.body(b)
            _, _, w_after, v_after, _, _ = self._after.records.body(b)
            put3(W.FB, b, 0, scale(S.bodies.mass[b], sub(v, v_after)))
            put3(W.FB, b, 3, neg(mv(R, mv(load9(S.bodies.inertia, b, 0), mtv(R, sub(w_after, w))))))
        return W

    def _acting(self) -> SimpleNamespace:
        """The same with rows and what was given."""
        W = self._inertial()
        for wrenches in self._by_rows.values():
            W.FB += wrenches
        return W
