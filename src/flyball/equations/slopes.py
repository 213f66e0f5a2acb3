"""Slopes of forces: how each changes with what it acts along and with its rate, by differences.

What takes forces implicitly needs them roughly; laws, tables and functions of the user's are differentiated with the
rest. A force between frames has up to six directions: along the line through both origins where it acts along that,
otherwise shifts and turns of M along F's axes.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.vec import add, col, cross, dot, norm, scale, sub
from ..tables.system import LOAD, RATE, VALUE
from .dispatch import effort, inputs, kind_of, wrench
from .loads import law, way, wide
from .records import load

# columns of a sheet of slopes: stiffness, damping and the force itself along up to six directions; how many there are
# of a force between frames, which the caller says
STIFFNESS, DAMPING, ALONG, DIRECTIONS, SLOPE_WIDTH = 0, 6, 12, 18, 19
STEP = 1e-6  # of the mechanism's length, or of a radian; rates also of themselves


@formula
def slopes(S, W, t, out):
    """Stiffness and damping (out[k], see above) of every force at the state in W."""
    for k in range(S.forces.F.shape[0]):
        for i in range(DIRECTIONS):
            out[k, i] = 0.0
        if S.forces.family[k] == 1:
            along(S, W, t, k, out)
        else:
            between(S, W, t, k, out)


@formula
def along(S, W, t, k, out):
    """Of a force along a measured quantity."""
    m = S.forces.F[k]
    x, rate = W.sensed[VALUE, m], W.sensed[RATE, m]
    d = STEP * min(1.0, S.scales.length)
    e = d + STEP * abs(rate)
    pressed = W.sensed[LOAD, S.forces.load[k]] if S.forces.load[k] >= 0 else 0.0
    for j in range(5):
        dx = d if j == 1 else -d if j == 2 else 0.0
        dr = e if j == 3 else -e if j == 4 else 0.0
        laws = (law(S, W, k, 0, (t, x + dx, rate + dr)), 0.0, way(S, W, k, rate))
        s = effort(kind_of(S, k), wide(S.force_parameters, k), x + dx, rate + dr, laws, pressed)
        if j == 0:
            out[k, ALONG] = s
        out[k, STIFFNESS] -= s * dx / (2.0 * d * d)
        out[k, DAMPING] -= s * dr / (2.0 * e * e)


@formula
def between(S, W, t, k, out):
    """Of a force between frames, one of the two states of M after the other."""
    kind = kind_of(S, k)
    par = wide(S.force_parameters, k)
    F = load(W.FK, S.forces.F[k])
    p, R, w, v, alpha, a = load(W.FK, S.forces.M[k])
    d = STEP * min(1.0, S.scales.length)
    e = d + STEP * norm(sub(v, F[3]))
    n = int(out[k, DIRECTIONS])
    for j in range(4 * n):
        i = j // 4
        up = 1.0 if j % 2 == 0 else -1.0
        axis = direction(F, p, n, i)
        moved, moving = (up * d, 0.0) if j % 4 < 2 else (0.0, up * e)
        if i < 3:
            M = (add(p, scale(moved, axis)), R, w, add(v, scale(moving, axis)), alpha, a)
        else:
            M = (p, tilted(R, scale(moved, axis)), add(w, scale(moving, axis)), v, alpha, a)
        q, r = inputs(kind, par, F, M)
        x = (t, q, r)
        force, torque = wrench(kind, par, F, M, (law(S, W, k, 0, x), law(S, W, k, 1, x), law(S, W, k, 2, x)), (q, r))
        s = dot(force, axis) if i < 3 else dot(torque, axis)
        out[k, STIFFNESS + i] -= s * moved / (2.0 * d * d)
        out[k, DAMPING + i] -= s * moving / (2.0 * e * e)
        out[k, ALONG + i] += 0.25 * s


@formula
def direction(F, p, n, i):
    """Direction i of n that a force between frames changes along; p is where M is."""
    if n == 1:
        line = sub(p, F[0])
        size = norm(line)
        return scale(1.0 / size, line) if size > 0.0 else line
    return col(F[1], i % 3)


@formula
def tilted(R, a):
    """R turned by a small vector."""
    x, y, z = col(R, 0), col(R, 1), col(R, 2)
    x, y, z = add(x, cross(a, x)), add(y, cross(a, y)), add(z, cross(a, z))
    return (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])
