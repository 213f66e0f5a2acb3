"""What a start could not keep of what was described: positions that assembly moved, velocities that it changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .numbers import number, tuple_of

NAMED = 4  # elements that a line names
WRITTEN = 1e-5  # part by which numbers written with some digits are off
FAST = 100.0  # times the largest velocity that is given or prescribed, above which one that is not given is said
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
        As described, and where or how it starts: of the reference frame, along world axes. Of a velocity that is not
        given, and is far larger than those that are, ``given`` is empty.
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
        a, b = np.array(self.given or (0.0,) * len(self.got)), np.array(self.got)
        if self.what == "orientation":
            # |a - b| = 2 |sin(theta / 4)|, |a + b| = 2 |cos(theta / 4)|; b and -b are the same orientation
            apart, opposite = sorted((float(np.linalg.norm(a - b)), float(np.linalg.norm(a + b))))
            return float(4.0 * np.arctan2(apart, opposite))
        return float(np.linalg.norm(b - a))

    @property
    def text(self) -> str:
        """In words."""
        field = self.what.replace("_", " ")
        size = max(map(abs, (*self.given, *self.got)), default=0.0)
        given = f"given {_numbers(self.given, size)}" if self.given else "not given"
        return f"{field} of {self.element!r}: {given}, got {_numbers(self.got, size)} {self.unit}"

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


def _numbers(values: Sequence[float], size: float) -> str:
    """Components in brackets, one number bare; what is rounding beside ``size`` is 0."""
    return number(values[0], size) if len(values) == 1 else tuple_of(values, 6, size)


def changed_velocities(departures: Sequence[Departure]) -> list[Departure]:
    """Given velocities that were changed by more than the digits that users write, and others that are very large."""
    return [
        d
        for d in departures
        if d.what in VELOCITIES and d.distance > WRITTEN * max(np.linalg.norm(d.given), np.linalg.norm(d.got))
    ]


def not_allowed(d: Departure) -> str:
    """What to say of a velocity that the start does not have, or has unasked, and what to do."""
    if not d.given:
        return (
            f"{d.text}: more than {FAST:g} times the largest velocity that is given; the constraints need it to keep "
            f"given velocities as nearly as they can. Check those, and whether the position is near a dead centre, or "
            f"give {d.element!r} a velocity too"
        )
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
    for what, found in (
        ("velocities that the constraints do not allow", [d for d in changed if d.given]),
        ("velocities far larger than those given", [d for d in changed if not d.given]),
    ):
        if found:
            more = f"; and {len(found) - NAMED} more" if len(found) > NAMED else ""
            text += f"; {what}: {'; '.join(d.text for d in found[:NAMED])}{more}"
    return text
