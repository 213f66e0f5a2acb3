"""By how much a motion of one freedom is late or early, from the error of its energy.

What nothing drives or damps has its speed from its energy: off by dE where the kinetic energy is T, it is faster by the
part dE / 2T, and after a while early by the integral of that. So an error of the energy that is nothing beside what is
moved makes a mechanism that all but stops on a dead centre go over it at quite another time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .ledger import Ledger

LATE = 0.05  # part of the longest way of a body by which one may be off
STILL = 1e-6  # part of the mechanism's length that is no way
TURNING = 0.1  # part of the largest kinetic energy below which a motion that comes back is at its turning point


def late(x: Ledger) -> str:
    """What is to be said of a motion of one freedom whose energy is off; nothing where it comes out in time.

    Not where steps outnumber output times, which may miss when it is slow.
    """
    r = x.result
    unknown = x.works or r.exchanged or r.bulk or r.pieces
    if unknown or not 1 < r.health.steps <= len(r.t) or not x.kinetic.max() > 0.0:
        return ""
    faster = _faster(x)
    faster[_turns(x)] = 0.0
    lag = np.r_[0.0, np.cumsum(0.5 * (faster[1:] + faster[:-1]) * np.diff(r.t))]
    off, name, way = 0.0, "", STILL * r.values.length
    for body, b in r.values.structure.place.items():
        if b < 0:
            continue
        p, _, _, v, _, _ = r.motions.body(b)
        way = max(way, float(np.linalg.norm(np.ptp(p, axis=1))))
        off, name = max((off, name), (float((np.abs(lag) * np.linalg.norm(v, axis=0)).max()), body))
    if not off > LATE * way or r.health.freedoms != 1:
        return ""
    finer = "shorter step" if r.health.options.get("step") else "smaller rtol"
    return (
        f"the energy is off by up to {np.abs(x.balance).max():.2g} J where down to {x.kinetic.min():.2g} J move: by "
        f"that alone the motion comes to be {np.abs(lag).max():.2g} s early or late, and {name!r} off by about "
        f"{off:.2g} m; a {finer} may tell whether it can be trusted"
    )


def _faster(x: Ledger) -> np.ndarray:
    """Part by which it is too fast at every output time, dE / 2T: half of what moves at most."""
    return x.balance / (2.0 * (x.kinetic + np.abs(x.balance)) + 1e-300)


def _turns(x: Ledger) -> np.ndarray:
    """Rows about turning points, where a motion comes back: its speed is off by much there, its time is not."""
    slow, v = x.kinetic < TURNING * x.kinetic.max(), x.result.v
    edges = np.flatnonzero(np.diff(np.r_[False, slow, False]))
    out = np.zeros(len(slow), bool)
    for begin, end in edges.reshape(-1, 2):
        before, after = v[max(begin - 1, 0)], v[min(end, len(v) - 1)]
        out[begin:end] = begin == 0 or end == len(v) or float(before @ after) <= 0.0
    return out
