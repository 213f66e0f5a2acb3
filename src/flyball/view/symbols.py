"""Symbols of joints and couplings: which one, on which body, and how large.

What is drawn follows from the word that an element's class declares (``drawn``). An unknown word gets a plain mark.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..model.geometry import matrix_to_quaternion
from .gears import gear_pair, rack
from .places import End, Places, three
from .recording import RecordedCurve, RecordedJoint, RecordedLine

Drawn = RecordedJoint | RecordedCurve | RecordedLine

BODILY = ("gear", "rack", "wheel", "ball")  # symbols that are the body itself, where it has no shape of its own


def symbols(e: Any, places: Places, every: np.ndarray) -> Iterator[Drawn]:
    """What shows a joint, a coupling or a bushing.

    Parameters
    ----------
    e : Joint, Coupling or Force
    places : Places
    every : ndarray of int
        The times that are shown.
    """
    kind = getattr(e, "drawn", "")
    if kind == "gear":
        yield from gear_pair(e, places)
    elif kind == "rack":
        yield from rack(e, places)
    ends = places.ends(e)
    if ends is None or kind in ("coupler", ""):
        return
    F, M = ends
    numbers = places.result.values.numbers[e.name]
    if kind == "link":
        yield _line(e, places, every)
    elif kind == "universal" and np.abs(places.seen(F, M)).max(initial=0.0) > 1e-6 * places.result.values.length:
        yield _line(e, places, every)  # a massless link with a hinge at either end
        yield _at(e, "revolute", F, M, places)
        yield _at(e, "revolute", M, F, places)
    elif kind in ("planar", "point_in_plane"):
        yield _at(e, "plane", F, M, places)
        yield _at(e, "point", M, F, places)
    elif kind == "point_on_line":
        yield _at(e, "rail", F, M, places)
        yield _at(e, "point", M, F, places)
    elif kind == "rolling":
        yield _at(e, "plane", F, M, places)
        ball = not places.result.planar and not hasattr(numbers, "tread")
        yield _at(e, "ball" if ball else "wheel", M, F, places, (wheel_radius(e, places),))
    elif kind == "cam":
        outline = cam_outline(e, numbers)
        if outline is not None:
            yield RecordedCurve(e.name, F.body, F.p + outline @ F.R.T, closed=True)
        radius = float(getattr(numbers, "radius", None) or 0.0)
        yield _at(e, "roller" if radius else "point", M, F, places, (radius,))
    elif kind == "knife_edge":
        yield _at(e, "knife_edge", M, F, places)
    else:
        first, second = carried(F, M)
        size = (float(numbers.lead),) if kind == "screw" and hasattr(numbers, "lead") else ()
        yield _at(e, kind, first, second, places, size)


def carried(F: End, M: End) -> tuple[End, End]:
    """The end that a symbol rides on: ground where the joint is fixed there, else the first body."""
    return (M, F) if M.grounded else (F, M)


def wheel_radius(e: Any, places: Places) -> float:
    """Radius of a rolling wheel: as given, with its tread; else the distance of its centre from what it rolls on."""
    n = places.result.values.numbers[e.name]
    if hasattr(n, "radius"):
        return float(n.radius) + float(getattr(n, "tread", 0.0))
    ends = places.ends(e)
    assert ends is not None
    return float(np.sqrt((places.seen(*ends)[:1, :2] ** 2).sum()))


def cam_outline(e: Any, n: Any) -> np.ndarray | None:
    """Points of a cam's outline in its frame, (k, 3): the element's own ``outline``, else the points it was given."""
    points = e.outline(n) if hasattr(e, "outline") else getattr(n, "points", None)
    if points is None:
        return None
    a = np.asarray(points, float)
    return np.column_stack([a, np.zeros(len(a))]) if a.shape[1] == 2 else a


def _at(e: Any, kind: str, end: End, other: End, places: Places, size: tuple[float, ...] = ()) -> RecordedJoint:
    turn = tuple(matrix_to_quaternion(end.R).tolist())
    reach = places.reach(end, other)
    return RecordedJoint(e.name, kind, end.body, three(end.p), three(end.R[:, 2]), turn, other.body, reach, size)


def _line(e: Any, places: Places, every: np.ndarray) -> RecordedLine:
    ends = places.ends(e)
    assert ends is not None
    return RecordedLine(e.name, "link", tuple(places.track(end)[0][every] for end in ends))
