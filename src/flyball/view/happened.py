"""What happened at instants, and what held when, as tables of a report: for three events and for thousands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..constraints.modes import BRANCH, EDGE, ELASTIC, FRICTION, FROZEN, LOCK, ONE_WAY, RATCHET, SLIP, STOP
from ..model.touch import Touch
from ..results.events import Happening
from ..tables.system import OFF
from .tabled import Table

if TYPE_CHECKING:
    from ..results.result import Result

FEW = 12  # events that are listed without a summary
FIRST, LAST = 150, 50  # of many, those that are listed
WORDS = {
    STOP: ("closed", "open"), ELASTIC: ("pressed", "open"), FRICTION: ("sticks", "slides"), RATCHET: ("holds", "free"),
    ONE_WAY: ("holds", "overruns"), LOCK: ("locked", "free"),
}  # fmt: skip
"""Of each kind of switch what it says while it holds, and while it does not."""
ROPE, PLACE = ("taut", "slack"), ("touches", "apart")


def events(result: Result) -> list[Table]:
    """The list of what happened; of many, how often each comes first, and the list is folded."""
    found = _events(list(result.events))
    return found if result.events.lost.any() else [_without_last(t) for t in found]


def _without_last(t: Table) -> Table:
    """A table without its last column."""
    return replace(t, columns=t.columns[:-1], rows=tuple(row[:-1] for row in t.rows), total=t.total[:-1])


def _events(every: list[Happening]) -> list[Table]:
    columns = ("t [s]", "name", "kind", "what was done", "energy lost [J]")
    if len(every) <= FEW:
        return [Table("events", "Events", columns, tuple(_rows(every)))]
    shown, note = every, ""
    if len(every) > FIRST + LAST:
        shown = [*every[:FIRST], *every[-LAST:]]
        note = f"The first {FIRST} and the last {LAST} of {len(every)}; run.events has all."
    rows = _rows(shown)
    if note:
        rows.insert(FIRST, ("...", f"{len(every) - FIRST - LAST} more", "", "", ""))
    listed = Table("all-events", "", columns, tuple(rows), note=note, folded=f"All {len(every)} in the order of time")
    return [_summary(every), listed]


def _rows(every: Sequence[Happening]) -> list[tuple[str, ...]]:
    return [(f"{h.t:.6g}", h.name, h.kind, "; ".join(h.done) or "noted", _energy([h])) for h in every]


def _energy(every: Sequence[Happening]) -> str:
    """What was lost, if anything."""
    lost = sum(h.lost for h in every)
    return f"{lost:.4g}" if lost else ""


def _summary(every: Sequence[Happening]) -> Table:
    """How often each happened, when first and last, and what it took."""
    groups: dict[tuple[str, str], list[Happening]] = {}
    for h in every:
        groups.setdefault((h.name, h.kind), []).append(h)
    rows = []
    for (name, kind), own in groups.items():
        rows.append((name, kind, str(len(own)), f"{own[0].t:.6g}", f"{own[-1].t:.6g}", _energy(own)))
    columns = ("name", "kind", "times", "first at [s]", "last at [s]", "energy lost [J]")
    return Table("events", "Events", columns, tuple(rows), ("all", "", str(len(every)), "", "", _energy(every)))


def holding(result: Result) -> Table:
    """What may hold and let go: as it began, as it ended, and how much of the time it held."""
    columns = ("part", "kind", "acts on", "at the start", "at the end", "of output times", "listed above")
    title = "Stops, ropes, latches and friction"
    if result.stretches is None or not len(result.t):
        return Table("holding", title, columns, ())
    held = _held(result)
    counts, rows = result.events.counts(), []
    for k, x in enumerate(result.stretches.all[0].values.structure.switches):
        if x.switch.kind in (BRANCH, EDGE, SLIP):
            continue
        yes, no = _words(x)
        told = [yes if held[k, i] else no for i in (0, -1)]
        if result.stretches.all[-1].modes.released[k] != 0.0:
            told[-1] = "released"
        event = x.element.category == "events"
        name = x.switch.label if event else x.element.name
        kind = "locked by events" if event else type(x.element).__name__
        times = "once" if counts.get(name) == 1 else f"{counts[name]} times" if name in counts else "never"
        rows.append((name, kind, _on(x), *told, f"{yes} {100 * held[k].mean():.3g} %", times))
    return Table("holding", title, columns, tuple(rows))


def _held(result: Any) -> np.ndarray:
    """Whether each switch holds or presses at each output time, (ns, n)."""
    every = result.stretches.all[0].values.structure.switches
    elastic = np.array([x.switch.kind == ELASTIC for x in every], bool)
    pressed = (result.stretches.sigma != FROZEN) & (result.stretches.sigma != 0.0)
    return np.where(elastic[:, None], pressed, result.stretches.mode != OFF)


def _words(x: Any) -> tuple[str, str]:
    if x.switch.path:
        return PLACE if isinstance(x.element, Touch) else ROPE
    return WORDS[x.switch.kind]


def _on(x: Any) -> str:
    """The coordinates that it acts along, or the bodies that it is between."""
    if x.switch.along:
        return " and ".join(x.switch.along)
    bodies = getattr(x.element, "bodies", None) or (getattr(x.element, "body_i", ""), getattr(x.element, "body_j", ""))
    return " - ".join(b for b in bodies if b)
