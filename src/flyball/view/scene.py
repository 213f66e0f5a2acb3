"""The scene around bodies: sets of bodies, ground, contact forces, and arrows of reactions, elements and loads."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.body import frame_of
from ..model.element import resolve
from ..model.force import BodyForce, CoordinateForce
from ..model.geometry import matrix_to_quaternion
from ..model.shapes import Plane
from ..model.snapshot import hidden_parts
from .body_shapes import shape_from_solid
from .figures import evenly_chosen
from .recording import RecordedArrow, RecordedBody, RecordedContacts, RecordedSet, Shape, half_extent
from .symbols import AttachedFrame, AttachedFrames, coordinate_axis, coordinate_frames_of, float_triple, is_rotational

if TYPE_CHECKING:
    from ..results.contacts import Contacts
    from ..results.motion_record import RecordedMotion
    from ..results.result import Result


MAX_CONTACT_ARROWS = 300_000  # largest number of contact forces in a recording
LEVEL_COSINE = 0.999  # a plane whose normal is this close to up is the ground plane of every picture
WALL_OPACITY = 0.15  # opacity of infinite walls
PLANE_MARGIN = 0.06  # margin of a plane around the bodies moving on it, relative to their extent


def recorded_sets(result: Result, every: np.ndarray) -> tuple[RecordedSet, ...]:
    """Return sets of bodies at the recorded times."""
    out = []
    env = _parameter_values(result)
    for name, bulk in result.bulk.items():
        e = result.model[name]
        shapes = tuple(shape_from_solid(s, resolve(s, env)) for s in e.shapes())
        scale = None if e.scale is None else e.sizes()
        colors = (e.color,) if e.color else ()
        out.append(RecordedSet(name, shapes, bulk.origin[every], bulk.quaternion[every], colors, scale))
    return tuple(out)


POSES_AT_ONCE = 1 << 18


def body_poses(result: Result, every: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Return positions (n, 3) and quaternions (n, 4) of the reference frame of each body at the recorded times."""
    parts = [piece.motions for piece in result.pieces or (result,)]
    names = [b.name for b in result.model.bodies]
    block = max(1, POSES_AT_ONCE // max(len(every), 1))
    for first in range(0, len(names), block):
        found = [_poses_of(motions, names[first : first + block]) for motions in parts]
        p, R = (np.concatenate(x, axis=1)[:, every] for x in zip(*found, strict=True))
        yield from zip(p, matrix_to_quaternion(R), strict=True)


def _poses_of(motions: RecordedMotion, names: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (m, n, 3) and rotation matrices (m, n, 3, 3) of the reference frames of bodies."""
    placed = [motions.placed(name) for name in names]
    at, offset, turn = ([x[k] for x in placed] for k in range(3))
    centre, axes = (np.moveaxis(x[at].real, 1, 2) for x in (motions.W.bodies.position, motions.W.bodies.rotation))
    R = axes.reshape(*axes.shape[:2], 3, 3)
    p = centre + np.einsum("mnij,mj->mni", R, np.real(offset))
    return p, R @ np.real(turn).reshape(-1, 1, 3, 3)


def _parameter_values(result: Result) -> dict[str, float]:
    return dict(zip(result.model.parameters, np.real(result.values.system.const).tolist(), strict=False))


def ground_bodies(
    result: Result, every: np.ndarray, moving: tuple[RecordedBody | RecordedSet, ...]
) -> list[RecordedBody]:
    """Return the shapes of ground; infinite planes extend as far as bodies move."""
    env, out = _parameter_values(result), []
    points = np.concatenate([np.zeros((0, 3)), *(np.asarray(b.p).reshape(-1, 3) for b in moving)])
    points = points[np.isfinite(points).all(axis=1)]
    reach = max((half_extent(s) for b in moving for s in b.shapes), default=0.5)
    for e in result.model.ground:
        p, R = frame_of(e, resolve(e, env))
        turn = tuple(matrix_to_quaternion(R).tolist())
        glass: list[Shape] = []
        solid: list[Shape] = []
        for s in e.shapes():
            n = resolve(s, env)
            if not isinstance(s, Plane) or n.extent is not None:
                solid.append(shape_from_solid(s, n))
                continue
            local = (points - p) @ R
            level = abs(float(s.pose(n)[1][:, 2] @ R.T @ _up_direction(result)))
            if result.planar:
                solid.append(_ground_line(s.pose(n), local, reach))
            elif level < LEVEL_COSINE:  # the page has a level ground of its own
                (glass if level < 1.0 - LEVEL_COSINE else solid).append(_plane_patch(s.pose(n), local, reach))
        walls = f"{e.name} (walls)" if solid else e.name
        for name, shapes, opacity in ((e.name, solid, 1.0), (walls, glass, WALL_OPACITY)):
            if shapes:
                pose = np.tile(p, (len(every), 1)), np.tile(turn, (len(every), 1))
                out.append(RecordedBody(name, tuple(shapes), *pose, e.color or "#9aa6b3", opacity, ground=True))
    return out


def _up_direction(result: Result) -> np.ndarray:
    g = np.real(np.asarray(result.values.system.gravity))
    size = float(np.sqrt(g @ g))
    return -g / size if size > 0.0 else np.array([0.0, 0.0, 1.0])


def _plane_patch(pose: tuple[np.ndarray, np.ndarray], points: np.ndarray, reach: float) -> Shape:
    """Return the part of a plane under the points, as a slab, in the frame of its body."""
    p, R = pose
    middle, edge = _covering_box((points - p) @ R, reach)
    thick = 0.02 * float(edge.max())
    at = p + R @ np.array([middle[0], middle[1], -thick / 2])
    return Shape(
        "box", (float(edge[0]), float(edge[1]), thick), float_triple(at), tuple(matrix_to_quaternion(R).tolist())
    )


def _ground_line(pose: tuple[np.ndarray, np.ndarray], points: np.ndarray, reach: float) -> Shape:
    """Return the same in the plane: a strip behind a line."""
    p, n = pose[0], pose[1][:, 2]
    R = np.column_stack([np.array([n[1], -n[0], 0.0]), n, np.array([0.0, 0.0, 1.0])])
    middle, edge = _covering_box((points - p) @ R, reach)
    thick = 0.02 * float(edge.max())
    at = p + R @ np.array([middle[0], -thick / 2, 0.0])
    return Shape("box", (float(edge[0]), thick, thick), float_triple(at), tuple(matrix_to_quaternion(R).tolist()))


def _covering_box(points: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Return middle and edges of a box around points, enlarged by the bodies' size."""
    if not len(points):
        return np.zeros(3), np.full(3, 4.0 * reach)
    low, high = points.min(axis=0) - 1.5 * reach, points.max(axis=0) + 1.5 * reach
    return (low + high) / 2.0, (high - low) * (1.0 + 2.0 * PLANE_MARGIN)


def contact_arrows(result: Result, every: np.ndarray) -> tuple[RecordedContacts | None, str]:
    """Return contact forces at the recorded times, and a note on those left out.

    Forces act on the moving body: of two moving bodies on the second one.
    """
    contacts = result.contacts
    if contacts is None or not len(contacts):
        return None, ""
    rows = contacts.at_times(every)
    note = ""
    begin, pair, point, force, state = rows.begin, rows.pair, rows.point, rows.force, rows.state
    if len(rows) > MAX_CONTACT_ARROWS:
        begin, (pair, point, force, state) = largest_contacts(rows)
        note = f"the largest {len(pair)} of {len(rows)} are shown"
    still = pair[:, 1] == contacts.sides.span("ground")[0] if "ground" in contacts.sides.names else np.zeros(0, bool)
    if len(still):
        force = np.where(still[:, None], -force, force)
    return RecordedContacts(begin, point, force, state), note


def largest_contacts(rows: Contacts) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """Return the start index of each time, and pairs, points, forces and states of the largest forces displayed."""
    size = (rows.force**2).sum(axis=1)
    kept = np.zeros(len(size), bool)
    kept[np.argpartition(-size, MAX_CONTACT_ARROWS)[:MAX_CONTACT_ARROWS]] = True
    begin = np.r_[0, np.cumsum(np.bincount(rows.when[kept], minlength=len(rows.t)))]
    return begin, tuple(a[kept] for a in (rows.pair, rows.point, rows.force, rows.state))


MIN_ARROW_PART = 1e-5  # relative to the largest of their kind: smaller arrows are invisible and left out
MAX_ARROW_NUMBERS = 600_000  # largest number of vectors in the arrows of a recording


def force_arrows(
    result: Result, places: AttachedFrames, every: np.ndarray, instead: np.ndarray
) -> tuple[RecordedArrow, ...]:
    """Return all visible arrows; for a mechanism with very many parts those of evenly chosen ones.

    Reactions are those on ``body_j`` at the joint's point there. Forces along a line, such as a spring, act on both
    ends; ends on ground are left out. ``instead`` are the times used if there is no value at a time.
    """
    most = max(1, MAX_ARROW_NUMBERS // (3 * len(every)))
    out = [
        RecordedArrow(name, group, what, end.body, float_triple(end.p), _values_at(vector, every, instead))
        for name, group, what, end, vector in _all_arrows(result, places, most)
        if np.isfinite(vector).any()
    ]
    size = [float(np.nanmax(np.abs(a.vector), initial=0.0)) for a in out]
    largest = {what: max((s for a, s in zip(out, size) if a.what == what), default=0.0) for what in ("force", "moment")}
    seen = [k for k, a in enumerate(out) if size[k] > MIN_ARROW_PART * largest[a.what]]
    rank = sorted(seen, key=lambda k: -size[k] / largest[out[k].what])
    return tuple(out[k] for k in sorted(rank[:most]))


def _values_at(vector: np.ndarray, every: np.ndarray, instead: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(vector[every]).all(axis=1)[:, None], vector[every], vector[instead])


ArrowData = tuple[str, str, str, AttachedFrame, np.ndarray]


def _all_arrows(result: Result, places: AttachedFrames, most: int) -> Iterator[ArrowData]:
    for joint in evenly_chosen(result.model.joints, most):
        M = places.end(joint.name, "M")
        if M is not None and joint.blocks:
            force, torque = result[joint.name].reaction()
            yield from _force_and_moment(joint.name, "reaction", M, force, torque)
    hidden = hidden_parts(result.model)
    forces = [e for e in (*result.model.forces, *result.model.limits) if e.name not in hidden]
    for e in evenly_chosen(forces, most):
        yield from _element_arrows(result, places, e)
    for driver in (d for d in result.model.drivers if d.name not in hidden):
        yield from _coordinate_arrow(result, places, driver.name, driver.coordinate, result[driver.name].effort)


def _force_and_moment(
    name: str, group: str, end: AttachedFrame, force: np.ndarray, torque: np.ndarray
) -> Iterator[ArrowData]:
    for what, vector in (("force", force), ("moment", torque)):
        if np.any(vector):
            yield name, group, what, end, vector


def _element_arrows(result: Result, places: AttachedFrames, e: Any) -> Iterator[ArrowData]:
    """Return the arrows of a force element, by its target: a rope's points, a coordinate, or frames."""
    view = result[e.name]
    if places.end(e.name, "P0") is not None:
        yield from _rope_arrows(places, e.name, view)
        return
    M = places.end(e.name, "M")
    if M is None:
        texts = e.along() if isinstance(e, CoordinateForce) else ()
        effort = getattr(view, list(e.outputs)[2]) if texts else None
        weights = e.switch_weights(result.values.numbers[e.name], "") if texts else ()
        for text, weight in zip(texts, weights or (1.0,) * len(texts), strict=True):
            yield from _coordinate_arrow(result, places, e.name, text, weight * effort)
        return
    force, torque = view.wrench
    if isinstance(e, BodyForce):
        yield from _force_and_moment(e.name, "load", M, force, torque)
        return
    F = places.end(e.name, "F")
    if not M.grounded:
        yield from _force_and_moment(e.name, "element", M, force, torque)
    if F is not None and not F.grounded and (M.grounded or e.symbol in ("spring", "damper")):
        yield from _force_and_moment(e.name, "element", F, -force, -torque)


def _rope_arrows(places: AttachedFrames, name: str, view: Any) -> Iterator[ArrowData]:
    """Return the rope's forces on its points, towards their neighbours."""
    for end, (_, force) in zip(rope_ends(places, name), view.pulls, strict=True):
        if not end.grounded:
            yield name, "element", "force", end, force


def rope_ends(places: AttachedFrames, name: str) -> list[AttachedFrame]:
    """Return the frames P0, P1, ... of an element with several points."""
    out: list[AttachedFrame] = []
    while (end := places.end(name, f"P{len(out)}")) is not None:
        out.append(end)
    return out


def _coordinate_arrow(
    result: Result, places: AttachedFrames, name: str, coordinate: str, effort: np.ndarray
) -> Iterator[ArrowData]:
    """Return an effort along a coordinate of a joint or a point: a force or moment on the second body."""
    e = result.model[name]
    owner, what = result.model.coordinate(coordinate, e)
    base, end = coordinate_frames_of(e, owner, what, places)
    if base is not None and end is not None:
        kind = "moment" if is_rotational(owner, what) else "force"
        yield name, "element", kind, end, effort[:, None] * coordinate_axis(owner, what, base, places)
