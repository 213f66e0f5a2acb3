"""A mechanism stepped from Python: the door of its part of the step, and a plain solver of contact problems."""

import numpy as np

from flyball.collision.tables import Movers, no_contacts
from flyball.engine.entry_point import engine
from flyball.numerics.complementarity.contact_problem import allocate_solver, empty_problem
from flyball.simulation.impulse_stepping.mechanism_step import mechanism_kernel
from flyball.simulation.impulse_stepping.setup import mechanism_tables
from flyball.simulation.impulse_stepping.stepping_tables import (
    TASK_APPLY_IMPULSES,
    TASK_BEGIN,
    TASK_FINAL_VELOCITIES,
    TASK_FINISH,
    TASK_FREE_VELOCITIES,
    TASK_MEAN_VELOCITIES,
    TASK_ROWS,
    TASK_START,
    Jobs,
)
from flyball.simulation.initial_state import find_initial_state


class Stepped:
    """A mechanism and what it touches; ``touching(M)`` says what: (mover 1, mover 2, point, normal, gap, friction)."""

    def __init__(self, model, h, coordinates="absolute", contacts=0, touching=None, stops=None):
        start = find_initial_state(model.snapshot(), 0.0, None, None, coordinates)
        self.names = [b.name for b in model.bodies]
        self.touching = touching
        self.compiled = start.assembly.compiled
        self.structure = self.compiled.structure
        A = mechanism_tables(start, self.names, 0, h, stops)
        A.count.accept_unsettled = 1  # the loop's shorter steps are not here
        lines = 2 * len(A.line)
        self.A = A._replace(job=Jobs.blank(2 * contacts + lines))
        n, nv = len(self.names), A.velocities.before.shape[0]
        self.M = Movers(np.zeros((n, 12)), np.zeros((n, 6)))
        self.C = no_contacts(contacts)
        self.P = empty_problem(contacts, 0, len(A.group) - 1, lines, (6 * contacts + lines) * nv)
        self.P.group[:] = A.group
        self.X, self.Y = allocate_solver(self.P)[0], allocate_solver(self.P)[0]
        A.door[0] = engine.address
        self.ask(TASK_START)

    def ask(self, task, X=None):
        status = mechanism_kernel(self.A, self.M, self.C, self.P, self.X if X is None else X, task)
        assert status == 0, status

    @property
    def q(self):
        return self.A.clock.y.current[: self.structure.nq]

    @property
    def v(self):
        return self.A.clock.y.current[self.structure.nq : self.structure.nq + self.structure.nv]

    @property
    def z(self):
        return self.A.clock.y.current[self.structure.nq + self.structure.nv :]

    def pose(self, name):
        """Mass centre, axes."""
        x = self.M.pose[self.names.index(name)]
        return x[:3], x[3:].reshape(3, 3)

    def twist(self, name):
        """Velocity of the mass centre, angular velocity."""
        x = self.M.twist[self.names.index(name)]
        return x[:3], x[3:]

    def step(self, times=1):
        for _ in range(times):
            P, X, Y, h = self.P, self.X, self.Y, self.A.real.step
            found = self.touching(self.M) if self.touching else []
            P.size[0] = n = len(found)
            for c, (a, b, point, normal, gap, mu) in enumerate(found):
                P.at[c], P.frame[c], P.mu[c], P.bias[c] = (a, b), frame(normal), mu, (max(gap, 0.0) / h, 0.0, 0.0)
                P.arm[c] = np.r_[
                    [np.subtract(point, self.M.pose[k, :3]) if k >= 0 else np.zeros(3) for k in (a, b)]
                ].ravel()
                self.C.x.point[c], self.C.x.normal[c], self.C.x.gap[c] = point, normal, gap
            X.p[:] = Y.p[:] = 0.0
            X.line[:] = 0.0
            self.ask(TASK_FREE_VELOCITIES)
            self.ask(TASK_ROWS)
            self.ask(TASK_BEGIN)
            self.solve(X, P.bias[:n], P.mu[:n])
            self.ask(TASK_APPLY_IMPULSES)
            self.ask(TASK_MEAN_VELOCITIES, Y)
            bias = np.array([(found[c][4] / h + self.seen(Y, c)[0], 0.0, 0.0) for c in range(n)]).reshape(n, 3)
            Y.wide[:] = 0.0
            self.solve(Y, bias, np.zeros(n))
            self.ask(TASK_FINISH, Y)
            self.ask(TASK_FINAL_VELOCITIES)

    def sides(self, c):
        """(sign, slice of velocities, J, Y) of each side of contact c that is in a group."""
        P, group = self.P, self.A.group
        out = []
        for side, sign in ((0, -1.0), (1, 1.0)):
            if P.at[c, side] <= -2:
                g, at = -2 - P.at[c, side], P.block[c, side]
                n = group[g + 1] - group[g]
                J, Y = (x[at : at + 3 * n].reshape(3, n) for x in (P.J, P.Y))
                out.append((sign, slice(group[g], group[g + 1]), J, Y))
        return out

    def seen(self, X, c):
        """Velocity at contact c."""
        return sum((sign * J @ X.wide[part] for sign, part, J, _ in self.sides(c)), np.zeros(3))

    def solve(self, X, bias, mu):
        """Gauss and Seidel, Coulomb's law, to the last digit."""
        n, nl = len(mu), self.P.size[3]
        lines = [self.line(k) for k in range(nl)]
        sides = [self.sides(c) for c in range(n)]
        N = [sum(J @ Y.T for _, _, J, Y in s) for s in sides]
        for _ in range(3000):
            worst = 0.0
            for c in range(n):
                old = X.p[c].copy()
                u = bias[c] + self.seen(X, c)
                X.p[c, 0] = max(0.0, old[0] - u[0] / N[c][0, 0])
                if mu[c] > 0.0:
                    t = X.p[c, 1:] - (u + N[c][:, 0] * (X.p[c, 0] - old[0]))[1:] / N[c].trace()
                    X.p[c, 1:] = t * min(1.0, mu[c] * X.p[c, 0] / max(np.hypot(*t), 1e-300))
                change = X.p[c] - old
                for sign, part, _, Y in sides[c]:
                    X.wide[part] += sign * change @ Y
                worst = max(worst, np.abs(N[c] @ change).max())
            for k, (part, J, Y) in enumerate(lines):
                add, soft, low, high = self.P.line_law[k]
                old, per = X.line[k], J @ Y + soft
                if per > 0.0:
                    new = old - (J @ X.wide[part] + add + soft * old) / per
                    X.line[k] = min(max(new, low), high)
                    X.wide[part] += (X.line[k] - old) * Y
                    worst = max(worst, abs(X.line[k] - old) * per)
            if worst < 1e-13:
                return

    def line(self, k):
        """Slice of velocities, J, Y of a line."""
        g, at = self.P.line_at[k]
        a, b = self.A.group[g], self.A.group[g + 1]
        return slice(a, b), self.P.J[at : at + b - a], self.P.Y[at : at + b - a]


def frame(normal):
    """Rows n, t1, t2."""
    n = np.asarray(normal, float)
    t = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    t /= np.linalg.norm(t)
    return np.r_[n, t, np.cross(n, t)]
