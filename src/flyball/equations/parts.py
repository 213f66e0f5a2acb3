"""The equations of motion part by part: what Jacobians are put together from.

What no part depends on together may be stepped together (Curtis, Powell and Reid 1974). Of a chassis on which thirty
bodies hang the equations depend on all of them, but each mount on two bodies only; so a sum is taken apart, and a
Jacobian takes as many evaluations as the widest part has velocities.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.vec import load3
from ..tables.system import (
    ALONG,
    BETWEEN,
    SLIDING,
)
from .loads import acting, effort_of, inertial
from .sliding import friction
from .tree import project


@formula
def pushes(S, W, out):
    """Inertial wrench and weight of every body along the velocities of all that it hangs on. Returns how many terms."""
    for i in range(out.shape[0]):
        out[i] = 0.0
    inertial(S, W)
    at = 0
    for b in range(S.tree.parent.shape[0]):
        at = spread(S, W, b, out, at, -1.0, load3(W.FB, b, 0), load3(W.FB, b, 3), load3(W.BK, b, 0))
    return at


@formula
def parts(S, W, t, lam, out):
    """The terms of r, in the order of `analysis/motion/implicit/parts.py`; kinematics, rows and loads being known.

    Bodies; of each force between frames the side of M, then that of F; rows; forces along what is measured.
    """
    at = pushes(S, W, out)
    for k in range(S.forces.F.shape[0]):
        if S.forces.family[k] == BETWEEN:
            _, M, force, torque = acting(S, W, t, k)
            at = spread(S, W, S.frame_body[S.forces.M[k]], out, at, -1.0, force, torque, M[0])
            at = spread(S, W, S.frame_body[S.forces.F[k]], out, at, 1.0, force, torque, M[0])
    nr = S.rows.law.shape[0]
    for r in range(nr):
        at = along(S, W, r, -lam[r], out, at)
    for k in range(S.forces.F.shape[0]):
        if S.forces.family[k] == ALONG:
            s, _ = effort_of(S, W, t, k)
            at = along(S, W, nr + S.forces.F[k], -s, out, at)
        elif S.forces.family[k] == SLIDING:
            a, b, _ = friction(S, W, k)
            at = along(S, W, nr + S.forces.F[k], -a, out, at)
            if S.forces.M[k] >= 0:
                at = along(S, W, nr + S.forces.M[k], -b, out, at)
    return at


@formula
def spread(S, W, b, out, at, sign, force, torque, point):
    """A wrench on body b along its velocities, then along those of what it hangs on. Returns the next place."""
    while b >= 0:
        project(S, W, b, out, at, sign, force, torque, point)
        at += S.tree.nv[b]
        b = S.tree.parent[b]
    return at


@formula
def along(S, W, r, s, out, at):
    """The force s along row r. Returns the next place."""
    for e in range(S.row_start[r], S.row_start[r + 1]):
        out[at] = s * W.G[e]
        at += 1
    return at
