"""Recordings of further states of a mechanism, for a page that shows it already: what moves, and its curves."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

import numpy as np

from .animation import force_line
from .recording import Channel, RecordedBody, RecordedLine, Recording
from .scene import body_poses, contact_arrows, recorded_sets
from .symbols import AttachedFrames, coordinate_spring_line, element_symbols

if TYPE_CHECKING:
    from ..results.result import Result


def record_further_states(result: Result, shown: Recording) -> Recording:
    """Make the recording of further states: poses, lines and curves of parts that a page shows, and nothing else.

    Parameters
    ----------
    result : Result
        The states, of the same mechanism; it may have more parts.
    shown : Recording
        Names of the bodies, lines and curves of the page.

    Returns
    -------
    Recording
        Bodies have no shapes; curves that have no value at any of these times are left out.
    """
    every = np.arange(len(result.t))
    known = {b.name for b in shown.bodies}
    poses = zip(result.model.bodies, body_poses(result, every), strict=True)
    return Recording(
        name=shown.name,
        planar=shown.planar,
        t=result.t,
        bodies=tuple(RecordedBody(b.name, (), p, q) for b, (p, q) in poses if b.name in known),
        lines=tuple(_lines(result, every, {line.name for line in shown.lines}, shown.size)),
        channels=tuple(_channels(result, [c.name for c in shown.channels])),
        size=shown.size,
        down=shown.down,
        sets=recorded_sets(result, every),
        contacts=contact_arrows(result, every)[0],
        speed=shown.speed,
    )


def _lines(result: Result, every: np.ndarray, names: Collection[str], size: float) -> Iterator[RecordedLine]:
    places, m = AttachedFrames(result), result.model
    for e in (x for x in (*m.joints, *m.couplings) if x.name in names):
        yield from (d for d in element_symbols(e, places, every, []) if isinstance(d, RecordedLine))
    for e in (x for x in m.forces if x.name in names):
        drawn = force_line(e, places, every) or coordinate_spring_line(e, places, every, size)
        if isinstance(drawn, RecordedLine):
            yield drawn


def _channels(result: Result, names: Collection[str]) -> Iterator[Channel]:
    for name in names:
        unit, values = result.channel(name)
        values = np.asarray(values, float)
        if np.isfinite(values).any():
            yield Channel(name, unit, values)
