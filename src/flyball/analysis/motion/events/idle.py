"""One-sided rows that are at their ends and idle: neither a force nor an acceleration says whether they hold.

What comes a moment later says so: the problem of accelerations there, the state going on as decided. And where others
hold what such a row is of, as a freewheel and a tight rope between the same bodies, it cannot move: what is seen of
it is the rounding of those that hold.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ....constraints.modes import ONE_WAY, RATCHET, STOP
from ....equations.instant import FORCES, Bench
from ....equations.tasks import MOTION
from ....equations.watched import Loop
from ....numerics.cone.dense.problem import EVEN, FOUND, OUT, PUSHES
from ....numerics.integrators.clock import SPAN, H, T
from ....tables.system import BODY_LAW, G_BACK, G_CONE, G_HOLDS, G_LOWER, G_PULL, G_UPPER, ROW_WORK, UNIT, V0
from .here import Here
from .instant import Instant, instant_of, slowest

if TYPE_CHECKING:
    from .modes import Decided

NONE = 1e-7  # of the accelerations that one is the difference of: as good as none
CLEAR = 10.0  # times what is rounding: none of it
SOON = (1.0, 1e2, 1e4)  # moments later, in parts of the first
OF_STEP, OF_SPAN = 1e-6, 1e-9  # the first: part of the step before, of the time of the motion
SAME = 1e-11  # of a row's own response: it moves with others
ONE_SIDED = (STOP, RATCHET, ONE_WAY)
FORCES_HELD = (G_PULL, G_HOLDS, G_CONE)  # guards of forces of what holds


def idle(n: Instant, found: Decided) -> list[int]:
    """Rows that could push and do not, and that do not part either."""
    led = {p.of for p in found.parts}
    return [
        i
        for i, p in enumerate(found.parts)
        if p.rule in (PUSHES, OUT)
        and n.kind[p.switch] in ONE_SIDED
        and found.state[i] != EVEN
        and i not in led
        and found.A[i, i] > 0.0
        and abs(found.u[i]) <= NONE * found.sizes[p.switch] * found.A[i, i] + n.tiny[p.switch]
    ]


def take_over(n: Instant, found: Decided) -> None:
    """Have those hold, with no force yet, that push a moment later."""
    rows = idle(n, found)
    if not rows:
        return
    found.parts = found.parts.copy()
    parts = [p._replace(rule=PUSHES) if p.rule == OUT else p for p in found.parts]
    here, y, t = n.here, n.here.y.copy(), n.here.t
    B, _, _ = n.problem(parts)
    a = B.free + found.x @ B.Y
    n.ask(MOTION)
    nq, nv = len(here.q), len(a)
    q_dot = n.desk.K[0, :nq].copy()
    span, step = here.clock.real[SPAN], here.clock.real[H]
    first = OF_STEP * step if 0.0 < step < span else OF_SPAN * span
    open_ = set(rows)
    for part in SOON:
        later = part * first
        here.y[:nq], here.y[nq : nq + nv] = y[:nq] + later * q_dot, y[nq : nq + nv] + later * a
        here.clock.real[T] = t + later
        B, P, status = n.problem(parts)
        if status != 0 or n.balance(B, P, FORCES) != FOUND:
            break
        for i in sorted(open_):
            if P.state[i] == EVEN and P.x[i] * P.A[i, i] > CLEAR * P.grain[i]:
                found.state[i] = EVEN
                found.parts[i] = parts[i]  # it pushes, and is watched for that
            if abs(P.u[i]) > CLEAR * P.grain[i] or found.state[i] == EVEN:
                open_.discard(i)
    here.y[:], here.clock.real[T] = y, t
    n.problem(found.parts)


def tied(n: Instant, found: Decided) -> frozenset[tuple[int, int]]:
    """Guards, as (kind, switch), of rows that are at their ends and that what holds keeps there."""
    out: set[tuple[int, int]] = set()
    held = [i for i in range(len(found.parts)) if found.state[i] == EVEN and found.A[i, i] > 0.0]
    rows = idle(n, found)
    if not rows or not held:
        return frozenset()
    room = n.rooms[len(found.parts)]
    A = found.A[np.ix_(held, held)]
    for i in rows:
        p = found.parts[i]
        c = np.linalg.lstsq(A, found.A[held, i], rcond=1e-12)[0]
        rest = found.A[i, i] - c @ found.A[held, i]
        if abs(rest) <= SAME * found.A[i, i] and not _driven(n, room.B, i, (held, c)):
            out.add((G_BACK if n.kind[p.switch] == ONE_WAY else G_LOWER if p.sign > 0.0 else G_UPPER, p.switch))
    return frozenset(out)


def _driven(n: Instant, B: Bench, i: int, others: tuple[list[int], np.ndarray]) -> bool:
    """Whether row i, less what holds it, does work on what drivers prescribe: these move it then."""
    held, c = others
    axes = n.S.body_i[n.S.body_i[:, BODY_LAW] >= 0, V0]
    rows = n.S.row_i[:, ROW_WORK] >= 0
    for part in (B.E[:, axes], B.L[:, rows]):
        size = max(np.abs(part[i]).max(initial=0.0), np.abs(part[held]).max(initial=0.0))
        if np.abs(part[i] - c @ part[held]).max(initial=0.0) > SAME * size:
            return True
    return False


def tie(here: Here, loop: Loop) -> None:
    """Have the loop know which forces are rounding, and what is kept at its end by others.

    Of the latter a rate is none by which nothing gets anywhere.
    """
    loop.desk.tied[:] = loop.desk.still[:] = loop.desk.least[:] = 0.0
    if here.still:
        at = list(here.still)
        loop.desk.still[at] = here.c.system.glob[UNIT : UNIT + len(loop.desk.still)][at] * slowest(here)
    if here.tied or here.least:
        n = instant_of(here)
        for g, (kind, s, _) in enumerate(n.guarded):
            if kind in FORCES_HELD:
                loop.desk.least[g] = here.least.get(s, 0.0)
            if (kind, s) in here.tied:
                loop.desk.tied[g] = n.unit[s] * (n.pace if kind == G_BACK else 1.0)
