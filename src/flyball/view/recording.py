"""The recording of a motion that every picture, page and player reads, and the check that it is consistent.

A recording holds no physics: times, poses of bodies, lines through moving points, things that ride on bodies, vectors
and named curves. World axes are right-handed; a planar recording lies in z = 0 with y up, a spatial one has z up.
Objects fixed on a body (or on ``"ground"``) are given in the axes of that body, from its origin.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

Vector3 = tuple[float, float, float]
Quaternion4 = tuple[float, float, float, float]
NO_ROTATION = (1.0, 0.0, 0.0, 0.0)
BODY_COLORS = ("#2f6fb7", "#e58a2b", "#2a9d83", "#c8465a", "#7d63b8", "#d9b02c", "#58b0d8", "#a2572f")
"""Colours of bodies without one of their own, in turn, as on the page."""


@dataclass(frozen=True)
class Shape:
    """A solid drawn on a body, in the body's axes.

    ``kind`` and ``size`` [m]: ``box`` (x, y, z edges), ``sphere`` (radius,), ``cylinder`` (radius, length; along z),
    ``capsule`` (radius, length between the cap centres; along z), ``cone`` (radius, height; tip at +z),
    ``ellipsoid`` (three semi-axes), ``plate`` (planar outline given in ``outline``, thickness), ``mesh`` (no size;
    ``vertices`` (k, 3) [m] and ``triangles`` (m, 3), indices of vertices, anticlockwise seen from outside).

    A ``hole`` is drawn as a dark opening in the body's other shapes; a ``link`` joins them to a joint.
    """

    kind: str
    size: tuple[float, ...]
    position: Vector3 = (0.0, 0.0, 0.0)
    quaternion: Quaternion4 = NO_ROTATION
    outline: tuple[tuple[float, float], ...] = ()
    vertices: np.ndarray | None = None
    triangles: np.ndarray | None = None
    hole: bool = False
    link: bool = False


def scaled_shape(shape: Shape, factor: float) -> Shape:
    """Return a shape enlarged about the body's origin."""
    x, y, z = shape.position
    return replace(
        shape,
        size=tuple(factor * x for x in shape.size),
        position=(factor * x, factor * y, factor * z),
        outline=tuple((factor * x, factor * y) for x, y in shape.outline),
        vertices=None if shape.vertices is None else factor * np.asarray(shape.vertices),
    )


def shape_box(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return the low and high corners of the box around a shape, in the shape's own axes [m]."""
    if shape.kind == "mesh":
        points = np.asarray(shape.vertices, float)
        return points.min(axis=0), points.max(axis=0)
    if shape.kind == "plate":
        points, half = np.array(shape.outline), 0.5 * shape.size[0]
        return np.r_[points.min(axis=0), -half], np.r_[points.max(axis=0), half]
    if shape.kind == "box":
        high = 0.5 * np.array(shape.size)
    elif shape.kind in ("sphere", "ellipsoid"):
        high = np.broadcast_to(shape.size, 3).astype(float)
    else:
        radius, length = shape.size
        high = np.array([radius, radius, 0.5 * length + (radius if shape.kind == "capsule" else 0.0)])
    return -high, high


def half_extent(shape: Shape) -> float:
    """Return about half the largest length of a shape [m]."""
    low, high = shape_box(shape)
    return 0.5 * float((high - low).max())


@dataclass(frozen=True)
class RecordedBody:
    """A body: its shapes and its pose over time, ``p`` (n, 3) [m] and ``q`` (n, 4) scalar first, world from body.

    Shapes of ``ground`` are drawn behind all others in the plane.
    """

    name: str
    shapes: tuple[Shape, ...]
    p: np.ndarray
    q: np.ndarray
    color: str | None = None
    opacity: float = 1.0
    ground: bool = False


@dataclass(frozen=True)
class RecordedSet:
    """A set of bodies of one shape, named ``name[0]``, ``name[1]``, ... or by ``names``; drawn together.

    ``p`` (n, m, 3) [m] and ``q`` (n, m, 4) scalar first, world from body, of m bodies; ``scale`` (m,) if their sizes
    differ; ``colors`` are used in turn, if there are several. A body whose pose is nan is not drawn.
    """

    name: str
    shapes: tuple[Shape, ...]
    p: np.ndarray
    q: np.ndarray
    colors: tuple[str, ...] = ()
    scale: np.ndarray | None = None
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class RecordedContacts:
    """Contact forces as arrows: those of time i are the rows ``begin[i]`` to ``begin[i + 1]``.

    ``point`` (k, 3) [m], ``force`` (k, 3) [N] on the second of two bodies, ``state`` (k,): 0 sticks, 1 slips.
    """

    begin: np.ndarray
    point: np.ndarray
    force: np.ndarray
    state: np.ndarray


@dataclass(frozen=True)
class RecordedLine:
    """A line through two or more moving points, each (n, 3) [m].

    ``kind``: ``spring`` (drawn as a coil), ``damper``, ``link`` (a thin rod), ``rope``, ``arrow``. ``rest`` (n,) [m] is
    the length of an unloaded rope: if the points are closer, it is drawn slack.
    """

    name: str
    kind: str
    points: tuple[np.ndarray, ...]
    radius: float | None = None
    rest: np.ndarray | None = None


@dataclass(frozen=True)
class RecordedCurve:
    """A curve fixed on a body, such as the outline of a cam: ``points`` (k, 3) [m]."""

    name: str
    body: str
    points: np.ndarray
    closed: bool = False


@dataclass(frozen=True)
class RecordedJoint:
    """A joint's symbol.

    ``kind``: ``revolute``, ``prismatic``, ``cylindrical``, ``screw``, ``spherical``, ``universal``, ``fixed``;
    ``plane`` and ``rail`` (on which a point or a body slides), ``point``, ``wheel``, ``roller``, ``gear``, ``rack``,
    ``knife_edge``, ``bushing``; any other kind is drawn as a plain mark.

    It is fixed on the body named ``body`` at ``position``; ``axis`` is its axis, ``quaternion`` its frame. ``mate`` is
    the other body, ``reach`` the range of the other body's point along x, y, z of the symbol's frame (low x, high x,
    low y, ... [m]). ``size`` contains the numbers of each kind: of ``wheel`` and ``roller`` the radius; of ``gear``
    radius, number of teeth, angle of a tooth from x, and 1 for teeth that point inwards; of ``rack`` the distance of
    the pitch line from the frame's origin along y, and the distance of its teeth; of ``screw`` the lead. ``scale``
    makes the symbol smaller where the parts it joins are slender.
    """

    name: str
    kind: str
    body: str
    position: Vector3
    axis: Vector3
    quaternion: Quaternion4 = NO_ROTATION
    mate: str | None = None
    reach: tuple[float, float, float, float, float, float] | None = None
    size: tuple[float, ...] = ()
    scale: float = 1.0


@dataclass(frozen=True)
class RecordedFrame:
    """Axes that can be shown: a frame on a body; ``of`` is ``joint`` or ``frame``. Bodies' own frames are omitted."""

    name: str
    of: str
    body: str
    position: Vector3
    quaternion: Quaternion4


@dataclass(frozen=True)
class RecordedArrow:
    """A force or moment on a body over time: ``vector`` (n, 3) [N] or [N m], world axes, acting at ``position``.

    ``group``: ``reaction`` (of joints), ``element`` (springs, motors, drivers), ``load`` (external). ``what``:
    ``force`` or ``moment``.
    """

    name: str
    group: str
    what: str
    body: str
    position: Vector3
    vector: np.ndarray


@dataclass(frozen=True)
class RecordedPath:
    """The path of a point of a body, to be drawn."""

    name: str
    body: str
    position: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Channel:
    """A curve over time: ``values`` (n,) in ``unit``."""

    name: str
    unit: str
    values: np.ndarray


@dataclass(frozen=True)
class Panel:
    """Curves of one unit that share an axis; ``label`` is the axis label without the unit."""

    label: str
    curves: tuple[Channel, ...]
    note: str = ""

    @property
    def unit(self) -> str:
        """Unit of the axis."""
        return self.curves[0].unit


@dataclass(frozen=True)
class Figure:
    """Panels one below the other, over the same time."""

    name: str
    title: str
    panels: tuple[Panel, ...]
    note: str = ""


@dataclass(frozen=True)
class Mark:
    """An event at the time ``t`` [s], as a mark on a time axis: its text, and whether it is a line or a tick.

    ``label`` is written above a line if there is space, lower ``rank`` first.
    """

    t: float
    text: str
    line: bool = True
    label: str = ""
    rank: int = 0


@dataclass(frozen=True)
class PointPaths:
    """Paths of points by name, each (n, 3) [m], world axes."""

    points: dict[str, np.ndarray]
    planar: bool
    note: str = ""


@dataclass(frozen=True)
class Picture:
    """Title and content of a picture: curves over the times ``t`` (n,) [s], or paths."""

    name: str
    title: str
    t: np.ndarray
    content: Figure | PointPaths
    marks: tuple[Mark, ...] = ()


@dataclass(frozen=True)
class RecordedMode:
    """A mode: one period of it, from ``begin`` to ``end`` of the recorded times, and its properties.

    ``frequency`` [Hz] is 0 if it does not oscillate, ``omega`` [rad/s] is the magnitude of the eigenvalue. ``shape``
    contains name, unit, amplitude and phase [deg] of each moving coordinate. The first of all recorded times is at
    rest.
    """

    name: str
    begin: float
    end: float
    frequency: float
    omega: float
    damping_ratio: float
    kind: str
    shape: tuple[tuple[str, str, float, float], ...] = ()


@dataclass(frozen=True)
class ComparisonTable:
    """Columns and rows of texts beside compared motions; a row of ``curves`` is shown while that curve is plotted."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    curves: tuple[str, ...] = ()


@dataclass(frozen=True)
class MeasuredCurve:
    """Measured values (n,) of a channel, in its unit, at their own times (n,) [s]."""

    name: str
    unit: str
    t: np.ndarray
    values: np.ndarray


@dataclass(frozen=True)
class Compared:
    """What a motion is compared with on its page.

    ``label`` names the motion itself, ``others`` are other motions by label, which are drawn as ghosts.
    """

    label: str
    others: dict[str, Recording] = field(default_factory=dict)
    source: str = ""  # of the measured values
    measured: tuple[MeasuredCurve, ...] = ()
    tables: tuple[ComparisonTable, ...] = ()


@dataclass(frozen=True)
class Recording:
    """One motion, ready for display."""

    name: str
    planar: bool
    t: np.ndarray
    bodies: tuple[RecordedBody, ...]
    lines: tuple[RecordedLine, ...] = ()
    joints: tuple[RecordedJoint, ...] = ()
    channels: tuple[Channel, ...] = ()
    plotted: tuple[str, ...] = ()  # the channels plotted when the page opens
    size: float = 1.0  # a typical length of the mechanism [m]: joint symbols and coils scale with it
    notes: dict[str, str] = field(default_factory=dict)  # summary lines shown beside the picture
    curves: tuple[RecordedCurve, ...] = ()
    arrows: tuple[RecordedArrow, ...] = ()
    frames: tuple[RecordedFrame, ...] = ()
    paths: tuple[RecordedPath, ...] = ()
    show: tuple[str, ...] = ()  # displays switched on when the page opens: see `SHOW_OPTIONS`
    facts: dict[str, tuple[str, ...]] = field(default_factory=dict)  # part -> lines about it, for its card
    figures: tuple[Figure, ...] = ()  # figures of a report
    down: Vector3 = (0.0, 0.0, 0.0)  # direction of gravity, or zero
    modes: tuple[RecordedMode, ...] = ()  # modes to choose from, in place of one motion
    sets: tuple[RecordedSet, ...] = ()
    contacts: RecordedContacts | None = None
    marks: tuple[Mark, ...] = ()  # marks of events
    speed: float = 1.0  # seconds of motion in a second of playing, when the page opens
    remark: str = ""  # shown over the picture
    compared: Compared | None = None


SHOW_OPTIONS = {
    "reactions": "reaction forces of joints",
    "elements": "forces of springs, motors and drivers",
    "loads": "given forces",
    "contacts": "contact forces",
    "moments": "moments, where forces are shown",
    "world": "axes of the world",
    "bodies": "axes of bodies",
    "frames": "axes of joints and named frames",
    "names": "names of bodies",
    "grid": "ground grid",
}
"""Displays that can be switched on and off in a page, with their descriptions."""


SHAPE_SIZES = {"box": 3, "sphere": 1, "cylinder": 2, "capsule": 2, "cone": 2, "ellipsoid": 3, "plate": 1, "mesh": 0}
LINE_KINDS = ("spring", "damper", "link", "rope", "arrow")
RIDERS = ("joints", "curves", "arrows", "frames", "paths")
"""Fields of a recording whose objects are fixed on bodies."""
ARROW_GROUPS = ("reaction", "element", "load")


MIN_GROUPED = 200
"""Number of single bodies of the same shapes from which they are drawn together, as a set."""


def group_bodies(recording: Recording) -> Recording:
    """Return a recording in which many bodies of the same shapes, on which nothing is fixed, are sets."""
    fixed = {rider.body for what in RIDERS for rider in getattr(recording, what)} | {j.mate for j in recording.joints}
    groups: dict[Any, list[RecordedBody]] = {}
    for b in recording.bodies:
        if b.shapes and b.name not in fixed:
            groups.setdefault((b.opacity, tuple(map(_shape_key, b.shapes))), []).append(b)
    many = [g for g in groups.values() if len(g) >= MIN_GROUPED and g[0].opacity == 1.0]
    if not many:
        return recording
    grouped = {b.name for g in many for b in g}
    single = tuple(b for b in recording.bodies if b.name not in grouped)
    return replace(recording, bodies=single, sets=(*recording.sets, *map(_body_set, many)))


def _shape_key(shape: Shape) -> Any:
    mesh = None if shape.vertices is None else (shape.vertices.tobytes(), np.asarray(shape.triangles).tobytes())
    return shape.kind, shape.size, shape.position, shape.quaternion, shape.outline, shape.hole, mesh


def _body_set(bodies: list[RecordedBody]) -> RecordedSet:
    p, q = (np.stack([getattr(b, k) for b in bodies], axis=1) for k in ("p", "q"))
    colored = any(b.color for b in bodies)
    colors = tuple(b.color or BODY_COLORS[k % len(BODY_COLORS)] for k, b in enumerate(bodies)) if colored else ()
    names = tuple(b.name for b in bodies)
    return RecordedSet(f"{names[0]} ... {names[-1]}", bodies[0].shapes, p, q, colors, names=names)


def check_recording(recording: Recording) -> None:
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
        _check_kind(f"arrow {arrow.name!r}", arrow.group, ARROW_GROUPS)
        _check_kind(f"arrow {arrow.name!r}", arrow.what, ("force", "moment"))
        _check_shape(f"arrow {arrow.name!r}: vector", arrow.vector, (t.size, 3))
    for channel in _all_channels(recording):
        _check_shape(f"channel {channel.name!r}: values", channel.values, (t.size,))
    for mode in recording.modes:
        if not t[0] <= mode.begin < mode.end <= t[-1]:
            raise ValueError(f"mode {mode.name!r}: from {mode.begin} to {mode.end} is no stretch of the recorded times")
    for mark in recording.marks:
        if not np.isfinite(mark.t):
            raise ValueError(f"mark {mark.text!r}: its time is {mark.t}")
    for name in recording.show:
        _check_kind(f"recording {recording.name!r}: show", name, tuple(SHOW_OPTIONS))
    _check_riders(recording)


def _all_channels(recording: Recording) -> list[Channel]:
    panels = [panel for figure in recording.figures for panel in figure.panels]
    return [*recording.channels, *(c for panel in panels for c in panel.curves)]


def _check_shape(what: str, values: np.ndarray, shape: tuple[int, ...]) -> None:
    if np.shape(values) != shape:
        raise ValueError(f"{what} must have shape {shape}, one row for each time, got {np.shape(values)}")


def _check_kind(what: str, kind: str, known: tuple[str, ...]) -> None:
    if kind not in known:
        raise ValueError(f"{what}: unknown kind {kind!r}, known are {', '.join(known)}")


def _check_line(line: RecordedLine, n: int) -> None:
    _check_kind(f"line {line.name!r}", line.kind, LINE_KINDS)
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
    if many.names and len(many.names) != m:
        raise ValueError(f"set {many.name!r}: it has {m} members, and {len(many.names)} names")
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
    _check_kind(f"shape of body {body!r}", shape.kind, tuple(SHAPE_SIZES))
    if len(shape.size) != SHAPE_SIZES[shape.kind] or min(shape.size, default=0) < 0:
        raise ValueError(f"body {body!r}: a {shape.kind} takes {SHAPE_SIZES[shape.kind]} lengths, got {shape.size}")
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
    """Check that everything fixed on a body names an existing one."""
    names = [b.name for b in recording.bodies] + [s.name for s in recording.sets]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise ValueError(f"recording {recording.name!r}: two bodies are named {sorted(twice)[0]!r}")
    known = {*(body.name for body in recording.bodies), "ground"}
    for what in RIDERS:
        for rider in getattr(recording, what):
            if rider.body not in known:
                rider_is = f"{what.removesuffix('s')} {rider.name!r}"
                raise ValueError(f"{rider_is} rides on body {rider.body!r}, which the recording does not have")
