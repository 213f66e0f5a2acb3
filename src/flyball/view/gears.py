"""Gear wheels and racks as pictures: pitch circles from the axes' distance, teeth that mesh as drawn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..model.geometry import matrix_to_quaternion
from .places import End, Places, three
from .recording import RecordedJoint

TEETH = 18  # of the smaller wheel of a pair, where the user gave radii, or too many teeth to be seen
MOST = 120


@dataclass(frozen=True)
class Wheel:
    """A wheel that is drawn: on which body, of what radius, how many teeth, and which way one points at the start."""

    body: str
    radius: float
    teeth: int
    tooth: np.ndarray


def gear_pair(e: Any, places: Places, drawn: list[Wheel]) -> Iterator[RecordedJoint]:
    """Two wheels that touch between their axes; plain discs where the axes are not parallel (bevel gears).

    Wheels that are ``drawn`` already, for another pair, are left as they are, and the other one fits them.
    """
    model = places.result.model
    wheels = _movers(places, model[e.joint_1], model[e.joint_2])
    if wheels is None or not len(places.result.t):
        return
    (p, a), (q, b) = (_start(places, w) for w in wheels)
    z = np.array(places.result.values.numbers[e.name].teeth, float)
    inside = bool(getattr(e, "internal", False))
    d = q - p
    across = [d - (d @ n) * n for n in (a, b)]
    distance = float(np.sqrt(across[0] @ across[0]))
    if distance <= 1e-9 * places.result.values.length or (inside and z[1] <= z[0]):
        return
    if abs(a @ b) <= 1.0 - 1e-6:
        for wheel, other, arm in zip(wheels, wheels[::-1], across, strict=True):
            yield _symbol(e.name, "gear", wheel, wheel.R, other.body, (float(np.sqrt(arm @ arm)), 0.0, 0.0, 0.0))
        return
    radii = distance * z / (z[1] - z[0] if inside else z.sum())
    towards = across[0] / distance * (-1.0 if inside else 1.0)
    pair = _Pair(a, b, (towards, towards if inside else -towards), inside)
    counts = _teeth(z)
    known = [_known(drawn, w.body, float(r), int(n)) for w, r, n in zip(wheels, radii, counts, strict=True)]
    for k, tooth in enumerate(pair.teeth(known, counts)):
        if known[k] is not None:
            continue
        drawn.append(Wheel(wheels[k].body, float(radii[k]), int(counts[k]), tooth))
        x = _seen(places, wheels[k], tooth)
        size = float(radii[k]), float(counts[k]), float(np.arctan2(x[1], x[0])), float(inside and k == 1)
        yield _symbol(e.name, "gear", wheels[k], wheels[k].R, wheels[1 - k].body, size)


@dataclass(frozen=True)
class _Pair:
    """Where two wheels with parallel axes a and b meet, seen from the centre of each."""

    a: np.ndarray
    b: np.ndarray
    contacts: tuple[np.ndarray, np.ndarray]
    inside: bool

    def teeth(self, known: Sequence[Wheel | None], counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A tooth of each, so that they mesh.

        With f the angle from the contact to a tooth in pitches, and s = +1 or -1 as the axes point alike or not: teeth
        meet gaps where f_1 + s f_2 = 1/2 for wheels that turn against one another, f_1 - s f_2 = 1/2 inside a ring.
        """
        s = (-1.0 if self.inside else 1.0) * np.sign(self.a @ self.b)
        f = [self.offset(k, w.tooth, w.teeth) if w is not None else None for k, w in enumerate(known)]
        one = f[0] if f[0] is not None else 0.5 - s * f[1] if f[1] is not None else 0.0
        other = f[1] if f[1] is not None else s * (0.5 - one)
        return self.turned(0, one / counts[0]), self.turned(1, other / counts[1])

    def offset(self, k: int, tooth: np.ndarray, count: int) -> float:
        """Angle from the contact to a tooth, in pitches, about the wheel's axis."""
        return _angle((self.a, self.b)[k], self.contacts[k], tooth) * count / (2.0 * np.pi)

    def turned(self, k: int, turns: float) -> np.ndarray:
        """The direction of the contact turned about the wheel's axis."""
        return _turned((self.a, self.b)[k], self.contacts[k], 2.0 * np.pi * turns)


def _known(drawn: Sequence[Wheel], body: str, radius: float, teeth: int) -> Wheel | None:
    return next(
        (w for w in drawn if w.body == body and w.teeth == teeth and abs(w.radius - radius) < 1e-3 * radius), None
    )


def _angle(axis: np.ndarray, start: np.ndarray, end: np.ndarray) -> float:
    """Angle from one direction to another about an axis that is square to both [rad]."""
    return float(np.arctan2(np.cross(start, end) @ axis, start @ end))


def _turned(axis: np.ndarray, direction: np.ndarray, angle: float) -> np.ndarray:
    return np.cos(angle) * direction + np.sin(angle) * np.cross(axis, direction)


def rack(e: Any, places: Places, drawn: list[Wheel]) -> Iterator[RecordedJoint]:
    """The pinion, and the toothed bar whose pitch line passes the pinion's centre at its radius."""
    model = places.result.model
    movers = _movers(places, model[e.pinion], model[e.rack])
    if movers is None or not len(places.result.t):
        return
    pinion, bar = movers
    radius = float(places.result.values.numbers[e.name].radius)
    (p, n), (_, a) = (_start(places, w) for w in movers)
    for end, joint in ((pinion, model[e.pinion]), (bar, model[e.rack])):
        if end.body == model.carrier(joint.body_i, joint):  # its coordinate is that of the other body
            radius = -radius
    # displacement = radius * angle: the rim that goes along +a lies at a x n
    side = np.cross(a, n) * np.sign(radius)
    radius = abs(radius)
    same = [w for w in drawn if w.body == pinion.body and abs(w.radius - radius) < 1e-3 * radius]
    wheel = same[0] if same else Wheel(pinion.body, radius, TEETH, side)
    if not same:
        drawn.append(wheel)
        x = _seen(places, pinion, side)
        size = radius, float(TEETH), float(np.arctan2(x[1], x[0])), 0.0
        yield _symbol(e.name, "gear", pinion, pinion.R, bar.body, size)
    # the bar's frame: origin in a gap where the two meet as drawn, x along the slide, y towards the pinion
    q, S = places.track(bar)
    body = S[0] @ bar.R.T
    axes = body.T @ np.column_stack([a, -side, np.cross(a, -side)])
    shift = radius * _angle(n, side, wheel.tooth) * np.cross(n, side)
    at = bar.p + body.T @ (p + radius * side + shift - q[0])
    moved = np.einsum("ni,ni->n", q - places.track(pinion)[0], S[:, :, 2])
    moved = moved - moved[0] + shift @ a
    reach = (float(-np.nanmax(moved)), float(-np.nanmin(moved)), 0.0, 0.0, 0.0, 0.0)
    pitch = 2.0 * np.pi * radius / wheel.teeth
    yield _symbol(e.name, "rack", End(bar.body, at, axes, bar.frame), axes, pinion.body, (radius, pitch), reach)


def _movers(places: Places, first: Any, second: Any) -> tuple[End, End] | None:
    """Of two joints on one carrier the ends that are not on it; else the ends that move, of two the second."""
    pairs = [places.ends(joint) for joint in (first, second)]
    if pairs[0] is None or pairs[1] is None:
        return None
    common = {end.body for end in pairs[0]} & {end.body for end in pairs[1]}
    out = []
    for pair in pairs:
        assert pair is not None
        free = [end for end in pair if end.body not in common] if len(common) == 1 else []
        out.append(free[0] if free else pair[0] if pair[1].grounded else pair[1])
    return out[0], out[1]


def _start(places: Places, end: End) -> tuple[np.ndarray, np.ndarray]:
    """Origin and z axis of a frame in the world, at the first time."""
    p, R = places.track(end)
    return p[0], R[0][:, 2]


def _seen(places: Places, end: End, direction: np.ndarray) -> np.ndarray:
    """A direction in the world, seen in a frame at the first time."""
    return places.track(end)[1][0].T @ direction


def _symbol(
    name: str, kind: str, end: End, R: np.ndarray, mate: str, size: tuple[float, ...], reach: Any = None
) -> RecordedJoint:
    turn = tuple(matrix_to_quaternion(R).tolist())
    return RecordedJoint(name, kind, end.body, three(end.p), three(R[:, 2]), turn, mate, reach, size)


def _teeth(z: np.ndarray) -> np.ndarray:
    """Numbers of teeth to draw: the user's where they are whole and can be seen, else in the same ratio, about."""
    if (z == z.round()).all() and z.min() >= 6 and z.max() <= MOST:
        return z.astype(int)
    return np.clip((z / z.min() * TEETH).round(), 3, MOST).astype(int)
