"""What a motion exchanged besides its forces' works: in impacts, by events, and in motions that it goes on from."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..tables.system import SPARE

GIVEN = "event_work"
"""Energy that events gave: by kicks, and by changes of parameters that energy depends on."""
ADDED = ("friction_loss", "impact_loss", "surface_work", "numerical_loss", GIVEN)
"""Energies in `Result.exchanged` that count on from one motion to the next."""
ALL = ""


@dataclass
class Begun:
    """How a motion began.

    Attributes
    ----------
    y : ndarray (ny,) or None
        The state vector then; None where nobody said.
    done : dict
        What motions before it had exchanged [J], by the names of `ADDED`, and the work of what each force stores.
    """

    y: np.ndarray | None = None
    done: dict[str, float] = field(default_factory=dict)


def booked(result: Any) -> dict[str, np.ndarray]:
    """Energies [J] since the start, by their names in `Result.exchanged`: lost in impacts, given by events."""
    if result.stretches is None:
        return {}
    done, over = result.begun.done, result.stretches.over
    lost, given = over("lost") + done.get("impact_loss", 0.0), over("given") + done.get(GIVEN, 0.0)
    return {"impact_loss": lost, GIVEN: given + _over(result, _jumps(result, ALL))}


def basis(result: Any, name: str) -> np.ndarray:
    """What a force had stored at the start, and what events stored in it since [J] (n,).

    Less what it stores now, that is what it gave the bodies since the start.
    """
    whole, at = result.within or (result, slice(None))
    if isinstance(at, int):  # a moment of that stretch
        return np.full(len(result.t), _jumps(whole, name)[at] + _first(whole, name))
    known = whole.__dict__.setdefault("_basis", {})
    if name not in known:
        jumped = _over(whole, _jumps(whole, name)) if whole.stretches is not None else 0.0
        known[name] = jumped + _first(whole, name) + np.zeros(len(whole.t))
    return known[name][at]


def at_stretch(result: Any, k: int) -> dict[str, np.ndarray]:
    """As `booked`, at a moment of stretch k of a result."""
    done, x = result.begun.done, result.stretches.all[k]
    given = x.given + done.get(GIVEN, 0.0) + _jumps(result, ALL)[k]
    return {"impact_loss": np.array([x.lost + done.get("impact_loss", 0.0)]), GIVEN: np.array([given])}


def ended(before: Any) -> dict[str, float]:
    """What a motion that goes on from an earlier one begins with, as `Begun.done` has it."""
    done, last = before.begun.done, before.stretches.all[-1] if before.stretches is not None else None
    out = {k: done[k] for k in ADDED if k in done}
    if last is not None:
        totals = {"impact_loss": last.lost, GIVEN: last.given + _jumps(before, ALL)[-1]}
        out |= {k: x + done.get(k, 0.0) for k, x in totals.items()}
    else:
        out |= {k: float(x[-1]) for k, x in before.exchanged.items() if k in ADDED and len(x)}
    values = before.values if last is None else last.values
    now = _stored(before, (values, None if last is None else last.switch), before.final[1])
    for f in values.structure.forces:
        if f.energy is not None:
            jumped = _jumps(before, f.name)[-1] if last is not None else 0.0
            out[f.name] = float(_first(before, f.name) + jumped - now[f.name])
    return {k: x for k, x in out.items() if x != 0.0}


def added(result: Any) -> dict[str, np.ndarray]:
    """Energies that contacts exchanged, with those of the motions before."""
    return {k: x + (result.begun.done.get(k, 0.0) if k in ADDED else 0.0) for k, x in result.exchanged.items()}


def _first(result: Any, name: str) -> Any:
    """Stored in a force at the start, and the work of that before it [J]; at the first output if nobody said."""
    if result.begun.y is None or _at_start(result):
        stored = result[name].energy[:1].sum()  # complex where derivatives are asked for
        return stored + result.begun.done.get(name, 0.0)
    known = result.__dict__.setdefault("_at_first", {})
    if not known:
        every = result.stretches.all if result.stretches is not None else ()
        by = (every[0].values, every[0].switch) if every else (result.values, None)
        known.update(_stored(result, by, result.begun.y))
    return known.get(name, 0.0) + result.begun.done.get(name, 0.0)


def _at_start(result: Any) -> bool:
    """Whether the first output is the state that the motion began with, and no event changed anything since."""
    if result.stretches is not None or not len(result.t):
        return False
    first = np.concatenate([x[0] for x in (result.q, result.v, result.hints)])
    return np.array_equal(first, result.begun.y)


def _over(result: Any, each: list[float]) -> np.ndarray:
    """Numbers of the stretches at every output time."""
    return np.repeat(each, [x.rows for x in result.stretches.all])


def _jumps(result: Any, name: str) -> list[float]:
    """What events stored since the start [J], by stretches, in a force or by changes of parameters in all (`ALL`).

    That is what the same state has more afterwards. Of a force that is released all is gone.
    """
    known = result.__dict__.setdefault("_jumped", {})
    if not known:
        known.update(_jumped(result))
    return known.get(name) or [0.0] * len(result.stretches.all)


def _jumped(result: Any) -> dict[str, list[float]]:
    every = result.stretches.all
    names = [ALL, *(f.name for f in every[0].values.structure.forces)]
    total = dict.fromkeys(names, 0.0)
    out: dict[str, list[float]] = {name: [] for name in names}
    for k, x in enumerate(every):
        old = every[k - 1] if k else x
        other = x.values is not old.values
        if other or (x.switch[SPARE] != old.switch[SPARE]).any():
            now, then = (_stored(result, by, old.end) for by in ((x.values, x.switch), (old.values, old.switch)))
            total |= {name: total[name] + now[name] - then[name] for name in names if name != ALL}
            if other:
                total[ALL] += _stored(result, (x.values, old.switch), old.end)[ALL] - then[ALL]
        for name in names:
            out[name].append(total[name])
    return out


def _stored(result: Any, by: tuple[Any, Any], y: np.ndarray) -> dict[str, float]:
    """Energy [J] of a state by tables and switches (none: all is in force): of every force, and all of it."""
    values, switch = by
    s = values.structure
    q, v, z = np.split(y[None, :], [s.nq, s.nq + s.nv], axis=1)
    still, none = np.zeros((1, s.nv)), np.zeros((1, len(s.rows) + len(s.prescribed)))
    one = type(result)(result.model, values, np.zeros(1), q, v, z, still, none, result.health)
    gone = {x.element.name for k, x in enumerate(s.switches) if switch is not None and switch[SPARE, k] != 0.0}
    out = {f.name: 0.0 if f.energy is None or f.name in gone else float(one[f.name].energy[0]) for f in s.forces}
    return out | {ALL: float(one.energy.kinetic[0] + one.energy.gravity[0]) + sum(out.values())}
