"""The neutral recording of a motion: the one thing that every picture, page and player reads.

A recording holds no physics: times, poses of bodies, end points of lines, and named curves.
World axes are right-handed; a planar recording lies in z = 0 with y up, a spatial one has z up.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Shape:
    """A solid drawn on a body, in the body's axes.

    ``kind`` and ``size`` [m]: ``box`` (x, y, z edges), ``sphere`` (radius,), ``cylinder`` (radius, length; along z),
    ``capsule`` (radius, length between the cap centres; along z), ``cone`` (radius, height; tip at +z),
    ``ellipsoid`` (three semi-axes), ``plate`` (planar outline given in ``outline``, thickness).
    """

    kind: str
    size: tuple[float, ...]
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    outline: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class RecordedBody:
    """A body: its shapes and its pose over time, ``p`` (n, 3) [m] and ``q`` (n, 4) scalar first, world from body."""

    name: str
    shapes: tuple[Shape, ...]
    p: np.ndarray
    q: np.ndarray
    color: str | None = None


@dataclass(frozen=True)
class RecordedLine:
    """A line between two moving points ``a`` and ``b``, each (n, 3) [m].

    ``kind``: ``spring`` (drawn as a coil), ``damper``, ``link`` (a thin rod), ``rope``, ``arrow`` (a force).
    """

    name: str
    kind: str
    a: np.ndarray
    b: np.ndarray
    radius: float | None = None


@dataclass(frozen=True)
class RecordedJoint:
    """A joint's symbol: ``revolute``, ``prismatic``, ``cylindrical``, ``spherical``, ``universal``, ``fixed``.

    It rides on the body named ``body`` ("ground" too) at ``position`` and with its axis along ``axis`` in that
    body's axes.
    """

    name: str
    kind: str
    body: str
    position: tuple[float, float, float]
    axis: tuple[float, float, float]


@dataclass(frozen=True)
class Channel:
    """A curve over time: ``values`` (n,) in ``unit``."""

    name: str
    unit: str
    values: np.ndarray


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
