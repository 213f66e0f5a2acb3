"""What a start could not keep of what was described: positions that assembly moved, velocities that it changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .numbers import number, tuple_of

NAMED = 4  # elements that a line names
WRITTEN = 1e-5  # part by which numbers written with some digits are off
VELOCITIES = ("velocity", "angular_velocity")


@dataclass(frozen=True)
class Departure:
    """A number of the description that the start does not have.

    Attributes
    ----------
    element : str
        The body.
    what : str
        Its field: ``"position"``, ``"angle"``, ``"orientation"`` (quaternion), ``"velocity"``, ``"angular_velocity"``.
    given, got : tuple of float
        As described, and where or how it starts: of the reference frame, along world axes.
    unit : str
    """

    element: str
    what: str
    given: tuple[float, ...]
    got: tuple[float, ...]
    unit: str

    @property
    def distance(self) -> float:
        """How far apart these are [unit]; of orientations the angle of the turn between them [rad]."""
        a, b = np.array(self.given), np.array(self.got)
        if self.what == "orientation":
            # |a - b| = 2 |sin(theta / 4)|, |a + b| = 2 |cos(theta / 4)|; b and -b are the same orientation
            apart, opposite = sorted((float(np.linalg.norm(a - b)), float(np.linalg.norm(a + b))))
            return float(4.0 * np.arctan2(apart, opposite))
        return float(np.linalg.norm(b - a))

    @property
    def text(self) -> str:
        """In words."""
        field = self.what.replace("_", " ")
        return f"{field} of {self.element!r}: given {_numbers(self.given)}, got {_numbers(self.got)} {self.unit}"

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "element": self.element,
            "what": self.what,
            "given": list(self.given),
            "got": list(self.got),
            "unit": self.unit,
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Departure:
        """As `as_dict` gave it."""
        return cls(**{**data, "given": tuple(data["given"]), "got": tuple(data["got"])})


def _numbers(values: Sequence[float]) -> str:
    """Components in brackets, one number bare; rounding beside the others is 0."""
    return number(values[0]) if len(values) == 1 else tuple_of(values, 6)


def changed_velocities(departures: Sequence[Departure]) -> list[Departure]:
    """Given velocities that were changed by more than the digits that users write."""
    return [
        d
        for d in departures
        if d.what in VELOCITIES and d.distance > WRITTEN * max(np.linalg.norm(d.given), np.linalg.norm(d.got))
    ]


def not_allowed(d: Departure) -> str:
    """What to say of a velocity that the start does not have, and what to do."""
    return (
        f"{d.text}: joints, drivers or other given velocities do not allow it; the nearest was taken. Correct it, or "
        f"leave it out: what is not given is free"
    )


def summary(departures: Sequence[Departure]) -> str:
    """One line: what assembly moved, and which velocities it could not keep."""
    moved: dict[str, Departure] = {}
    for d in departures:
        if d.what not in VELOCITIES and (d.element not in moved or d.what == "position"):
            moved[d.element] = d
    text = "closed as drawn"
    if moved:
        count = f"{len(moved)} {'body' if len(moved) == 1 else 'bodies'}"
        worst = max(moved.values(), key=lambda d: (d.what == "position", d.distance))
        far = (
            f"{worst.distance:.3g} m" if worst.what == "position" else f"turned by {np.degrees(worst.distance):.3g} deg"
        )
        text = f"closed after moving {count}, {worst.element} farthest: {far}"
    changed = changed_velocities(departures)
    if changed:
        more = f"; and {len(changed) - NAMED} more" if len(changed) > NAMED else ""
        text += f"; velocities that the constraints do not allow: {'; '.join(d.text for d in changed[:NAMED])}{more}"
    return text
