"""Rows of the contacts and lines of the mechanism, and what an impulse along them changes all of a group by.

A contact acts where ``P.arm`` has it from the body. What a row's impulse changes is
one solve with the factor of the joints; groups know nothing of each other, so that one solve answers a row of each.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.vec import add, load3
from ..numerics.cone.problem import NONE
from .implicit import climb, respond, stiffened
from .joined import IMPULSE, JOB_AT, JOB_NEXT, JOB_ROWS, LINE_AT, LINE_GROUP, NO_ROOM, STRUCK
from .lines import line_laws, line_rows


@formula
def contact_rows(A, M, C, P):
    """Rows of all contacts on the mechanism into ``P``, whose sides are movers' numbers: they become groups.

    Returns 0, or NO_ROOM where J and Y, or the table of jobs, are too small for ``A.count[NEEDED]`` and [JOBS].
    """
    first = A.count.first
    rows = 6 if P.turn.shape[0] > 0 else 3
    used, jobs = needed(A, P, rows)
    used, jobs, lines = line_rows(A, P, used, jobs, False)
    A.count.needed, A.count.jobs = used, jobs
    if used > min(P.J.shape[0], P.Y.shape[0]) or jobs > A.job.shape[0] or lines > P.line_at.shape[0]:
        return NO_ROOM
    for g in range(A.queue.shape[0]):
        A.queue[g] = -1
    used = 0
    jobs = 0
    for c in range(P.size[0]):
        last = -1
        for side in range(2):
            P.block[c, side] = -1
            mover = P.at[c, side]
            if mover < first:
                continue
            b, g = A.mover[mover - first, 0], A.mover[mover - first, 1]
            if g < 0:  # joints hold it to the ground
                P.at[c, side] = NONE
                continue
            n = A.group[g + 1] - A.group[g]
            if g == last:  # both sides in one group: the difference
                at = P.block[c, 0]
                for i in range(rows * n):
                    P.J[at + i] = -P.J[at + i]
                P.block[c, 0], P.at[c, 0] = -1, NONE
            else:
                at = used
                for i in range(rows * n):
                    P.J[at + i] = 0.0
                used += rows * n
                queue(A, g, jobs, at, rows)
                jobs += 1
            point = add(load3(A.W.BK, b, 0), load3(P.arm, c, 3 * side))
            side_rows(A, P, c, (b, at - A.group[g], n), point, rows)
            P.block[c, side], P.at[c, side] = at, -2 - g
            last = g
    line_rows(A, P, used, jobs, True)
    for i in range(lines):
        queue(A, A.active[i, LINE_GROUP], jobs + i, A.active[i, LINE_AT], 1)
    answer(A, P)
    line_laws(A, P, lines)
    return 0


@formula
def needed(A, P, rows):
    """How many numbers J and Y hold, and how many jobs there are."""
    used = 0
    jobs = 0
    for c in range(P.size[0]):
        last = -1
        for side in range(2):
            mover = P.at[c, side]
            if mover >= A.count.first:
                g = A.mover[mover - A.count.first, 1]
                if g != last and g >= 0:
                    used += rows * (A.group[g + 1] - A.group[g])
                    jobs += 1
                last = g
    return used, jobs


@formula
def queue(A, g, job, at, rows):
    """Ask for the response to rows of group g."""
    A.job[job, JOB_AT], A.job[job, JOB_ROWS], A.job[job, JOB_NEXT] = at, rows, A.queue[g]
    A.queue[g] = job


@formula
def side_rows(A, P, c, where, point, rows):
    """Add velocities of a point of body b along the frame of contact c; with six rows its turning after them."""
    b, at, n = where
    zero = (0.0, 0.0, 0.0)
    for i in range(rows):
        axis = load3(P.frame, c, 3 * (i % 3))
        force, torque = (axis, zero) if i < 3 else (zero, axis)
        climb(A.S, A.W, b, P.J, at + i * n, 1.0, force, torque, point)


@formula
def answer(A, P):
    """Responses Y to all rows that are queued: a row of each group in every solve."""
    force, out = A.wide[IMPULSE], A.wide[STRUCK]
    busy = True
    while busy:
        busy = False
        for i in range(6):
            asked = fill(A, P, i, force)
            if asked == 0:
                break
            busy = True
            respond(A, force, out)
            stiffened(A, out)
            take(A, P, i, out)
        for g in range(A.queue.shape[0]):
            if A.queue[g] >= 0:
                A.queue[g] = A.job[A.queue[g], JOB_NEXT]


@formula
def fill(A, P, i, force):
    """Row i of the job that is next in each group; how many have one."""
    asked = 0
    for d in range(force.shape[0]):
        force[d] = 0.0
    for g in range(A.queue.shape[0]):
        k = A.queue[g]
        if k >= 0 and i < A.job[k, JOB_ROWS]:
            asked += 1
            a = A.group[g]
            n = A.group[g + 1] - a
            at = A.job[k, JOB_AT] + i * n
            for d in range(n):
                force[a + d] = P.J[at + d]
    return asked


@formula
def take(A, P, i, out):
    """Read what `fill` asked for."""
    for g in range(A.queue.shape[0]):
        k = A.queue[g]
        if k >= 0 and i < A.job[k, JOB_ROWS]:
            a = A.group[g]
            n = A.group[g + 1] - a
            at = A.job[k, JOB_AT] + i * n
            for d in range(n):
                P.Y[at + d] = out[a + d]
