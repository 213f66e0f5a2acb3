"""x = M^-1 f of a forest in O(n): articulated bodies (Featherstone 2008, chapter 7), as a factor and solves with it.

Wrenches and twists are taken about the reference points of the tree joints, W.O, with components along the world's
axes: from a body to its parent there is a shift and no turn. A joint of several velocities is a chain of joints with
one each, all at its point: whatever its kind, what is eliminated is one twist column X at a time. Of the inertia

    I = [J H; H^T K]: (angular velocity, velocity of the point) -> (moment, force)

of all that hangs beyond it, U = I X and D = X . U, the parent feels I - U U^T / D. M itself is never made. Gravity,
gyroscopic terms and bias accelerations stand in f, so no velocity occurs here.

A velocity that a driver prescribes is not eliminated: its acceleration is given, and the driver's effort comes out.

Bodies stand in the table behind their parents, and where a body is the next one behind its parent, as in a chain, what
goes from one to the other stays in registers. Everything else waits in W.IC[b]. W.X[d] holds, behind the twist of
velocity d, U, D and 1 / D.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import positive
from ..math.vec import add, cross, dot, load3, load9, mtv, mv, put3, put9, scale, sub, symmetric
from .mass import load6, plus, put6, rigid, root_columns

# columns of W.IC: parts of an inertia, after J; whether any waits there; a wrench or acceleration that does
COUPLING, LINEAR, LOST, TOTAL, WAITING, PASSED = 6, 15, 21, 22, 23, 24
# columns of W.X
RESPONSE, STIFF, SOFT = 6, 12, 13
ROUNDING = 1e-14  # of what it would be with all joints beyond it held: a smaller inertia is none


@formula
def articulate(S, W):
    """Factor the equations of motion of a forest at the kinematics now in W.

    Returns
    -------
    int
        0, or 1 + the velocity that moves no inertia.
    """
    A = W.IC
    n = S.tree.parent.shape[0]
    o = 0.0 * W.O[0, 0]
    for b in range(n):
        A[b, WAITING] = o
    I = nothing(o)
    for b in range(n - 1, -1, -1):
        root_columns(S, W, b)
        I = with_body(S, W, b, I)
        status, I = eliminate(S, W, b, I)
        if status != 0:
            return status
        a = S.tree.parent[b]
        if a >= 0:
            I = moved(I, sub(load3(W.O, b, 0), load3(W.O, a, 0)))
        if a != b - 1:
            if a >= 0:
                leave(A, a, I)
            I = nothing(o)
    return 0


@formula
def nothing(o):
    """No inertia: J, H, K; how much was lost of the trace of J; mass."""
    zero = (o, o, o, o, o, o)
    return zero, (o, o, o, o, o, o, o, o, o), zero, o, o


@formula
def both(I, other):
    """Sum of two inertias."""
    J, H, K, lost, mass = I
    J2, H2, K2, lost2, mass2 = other
    x, y, z = add(H[0:3], H2[0:3]), add(H[3:6], H2[3:6]), add(H[6:9], H2[6:9])
    return plus(J, J2), (*x, *y, *z), plus(K, K2), lost + lost2, mass + mass2


@formula
def waiting(A, b):
    """The inertia that others have left for body b."""
    return load6(A, b, 0), load9(A, b, COUPLING), load6(A, b, LINEAR), A[b, LOST], A[b, TOTAL]


@formula
def leave(A, b, I):
    """Leave an inertia for body b, beside what waits there."""
    if A[b, WAITING].real > 0.0:
        I = both(I, waiting(A, b))
    put6(A, b, 0, I[0])
    put9(A, b, COUPLING, I[1])
    put6(A, b, LINEAR, I[2])
    A[b, LOST] = I[3]
    A[b, TOTAL] = I[4]
    A[b, WAITING] = 1.0


@formula
def with_body(S, W, b, I):
    """The inertia handed to body b, with its own and what waits there."""
    J, H, K, lost, mass = I
    m, h, own = rigid(S, W, b)
    H = (H[0], H[1] - h[2], H[2] + h[1], H[3] + h[2], H[4], H[5] - h[0], H[6] - h[1], H[7] + h[0], H[8])
    I = plus(J, own), H, (K[0] + m, K[1], K[2], K[3] + m, K[4], K[5] + m), lost, mass + m
    if W.IC[b, WAITING].real > 0.0:
        I = both(I, waiting(W.IC, b))
    return I


@formula
def eliminate(S, W, b, I):
    """Take the velocities of body b out of the inertia, the last one first. Returns (status, what is left).

    An inertia along a velocity counts as none if it is but the rounding errors of those that were taken out before.
    """
    J, H, K, lost, mass = I
    size = J[0] + J[3] + J[5] + lost
    v0 = S.tree.v[b]
    for d in range(v0 + S.tree.nv[b] - 1, v0 - 1, -1):
        w, v = load3(W.X, d, 0), load3(W.X, d, 3)
        t, f = symmetric(J, w), mtv(H, w)
        D = dot(w, t)
        least = size
        if v[0] != 0.0 or v[1] != 0.0 or v[2] != 0.0:
            t, f = add(t, mv(H, v)), add(f, symmetric(K, v))
            D = dot(w, t) + dot(v, f)
            least = dot(w, w) * size + dot(v, v) * mass
        put3(W.X, d, RESPONSE, t)
        put3(W.X, d, RESPONSE + 3, f)
        W.X[d, STIFF] = D
        if S.tree.law[b] < 0:
            if not positive(D - ROUNDING * least):
                return 1 + d, (J, H, K, lost, mass)
            r = 1.0 / D
            W.X[d, SOFT] = r
            y, z = scale(r, t), scale(r, f)
            J, H, K = less(J, t, y), less_coupled(H, t, z), less(K, f, z)
            lost = lost + dot(t, y)
    return 0, (J, H, K, lost, mass)


@formula
def less(J, a, b):
    """J - a b^T, symmetric."""
    return (
        J[0] - a[0] * b[0],
        J[1] - a[0] * b[1],
        J[2] - a[0] * b[2],
        J[3] - a[1] * b[1],
        J[4] - a[1] * b[2],
        J[5] - a[2] * b[2],
    )


@formula
def less_coupled(H, a, b):
    """H - a b^T."""
    return (
        *sub(H[0:3], scale(a[0], b)),
        *sub(H[3:6], scale(a[1], b)),
        *sub(H[6:9], scale(a[2], b)),
    )


@formula
def moved(I, d):
    """The inertia about a point that lies at -d from its own: H + d~ K, J + d~ (H + d~ K)^T - H d~."""
    J, H, K, lost, mass = I
    x = add((H[0], H[3], H[6]), cross(d, (K[0], K[1], K[2])))
    y = add((H[1], H[4], H[7]), cross(d, (K[1], K[3], K[4])))
    z = add((H[2], H[5], H[8]), cross(d, (K[2], K[4], K[5])))
    J = (
        J[0] + (d[1] * z[0] - d[2] * y[0]) + (d[1] * H[2] - d[2] * H[1]),
        J[1] + (d[1] * z[1] - d[2] * y[1]) + (d[2] * H[0] - d[0] * H[2]),
        J[2] + (d[1] * z[2] - d[2] * y[2]) + (d[0] * H[1] - d[1] * H[0]),
        J[3] + (d[2] * x[1] - d[0] * z[1]) + (d[2] * H[3] - d[0] * H[5]),
        J[4] + (d[2] * x[2] - d[0] * z[2]) + (d[0] * H[4] - d[1] * H[3]),
        J[5] + (d[0] * y[2] - d[1] * x[2]) + (d[0] * H[7] - d[1] * H[6]),
    )
    return J, (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]), K, lost, mass


@formula
def articulated_solve(S, W, f, x, effort):
    """Solve M x = f with the factor in W.

    Parameters
    ----------
    S : System
    W : Work
    f : array, shape (nv,)
        Generalised forces [N, N m], those of the drivers not among them; kept.
    x : array, shape (nv,)
        Accelerations, out. Where a driver prescribes one it is taken as it comes in.
    effort : array, shape (nv,)
        At the velocities that a driver prescribes: the generalised force (M x - f)[d] that it has to add. The other
        entries are left alone.
    """
    A = W.IC
    n = S.tree.parent.shape[0]
    o = 0.0 * W.O[0, 0]
    zero = (o, o, o)
    for b in range(n):
        if A[b, WAITING].real > 0.0:
            put3(A, b, PASSED, zero)
            put3(A, b, PASSED + 3, zero)
    moment, force = zero, zero
    for b in range(n - 1, -1, -1):
        moment, force = collect(S, W, b, (moment, force), f, x, effort)
        a = S.tree.parent[b]
        if a >= 0:
            moment = add(moment, cross(sub(load3(W.O, b, 0), load3(W.O, a, 0)), force))
        if a != b - 1:
            if a >= 0:
                put3(A, a, PASSED, add(load3(A, a, PASSED), moment))
                put3(A, a, PASSED + 3, add(load3(A, a, PASSED + 3), force))
            moment, force = zero, zero
    turn, shift = zero, zero
    for b in range(n):
        a = S.tree.parent[b]
        if a < 0:
            turn, shift = zero, zero
        else:
            if a != b - 1:
                turn, shift = load3(A, a, PASSED), load3(A, a, PASSED + 3)
            shift = add(shift, cross(turn, sub(load3(W.O, b, 0), load3(W.O, a, 0))))
        turn, shift = spread(S, W, b, (turn, shift), x, effort)
        if A[b, WAITING].real > 0.0:
            put3(A, b, PASSED, turn)
            put3(A, b, PASSED + 3, shift)


@formula
def collect(S, W, b, wrench, f, x, effort):
    """The wrench that goes from body b to its parent, from the one handed to it and what waits there.

    Forces that are left for its own velocities go to x, or to effort where a driver prescribes them.
    """
    t, p = wrench
    if W.IC[b, WAITING].real > 0.0:
        t, p = add(t, load3(W.IC, b, PASSED)), add(p, load3(W.IC, b, PASSED + 3))
    v0 = S.tree.v[b]
    for d in range(v0 + S.tree.nv[b] - 1, v0 - 1, -1):
        u = f[d] - (dot(load3(W.X, d, 0), t) + dot(load3(W.X, d, 3), p))
        if S.tree.law[b] < 0:
            x[d] = u
            s = u * W.X[d, SOFT]
        else:
            effort[d] = u
            s = x[d]
        t = add(t, scale(s, load3(W.X, d, RESPONSE)))
        p = add(p, scale(s, load3(W.X, d, RESPONSE + 3)))
    return t, p


@formula
def spread(S, W, b, carried, x, effort):
    """Accelerations of body b's velocities into x, and of the body, from the one at which its parent carries it."""
    w, v = carried
    for d in range(S.tree.v[b], S.tree.v[b] + S.tree.nv[b]):
        s = dot(load3(W.X, d, RESPONSE), w) + dot(load3(W.X, d, RESPONSE + 3), v)
        if S.tree.law[b] < 0:
            x[d] = (x[d] - s) * W.X[d, SOFT]
        else:
            effort[d] = W.X[d, STIFF] * x[d] + s - effort[d]
        w = add(w, scale(x[d], load3(W.X, d, 0)))
        v = add(v, scale(x[d], load3(W.X, d, 3)))
    return w, v
