"""Gear wheels and racks as pictures: pitch circles from the axes' distance, teeth that mesh as drawn."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..model.geometry import matrix_to_quaternion
from .places import End, Places, three
from .recording import RecordedJoint

TEETH = 18  # of the smaller wheel of a pair, where the user gave radii, or too many teeth to be seen
MOST = 120


def gear_pair(e: Any, places: Places) -> Iterator[RecordedJoint]:
    """Two wheels that touch between their axes; plain discs where the axes are not parallel (bevel gears)."""
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
    if abs(a @ b) > 1.0 - 1e-6:
        radii = distance * z / (z[1] - z[0] if inside else z.sum())
        counts = _teeth(z)
        towards = across[0] / distance * (-1.0 if inside else 1.0)
        contacts = (towards, towards if inside else -towards)
    else:
        radii = np.array([np.sqrt(x @ x) for x in across])
        counts, contacts = np.zeros(2, int), (across[0], -across[1])
    for k, wheel in enumerate(wheels):
        x = _seen(places, wheel, contacts[k])
        gap = np.pi / counts[k] if k and counts[k] else 0.0  # a tooth of the first meets a gap of the second
        size = float(radii[k]), float(counts[k]), float(np.arctan2(x[1], x[0]) + gap), float(inside and k == 1)
        yield _symbol(e.name, "gear", wheel, wheel.R, wheels[1 - k].body, size)


def rack(e: Any, places: Places) -> Iterator[RecordedJoint]:
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
    x = _seen(places, pinion, side)
    size = abs(radius), float(TEETH), float(np.arctan2(x[1], x[0])), 0.0
    yield _symbol(e.name, "gear", pinion, pinion.R, bar.body, size)
    # the bar's frame: origin where the two meet as drawn, x along the slide, y towards the pinion
    q, S = places.track(bar)
    body = S[0] @ bar.R.T
    axes = body.T @ np.column_stack([a, -side, np.cross(a, -side)])
    at = bar.p + body.T @ (p + abs(radius) * side - q[0])
    moved = np.einsum("ni,ni->n", q - places.track(pinion)[0], S[:, :, 2])
    moved = moved - moved[0]
    reach = (float(-np.nanmax(moved)), float(-np.nanmin(moved)), 0.0, 0.0, 0.0, 0.0)
    pitch = 2.0 * np.pi * abs(radius) / TEETH
    yield _symbol(e.name, "rack", End(bar.body, at, axes, bar.frame), axes, pinion.body, (abs(radius), pitch), reach)


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
