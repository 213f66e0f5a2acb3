"""What holds a mechanism where it is, as constraints: reached stops, what sticks, taut ropes, latches.

What may push one way only has a sign, what sticks bears so much and no more. Which of them hold is decided by the
forces (`forces.carried`), as it is of contacts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...constraints.modes import FRICTION, LOCK, ONE_WAY, RATCHET, STATIC, STOP
from ...equations.engine import MOTION
from ...equations.loads import wide
from ...equations.records import load as record
from ...errors import ModelError
from ...joints.coupler import Coupler
from ...laws.call import STACK_RESERVE
from ...laws.evaluation import evaluate
from ...model.element import Element, element
from ...model.model import Model
from ...model.switch import Switch
from ...results.result import Result
from ...tables.specs import FrameSpec
from ...tables.system import VALUE
from ...tables.values import Values
from ..assembly.start import Assembly
from ..compiled import compiled
from ..linear.curves import snapshot
from ..linear.derivatives import State
from ..linear.rest import Rest
from ..untouched import holding_parts
from .closed import CLOSED, Place
from .forces import Carried, carried
from .joints import Centres

LOADS, SETTLED = 30, 1e-10  # rounds for friction that follows its load, and a part of it that is no change
BOTH = 0.0
"""Sign of what may push either way."""


@element
class Held(Coupler):
    """One coordinate or more, whose weighted sum is held where it is."""

    def check(self, n: Any) -> None:
        """Whatever it was made of was checked."""


@dataclass
class Holds:
    """What holds a mechanism somewhere.

    Attributes
    ----------
    parts : tuple of Element
        The constraints that stand for what holds, by the names of these.
    signs : dict
        Name -> +1 if it may push its quantity up only, -1 down, 0 either way.
    sticks : dict
        Those of friction: name -> the element.
    """

    parts: list[Element] = field(default_factory=list)
    signs: dict[str, float] = field(default_factory=dict)
    sticks: dict[str, Element] = field(default_factory=dict)


def holds(model: Model, at: Assembly) -> Holds:
    """What may hold a mechanism at rest at a place, as constraints.

    Raises
    ------
    ModelError
        If something holds that has no constraint here.
    """
    out = Holds()
    parts = [e for e in holding_parts(model) if e.switches()]
    if not parts:
        return out
    c = compiled(model, parameters=at.compiled.parameters, switches=True)
    q, v = c.take(at.compiled, at.t, at.q, 0.0 * at.v)
    c.at(at.t, q, v)
    S = c.values.system
    for k, x in enumerate(c.structure.switches):
        value = float(c.work.sensed[VALUE, x.measured])
        size = 1.0 if _turns(model, x.element, x.switch) else c.values.length
        lower, upper = float(S.switch_numbers.lower[k]), float(S.switch_numbers.upper[k])
        sign = _sign(x.switch.kind, value, lower, upper, CLOSED * size)
        if sign is not None:
            out.parts.append(constraint(x.element, x.switch, c.values, value))
            out.signs[x.element.name] = sign
            if x.switch.kind == FRICTION:
                out.sticks[x.element.name] = x.element
    return out


def _turns(model: Model, e: Element, w: Switch) -> bool:
    return bool(w.along) and model.unit(w.along[0], e) == "rad"


def _sign(kind: int, x: float, lower: float, upper: float, near: float) -> float | None:
    """Which way a switch may push at rest; None if it is open."""
    if kind == STOP:
        return 1.0 if abs(x - lower) <= near else -1.0 if abs(x - upper) <= near else None
    if kind == RATCHET:  # a tooth, and the pitch
        return 1.0 if abs(x - lower - upper * round((x - lower) / upper)) <= near else None
    return {FRICTION: BOTH, LOCK: None, ONE_WAY: 1.0}.get(kind)


def constraint(e: Any, w: Switch, x: Values, value: float) -> Element:
    """The constraint that holds a switch's quantity where it is."""
    if w.along:
        weights = e.switch_weights(x.numbers[e.name], w.label) if w.summed else (1.0,)
        return Held(e.name, w.along, weights=tuple(float(np.real(x)) for x in weights), value=value)
    if len(w.path) == 1:
        ends = [x.poses.world(FrameSpec(0, e, role)) for role in e.ends()]
        frames = [tuple(np.real(np.r_[p, np.ravel(R)]).tolist()) for p, R, _ in ends]
        at = frames[0][: 2 if x.structure.model.planar else 3]
        return Centres(e.name, *e.bodies, at=at, frames=(frames[0], frames[1]), radii=(0.0, value))
    more = len(w.path) - 1
    points = "a point" if more == 1 else f"{more} points"
    raise ModelError(
        f"{e.title} is taut, and runs over {points} between its ends: nothing here holds the sum of its parts. "
        f"Give it a stiffness"
    )


def capacity(model: Model, at: Assembly, e: Any, reaction: Callable[[str], tuple]) -> float:
    """The most that something sticks with at rest [N] or [N m]; ``reaction`` of a joint: force and torque, (3,)."""
    c = compiled(model, parameters=at.compiled.parameters)
    q, v = c.take(at.compiled, at.t, at.q, 0.0 * at.v)
    c.at(at.t, q, v, MOTION)
    s, S, W = c.structure, c.values.system, c.work
    k = next(i for i, f in enumerate(s.forces) if f is e)
    par, first = wide(S.force_parameters, k), int(S.forces.laws[k, 0])
    x, load, law = float(W.sensed[VALUE, S.forces.F[k]]), 0.0, 0.0
    if S.forces.load[k] >= 0:
        load = float(e.load(par, record(W.FK, int(S.forces.M[k])), *reaction(e.joint)))
    if first >= 0:
        stack = np.zeros((s.depth + 1 + STACK_RESERVE, 3))
        law = float(evaluate(S.code, S.const, first, stack, (at.t, x, 0.0), W.sensed))
    return abs(float(e.effort(par, x, 0.0, (law, 0.0, STATIC), load)))


def supported(model: Model, place: Place, x: Rest, held: Holds) -> tuple[Carried, dict[str, float]]:
    """What carries a mechanism at rest, and the most that each part that sticks bears under these loads."""
    found, bears = carried(place, x, held.signs), dict[str, float]()
    for _ in range(LOADS):
        result = snapshot(State.resting(x.c, x.t, x.q, found.lam))
        before, bears = bears, {k: capacity(model, place.at, e, _reactions(result)) for k, e in held.sticks.items()}
        if all(abs(b - before.get(k, np.inf)) <= SETTLED * b for k, b in bears.items()):
            break
        found = carried(place, x, held.signs, bears)
    return found, bears


def _reactions(result: Result) -> Callable[[str], tuple]:
    """A joint's force and torque at the one time of a result."""

    def of(joint: str) -> tuple:
        return tuple(tuple(float(np.ravel(x)[0]) for x in part) for part in result.reactions.of(joint))

    return of
