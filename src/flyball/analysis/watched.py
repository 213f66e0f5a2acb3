"""What drivers prescribe, and parts that could hold: friction slips the way it is driven, stops must not be passed.

The motion is computed without rows for them: a driver decides, not a stop. Where it leads past one the answer would be
another mechanism's, and is refused.
"""

from __future__ import annotations

import numpy as np

from ..constraints.modes import FRICTION, ONE_WAY, STOP
from ..errors import ModelError
from ..results.result import Result
from ..tables.switches import SwitchSpec
from ..tables.system import SWITCH_LOWER, SWITCH_UPPER, VALUE
from .compiled import compiled

KNOWN = frozenset({FRICTION, STOP, ONE_WAY})
"""Kinds of switches that analyses of a prescribed motion know."""
NEAR = 1e-9  # of the mechanism's length, a radian, or of the fastest rate, that is not past a stop


def refuse_passed(result: Result, analysis: str) -> None:
    """Refuse a motion that goes past a stop; what is only looked at is told by its health.

    Raises
    ------
    ModelError
        Naming the part, the time and how far.
    """
    old = result.values.structure
    c = compiled(result.model, parameters=result.values.told, tree=old.tree, switches=True)
    specs = c.structure.switches
    if not specs:
        return
    x, rate = np.zeros((2, len(specs), len(result.t)))
    c.follow(dict(zip(old.states, result.hints[0].tolist(), strict=True)) if len(result.t) else {})
    for k, t in enumerate(result.t.tolist()):
        c.at(t, result.q[k].copy(), result.v[k].copy())
        for n, spec in enumerate(specs):
            x[n, k] = c.work.sensed[VALUE, spec.measured]
            rate[n, k] = _rate(c, spec, result.v[k])
    for n, spec in enumerate(specs):
        _refuse(result, spec, x[n], rate[n], c.values.system.switch_x[n], c.values.length, analysis)
    result.health.remarks = (*result.health.remarks, *_remarks(specs, rate))


def _rate(c, spec: SwitchSpec, v: np.ndarray) -> float:
    """Rate of a switch's quantity."""
    S = c.values.system
    row = len(S.row_i) + spec.measured
    entries = slice(S.row_p[row], S.row_p[row + 1])
    return float(c.work.G[entries] @ v[S.col_i[entries]])


def _refuse(
    result: Result, spec: SwitchSpec, x: np.ndarray, rate: np.ndarray, par: np.ndarray, length: float, analysis: str
) -> None:
    e, what = spec.element, " - ".join(spec.switch.along) or "its length"
    over = [x - par[SWITCH_UPPER], par[SWITCH_LOWER] - x] if spec.switch.kind == STOP else []
    if spec.switch.kind == ONE_WAY:
        over = [-rate]
    size = max(length, float(np.abs(rate).max(initial=0.0)))
    for past in over:
        if len(past) and past.max() > NEAR * size:
            k = int(np.argmax(past > NEAR * size))
            raise ModelError(
                f"{e.title}: the drivers take {what} past it at t = {result.t[k]:.6g} s ({past.max():.4g} at most). A "
                f"prescribed motion is not stopped: change the drivers' laws, or leave it out: "
                f"m.changed({{{e.name!r}: None}}).{analysis}(...)"
            )


def _remarks(specs: list[SwitchSpec], rate: np.ndarray) -> list[str]:
    """What was only looked at, and friction at rest."""
    out = []
    looked = [s.element.title for s in specs if s.switch.kind in (STOP, ONE_WAY)]
    if looked:
        out.append(f"{', '.join(looked)}: not passed at the output times, which is all that was looked at")
    for n, s in enumerate(specs):
        fastest = np.abs(rate[n]).max(initial=0.0)
        still = np.abs(rate[n]) <= NEAR * fastest
        if s.switch.kind == FRICTION and still.any():
            out.append(
                f"{s.element.title} is taken as nothing where it does not slide: what it carries there of what the "
                f"drives need is not determined"
            )
    return out
