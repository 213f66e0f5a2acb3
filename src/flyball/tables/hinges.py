"""Frames of the tree joints, each with z along its own axis: on what comes before, and seen from what comes after."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..math.products import product
from ..math.scalar import real_parts
from .afresh import Afresh
from .poses import Poses
from .specs import FrameSpec, Structure
from .system import BODY_P, BODY_R, BODY_TURNS, OFFSET, REVOLUTE, TREE, TREE_P, TREE_R, TREE_TURNS

ONE = np.eye(3)
TO_AXIS = {"x": np.roll(ONE, 2, axis=1), "y": np.roll(ONE, 1, axis=1), "z": ONE}  # z goes there
BACK = np.diag([1.0, -1.0, -1.0])  # turns an axis round


def tree_frames(s: Structure, pose: Poses, numbers: Mapping, body_x: np.ndarray, new: Afresh) -> None:
    """Frames of all tree joints into the body table.

    A chain leads from F to M; where the body beyond carries F it is gone back, every step about the axis turned round.
    """
    joints = [t for t in s.tree_joints.values() if new.asks(t.joint)]
    if not joints:
        return
    back = np.array([t.reversed for t in joints])[:, None, None]
    rest = np.array([t.joint.rest or ONE for t in joints])
    (pF, RF), (pM, RM) = (_stacked([pose.local(FrameSpec(0, t.joint, role)) for t in joints]) for role in "FM")
    M_back, F_back = product(rest, _turned(RM)), _turned(RF)
    before_p, before_R = np.where(back, pM, pF), np.where(back, product(RM, _turned(rest)), RF)
    beyond_p, beyond_R = np.where(back, product(-F_back, pF), product(-M_back, pM)), np.where(back, F_back, M_back)
    for t in joints:
        for link, step in zip(t.links, t.primitives, strict=False):
            if step.coordinate in t.joint.coordinates:
                body_x[link, OFFSET] = t.joint.offset(numbers[t.joint.name], step.coordinate)
    links = np.array([link for t in joints for link in t.links])
    turns = np.array([_turn(t, k) for t in joints for k in range(len(t.links))])
    last = np.cumsum([len(t.links) for t in joints]) - 1
    first = np.r_[0, last[:-1] + 1]
    p, R = np.zeros((len(links), 3, 1), body_x.dtype), np.tile(ONE.astype(body_x.dtype), (len(links), 1, 1))
    p[first], R[first] = before_p, before_R
    body_x[links, TREE_P : TREE_P + 3], body_x[links, TREE_R : TREE_R + 9] = p[..., 0], product(R, turns).reshape(-1, 9)
    p[:], R[:] = 0.0, ONE
    p[last], R[last] = beyond_p, beyond_R
    turns = _turned(turns)
    body_x[links, BODY_P : BODY_P + 3] = product(turns, p)[..., 0]
    body_x[links, BODY_R : BODY_R + 9] = product(turns, R).reshape(-1, 9)
    _leave_out(body_x, links, s.tables["body_i"][links, TREE])


def _turn(t: Any, k: int) -> np.ndarray:
    """Rotation from the frame before a step of a joint to one with z along the step's axis."""
    if not t.primitives:
        return ONE
    step = t.primitives[k]
    return TO_AXIS[step.axis] @ BACK if t.reversed and step.kind != "S" else TO_AXIS[step.axis]


def _stacked(poses: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3, 1) and rotations (n, 3, 3)."""
    return np.array([p for p, _ in poses])[..., None], np.array([R for _, R in poses])


def _turned(R: np.ndarray) -> np.ndarray:
    """Transposed matrices."""
    return R.swapaxes(1, 2)


def _leave_out(body_x: np.ndarray, links: np.ndarray, kinds: np.ndarray) -> None:
    """Note in the rows of links which of their joints' constant rotations are none: they need not be multiplied.

    One about the axis of a hinge may as well come after the hinge's own, and becomes one with what stands there.
    """
    tree, body = slice(TREE_R, TREE_R + 9), slice(BODY_R, BODY_R + 9)
    T = body_x[links, tree].reshape(-1, 3, 3)
    upright = (T[:, 2, 2] == 1.0) & ~(T[:, 2, :2] != 0.0).any(axis=1) & ~(T[:, :2, 2] != 0.0).any(axis=1)
    about = (kinds == REVOLUTE) & upright
    at, T = links[about], T[about]
    body_x[at, BODY_P : BODY_P + 3] = product(T, body_x[at, BODY_P : BODY_P + 3, None])[..., 0]
    body_x[at, body] = product(T, body_x[at, body].reshape(-1, 3, 3)).reshape(-1, 9)
    body_x[at, tree] = ONE.ravel()
    for rotation, turns in ((tree, TREE_TURNS), (body, BODY_TURNS)):
        R = body_x[links, rotation]
        none = _never_else(R) & (np.abs(real_parts(R) - ONE.ravel()) < 1e-15).all(axis=1)
        body_x[links[none], rotation] = ONE.ravel()
        body_x[links[none], turns] = 0.0
        body_x[links[~none], turns] = (ONE.ravel() != R[~none]).any(axis=1).astype(float)


def _never_else(R: np.ndarray) -> np.ndarray:
    """Whether rows are what they are for other values of the parameters too, as far as these numbers carry it."""
    if R.dtype == object:
        return np.array([not any(hasattr(x, "called") and not x.known for x in row) for row in R], bool)
    return np.asarray(~R.imag.any(axis=1))
