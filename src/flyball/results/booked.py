"""What events did to the energy of a motion, at its output times."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .energy import GIVEN
from .result import Result

if TYPE_CHECKING:
    from .stretches import Stretch


def booked(result: Result) -> dict[str, np.ndarray]:
    """Energies [J] since the start, by their names in `Result.exchanged`: lost in impacts, given by events.

    What a change of parameters gives is what the same state has more afterwards. Elements whose work is integrated
    account for their own share (`Energy.work`).
    """
    stretches = result.stretches
    if stretches is None:
        return {}
    given, jumps = stretches.over("given"), list[np.ndarray]()
    total = 0.0
    for k, x in enumerate(stretches.all):
        before = stretches.all[k - 1] if k else x
        if x.values is not before.values:
            total += _stored(result, x, before.end) - _stored(result, before, before.end)
        jumps.append(np.full(x.rows, total))
    return {"impact_loss": stretches.over("lost"), GIVEN: given + np.concatenate(jumps)}


def _stored(result: Result, by: Stretch, y: np.ndarray) -> float:
    """Energy [J] of a state by the parameters of a stretch; without elements that account for themselves."""
    s = by.values.structure
    q, v, z = np.split(y[None, :], [s.nq, s.nq + s.nv], axis=1)
    rows = result.multipliers.shape[1]
    one = Result(result.model, by.values, np.zeros(1), q, v, z, np.zeros((1, s.nv)), np.zeros((1, rows)), result.health)
    e = one.energy
    own = [f.name for f in s.forces if f"{f.name}.work" not in s.state_at]
    return float(e.kinetic[0] + e.gravity[0] + sum(one[name].energy[0] for name in own))
