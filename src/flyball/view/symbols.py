"""Symbols of joints and couplings: which one, on which body, and how large.

What is drawn follows from the word that an element's class declares (``drawn``). An unknown word gets a plain mark.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..model.geometry import matrix_to_quaternion
from .gears import Wheel, gear_pair, rack
from .places import End, Places, three
from .recording import RecordedCurve, RecordedJoint, RecordedLine

PER_POINT, LEAST, MOST = 8, 120, 600  # points of a drawn profile: for each that was given, and in all
Drawn = RecordedJoint | RecordedCurve | RecordedLine

BODILY = ("gear", "rack", "wheel", "ball")  # symbols that are the body itself, where it has no shape of its own


def symbols(e: Any, places: Places, every: np.ndarray, wheels: list[Wheel]) -> Iterator[Drawn]:
    """What shows a joint, a coupling or a bushing.

    Parameters
    ----------
    e : Joint, Coupling or Force
    places : Places
    every : ndarray of int
        The times that are shown.
    wheels : list of Wheel
        Toothed wheels that are drawn already; new ones are added.
    """
    kind = getattr(e, "drawn", "")
    if kind == "gear":
        yield from gear_pair(e, places, wheels)
    elif kind == "rack":
        yield from rack(e, places, wheels)
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
        outline = cam_outline(numbers)
        if outline is not None:
            closed = bool(getattr(numbers, "closed", True))
            yield RecordedCurve(e.name, F.body, F.p + outline @ F.R.T, closed)
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


def cam_outline(n: Any) -> np.ndarray | None:
    """Points of a cam's profile in its frame, (k, 3): along the C2 spline through the points given, by chord length."""
    if getattr(n, "points", None) is None:
        return None
    from scipy.interpolate import CubicSpline

    p = np.asarray(n.points, float).real[:, :2]
    closed = bool(getattr(n, "closed", True))
    if closed:
        p = np.vstack([p, p[:1]])
    s = np.r_[0.0, np.cumsum(np.sqrt((np.diff(p, axis=0) ** 2).sum(axis=1)))]
    each = max(1, min(max(PER_POINT, LEAST // (len(p) - 1)), MOST // (len(p) - 1)))  # the points given are among them
    at = np.interp(np.arange(each * (len(p) - 1) + (not closed)) / each, np.arange(len(p)), s)
    xy = CubicSpline(s, p, bc_type="periodic" if closed else "natural")(at)
    return np.column_stack([xy, np.zeros(len(xy))])


def _at(e: Any, kind: str, end: End, other: End, places: Places, size: tuple[float, ...] = ()) -> RecordedJoint:
    turn = tuple(matrix_to_quaternion(end.R).tolist())
    reach = places.reach(end, other)
    return RecordedJoint(e.name, kind, end.body, three(end.p), three(end.R[:, 2]), turn, other.body, reach, size)


def _line(e: Any, places: Places, every: np.ndarray) -> RecordedLine:
    ends = places.ends(e)
    assert ends is not None
    return RecordedLine(e.name, "link", tuple(places.track(end)[0][every] for end in ends))
