"""The standard pictures of a motion as data: what they show, ready to be drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..model.body import GROUND
from .edged import edged
from .figures import centre, few, figures, movers, some
from .marks import marks
from .recording import Figure, Picture, PointPaths

if TYPE_CHECKING:
    from ..results.result import Result

ORDER = ("energy", "coordinates", "positions", "paths", "contacts", "reactions", "actuation", "sensors", "controllers")


def standard_pictures(result: Result) -> list[Picture]:
    """The pictures that tell most of a motion, of those that have something to show.

    ``energy``, ``coordinates`` (of joints), ``positions`` (of spatial bodies over time), ``paths`` (of points, seen
    in the plane or from three sides), ``contacts``, ``reactions``, ``actuation``, ``sensors`` and ``controllers``.
    """
    whole = edged(result)
    found: dict[str, Figure | PointPaths] = {f.name: f for f in figures(whole)}
    if len(result.t):
        found["paths"] = _paths(whole)
    when, name = marks(result), result.model.name
    return [Picture(k, f"{name}: {k}", whole.t, found[k], when) for k in ORDER if k in found]


def _paths(result: Result) -> PointPaths:
    """Paths of centres of mass and named frames."""
    every = movers(result)
    bodies = some(every)
    points = {name: centre(result, name) for name in bodies}
    for frame in result.model.frames if len(points) < 6 else ():
        if frame.body != GROUND:
            p = result[frame.name].position
            points[frame.name] = np.column_stack([p, np.zeros((len(p), 3 - p.shape[1]))])
    note = "; ".join(x for x in (few(len(bodies), len(every), "bodies"), "dots: start") if x)
    return PointPaths(points, result.planar, note)
