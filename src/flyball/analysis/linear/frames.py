"""Evenly turning frames: which a motion may be steady from, and how changes of a state turn with them.

What turns with a frame is how the bodies move: with B(t) the changes of their positions and rotations, seen from the
frame they are T(t)^-1 B(t), T = exp(t H_B), whatever coordinates tell them. Coordinates x with B = J x turn by H where

    J H = H_B J - dJ/dt

Absolute coordinates are those of the bodies (J = 1), joint coordinates may turn with a body that carries the joint (H =
0 where that is the frame) or not. So the choice of a frame does not depend on the coordinates, and neither do the
eigenvalues that are seen from it.
"""

from __future__ import annotations

import numpy as np

from ...equations.tree import quaternion_at, rates
from ...numerics.rank import parts
from ...results.numbers import tuple_of
from ...results.records import Records
from .derivatives import State
from .loads import STEP, derivative
from .reduced import Frame

UNDECIDED = 1e-9  # singular values below this part of the largest leave the frame's turning open
IN_PLANE = (0, 1, 5)  # x, y and the angle about z, of a body's six
ROUNDED = 1e-13  # of the largest: entries of H that are none


def kinematic(x: State) -> np.ndarray:
    """N of `Frame`: changes of rotations have components along axes that turn, (nv, nv)."""
    S = x.c.values.system
    N = np.zeros((len(x.v),) * 2)
    for b in range(len(S.tree.parent)):
        _, w0 = quaternion_at(S, b)
        if w0 >= 0:
            at = slice(w0, w0 + 3)
            N[at, at] = -_skew(x.v[at])
    return N


def frames(x: State) -> list[Frame]:
    """Frames from which the motion may look steady, the most likely first.

    All bodies' velocities and angular velocities then turn with the frame: a = W x v, alpha = W x w. What this leaves
    open is chosen so that the frame stands still, or so that it turns with one of the bodies.
    """
    c = x.c
    c.at(x.t, x.q, x.v)
    r = Records(c.values, x.q[None], x.v[None], x.vdot[None])
    kept = [np.array([r.body(b)[k] for b in c.structure.place.values() if b >= 0])[..., 0] for k in (2, 3, 4, 5)]
    w, v, alpha, a = kept
    length = c.values.length
    A = np.vstack([-_skew(u) for u in [*(v / length), *w]])
    right = np.r_[(a / length).ravel(), alpha.ravel()]
    p = parts(A, UNDECIDED)
    least, open_ = p.seen @ ((p.span.T @ right) / p.values), p.null.T
    turns = [least]
    for spin in w:
        other = least + open_.T @ (open_ @ (spin - least))
        if min(np.abs(other - seen).max() for seen in turns) > UNDECIDED * (1.0 + np.abs(w).max()):
            turns.append(other)
    fast = max(np.abs(w).max(), np.abs(v).max() / length)
    turns = [np.where(np.abs(t) > UNDECIDED * fast, t, 0.0) for t in turns]  # the rest is rounding
    N = kinematic(x)
    return [Frame(turning, generator(x, turning), N) for turning in turns]


def told(x: State, frame: Frame, frozen: bool) -> str:
    """Where linear equations about a motion are seen from, for people; empty at rest."""
    if not np.abs(x.v).max(initial=0.0) > 0.0:
        return ""
    if frozen:
        return "the coordinates of this very instant"
    if not frame.turning.any():
        return "the ground"
    return f"a frame that turns with {tuple_of(frame.turning)} rad/s"


def generator(x: State, turning: np.ndarray) -> np.ndarray:
    """H of `Frame`: how changes of positions turn with a frame that turns with ``turning`` [rad/s], (nv, nv)."""
    s, S = x.c.structure, x.c.values.system
    if s.tree:
        return _of_joints(x, turning)
    x.c.at(x.t, x.q, x.v)
    H = np.zeros((len(x.v),) * 2)
    for b in range(len(S.tree.parent)):
        v0, n = int(S.tree.v[b]), int(S.tree.nv[b])
        own = _of_body(np.array(x.c.work.BK[b, 3:12]).reshape(3, 3), np.array(x.c.work.BK[b, 12:15]), turning)
        kept = (IN_PLANE if s.model.planar else range(6))[:n]  # a point mass has no turn
        H[v0 : v0 + n, v0 : v0 + n] = own[np.ix_(kept, kept)]
    return H


def _of_body(R: np.ndarray, w: np.ndarray, turning: np.ndarray) -> np.ndarray:
    """H_B of a body: its place turns with the frame; its rotation, along its axes, by its spin against the frame."""
    H = np.zeros((6, 6))
    H[:3, :3] = _skew(turning)
    H[3:, 3:] = -_skew(R.T @ (w - turning))
    return H


def _of_joints(x: State, turning: np.ndarray) -> np.ndarray:
    """H in joint coordinates: J and dJ/dt from a complex step along the motion."""
    c, nv = x.c, len(x.v)
    S, one = c.values.system, np.eye(nv)
    ahead = np.zeros_like(x.q)
    c.at(x.t, x.q, x.v)
    rates(S, x.q, x.v, ahead)
    r = Records(c.values, np.tile(x.q + 1j * STEP * ahead, (nv, 1)), one, 0.0 * one)
    J, rate, turned = [], [], []
    for b in c.structure.place.values():
        if b < 0:
            continue
        R, w, v = (np.array(part) for part in r.body(b)[1:4])
        own = np.vstack([v, np.einsum("jin,jn->in", R.reshape(3, 3, nv), w)])
        H = _of_body(R[:, 0].real.reshape(3, 3), w.real @ x.v, turning)
        size = np.r_[np.full(3, c.values.length), np.ones(3)][:, None]
        J.append(own.real / size)
        rate.append(derivative(own) / size)
        turned.append(H @ own.real / size)
    H = np.linalg.lstsq(np.vstack(J), np.vstack(turned) - np.vstack(rate), rcond=None)[0]
    return np.where(np.abs(H) > ROUNDED * np.abs(H).max(initial=0.0), H, 0.0)


def _skew(w: np.ndarray) -> np.ndarray:
    """Matrix of the cross product w x ."""
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
