"""What joints hold together, made ready for steps by impulses: which bodies these are, their groups, their tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ....equations.projection import STEPS
from ....equations.slopes import DIRECTIONS, SLOPE_WIDTH
from ....equations.tasks import Sheet
from ....model.force import CoordinateForce, TwoPointForce
from ....numerics.integrators.clock import STATES, Clock, ClockCounts, ClockReals
from ....numerics.integrators.tableaux import tableau
from ....stepping.joined import (
    FRICTION,
    LEAST,
    MOST_AT,
    REBOUND,
    ROPE,
    ROPE_C,
    ROPE_K,
    SHORTEST,
    STOP,
    Joined,
    JoinedCounts,
    JoinedReals,
)
from ....stepping.smooth import MIXED, MIXING
from ....tables.specs import Structure
from ....tables.system import BETWEEN, System
from ..start import Start

Stop = tuple[float, float, float]


def tables(
    start: Start, bodies: Sequence[str], first: int, h: float, stops: Mapping[str, Stop] | None = None
) -> Joined:
    """The mechanism's tables for steps of h seconds, at its start.

    Parameters
    ----------
    start : Start
        Of the mechanism alone.
    bodies : sequence of str
        Those that are movers, in the order of the movers from number ``first`` on.
    first : int
    h : float [s]
    stops : mapping, optional
        Forces without any effect that stand for a stop of the coordinate that they act along: name to (lower end, upper
        end, restitution).
    """
    c = start.assembly.compiled
    s, S = c.structure, c.values.system
    of, group = groups(S, s.nv)
    rows = [s.place[name] for name in bodies]
    y = np.zeros((STATES, len(start.y)))
    y[0] = start.y
    width = max(len(start.y) + 1, s.nv, len(S.rows.law), 1)
    clock = Clock(
        ClockReals.blank(), ClockCounts.blank(), np.zeros(0), y, np.zeros((1, len(start.y))), np.zeros(0, np.int64)
    )
    slopes = np.zeros((len(s.forces), SLOPE_WIDTH))
    slopes[:, DIRECTIONS] = [directions(f) for f in s.forces]
    springs = int(slopes[:, DIRECTIONS].sum())
    c.work.options.stabilization, c.work.options.deferred = STEPS, 0.0
    S = S._replace(force_parameters=S.force_parameters.copy())
    line, line_x = lines(s, S, stops or {})
    A = Joined(
        S, c.work, tableau("rk45"), clock, Sheet(np.zeros((4, width))), Sheet(slopes), np.zeros(1, np.int64),
        real=JoinedReals.blank(), count=JoinedCounts.blank(),
        mover=np.array([(b, of[b]) for b in rows], np.int64).reshape(-1, 2),
        group=group, wide=np.zeros((8, s.nv)), lam=np.zeros((3, len(S.rows.law))),
        spring_x=np.zeros((springs, 10)), spring_J=np.zeros((springs, s.nv)), spring_Y=np.zeros((springs, s.nv)),
        stiff=np.zeros((springs, springs)), mixing=np.zeros((MIXING, s.nv)), weight=np.zeros((MIXED + 1, MIXED + 1)),
        line=line, line_x=line_x, active=np.zeros((2 * len(line), 3), np.int64),
        job=np.zeros((0, 3), np.int64), queue=np.zeros(len(group) - 1, np.int64),
        pose=np.zeros((len(rows), 12)),
    )  # fmt: skip
    A.count.first = first
    A.real.time, A.real.step = start.assembly.t, h
    return A


def lines(s: Structure, S: System, stops: Mapping[str, Stop]) -> tuple[np.ndarray, np.ndarray]:
    """What is a single row of the step: stops, ropes, friction in joints. As forces the tables lose them."""
    line, line_x = [], []
    for k, e in enumerate(s.forces):
        x = np.zeros(8)
        if e.name in stops:
            kind = STOP
            x[[LEAST, MOST_AT, REBOUND]] = stops[e.name]
        elif e.single == "rope":
            kind = ROPE
            x[[ROPE_K, ROPE_C, SHORTEST]] = S.force_parameters[k, :3]
            S.force_parameters[k, :2] = 0.0
        elif e.single == "friction":
            kind = FRICTION
            x[LEAST] = S.force_parameters[k, 0]
            S.force_parameters[k, 0] = 0.0
        else:
            continue
        line.append((kind, S.forces.F[k], k))
        line_x.append(x)
    return np.array(line, np.int64).reshape(-1, 3), np.array(line_x).reshape(-1, 8)


def directions(force) -> int:
    """How many directions a force changes along: see `equations.slopes`."""
    return 1 if isinstance(force, (CoordinateForce, TwoPointForce)) else 6


def groups(S: System, nv: int) -> tuple[np.ndarray, np.ndarray]:
    """Which group each row of the body table is in (-1: it cannot move), and where the velocities of each begin.

    Groups are what rows, measured quantities and forces connect; all is one group where velocities of one are no
    neighbours.
    """
    part = np.arange(nv)

    def root(d: int) -> int:
        while part[d] != d:
            part[d] = d = part[part[d]]
        return d

    def join(several) -> None:
        several = list(several)
        for d in several[1:]:
            a, b = sorted((root(several[0]), root(d)))
            part[b] = a

    movers = [_moving(S, b) for b in range(len(S.tree.parent))]
    for own in movers:
        join(own)
    for r in range(len(S.row_start) - 1):
        join(S.column[S.row_start[r] : S.row_start[r + 1]])
    for k in np.flatnonzero(S.forces.family == BETWEEN):
        ends = [S.frame_body[S.forces.F[k]], S.frame_body[S.forces.M[k]]]
        join(d for b in ends if b >= 0 for d in movers[b])
    of = np.array([root(d) for d in range(nv)], np.int64)
    first = np.flatnonzero(np.r_[True, of[1:] != of[:-1]]) if nv else np.zeros(0, np.int64)
    if len(first) != len(np.unique(of)):
        of, first = np.zeros(nv, np.int64), np.zeros(1, np.int64)
    number = np.searchsorted(first, np.arange(nv), side="right") - 1
    return np.array([number[m[0]] if m else -1 for m in movers], np.int64), np.r_[first, nv].astype(np.int64)


def _moving(S: System, b: int) -> list[int]:
    """Velocities that move a body."""
    out: list[int] = []
    while b >= 0:
        out += range(S.tree.v[b], S.tree.v[b] + S.tree.nv[b])
        b = S.tree.parent[b]
    return out
