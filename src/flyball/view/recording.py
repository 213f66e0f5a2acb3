"""The neutral recording of a motion: the one thing that every picture, page and player reads.

A recording holds no physics: times, poses of bodies, lines through moving points, things that ride on bodies, vectors
and named curves. World axes are right-handed; a planar recording lies in z = 0 with y up, a spatial one has z up.
What rides on a body (``"ground"`` too) is given in the axes of that body, from its origin.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

Three = tuple[float, float, float]
Four = tuple[float, float, float, float]
UNTURNED = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Shape:
    """A solid drawn on a body, in the body's axes.

    ``kind`` and ``size`` [m]: ``box`` (x, y, z edges), ``sphere`` (radius,), ``cylinder`` (radius, length; along z),
    ``capsule`` (radius, length between the cap centres; along z), ``cone`` (radius, height; tip at +z),
    ``ellipsoid`` (three semi-axes), ``plate`` (planar outline given in ``outline``, thickness), ``mesh`` (no size;
    ``vertices`` (k, 3) [m] and ``triangles`` (m, 3), indices of vertices, anticlockwise seen from outside).

    A ``hole`` is drawn as a dark opening in the body's other shapes.
    """

    kind: str
    size: tuple[float, ...]
    position: Three = (0.0, 0.0, 0.0)
    quaternion: Four = UNTURNED
    outline: tuple[tuple[float, float], ...] = ()
    vertices: np.ndarray | None = None
    triangles: np.ndarray | None = None
    hole: bool = False


def extent(shape: Shape) -> float:
    """About half the largest length of a shape [m]."""
    if shape.kind == "mesh":
        return 0.5 * float(np.ptp(np.asarray(shape.vertices), axis=0).max(initial=0.0))
    if shape.kind == "plate":
        return 0.5 * float(np.ptp(np.array(shape.outline), axis=0).max())
    round_ones = {"sphere": 1.0, "ellipsoid": 1.0, "box": 0.5}
    if shape.kind in round_ones:
        return round_ones[shape.kind] * max(shape.size)
    radius, length = shape.size
    return max(radius, 0.5 * length + (radius if shape.kind == "capsule" else 0.0))


@dataclass(frozen=True)
class RecordedBody:
    """A body: its shapes and its pose over time, ``p`` (n, 3) [m] and ``q`` (n, 4) scalar first, world from body."""

    name: str
    shapes: tuple[Shape, ...]
    p: np.ndarray
    q: np.ndarray
    color: str | None = None
    opacity: float = 1.0


@dataclass(frozen=True)
class RecordedSet:
    """Many bodies of one shape, named ``name[0]``, ``name[1]``, ...; drawn all at once.

    ``p`` (n, m, 3) [m] and ``q`` (n, m, 4) scalar first, world from body, of m bodies; ``scale`` (m,) of each, if they
    are of several sizes; ``colors`` of each, to choose in turn, if there are several. A body whose pose is nan is not
    drawn.
    """

    name: str
    shapes: tuple[Shape, ...]
    p: np.ndarray
    q: np.ndarray
    colors: tuple[str, ...] = ()
    scale: np.ndarray | None = None


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

    ``kind``: ``spring`` (drawn as a coil), ``damper``, ``link`` (a thin rod), ``rope``, ``arrow``. ``rest`` (n,) [m]
    is the length of an unloaded rope: where the points are closer it hangs loose.
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
    ``plane`` and ``rail`` (what a point or a body slides on), ``point``, ``wheel``, ``roller``, ``gear``, ``rack``,
    ``knife_edge``, ``bushing``; any other kind is drawn as a plain mark.

    It rides on the body named ``body`` at ``position``; ``axis`` is its axis, ``quaternion`` its frame. ``mate`` is
    the other body, ``reach`` the stretch over which the other body's point moves along x, y, z of the symbol's frame
    (low x, high x, low y, ... [m]). ``size`` holds what a kind needs: of ``wheel`` and ``roller`` the radius; of
    ``gear`` radius, number of teeth, angle of a tooth from x, and 1 for teeth that point inwards; of ``rack`` the
    distance of the pitch line from the frame's origin along y, and the distance of its teeth; of ``screw`` the lead.
    ``scale`` makes the symbol smaller where the parts it joins are slender.
    """

    name: str
    kind: str
    body: str
    position: Three
    axis: Three
    quaternion: Four = UNTURNED
    mate: str | None = None
    reach: tuple[float, float, float, float, float, float] | None = None
    size: tuple[float, ...] = ()
    scale: float = 1.0


@dataclass(frozen=True)
class RecordedFrame:
    """Axes that can be shown: a frame on a body; ``of`` is ``joint`` or ``frame``. Bodies' own need no mention."""

    name: str
    of: str
    body: str
    position: Three
    quaternion: Four


@dataclass(frozen=True)
class RecordedArrow:
    """A force or moment on a body over time: ``vector`` (n, 3) [N] or [N m], world axes, acting at ``position``.

    ``group``: ``reaction`` (of joints), ``element`` (springs, motors, drivers), ``load`` (given from outside).
    ``what``: ``force`` or ``moment``.
    """

    name: str
    group: str
    what: str
    body: str
    position: Three
    vector: np.ndarray


@dataclass(frozen=True)
class RecordedPath:
    """The path of a point of a body is drawn."""

    name: str
    body: str
    position: Three = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Channel:
    """A curve over time: ``values`` (n,) in ``unit``."""

    name: str
    unit: str
    values: np.ndarray


@dataclass(frozen=True)
class Panel:
    """Curves of one unit that share an axis; ``label`` is what the axis says, without its unit."""

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
    """What happened at an instant ``t`` [s], as a mark on a time axis: its text, and whether it is a line or a tick.

    ``label`` is what is written above a line if there is room, lower ``rank`` first.
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
    """What a picture shows, and under which title: curves over the times ``t`` (n,) [s], or paths."""

    name: str
    title: str
    t: np.ndarray
    shown: Figure | PointPaths
    marks: tuple[Mark, ...] = ()


@dataclass(frozen=True)
class RecordedMode:
    """A mode: one period of it, from ``begin`` to ``end`` of the recorded times, and what it is.

    ``frequency`` [Hz] is 0 where it does not oscillate, ``omega`` [rad/s] is the size of the eigenvalue. ``shape``
    holds for each moving coordinate its name, unit, size and phase [deg]. The first of all recorded times is at rest.
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
class Recording:
    """One motion, ready to be shown."""

    name: str
    planar: bool
    t: np.ndarray
    bodies: tuple[RecordedBody, ...]
    lines: tuple[RecordedLine, ...] = ()
    joints: tuple[RecordedJoint, ...] = ()
    channels: tuple[Channel, ...] = ()
    shown: tuple[str, ...] = ()  # the channels plotted when the page opens
    size: float = 1.0  # a typical length of the mechanism [m]: joint symbols and coils scale with it
    notes: dict[str, str] = field(default_factory=dict)  # summary lines shown beside the picture
    curves: tuple[RecordedCurve, ...] = ()
    arrows: tuple[RecordedArrow, ...] = ()
    frames: tuple[RecordedFrame, ...] = ()
    paths: tuple[RecordedPath, ...] = ()
    show: tuple[str, ...] = ()  # what is switched on when the page opens: see `SHOW`
    facts: dict[str, tuple[str, ...]] = field(default_factory=dict)  # part -> lines about it, for its card
    figures: tuple[Figure, ...] = ()  # of a report
    down: Three = (0.0, 0.0, 0.0)  # direction of gravity, or zero
    modes: tuple[RecordedMode, ...] = ()  # to choose from, in place of one motion
    sets: tuple[RecordedSet, ...] = ()
    contacts: RecordedContacts | None = None
    marks: tuple[Mark, ...] = ()  # of what happened at instants


SHOW = {
    "reactions": "reaction forces of joints",
    "elements": "forces of springs, motors and drivers",
    "loads": "given forces",
    "contacts": "contact forces",
    "moments": "moments beside forces, wherever those are shown",
    "world": "axes of the world",
    "bodies": "axes of bodies",
    "frames": "axes of joints and named frames",
    "names": "names of bodies",
    "grid": "ground grid",
}
"""What can be switched on and off in a page, and what it is."""
