"""Cubes of 1 m on each other, stepped by two cone solves: velocities, then positions. A stepper of the tests' own."""

from __future__ import annotations

import numpy as np

from flyball.numerics.complementarity.contact_problem import allocate_solver, empty_problem
from flyball.numerics.complementarity.solver_choice import prepare_solver

H, G = 5e-3, 9.81
CORNERS = np.array([(a, b, -0.5) for a in (-0.5, 0.5) for b in (-0.5, 0.5)])


def matrix(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Stack:
    """Dropped from gaps of 1 mm, shifted by 3 cm and yawed by 3.4 degrees, alternately."""

    def __init__(self, masses, solver="newton", most=100, mu=0.5):
        n = len(masses)
        self.m, self.n, self.most = np.array(masses, float), n, most
        self.x = np.zeros((n, 3))
        self.x[:, 0] = 0.03 * (-1.0) ** np.arange(n)
        self.x[:, 2] = 0.5 + np.arange(n) + 1e-3 * (1 + np.arange(n))
        a = 0.03 * (np.arange(n) % 2)
        self.q = np.stack([np.cos(a), 0 * a, 0 * a, np.sin(a)], 1)
        self.v, self.p = np.zeros((n, 6)), np.zeros((4 * n, 3))
        self.P = P = empty_problem(4 * n, n)
        self.X, self.W, self.O, _ = allocate_solver(P)
        P.node[:, 0], P.node[:, 1:4], P.node[:, 7] = 1 / self.m, (6 / self.m)[:, None], 1
        self.mu, self.start = mu, self.x.copy()
        self.door = prepare_solver(solver, P, self.X, self.W, self.O)

    def find(self):
        """Corners of each box on the top of the one below; their gaps."""
        gap, P = np.zeros(4 * self.n), self.P
        below, place = np.eye(3), np.zeros(3)
        for i in range(self.n):
            own = matrix(self.q[i])
            n = below[:, 2]
            arms = CORNERS @ own.T
            points = self.x[i] + arms
            rows = slice(4 * i, 4 * i + 4)
            gap[rows] = (points - place - (0.5 * n if i else 0)) @ n
            P.at[rows], P.frame[rows] = (i - 1, i), np.r_[n, below[:, 0], below[:, 1]]
            P.arm[rows, :3], P.arm[rows, 3:] = points - place, arms
            below, place = own, self.x[i]
        return gap

    def solve(self, mu, bias, v, p):
        P, X, O = self.P, self.X, self.O
        P.mu[:], P.bias[:, 0], X.v[:, :6], X.p[:] = mu, bias, v, p
        O.count[:], O.real[:] = 0, 0
        O.count.most, O.count.island, O.count.coulomb, O.real.enough = self.most, -1, 1, 1e-9
        self.door.kernel(P, X, self.W, O, self.door.F, 0)
        return X.v[:, :6].copy(), X.p.copy(), O.count.ended

    def step(self):
        gap, v = self.find(), self.v.copy()
        v[:, 2] -= G * H
        new, self.p, ended = self.solve(self.mu, np.maximum(gap, 0) / H, v, self.p)
        move, _, ended_too = self.solve(0.0, gap / H, 0.5 * (self.v + new), np.zeros_like(self.p))
        self.v = new
        self.x += H * move[:, :3]
        for i, w in enumerate(move[:, 3:]):
            a = np.linalg.norm(w) * H
            if a > 0:
                u, q = w / np.linalg.norm(w) * np.sin(a / 2), self.q[i]
                self.q[i] = np.r_[
                    np.cos(a / 2) * q[0] - u @ q[1:], np.cos(a / 2) * q[1:] + q[0] * u + np.cross(u, q[1:])
                ]
        return max(ended, ended_too)

    def kinetic_of(self, v):
        return 0.5 * (self.m * (v[:, :3] ** 2).sum(1) + self.m / 6 * (v[:, 3:] ** 2).sum(1)).sum()

    @property
    def kinetic(self):
        return self.kinetic_of(self.v)
