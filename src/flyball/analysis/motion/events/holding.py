"""Locking and releasing: modes of rows. What velocities do then is decided with everything else at the instant."""

from __future__ import annotations

import numpy as np

from ....constraints.modes import ELASTIC, FROZEN, LOCK
from ....errors import SimulationError
from ....model.actions import Lock, Release
from ....model.event import Event
from ....model.held import held_by
from ....results.result import Result
from ....tables.system import (
    HELD,
    OFF,
    VALUE,
)
from .here import Here

CLOSED = 1e-6  # of the mechanism's length, or a radian: a joint that is let go holds again where it is closed
GONE = 1.0  # in `Modes.released`: an element that was released; whatever it does, it does not


def hold(here: Here, e: Event, a: Lock) -> str:
    """Hold coordinates where they are, a joint where it is closed, or have a limit or rope in force again.

    Raises
    ------
    SimulationError
        If the joint is open.
    """
    W, S = here.c.work, here.c.system
    held = held_by(here.structure.model, e, a)
    for k in switches(here, held.coordinates, held.joint, held.element):
        if held.element:
            W.modes.released[k] = 0.0
            W.modes.lower[k], W.modes.upper[k] = S.switch_numbers.lower[k], S.switch_numbers.upper[k]
            here.given += stored(here, k)
            continue
        x = W.sensed[VALUE, S.switches.measured[k]]
        if held.joint and abs(x) > CLOSED * here.c.values.length:
            raise SimulationError(
                f"at t = {here.t:.9g} s {a.title} in {e.title}: it is open by {abs(x):.3g}, and holds again only where "
                f"its bodies meet; let the event be where they do",
                t=here.t,
            )
        if W.modes.mode[k] == OFF:
            W.modes.hold[k] = 0.0 if held.joint else x
        W.modes.mode[k] = HELD
    return f"{a.what} is in force" if held.element else f"locked {a.what}"


def let_go(here: Here, e: Event, a: Release) -> str:
    """Let coordinates, a joint, a limit or a rope go."""
    W = here.c.work
    ways = W.sensed[VALUE, W.sensed.shape[1] - W.modes.mode.shape[0] :]
    held, kinds = held_by(here.structure.model, e, a), here.c.system.switches.kind
    every = switches(here, held.coordinates, held.joint, held.element)
    if not any(W.modes.released[k] == 0.0 if held.element else W.modes.mode[k] != OFF for k in every):
        return f"{a.what} was {'released already' if held.element else 'not locked'}"
    for k in every:
        if held.element:
            here.given -= stored(here, k)
        W.modes.mode[k], ways[k] = OFF, FROZEN if kinds[k] == ELASTIC else 0.0
        if held.element:
            W.modes.released[k], W.modes.lower[k], W.modes.upper[k] = GONE, -np.inf, np.inf
    return f"released {a.what}"


def stored(here: Here, k: int) -> float:
    """Energy [J] in an elastic switch at the state last evaluated; it goes when that is released."""
    S, W = here.c.system, here.c.work
    if S.switches.kind[k] != ELASTIC:
        return 0.0
    x = W.sensed[VALUE, S.switches.measured[k]]
    depth = max(W.modes.lower[k] - x, x - W.modes.upper[k], 0.0)
    return float(0.5 * S.switch_numbers.stiffness[k] * depth**2)


def switches(here: Here, coordinates: tuple[str, ...], joint: str, element: str) -> list[int]:
    """Numbers of the rows that hold these coordinates, or are those of a joint or element."""
    kinds = here.c.system.switches.kind
    out = []
    for k, spec in enumerate(here.structure.switches):
        own = isinstance(spec.element, Event)
        if (own and spec.switch.label in coordinates) or (
            not own and spec.element.name == (joint or element) and (kinds[k] == LOCK) == bool(joint)
        ):
            out.append(k)
    return out


def gone_on(here: Here, before: Result) -> None:
    """Lock and release as an earlier motion ended."""
    stretches = getattr(before, "stretches", None)
    if stretches is None or not stretches.all:
        return
    last, W = stretches.all[-1], here.c.work
    old = {(x.element.name, x.switch.label): k for k, x in enumerate(last.values.structure.switches)}
    for k, spec in enumerate(here.structure.switches):
        j = old.get((spec.element.name, spec.switch.label))
        if j is None:
            continue
        if spec.switch.kind == LOCK:
            W.modes.mode[k], W.modes.hold[k] = last.modes.mode[j], last.modes.hold[j]
        elif last.modes.released[j] == GONE:
            W.modes.released[k], W.modes.lower[k], W.modes.upper[k] = GONE, -np.inf, np.inf
            W.sensed[VALUE, W.sensed.shape[1] - W.modes.mode.shape[0] + k] = (
                FROZEN if spec.switch.kind == ELASTIC else 0.0
            )
