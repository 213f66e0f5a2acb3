"""Contact points between bodies, as far as constraint rows can express them exactly; rigid stops of coordinates.

For a sphere or a corner on a plane the gap is its height; for a sphere on a rounded box its distance from the core
(`constraints/ball_on_box.py`); for a sharp corner on a sharp box its height above a face
(`constraints/corner_on_box.py`). Shapes with corners or rounded ends touch a plane by these; in the plane two
rectangles or rounded segments touch by the corners of either. Everything else is reported by name and left to impulse
time stepping.
"""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass

import numpy as np

from ..collision import shape_kinds
from ..constraints import ball_on_box, corner_on_box, displacement, rolling
from ..forces.limit import Limit
from ..model.body import GROUND
from ..model.contact_point import Term, Touch
from ..model.model import Model
from . import table_definitions as su
from .contact_tables import ContactTables, contact_tables
from .element_numbers import ElementNumbers
from .table_definitions import Surfaces

MAX_PLACES = 256  # contact points that a motion with constraint rows can have
UNBOUNDED = 1e30  # half edge of a core without end
NEGLIGIBLE = 1e-9  # cosines, and relative lengths, that count as zero


@dataclass(frozen=True)
class ContactPlaces:
    """Contact points between bodies.

    Attributes
    ----------
    touches : tuple of Touch
    why_not : tuple of str
        Contacts that rows cannot express, by name; empty if there are none.
    """

    touches: tuple[Touch, ...]
    why_not: tuple[str, ...]


@dataclass(frozen=True)
class _PlacedShape:
    """A shape in the reference configuration: its bearer, kind, parameters and pose in the world."""

    body: str
    part: str
    kind: int
    par: np.ndarray
    p: np.ndarray
    R: np.ndarray
    corners: np.ndarray

    @property
    def name(self) -> str:
        """Shape and bearer, for messages."""
        return f"the {KIND_NAMES[self.kind]} of {self.part!r}"


KIND_NAMES = {number: name.lower() for name, number in shape_kinds.KIND_NUMBERS.items()}


def contact_places(model: Model, given: ElementNumbers) -> ContactPlaces:
    """All contact points of a model at some values of its parameters.

    Raises
    ------
    ModelError
        If shapes or surfaces are not sufficiently described for any contact.
    """
    if model.bulk:
        return ContactPlaces((), tuple(f"{e.title} is many bodies" for e in model.bulk))
    scene = contact_tables(model, given, [b.name for b in model.bodies])
    found: list[tuple[str, dict]] = []
    why_not: dict[str, None] = {}
    for i, j in itertools.combinations(range(len(scene.geometry.shape)), 2):
        row = _pair_properties(scene, i, j)
        if row is None:
            continue
        a, b = _placed_shape(scene, i), _placed_shape(scene, j)
        told = _unsupported_surface(scene.surfaces, row, (i, j)) or _pair_places(model.planar, a, b)
        if isinstance(told, str):
            why_not[told.format(a=a.name, b=b.name)] = None
            continue
        for fields in told:
            friction = (float(row[su.STATIC]), float(row[su.KINETIC]))
            slips = fields.pop("slips") if max(friction) > 0.0 else ()
            more = {"slips": slips, "friction": friction, "restitution": float(row[su.RESTITUTION])}
            found.append((f"{a.part}-{b.part}", fields | more))
    if len(found) > MAX_PLACES:
        why_not[f"there are {len(found)} places where something may touch, and rows are made for {MAX_PLACES}"] = None
    if why_not:
        return ContactPlaces((), tuple(why_not))
    return ContactPlaces(tuple(Touch(name, **fields) for name, fields in _with_unique_names(model, found)), ())


def _with_unique_names(model: Model, found: list[tuple[str, dict]]) -> list[tuple[str, dict]]:
    """Contact points with unique names: numbered where several have the same name, none that is taken."""
    count, at, out = Counter(name for name, _ in found), Counter[str](), []
    for name, fields in found:
        at[name] += 1
        told = f"{name}-{at[name]}" if count[name] > 1 else name
        while model.find(told) is not None:
            told += "'"
        out.append((told, fields))
    return out


def _pair_properties(scene: ContactTables, i: int, j: int) -> np.ndarray | None:
    """Contact properties of the surfaces of two shapes, if they may touch."""
    x = scene.geometry.shape
    a, b = int(x.mover[i]), int(x.mover[j])
    apart = scene.geometry.excluded_pairs
    if a == b or not (x.mask[i] & x.member[j] and x.mask[j] & x.member[i]):
        return None
    if len(apart) and (apart == (min(a, b), max(a, b))).all(axis=1).any():
        return None
    row = scene.surfaces.pair[x.material[i], x.material[j]]
    return None if np.isnan(row[su.STATIC]) else row


def _unsupported_surface(surfaces: Surfaces, row: np.ndarray, shapes: tuple[int, int]) -> str:
    """Surface properties that rows cannot express."""
    if row[su.STIFFNESS] > 0.0 or row[su.MODULUS] > 0.0:
        return "the contact of {a} and {b} is compliant"
    if row[su.ROLLING] > 0.0 or row[su.SPINNING] > 0.0:
        return "{a} on {b} has rolling or spinning friction"
    if row[su.ACROSS] != 1.0:
        return "{a} on {b} has friction with a grain"
    return "the surface of {a} or {b} moves, as a belt" if surfaces.belt[list(shapes)].any() else ""


def _placed_shape(scene: ContactTables, k: int) -> _PlacedShape:
    G = scene.geometry
    p, R = G.dimensions.place[k], G.dimensions.axes[k].reshape(3, 3)
    mover = int(G.shape.mover[k])
    body = GROUND
    if mover >= 0:
        pose = scene.carriers.movers.pose[mover]
        T = pose[3:].reshape(3, 3)
        p, R, body = pose[:3] + T @ p, T @ R, scene.carriers.name(mover)
    first, count = int(G.shape.first[k]), int(G.shape.count[k])
    kind = int(G.shape.kind[k])
    return _PlacedShape(body, scene.name(k), kind, G.dimensions.par[k], p, R, G.vertex[first : first + count])


def _pair_places(planar: bool, a: _PlacedShape, b: _PlacedShape) -> list[dict] | str:
    """Fields of the contact points of two shapes, or what rows cannot express of them."""
    for F, M in ((a, b), (b, a)):
        if F.kind == shape_kinds.PLANE:
            balls = _touching_spheres(M)
            return [_on_plane(planar, F, M, x) for x in balls] if balls else "{a} on {b}"
    out = []
    for F, M in ((a, b), (b, a)):
        core, balls = _rounded_box(F), _touching_spheres(M)
        if planar:
            if core is None or not balls:
                return "{a} on {b}"
            if F.kind == shape_kinds.SPHERE and M.kind != shape_kinds.SPHERE:
                continue  # the circle is a sphere on the other shape
            out += [_on_core(F, M, core, x, 0) for x in balls]
        elif core is not None and M.kind == shape_kinds.SPHERE:
            out.append(_on_core(F, M, core, balls[0], 2))
        if out and M.kind == shape_kinds.SPHERE:
            break
    return out or "{a} on {b}"


def _touching_spheres(s: _PlacedShape) -> list[tuple[np.ndarray, float]]:
    """Spheres by which a shape touches anything flat: centres in its axes, each with its radius."""
    o = np.zeros(3)
    if s.kind == shape_kinds.SPHERE:
        return [(o, float(s.par[0]))]
    if s.kind == shape_kinds.CAPSULE:
        return [(np.array([0.0, 0.0, z * s.par[1]]), float(s.par[0])) for z in (-1.0, 1.0)]
    if s.kind == shape_kinds.BOX:
        return [(np.array(x) * s.par[:3], 0.0) for x in itertools.product((-1.0, 1.0), repeat=3)]
    if s.kind in (shape_kinds.HULL, shape_kinds.POLYGON):
        return [(x, float(s.par[0])) for x in s.corners]
    return []


@dataclass(frozen=True)
class _RoundedBox:
    """A box rounded by a radius: its centre and axes in the world, half edges."""

    p: np.ndarray
    R: np.ndarray
    half: np.ndarray
    radius: float


def _rounded_box(s: _PlacedShape) -> _RoundedBox | None:
    if s.kind == shape_kinds.SPHERE:
        return _RoundedBox(s.p, s.R, np.zeros(3), float(s.par[0]))
    if s.kind == shape_kinds.CAPSULE:
        return _RoundedBox(s.p, s.R, np.array([0.0, 0.0, s.par[1]]), float(s.par[0]))
    if s.kind == shape_kinds.BOX:
        return _RoundedBox(s.p, s.R, s.par[:3].copy(), 0.0)
    return _rectangle(s) if s.kind == shape_kinds.POLYGON else None


def _rectangle(s: _PlacedShape) -> _RoundedBox | None:
    """Rounded box of a rectangle, a segment or a point; None for other shapes."""
    x = s.corners
    if len(x) == 1:
        return _RoundedBox(s.p + s.R @ x[0], s.R, np.zeros(3), float(s.par[0]))
    if len(x) not in (2, 4):
        return None
    middle, along, other = x.mean(axis=0), x[1] - x[0], x[2] - x[1] if len(x) == 4 else np.zeros(3)
    size = np.sqrt((along**2).sum() + (other**2).sum())
    if len(x) == 4 and (
        abs(along @ other) > NEGLIGIBLE * size * size or np.abs(x[0] + x[2] - x[1] - x[3]).max() > NEGLIGIBLE * size
    ):
        return None
    e = along / np.linalg.norm(along)
    axes = np.column_stack([e, np.cross((0.0, 0.0, 1.0), e), (0.0, 0.0, 1.0)])
    half = np.array([np.linalg.norm(along) / 2.0, np.linalg.norm(other) / 2.0, UNBOUNDED])
    return _RoundedBox(s.p + s.R @ middle, s.R @ axes, half, float(s.par[0]))


def _frame(p: np.ndarray, R: np.ndarray) -> tuple[float, ...]:
    return tuple(float(x) for x in (*p, *R.ravel()))


def _place(F: _PlacedShape, M: _PlacedShape, frames: tuple, gap: Term, slips: tuple[Term, ...]) -> dict:
    at = frames[1][:3]
    return {"body_i": F.body, "body_j": M.body, "at": at, "frames": frames, "gap": gap, "slips": slips}


def _on_plane(planar: bool, F: _PlacedShape, M: _PlacedShape, ball: tuple[np.ndarray, float]) -> dict:
    """Sphere or corner on a plane: a gap, and slips along one or both axes of the plane."""
    x, r = ball
    n = F.R[:, 2]
    axes = np.column_stack([(n[1], -n[0], 0.0), (0.0, 0.0, -1.0), n]) if planar else F.R
    frames = _frame(F.p, axes), _frame(M.p + M.R @ x, M.R)
    gap = (displacement.KIND, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, r, 1.0)
    slips = tuple((rolling.KIND, *e, 0.0, r, 0.0, 0.0, 1.0) for e in np.eye(3)[: 1 if planar else 2].tolist())
    return _place(F, M, frames, gap, slips)


def _on_core(
    F: _PlacedShape, M: _PlacedShape, core: _RoundedBox, ball: tuple[np.ndarray, float], tangents: int
) -> dict:
    """Sphere or corner on a rounded box."""
    x, r = ball
    p = M.p + M.R @ x
    half = tuple(core.half.tolist())
    d = p - core.p
    up = int(np.argmax(np.abs(d)))
    way = float(up + 1) * (1.0 if d[up] >= 0.0 else -1.0)
    sharp = r + core.radius == 0.0
    if sharp:
        inward = M.corners.mean(axis=0) - x
        way = float(np.arctan2(inward[1], inward[0]))
    gap, slip = (
        (corner_on_box.KIND_HEIGHT, corner_on_box.KIND_SLIDE)
        if sharp
        else (ball_on_box.KIND_GAP, ball_on_box.KIND_SLIP)
    )
    which = range(1, tangents + 1) if tangents else (0,)
    slips = tuple((slip, *half, r, float(k), way, 0.0, 1.0) for k in which)
    fields = _place(
        F, M, (_frame(core.p, core.R), _frame(p, M.R)), (gap, *half, r, 0.0, way, r + core.radius, 1.0), slips
    )
    return fields | ({"measured": (corner_on_box.KIND_APART, *fields["gap"][1:])} if sharp else {})


@dataclass(frozen=True)
class RigidStop:
    """Stop of a coordinate: bounds [m or rad], inf where there is none, and restitution."""

    element: Limit
    lower: float
    upper: float
    restitution: float


def rigid_stops(model: Model, given: ElementNumbers) -> list[RigidStop]:
    """Every rigid stop of a model."""
    out = []
    for e in model.limits:
        if isinstance(e, Limit) and not e.acts():
            lower, upper, bounce, *_ = e.switched(given.of[e.name], "", 0.0)
            out.append(RigidStop(e, float(np.real(lower)), float(np.real(upper)), float(np.real(bounce))))
    return out
