"""Springs and dampers along a coordinate: a line beside what moves, or a spiral about the axis that turns."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..model.force import CoordinateForce
from ..model.joint import Joint
from .places import End, Places
from .recording import RecordedCurve, RecordedLine

SHORTEST = 0.5  # length of a spring where it is shortest, as part of the mechanism's typical length
PART = 0.3  # and of how far it moves
SPIRAL = (0.03, 0.13)  # radii of a spiral, as parts of the typical length
TURNS, POINTS = 2.75, 120


def spring_along(e: Any, places: Places, every: np.ndarray, size: float) -> RecordedLine | RecordedCurve | None:
    """What shows a spring or damper along a coordinate; None if it is neither, or nothing says where it is.

    Where its other end is held is not described: beyond the places where the coordinate comes, and where it is at rest.
    """
    numbers = places.result.values.numbers[e.name]
    if not isinstance(e, CoordinateForce) or not hasattr(numbers, "stiffness"):
        return None
    if numbers.stiffness == 0.0 and numbers.damping == 0.0:
        return None
    owner, what = places.result.model.coordinate(e.coordinate_text(), e)
    base, moving = frames(e, owner, what, places)
    if base is None or moving is None:
        return None
    if turning(owner, what):
        return _spiral(e, base, np.array(_turn(owner, what)), size)
    return _line(e, numbers, (base, moving, owner, what), places, every, size)


def frames(e: Any, owner: Any, what: str, places: Places) -> tuple[End | None, End | None]:
    """The frame whose axes a coordinate is along or about, and that which moves along or about them."""
    moving = places.end(e.name, "M") or places.end(owner.name, "M")
    if not isinstance(owner, Joint):
        return moving, moving
    return places.end(owner.name, owner.coordinates[what].frames[0]), places.end(owner.name, "M")


def turning(owner: Any, what: str) -> bool:
    """Whether a coordinate is an angle."""
    return owner.coordinates[what].unit == "rad" if isinstance(owner, Joint) else what == "angle"


def axes(owner: Any, what: str, base: End, places: Places) -> np.ndarray:
    """The direction of a coordinate, or its axis, in the world over time, (n, 3)."""
    k = "xyz".index(what) if what in ("x", "y", "z") and not turning(owner, what) else 2
    if not isinstance(owner, Joint):
        return np.tile(np.eye(3)[k], (len(places.result.t), 1))
    return (places.track(base)[1] @ np.array(_turn(owner, what)))[:, :, k]


def _turn(owner: Any, what: str) -> Any:
    """Axes of a coordinate from those of its frame."""
    if not isinstance(owner, Joint):
        return np.eye(3)
    c = owner.coordinates[what]
    turn = getattr(c, f"turn_{c.frames[0]}")
    return turn if len(turn) else np.eye(3)


def _line(
    e: Any, numbers: Any, along: tuple[End, End, Any, str], places: Places, every: np.ndarray, size: float
) -> RecordedLine | None:
    base, moving, owner, what = along
    x = np.asarray(getattr(places.result[e.name], next(iter(e.outputs))))
    if not np.isfinite(x).any():
        return None
    low = min(float(np.nanmin(x)), float(getattr(numbers, "rest", np.inf)))
    held = low - max(SHORTEST * size, PART * float(np.nanmax(x) - low))
    point = places.track(moving)[0]
    foot = point - axes(owner, what, base, places) * (x - held)[:, None]
    kind = "spring" if numbers.stiffness != 0.0 else "damper"
    return RecordedLine(e.name, kind, (foot[every], point[every]))


def _spiral(e: Any, base: End, turn: np.ndarray, size: float) -> RecordedCurve:
    """Fixed on the body that it turns against; it does not wind up."""
    s = np.linspace(0.0, 1.0, POINTS)
    radius, angle = size * np.interp(s, (0.0, 1.0), SPIRAL), 2.0 * np.pi * TURNS * s
    flat = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * s], axis=1)
    return RecordedCurve(e.name, base.body, base.p + flat @ (base.R @ turn).T)
