"""A ball on a rounded box: the gap between them, and the sliding velocity of one surface over the other.

M's origin is the centre of the ball. F's origin is the middle of the core of the other side, which contains all points
within the half edges par[0:3] along F's axes: a point (for a ball), a line (for a capsule) or a box. With q the point
of the core nearest to the centre p and n = (p - q) / |p - q| the gap is |p - q| - par[6], where par[6] is the sum of
the radii. Only motion that changes p - q rotates n, so one formula covers faces, edges and corners; the curvature jumps
between them. Inside the core the nearest face counts.

Slip is the velocity of M's material relative to F's at p - r n, r = par[3], along one of two tangents. If par[4] is 0
it is the tangent in the plane, z x n. Otherwise it is number par[4] of the two axes perpendicular to n that rotate with
n continuously (Duff and others 2017) for every n but one, which points against the world axis par[5] (1, 2, 3, or
-1, -2, -3).
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import sqrt
from ..math.vec import add, cross, dot, mtv, mv, neg, scale, sub

KIND_GAP = 12
KIND_SLIP = 13
SINGLE = True


@formula
def beyond(x, h):
    """Return the distance of x beyond the interval -h..h, with its sign."""
    if x.real > h.real:
        return x - h
    return x + h if x.real < -h.real else 0.0 * x


@formula
def within(h, e, w):
    """Return the part of a rate w that rotates the normal: zero within -h..h. For h = 0 it is w, even at e = 0."""
    return w if e.real != 0.0 or h.real == 0.0 else 0.0 * w


@formula
def face(par, p):
    """Return the face of the core that p lies farthest beyond, or nearest below: 0 to 5 for +x, -x, +y, -y, +z, -z."""
    best = -1e300
    found = 0
    for i in range(3):
        depth = p[i].real - par[i].real
        if depth > best:
            best, found = depth, 2 * i
        depth = -p[i].real - par[i].real
        if depth > best:
            best, found = depth, 2 * i + 1
    return found


@formula
def outward(number, o):
    """Return the normal of a face, in the axes of the core."""
    s = o + (1.0 if number % 2 == 0 else -1.0)
    i = number // 2
    return (s if i == 0 else o, s if i == 1 else o, s if i == 2 else o)


@formula
def nearest(par, F, M):
    """Return the distance from the core, the normal and its rate in the world, and the curvature term of the bias."""
    d = sub(M[0], F[0])
    p = mtv(F[1], d)
    e = (beyond(p[0], par[0]), beyond(p[1], par[1]), beyond(p[2], par[2]))
    o = 0.0 * p[0]
    square = dot(e, e)
    if square.real > 0.0:
        distance = sqrt(square)
        n = scale(1.0 / distance, e)
        w = mtv(F[1], sub(sub(M[3], F[3]), cross(F[2], d)))
        w = (within(par[0], e[0], w[0]), within(par[1], e[1], w[1]), within(par[2], e[2], w[2]))
        rate = dot(n, w)
        n1 = scale(1.0 / distance, sub(w, scale(rate, n)))
        curved = (dot(w, w) - rate * rate) / distance
    else:
        n = outward(face(par, p), o)
        distance = dot(n, p) - (par[0] * n[0] * n[0] + par[1] * n[1] * n[1] + par[2] * n[2] * n[2])
        n1 = (o, o, o)
        curved = o
    N = mv(F[1], n)
    return distance, N, add(mv(F[1], n1), cross(F[2], N)), curved


@formula
def across(n, n1, which):
    """Return the tangent t1 or t2 of a normal, with its rate; both are undefined only at n = (0, 0, -1)."""
    a = -1.0 / (1.0 + n[2])
    a1 = a * a * n1[2]
    b = n[0] * n[1] * a
    b1 = (n1[0] * n[1] + n[0] * n1[1]) * a + n[0] * n[1] * a1
    if which == 1:
        t = (1.0 + n[0] * n[0] * a, b, -n[0])
        return t, (2.0 * n[0] * n1[0] * a + n[0] * n[0] * a1, b1, -n1[0])
    t = (b, 1.0 + n[1] * n[1] * a, -n[1])
    return t, (b1, 2.0 * n[1] * n1[1] * a + n[1] * n[1] * a1, -n1[1])


@formula
def tangent(par, n, n1):
    """Return the tangent of a slip row, and its rate."""
    o = 0.0 * n[0]
    which = int(par[4].real)
    if which == 0:
        return (-n[1], n[0], o), (-n1[1], n1[0], o)
    up = int(par[5].real)
    if up < 0:
        n, n1, up = neg(n), neg(n1), -up
    if up == 1:
        t, t1 = across((n[1], n[2], n[0]), (n1[1], n1[2], n1[0]), which)
        return (t[2], t[0], t[1]), (t1[2], t1[0], t1[1])
    if up == 2:
        t, t1 = across((n[2], n[0], n[1]), (n1[2], n1[0], n1[1]), which)
        return (t[1], t[2], t[0]), (t1[1], t1[2], t1[0])
    return across(n, n1, which)


@formula
def slip(par, F, M, n, n1):
    """Return a slip row along the tangent given by par, at p_M - par[3] n.

    gdot = t.(u + w_M x rho - w_F x (d + rho)), rho = -r n, u = v_M - v_F.
    """
    t, t1 = tangent(par, n, n1)
    rho = scale(-par[3], n)
    rho1 = scale(-par[3], n1)
    u = sub(M[3], F[3])
    arm = add(sub(M[0], F[0]), rho)
    velocity = sub(add(u, cross(M[2], rho)), cross(F[2], arm))
    a = add(sub(M[5], F[5]), sub(cross(M[4], rho), cross(F[4], arm)))
    a = add(a, sub(cross(M[2], rho1), cross(F[2], add(u, rho1))))
    return 0.0 * t[0], t, cross(rho, t), neg(cross(arm, t)), dot(t, a) + dot(t1, velocity)


@formula
def gap_row(par, F, M, hint, data):
    """Value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias."""
    distance, n, _, curved = nearest(par, F, M)
    d = sub(M[0], F[0])
    w = F[2]
    a = sub(sub(M[5], F[5]), cross(F[4], d))
    a = add(sub(a, scale(2.0, cross(w, sub(M[3], F[3])))), cross(w, cross(w, d)))
    o = 0.0 * d[0]
    return distance - par[6], n, (o, o, o), cross(n, d), dot(n, a) + curved


@formula
def slip_row(par, F, M, hint, data):
    """No value, the wrench of slip, its bias. See `slip`."""
    _, n, n1, _ = nearest(par, F, M)
    return slip(par, F, M, n, n1)


ROWS = {KIND_GAP: gap_row, KIND_SLIP: slip_row}
