"""Is a recording complete and consistent? Refused with a message that names what is wrong, before it is shown."""

from __future__ import annotations

import numpy as np

from .recording import SHOW, Channel, RecordedContacts, RecordedLine, RecordedSet, Recording, Shape

SIZES = {"box": 3, "sphere": 1, "cylinder": 2, "capsule": 2, "cone": 2, "ellipsoid": 3, "plate": 1, "mesh": 0}
LINES = ("spring", "damper", "link", "rope", "arrow")
GROUPS = ("reaction", "element", "load")


def check(recording: Recording) -> None:
    """Refuse a recording that a view cannot show.

    Raises
    ------
    ValueError
        If times, shapes of arrays, kinds or references to bodies are wrong.
    """
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
    for many in recording.sets:
        _check_set(many, t.size)
    if recording.contacts is not None:
        _check_contacts(recording.contacts, t.size)
    for line in recording.lines:
        _check_line(line, t.size)
    for arrow in recording.arrows:
        _check_kind(f"arrow {arrow.name!r}", arrow.group, GROUPS)
        _check_kind(f"arrow {arrow.name!r}", arrow.what, ("force", "moment"))
        _check_shape(f"arrow {arrow.name!r}: vector", arrow.vector, (t.size, 3))
    for channel in _channels(recording):
        _check_shape(f"channel {channel.name!r}: values", channel.values, (t.size,))
    for mode in recording.modes:
        if not t[0] <= mode.begin < mode.end <= t[-1]:
            raise ValueError(f"mode {mode.name!r}: from {mode.begin} to {mode.end} is no stretch of the recorded times")
    for mark in recording.marks:
        if not np.isfinite(mark.t):
            raise ValueError(f"mark {mark.text!r}: its time is {mark.t}")
    for name in recording.show:
        _check_kind(f"recording {recording.name!r}: show", name, tuple(SHOW))
    _check_riders(recording)


def _channels(recording: Recording) -> list[Channel]:
    panels = [panel for figure in recording.figures for panel in figure.panels]
    return [*recording.channels, *(c for panel in panels for c in panel.curves)]


def _check_shape(what: str, values: np.ndarray, shape: tuple[int, ...]) -> None:
    if np.shape(values) != shape:
        raise ValueError(f"{what} must have shape {shape}, one row for each time, got {np.shape(values)}")


def _check_kind(what: str, kind: str, known: tuple[str, ...]) -> None:
    if kind not in known:
        raise ValueError(f"{what}: unknown kind {kind!r}, known are {', '.join(known)}")


def _check_line(line: RecordedLine, n: int) -> None:
    _check_kind(f"line {line.name!r}", line.kind, LINES)
    if len(line.points) < 2 or (len(line.points) > 2 and line.kind != "rope"):
        wanted = "two or more points" if line.kind == "rope" else "two points"
        raise ValueError(f"line {line.name!r}: a {line.kind} takes {wanted}, got {len(line.points)}")
    for k, p in enumerate(line.points):
        _check_shape(f"line {line.name!r}: point {k}", p, (n, 3))
    if line.rest is not None:
        _check_shape(f"line {line.name!r}: rest", line.rest, (n,))


def _check_set(many: RecordedSet, n: int) -> None:
    m = np.shape(many.p)[1] if np.ndim(many.p) == 3 else 0
    for what, width in (("p", 3), ("q", 4)):
        _check_shape(f"set {many.name!r}: {what}", getattr(many, what), (n, m, width))
    if many.scale is not None and (np.shape(many.scale) != (m,) or not (np.asarray(many.scale) > 0).all()):
        raise ValueError(f"set {many.name!r}: scale must be {m} positive numbers")
    if not many.shapes:
        raise ValueError(f"set {many.name!r}: it has no shape to draw")
    for shape in many.shapes:
        _check_solid(many.name, shape)


def _check_contacts(contacts: RecordedContacts, n: int) -> None:
    begin, k = np.asarray(contacts.begin), len(contacts.point)
    if begin.shape != (n + 1,) or begin[0] != 0 or begin[-1] != k or (np.diff(begin) < 0).any():
        raise ValueError(f"contacts: begin must ascend from 0 to {k} in {n + 1} steps")
    for what, shape in (("point", (k, 3)), ("force", (k, 3)), ("state", (k,))):
        _check_shape(f"contacts: {what}", getattr(contacts, what), shape)


def _check_solid(body: str, shape: Shape) -> None:
    _check_kind(f"shape of body {body!r}", shape.kind, tuple(SIZES))
    if len(shape.size) != SIZES[shape.kind] or min(shape.size, default=0) < 0:
        raise ValueError(f"body {body!r}: a {shape.kind} takes {SIZES[shape.kind]} lengths, got {shape.size}")
    if shape.kind == "plate" and len(shape.outline) < 3:
        raise ValueError(f"body {body!r}: a plate's outline needs three points at least, got {len(shape.outline)}")
    if shape.kind == "mesh":
        v, t = np.asarray(shape.vertices), np.asarray(shape.triangles)
        if v.ndim != 2 or t.ndim != 2 or v.shape[1] != 3 or t.shape[1] != 3:
            raise ValueError(f"body {body!r}: a mesh takes vertices (k, 3) and triangles (m, 3)")
        if not np.isfinite(v).all() or t.min(initial=0) < 0 or t.max(initial=-1) >= len(v):
            rule = f"its vertices must be finite and its triangles name those {len(v)}"
            raise ValueError(f"body {body!r}: a mesh that cannot be drawn: {rule}")


def _check_riders(recording: Recording) -> None:
    """Whatever rides on a body names one that is there."""
    names = [b.name for b in recording.bodies] + [s.name for s in recording.sets]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise ValueError(f"recording {recording.name!r}: two bodies are named {sorted(twice)[0]!r}")
    known = {*(body.name for body in recording.bodies), "ground"}
    for what in ("joints", "curves", "arrows", "frames", "paths"):
        for rider in getattr(recording, what):
            if rider.body not in known:
                rider_is = f"{what.removesuffix('s')} {rider.name!r}"
                raise ValueError(f"{rider_is} rides on body {rider.body!r}, which the recording does not have")
