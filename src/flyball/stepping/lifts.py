"""Overlap that putting the mechanism onto its joints makes at the end of the step, and what is aimed at instead.

Joints are closed by what moves least, measured by the masses: light links move by what is of second order in the way,
and with them their contacts. The lifts are found again with the gaps that this leaves, until none is below zero.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..contact.tables import FOUND, MOVER, SHAPE_1, SHAPE_2
from ..math.vec import add, cross, dot, load3, load9, mm, sub, transpose
from ..numerics.cone.operator import seen
from .tables import FLAT, STEP

PASSES = 16
ENOUGH = 1e3  # times the overlap that is none: what a pass may leave


@formula
def shifted(A, M, mover, axis, arm):
    """How far a point of a mover was moved along an axis by putting onto joints."""
    k = mover - A.count.first
    if k < 0:
        return 0.0
    turn = mm(load9(M.pose, mover, 3), transpose(load9(A.pose, k, 3)))
    spin = (0.5 * (turn[7] - turn[5]), 0.5 * (turn[2] - turn[6]), 0.5 * (turn[3] - turn[1]))
    way = add(sub(load3(M.pose, mover, 0), load3(A.pose, k, 0)), cross(spin, arm))
    return dot(axis, way)


@formula
def change_of_gap(G, A, M, C, P, c):
    """What putting onto joints did to the gap of contact c."""
    n = load3(P.frame, c, 0)
    a, b = G.shape_i[C.at[c, SHAPE_1], MOVER], G.shape_i[C.at[c, SHAPE_2], MOVER]
    return shifted(A, M, b, n, load3(P.arm, c, 3)) - shifted(A, M, a, n, load3(P.arm, c, 0))


@formula
def sunk(G, A, M, C, P, Q, Y, aim, pace):
    """Whether contacts overlap now; then ``Q`` has the gaps to be lifted from, which are ``aim`` and the change.

    ``aim`` has in column 0 the velocity that leaves no gap, by which ``Y`` was found.
    """
    if not A.real.kinetic >= 0.0:
        return False
    h, worst = pace.real[STEP], 0.0
    for c in range(C.count[FOUND]):
        change = change_of_gap(G, A, M, C, P, c)
        if change != 0.0:
            worst = min(worst, h * (aim[c, 0] + seen(P, Y.v, Y.wide, c)[0]) + change)
    if worst >= -ENOUGH * pace.real[FLAT]:
        return False
    for c in range(C.count[FOUND]):
        Q.bias[c, 0] = aim[c, 0] + change_of_gap(G, A, M, C, P, c) / h
    Q.size[0] = C.count[FOUND]
    return True
