"""How well the accelerations of a motion fulfil G vdot = gamma, seen from outside the solve."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ...equations.engine import MOTION
from ...tables.system import VALUE
from ..compiled import Compiled, compiled

if TYPE_CHECKING:
    from ...results.result import Result

MOST = 100  # output times that are looked at
NOTHING = 1e-14  # of the mechanism's length (or a radian) by the square of the motion's time: what is less is rounding


def acceleration_violation(result: Result) -> float:
    """Largest |G vdot - gamma| at up to `MOST` output times, relative to the terms that make it up.

    Looked at in absolute coordinates, whatever the motion was computed in: what two bodies add to a row cancels in
    others. The terms are what would be there without the constraints, |G| M^-1 |f|, which reactions cancel;
    |G| |vdot|; and what gamma is made of, rates of turn times rates of the rows: where nothing moves, or all moves
    steadily, the accelerations themselves are only the rounding of these; where no force acts either, all of them are
    (`NOTHING`). With Baumgarte's stabilization gamma is what that makes of it.
    """
    n, old = len(result.t), result.values.structure
    if not n or not (result.model.joints or result.model.drivers or old.switches):
        return 0.0
    if result.pieces:
        return max(map(acceleration_violation, result.pieces))
    told = result.values.told
    own = compiled(result.model, parameters=told, tree=old.tree, switches=result.stretches is not None)
    c = own
    if old.tree:
        c = compiled(result.model, parameters=told, switches=result.stretches is not None)
    if not len(c.structure.rows):
        return 0.0
    picked = np.unique(np.linspace(0, n - 1, min(n, MOST)).astype(int)).tolist()
    accelerations, sizes = _accelerations(result, c), c.sizes
    held = None if result.stretches is None else result.stretches.over("switch")
    span, worst = float(np.ptp(result.t)), 0.0
    least = NOTHING / span**2 if span > 0.0 else 0.0
    for k in picked:
        q, v, own.z = result.q[k].copy(), result.v[k].copy(), result.states[k].copy()
        if c is not own:
            q, v = c.take(own, result.t[k], q, v)
        if held is not None:
            c.work.modes.mode[:], c.work.modes.hold[:] = held[:2, :, k]
            c.work.sensed[VALUE, c.work.sensed.shape[1] - len(old.switches) :] = result.stretches.sigma[:, k]  # type: ignore[union-attr]
        c.at(result.t[k], q, v, MOTION)
        gap, largest, _ = missed(c, v, accelerations[k], sizes, result.health.options)
        largest = max(largest, least)
        worst = max(worst, float(gap.max()) / largest if largest > 0.0 else 0.0)
    return worst


def _accelerations(result: Result, c: Compiled) -> np.ndarray:
    """Accelerations of all bodies at all output times, as c's velocities go, (n, nv)."""
    out = np.zeros((len(result.t), c.structure.nv))
    planar = c.structure.model.planar
    for name, b in c.structure.place.items():
        if b < 0:
            continue
        _, R, _, _, alpha, a = result.records.body(result.values.structure.place[name])
        v0, n = int(c.values.system.tree.v[b]), int(c.values.system.tree.nv[b])
        turns = [alpha[2]] if planar else [sum(R[3 * i + k] * alpha[i] for i in range(3)) for k in range(3)]
        out[:, v0 : v0 + n] = np.stack([*(a[:2] if planar else a), *turns][:n], axis=1)
    return out


def missed(
    c: Compiled, v: np.ndarray, x: np.ndarray, sizes: np.ndarray, o: Mapping[str, Any] | None = None
) -> tuple[np.ndarray, float, float]:
    """How far the accelerations x are off each row, (nr,), the largest sum of a row's terms, and that without x's own.

    Rows in metres count as parts of the mechanism's length. The state (velocities v) is the one in c's scratch,
    evaluated with forces; ``sizes`` are c's, ``o`` the options of the motion.
    """
    S, n = c.values.system, len(c.structure.rows)
    row_p = S.row_start[: n + 1]
    row, column, G = np.repeat(np.arange(n), np.diff(row_p)), S.column[: row_p[-1]], c.work.G[: row_p[-1]]

    def times(entries: np.ndarray, x: np.ndarray) -> np.ndarray:
        return np.bincount(row, entries * x[column], n)

    gamma = c.work.rows.gamma.copy()
    if o is not None and o.get("stabilization") == "baumgarte":
        gamma -= 2 * o["alpha"] * (times(G, v) - c.work.rows.nu) + o["beta"] ** 2 * c.work.rows.value
    turning = np.zeros(n)
    np.maximum.at(turning, row, (np.abs(v) / sizes)[column])
    asked = times(abs(G), np.abs(_unconstrained(c))) + np.abs(gamma) + times(abs(G), np.abs(v)) * turning
    metre = np.where(c.metric, c.values.length, 1.0)
    size = asked + times(abs(G), np.abs(x))
    return np.abs(times(G, x) - gamma) / metre, float((size / metre).max()), float((asked / metre).max())


def _unconstrained(c: Compiled) -> np.ndarray:
    """Accelerations (nv,) that forces would give the bodies without constraints, at the state in c's scratch.

    Every body is taken for a compact one: a slender one that its joints keep from spinning does not spin.
    """
    S = c.values.system
    per = np.zeros(c.structure.nv)
    for b, (v0, n) in enumerate(zip(S.tree.v, S.tree.nv, strict=True)):
        k = min(n, 2 if c.structure.model.planar else 3)
        per[v0 : v0 + k], per[v0 + k : v0 + n] = S.bodies.inverse_mass[b], S.bodies.inverse_reference_inertia[b]
    return per * c.work.velocities.applied
