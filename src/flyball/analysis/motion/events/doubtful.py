"""What an instant leaves open: several solutions, friction whose hold redundancy leaves undetermined; and what jams.

Where friction grows with the load that it makes itself, rigid bodies may have no accelerations, or several (Painleve
1895). With several the one is taken that goes on from the modes before. With none velocities jump without a collision:
the impulses are the limit of a step of time that goes to zero (Stewart 2000, SIAM Review 42, section 1.3).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....constraints.modes import SLIP
from ....equations.instant import BLOWS, GRAIN, OF_A_STEP
from ....model.touch import Touch
from ....numerics.cone.dense.problem import EVEN, FOUND, FREE, GRIPS
from ....tables.system import G_SHARED
from ..jams import bodies
from .instant import Instant, Part
from .jump import Jump, finish, nothing
from .modes import Decided, elements

OTHER = 1e-6  # of the accelerations: they are others
OPEN = 1e-9  # of the largest eigenvalue: nothing tells rows apart
INSTANT = 1e-9  # part of the speed that forces make in a step of time that goes to zero
STRUCK = 1e3  # times the impulse that forces make in it: a blow


def doubt(n: Instant, found: Decided) -> None:
    """Say what is left open at this instant, of the same elements once in a motion."""
    if not found.gain.any():
        return
    if (said := _several(n, found)) and not any(x.endswith(said) for x in n.here.doubts):
        n.here.doubts.append(f"at t = {n.here.t:.6g} s {said}")
    if (said := _undetermined(n, found)) and said not in n.here.doubts:
        n.here.doubts.append(said)


def shared(n: Instant, guards: Sequence[int]) -> None:
    """Say whose shares of what holds a body no guard watches: it holds by others than those that are computed."""
    group = np.flatnonzero(n.W.modes.shared).tolist()
    own = [x for g in guards for x in (group if n.guarded[g][0] == G_SHARED else [n.guarded[g][1]])]
    which = [n.here.structure.switches[s].element for s in dict.fromkeys(own)]
    who = " and ".join(dict.fromkeys(f"{e.title} of {bodies(e)}" if isinstance(e, Touch) else e.title for e in which))
    said = (
        f"{who} would carry more than can be held there by the least forces, by others it holds: how rigid bodies at "
        f"rest share what holds them is not determined, and when this gives way can be wrong. Steps by impulses "
        f"(method='impulse') share anew in each step"
    )
    if said not in n.here.doubts:
        n.here.doubts.append(said)


def _several(n: Instant, found: Decided) -> str:
    """Other solutions of the problem that was solved last, looked for from the opposite modes."""
    P = n.rooms[len(found.parts)].P
    size = max(np.abs(P.b).max(), P.grain.max() / GRAIN)  # at a take-off accelerations are differences of larger ones
    for state in (FREE, EVEN):
        P.state[:] = state
        if n.again(P) == FOUND and np.abs(P.u - found.u).max() > OTHER * size:
            who = " and ".join(elements(n, found.parts))
            return (
                f"rigid bodies with friction can go on in several ways (Painleve's paradox) at "
                f"{who}; taken: the one that goes on from the modes before"
            )
    return ""


def _undetermined(n: Instant, found: Decided) -> str:
    """Friction whose most depends on what redundancy leaves open."""
    held = np.flatnonzero(found.state == EVEN)
    grips = [i for i in held.tolist() if found.parts[i].rule == GRIPS and found.gain[i].any()]
    if len(held) < 2 or not grips:
        return ""
    d = np.sqrt(found.A.diagonal()[held])
    d[d == 0.0] = 1.0
    size, Z = np.linalg.eigh(found.A[np.ix_(held, held)] / np.outer(d, d))
    Z = Z[:, size < OPEN * size.max()] / d[:, None]
    open_ = [i for i in grips if (np.abs(found.gain[i][held] @ Z) > OTHER * np.abs(found.gain[i][held]).max()).any()]
    if not open_ or _needless(n, found, open_):
        return ""
    who = " and ".join(elements(n, [found.parts[i] for i in open_]))
    return (
        f"whether {who} holds is not determined: the most that it holds follows reactions that redundancy leaves open; "
        f"taken: those whose sum of squares, each by the mass that it moves, is least"
    )


def _needless(n: Instant, found: Decided, rows: list[int]) -> bool:
    """Whether these are places of contact without whose friction nothing moves either: a ball at rest in a groove."""
    if any(n.kind[found.parts[i].switch] != SLIP for i in rows):
        return False
    P = n.rooms[len(found.parts)].P
    P.const[rows], P.gain[rows], P.state[:] = 0.0, 0.0, found.state
    size = max(np.abs(P.b).max(), P.grain.max() / GRAIN)
    return n.again(P) == FOUND and bool(np.abs(P.u - found.u).max() <= OTHER * size)


def shock(n: Instant, parts: list[Part], held: float) -> Jump | None:
    """The jump of velocities without a collision, if there is one, for rows that have no accelerations.

    ``held`` is what friction holds at least, without any load.
    """
    B, P, _ = n.problem(parts)
    forces, before = P.b.copy(), B.sign * n.rate[B.which]
    size = np.abs(before).max(initial=0.0)
    if not size > 0.0:
        return None
    scale = np.sqrt(np.maximum(P.A.diagonal(), 1e-300))
    finite = max(np.abs(forces).max(), (P.A.diagonal() * held).max())
    B.step[0] = INSTANT * size / max(finite, 1e-300)
    P.b[:] = before + B.step[0] * forces
    B.loaded[:] *= B.step[0]
    if n.balance(B, P, OF_A_STEP) != FOUND:
        return None
    if not (scale * np.abs(P.x)).max() > STRUCK * B.step[0] * finite / scale.max():
        return None
    P.b[:], B.loaded[:] = before, 0.0
    if n.balance(B, P, BLOWS) != FOUND:
        return None
    out = nothing(n)
    out.jammed = tuple(p.switch for p in parts)
    return finish(n, (B, P), parts, (before, P.x.copy(), P.u.copy()), out, np.zeros_like(out.along))
