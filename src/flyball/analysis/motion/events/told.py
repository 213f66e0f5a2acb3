"""What happened at an instant, in words, into the records of a motion."""

from __future__ import annotations

import numpy as np

from ....constraints.modes import BY_RATE, ELASTIC, FRICTION, FROZEN, LOCK, ONE_WAY, RATCHET, SLIP, STOP
from ....model.joint import Joint
from ....model.touch import Touch
from ....results.events import Happening
from ....results.struck import Struck
from ....tables.system import OFF
from .instant import Instant
from .jump import Jump

NOISE = 1e-14  # of the energy that a motion is about, or that passes in an impact: as good as nothing lost
HELD_WORDS = {
    STOP: ("close", "closes"),
    FRICTION: ("stick", "sticks"),
    SLIP: ("stick", "sticks"),
    ONE_WAY: ("lock", "locks"),
    LOCK: ("lock", ""),
    RATCHET: ("latch", "latches"),
    ELASTIC: ("close", "is pressed"),
}
FREE_WORDS = {
    STOP: ("open", "opens"),
    FRICTION: ("slip", "slides"),
    SLIP: ("slip", "slides"),
    ONE_WAY: ("overrun", "overruns"),
    LOCK: ("", ""),
    RATCHET: ("unlatch", "lets go"),
    ELASTIC: ("open", "lets go"),
}
ROPE_WORDS = {"close": ("taut", "goes taut"), "open": ("slack", "goes slack")}
PLACE_WORDS = {"close": ("touch", "touches"), "open": ("part", "parts")}


def words(n: Instant, s: int, held: bool) -> tuple[str, str]:
    """Kind and words of what switch s did."""
    kind, said = (HELD_WORDS if held else FREE_WORDS).get(int(n.kind[s]), ("", ""))
    if n.here.structure.switches[s].switch.path and kind in ROPE_WORDS:
        return (PLACE_WORDS if isinstance(n.here.structure.switches[s].element, Touch) else ROPE_WORDS)[kind]
    return kind, said


def tell_jump(n: Instant, jumped: Jump, before: np.ndarray) -> None:
    """Record a jump of velocities."""
    if not (jumped.closing or jumped.blows or jumped.given or jumped.jammed):
        return
    done: list[str] = []
    impulses: dict[str, float] = {}
    for s, (u, after) in jumped.closing.items():
        unit = n.units[s]
        goes = "stays" if s in jumped.even else f"leaves at {abs(after):.6g} {unit}/s"
        done.append(
            f"{n.name(s)} closes at {abs(u):.6g} {unit}/s, {goes}" if n.kind[s] != LOCK else f"{n.name(s)} locks"
        )
    for s, x in jumped.impulse.items():  # joints and places of contact have components, by their rows
        if x != 0.0 and not isinstance(n.here.structure.switches[s].element, (Joint, Touch)):
            impulses[n.name(s)] = impulses.get(n.name(s), 0.0) + x
    if jumped.jammed:
        done.append("stops without a collision: no accelerations go with its friction (Painleve's paradox)")
    names = ", ".join(dict.fromkeys(n.name(s) for s in jumped.closing or jumped.jammed)) or "start"
    kind = "jam" if jumped.jammed else "impact" if jumped.closing else "kick"
    record(n, names, kind, tuple(done), jumped, impulses, before)


def tell_modes(n: Instant, old: tuple[np.ndarray, np.ndarray], before: np.ndarray, hits: dict[int, bool]) -> None:
    """Record what holds, slides or let go now and did not before, one record a kind.

    Parameters
    ----------
    n : Instant
    old : tuple of ndarray
        Modes and ways before.
    before : ndarray
        The state before.
    hits : dict
        Switches whose impact is recorded already, and whether they stay.
    """
    modes, ways = old
    told: dict[str, list[tuple[int, str]]] = {}
    for s in range(len(n.kind)):
        was, now = modes[s] != OFF, n.W.modes.mode[s] != OFF
        over = n.here.bounces[s].over if s in n.here.bounces else np.nan
        if now and not np.isnan(over):
            count = n.here.bounces.pop(s).count
            told.setdefault("rest", []).append((s, f"came to rest after {count} bounces"))
            n.over = float(np.fmax(n.over, over))
        elif n.kind[s] == ELASTIC and ways[s] != n.ways()[s] != 0.0 and not ways[s] == 0.0 < n.ways()[s] == FROZEN:
            kind, said = words(n, s, n.ways()[s] != FROZEN)
            told.setdefault(kind, []).append((s, said))
        elif was != now and s not in hits and not (n.kind[s] == SLIP and _is_open(n, s)):
            kind, said = words(n, s, now)
            if kind:
                told.setdefault(kind, []).append((s, said))
        elif not was and not now and _goes_both_ways(n, s) and ways[s] * n.ways()[s] < 0.0 and n.ways()[s] != BY_RATE:
            told.setdefault("turn", []).append((s, "slides the other way"))
    for kind, all_of in told.items():
        names = ", ".join(dict.fromkeys(n.name(s) for s, _ in all_of))
        record(n, names, kind, tuple(dict.fromkeys(said for _, said in all_of)), None, {}, before)


def _is_open(n: Instant, s: int) -> bool:
    """Whether the place of a slip parted: it does not slide either."""
    return bool(n.W.modes.mode[n.S.switches.other[s]] == OFF)


def _goes_both_ways(n: Instant, s: int) -> bool:
    """Whether a switch slides one way or the other: not a tangent of a place in space."""
    return bool(n.kind[s] == FRICTION or (n.kind[s] == SLIP and n.S.switches.partner[s] < 0))


def record(
    n: Instant, names: str, kind: str, done: tuple[str, ...], jumped: Jump | None, impulses: dict, before: np.ndarray
) -> None:
    """Append a record."""
    t = n.over if kind == "rest" and not np.isnan(n.over) else n.here.t
    size = max(jumped.passed, min(n.energy, n.here.clock.real.ledger)) if jumped else 0.0
    lost = jumped.lost if jumped and abs(jumped.lost) > NOISE * size else 0.0
    known = Struck(impulses, jumped.rows, jumped.blows) if jumped else impulses
    n.here.records.append(Happening(t, names, kind, done, lost, known, before.copy(), n.here.y.copy()))
