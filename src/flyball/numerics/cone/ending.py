"""The end of a solve: residuals, rows of the history, impulses that make no energy, velocities handed back."""

from __future__ import annotations

from ...compiler.formulas import formula
from .problem import (
    BROKEN,
    CUT,
    H_FORCE,
    H_ITERATION,
    H_OBJECTIVE,
    H_VELOCITY,
)
from .residual import contacts_of, lines_of, nodes_of


@formula
def finish(P, X, W, O, left, used, last):
    """Write down how far impulses are from a solution; if it is the last time, make them safe and hand back.

    Impulses are those in X, velocities with them in W.own and X.wide, those without in X.v and W.free_wide; ``left`` is
    what `residuals` says.
    """
    velocity, force, linear, square = left
    row = O.count.written
    if not last and row < O.history.shape[0]:
        O.history[row, H_ITERATION], O.history[row, H_VELOCITY] = used, velocity
        O.history[row, H_FORCE], O.history[row, H_OBJECTIVE] = force, 0.5 * square + linear
        O.count.written = row + 1
    if not last:
        return
    O.real.residual, O.real.force_residual = velocity, force
    part = 1.0
    if not (velocity == velocity and square == square):
        part, O.count.ended = 0.0, BROKEN
    elif 0.5 * square + linear > 0.0 and O.count.ended == CUT and P.least.shape[0] == 0:
        part = 0.0 if linear >= 0.0 else -linear / square  # the best there is along these impulses
    hand_back(P, X, W, O, part)


@formula
def between(part, a, b):
    """A if the part is 0, b if it is 1, whatever the other is."""
    if part == 1.0:
        return b
    return a + part * (b - a) if part > 0.0 else a


@formula
def hand_back(P, X, W, O, part):
    """Velocities with a part of the impulses."""
    begin, end = nodes_of(P, O)
    for e in range(begin, end):
        i = P.member[e]
        for s in range(6):
            X.v[i, s] = between(part, X.v[i, s], W.own[i, s])
    if part == 1.0:
        return
    for s in range(X.wide.shape[0]):
        X.wide[s] = between(part, W.free_wide[s], X.wide[s])
    first, last = contacts_of(P, O)
    for c in range(first, last):
        for s in range(3):
            X.p[c, s] = between(part, 0.0, X.p[c, s])
        if P.turn.shape[0] > 0:
            for s in range(3):
                X.torque[c, s] = between(part, 0.0, X.torque[c, s])
    first, last = lines_of(P, O)
    for e in range(first, last):
        X.line[e] = between(part, 0.0, X.line[e])
