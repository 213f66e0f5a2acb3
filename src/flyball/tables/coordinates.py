"""Coordinates of the forest, read from where the bodies are: the drawn state, and the way between coordinate layers.

Goes for every chain of tree joints. Velocities are in ``equations/velocities.py``: they need the twist columns.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..math.products import inner, product
from ..math.scalar import atan2, cos, rounded, sin
from ..math.vec import cross
from ..model.body import GROUND
from ..model.geometry import matrix_to_quaternion
from .afresh import Afresh
from .forest import TreeJoint
from .specs import FrameSpec
from .system import POINT

if TYPE_CHECKING:
    from .values import Values

AXES = {"x": np.array([1.0, 0.0, 0.0]), "y": np.array([0.0, 1.0, 0.0]), "z": np.array([0.0, 0.0, 1.0])}

MANY = 30  # joints of one coordinate from which on they are read all at once
NEXT = {"x": "y", "y": "z", "z": "x"}


@dataclass(frozen=True)
class BodyState:
    """A body as it is: centre of mass, rotation, velocity, angular velocity, all in the world; in the plane its turned
    angle.
    """

    p: np.ndarray
    R: np.ndarray
    v: np.ndarray
    w: np.ndarray
    angle: Any = 0.0


ALL = Afresh()
REST = BodyState(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3))


def positions(
    x: Values,
    bodies: Mapping[str, BodyState],
    hints: Mapping[str, float] | None = None,
    new: Afresh = ALL,
) -> np.ndarray:
    """Coordinates (nq,) of the forest for bodies that are there; where these do not fit the tree joints, the nearest.

    ``hints``: angles of joints, "joint.coordinate", within half a turn; the drawn turns where they are not told.
    ``new``: which are found; the others are those of its tables.
    """
    s, tree = x.structure, x.structure.tables["tree"]
    q = new.state("q", s.nq, x.system.const.dtype)
    hung = {t.child: t for t in s.tree_joints.values()}
    single = {b: t for b, t in hung.items() if len(t.primitives) == 1 and t.primitives[0].kind in "RP"}
    if len(single) < MANY:
        single = {}
    _read_single(x, [t for t in single.values() if new.asks(t.joint)], bodies, hints or {}, q)
    for name, b in s.place.items():
        if b in hung:
            if b not in single and new.asks(hung[b].joint):
                _read(x, hung[b], bodies, hints or {}, q)
        elif b >= 0 and new.asks(s.model[name]):
            d, q0 = bodies[name], tree.q[b]
            if tree.joint[b] == POINT:
                n = tree.nq[b]
                q[q0 : q0 + n] = d.p[:n]
            elif s.model.planar:
                q[q0 : q0 + 3] = d.p[0], d.p[1], d.angle
            else:
                q[q0 : q0 + 7] = np.r_[d.p, matrix_to_quaternion(d.R)]
    return q


def free_velocities(x: Values, bodies: Mapping[str, BodyState], new: Afresh = ALL) -> np.ndarray:
    """Velocities (nv,) of the bodies that hang on ground by FREE, PLANAR or POINT; zero along all tree joints."""
    s, tree = x.structure, x.structure.tables["tree"]
    v = new.state("v", s.nv, x.system.const.dtype)
    hung = {t.child for t in s.tree_joints.values()}
    for name, b in s.place.items():
        if b >= 0 and b not in hung and new.asks(s.model[name]):
            d, v0 = bodies[name], tree.v[b]
            if tree.joint[b] == POINT:
                n = tree.nv[b]
                v[v0 : v0 + n] = d.v[:n]
            elif s.model.planar:
                v[v0 : v0 + 3] = d.v[0], d.v[1], d.w[2]
            else:
                v[v0 : v0 + 6] = np.r_[d.v, product(d.R.T, d.w)]
    return v


def _read_single(
    x: Values, joints: list[TreeJoint], bodies: Mapping[str, BodyState], hints: Mapping[str, Any], q: np.ndarray
) -> None:
    """The same as `_read` for hinges and slides, all at once."""
    if not joints:
        return
    at = x.structure.tables["tree"].q[[t.child for t in joints]]
    frames = []
    for k, role in enumerate("FM"):
        own = np.array([x.poses.row(FrameSpec(0, t.joint, role)) for t in joints])
        carriers = [bodies.get(_ends(x, t)[k], REST) for t in joints]
        p, R = np.array([d.p for d in carriers]), np.array([d.R for d in carriers])
        frames.append((p + product(R, own[:, :3, None])[..., 0], product(R, own[:, 3:].reshape(-1, 3, 3))))
    (pF, RF), (pM, RM) = frames
    back = RF.swapaxes(1, 2)
    rest = np.array([t.joint.rest or np.eye(3) for t in joints])
    shift, turn = product(back, (pM - pF)[..., None])[..., 0], product(product(back, RM), rest.swapaxes(1, 2))
    for name, i in (("x", 0), ("y", 1), ("z", 2)):
        of = np.array([t.primitives[0].axis == name for t in joints])
        slides = of & np.array([t.primitives[0].kind == "P" for t in joints])
        q[at[slides]] = shift[slides, i]
        j, k = (i + 1) % 3, (i + 2) % 3
        for n in np.flatnonzero(of & ~slides):
            t = joints[n]
            angle = atan2(turn[n, k, j], turn[n, j, j])
            q[at[n]] = _with_turns(x, t, t.primitives[0].coordinate, angle, bodies, hints)


def _ends(x: Values, t: TreeJoint) -> tuple[str, str]:
    """Bodies that carry frames F and M."""
    model = x.structure.model
    return model.carrier(t.joint.body_i, t.joint), model.carrier(t.joint.body_j, t.joint)


def _read(x: Values, t: TreeJoint, bodies: Mapping[str, BodyState], hints: Mapping[str, float], q: np.ndarray) -> None:
    """Coordinates of one tree joint from the pose of M in F: slides first, then what turns."""
    first = x.structure.tables["tree"].q
    (pF, RF), (pM, RM) = _frames(x, t, bodies)
    rest = np.array(t.joint.rest or np.eye(3))
    shift, turn = product(RF.T, pM - pF), product(product(RF.T, RM), rest.T)
    way = list(zip(t.links, t.primitives, strict=False))
    for link, step in way[::-1] if t.reversed else way:
        at = first[link]
        a = AXES[step.axis]
        if step.kind == "P":
            q[at] = inner(a, shift)
        elif step.kind == "S":
            q[at : at + 4] = matrix_to_quaternion(turn.T if t.reversed else turn)
        else:
            b = AXES[NEXT[step.axis]]  # turned by the angle; a further turn is about an axis that this one has turned
            crossing = [o for o in t.primitives if o.kind == "R" and o is not step]
            if crossing and crossing[0].axis != step.axis:
                b = AXES[crossing[0].axis]
            c = np.array(cross(a, b))
            turned = product(turn, b)
            angle = atan2(inner(c, turned), inner(b, turned))
            turn = product(_about(a, -angle), turn)
            q[at] = _with_turns(x, t, step.coordinate, angle, bodies, hints)


def _frames(x: Values, t: TreeJoint, bodies: Mapping[str, BodyState]) -> list[tuple[np.ndarray, np.ndarray]]:
    """World poses of a joint's frames F and M on those bodies."""
    out = []
    for role, name in zip("FM", _ends(x, t), strict=True):
        p, R = x.poses.local(FrameSpec(0, t.joint, role))
        d = bodies.get(name, REST)
        out.append((d.p + product(d.R, p), product(d.R, R)))
    return out


def _about(a: np.ndarray, angle: float) -> np.ndarray:
    """Rotation about one of the three axes."""
    K = np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
    return np.eye(3) + sin(angle) * K + (1.0 - cos(angle)) * product(K, K)


def _with_turns(
    x: Values, t: TreeJoint, what: str, angle: Any, bodies: Mapping[str, BodyState], hints: Mapping[str, Any]
) -> Any:
    """The angle with the whole turns that somebody told, or (in the plane) that the bodies' own angles say."""
    name = f"{t.joint.name}.{what}"
    if name in hints:
        near = t.joint.coordinates[what].sign * hints[name]
    elif x.structure.model.planar:
        i, j = _ends(x, t)
        sign = np.sign(_normal(x, t))
        now = [bodies[k].angle if k != GROUND else 0.0 for k in (i, j)]
        drawn = [x.bodies[k].angle if k != GROUND else 0.0 for k in (i, j)]
        now_by, drawn_by = (sign * (a[1] - a[0]) for a in (now, drawn))
        F, M = (x.poses.world(FrameSpec(0, t.joint, role))[1] for role in "FM")
        at = 0.0 if F is M else _planar_angle(product(F.T, M), t)
        near = at + now_by - drawn_by
    else:
        return angle
    return angle + whole_turns(near, angle)


def whole_turns(near: Any, angle: Any) -> Any:
    """Whole turns [rad] that bring an angle next to another one."""
    return 2.0 * np.pi * rounded((near - angle) / (2.0 * np.pi))


def _normal(x: Values, t: TreeJoint) -> float:
    """Component along the plane's normal of the axis that a joint in the plane turns about."""
    R = x.poses.world(FrameSpec(0, t.joint, "F"))[1]
    return float(product(R, AXES[t.joint.planar_normal])[2].real)


def _planar_angle(turn: np.ndarray, t: TreeJoint) -> Any:
    """Angle of a turn about a planar joint's normal."""
    b = AXES[NEXT[t.joint.planar_normal]]
    c = np.array(cross(AXES[t.joint.planar_normal], b))
    turned = product(turn, b)
    return atan2(inner(c, turned), inner(b, turned))
