"""Forces and moments as arrows: reactions of joints, what springs, motors and drivers do, and given loads."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.force import BodyForce, CoordinateForce
from .along import axes, frames, turning
from .figures import some
from .places import End, Places, three
from .recording import RecordedArrow

if TYPE_CHECKING:
    from ..results.result import Result

FAINT = 1e-5  # arrows that never reach this part of the largest of their kind cannot be seen and are left out
NUMBERS = 600_000  # in the arrows of a recording, at most


def arrows(result: Result, places: Places, every: np.ndarray, instead: np.ndarray) -> tuple[RecordedArrow, ...]:
    """Every arrow that can be seen; of a mechanism with very many parts those of evenly chosen ones.

    Reactions are those on ``body_j`` at the joint's point there. What acts along a line, a spring for instance, acts
    on both of its ends; ends on ground are left out. ``instead`` are times to take where there is no value at a time.
    """
    most = max(1, NUMBERS // (3 * len(every)))
    out = [
        RecordedArrow(name, group, what, end.body, three(end.p), _known(vector, every, instead))
        for name, group, what, end, vector in _all(result, places, most)
        if np.isfinite(vector).any()
    ]
    size = [float(np.nanmax(np.abs(a.vector), initial=0.0)) for a in out]
    largest = {what: max((s for a, s in zip(out, size) if a.what == what), default=0.0) for what in ("force", "moment")}
    seen = [k for k, a in enumerate(out) if size[k] > FAINT * largest[a.what]]
    rank = sorted(seen, key=lambda k: -size[k] / largest[out[k].what])
    return tuple(out[k] for k in sorted(rank[:most]))


def _known(vector: np.ndarray, every: np.ndarray, instead: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(vector[every]).all(axis=1)[:, None], vector[every], vector[instead])


Found = tuple[str, str, str, End, np.ndarray]


def _all(result: Result, places: Places, most: int) -> Iterator[Found]:
    for joint in some(result.model.joints, most):
        M = places.end(joint.name, "M")
        if M is not None:
            force, torque = result[joint.name].reaction()
            yield from _pair(joint.name, "reaction", M, force, torque)
    for e in some([*result.model.forces, *result.model.limits], most):
        yield from _force(result, places, e)
    for driver in result.model.drivers:
        yield from _along(result, places, driver.name, driver.coordinate, result[driver.name].effort)


def _pair(name: str, group: str, end: End, force: np.ndarray, torque: np.ndarray) -> Iterator[Found]:
    for what, vector in (("force", force), ("moment", torque)):
        if np.any(vector):
            yield name, group, what, end, vector


def _force(result: Result, places: Places, e: Any) -> Iterator[Found]:
    """A force element's arrows, by what it acts on: a rope's points, a coordinate, or frames."""
    view = result[e.name]
    if places.end(e.name, "P0") is not None:
        yield from _rope(places, e.name, view)
        return
    M = places.end(e.name, "M")
    if M is None:
        texts = e.along() if isinstance(e, CoordinateForce) else ()
        effort = getattr(view, list(e.outputs)[2]) if texts else None
        weights = e.switch_weights(result.values.numbers[e.name], "") if texts else ()
        for text, weight in zip(texts, weights or (1.0,) * len(texts), strict=True):
            yield from _along(result, places, e.name, text, weight * effort)
        return
    force, torque = view.wrench
    if isinstance(e, BodyForce):
        yield from _pair(e.name, "load", M, force, torque)
        return
    F = places.end(e.name, "F")
    if not M.grounded:
        yield from _pair(e.name, "element", M, force, torque)
    if F is not None and not F.grounded and (M.grounded or e.drawn in ("spring", "damper")):
        yield from _pair(e.name, "element", F, -force, -torque)


def _rope(places: Places, name: str, view: Any) -> Iterator[Found]:
    """The rope pulls each of its points towards its neighbours."""
    ends = rope_ends(places, name)
    points = [places.track(end)[0] for end in ends]
    steps = [b - a for a, b in pairwise(points)]
    units = [d / np.maximum(np.sqrt((d * d).sum(axis=1)), 1e-300)[:, None] for d in steps]
    nothing = np.zeros_like(points[0])
    for k, end in enumerate(ends):
        after = units[k] if k < len(units) else nothing
        before = units[k - 1] if k > 0 else nothing
        if not end.grounded:
            yield name, "element", "force", end, view.tension[:, None] * (after - before)


def rope_ends(places: Places, name: str) -> list[End]:
    """The frames P0, P1, ... of an element that runs over several points."""
    out: list[End] = []
    while (end := places.end(name, f"P{len(out)}")) is not None:
        out.append(end)
    return out


def _along(result: Result, places: Places, name: str, coordinate: str, effort: np.ndarray) -> Iterator[Found]:
    """An effort along a coordinate of a joint or a point: a force or moment on the second body."""
    e = result.model[name]
    owner, what = result.model.coordinate(coordinate, e)
    base, end = frames(e, owner, what, places)
    if base is not None and end is not None:
        kind = "moment" if turning(owner, what) else "force"
        yield name, "element", kind, end, effort[:, None] * axes(owner, what, base, places)
