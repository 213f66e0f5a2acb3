"""A mechanism in general motion in which an element is tested."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..joints import Prismatic, Revolute, Spherical
from ..mechanism import Mechanism
from ..model.body import GROUND, Body, Frame
from ..model.element import Unit, Vector, fields_with
from ..model.force import CoordinateForce, Force
from ..model.geometry import orientation_matrix
from ..model.joint import Joint

AXIS = np.array([1.0, 2.0, -2.0]) / 3.0
ACROSS = np.array([2.0, 1.0, 2.0]) / 3.0
KINDS: dict[str, Any] = {"angle": Revolute, "displacement": Prismatic}
FRAME, CARRIER = "frame", "body of "
GRAVITY = np.array([0.7, -1.5, -9.3])


def sample_mechanism(
    e: Force | Joint,
    parameters: Mapping[str, Any] | None = None,
    Q: np.ndarray | None = None,
    d: np.ndarray | None = None,
) -> Mechanism:
    """The element, and the bodies, frames and joints that it names: bodies of about 1 kg and 1 m, in gravity.

    Each body is joined to an arm that is hinged on ground, so that joint coordinates differ from absolute ones.

    Parameters
    ----------
    e : Force or Joint
    parameters : mapping, optional
        Of the mechanism, if the element names some.
    Q, d : ndarray
        Rotation and shift of the whole, element and gravity included.
    """
    Q, d = np.eye(3) if Q is None else Q, np.zeros(3) if d is None else d
    m = Mechanism("sample", gravity=_plain(Q @ GRAVITY), parameters=dict(parameters or {}))
    orientation = _quaternion(Q)
    for k, (body, joint, what) in enumerate(_needed(e)):
        arm, start = f"arm of {body}", np.array([1.5 * k, 0.3 * k, 0.2])
        hinge, ball, centre = (start + np.array(x) for x in ((0.0, 0.4, 0.1), (0.3, 0.1, -0.1), (0.5, -0.2, 0.0)))
        for name, at, spin in ((arm, start, 0.4 * AXIS), (body, centre, np.array([0.6, -1.1, 0.9]))):
            given: dict[str, Any] = {"position": _plain(Q @ at + d), "orientation": orientation}
            if not (what in KINDS and name == body):
                given["angular_velocity"] = _plain(Q @ spin)
            m.add(Body(name, mass=1.2, inertia=(0.05, 0.08, 0.11), **given))
        m.add(Revolute(f"hinge of {arm}", GROUND, arm, at=_plain(Q @ hinge + d), axis=_plain(Q @ AXIS)))
        kind = KINDS.get(what, Spherical)
        axis = {} if kind is Spherical else {"axis": _plain(Q @ ACROSS)}
        m.add(kind(joint, arm, body, at=_plain(Q @ ball + d), **axis))
        if what == FRAME:
            m.add(Frame(body.removeprefix(CARRIER), body, position=(0.1, 0.05, -0.1), orientation=(0.8, 0.0, 0.6, 0.0)))
    m.add(_turned(e, Q, d))
    return m


def _needed(e: Force | Joint) -> list[tuple[str, str, str]]:
    """Bodies that have to be there, the joint of each, and what it must have: a coordinate, or a frame on the body."""
    if isinstance(e, Joint) and e.at is None:  # it names frames
        return [(CARRIER + x, f"joint of {x}", FRAME) for x in e.ends().values() if x != GROUND]
    found: dict[str, tuple[str, str]] = {x: (f"joint of {x}", "") for x in e.ends().values() if x != GROUND}
    for text in e.along() if isinstance(e, CoordinateForce) else ():
        owner, _, what = text.partition(".")
        if what in ("angle", "displacement"):
            found[f"body of {owner}"] = owner, what
        else:
            found[owner] = f"joint of {owner}", ""
    return [(body, joint, what) for body, (joint, what) in found.items()]


def _turned(e: Any, Q: np.ndarray, d: np.ndarray) -> Force | Joint:
    """The element with its points and directions rotated and its points shifted."""
    units, new = fields_with(type(e), Unit), dict[str, Any]()
    points = {name for name, unit in units.items() if unit.dimension == "m" and isinstance(getattr(e, name), tuple)}
    for name in points.union(fields_with(type(e), Vector)):
        value = getattr(e, name)
        if value is not None and (np.eye(3) != Q).any():
            shift = d if name in points else np.zeros(3)
            x = np.array(value, float)
            new[name] = tuple(_plain(Q @ v + shift) for v in x) if x.ndim > 1 else _plain(Q @ x + shift)
    fields = type(e).__dataclass_fields__
    if (np.eye(3) != Q).any() and "orientation" in fields:  # of its axes as drawn; the world's if not given
        given = e.orientation
        R = np.eye(3) if given is None else orientation_matrix(given, f"orientation of {e.title}")
        new["orientation"] = _quaternion(Q @ R)
    return dataclasses.replace(e, **new) if new else e


def _quaternion(Q: np.ndarray) -> tuple[float, ...]:
    from scipy.spatial.transform import Rotation

    return _plain(np.roll(Rotation.from_matrix(Q).as_quat(), 1))


def _plain(x: np.ndarray) -> tuple[float, ...]:
    return tuple(float(v) for v in x)
