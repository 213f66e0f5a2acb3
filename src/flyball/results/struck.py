"""Impulses of an instant by joint and element: those of rows as they were found, those of tree joints by a sweep.

The sweep is that of `reactions`, with jumps of velocities in place of accelerations: what a body's momentum changes by,
less what rows and given impulses do to it, its tree joint must have done. Gravity and finite forces have no part in it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..equations.loads import act
from ..math.vec import load3, load9, mtv, mv, neg, put3, scale, sub
from ..tables.system import INERTIA, MASS
from .reactions import Reactions
from .terms import coefficient

if TYPE_CHECKING:
    from .moment import Moment
    from .result import Result

Blow = tuple[Any, ...]


class Struck(Mapping):
    """Joint or element -> its impulse.

    Elements that act along a coordinate have one number [N s] or [N m s]; joints have six: force and torque about M's
    origin, on ``body_j``, world axes.

    Parameters
    ----------
    own : mapping
        Those of elements.
    rows : ndarray
        Impulses of all rows, then of drivers that prescribe coordinates.
    blows : sequence
        Impulses that were given: ``("body", row, force, torque about its centre of mass)``, or ``("along", measured
        quantity, impulse)``.
    """

    def __init__(self, own: Mapping[str, float], rows: np.ndarray, blows: tuple[Blow, ...] = ()) -> None:
        self._own, self._rows, self._blows = dict(own), rows, blows
        self._moments: tuple[Moment, Moment] | None = None
        self._joints: tuple[str, ...] = ()

    def bound(self, before: Moment, after: Moment) -> Struck:
        """With what joints carried, for which the states before and after are needed."""
        made = Struck(self._own, self._rows, self._blows)
        made._moments = before, after
        s = before.values.structure
        made._joints = tuple(j.name for j in s.model.joints if j.name in s.terms_of or j.name in s.tree_joints)
        return made

    def loose(self) -> Struck:
        """As it was found, without the states of its result."""
        return Struck(self._own, self._rows, self._blows)

    @cached_property
    def _reactions(self) -> Reactions:
        """What joints carried, found when first asked for."""
        assert self._moments is not None
        before, after = (m.alone for m in self._moments)
        return ImpulseReactions(before, after, self._rows, self._blows)

    def __getitem__(self, name: str) -> Any:
        if name in self._own:
            return self._own[name]
        if name not in self._joints:
            raise KeyError(name)
        force, torque = self._reactions.of(name)
        return np.array([np.asarray(x, float).ravel()[0] for x in (*force, *torque)])

    def __iter__(self) -> Iterator[str]:
        return iter((*self._own, *(j for j in self._joints if j not in self._own)))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __repr__(self) -> str:
        return repr(dict(self))

    def __reduce__(self) -> Any:
        return dict, (dict(self),)


class ImpulseReactions(Reactions):
    """Reactions of an instant: impulses in place of forces."""

    def __init__(self, before: Result, after: Result, rows: np.ndarray, blows: tuple[Blow, ...]) -> None:
        made = type(before)(
            before.model, before.values, before.t, before.q, before.v, before.states, before.vdot, rows[None, :],
            before.health,
        )  # fmt: skip
        made.wound = before.wound
        super().__init__(made)
        self._after, self._blows = after, blows

    def _inertial(self) -> SimpleNamespace:
        """Kinematics, and the momentum that each body lost, about its centre of mass."""
        S, records = self._result.values.system, self._result.records
        W = SimpleNamespace(BK=records.W.BK, FB=records.zeros(len(S.body_i), 6))
        for b in range(len(S.body_i)):
            _, R, w, v, _, _ = records.body(b)
            _, _, w_after, v_after, _, _ = self._after.records.body(b)
            put3(W.FB, b, 0, scale(S.body_x[b, MASS], sub(v, v_after)))
            put3(W.FB, b, 3, neg(mv(R, mv(load9(S.body_x, b, INERTIA), mtv(R, sub(w_after, w))))))
        return W

    def _acting(self) -> SimpleNamespace:
        """The same with rows and what was given."""
        result, s = self._result, self._result.values.structure
        W = self._inertial()
        given: dict[int, float] = {}
        for kind, slot, impulse, *_ in self._blows:
            if kind == "along":
                given[slot] = given.get(slot, 0.0) + impulse
        for k, t in enumerate(s.terms):
            c = coefficient(result, k)
            effort = result.multipliers[:, t.row] if not t.measured else result.records.zeros()
            if t.measured:
                effort = effort + given.get(t.row - len(s.rows), 0.0)
            if c != 0.0 and effort.any():
                self._term(W, k, c * effort)
        for kind, b, force, *torque in self._blows:
            if kind == "body" and b >= 0:
                act(W, b, 1.0, tuple(force), tuple(torque[0]), load3(W.BK, b, 0))
        return W
