"""What a recording shows besides bodies of a mechanism: sets of bodies, what stands on ground, contact forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..model.element import resolve
from ..model.geometry import matrix_to_quaternion
from ..model.ground import frame_of
from ..model.shapes import Plane
from .looks import given_shape
from .places import three
from .recording import RecordedBody, RecordedContacts, RecordedSet, Shape, extent

if TYPE_CHECKING:
    from ..results.contacts import Contacts
    from ..results.result import Result

ARROWS = 300_000  # contact forces in a recording, at most
LEVEL = 0.999  # a plane whose normal is as near to up as this is the ground that every picture has
GLASS = 0.15  # opacity of walls without end
WIDER = 0.06  # by which a plane reaches over what moves on it, as part of the extent of that


def crowds(result: Result, every: np.ndarray) -> tuple[RecordedSet, ...]:
    """Sets of bodies over the recorded times."""
    out = []
    env = _environment(result)
    for name, bulk in result.bulk.items():
        e = result.model[name]
        shapes = tuple(given_shape(s, resolve(s, env)) for s in e.shapes())
        scale = None if e.scale is None else e.sizes()
        colors = (e.color,) if e.color else ()
        out.append(RecordedSet(name, shapes, bulk.origin[every], bulk.quaternion[every], colors, scale))
    return tuple(out)


def _environment(result: Result) -> dict[str, float]:
    return dict(zip(result.model.parameters, np.real(result.values.system.const).tolist(), strict=False))


def grounds(result: Result, every: np.ndarray, moving: tuple[RecordedBody | RecordedSet, ...]) -> list[RecordedBody]:
    """What stands on ground; planes without end reach as far as things move."""
    env, out = _environment(result), []
    points = np.concatenate([np.zeros((0, 3)), *(np.asarray(b.p).reshape(-1, 3) for b in moving)])
    points = points[np.isfinite(points).all(axis=1)]
    reach = max((extent(s) for b in moving for s in b.shapes), default=0.5)
    for e in result.model.ground:
        p, R = frame_of(e, resolve(e, env))
        turn = tuple(matrix_to_quaternion(R).tolist())
        glass: list[Shape] = []
        solid: list[Shape] = []
        for s in e.shapes():
            n = resolve(s, env)
            if not isinstance(s, Plane) or n.extent is not None:
                solid.append(given_shape(s, n))
                continue
            local = (points - p) @ R
            level = abs(float(s.pose(n)[1][:, 2] @ R.T @ _up(result)))
            if result.planar:
                solid.append(_line(s.pose(n), local, reach))
            elif level < LEVEL:  # the page has a level ground of its own
                (glass if level < 1.0 - LEVEL else solid).append(_patch(s.pose(n), local, reach))
        walls = f"{e.name} (walls)" if solid else e.name
        for name, shapes, opacity in ((e.name, solid, 1.0), (walls, glass, GLASS)):
            if shapes:
                pose = np.tile(p, (len(every), 1)), np.tile(turn, (len(every), 1))
                out.append(RecordedBody(name, tuple(shapes), *pose, e.color or "#9aa6b3", opacity))
    return out


def _up(result: Result) -> np.ndarray:
    g = np.real(np.asarray(result.values.system.gravity))
    size = float(np.sqrt(g @ g))
    return -g / size if size > 0.0 else np.array([0.0, 0.0, 1.0])


def _patch(pose: tuple[np.ndarray, np.ndarray], points: np.ndarray, reach: float) -> Shape:
    """The part of a plane over which points lie, as a slab; all in the frame of what it is part of."""
    p, R = pose
    middle, edge = _span((points - p) @ R, reach)
    thick = 0.02 * float(edge.max())
    at = p + R @ np.array([middle[0], middle[1], -thick / 2])
    return Shape("box", (float(edge[0]), float(edge[1]), thick), three(at), tuple(matrix_to_quaternion(R).tolist()))


def _line(pose: tuple[np.ndarray, np.ndarray], points: np.ndarray, reach: float) -> Shape:
    """The same in the plane: a strip behind a line."""
    p, n = pose[0], pose[1][:, 2]
    R = np.column_stack([np.array([n[1], -n[0], 0.0]), n, np.array([0.0, 0.0, 1.0])])
    middle, edge = _span((points - p) @ R, reach)
    thick = 0.02 * float(edge.max())
    at = p + R @ np.array([middle[0], -thick / 2, 0.0])
    return Shape("box", (float(edge[0]), thick, thick), three(at), tuple(matrix_to_quaternion(R).tolist()))


def _span(points: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Middle and edges of a box around points, with room for bodies that reach so far."""
    if not len(points):
        return np.zeros(3), np.full(3, 4.0 * reach)
    low, high = points.min(axis=0) - 1.5 * reach, points.max(axis=0) + 1.5 * reach
    return (low + high) / 2.0, (high - low) * (1.0 + 2.0 * WIDER)


def touches(result: Result, every: np.ndarray) -> tuple[RecordedContacts | None, str]:
    """Contact forces at the recorded times, and what had to be left out, in words.

    Forces are those on what moves: of two bodies on the second one.
    """
    contacts = result.contacts
    if contacts is None or not len(contacts):
        return None, ""
    rows = contacts.taken(every)
    note = ""
    begin, pair, point, force, state = rows.begin, rows.pair, rows.point, rows.force, rows.state
    if len(rows) > ARROWS:
        begin, (pair, point, force, state) = largest(rows)
        note = f"the largest {len(pair)} of {len(rows)} are shown"
    still = pair[:, 1] == contacts.sides.span("ground")[0] if "ground" in contacts.sides.names else np.zeros(0, bool)
    if len(still):
        force = np.where(still[:, None], -force, force)
    return RecordedContacts(begin, point, force, state), note


def largest(rows: Contacts) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """Where times begin, and pairs, points, forces and states of the largest forces, as many as are shown."""
    size = (rows.force**2).sum(axis=1)
    kept = np.zeros(len(size), bool)
    kept[np.argpartition(-size, ARROWS)[:ARROWS]] = True
    begin = np.r_[0, np.cumsum(np.bincount(rows.when[kept], minlength=len(rows.t)))]
    return begin, tuple(a[kept] for a in (rows.pair, rows.point, rows.force, rows.state))
