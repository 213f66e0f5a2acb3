"""q -> poses, v -> velocities and bias accelerations, of bodies and frames."""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.vec import load3, load9
from .records import at_rest, carried, load, store_motion, store_pose
from .tree import motion, pose


@formula
def poses(S, W, q):
    """Positions and rotations of all bodies, parents first, and of the frames on them."""
    for b in range(S.tree.parent.shape[0]):
        pose(S, W, b, q)
    for k in range(S.sizes.ground_frames, S.sizes.moving_frames):
        p, R, _, _, _, _ = carried(
            load(W.BK, S.frame_body[k]), load3(S.frames.position, k, 0), load9(S.frames.rotation, k, 0)
        )
        store_pose(W.FK, k, p, R)


@formula
def motions(S, W, v):
    """Velocities and bias accelerations at these poses."""
    for b in range(S.tree.parent.shape[0]):
        motion(S, W, b, v)
    frame_motions(S, W)


@formula
def frame_motions(S, W):
    """Those of the frames, from their bodies'."""
    for k in range(S.sizes.ground_frames, S.sizes.moving_frames):
        _, _, w, u, alpha, a = carried(
            load(W.BK, S.frame_body[k]), load3(S.frames.position, k, 0), load9(S.frames.rotation, k, 0)
        )
        store_motion(W.FK, k, w, u, alpha, a)


@formula
def frames(S, W):
    """Poses and motions of the frames in one pass."""
    for k in range(S.sizes.ground_frames, S.sizes.moving_frames):
        p, R, w, u, alpha, a = carried(
            load(W.BK, S.frame_body[k]), load3(S.frames.position, k, 0), load9(S.frames.rotation, k, 0)
        )
        store_pose(W.FK, k, p, R)
        store_motion(W.FK, k, w, u, alpha, a)


@formula
def ground_frames(S, W):
    """Records of the frames on ground, written once."""
    for k in range(S.sizes.ground_frames):
        p, R, w, v, alpha, a = at_rest(
            load3(S.frames.position, k, 0), load9(S.frames.rotation, k, 0), 0.0 * S.frames.position[k, 0]
        )
        store_pose(W.FK, k, p, R)
        store_motion(W.FK, k, w, v, alpha, a)
