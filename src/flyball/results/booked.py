"""What events did to the energy of a motion, at its output times."""

from __future__ import annotations

from typing import Any

import numpy as np

GIVEN = "event_work"
"""Energy that events gave: by kicks, and by changes of parameters that energy depends on."""
ALL = ""


def booked(result: Any) -> dict[str, np.ndarray]:
    """Energies [J] since the start, by their names in `Result.exchanged`: lost in impacts, given by events."""
    if result.stretches is None:
        return {}
    return {"impact_loss": result.stretches.over("lost"), GIVEN: result.stretches.over("given") + jumps(result)[ALL]}


def jumps(result: Any) -> dict[str, np.ndarray]:
    """What changes of parameters gave since the start [J] (n,): to each force that stores energy, and to all (`ALL`).

    That is what the same state has more afterwards.
    """
    every, total = result.stretches.all, dict[str, float]()
    out: dict[str, list[np.ndarray]] = {}
    for k, x in enumerate(every):
        before = every[k - 1] if k else x
        if x.values is not before.values:
            now, then = (_stored(result, by, before.end) for by in (x, before))
            total = {name: total.get(name, 0.0) + now[name] - then[name] for name in now}
        for name in (ALL, *(f.name for f in x.values.structure.forces)):
            out.setdefault(name, []).append(np.full(x.rows, total.get(name, 0.0)))
    return {name: np.concatenate(parts) for name, parts in out.items()}


def _stored(result: Any, by: Any, y: np.ndarray) -> dict[str, float]:
    """Energy [J] of a state by the parameters of a stretch: of every force, and all of it."""
    s = by.values.structure
    q, v, z = np.split(y[None, :], [s.nq, s.nq + s.nv], axis=1)
    still, none = np.zeros((1, s.nv)), np.zeros((1, result.multipliers.shape[1]))
    one = type(result)(result.model, by.values, np.zeros(1), q, v, z, still, none, result.health)
    out = {f.name: float(one[f.name].energy[0]) for f in s.forces}
    return out | {ALL: float(one.energy.kinetic[0] + one.energy.gravity[0]) + sum(out.values())}
