"""A recording as the bytes that the animation page reads: a JSON header, then one block of numbers.

Poses, points and curves are float32, times float64, corners of triangles integers. Arrays lie column by column with
their bytes shuffled (all first bytes, then all second bytes, ...), which makes smooth motions much smaller once
compressed. Equal arrays are stored once.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import numpy as np

from .packing import orientations, positions, rooted
from .recording import Channel, RecordedContacts, RecordedSet, Recording, Shape, extent
from .recording_check import check

ALIGNMENT = 8


class _Block:
    """Numbers put one after the other; each ``add`` returns where they went."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.length = 0
        self.known: dict[bytes, dict[str, object]] = {}

    def add(self, values: np.ndarray, kind: str = "f4") -> dict[str, object]:
        columns = np.ascontiguousarray(np.asarray(values).astype(f"<{kind}").T).reshape(-1)
        shuffled = columns.view(np.uint8).reshape(-1, columns.itemsize).T.tobytes()
        if shuffled not in self.known:
            padded = shuffled + bytes(-len(shuffled) % ALIGNMENT)
            self.known[shuffled] = {"at": self.length, "count": columns.size, "type": kind}
            self.parts.append(padded)
            self.length += len(padded)
        reference = self.known[shuffled]
        return reference if reference["type"] == kind else reference | {"count": columns.size, "type": kind}


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
        "show": list(recording.show),
        "facts": {part: list(lines) for part, lines in recording.facts.items()},
        "down": _numbers(recording.down),
        "t": block.add(recording.t, "f8"),
        "bodies": [
            {
                "name": b.name,
                "color": b.color,
                "opacity": float(b.opacity),
                "shapes": [_shape(s, block) for s in b.shapes],
            }
            | {"p": block.add(b.p), "q": block.add(_continuous(b.q))}
            for b in recording.bodies
        ],
        "sets": [_many(many, block) for many in recording.sets],
        "contacts": None if recording.contacts is None else _contacts(recording.contacts, block),
        "lines": [
            {"name": line.name, "kind": line.kind, "radius": _number(line.radius)}
            | {"points": [block.add(p) for p in line.points]}
            | {"rest": None if line.rest is None else block.add(line.rest)}
            for line in recording.lines
        ],
        "joints": [_riding(j, "kind", "mate", "reach", "size", "scale", "axis") for j in recording.joints],
        "curves": [
            {"name": c.name, "body": c.body, "closed": bool(c.closed), "points": block.add(c.points)}
            for c in recording.curves
        ],
        "arrows": [_riding(a, "group", "what") | {"vector": block.add(a.vector)} for a in recording.arrows],
        "frames": [_riding(f, "of") for f in recording.frames],
        "paths": [_riding(p) for p in recording.paths],
        "marks": [asdict(m) | {"t": float(m.t)} for m in recording.marks],
        "modes": [asdict(mode) for mode in recording.modes],
        "channels": _curves(recording.channels, block),
        "figures": [
            {"name": f.name, "title": f.title, "note": f.note}
            | {"panels": [{"label": p.label, "note": p.note, "curves": _curves(p.curves, block)} for p in f.panels]}
            for f in recording.figures
        ],
    }
    text = json.dumps(header, allow_nan=False, separators=(",", ":")).encode()
    head = struct.pack("<I", len(text)) + text
    return head + bytes(-len(head) % ALIGNMENT) + b"".join(block.parts)


def _number(value: float | None) -> float | None:
    return None if value is None else float(value)


def _numbers(values: Iterable[float]) -> list[float]:
    return [float(value) for value in values]


def _riding(thing: Any, *more: str) -> dict[str, object]:
    """Something that rides on a body: name, body, place, and further fields."""
    out: dict[str, object] = {"name": thing.name, "body": thing.body, "position": _numbers(thing.position)}
    if hasattr(thing, "quaternion"):
        out["quaternion"] = _numbers(thing.quaternion)
    for name in more:
        value = getattr(thing, name)
        out[name] = _numbers(value) if isinstance(value, (tuple, list)) else value
    return out


def _curves(channels: Iterable[Channel], block: _Block) -> list[dict[str, object]]:
    return [{"name": c.name, "unit": c.unit, "values": block.add(c.values)} for c in channels]


def _shape(shape: Shape, block: _Block) -> dict[str, object]:
    out: dict[str, object] = {"kind": shape.kind, "size": _numbers(shape.size), "position": _numbers(shape.position)}
    out |= {"quaternion": _numbers(shape.quaternion), "outline": [_numbers(point) for point in shape.outline]}
    out["hole"] = bool(shape.hole)
    if shape.vertices is not None and shape.triangles is not None:
        kind = "u2" if len(shape.vertices) <= 65_535 else "u4"
        return out | {"vertices": block.add(shape.vertices), "triangles": block.add(shape.triangles, kind)}
    return out


def _many(many: RecordedSet, block: _Block) -> dict[str, object]:
    """A set of bodies: its poses as `packing` has them."""
    size = min((extent(shape) for shape in many.shapes), default=1.0)
    size *= 1.0 if many.scale is None else float(np.min(many.scale, initial=np.inf))
    p, about = positions(np.asarray(many.p, float), size)
    kind = str(about.pop("type"))
    out: dict[str, object] = {"name": many.name, "colors": list(many.colors), "count": int(np.shape(many.p)[1])}
    out |= {"shapes": [_shape(s, block) for s in many.shapes], "p": block.add(p, kind)} | about
    out["q"] = block.add(orientations(np.asarray(many.q, float)), "u2")
    return out | {"scale": None if many.scale is None else block.add(many.scale)}


def _contacts(contacts: RecordedContacts, block: _Block) -> dict[str, object]:
    """Contact forces, each component by itself."""
    point = np.asarray(contacts.point, float)
    low = point.min(axis=0, initial=np.inf) if len(point) else np.zeros(3)
    step = float((point - low).max(initial=0.0)) / 65_535 or 1.0
    force, largest = rooted(np.asarray(contacts.force, float))
    return {
        "begin": block.add(contacts.begin, "u4"),
        "point": block.add(np.rint((point - low) / step).astype(np.int64), "u2"),
        "low": _numbers(low),
        "step": step,
        "force": block.add(force, "u2"),
        "largest": largest,
        "state": block.add(contacts.state, "u1"),
    }


def _continuous(q: np.ndarray) -> np.ndarray:
    """Flip signs so that neighbouring quaternions never point apart."""
    q = np.asarray(q, float)
    apart = np.einsum("ij,ij->i", q[1:], q[:-1]) < 0
    signs = np.where(np.cumsum(apart) % 2, -1.0, 1.0)
    return q * np.concatenate([[1.0], signs])[:, None]
