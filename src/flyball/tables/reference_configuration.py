"""The reference configuration: poses of frames, frames of the tree joints, and coordinates from body poses.

`Refresh` states which rows of the tables are computed again where tables for other parameter values exist already.
`Poses` computes frames of elements in the reference configuration; `tree_frames` writes the frames of tree joints, each
with z along its own axis; `positions` and `free_velocities` compute the coordinates of the forest from the bodies'
poses and velocities. Velocities of tree joints need the twist columns, and are in ``engine/kinematics.py``.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..math.scalar import atan2, cos, real_parts, rounded, sin
from ..math.vec import cross, inner_product, matrix_product
from ..model.body import GROUND, Body, Frame
from ..model.element import Element
from ..model.force import BodyForce, Force
from ..model.geometry import matrix_to_quaternion, vector
from ..model.joint import Coupling, Joint
from ..model.model import Model
from .element_numbers import ElementNumbers
from .forest import TreeJoint
from .structure_definition import FrameSpec, Structure, TermSpec
from .table_definitions import POINT, REVOLUTE, Bodies, map_arrays

if TYPE_CHECKING:
    from .values import Values


T = TypeVar("T")


@dataclass(frozen=True)
class Refresh:
    """Rows to compute again: those of elements with other numbers than in ``base``, or that depend on such an element.

    The other rows are copied: they would be the same to the bit. Without ``base`` all rows are computed.
    """

    base: Values | None = None
    names: Collection[str] = frozenset()
    forces_only: bool = False  # whether only forces and controllers have other numbers

    @classmethod
    def since(cls, base: Values | None, given: ElementNumbers, model: Model) -> Refresh:
        """Differences from existing tables of the same structure."""
        if base is None or base.given.since is not given.since:
            return cls()
        stand_on = model.cache.get("stand on", None, 1, lambda: _dependents(model))
        other = given.changed | base.given.changed
        acting = model.cache.get("acting", None, 1, lambda: {e.name for e in (*model.forces, *model.controllers)})
        return cls(base, other.union(*(stand_on.get(name, ()) for name in other)), other <= acting)

    def table(self, name: str, new: T, dtype: Any) -> T:
        """Table of `System` to be filled in: a copy of the existing one, or the ``new`` one."""
        if self.base is None:
            return new
        return map_arrays(lambda _, x: x.astype(dtype), getattr(self.base.system, name))  # type: ignore[no-any-return]

    def state(self, name: str, n: int, dtype: Any) -> np.ndarray:
        """Reference coordinates "q" or velocities "v" to be filled in: a copy of the existing ones, or zeros."""
        return np.zeros(n, dtype) if self.base is None else getattr(self.base, name).astype(dtype)

    def rows(self, s: Structure, table: str) -> Iterable[int]:
        """Numbers of the rows of a table ("frames", "terms" or "forces") that are computed again."""
        if self.base is None:
            return range(len(getattr(s, table)))
        of = s.cache.get("rows of elements", table, 3, lambda: _rows_of_elements(getattr(s, table)))
        return sorted({k for name in self.names for k in of.get(name, ())})

    def asks(self, *elements: Any) -> bool:
        """Whether rows of one of these elements (None: of the world) are computed again."""
        return self.base is None or any(e is not None and e.name in self.names for e in elements)


def _rows_of_elements(specs: Sequence[Any]) -> Mapping[str, list[int]]:
    """Map of each element to the rows that depend on it."""
    out: dict[str, list[int]] = {}
    for k, x in enumerate(specs):
        elements = (x,) if isinstance(x, Element) else (x.element, getattr(x, "owner", None))
        for name in {e.name for e in elements if e is not None}:
            out.setdefault(name, []).append(k)
    return out


def _dependents(model: Model) -> Mapping[str, set[str]]:
    """Map of each element to the elements whose frames in the reference configuration depend on its numbers."""
    out: dict[str, set[str]] = {}
    for e in model.elements():
        for name in _supports(model, e):
            out.setdefault(name, set()).add(e.name)
    return out


def _supports(model: Model, e: Any) -> set[str]:
    """Names of all elements that an element's frames are defined on."""
    if isinstance(e, Coupling):
        owners = [model.coordinate(text, e)[0] for text in e.coupled()]
        return {owner.name for owner in owners}.union(*(_supports(model, owner) for owner in owners))
    ends: Collection[str] = ()
    if isinstance(e, (Joint, Force)):
        ends = e.ends().values()
    elif isinstance(e, Frame):
        ends = (e.body,)
    return {*ends, *(model.carrier(name, e) for name in ends)}


class Poses:
    """Poses of the elements' frames in the reference configuration."""

    def __init__(self, s: Structure, given: ElementNumbers) -> None:
        self.s, self.numbers, self.bodies = s, given.of, given.bodies
        self.model = s.model
        self._given, self.env = given, given.env

    def row(self, f: FrameSpec) -> np.ndarray:
        """Position (3) from the body's centre of mass and rotation (9), in body axes."""
        key = (f.element.name if f.element is not None else "", f.role, f.coordinate)
        found = self._given.local.get(key)
        if found is None:
            p, R, name = self.world(f)
            b = self.bodies[name]
            back = b.R.T
            found = self._given.local[key] = np.concatenate(
                (matrix_product(back, p - b.c), matrix_product(back, R).ravel())
            )
        return found

    def local(self, f: FrameSpec) -> tuple[np.ndarray, np.ndarray]:
        """Position from the body's centre of mass and rotation, in body axes."""
        row = self.row(f)
        return row[:3], row[3:].reshape(3, 3)

    def world(self, f: FrameSpec) -> tuple[np.ndarray, np.ndarray, str]:
        """Position, rotation and carrier of a frame in the reference configuration."""
        if f.element is None:
            turn = Body.coordinates[f.coordinate].turn_F if f.coordinate else ()
            return np.zeros(3), np.array(turn) if len(turn) else np.eye(3), GROUND
        key = f.element.name, f.role, f.coordinate
        found = self._given.world.get(key)
        if found is None:
            found = self._given.world[key] = self._local_frame(f)
        return found

    def _local_frame(self, f: FrameSpec) -> tuple[np.ndarray, np.ndarray, str]:
        e = f.element
        n = self.numbers[e.name]
        end = e.ends()[f.role]
        name = self.model.carrier(end, e)
        if isinstance(e, BodyForce):
            p, R = self.named(end)
            if isinstance(self.model[end], Body):
                at = getattr(n, "at", None)
                p = self.bodies[name].c if at is None else vector(at, self.model.planar, e.title)
            return p, R, name
        placed = self._placed(e, n) if hasattr(e, "placed") and n.at is not None else {}
        p, R = placed[f.role] if f.role in placed else self.named(end)
        if f.coordinate:
            R = matrix_product(R, np.array(getattr(e.coordinates[f.coordinate], f"turn_{f.role}")))
        return p, R, name

    def _placed(self, e: Any, n: SimpleNamespace) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        found = self._given.placed.get(e.name)
        if found is None:
            found = self._given.placed[e.name] = e.placed(n, self.model.planar)
        return found

    def named(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Pose of a body's reference frame or of a named frame in the reference configuration."""
        if name in self.bodies:
            return self.bodies[name].p, self.bodies[name].R
        e = self.model[name]
        n = self.numbers[name]
        b = self.bodies[e.body]
        return b.p + matrix_product(b.R, vector(n.position, self.model.planar, e.title)), matrix_product(
            b.R, e.rotation(n)
        )

    def separation(self, e: Any) -> float:
        """Length of the path from the first to the last of an element's frames in the reference configuration."""
        points = [self.world(FrameSpec(0, e, role))[0] for role in e.ends()]
        return sum(np.sqrt(((b - a) ** 2).sum()) for a, b in itertools.pairwise(points))

    def frame_separation(self, e: Any) -> float:
        """`separation` of an element that has several frames; 0 of others."""
        return self.separation(e) if hasattr(e, "ends") and len(e.ends()) > 1 else 0.0

    def ends(self, e: Any) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """Frames F and M of a joint in the reference configuration."""
        F, M = (self.world(FrameSpec(0, e, role))[:2] for role in "FM")
        return F, M

    def axis(self, joint: str) -> np.ndarray:
        """Axis of a joint's angle in the world in the reference configuration."""
        e = self.model[joint]
        R = self.ends(e)[0][1]
        turn = e.coordinates["angle"].turn_F if "angle" in e.coordinates else ()
        return (matrix_product(R, np.array(turn)) if len(turn) else R)[:, 2]

    def term_value(self, t: TermSpec) -> float:
        """Value of a term's formula in the reference configuration."""
        if t.formula.of_kind.place:
            return t.owner.nearest(self.numbers[t.owner.name], *self.ends(t.owner))[0]  # type: ignore[no-any-return]
        poses = (self.world(self.s.frames[k]) for k in (t.F, t.M))
        F, M = ((tuple(p), tuple(R.ravel()), *((0.0,) * 3,) * 4) for p, R, _ in poses)
        par = (1.0, *t.formula.par[1:6], 0.0, 0.0) if t.formula.of_kind.turns else (*t.formula.par[:6], 0.0, 0.0)
        return t.formula.of_kind.row(par, F, M, self.turned(t.owner), None)[0]

    def turned(self, owner: Any) -> float:
        """Angle of a body or frame in the plane in the reference configuration, with whole turns; 0 for joints."""
        if isinstance(owner, Joint) or not self.model.planar:
            return 0.0
        own = self.numbers[owner.name].angle
        return own if isinstance(owner, Body) or owner.body == GROUND else own + self.numbers[owner.body].angle


IDENTITY = np.eye(3)
# rotations that take z to each axis
Z_TO_AXIS = {"x": np.roll(IDENTITY, 2, axis=1), "y": np.roll(IDENTITY, 1, axis=1), "z": IDENTITY}
FLIP = np.diag([1.0, -1.0, -1.0])  # half a turn about x, which reverses z


def tree_frames(s: Structure, pose: Poses, numbers: Mapping, table: Bodies, refresh: Refresh) -> None:
    """Write the frames of all tree joints to the body table.

    A chain leads from F to M. Where the body beyond carries F it is traversed backwards, with every axis reversed.
    """
    joints = [t for t in s.tree_joints.values() if refresh.asks(t.joint)]
    if not joints:
        return
    back = np.array([t.reversed for t in joints])[:, None, None]
    rest = np.array([t.joint.rest or IDENTITY for t in joints])
    (pF, RF), (pM, RM) = (_stacked([pose.local(FrameSpec(0, t.joint, role)) for t in joints]) for role in "FM")
    M_back, F_back = matrix_product(rest, _transposed(RM)), _transposed(RF)
    before_p, before_R = np.where(back, pM, pF), np.where(back, matrix_product(RM, _transposed(rest)), RF)
    beyond_p, beyond_R = (
        np.where(back, matrix_product(-F_back, pF), matrix_product(-M_back, pM)),
        np.where(back, F_back, M_back),
    )
    for t in joints:
        for link, step in zip(t.links, t.primitives, strict=False):
            if step.coordinate in t.joint.coordinates:
                table.offset[link] = t.joint.offset(numbers[t.joint.name], step.coordinate)
    links = np.array([link for t in joints for link in t.links])
    turns = np.array([_step_rotation(t, k) for t in joints for k in range(len(t.links))])
    last = np.cumsum([len(t.links) for t in joints]) - 1
    first = np.r_[0, last[:-1] + 1]
    dtype = table.offset.dtype
    p, R = np.zeros((len(links), 3, 1), dtype), np.tile(IDENTITY.astype(dtype), (len(links), 1, 1))
    p[first], R[first] = before_p, before_R
    table.joint_position[links], table.joint_rotation[links] = p[..., 0], matrix_product(R, turns).reshape(-1, 9)
    p[:], R[:] = 0.0, IDENTITY
    p[last], R[last] = beyond_p, beyond_R
    turns = _transposed(turns)
    table.body_position[links] = matrix_product(turns, p)[..., 0]
    table.body_rotation[links] = matrix_product(turns, R).reshape(-1, 9)
    _mark_identities(table, links, s.tables["tree"].joint[links])


def _step_rotation(t: Any, k: int) -> np.ndarray:
    """Rotation from the frame before primitive k of a joint to one with z along the primitive's axis."""
    if not t.primitives:
        return IDENTITY
    step = t.primitives[k]
    return Z_TO_AXIS[step.axis] @ FLIP if t.reversed and step.kind != "S" else Z_TO_AXIS[step.axis]


def _stacked(poses: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3, 1) and rotations (n, 3, 3)."""
    return np.array([p for p, _ in poses])[..., None], np.array([R for _, R in poses])


def _transposed(R: np.ndarray) -> np.ndarray:
    """Transposed matrices."""
    return R.swapaxes(1, 2)


def _mark_identities(table: Bodies, links: np.ndarray, kinds: np.ndarray) -> None:
    """Mark constant rotations of joints that are the identity: they need not be multiplied.

    A constant rotation about the axis of a hinge commutes with the hinge's own, and is merged with the one behind it.
    """
    T = table.joint_rotation[links].reshape(-1, 3, 3)
    upright = (T[:, 2, 2] == 1.0) & ~(T[:, 2, :2] != 0.0).any(axis=1) & ~(T[:, :2, 2] != 0.0).any(axis=1)
    about = (kinds == REVOLUTE) & upright
    at, T = links[about], T[about]
    table.body_position[at] = matrix_product(T, table.body_position[at, :, None])[..., 0]
    table.body_rotation[at] = matrix_product(T, table.body_rotation[at].reshape(-1, 3, 3)).reshape(-1, 9)
    table.joint_rotation[at] = IDENTITY.ravel()
    for rotation, turned in ((table.joint_rotation, table.joint_turned), (table.body_rotation, table.body_turned)):
        R = rotation[links]
        none = _is_constant(R) & (np.abs(real_parts(R) - IDENTITY.ravel()) < 1e-15).all(axis=1)
        rotation[links[none]] = IDENTITY.ravel()
        turned[links[none]] = 0.0
        turned[links[~none]] = (IDENTITY.ravel() != R[~none]).any(axis=1).astype(float)


def _is_constant(R: np.ndarray) -> np.ndarray:
    """Whether rows have the same value for other parameter values too, as far as the number type shows it."""
    if R.dtype == object:
        return np.array([not any(hasattr(x, "called") and not x.known for x in row) for row in R], bool)
    return np.asarray(~R.imag.any(axis=1))


UNIT_AXES = {"x": np.array([1.0, 0.0, 0.0]), "y": np.array([0.0, 1.0, 0.0]), "z": np.array([0.0, 0.0, 1.0])}

MANY_JOINTS = 30  # number of joints of one coordinate from which they are read all at once
NEXT_AXIS = {"x": "y", "y": "z", "z": "x"}


@dataclass(frozen=True)
class BodyState:
    """Body state: centre of mass, rotation, velocity, angular velocity in the world; in the plane also its angle."""

    p: np.ndarray
    R: np.ndarray
    v: np.ndarray
    w: np.ndarray
    angle: Any = 0.0


ALL_ROWS = Refresh()
GROUND_STATE = BodyState(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3))


def positions(
    x: Values,
    bodies: Mapping[str, BodyState],
    hints: Mapping[str, float] | None = None,
    refresh: Refresh = ALL_ROWS,
) -> np.ndarray:
    """Coordinates (nq,) of the forest for given body states; the nearest ones where these do not fit the tree joints.

    ``hints``: angles of joints, "joint.coordinate", within half a turn; by default the turns of the reference
    configuration. ``refresh``: which are computed; the others are copied from its tables.
    """
    s, tree = x.structure, x.structure.tables["tree"]
    q = refresh.state("q", s.nq, x.system.const.dtype)
    hung = {t.child: t for t in s.tree_joints.values()}
    single = {b: t for b, t in hung.items() if len(t.primitives) == 1 and t.primitives[0].kind in "RP"}
    if len(single) < MANY_JOINTS:
        single = {}
    _read_one_coordinate_joints(x, [t for t in single.values() if refresh.asks(t.joint)], bodies, hints or {}, q)
    for name, b in s.place.items():
        if b in hung:
            if b not in single and refresh.asks(hung[b].joint):
                _read_joint(x, hung[b], bodies, hints or {}, q)
        elif b >= 0 and refresh.asks(s.model[name]):
            d, q0 = bodies[name], tree.q[b]
            if tree.joint[b] == POINT:
                n = tree.nq[b]
                q[q0 : q0 + n] = d.p[:n]
            elif s.model.planar:
                q[q0 : q0 + 3] = d.p[0], d.p[1], d.angle
            else:
                q[q0 : q0 + 7] = np.r_[d.p, matrix_to_quaternion(d.R)]
    return q


def free_velocities(x: Values, bodies: Mapping[str, BodyState], refresh: Refresh = ALL_ROWS) -> np.ndarray:
    """Velocities (nv,) of the bodies connected to ground by FREE, PLANAR or POINT; zero along all tree joints."""
    s, tree = x.structure, x.structure.tables["tree"]
    v = refresh.state("v", s.nv, x.system.const.dtype)
    hung = {t.child for t in s.tree_joints.values()}
    for name, b in s.place.items():
        if b >= 0 and b not in hung and refresh.asks(s.model[name]):
            d, v0 = bodies[name], tree.v[b]
            if tree.joint[b] == POINT:
                n = tree.nv[b]
                v[v0 : v0 + n] = d.v[:n]
            elif s.model.planar:
                v[v0 : v0 + 3] = d.v[0], d.v[1], d.w[2]
            else:
                v[v0 : v0 + 6] = np.r_[d.v, matrix_product(d.R.T, d.w)]
    return v


def _read_one_coordinate_joints(
    x: Values, joints: list[TreeJoint], bodies: Mapping[str, BodyState], hints: Mapping[str, Any], q: np.ndarray
) -> None:
    """`_read_joint` for hinges and slides, all at once."""
    if not joints:
        return
    at = x.structure.tables["tree"].q[[t.child for t in joints]]
    frames = []
    for k, role in enumerate("FM"):
        own = np.array([x.poses.row(FrameSpec(0, t.joint, role)) for t in joints])
        carriers = [bodies.get(_carrying_bodies(x, t)[k], GROUND_STATE) for t in joints]
        p, R = np.array([d.p for d in carriers]), np.array([d.R for d in carriers])
        frames.append(
            (p + matrix_product(R, own[:, :3, None])[..., 0], matrix_product(R, own[:, 3:].reshape(-1, 3, 3)))
        )
    (pF, RF), (pM, RM) = frames
    back = RF.swapaxes(1, 2)
    rest = np.array([t.joint.rest or np.eye(3) for t in joints])
    shift, turn = (
        matrix_product(back, (pM - pF)[..., None])[..., 0],
        matrix_product(matrix_product(back, RM), rest.swapaxes(1, 2)),
    )
    for name, i in (("x", 0), ("y", 1), ("z", 2)):
        of = np.array([t.primitives[0].axis == name for t in joints])
        slides = of & np.array([t.primitives[0].kind == "P" for t in joints])
        q[at[slides]] = shift[slides, i]
        j, k = (i + 1) % 3, (i + 2) % 3
        for n in np.flatnonzero(of & ~slides):
            t = joints[n]
            angle = atan2(turn[n, k, j], turn[n, j, j])
            q[at[n]] = _with_turns(x, t, t.primitives[0].coordinate, angle, bodies, hints)


def _carrying_bodies(x: Values, t: TreeJoint) -> tuple[str, str]:
    """States of the bodies that carry frames F and M."""
    model = x.structure.model
    return model.carrier(t.joint.body_i, t.joint), model.carrier(t.joint.body_j, t.joint)


def _read_joint(
    x: Values, t: TreeJoint, bodies: Mapping[str, BodyState], hints: Mapping[str, float], q: np.ndarray
) -> None:
    """Coordinates of one tree joint from the pose of M in F: slides first, then rotations."""
    first = x.structure.tables["tree"].q
    (pF, RF), (pM, RM) = _joint_frames(x, t, bodies)
    rest = np.array(t.joint.rest or np.eye(3))
    shift, turn = matrix_product(RF.T, pM - pF), matrix_product(matrix_product(RF.T, RM), rest.T)
    way = list(zip(t.links, t.primitives, strict=False))
    for link, step in way[::-1] if t.reversed else way:
        at = first[link]
        a = UNIT_AXES[step.axis]
        if step.kind == "P":
            q[at] = inner_product(a, shift)
        elif step.kind == "S":
            q[at : at + 4] = matrix_to_quaternion(turn.T if t.reversed else turn)
        else:
            b = UNIT_AXES[
                NEXT_AXIS[step.axis]
            ]  # rotated by the angle; a further rotation is about an axis that this one has moved
            crossing = [o for o in t.primitives if o.kind == "R" and o is not step]
            if crossing and crossing[0].axis != step.axis:
                b = UNIT_AXES[crossing[0].axis]
            c = np.array(cross(a, b))
            turned = matrix_product(turn, b)
            angle = atan2(inner_product(c, turned), inner_product(b, turned))
            turn = matrix_product(_rotation_about(a, -angle), turn)
            q[at] = _with_turns(x, t, step.coordinate, angle, bodies, hints)


def _joint_frames(x: Values, t: TreeJoint, bodies: Mapping[str, BodyState]) -> list[tuple[np.ndarray, np.ndarray]]:
    """World poses of a joint's frames F and M for these body states."""
    out = []
    for role, name in zip("FM", _carrying_bodies(x, t), strict=True):
        p, R = x.poses.local(FrameSpec(0, t.joint, role))
        d = bodies.get(name, GROUND_STATE)
        out.append((d.p + matrix_product(d.R, p), matrix_product(d.R, R)))
    return out


def _rotation_about(a: np.ndarray, angle: float) -> np.ndarray:
    """Rotation about one of the three coordinate axes."""
    K = np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
    return np.eye(3) + sin(angle) * K + (1.0 - cos(angle)) * matrix_product(K, K)


def _with_turns(
    x: Values, t: TreeJoint, what: str, angle: Any, bodies: Mapping[str, BodyState], hints: Mapping[str, Any]
) -> Any:
    """The angle plus whole turns: those of a hint, or (in the plane) those of the bodies' own angles."""
    name = f"{t.joint.name}.{what}"
    if name in hints:
        near = t.joint.coordinates[what].sign * hints[name]
    elif x.structure.model.planar:
        i, j = _carrying_bodies(x, t)
        sign = np.sign(_normal(x, t))
        now = [bodies[k].angle if k != GROUND else 0.0 for k in (i, j)]
        drawn = [x.bodies[k].angle if k != GROUND else 0.0 for k in (i, j)]
        now_by, drawn_by = (sign * (a[1] - a[0]) for a in (now, drawn))
        F, M = (x.poses.world(FrameSpec(0, t.joint, role))[1] for role in "FM")
        at = 0.0 if F is M else _planar_angle(matrix_product(F.T, M), t)
        near = at + now_by - drawn_by
    else:
        return angle
    return angle + whole_turns(near, angle)


def whole_turns(near: Any, angle: Any) -> Any:
    """Whole turns [rad] that bring an angle nearest to another one."""
    return 2.0 * np.pi * rounded((near - angle) / (2.0 * np.pi))


def _normal(x: Values, t: TreeJoint) -> float:
    """Component along the plane's normal of the axis of a joint in the plane."""
    R = x.poses.world(FrameSpec(0, t.joint, "F"))[1]
    return float(matrix_product(R, UNIT_AXES[t.joint.planar_normal])[2].real)


def _planar_angle(turn: np.ndarray, t: TreeJoint) -> Any:
    """Angle of a rotation about a planar joint's normal."""
    b = UNIT_AXES[NEXT_AXIS[t.joint.planar_normal]]
    c = np.array(cross(UNIT_AXES[t.joint.planar_normal], b))
    turned = matrix_product(turn, b)
    return atan2(inner_product(c, turned), inner_product(b, turned))
