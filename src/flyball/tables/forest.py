"""The forest of bodies: parents, tree joints, point masses and the body table.

Bodies that no tree joint connects to ground are free bodies (FREE or PLANAR), one for each connected part, and point
masses (POINT), each on its own.

A point mass is a body without inertia whose orientation is irrelevant: it has no angular velocity. A body is a point
mass if its inertia is written as zero (a parameter may become something else) and everything that acts on it acts at
its centre of mass and depends on that point's position only: ends of `Distance`, springs and ropes, ball joints,
forces. If something is attached elsewhere, or constrains or drives its orientation, the body is a rigid body, and
joints must restrain its rotation. The model's own numbers decide; `check_centred` refuses other values that would
decide otherwise.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..constraints.blocks import Row
from ..errors import FlyballError, ModelError
from ..math.vec import matrix_product
from ..model.body import GROUND, Body, Frame
from ..model.element import Element, si_numbers
from ..model.expressions import Expression, is_number_text
from ..model.force import BodyForce, CoordinateForce, Force
from ..model.geometry import vector
from ..model.joint import Joint, Primitive
from ..model.model import Model
from .element_numbers import element_numbers
from .table_definitions import FREE, PLANAR, POINT, PRISMATIC, REVOLUTE, SPHERICAL, TREE_NQ, TREE_NV, WELD, Tree

if TYPE_CHECKING:
    from .structure_definition import Structure


CENTRED = 1e-9  # relative to the distance from the world's origin: by how much an end may miss the centre


def point_mass_obstacles(model: Model) -> Mapping[str, str]:
    """Bodies without inertia -> why each is no point mass; "" for a point mass."""
    model = model.snapshot()
    return model.cache.get("points", None, 1, lambda: _point_mass_obstacles(model))


def point_masses(model: Model) -> frozenset[str]:
    """Names of the point masses: the only result that structures take from parameter values."""
    model = model.snapshot()
    return model.cache.get(
        "single", None, 1, lambda: frozenset(k for k, why in point_mass_obstacles(model).items() if not why)
    )


def _point_mass_obstacles(model: Model) -> dict[str, str]:
    found = {
        b.name: "its angular velocity is given" if b.angular_velocity is not None else ""
        for b in model.bodies
        if is_without_inertia(b)
    }
    if not any(why == "" for why in found.values()):
        return found
    place = _Centres(model)
    for name, role, e, blind in _attachments(model, found):
        if not found[name]:
            if not blind:
                found[name] = f"{e.title} needs its orientation"
            elif not place.centred(name, role, e):
                found[name] = f"{e.title} is attached off its centre of mass"
    return found


def is_without_inertia(body: Body) -> bool:
    """Whether a body's inertia is written as zero."""
    return body.inertia is not None and body.inertia_about is None and _is_zero(body.inertia)


def _is_zero(value: Any) -> bool:
    if isinstance(value, tuple):
        return all(_is_zero(x) for x in value)
    if not isinstance(value, str):
        return bool(value == 0)
    try:
        if not is_number_text(value) and Expression.parse(value, curves=True).names:
            return False  # decided here: the message about unknown names would look up all units
        return bool(si_numbers(value, {}, "kg*m^2", "inertia") == 0)
    except FlyballError:  # not a number
        return False


def _attachments(model: Model, among: Mapping[str, str]) -> Iterator[tuple[str, str, Element, bool]]:
    """(body, role, element, whether it depends on the end's position only) of everything that acts on these bodies."""
    for joint in model.joints:
        rows = joint.rows(model.planar)
        for role, end in joint.ends().items():
            if (name := model.carrier(end, joint)) in among:
                yield name, role, joint, all(sees_point(r, role) for r in rows)
    for force in model.forces:
        for role, end in force.ends().items():
            if (name := model.carrier(end, force)) in among:
                yield name, role, force, force.on_points()
    for text, e in _acting_coordinates(model):
        owner, what = model.coordinate(text, e)
        c = owner.coordinates[what]
        for k, role in enumerate(c.frames):
            if role in owner.ends() and (name := model.carrier(owner.ends()[role], owner)) in among:
                yield name, role, owner, sees_point(c.row, "FM"[k])


def sees_point(row: Row, role: str) -> bool:
    """Whether a row depends on the position of its frame F or M only, and makes no torque about it."""
    return role in row.of_kind.points


def _acting_coordinates(model: Model) -> Iterator[tuple[str, Element]]:
    """Names of coordinates that something acts along."""
    for coupling in model.couplings:
        yield from ((text, coupling) for text in coupling.coupled())
    yield from ((d.coordinate, d) for d in model.drivers)
    for f in (*model.forces, *model.limits):
        if isinstance(f, CoordinateForce):
            yield from ((text, f) for text in f.along())


class _Centres:
    """Positions of ends and centres of mass in the reference configuration, from the model's own numbers."""

    def __init__(self, model: Model) -> None:
        self.model, self.numbers = model, element_numbers(model)

    def centred(self, name: str, role: str, e: Element) -> bool:
        """Whether the end of an element on a body is its centre of mass."""
        body: Any = self.model[name]
        at = _written_place(e, role)
        if body.com is None and at is not None and at == body.position:
            return True
        centre = self.numbers.bodies[name].c
        return bool(np.abs(self._end(role, e, centre) - centre).max() <= CENTRED * np.abs(centre).max())

    def _end(self, role: str, e: Any, centre: np.ndarray) -> np.ndarray:
        n, planar = self.numbers.of[e.name], self.model.planar
        if not isinstance(e, (BodyForce, Body, Frame)) and n.at is not None and role in (placed := e.placed(n, planar)):
            return placed[role][0]
        if isinstance(e, BodyForce) and isinstance(self.model[e.body], Body):
            at = getattr(n, "at", None)
            return centre if at is None else vector(at, planar, e.title)
        end: Any = self.model[e.ends()[role]]
        if not isinstance(end, Frame):
            return self.numbers.bodies[end.name].p
        b = self.numbers.bodies[end.body]
        return b.p + matrix_product(b.R, vector(self.numbers.of[end.name].position, planar, end.title))


def _written_place(e: Any, role: str) -> Any:
    """Position of an end in the world as written in the description, if it is."""
    at = getattr(e, "at", None)
    if at is None or not isinstance(at[0], tuple):
        return at
    return at[list(e.ends()).index(role)]


def check_centred(model: Model, name: str, element: Any, way: np.ndarray, length: Any) -> None:
    """Refuse numbers by which an element misses the centre of a point mass.

    Raises
    ------
    ModelError
        With the names of both, and the distance.
    """
    off = np.abs(way.real)
    if isinstance(element, (Joint, Force)) and (off > CENTRED * length.real).any():
        raise ModelError(
            f"{model[name].title} has no inertia and is a point mass as the model describes it, but with these "
            f"parameters {element.title} is attached {float(off.max()):.3g} m off its centre of mass. Place both by "
            f"the same expression, or give the body an inertia"
        )


TREE_KINDS = {"R": REVOLUTE, "P": PRISMATIC, "S": SPHERICAL}


@dataclass(frozen=True)
class TreeJoint:
    """A tree joint: a joint whose freedoms are coordinates, with its chain in the body table."""

    joint: Joint
    reversed: bool  # the body beyond the joint carries frame F
    links: tuple[int, ...]  # rows of the body table, outwards from the parent; all but the last are massless
    primitives: tuple[Primitive, ...]  # in the order of the links; empty for a weld

    @property
    def child(self) -> int:
        """Row of the body beyond the joint."""
        return self.links[-1]


@dataclass(frozen=True)
class TreeBody:
    """A body and its tree joint: None for one connected to ground by FREE, PLANAR or POINT."""

    body: str
    joint: Joint | None = None
    parent: str = GROUND
    reversed: bool = False


def joint_bodies(model: Model, joint: Joint) -> tuple[str, str]:
    """Names of the bodies that carry a joint's frames F and M."""
    return model.carrier(joint.body_i, joint), model.carrier(joint.body_j, joint)


def tree_bodies(model: Model, tree: Sequence[str]) -> list[TreeBody]:
    """Bodies with their tree joints, parents first.

    Of a part that is not connected to ground, the first body that is the second one of no tree joint is free.

    Raises
    ------
    ModelError
        If the tree joints close a loop.
    """
    near: dict[str, list[tuple[Joint, str, bool]]] = {GROUND: []}
    near |= {b.name: [] for b in model.bodies}
    seconds = set()
    for name in tree:
        joint = model[name]
        a, b = joint_bodies(model, joint)
        near[a].append((joint, b, False))
        near[b].append((joint, a, True))
        seconds.add(b)
    out: list[TreeBody] = []
    seen = {GROUND}
    _append_chains(near, GROUND, seen, out)
    for body in sorted(model.bodies, key=lambda x: x.name in seconds):
        if body.name not in seen:
            out.append(TreeBody(body.name))
            seen.add(body.name)
            _append_chains(near, body.name, seen, out)
    if sum(h.joint is not None for h in out) != len(tree):
        raise ModelError("the tree joints close a loop")
    return out


def _append_chains(near: dict, root: str, reached: set[str], out: list[TreeBody]) -> None:
    """Append all bodies reachable from the root, one chain after the other."""
    stack = [(root, iter(near[root]))]
    while stack:
        here, ways = stack[-1]
        for joint, there, turned in ways:
            if there not in reached:
                reached.add(there)
                out.append(TreeBody(there, joint, here, turned))
                stack.append((there, iter(near[there])))
                break
        else:
            stack.pop()


def body_table(s: Structure) -> None:
    """Assign rows of bodies and massless links, with their coordinates and velocities."""
    model = s.model
    plain = PLANAR if model.planar else FREE
    s.points = point_masses(model)
    rows: list[tuple[int, int]] = []  # parent, kind
    place = {GROUND: -1}
    for h in tree_bodies(model, s.tree) if s.tree else [TreeBody(b.name) for b in model.bodies]:
        if h.joint is None:
            rows.append((-1, POINT if h.body in s.points else plain))
        else:
            steps = h.joint.primitives(model.planar)
            steps = steps[::-1] if h.reversed else steps
            first = len(rows)
            parent = place[h.parent]
            for kind in [TREE_KINDS[p.kind] for p in steps] or [WELD]:
                rows.append((parent, kind))
                parent = len(rows) - 1
            s.tree_joints[h.joint.name] = TreeJoint(h.joint, h.reversed, tuple(range(first, len(rows))), steps)
        place[h.body] = len(rows) - 1
    s.place = place
    kinds = np.array([kind for _, kind in rows], np.int64)
    nq, nv = np.array(TREE_NQ)[kinds], np.array(TREE_NV)[kinds]
    if model.planar:
        nq[kinds == POINT] = nv[kinds == POINT] = 2
    parents, none = np.array([parent for parent, _ in rows], np.int64), np.full(len(rows), -1, np.int64)
    s.tables["tree"] = Tree(parents, kinds, np.cumsum(nq) - nq, np.cumsum(nv) - nv, nq, nv, none, none.copy())


def tree_joint_steps(s: Structure) -> Iterator[tuple[TreeJoint, int, Primitive]]:
    """Primitives of every tree joint with their rows of the body table."""
    for t in s.tree_joints.values():
        for row, p in zip(t.links, t.primitives, strict=False):  # a weld has none
            yield t, row, p


def coordinate_row(s: Structure, joint: str, coordinate: str) -> int | None:
    """Row of the body table whose coordinate is that coordinate of a joint; None if there is none."""
    found = s.tree_joints.get(joint)
    if found is None:
        return None
    for row, p in zip(found.links, found.primitives, strict=False):
        if p.coordinate == coordinate and p.kind != "S":
            return row
    return None
