"""Cone problems to try solvers on, and the same ones as dense matrices, put together by definition."""

from __future__ import annotations

import numpy as np

from flyball.numerics.complementarity.contact_operator import find_columns
from flyball.numerics.complementarity.contact_problem import allocate_solver, empty_problem

KINDS = {
    "nodes": {},
    "balls": {"balls": True},
    "smooth": {"mu": 0.0},
    "smooth balls": {"mu": 0.0, "balls": True},
    "soft": {"soft": 0.2},
    "groups and lines": {"ng": 2, "nl": 4},
    "rolling friction": {"nc": 6, "nn": 4, "turning": True},
    "rolling friction in groups": {"nc": 4, "ng": 2, "nl": 3, "turning": True},
}


def positive(rng, n):
    a = rng.standard_normal((n, n))
    return a @ a.T + 0.3 * np.eye(n)


class Builder:
    """Sides, frames and blocks of a random problem."""

    def __init__(self, seed, nc, nn, ng, nl, turning):
        self.rng = np.random.default_rng(seed)
        self.sizes = self.rng.integers(4, 9, ng)
        self.inertia = [positive(self.rng, n) for n in self.sizes]
        self.rows, self.used = 6 if turning else 3, 0
        self.P = empty_problem(nc, nn, ng, nl, (nc * 2 * self.rows + nl) * int(self.sizes.max(initial=0)), turning)
        self.P.group[1:] = np.cumsum(self.sizes)

    def block(self, g, rows):
        J = self.rng.standard_normal((rows, self.sizes[g]))
        at, end = self.used, self.used + J.size
        self.P.J[at:end], self.P.Y[at:end] = J.ravel(), (J @ np.linalg.inv(self.inertia[g])).ravel()
        find_columns(self.P, at, self.sizes[g], rows)
        self.used = end
        return at

    def contact(self, c, balls):
        rng, P = self.rng, self.P
        q = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        q *= np.sign(np.linalg.det(q))
        P.frame[c] = q.ravel()
        a, b = rng.integers(-1 - P.size[2], P.size[1], 2)
        while a == b:
            a, b = rng.integers(-1 - P.size[2], P.size[1], 2)
        P.at[c] = a, b
        for side, k in enumerate((a, b)):
            if k >= 0:
                arm = q[0] * rng.uniform(0.1, 1.0) * (1 - 2 * side) if balls else 0.5 * rng.standard_normal(3)
                P.arm[c, 3 * side : 3 * side + 3] = arm
            elif k < -1:
                P.block[c, side] = self.block(-2 - k, self.rows)


def random_problem(seed, nc=12, nn=6, ng=0, nl=0, soft=0.0, balls=False, turning=False, mu=None):
    """A random problem with all that solvers take: (P, X, W, O, F)."""
    made = Builder(seed, nc, nn, ng, nl, turning)
    P, rng = made.P, made.rng
    P.node[:, 0] = rng.uniform(0.3, 3, nn)
    for i in range(nn):
        B = rng.uniform(1, 4) * np.eye(3) if balls else positive(rng, 3)
        P.node[i, 1:] = B[0, 0], B[1, 1], B[2, 2], B[0, 1], B[0, 2], B[1, 2], balls
    for c in range(nc):
        made.contact(c, balls)
    P.mu[:] = rng.uniform(0.1, 0.9, nc) if mu is None else mu
    P.soft[:] = soft * rng.uniform(0, 1, nc)
    P.bias[:, 0] = rng.uniform(-0.1, 0.3, nc)
    if not balls:
        P.bias[:, 1:] = 0.1 * rng.standard_normal((nc, 2))
    P.turn[:] = rng.uniform(0.05, 0.3, P.turn.shape)
    for k in range(nl):
        P.line_at[k] = (g := rng.integers(ng)), made.block(g, 1)
        P.line_law[k] = (
            0.2 * rng.standard_normal(),
            rng.uniform(0, 0.1),
            *[(0, np.inf), (-0.2, 0.2), (-np.inf, np.inf)][k % 3],
        )
    X, W, O, F = allocate_solver(P)
    X.v[:, :6], X.wide[:] = rng.standard_normal((nn, 6)), rng.standard_normal(len(X.wide))
    return P, X, W, O, F


def dense(P, X):
    """(D, D K^-1, N, b): rows are the contacts' impulses (and torques), then the lines'."""
    nc, nn, _, nl = P.size
    r, n = 6 if len(P.turn) else 3, 6 * nn + P.group[-1]
    D, DK = np.zeros((nc * r + nl, n)), np.zeros((nc * r + nl, n))

    def wide(g):
        return slice(6 * nn + P.group[g], 6 * nn + P.group[g + 1]), P.group[g + 1] - P.group[g]

    for c in range(nc):
        q, rows = P.frame[c].reshape(3, 3), slice(c * r, c * r + r)
        for side, k in enumerate(P.at[c]):
            sign = 2 * side - 1
            if k >= 0:
                xx, yy, zz, xy, xz, yz = P.node[k, 1:7]
                B = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
                R = np.hstack([q, np.cross(P.arm[c, 3 * side : 3 * side + 3], q)])
                R = np.vstack([R, np.hstack([0 * q, q])])[:r]
                D[rows, 6 * k : 6 * k + 6] += sign * R
                DK[rows, 6 * k : 6 * k + 6] += sign * np.hstack([R[:, :3] * P.node[k, 0], R[:, 3:] @ B])
            elif k < -1 and P.block[c, side] >= 0:
                at, m = wide(-2 - k)
                e = P.block[c, side]
                D[rows, at] += sign * P.J[e : e + r * m].reshape(r, m)
                DK[rows, at] += sign * P.Y[e : e + r * m].reshape(r, m)
    for k in range(nl):
        at, m = wide(P.line_at[k, 0])
        e = P.line_at[k, 1]
        D[nc * r + k, at], DK[nc * r + k, at] = P.J[e : e + m], P.Y[e : e + m]
    N, b = D @ DK.T, D @ np.concatenate([X.v[:, :6].ravel(), X.wide])
    for c in range(nc):
        N[c * r, c * r] += P.soft[c]
        b[c * r : c * r + 3] += P.bias[c]
    for k in range(nl):
        N[nc * r + k, nc * r + k] += P.line_law[k, 1]
        b[nc * r + k] += P.line_law[k, 0]
    return D, DK, N, b


def impulses(P, X):
    """All impulses in the order of `dense`."""
    return np.concatenate([np.hstack([X.p, X.torque] if len(P.turn) else [X.p]).ravel(), X.line])


def cone_lack(P, p, u, coulomb=False):
    """How far each contact and line is from the conditions: p in its cone, u in the dual cone, u . p = 0."""
    r, out = 6 if len(P.turn) else 3, []
    for c in range(P.size[0]):
        q, w = p[c * r : c * r + r], u[c * r : c * r + r]
        bounds = [(P.mu[c], slice(1, 3))]
        if r == 6:
            bounds += [(P.turn[c, 0], slice(4, 6)), (P.turn[c, 1], slice(3, 4))]
        slip = sum(m * np.linalg.norm(w[s]) for m, s in bounds)
        out += [max(0, np.linalg.norm(q[s]) - m * q[0]) for m, s in bounds]
        opening = w[0] + (slip if coulomb else 0)  # De Saxce's correction makes Coulomb's law this condition
        out += [max(0, slip - opening), abs(q[0] * opening + q[1:] @ w[1:])]
    for k in range(P.size[3]):
        low, high = P.line_law[k, 2:]
        s, w = p[P.size[0] * r + k], u[P.size[0] * r + k]
        out.append(abs(min(max(s - w, low), high) - s))
    return max(out)
