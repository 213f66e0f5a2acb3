"""A motion by the variational method: bodies in free flight, forces and constraints, through the engine's door.

In absolute coordinates: masses are constant, bodies are coupled by rows and forces alone.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..compiler.kernels import kernel
from ..math.cayley import bent
from ..math.scalar import sqrt, tan
from ..math.vec import add, cross, dot, load9, mv, scale, sub
from ..numerics.integrators.implicit.desk import VariationalDesk
from ..numerics.integrators.implicit.hermite import between
from ..numerics.integrators.implicit.variational import answer
from ..tables.system import System, Work
from .asking import OWN, S_, SHEET, W_, inspect, through
from .callbacks import Going, Own
from .implicit import compose, land
from .solve import inverse_mass
from .tasks import POSITION, RESIDUAL, SOLVE
from .tree import quaternion_at

MOST = 20  # iterations for a turn
ENOUGH = 1e-15  # part of a turn's momentum that its equation may miss
ROUNDED = 1e-12  # what it misses that does not fall
SMALL = 0.02  # turn [rad] below which functions of it are series


@formula
def weigh(v, p, A):
    """Momenta of velocities: of turns along the body's axes."""
    S = A[S_]
    for b in range(S.tree.parent.shape[0]):
        i, n = S.tree.v[b], S.tree.nv[b]
        m = S.bodies.mass[b]
        p[i], p[i + 1] = m * v[i], m * v[i + 1]
        if n == 3:
            p[i + 2] = S.bodies.inertia[b, 8] * v[i + 2]
        elif n == 6:
            p[i + 2] = m * v[i + 2]
            L = mv(load9(S.bodies.inertia, b, 0), (v[i + 3], v[i + 4], v[i + 5]))
            p[i + 3], p[i + 4], p[i + 5] = L


@formula
def speed(p, v, A):
    """Velocities of momenta."""
    S = A[S_]
    for b in range(S.tree.parent.shape[0]):
        inverse_mass(S, b, p, S.tree.v[b], v, S.tree.v[b])


@formula
def fly(p, h, d, p1, A):
    """Ways d of bodies, and momenta on arrival; see `turn`. Returns a status."""
    S = A[S_]
    speed(p, d, A)
    for i in range(d.shape[0]):
        d[i] *= h
        p1[i] = p[i]
    for b in range(S.tree.parent.shape[0]):
        if quaternion_at(S, b)[1] >= 0 and turn(load9(S.bodies.inertia, b, 0), p, h, d, p1, S.tree.v[b] + 3) != 0:
            return 1
    return 0


@formula
def turn(J, p, h, d, p1, i):
    """Solve h p = J x + x~ J x / 2 + c x~ x~ J x for the rotation vector x of a step.

    That is T(-x)^T J x, T being the inverse of the differential of the exponential map; on arrival x~ J x / 2 has the
    other sign: p1 = p - x~ J x / h. Cayley's step of the same turn goes to place i of d. Returns a status.
    """
    x = (d[i], d[i + 1], d[i + 2])
    w = (h * p[i], h * p[i + 1], h * p[i + 2])
    size = abs(w[0]) + abs(w[1]) + abs(w[2])
    last = 1e300
    for _ in range(MOST):
        L = mv(J, x)
        c, by = curved(sqrt(dot(x, x)))
        twist = cross(x, L)
        r = sub(sub(w, L), add(scale(0.5, twist), scale(c, cross(x, twist))))
        off = abs(r[0]) + abs(r[1]) + abs(r[2])
        if off <= ENOUGH * size or (off >= last and off <= ROUNDED * size):
            arrived(p, scale(by, x), d, p1, i)
            return 0
        if not off < 1e300:
            return 1
        columns = (
            column((J[0], J[3], J[6]), x, L, c, (1.0, 0.0, 0.0)),
            column((J[1], J[4], J[7]), x, L, c, (0.0, 1.0, 0.0)),
            column((J[2], J[5], J[8]), x, L, c, (0.0, 0.0, 1.0)),
        )
        x = add(x, solve3(columns, r))
        last = off
    return 1


@formula
def arrived(p, x, d, p1, i):
    """Cayley's step x to place i of d, and p in axes that are turned by it: that is p - x~ J x / h, but keeps |p|.

    Written as what it changes: what is equal in all steps must not round the same way ten million times.
    """
    more = bent(x, (p[i], p[i + 1], p[i + 2]))
    for k in range(3):
        d[i + k] = x[k]
        p1[i + k] = p[i + k] + more[k]


@formula
def curved(angle):
    """Of a turn: (1 - y cot y) / (4 y^2) and tan(y) / y, y being half the angle."""
    y = 0.5 * angle
    if angle < SMALL:
        s = angle * angle
        return 1.0 / 12.0 + s * (1.0 / 720.0 + s * (1.0 / 30240.0 + s / 1209600.0)), 1.0 + s / 12.0 + s * s / 120.0
    x = tan(y)
    return (1.0 - y / x) / (angle * angle), x / y


@formula
def column(Ju, x, L, c, u):
    """Derivative of J x + x~ J x / 2 + c x~ x~ J x along u, but for that of c; Ju = J u, L = J x."""
    bend = add(cross(u, L), cross(x, Ju))
    return add(add(Ju, scale(0.5, bend)), scale(c, add(cross(u, cross(x, L)), cross(x, bend))))


@formula
def solve3(columns, r):
    """Solve for three unknowns, by the columns of the matrix."""
    a, b, c = columns
    bc = cross(b, c)
    by = 1.0 / dot(a, bc)
    return (by * dot(r, bc), by * dot(a, cross(r, c)), by * dot(a, cross(b, r)))


@formula
def push(t, y, lam, f, A):
    """Generalised forces at a state, but for those of inertia and of rows; friction presses with ``lam``."""
    S, W, own, rows = A[S_], A[W_], A[OWN], A[SHEET].rows
    nv, nq = f.shape[0], S.sizes.coordinates
    own.real.t = t
    for i in range(y.shape[0]):
        own.y[0, i] = y[i]
    for i in range(nv):
        rows[1, i] = 0.0
    for r in range(lam.shape[0]):
        rows[2, r] = lam[r]
    through(A, RESIDUAL)
    for i in range(nv):
        f[i] = -rows[0, i]
    for b in range(S.tree.parent.shape[0]):
        i = quaternion_at(S, b)[1]
        if i >= 0:
            w = (y[nq + i], y[nq + i + 1], y[nq + i + 2])
            g = cross(w, mv(load9(S.bodies.inertia, b, 0), w))
            for k in range(3):
                f[i + k] += g[k]
    for r in range(lam.shape[0]):
        for e in range(S.row_start[r], S.row_start[r + 1]):
            f[S.column[e]] -= W.G[e] * lam[r]


@formula
def place(t, y, g, A):
    """What positions miss of the constraints, into g, and the largest of it; turns in y are brought up to date."""
    W, own = A[W_], A[OWN]
    own.real.t = t
    for i in range(y.shape[0]):
        own.y[0, i] = y[i]
    through(A, POSITION)
    for i in range(y.shape[0]):
        y[i] = own.y[0, i]
    worst = 0.0
    for r in range(g.shape[0]):
        g[r] = W.rows.value[r]
        x = abs(g[r])
        if not x <= worst:
            worst = x
    return worst


@formula
def relax(g, lam, A):
    """Multipliers that move positions by M^-1 G^T lam to where g is none."""
    S, rows = A[S_], A[SHEET].rows
    for r in range(g.shape[0]):
        rows[1, r] = -g[r]
    for b in range(S.tree.parent.shape[0]):
        for k in range(S.tree.nv[b]):
            rows[0, S.tree.v[b] + k] = 0.0
    through(A, SOLVE)
    for r in range(g.shape[0]):
        lam[r] = rows[3, r]


@formula
def pull(G, lam, by, p, A):
    """Add by G^T lam to momenta."""
    S = A[S_]
    for r in range(lam.shape[0]):
        for e in range(S.row_start[r], S.row_start[r + 1]):
            p[S.column[e]] += by * G[e] * lam[r]


@formula
def rows_to(G, A):
    """Keep the rows as last evaluated."""
    for e in range(G.shape[0]):
        G[e] = A[W_].G[e]


@formula
def by_variation(S, W, M, own, going, task):
    """The variational method; places in A are those of `implicit`."""
    A = (
        own.doors[0], S, W, own.R, own.clock, own.sheet, going.group, 0, 0, 0, 0, 0, 0, M.turns, going, between,
    )  # fmt: skip
    callbacks = (
        compose, land, inspect, weigh, speed, fly, push, place, relax, pull, rows_to,
    )  # fmt: skip
    return answer(callbacks, A, M, going.clock, task)


@kernel
def variational_steps(S: System, W: Work, M: VariationalDesk, own: Own, going: Going, task: int) -> int:
    """`by_variation` behind an address."""
    return by_variation(S, W, M, own, going, task)
