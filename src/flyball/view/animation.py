"""Animations: recordings made from results, and the pages of a motion, an equilibrium and mode shapes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import ModelError
from ..model.body import GROUND, Body, Frame
from ..model.controller import Controller
from ..model.geometry import matrix_to_quaternion, vector
from ..model.model import suggest
from ..model.names import curve_parts
from ..model.snapshot import hidden_parts
from .body_shapes import BodyShapes
from .comparison_tables import difference_tables, measurement_table
from .event_marks import event_marks
from .figures import initial_channels
from .motion_with_events import add_event_states
from .page import animation_page
from .playback import Playback, playback_of
from .recording import (
    MIN_GROUPED,
    SHOW_OPTIONS,
    Channel,
    Compared,
    ComparisonTable,
    MeasuredCurve,
    RecordedBody,
    RecordedCurve,
    RecordedFrame,
    RecordedJoint,
    RecordedLine,
    RecordedPath,
    Recording,
    group_bodies,
)
from .scene import body_poses, contact_arrows, force_arrows, ground_bodies, recorded_sets, rope_ends
from .symbols import AttachedFrames, GearWheel, SymbolPart, coordinate_spring_line, element_symbols, float_triple

if TYPE_CHECKING:
    from ..results.equilibrium import Equilibrium
    from ..results.result import Result


def part_facts(result: Result) -> dict[str, tuple[str, ...]]:
    """Return lines about every part, by its name: its kind, connected parts, a body's mass."""
    out: dict[str, tuple[str, ...]] = {}
    for e in result.model.elements():
        if e.category == "bodies":
            mass = float(np.real(result.values.bodies[e.name].mass))
            out[e.name] = ("Body", f"{mass:.4g} kg")
        elif e.category != "initial":
            out[e.name] = tuple(x for x in (type(e).__name__, attachment_text(e)) if x)
    return out


def attachment_text(e: Any) -> str:
    """Return what an element connects or acts on."""
    if hasattr(e, "body_i"):
        return f"{e.body_i} – {e.body_j}"
    if hasattr(e, "bodies"):
        return " – ".join(e.bodies)
    if hasattr(e, "body"):
        return f"on {e.body}"
    if hasattr(e, "law") and hasattr(e, "coordinate"):
        return f"{e.coordinate} = {e.law}"
    coupled = getattr(e, "coupled", None)
    if callable(coupled):
        return ", ".join(coupled())
    about = getattr(e, "joint", None) or getattr(e, "coordinate", None)
    if isinstance(about, str):
        return f"on {about}"
    if isinstance(about, tuple):
        return f"on {', '.join(about)}"
    measured = getattr(e, "of", None) or getattr(e, "frame", None)
    return f"of {measured}" if isinstance(measured, str) else ""


MAX_TIMES = 2000  # approximate number of times in a recording
MAX_POSES = 1_500_000  # largest number of poses of many bodies in a recording
MAX_CURVES = 60
DEFAULT_SHOW = ("loads", "moments", "grid")

PathRequest = str | tuple[str, Any]


def animation_html(
    result: Result,
    *,
    paths: Iterable[PathRequest] = (),
    show: Collection[str] = DEFAULT_SHOW,
    others: Mapping[str, Result] | None = None,
    label: str = "",
    measured: Any = None,
) -> str:
    """Return the animation page of a result: one self-contained HTML document.

    Parameters
    ----------
    result : Result
    paths : names, or (body, point) pairs
        Paths to draw: of the origins of bodies or frames, or of points [m] of bodies, in their reference frames:
        ``paths=["P", ("coupler", (0.1, 0.2))]``.
    show : names
        Displays switched on when the page opens; see `flyball.view.recording.SHOW_OPTIONS`.
    others : mapping of str to Result, optional
        Other motions by label, up to six. Each is a ghost in a colour, without its forces and its sets of bodies; its
        curves lie over those of the same names, and tables list the differences, as `Result.differences` does. The page
        has the times of the first motion.
    label : str
        Label of the motion itself beside others; by default the name of the mechanism.
    measured : str, path, or mapping of str to array, optional
        Measured curves, as in `Result.compare`: dots over the curves, and a table of deviations.

    Raises
    ------
    ModelError
        If there is no output time, no such part, or nothing of that name to show; if motions cannot be compared, or the
        measured curves are not as `Result.compare` needs them.
    """
    return animation_page(
        group_bodies(record_comparison(result, paths=paths, show=show, others=others, label=label, measured=measured))
    )


MAX_OTHERS = 6  # colours of ghosts


def record_comparison(
    result: Result,
    *,
    others: Mapping[str, Result] | None = None,
    label: str = "",
    measured: Any = None,
    **options: Any,
) -> Recording:
    """Make the recording of a motion and what it is compared with; see `animation_html`."""
    recording = record_motion(result, **options)
    if label and not others:
        raise ModelError(f"label={label!r} is for a page with others={{...}}; leave it out")
    if not others and measured is None:
        return recording
    others, label = others or {}, label or result.model.name
    _check_labels(label, others)
    tables: tuple[ComparisonTable, ...] = ()
    dots: tuple[MeasuredCurve, ...] = ()
    source = ""
    if measured is not None:
        found = result.compare(measured)
        names = [f"{name}.value" if name in result.model else name for name in found.names]
        recording = _with_channels(recording, result, names)
        columns = zip(names, found.units, found.measured.T, strict=True)
        dots = tuple(MeasuredCurve(name, unit, found.t, values) for name, unit, values in columns)
        tables, source = (measurement_table(found, names),), Path(found.source).name
    ghosts = {k: _ghost(other, recording) for k, other in others.items()}
    changes = {k: result.differences(others[k], *(c.name for c in ghosts[k].channels)) for k in others}
    tables = (*difference_tables(label, changes), *tables)
    return replace(recording, compared=Compared(label, ghosts, source, dots, tables))


def _check_labels(label: str, others: Mapping[str, Result]) -> None:
    if len(others) > MAX_OTHERS:
        raise ModelError(f"{len(others)} other motions are too many for one page; give at most {MAX_OTHERS}")
    for name in others:
        if not isinstance(name, str) or not name.strip() or name == label:
            raise ModelError(f"the label {name!r} of another motion must be a text that differs from {label!r}")


def _with_channels(recording: Recording, result: Result, names: Collection[str]) -> Recording:
    """Return the recording with these curves among its channels, and plotted first."""
    known = {c.name for c in recording.channels}
    whole, every, _, _ = motion_to_show(result)
    more = [(name, *whole.channel(name)) for name in names if name not in known]
    channels = (Channel(name, unit, np.asarray(values, float)[every]) for name, unit, values in more)
    plotted = dict.fromkeys([*names, *recording.plotted])
    return replace(recording, channels=(*recording.channels, *channels), plotted=tuple(plotted))


def _ghost(other: Result, recording: Recording) -> Recording:
    """Return the recording of another motion, with those channels that the first one has in the same unit."""
    whole, every, _, _ = motion_to_show(other)
    channels = []
    for c in recording.channels:
        if c.name in whole:
            unit, values = whole.channel(c.name)
            if unit == c.unit:
                channels.append(Channel(c.name, unit, np.asarray(values, float)[every]))
    own = record_motion(other, curves=False, with_notes=False)
    return replace(own, channels=tuple(channels), sets=(), joints=(), frames=(), curves=())


def record_motion(
    result: Result,
    *,
    paths: Iterable[PathRequest] = (),
    show: Collection[str] = DEFAULT_SHOW,
    curves: bool = True,
    with_notes: bool = True,
) -> Recording:
    """Make the recording that pictures and pages read; see `animation_html`.

    Without ``curves`` it has no curves and arrows, without ``with_notes`` no notes and facts of parts.

    Poses are those of reference frames, so that shapes appear as the user gave them. Bodies without shapes get shapes
    derived from their joints and inertia.
    """
    if not len(result.t):
        raise ModelError(f"the result of {result.model.name!r} has no output time: there is nothing to plot")
    motion = result
    result, every, near, instead = motion_to_show(motion)
    members = _member_count(result)
    places = AttachedFrames(result)
    looks = BodyShapes(result, places)
    hidden = hidden_parts(result.model)
    drawn = list(_symbols_and_lines(result, places, looks, every))
    channels = _recorded_channels(result, every) if curves else ()
    bodies = tuple(
        RecordedBody(b.name, looks.shapes(b.name), p, q, b.color)
        for b, (p, q) in zip(result.model.bodies, body_poses(result, every), strict=True)
        if b.name not in hidden
    )
    joints = tuple(d for d in drawn if isinstance(d, RecordedJoint))
    sets = recorded_sets(result, every)
    contacts, left_out = contact_arrows(motion, near) if curves else (None, "")
    notes = dict(motion.health.lines()) if with_notes else {}
    if len(every) < len(result.t) and members:
        notes["pictures"] = f"{len(every)} of {len(result.t)} output times: {members} bodies"
    if left_out:
        notes["contact arrows"] = left_out
    playback = playback_of(result, every) if with_notes else Playback()
    return Recording(
        name=result.model.name,
        planar=result.planar,
        t=result.t[every],
        bodies=(*bodies, *ground_bodies(result, every, (*bodies, *sets))),
        lines=tuple(d for d in drawn if isinstance(d, RecordedLine)),
        joints=joints,
        channels=channels,
        plotted=initial_channels(result, channels),
        size=looks.size,
        notes=notes,
        curves=tuple(d for d in drawn if isinstance(d, RecordedCurve)),
        arrows=force_arrows(result, places, every, instead) if curves else (),
        frames=tuple(_recorded_frames(result, places)),
        paths=tuple(_recorded_path(result, p) for p in paths),
        show=_checked_show(show),
        facts=part_facts(result) if with_notes else {},
        down=_gravity_direction(result),
        sets=sets,
        contacts=contacts,
        marks=event_marks(motion) if with_notes else (),
        speed=playback.speed,
        remark=playback.remark,
    )


class DisplayedMotion(NamedTuple):
    """A motion with the states around its events, and the displayed times.

    ``every`` are their indices, ``near`` those of the nearest output times of the original motion, ``instead`` the
    latter's indices in the extended motion.
    """

    motion: Result
    every: np.ndarray
    near: np.ndarray
    instead: np.ndarray


def motion_to_show(result: Result) -> DisplayedMotion:
    """Return the displayed motion, with all states around events."""
    chosen = thinned_times(len(result.t), _member_count(result))
    whole, near, more = add_event_states(result)
    every = np.flatnonzero(more | np.isin(near, chosen))
    return DisplayedMotion(whole, every, near[every], np.flatnonzero(~more)[near[every]])


def _member_count(result: Result) -> int:
    """Return the number of bodies in sets, and of single bodies if they are many."""
    single = len(result.model.bodies)
    return sum(map(len, result.bulk.values())) + (single if single > MIN_GROUPED else 0)


def thinned_times(n: int, members: int = 0) -> np.ndarray:
    """Return the indices of the displayed times: all, or about 2000 evenly chosen, including first and last.

    Fewer if there are so many bodies that the page would become too large.
    """
    most = max(2, min(MAX_TIMES, MAX_POSES // max(members, 1)))
    return np.arange(n) if n <= most * 1.25 else np.unique(np.linspace(0, n - 1, most).round().astype(int))


def _checked_show(show: Collection[str]) -> tuple[str, ...]:
    for name in show:
        if name not in SHOW_OPTIONS:
            known = ", ".join(SHOW_OPTIONS)
            raise ModelError(f"there is nothing to show named {name!r}{suggest(name, SHOW_OPTIONS)}; choose of {known}")
    return tuple(show)


def _gravity_direction(result: Result) -> tuple[float, float, float]:
    g = np.asarray(result.values.system.gravity).real
    size = float(np.sqrt(g @ g))
    return float_triple(g / size if size > 0.0 else g)


def _symbols_and_lines(
    result: Result, places: AttachedFrames, looks: BodyShapes, every: np.ndarray
) -> Iterator[SymbolPart]:
    """Return symbols of joints and couplings; lines of springs, dampers, ropes and links."""
    m = result.model
    wheels: list[GearWheel] = []
    hidden = hidden_parts(m)
    for e in (x for x in (*m.joints, *m.couplings) if x.name not in hidden):
        for drawn in element_symbols(e, places, every, wheels):
            worn = looks.fit_symbol(drawn) if isinstance(drawn, RecordedJoint) else drawn
            if worn is not None:
                yield worn
    for e in m.forces:
        if e.symbol == "bushing":
            yield from (
                replace(d, scale=1.0) for d in element_symbols(e, places, every, wheels) if isinstance(d, RecordedJoint)
            )
        elif (
            found := force_line(e, places, every) or coordinate_spring_line(e, places, every, looks.size)
        ) is not None:
            yield found


def force_line(e: Any, places: AttachedFrames, every: np.ndarray) -> RecordedLine | None:
    """Return the line of a force element: a rope with its free length, a spring, or a damper without stiffness."""
    ends = rope_ends(places, e.name)
    numbers = places.result.values.numbers[e.name]
    if len(ends) > 1:
        points = [places.track(end)[0] for end in ends]
        if getattr(e, "radii", None) is not None:
            view = places.result[e.name]
            points = view.course.line(view.wraps)
        rest = _free_length(e, places.result, points) if e.single == "rope" else None  # others are never slack
        return RecordedLine(e.name, "rope", tuple(p[every] for p in points), rest=None if rest is None else rest[every])
    pair = places.ends(e)
    if pair is None or e.symbol not in ("spring", "damper"):
        return None
    kind = "spring" if getattr(numbers, "stiffness", 0.0) != 0.0 else "damper"
    return RecordedLine(e.name, kind, tuple(places.track(end)[0][every] for end in pair))


def _free_length(e: Any, result: Result, points: list[np.ndarray]) -> np.ndarray:
    """The free length of a rope: as given, else that at the first time, in place of the reference configuration."""
    numbers = result.values.numbers[e.name]
    if e.transmitted():  # wound up or paid out: its path, and what is slack
        limit = curve_parts(e.transmitted())[0]
        slack: np.ndarray = result.values.numbers[limit].upper - result[limit].value
        return slack + sum(np.sqrt(((b - a) ** 2).sum(axis=1)) for a, b in pairwise(points))
    if getattr(numbers, "length", None) is not None:
        return np.full(len(points[0]), float(numbers.length))
    steps = [b[:1] - a[:1] for a, b in pairwise(points)]
    return np.full(len(points[0]), sum(float(np.sqrt((d * d).sum())) for d in steps))


def _recorded_frames(result: Result, places: AttachedFrames) -> Iterator[RecordedFrame]:
    """Return axes of joints, on their first body, and named frames."""
    for joint in result.model.joints:
        F = places.end(joint.name, "F")
        if F is not None:
            turn = tuple(matrix_to_quaternion(F.R).tolist())
            yield RecordedFrame(joint.name, "joint", F.body, float_triple(F.p), turn)
    x = result.values
    for e in result.model.frames:
        p, R = x.poses.named(e.name)
        body = x.bodies[e.body]
        turn = tuple(matrix_to_quaternion((body.R.T @ R).real).tolist())
        yield RecordedFrame(e.name, "frame", e.body, float_triple((body.R.T @ (p - body.p)).real), turn)


def _recorded_path(result: Result, path: PathRequest) -> RecordedPath:
    """Return a requested path: of the origin of a body or frame, or of a point of a body."""
    m = result.model
    if isinstance(path, str):
        part = m[path]
        if isinstance(part, Body):
            return RecordedPath(path, path)
        if isinstance(part, Frame) and part.body != GROUND:
            x = result.values
            body = x.bodies[part.body]
            p, _ = x.poses.named(path)
            return RecordedPath(path, part.body, float_triple((body.R.T @ (p - body.p)).real))
        raise ModelError(f"paths: {part.title} has no path; name a body, a frame on a body, or a (body, point) pair")
    if not (isinstance(path, (tuple, list)) and len(path) == 2 and isinstance(path[0], str)):
        remedy = "name a body or frame, or give a pair such as ('rod', (0.1, 0.2))"
        raise ModelError(f"paths: {path!r} is no path; {remedy}")
    name, point = path
    if not isinstance(m[name], Body):
        raise ModelError(f"paths: {m[name].title} is no body, so it has no points; name it alone, or name a body")
    p = vector(point, result.planar, f"path of {name!r}")
    where = ", ".join(f"{c:g}" for c in p[: 2 if result.planar else 3])
    return RecordedPath(f"{name} ({where})", name, float_triple(p))


def _recorded_channels(result: Result, every: np.ndarray) -> tuple[Channel, ...]:
    """All curves of a small mechanism; of a large one energies, drivers, forces, joint coordinates, then bodies."""
    if 8 * (len(result.model.bodies) + len(result.model.joints)) <= 400:
        hidden = hidden_parts(result.model) & {e.name for e in (*result.model.bodies, *result.model.joints)}
        curves = {k: c for k, c in result.channels().items() if curve_parts(k)[0] not in hidden}
        curves = {k: c for k, c in curves.items() if np.isfinite(c[1]).any()}
        names = list(curves) if len(curves) <= MAX_CURVES else _main_curves(list(curves), result)
    else:
        curves = {f"energy.{k}": c for k, c in result.energy.channels().items()}
        for e in _parts_with_curves(result):
            if len(curves) >= MAX_CURVES:
                break
            view = result[e.name]
            main = [k for k, x in view.names.items() if x.curve and _is_main_curve(f"{e.name}.{k}", result)]
            curves |= {f"{e.name}.{k}": view.quantity(k) for k in main}
        names = list(curves)[:MAX_CURVES]
    return tuple(Channel(k, curves[k][0], np.asarray(curves[k][1], float)[every]) for k in names)


def _parts_with_curves(result: Result) -> list:
    m = result.model
    return [*m.sensors, *m.controllers, *m.drivers, *m.forces, *m.joints, *m.bodies]


def _is_main_curve(name: str, result: Result) -> bool:
    """Return whether a curve is a position, or an effort of a driver, force or controller; not a rate or reaction."""
    owner, what = curve_parts(name)
    if owner == "energy" or result.model[owner].category in ("drivers", "forces", "sensors"):
        return True
    if isinstance(e := result.model[owner], Controller):
        return what in (*e.compared, *e.output_names)
    return what in ("x", "y", "z", "angle") or what in (getattr(result.model[owner], "coordinates", None) or ())


def _main_curves(names: list[str], result: Result) -> list[str]:
    """Return the most important names, at most as many as are shown, in their order."""
    rank = {k: (not _is_main_curve(k, result), i) for i, k in enumerate(names)}
    chosen = set(sorted(names, key=rank.__getitem__)[:MAX_CURVES])
    return [k for k in names if k in chosen]


def equilibrium_page(found: Equilibrium) -> str:
    """Return the page of an equilibrium."""
    notes: dict[str, str] = {}
    for label, text in found.lines():
        notes[label] = f"{notes[label]}; {text}" if label in notes else text
    return animation_page(replace(record_motion(found.result), notes=notes))
