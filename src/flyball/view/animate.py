"""From a result to a recording: poses, lines, symbols, arrows, curves, and what to show first."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import ModelError
from ..model.body import GROUND, Body, Frame
from ..model.controller import Controller
from ..model.geometry import matrix_to_quaternion, vector
from ..model.model import suggest
from .along import spring_along
from .arrows import arrows, rope_ends
from .edged import with_edges
from .facts import facts
from .gears import Wheel
from .looks import Looks
from .marks import marks
from .places import Places, three
from .recording import (
    SHOW,
    Channel,
    RecordedBody,
    RecordedCurve,
    RecordedFrame,
    RecordedJoint,
    RecordedLine,
    RecordedPath,
    Recording,
)
from .scene import crowds, grounds, touches
from .symbols import Drawn, symbols

if TYPE_CHECKING:
    from ..results.result import Result

FRAMES = 2000  # times in a recording, about
POSES = 1_500_000  # of members of sets in a recording, at most
CURVES = 60
USUAL = ("loads", "moments", "grid")

Path = str | tuple[str, Any]


def animation(result: Result, *, paths: Iterable[Path] = (), show: Collection[str] = USUAL) -> str:
    """The animation page of a result: one HTML document that needs nothing else.

    Parameters
    ----------
    result : Result
    paths : names, or (body, point) pairs
        Whose paths are drawn: the origins of bodies or frames of these names, or points [m] of bodies, counted from
        their reference frames: ``paths=["P", ("coupler", (0.1, 0.2))]``.
    show : names
        What is switched on when the page opens; see `flyball.view.recording.SHOW`.

    Raises
    ------
    ModelError
        If there is no output time, no such part, or nothing of that name to show.
    """
    from .page import page

    return page(record(result, paths=paths, show=show))


def record(
    result: Result,
    *,
    paths: Iterable[Path] = (),
    show: Collection[str] = USUAL,
    curves: bool = True,
    told: bool = True,
) -> Recording:
    """Make the recording that pictures and pages read; see `animation`.

    Without ``curves`` it has no curves and arrows, unless ``told`` no notes and facts of parts.

    Bodies are placed by their reference frames, so that shapes lie on them as the user gave them. Bodies without
    shapes get some that follow from their joints and inertia.
    """
    if not len(result.t):
        raise ModelError(f"the result of {result.model.name!r} has no output time: there is nothing to draw")
    motion = result
    result, every, near, instead = shown_times(motion)
    members = sum(map(len, result.bulk.values()))
    places = Places(result)
    looks = Looks(result, places)
    drawn = list(_drawn(result, places, looks, every))
    channels = _channels(result, every) if curves else ()
    bodies = tuple(
        RecordedBody(b.name, looks.shapes(b.name), *_poses(result, b.name, every), b.color) for b in result.model.bodies
    )
    joints = tuple(d for d in drawn if isinstance(d, RecordedJoint))
    sets = crowds(result, every)
    contacts, left_out = touches(motion, near) if curves else (None, "")
    notes = dict(motion.health.lines()) if told else {}
    if len(every) < len(result.t) and members:
        notes["pictures"] = f"{len(every)} of {len(result.t)} output times: {members} bodies in sets"
    if left_out:
        notes["contact arrows"] = left_out
    return Recording(
        name=result.model.name,
        planar=result.planar,
        t=result.t[every],
        bodies=(*bodies, *grounds(result, every, (*bodies, *sets))),
        lines=tuple(d for d in drawn if isinstance(d, RecordedLine)),
        joints=joints,
        channels=channels,
        shown=shown(result, [c.name for c in channels]),
        size=looks.size,
        notes=notes,
        curves=tuple(d for d in drawn if isinstance(d, RecordedCurve)),
        arrows=arrows(result, places, every, instead) if curves else (),
        frames=tuple(_frames(result, places)),
        paths=tuple(_path(result, p) for p in paths),
        show=_chosen(show),
        facts=facts(result) if told else {},
        down=_down(result),
        sets=sets,
        contacts=contacts,
        marks=marks(motion) if told else (),
    )


class Shown(NamedTuple):
    """A motion with the states around its events, and which of its times are shown.

    ``every`` are their indices, ``near`` those of the nearest output times of the motion as it was given, ``instead``
    these in the motion itself.
    """

    motion: Result
    every: np.ndarray
    near: np.ndarray
    instead: np.ndarray


def shown_times(result: Result) -> Shown:
    """What is shown of a motion; all that is around events."""
    chosen = kept(len(result.t), sum(map(len, result.bulk.values())))
    whole, near, more = with_edges(result)
    every = np.flatnonzero(more | np.isin(near, chosen))
    return Shown(whole, every, near[every], np.flatnonzero(~more)[near[every]])


def kept(n: int, members: int = 0) -> np.ndarray:
    """Indices of the times that are shown: all, or about 2000 evenly chosen, first and last among them.

    Fewer of so many members of sets of bodies that the page would become too large.
    """
    most = max(2, min(FRAMES, POSES // max(members, 1)))
    return np.arange(n) if n <= most * 1.25 else np.unique(np.linspace(0, n - 1, most).round().astype(int))


def _chosen(show: Collection[str]) -> tuple[str, ...]:
    for name in show:
        if name not in SHOW:
            known = ", ".join(SHOW)
            raise ModelError(f"there is nothing to show named {name!r}{suggest(name, SHOW)}; choose of {known}")
    return tuple(show)


def _down(result: Result) -> tuple[float, float, float]:
    g = np.asarray(result.values.system.gravity).real
    size = float(np.sqrt(g @ g))
    return three(g / size if size > 0.0 else g)


def _poses(result: Result, name: str, every: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position and quaternion of a body's reference frame."""
    view = result[name]
    p = np.zeros((len(every), 3))
    p[:, : 2 if result.planar else 3] = view.position[every]
    if not result.planar:
        return p, view.quaternion[every]
    half = 0.5 * view.angle[every]
    return p, np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)


def _drawn(result: Result, places: Places, looks: Looks, every: np.ndarray) -> Iterator[Drawn]:
    """Symbols of joints and couplings; lines of springs, dampers, ropes and links."""
    m = result.model
    wheels: list[Wheel] = []
    for e in (*m.joints, *m.couplings):
        for drawn in symbols(e, places, every, wheels):
            worn = looks.wear(drawn) if isinstance(drawn, RecordedJoint) else drawn
            if worn is not None:
                yield worn
    for e in m.forces:
        if e.drawn == "bushing":
            yield from (
                replace(d, scale=1.0) for d in symbols(e, places, every, wheels) if isinstance(d, RecordedJoint)
            )
        elif (found := _line(e, places, every) or spring_along(e, places, every, looks.size)) is not None:
            yield found


def _line(e: Any, places: Places, every: np.ndarray) -> RecordedLine | None:
    """A force element along a line: a rope with its free length, a spring, or a damper where nothing is stiff."""
    ends = rope_ends(places, e.name)
    numbers = places.result.values.numbers[e.name]
    if len(ends) > 1:
        points = [places.track(end)[0] for end in ends]
        return RecordedLine(e.name, "rope", tuple(p[every] for p in points), rest=_rest(numbers, points)[every])
    pair = places.ends(e)
    if pair is None or e.drawn not in ("spring", "damper"):
        return None
    kind = "spring" if getattr(numbers, "stiffness", 0.0) != 0.0 else "damper"
    return RecordedLine(e.name, kind, tuple(places.track(end)[0][every] for end in pair))


def _rest(numbers: Any, points: list[np.ndarray]) -> np.ndarray:
    """Free length of a rope: as given, else as drawn, for which the first time has to serve."""
    if getattr(numbers, "length", None) is not None:
        return np.full(len(points[0]), float(numbers.length))
    steps = [b[:1] - a[:1] for a, b in pairwise(points)]
    return np.full(len(points[0]), sum(float(np.sqrt((d * d).sum())) for d in steps))


def _frames(result: Result, places: Places) -> Iterator[RecordedFrame]:
    """Axes of joints, on their first body, and of named frames."""
    for joint in result.model.joints:
        F = places.end(joint.name, "F")
        if F is not None:
            turn = tuple(matrix_to_quaternion(F.R).tolist())
            yield RecordedFrame(joint.name, "joint", F.body, three(F.p), turn)
    x = result.values
    for e in result.model.frames:
        p, R = x.poses.named(e.name)
        body = x.bodies[e.body]
        turn = tuple(matrix_to_quaternion((body.R.T @ R).real).tolist())
        yield RecordedFrame(e.name, "frame", e.body, three((body.R.T @ (p - body.p)).real), turn)


def _path(result: Result, path: Path) -> RecordedPath:
    """A path as asked for: the origin of a body or frame, or a point of a body."""
    m = result.model
    if isinstance(path, str):
        part = m[path]
        if isinstance(part, Body):
            return RecordedPath(path, path)
        if isinstance(part, Frame) and part.body != GROUND:
            x = result.values
            body = x.bodies[part.body]
            p, _ = x.poses.named(path)
            return RecordedPath(path, part.body, three((body.R.T @ (p - body.p)).real))
        raise ModelError(f"paths: {part.title} has no path; name a body, a frame on a body, or a (body, point) pair")
    if not (isinstance(path, (tuple, list)) and len(path) == 2 and isinstance(path[0], str)):
        remedy = "name a body or frame, or give a pair such as ('rod', (0.1, 0.2))"
        raise ModelError(f"paths: {path!r} is no path; {remedy}")
    name, point = path
    if not isinstance(m[name], Body):
        raise ModelError(f"paths: {m[name].title} is no body, so it has no points; name it alone, or name a body")
    p = vector(point, result.planar, f"path of {name!r}")
    where = ", ".join(f"{c:g}" for c in p[: 2 if result.planar else 3])
    return RecordedPath(f"{name} ({where})", name, three(p))


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
    return [*m.sensors, *m.controllers, *m.drivers, *m.forces, *m.joints, *m.bodies]


def _main(name: str, result: Result) -> bool:
    """Whether a curve says where something is, or what a driver, force or controller does: no rate, no reaction."""
    owner, _, what = name.partition(".")
    if owner == "energy" or result.model[owner].category in ("drivers", "forces", "sensors"):
        return True
    if isinstance(e := result.model[owner], Controller):
        return what in (*e.compared, *e.output_names)
    return what in ("x", "y", "z", "angle") or what in (getattr(result.model[owner], "coordinates", None) or ())


def _telling(names: list[str], result: Result) -> list[str]:
    """At most as many names as are shown, those that say most; in their order."""
    rank = {k: (not _main(k, result), i) for i, k in enumerate(names)}
    chosen = set(sorted(names, key=rank.__getitem__)[:CURVES])
    return [k for k in names if k in chosen]


def shown(result: Result, names: Collection[str]) -> tuple[str, ...]:
    """The curves on show when a page opens.

    What is measured; what a controller is to follow, what follows, and what it says; what a driver needs; a joint's
    coordinate of each kind (else a position); energies.
    """
    m = result.model
    measured = [f"{s.name}.value" for s in m.sensors][:2]
    compared = {str(getattr(c, k)) for c in m.controllers[:1] for k in c.compared}  # shown beside one another
    kinds: dict[str, str] = {}
    for j in m.joints:
        for k, c in j.coordinates.items():
            if f"{j.name}.{k}" in set(names) - compared:
                kinds.setdefault(c.unit, f"{j.name}.{k}")
    told = [f"{c.name}.{k}" for c in m.controllers[:1] for k in c.compared]
    told += [f"{c.name}.{c.output_names[0]}" for c in m.controllers][:2]
    efforts = [f"{d.name}.effort" for d in m.drivers if f"{d.name}.effort" in names][:1]
    first = [*measured, *told, *efforts, *kinds.values()] or [f"{b.name}.{k}" for b in m.bodies for k in ("x", "z")][:1]
    energies = ("energy.kinetic", "energy.potential", "energy.total")
    return (*(k for k in first if k in names), *(k for k in energies if k in names))
