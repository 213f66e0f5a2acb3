"""Rooms as large as a problem: what solvers work in, made outside of the compiled code."""

from __future__ import annotations

import numpy as np

from .problem import ChoiceCounts, ChoiceReals, Choices, Factor, Problem, Scratch, State

PACKED = 32  # numbers of `Scratch.pack` for each contact


def unfilled(contacts: int, nodes: int = 0, groups: int = 0, lines: int = 0, numbers: int = 0, turning: bool = False):  # type: ignore[no-untyped-def]
    """A problem of zeros, one island, with all its sides on what stands still.

    Parameters
    ----------
    contacts, nodes, groups, lines : int
        How many there are; capacities are the same.
    numbers : int
        Numbers in J and in Y.
    turning : bool
        Whether there is rolling and spinning friction.

    Returns
    -------
    Problem
    """
    nc, nn, whole = contacts, nodes, np.int64

    def ends(n: int) -> np.ndarray:
        return np.array([0, n], whole)

    return Problem(
        size=np.array([nc, nn, groups, lines], whole),
        at=np.full((nc, 2), -1, whole),
        frame=np.tile(np.eye(3).ravel(), (nc, 1)),
        arm=np.zeros((nc, 6)),
        bias=np.zeros((nc, 3)),
        mu=np.zeros(nc),
        soft=np.zeros(nc),
        least=np.zeros(0),
        turn=np.zeros((nc if turning else 0, 2)),
        node=np.zeros((nn, 8)),
        group=np.zeros(groups + 1, whole),
        block=np.full((nc, 2), -1, whole),
        J=np.zeros(numbers),
        Y=np.zeros(numbers),
        line_at=np.zeros((lines, 2), whole),
        line_x=np.zeros((lines, 4)),
        island=ends(nc),
        member=np.arange(nn),
        member_p=ends(nn),
        line_p=ends(lines),
    )


def aligned(rows: int, columns: int) -> np.ndarray:
    """Zeros that begin where a line of the processor's cache does: a row of eight numbers is then in one line."""
    whole = np.zeros(rows * columns + 8)
    begin = -(whole.ctypes.data // 8) % 8
    return whole[begin : begin + rows * columns].reshape(rows, columns)


def rooms(P: Problem, history: int = 0) -> tuple[State, Scratch, Choices, Factor]:
    """State, scratch, choices and an empty factor for a problem.

    Parameters
    ----------
    P : Problem
    history : int
        Rows of the history of residuals; none is kept if 0.

    Returns
    -------
    State, Scratch, Choices, Factor
        The state is zero; the choices say: all islands, 100 iterations at most, 1e-6 m/s is enough, the convex form.
    """
    nc, nn, nl, nw = len(P.mu), len(P.node), len(P.line_at), int(P.group[-1])
    X = State(np.zeros((nc, 3)), np.zeros((len(P.turn), 3)), np.zeros(nl), np.zeros((nn, 8)), np.zeros(nw))
    W = Scratch(
        rows=np.zeros((17, nc, 3)),
        nodes=np.zeros((6, nn, 8)),
        wide=np.zeros((6, nw)),
        lines=np.zeros((9, nl)),
        own=aligned(nn + 1, 8),
        inner=aligned(nn + 1, 8),
        free=aligned(nn + 1, 8),
        free_wide=np.zeros(nw),
        pack=aligned(nc, PACKED).ravel(),
        sides=np.zeros((nc, 3), np.int64),
    )
    O = Choices(ChoiceCounts.blank(), ChoiceReals.blank(), np.zeros((history, 4)))
    O.count[:3] = 100, -1, history > 0
    O.real[0] = 1e-6
    return X, W, O, Factor(np.zeros(0), np.zeros(0, np.int64))
