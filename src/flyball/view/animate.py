"""From a result to a recording: poses, lines between moving points, joint symbols, curves, and what to show first."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from ..forces.point_force import PointForce
from ..forces.spring_damper import SpringDamper
from ..joints.distance import Distance
from ..model.body import GROUND
from ..model.force import TwoPointForce
from .looks import Looks
from .recording import Channel, RecordedBody, RecordedJoint, RecordedLine, Recording

if TYPE_CHECKING:
    from ..model.element import Element
    from ..results.result import Result

FRAMES = 2000  # times in a recording, about
CURVES = 60


def animation(result: Result) -> str:
    """The animation page of a result: one HTML document that needs nothing else."""
    from .page import page

    return page(record(result))


def record(result: Result) -> Recording:
    """Make the recording that pictures and pages read.

    Bodies are placed by their reference frames, so that shapes lie on them as the user gave them. Bodies without
    shapes get some that follow from their joints and inertia.
    """
    every = kept(len(result.t))
    looks = Looks(result)
    bodies = tuple(
        RecordedBody(b.name, looks.shapes(b.name), *_poses(result, b.name, every), b.color) for b in result.model.bodies
    )
    channels = _channels(result, every)
    return Recording(
        name=result.model.name,
        planar=result.planar,
        t=result.t[every],
        bodies=bodies,
        lines=tuple(_lines(result, every, looks.size)),
        joints=tuple(_joints(result, looks)),
        channels=channels,
        shown=shown(result, [c.name for c in channels]),
        size=looks.size,
        notes=dict(result.health.lines()),
    )


def kept(n: int) -> np.ndarray:
    """Indices of the times that are shown: all, or about 2000 evenly chosen, first and last among them."""
    return np.arange(n) if n <= FRAMES * 1.25 else np.unique(np.linspace(0, n - 1, FRAMES).round().astype(int))


def _poses(result: Result, name: str, every: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position and quaternion of a body's reference frame."""
    view = result[name]
    p = np.zeros((len(every), 3))
    p[:, : 2 if result.planar else 3] = view.position[every]
    if not result.planar:
        return p, view.quaternion[every]
    half = 0.5 * view.angle[every]
    return p, np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)


def _point(result: Result, name: str, role: str, every: np.ndarray) -> np.ndarray:
    """Origin of an element's frame over time, (n, 3)."""
    k = result.values.structure.frame_at[name, role, ""]
    return np.stack([np.broadcast_to(c, len(result.t))[every] for c in result.records.frame(k)[0]], axis=1)


def _lines(result: Result, every: np.ndarray, size: float) -> list[RecordedLine]:
    """Springs, dampers, links, and the arrows of given forces."""
    out = []

    def between(e: Element, kind: str) -> None:
        a, b = (_point(result, e.name, role, every) for role in "FM")
        out.append(RecordedLine(e.name, kind, a, b))

    for e in result.model.forces:
        if isinstance(e, TwoPointForce):
            soft = isinstance(e, SpringDamper) and result.values.numbers[e.name].stiffness != 0.0
            between(e, "spring" if soft else "damper")
        elif isinstance(e, PointForce):
            force = result[e.name].wrench[0][every]
            largest = np.sqrt((force**2).sum(axis=1)).max(initial=0.0)
            if 0.0 < largest < np.inf:
                a = _point(result, e.name, "M", every)
                out.append(RecordedLine(e.name, "arrow", a, a + force * (0.6 * size / largest)))
    for joint in result.model.joints:
        if isinstance(joint, Distance):
            between(joint, "link")
    return out


def _joints(result: Result, looks: Looks) -> list[RecordedJoint]:
    """Symbols, riding on ground where the joint is fixed there, else on the first body."""
    out = []
    for e in result.model.joints:
        if isinstance(e, Distance):
            continue
        ends = [looks.end(e.name, role) for role in "FM"]
        body, p, R = ends[1] if ends[1][0] == GROUND else ends[0]
        out.append(RecordedJoint(e.name, e.drawn, body, tuple(p.tolist()), tuple(R[:, 2].tolist())))
    return out


def _channels(result: Result, every: np.ndarray) -> tuple[Channel, ...]:
    """All curves of a small mechanism; of a big one energies, drivers, forces, joint coordinates, then bodies."""
    if 8 * (len(result.model.bodies) + len(result.model.joints)) <= 400:
        curves = result.channels()
        curves = {k: c for k, c in curves.items() if np.isfinite(c[1]).any()}
        names = list(curves) if len(curves) <= CURVES else _telling(list(curves), result)
    else:
        curves = {f"energy.{k}": c for k, c in result.energy.channels().items()}
        for e in _parts(result):
            if len(curves) >= CURVES:
                break
            curves |= {
                f"{e.name}.{k}": c for k, c in result[e.name].channels().items() if _main(f"{e.name}.{k}", result)
            }
        names = list(curves)[:CURVES]
    return tuple(Channel(k, curves[k][0], np.asarray(curves[k][1], float)[every]) for k in names)


def _parts(result: Result) -> list:
    m = result.model
    return [*m.drivers, *m.forces, *m.joints, *m.bodies]


def _main(name: str, result: Result) -> bool:
    """Whether a curve says where something is, or what a driver or force does: no derivative, no reaction."""
    owner, _, what = name.partition(".")
    if owner == "energy" or any(e.name == owner for e in (*result.model.drivers, *result.model.forces)):
        return True
    return what in ("x", "y", "z", "angle") or what in getattr(result.model[owner], "coordinates", {})


def _telling(names: list[str], result: Result) -> list[str]:
    """At most as many names as are shown, those that say most; in their order."""
    rank = {k: (not _main(k, result), i) for i, k in enumerate(names)}
    chosen = set(sorted(names, key=rank.__getitem__)[:CURVES])
    return [k for k in names if k in chosen]


def shown(result: Result, names: Collection[str]) -> tuple[str, ...]:
    """The curves on show when a page opens: what a driver needs, a joint's coordinate (else a position), energies."""
    m = result.model
    wanted = (
        [f"{d.name}.effort" for d in m.drivers],
        [f"{j.name}.{k}" for j in m.joints for k in j.coordinates],
        [f"{b.name}.{k}" for b in m.bodies for k in ("x", "z")],
    )
    groups = [[k for k in group if k in names][:1] for group in wanted]
    first = [k for group in groups[:2] for k in group] or groups[2]
    return (*first, *(k for k in ("energy.kinetic", "energy.total") if k in names))
