"""What happens at an instant: what events ask for, velocities that jump, modes; until nothing is against its rule."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....constraints.modes import ONE_WAY, STOP
from ....numerics.cone.dense.problem import FOUND, NONE_FOUND
from ....tables.system import (
    G_BACK,
    G_CONE,
    G_CORNER,
    G_HOLDS,
    G_PRESS_LOWER,
    G_PRESS_UPPER,
    G_PULL,
    G_SLIDES,
    G_TURNS,
    HELD,
    OFF,
)
from .actions import act, act_at_start
from .branches import Corners
from .doubtful import doubt, shared, shock
from .failed import beyond, guard_names, no_end, no_forces, no_impulses, sunk
from .here import Here
from .instant import Instant, instant_of
from .jump import Jump, jump, must_jump
from .modes import Decided, come_to_rest, decide
from .parts import at_rest, of_velocities, sides
from .rest import coming_to_rest, note_bounces, settle_down
from .sides import pressed, teeth, turned
from .slips import stop_slips
from .told import tell_jump, tell_modes

ROUNDS = 100
AGAIN = 5  # times that ways of sliding are decided again for the same modes
RATES = (G_SLIDES, G_BACK, G_TURNS, G_PRESS_LOWER, G_PRESS_UPPER)  # guards of rates, or whose meaning they decide
HOLDING = (G_PULL, G_HOLDS, G_CONE)  # guards of what holds, by the forces that it carries
BROKEN = 1e-8  # of the forces that a force is the difference of: beyond what rounding makes
VIOLATED = 1e-9  # of the mechanism's length or a radian, of rates at its own rate: a start beyond its limit
SUNK = 1e-7  # of the same: what is open and past its bound has gone through it


def begin(here: Here) -> None:
    """As the motion begins: what is kicked, closed, stuck or slides there.

    Raises
    ------
    ModelError
        If a limit starts violated.
    """
    s = here.structure
    if here.start.before is None and not (s.switches or s.events or s.model.events):
        return
    acts = act_at_start(here)
    if len(here.c.system.switches.row) or here.kick is not None:
        n = instant_of(here)
        corners = Corners(n)
        corners.begin()
        n.look()
        n.restored()
        put_apart(n)
        refuse_violated(n)
        settled(n, corners, np.zeros(0, np.int64), told=False)
    acts.told(["start"])
    _happen(here, acts.passed())


def happen(here: Here, fired: Sequence[int]) -> None:
    """Where guards fired.

    Parameters
    ----------
    here : Here
    fired : sequence of int
        Rows of `System.guard_i`.

    Raises
    ------
    SimulationError
        If no forces or impulses go with all that is asked, or there is no end of it.
    """
    _happen(here, np.array(fired, np.int64))


def _happen(here: Here, fired: np.ndarray) -> None:
    """Events, jumps and modes, as long as expressions of events pass zero by what was done."""
    for _ in range(ROUNDS if len(fired) else 0):
        acts = act(here, fired.tolist())
        if len(here.c.system.switches.row) or here.kick is not None:
            n = instant_of(here)
            settled(n, Corners(n), fired)
        acts.told(["start"])
        fired = acts.passed()
        here.acted.clear()  # what follows from it comes later
        if not len(fired) or here.stopped:
            return
    if len(fired):
        raise no_end(here.t, guard_names(instant_of(here), fired.tolist()), ROUNDS)


def settled(n: Instant, corners: Corners, fired: np.ndarray, told: bool = True) -> None:
    """Jumps and modes, and the sides of laws' corners: each by what the others are, until they agree."""
    corners.fired(fired)
    by_rows = [g for g in fired.tolist() if n.guarded[g][0] != G_CORNER]
    if not len(fired) or by_rows:
        resolve(n, np.array(by_rows, np.int64), told)
    let_go = np.array([g for g in by_rows if n.guarded[g][0] in HOLDING], np.int64)
    for _ in range(ROUNDS):
        if not corners.settle() or not n.decided:
            return
        resolve(n, let_go, told)
    raise no_end(n.here.t, [n.name(s) for s in sorted(corners.at)], ROUNDS)


def refuse_violated(n: Instant) -> None:
    """Refuse a start beyond a limit."""
    for s, kind in enumerate(n.kinds):
        lower, upper = n.W.modes.lower[s], n.W.modes.upper[s]
        back = -n.rate[s] / n.tempo if kind == ONE_WAY else 0.0
        past = max(lower - n.x[s], n.x[s] - upper) if kind == STOP else back
        if past > VIOLATED * n.unit[s]:
            raise beyond(n, s)


def refuse_sunk(n: Instant) -> None:
    """Refuse to go on from where what is open is past its bound, by more than what is closed may be."""
    for s in n.of(STOP):
        past = max(n.W.modes.lower[s] - n.x[s], n.x[s] - n.W.modes.upper[s])
        if n.mode[s] == OFF and past > SUNK * n.unit[s] + n.W.options.position_tolerance:
            raise sunk(n, s, past)


def resolve(n: Instant, fired: np.ndarray, told: bool = True) -> None:
    """Jumps and modes at the instant, until nothing is against its rule; those that a motion begins in are no news."""
    here = n.here
    before, modes, ways = here.y.copy(), n.W.modes.mode.copy(), n.ways().copy()
    since = before  # the last jump that was recorded
    hits: dict[int, bool] = {}
    calm: list[int] = []
    gone: list[int] = []  # guards of what was held and could not hold
    again = 0
    for _ in range(ROUNDS):
        n.look()
        refuse_sunk(n)
        stop_slips(n, fired)
        still = at_rest(n, fired)
        still[calm] = True
        teeth(n, still)
        at = sides(n, fired)
        rate = n.rate.copy()
        jumped = jumps(n, at, still)
        if jumped is None:
            still |= n.mode != OFF
        else:
            hits |= {s: s in jumped.even for s in jumped.closing if s not in here.astray}
            fired = unmoved(n, fired, rate)
            still = at_rest(n, fired)
            still[list(jumped.even)] = True
        pressed(n, fired, ways)
        found = decided(n, at, still, fired, jumped)
        if isinstance(found, Jump):  # no accelerations: velocities have jumped, all is looked at again
            tell_jump(n, found, since)
            since = here.y.copy()
            n.look_again()
            fired, calm = unmoved(n, fired, rate), list(found.even)
            continue
        turned(n, hits)
        come_to_rest(n, found)
        n.arrive()
        if jumped is not None and (jumped.blows or jumped.given or not jumped.closing.keys() <= here.astray):
            tell_jump(n, jumped, since)
            since = here.y.copy()
        guards = n.guards()
        if again < AGAIN and misled(n, guards):
            n.look_again()
            again += 1
            continue
        against = broken(n, found, guards)
        new = [g for g in against if g not in gone]
        if not new:
            if against:  # it was let go, and is held again: by other shares than the least
                shared(n, against)
            if told:
                tell_modes(n, (modes, ways), before, hits)
            return
        fired, gone = np.array([*fired, *new], np.int64), [*gone, *new]
    raise no_end(here.t, guard_names(n, fired.tolist()), ROUNDS)


def misled(n: Instant, guards: np.ndarray) -> bool:
    """Whether something slides against its way: where bounces are cut off, what they were changes other rates too."""
    sliding = ((g, s) for g, (kind, s, _) in enumerate(n.guarded) if kind in (G_SLIDES, G_TURNS))
    return any(guards[g] < -n.still[s] for g, s in sliding)


def unmoved(n: Instant, fired: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Guards that fired, without those of rates that were something else before a jump."""
    other = np.abs(n.rate - rate) > n.still
    return np.array([g for g in fired.tolist() if n.guarded[g][0] not in RATES or not other[n.guarded[g][1]]], np.int64)


def jumps(n: Instant, at: dict[int, tuple[float, ...]], still: np.ndarray) -> Jump | None:
    """The jump of velocities, if there is one; ``n`` has looked where it leads."""
    here = n.here
    parts = of_velocities(n, at, still)
    kick, here.kick = here.kick, None
    blows, here.blows = tuple(here.blows), []
    if kick is None and not must_jump(n, parts, n.rate):
        return None
    jumped = jump(n, parts, kick)
    jumped.blows = blows
    if jumped.ended != FOUND:
        n.restored()
        raise no_impulses(n, parts)
    here.lost, here.given, here.fresh = here.lost + jumped.lost, here.given + jumped.given, True
    n.look_again()
    note_bounces(n, jumped)
    return jumped


def decided(
    n: Instant, at: dict[int, tuple[float, ...]], still: np.ndarray, fired: np.ndarray, jumped: Jump | None
) -> Decided | Jump:
    """Modes; a series of bounces that has become shorter than rounding is over.

    Where there are no accelerations velocities may jump without a collision.
    """
    found = decide(n, at, still, fired)
    if found.ended == FOUND and (over := coming_to_rest(n, at, still)).any():
        still |= over
        settle_down(n, np.flatnonzero(over).tolist(), still, jumped)
        found = decide(n, at, still, fired)
    if found.ended == FOUND:
        doubt(n, found)
        return found
    blow = (
        shock(n, of_velocities(n, at, still), np.abs(found.reach).max(initial=0.0))
        if found.ended == NONE_FOUND
        else None
    )
    if blow is None:
        n.restored()
        raise no_forces(n, found)
    n.here.lost, n.here.fresh = n.here.lost + blow.lost, True
    return blow


def broken(n: Instant, found: Decided, guards: np.ndarray) -> list[int]:
    """Guards of what holds that say that it cannot, beyond rounding."""
    out = [
        k
        for k, (kind, s, _) in enumerate(n.guarded)
        if kind in HOLDING and s in found.sizes and guards[k] < -BROKEN * found.sizes[s] - found.least[s]
    ]
    last = len(guards) - 1
    if n.shares and guards[last] < -BROKEN * n.here.group.size[0]:
        out.append(last)
    return out


# Overlaps of rounding size at the start: bodies are put side by side, as assembly closes joints.


SLIGHT = 1e-5  # of the mechanism's length, or of a radian: as positions are rounded in a description
TOLD = 1e-7  # of the same: worth a word


def put_apart(n: Instant) -> None:
    """Take overlaps up to `SLIGHT` away, of contacts, stops and ropes; velocities stay."""
    over = {}
    for s in np.flatnonzero(n.kind == STOP).tolist():
        lower, upper = n.W.modes.lower[s], n.W.modes.upper[s]
        for side, depth in ((lower, lower - n.x[s]), (upper, n.x[s] - upper)):
            if n.near[s] < depth <= SLIGHT * n.unit[s]:
                over[s] = side, depth
    if not over:
        return
    y, modes, hold = n.here.y.copy(), n.W.modes.mode.copy(), n.W.modes.hold.copy()
    for s, (side, _) in over.items():
        n.W.modes.mode[s], n.W.modes.hold[s] = HELD, side
    n.arrive()
    n.W.modes.mode[:], n.W.modes.hold[:] = modes, hold
    n.here.v[:] = y[n.here.structure.nq : n.here.structure.nq + n.here.structure.nv]
    n.arrive()  # velocities on the rows of joints, where they are now
    n.look()
    n.restored()
    told = {s: x for s, (_, x) in over.items() if x > TOLD * n.unit[s]}
    if told:
        most = max(told, key=lambda s: told[s])
        n.here.doubts.append(
            f"the start overlaps by up to {told[most]:.2g} ({n.name(most)}); what is there was moved by as much"
        )
