"""What drivers prescribe, and parts that could hold: friction slips the way it is driven, stops must not be passed.

The motion is computed without rows for them: a driver decides, not a stop. Where it leads past one the answer would be
another mechanism's, and is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..constraints.modes import FRICTION, ONE_WAY, STOP
from ..errors import ModelError
from ..results.result import Result
from ..tables.switches import SwitchSpec
from ..tables.system import VALUE
from .compiled import compiled

KNOWN = frozenset({FRICTION, STOP, ONE_WAY})
"""Kinds of switches that analyses of a prescribed motion know."""
NEAR = 1e-9  # of the mechanism's length, a radian, or of the fastest rate, that is not past a stop
PLACES, MOST = 8, 4000  # looked at between two times; in all
ROUNDS = 4


def refuse_passed(result: Result, analysis: str, again: Callable[[np.ndarray], Result]) -> None:
    """Refuse a motion that goes past a stop, at the output times or between them; health tells how closely it looked.

    Between two times it is looked at a few more, and where a cubic through values and rates at neighbours peaks.

    Parameters
    ----------
    result : Result
    analysis : str
        Its name, for the message.
    again : callable
        The same motion at other times [s].

    Raises
    ------
    ModelError
        Naming the part, the time and how far.
    """
    seen, t = _seen(result), result.t
    remarks = _at_rest(seen)
    stops = [x.element.title for x in seen.specs if x.switch.kind in (STOP, ONE_WAY)]
    for k in range(ROUNDS if stops else 0):
        more = _between(t) if k == 0 else _peaks(t, seen)
        if not len(more):
            break
        looked = again(np.union1d(t, more))
        seen, t = _seen(looked), looked.t
    if stops:
        _refuse(t, seen, analysis)
        remarks.append(f"{', '.join(stops)}: not passed at {len(t)} times that were looked at, which is no proof")
    result.health.remarks = (*result.health.remarks, *remarks)


def remark_friction(result: Result) -> None:
    """Say in a result's health where friction is at rest in a motion that drivers prescribe."""
    result.health.remarks = (*result.health.remarks, *_at_rest(_seen(result)))


class Seen(NamedTuple):
    """What could hold along a motion: values and rates at all times (n, times), bounds (n, 2), what is not past one."""

    specs: list[SwitchSpec]
    x: np.ndarray
    rate: np.ndarray
    bounds: np.ndarray
    near: np.ndarray


def _seen(result: Result) -> Seen:
    old = result.values.structure
    c = compiled(result.model, parameters=result.values.told, tree=old.tree, switches=True)
    every = c.structure.switches
    which = [k for k, spec in enumerate(every) if spec.measured >= 0]
    specs = [every[k] for k in which]
    x, rate = np.zeros((2, len(specs), len(result.t)))
    c.follow(dict(zip(old.states, result.hints[0].tolist(), strict=True)) if len(result.t) else {})
    for k, t in enumerate(result.t.tolist()):
        c.at(t, result.q[k].copy(), result.v[k].copy())
        for n, spec in enumerate(specs):
            x[n, k] = c.work.sensed[VALUE, spec.measured]
            rate[n, k] = _rate(c, spec, result.v[k])
    numbers = c.values.system.switch_numbers
    bounds = np.stack([numbers.lower[which], numbers.upper[which]], axis=1)
    return Seen(specs, x, rate, bounds, NEAR * np.maximum(c.values.length, np.abs(rate).max(axis=1, initial=0.0)))


def _between(t: np.ndarray) -> np.ndarray:
    """Times between those of a motion."""
    n = max(1, min(PLACES, MOST // max(len(t), 1)))
    part = np.arange(1, n + 1) / (n + 1)
    return (t[:-1, None] + np.diff(t)[:, None] * part).ravel()


def _peaks(t: np.ndarray, seen: Seen) -> np.ndarray:
    """Times at which the cubics between values and rates go past a stop, or back at a freewheel."""
    h, out = np.diff(t), [np.zeros(0)]
    for spec, x, rate, (lower, upper), near in zip(*seen, strict=True):
        # x + h (r s + b s^2 + a s^3), s from 0 to 1
        r, rise = rate[:-1], np.diff(x) / h
        a, b = rate[1:] + r - 2.0 * rise, 3.0 * rise - 2.0 * r - rate[1:]
        with np.errstate(all="ignore"):
            root = np.sqrt(b * b - 3.0 * a * r)
            turns = -b / (3.0 * a) if spec.switch.kind == ONE_WAY else (np.array([root, -root]) - b) / (3.0 * a)
            turns = np.where(a == 0.0, -r / (2.0 * b), turns)
        s = np.where((turns > 0.0) & (turns < 1.0), turns, 0.0)
        at, going = x[:-1] + h * s * (r + s * (b + s * a)), r + s * (2.0 * b + s * 3.0 * a)
        past = {STOP: (at > upper + near) | (at < lower - near), ONE_WAY: going < -near}
        out.append((t[:-1] + h * s)[(s > 0.0) & past.get(spec.switch.kind, np.zeros(s.shape, bool))])
    return np.unique(np.concatenate(out))


def _rate(c, spec: SwitchSpec, v: np.ndarray) -> float:
    """Rate of a switch's quantity."""
    S = c.values.system
    row = len(S.rows.law) + spec.measured
    entries = slice(S.row_start[row], S.row_start[row + 1])
    return float(c.work.G[entries] @ v[S.column[entries]])


def _refuse(t: np.ndarray, seen: Seen, analysis: str) -> None:
    for spec, x, rate, (lower, upper), near in zip(*seen, strict=True):
        over = {STOP: np.maximum(x - upper, lower - x), ONE_WAY: -rate}.get(spec.switch.kind, np.zeros(0))
        if not (over > near).any():
            continue
        e, what = spec.element, " - ".join(spec.switch.along) or "its length"
        raise ModelError(
            f"{e.title}: the drivers take {what} past it at t = {t[np.argmax(over > near)]:.6g} s ({over.max():.4g} at "
            f"most). A prescribed motion is not stopped: change the drivers' laws, or leave it out: "
            f"m.changed({{{e.name!r}: None}}).{analysis}(...)"
        )


def _at_rest(seen: Seen) -> list[str]:
    """Friction that stands still."""
    out = []
    for spec, rate in zip(seen.specs, seen.rate, strict=True):
        still = np.abs(rate) <= NEAR * np.abs(rate).max(initial=0.0)
        if spec.switch.kind == FRICTION and still.any():
            out.append(
                f"{spec.element.title} is taken as nothing where it does not slide: what it carries there of what the "
                f"drives need is not determined"
            )
    return out
