"""How long stiff springs are at the end of a step: as their forces were told, curved ways or not.

What turns about a stiff spring's end leaves the line along which it was taken implicitly, by w^2 h^2 / 8 of its length:
far more than a stiff spring ever gives, and a multiple of all energy. The way is put right along what the springs
themselves resist.
"""

from __future__ import annotations

from ..compiler.formulas import call, formula
from ..equations.records import load
from ..equations.tasks import POSITION
from ..equations.tree import retract
from ..math.rotation import rotation_vector
from ..math.vec import col, dot, mm, norm, sub, transpose
from ..tables.system import BIAS, VALUE
from .implicit import dot_rows, solve_springs
from .joined import BEND, OF_DIRECTION, OF_MANY, REACH, SHARE, SOLVED, SPRING_OF, WAY

PASSES = 3
STIFF = 1e-3  # share of the end of the step from which on a spring is put right
NEAR = 1e-12  # change of a spring's length that is none, of its own or a radian


@formula
def gauge(S, W, k, n, i):
    """How far force k is along its direction i of n, at the kinematics in W."""
    if S.forces.family[k] == 1:
        return W.sensed[VALUE, S.forces.F[k]]
    F, M = load(W.FK, S.forces.F[k]), load(W.FK, S.forces.M[k])
    line = sub(M[0], F[0])
    if n == 1:
        return norm(line)
    if i < 3:
        return dot(col(F[1], i), line)
    return rotation_vector(mm(transpose(F[1]), M[1]))[i - 3]


@formula
def read(A, i):
    """`gauge` of spring i of the step."""
    x = A.spring_x[i]
    return gauge(A.S, A.W, int(x[SPRING_OF]), int(x[OF_MANY]), int(x[OF_DIRECTION]))


@formula
def note_bends(A):
    """Keep the bias accelerations of what springs act along."""
    for i in range(A.count.springs):
        x = A.spring_x[i]
        k = int(x[SPRING_OF])
        x[BEND] = 0.0
        if A.S.forces.family[k] == 1:
            x[BEND] = A.W.sensed[BIAS, A.S.forces.F[k]]
        elif x[OF_MANY] < 2.0:
            x[BEND] = bend_of_line(load(A.W.FK, A.S.forces.F[k]), load(A.W.FK, A.S.forces.M[k]))


@formula
def bend_of_line(F, M):
    """Bias acceleration of the distance of two origins."""
    d, u = sub(M[0], F[0]), sub(M[3], F[3])
    far = norm(d)
    if not far > 0.0:
        return 0.0
    rate = dot(d, u) / far
    return (dot(u, u) - rate * rate + dot(d, sub(M[5], F[5]))) / far


@formula
def note_lengths(A):
    """Keep where the springs are at half the step."""
    for i in range(A.count.springs):
        A.spring_x[i, REACH] = read(A, i)


@formula
def put_right(A):
    """Move the positions in the clock, which went ``A.wide[WAY]`` from half the step, to where springs were told."""
    stiff = False
    for i in range(A.count.springs):
        stiff = stiff or A.spring_x[i, SHARE] > STIFF
    if not stiff:
        return
    h = A.real.step
    q = A.clock.y[0, : A.S.sizes.coordinates]
    step = A.mixing[0]
    for _ in range(PASSES):
        call(A.door[0], A.S, A.W, A.R, A.clock, A.sheet, POSITION)
        worst = 0.0
        for i in range(A.count.springs):
            x = A.spring_x[i]
            told = x[REACH] + dot_rows(A.spring_J[i], A.wide[WAY]) + 0.125 * h * h * x[BEND]
            x[SOLVED] = read(A, i) - told
            worst = max(worst, abs(x[SOLVED]) / (1.0 + abs(told)))
        if not NEAR < worst < 1.0:
            return
        solve_springs(A)
        for d in range(step.shape[0]):
            step[d] = 0.0
        for i in range(A.count.springs):
            for d in range(step.shape[0]):
                step[d] -= A.spring_x[i, SOLVED] * A.spring_Y[i, d]
        retract(A.S, q, step)
