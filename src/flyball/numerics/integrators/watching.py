"""What a watched integration keeps besides its `Clock`: guards, the sides they are on, what they depend on."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...compiler.layout import Float1, Float2, Float3, Int1, Int2, Record
from ...errors import ModelError

# what a guard's way means: which passing of zero is an event
FALLING, EITHER, RISING = -1, 0, 1
# rows of Watch.g: guards at the start and end of the step; of the equations within; expected within; sides in the
# making; what is zero of those that begin near it; what they were as they fired; what is rounding of them at the start
# and the end; least, largest and farthest from what is expected at stages; how far below zero they may end, nan where
# that tells nothing; their slopes at the end; then at the nodes of a panel, and where these are checked
START, END, TRUE, THERE, SIDE, MARK, FIRED, GRAIN_START, GRAIN_END, LEAST, MOST, MISS, ASTRAY, SLOPE, NODE = range(15)
NODES, CHECKS = 8, 2
GUARDS = NODE + NODES + CHECKS
CHECKED = (0.131, 0.567)  # places in a panel, far from those that are the same in a half of it
UNKNOWN = 2.0  # a side that follows from the value where the next step begins
EVENT = 6  # a status beside those of the clock: the step ends on events, told in Watch.fired


class WatchReals(Record, kind="Float"):
    """Where guards are looked for within the step."""

    panel: float  # begin of the panel
    width: float  # its width
    same: float  # time within which events are at the same instant
    done_to: float  # part of the step that was looked through
    beyond: float  # where a guard that comes back is beyond zero
    bracket: float  # how far apart places are between which it passes
    strayed: float  # how many roundings the state may be off by (`grains`)
    latest: float  # when the last event was
    fastest: float  # the fastest rate so far


class WatchCounts(Record, kind="Int"):
    """What was looked at."""

    stage: int  # calls of the right-hand side since the step began
    fresh: int  # whether the side of guards near zero is to be found
    steps: int  # watched
    looks: int  # places looked at
    again: int  # steps taken again
    events: int
    plain: int  # whether what is expected within the step is borne out
    sought: int  # places looked at with the equations since the step was taken,
    truly: int  # and in all
    lost: int  # whether they could not be evaluated at one
    cuts: int  # times that a step was cut since it could not be looked through
    away: int  # whether a guard leaves the side that it has to keep
    terms: int  # of the last guard, that of a group: see `concave`
    brief: int  # whether the step is so short that only rates tell of rates


class Watch(NamedTuple):
    """What a watched integration keeps besides its clock."""

    way: Int1  # (ng,): which passing of zero is an event
    kept: Int1  # (ng,): 1 of those that are above zero by what holds now
    firm: Int1  # (ng,): 1 of those that get no farther below zero by rounding than they begin
    grain: Float1  # (ng,): what is rounding of them; of those that may be anything, the less of both ends
    least: Float1  # (ng,): force that is rounding, of guards of forces; 0 of the rest
    tied: Float1  # (ng,): size of what those are of that others keep at zero; 0 of the rest
    still: Float1  # (nm,): size of rates that others keep at zero; 0 of the rest
    side: Float1  # (ng,): 1 where the guard is above zero, -1 below; as a segment begins 0 if it has just fired
    fired: Int1  # (ng,): 1 for those that the step ends on
    g: Float2  # (GUARDS, ng + terms of a group)
    poly: Float1  # (NODES,): a guard over a panel, in powers
    basis: Float2  # (NODES, NODES): powers from values at the nodes
    nodes: Float1  # (NODES + CHECKS,): places in a panel
    checks: Float2  # (CHECKS, NODES): the polynomial through the nodes where it is checked
    real: WatchReals  # type: ignore[assignment]
    count: WatchCounts  # type: ignore[assignment]
    stages: Int1  # of a step, where levels are kept
    met: Int1  # of a step, at which guards are kept
    met_at: Float1  # where in the step these are
    met_g: Float2  # (met, ng + terms): guards there
    moving: Float3  # (2, 3, nm): measured quantities, rates, accelerations, at the start and the end
    levels: Float2  # (2 + stages, rows + spots): what has no known rate: multipliers, loads
    places: Float1  # (2 + stages,): where in the step these were seen
    rows: Int1  # multipliers that guards depend on
    spots: Int2  # (..., 2): rows and columns of what else is sensed
    sensed: Float2  # what is expected to be sensed: values and rates in its first rows; then rates as values
    lam: Float1  # multipliers expected


@lru_cache(maxsize=1)
def nodes() -> np.ndarray:
    """Places of a panel's nodes in it: Chebyshev's, ends included."""
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(NODES) / (NODES - 1))


@lru_cache(maxsize=1)
def basis() -> np.ndarray:
    """What takes values at the nodes to powers of the place in the panel."""
    return np.ascontiguousarray(np.linalg.inv(np.vander(nodes(), increasing=True)))


@lru_cache(maxsize=1)
def checks() -> np.ndarray:
    """What takes values at the nodes to those of the polynomial where it is checked."""
    return np.ascontiguousarray(np.vander(CHECKED, NODES, increasing=True) @ basis())


def kept_stages(c: np.ndarray, stages: int) -> tuple[list[int], list[int]]:
    """Stages of a method at which levels are kept, as evenly apart as there are, and at which guards are.

    Not the first ones, whose order is low, unless there are no others. One at least tells whether levels are what
    those kept let expect.

    Raises
    ------
    ModelError
        If a step has less than two stages between its ends.
    """
    good = [i for i in range(max(2, stages // 3), stages) if c[i] < 0.95]
    if len(good) < 2:
        good = [i for i in range(1, stages) if c[i] < 0.95]
    if len(good) < 2:
        raise ModelError(
            f"the method of integration has {len(good)} stages between the ends of a step; to find events (of limits, "
            f"friction, corners of laws) it needs two: take another method, such as rk45"
        )
    found: list[int] = []
    for x in (0.25, 0.6, 0.857):
        best = min(good, key=lambda i: (abs(c[i] - x), -i))
        if best not in found:
            found.append(best)
    others = [i for i in good if all(abs(c[i] - c[k]) > 0.03 for k in found)]
    if not others:
        others = [found.pop(1)] if len(found) > 1 else [i for i in good if i not in found][:1]
    return sorted(found, key=lambda i: c[i]), sorted({*found, *others}, key=lambda i: c[i])


def watching(
    way: np.ndarray,
    holding: np.ndarray,
    c: np.ndarray,
    stages: int,
    measured: int,
    rows: np.ndarray,
    spots: np.ndarray,
    expected: tuple[np.ndarray, np.ndarray],
    terms: int = 0,
) -> Watch:
    """What a watched integration keeps, empty.

    Parameters
    ----------
    way : ndarray (ng,)
        Of the guards.
    holding : ndarray (ng,)
        1 for those that are above zero as long as what holds now is right, 2 for those of them that get no
        farther below by rounding than they begin: distances, rates.
    c : ndarray
        Where in a step a method's stages are.
    stages : int
        How many stages a step has.
    measured : int
        Quantities with rates.
    rows : ndarray
        Multipliers that guards depend on.
    spots : ndarray (..., 2)
        Rows and columns of what else is sensed.
    expected : tuple of ndarray
        Where expected values of what is sensed, and of multipliers, are written.
    terms : int, optional
        Room for terms of the guard of a group.
    """
    ng, real = len(way), WatchReals.blank()
    real.latest = -np.inf
    kept, met = (np.array(x, np.int64) for x in kept_stages(c, stages))
    spots = np.asarray(spots, np.int64).reshape(-1, 2)
    g = np.full((GUARDS, ng + terms), np.nan)
    g[GRAIN_START : GRAIN_END + 1] = 0.0
    return Watch(
        way=np.array(way, np.int64),
        kept=(np.asarray(holding) > 0).astype(np.int64),
        firm=(np.asarray(holding) > 1).astype(np.int64),
        grain=np.zeros(ng),
        least=np.zeros(ng),
        tied=np.zeros(ng),
        still=np.zeros(measured),
        side=np.full(ng, UNKNOWN),
        fired=np.zeros(ng, np.int64),
        g=g,
        poly=np.zeros(NODES),
        basis=basis(),
        nodes=np.r_[nodes(), CHECKED],
        checks=checks(),
        real=real,
        count=WatchCounts.blank(),
        stages=kept,
        met=met,
        met_at=c[met],
        met_g=np.full((len(met), ng + terms), np.nan),
        moving=np.zeros((2, 3, measured)),
        levels=np.zeros((2 + len(kept), len(rows) + len(spots))),
        places=np.r_[0.0, c[kept], 1.0],
        rows=np.array(rows, np.int64),
        spots=spots,
        sensed=expected[0],
        lam=expected[1],
    )
