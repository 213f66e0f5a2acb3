"""A recording as the bytes that the animation page reads: a JSON header, then one block of numbers.

Poses, points and curves are float32, times float64. Arrays lie column by column with their bytes shuffled (all first
bytes, then all second bytes, ...), which makes smooth motions much smaller once compressed.
"""

from __future__ import annotations

import json
import struct

import numpy as np

from .recording import RecordedBody, Recording, Shape

SIZES = {"box": 3, "sphere": 1, "cylinder": 2, "capsule": 2, "cone": 2, "ellipsoid": 3, "plate": 1}
LINES = ("spring", "damper", "link", "rope", "arrow")
JOINTS = ("revolute", "prismatic", "cylindrical", "spherical", "universal", "fixed")
ALIGNMENT = 8


class _Block:
    """Numbers put one after the other; each ``add`` returns where they went."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.length = 0

    def add(self, values: np.ndarray, kind: str = "f4") -> dict[str, object]:
        columns = np.ascontiguousarray(np.asarray(values, f"<{kind}").T).reshape(-1)
        shuffled = columns.view(np.uint8).reshape(-1, columns.itemsize).T.tobytes()
        padded = shuffled + bytes(-len(shuffled) % ALIGNMENT)
        reference = {"at": self.length, "count": columns.size, "type": kind}
        self.parts.append(padded)
        self.length += len(padded)
        return reference


def payload(recording: Recording) -> bytes:
    """Pack a recording for the page.

    Parameters
    ----------
    recording : Recording
        The motion; it is checked first.

    Returns
    -------
    bytes
        Length of the header (uint32, little-endian), header (UTF-8 JSON), padding to 8 bytes, numbers.
    """
    check(recording)
    block = _Block()
    header = {
        "name": recording.name,
        "planar": bool(recording.planar),
        "size": float(recording.size),
        "notes": {str(term): str(text) for term, text in recording.notes.items()},
        "shown": list(recording.shown),
        "t": block.add(recording.t, "f8"),
        "bodies": [_body(body, block) for body in recording.bodies],
        "lines": [
            {"name": line.name, "kind": line.kind, "radius": _number(line.radius)}
            | {"a": block.add(line.a), "b": block.add(line.b)}
            for line in recording.lines
        ],
        "joints": [
            {"name": joint.name, "kind": joint.kind, "body": joint.body}
            | {"position": _numbers(joint.position), "axis": _numbers(joint.axis)}
            for joint in recording.joints
        ],
        "channels": [
            {"name": channel.name, "unit": channel.unit, "values": block.add(channel.values)}
            for channel in recording.channels
        ],
    }
    text = json.dumps(header, allow_nan=False, separators=(",", ":")).encode()
    head = struct.pack("<I", len(text)) + text
    return head + bytes(-len(head) % ALIGNMENT) + b"".join(block.parts)


def _number(value: float | None) -> float | None:
    return None if value is None else float(value)


def _numbers(values: tuple[float, ...]) -> list[float]:
    return [float(value) for value in values]


def _body(body: RecordedBody, block: _Block) -> dict[str, object]:
    shapes = [
        {"kind": shape.kind, "size": _numbers(shape.size), "position": _numbers(shape.position)}
        | {"quaternion": _numbers(shape.quaternion), "outline": [_numbers(point) for point in shape.outline]}
        for shape in body.shapes
    ]
    poses: dict[str, object] = {"p": block.add(body.p), "q": block.add(_continuous(body.q))}
    return {"name": body.name, "color": body.color, "shapes": shapes, **poses}


def _continuous(q: np.ndarray) -> np.ndarray:
    """Flip signs so that neighbouring quaternions never point apart."""
    q = np.asarray(q, float)
    apart = np.einsum("ij,ij->i", q[1:], q[:-1]) < 0
    signs = np.where(np.cumsum(apart) % 2, -1.0, 1.0)
    return q * np.concatenate([[1.0], signs])[:, None]


def check(recording: Recording) -> None:
    """Refuse a recording that a view cannot show, naming what is wrong with it."""
    t = np.asarray(recording.t)
    if t.ndim != 1 or t.size == 0:
        raise ValueError(f"recording {recording.name!r}: t needs at least one time, got shape {t.shape}")
    if not np.isfinite(t).all() or (np.diff(t) < 0).any():
        raise ValueError(f"recording {recording.name!r}: times must be finite and must not decrease")
    if not (np.isfinite(recording.size) and recording.size > 0):
        raise ValueError(f"recording {recording.name!r}: size must be a positive length, got {recording.size}")
    for body in recording.bodies:
        _check_shape(f"body {body.name!r}: p", body.p, (t.size, 3))
        _check_shape(f"body {body.name!r}: q", body.q, (t.size, 4))
        for shape in body.shapes:
            _check_solid(body.name, shape)
    for line in recording.lines:
        _check_kind(f"line {line.name!r}", line.kind, LINES)
        _check_shape(f"line {line.name!r}: a", line.a, (t.size, 3))
        _check_shape(f"line {line.name!r}: b", line.b, (t.size, 3))
    for channel in recording.channels:
        _check_shape(f"channel {channel.name!r}: values", channel.values, (t.size,))
    _check_joints(recording)


def _check_shape(what: str, values: np.ndarray, shape: tuple[int, ...]) -> None:
    if np.shape(values) != shape:
        raise ValueError(f"{what} must have shape {shape}, one row for each time, got {np.shape(values)}")


def _check_kind(what: str, kind: str, known: tuple[str, ...]) -> None:
    if kind not in known:
        raise ValueError(f"{what}: unknown kind {kind!r}, known are {', '.join(known)}")


def _check_solid(body: str, shape: Shape) -> None:
    _check_kind(f"shape of body {body!r}", shape.kind, tuple(SIZES))
    if len(shape.size) != SIZES[shape.kind] or min(shape.size) < 0:
        raise ValueError(f"body {body!r}: a {shape.kind} takes {SIZES[shape.kind]} lengths, got {shape.size}")
    if shape.kind == "plate" and len(shape.outline) < 3:
        raise ValueError(f"body {body!r}: a plate's outline needs three points at least, got {len(shape.outline)}")


def _check_joints(recording: Recording) -> None:
    names = [body.name for body in recording.bodies]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise ValueError(f"recording {recording.name!r}: two bodies are named {sorted(twice)[0]!r}")
    for joint in recording.joints:
        _check_kind(f"joint {joint.name!r}", joint.kind, JOINTS)
        if joint.body != "ground" and joint.body not in names:
            raise ValueError(f"joint {joint.name!r} rides on body {joint.body!r}, which the recording does not have")
