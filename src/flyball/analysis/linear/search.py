"""The search for positions at rest: Newton's method, and the way that the forces push.

Newton's method on r(q, lam) = -f - G^T lam = 0, g(q) = 0 with the exact stiffness K (reactions turn with the bodies).
Where it does not lead on, pseudo-transient continuation: a motion without inertia, evenly damped, whose steps grow as
it comes to rest (Kelley and Keyes 1998). It goes the way that the forces push, so it ends in stable equilibria.
"""

from __future__ import annotations

import numpy as np

from ...errors import NotConverged, SingularityError
from ...numerics.saddle import surely_independent
from ...tables.names import velocity_names
from .balance import clearly_settled
from .derivatives import Equations, State
from .free import free
from .kinks import kinks
from .rest import Rest
from .stability import stability

NEWTON, DESCENT = 40, 400  # steps
ENDLESS = 15.0  # way in radians, or in the mechanism's lengths, after which nothing will hold it any more
ARRIVED = 1e-7  # Newton's last step: the next one would be its square
LONGEST = 0.3  # a step in radians, or parts of the mechanism's length
NEARLY = 1e-3  # of what is missing: less is left where everything on the way is nearly linear
PUSH = 1e-2  # in the same
BALANCED = 1e-9  # forces left, of those that act
CLOSED = 1e-10  # gaps that Newton's method leaves, of the mechanism's length
SOFT, HARD, STUCK = 1e-8, 1e2, 1e8  # dampings: where Newton takes over, where descent begins, where it gives up


def newton(x: Rest) -> Rest | None:
    """Newton's method with steps of limited length; None where it does not settle.

    Raises
    ------
    SingularityError
        If it ends in a position in which no finite reactions carry the load.
    """
    return newton_to(x)[0]


def newton_to(x: Rest) -> tuple[Rest | None, Rest]:
    """The same, and where it ended."""
    for _ in range(NEWTON):
        step, lam = x.step()
        longest = np.abs(step).max(initial=0.0)
        if not np.isfinite(longest):
            break
        x = _far(x, step, lam) or x.moved(step * min(1.0, LONGEST / max(longest, 1e-300)), lam)
        if longest < ARRIVED and (best := arrived(x)):
            return best, x
    return None, x


def _far(x: Rest, step: np.ndarray, lam: np.ndarray) -> Rest | None:
    """Where a longer step than is taken blindly leads, if little turns on the way and nearly nothing is left there."""
    size = np.abs(step)
    if not size.max(initial=0.0) > LONGEST or (size > LONGEST)[x.turns].any():
        return None
    there = x.moved(step, lam)
    return there if there.missing() < NEARLY * x.missing() else None


def arrived(x: Rest) -> Rest | None:
    """The place itself if it is closed and all is balanced there; None if not.

    Raises
    ------
    SingularityError
        If no finite reactions carry the load there.
    """
    if not x.open() <= CLOSED:
        return None
    best = Rest.at(x.c, x.t, x.q)  # the smallest reactions: self-stress would hide what is left
    if not best.settled(BALANCED) or _on_a_jump(best):
        return None
    refuse_shaky(best)
    return best


def _on_a_jump(x: Rest) -> bool:
    """Whether other last digits alone balance it, because a force jumps there."""
    return not clearly_settled(x.equations, BALANCED) and any(k.jump for k in kinks(x.equations))


def pushed(x: Rest, later: Rest | None = None) -> Rest:
    """A little way along the direction of least stiffness.

    Under later values, if given, to the side that the forces push to: just beyond a limit point they are too small to
    lead out of its neighbourhood.

    Raises
    ------
    NotConverged
        If nothing is free: nothing can give way then, and no branch end.
    """
    direction = stability(x).direction
    largest = np.abs(direction).max(initial=0.0)
    if not largest:
        raise failure(later or x)
    side = 1.0
    if later is not None:
        x = later.closed()
        side = -1.0 if float(direction @ x.r) > 0.0 else 1.0
    return x.moved(PUSH * side * direction / largest, 0.0 * x.lam).closed()


def descent(x: Rest) -> Rest | None:
    """Pseudo-transient continuation on the constraints; None where it gets no further."""
    x = x.closed()
    damping, left, way = HARD, np.abs(x.r).max(initial=0.0), 0.0
    for _ in range(DESCENT):
        if damping < SOFT or x.settled(BALANCED):
            return x
        step, lam = x.step(damping)
        longest = np.abs(step).max(initial=0.0)
        along = float(step @ -x.r)
        if not along > 0.0 or longest > LONGEST:  # against the forces, or too far
            damping *= 4.0
            if damping > STUCK:
                return None
            continue
        way += longest
        if way > ENDLESS:
            return None
        x = x.moved(step, lam).closed()
        before, left = left, np.abs(x.r).max(initial=0.0)
        damping *= float(np.clip(left / max(before, 1e-300), 0.3, 1.5)) * 0.7
    return None


def led(x: Rest) -> tuple[Rest | None, Rest]:
    """The same for what has no potential, as forces of controllers: (place or None, where it ended).

    Implicit steps of a motion without inertia that lengthen as what is missing becomes less (switched evolution
    relaxation); there is no hill to tell whether one leads down.
    """
    x = x.closed()
    damping, left = HARD, x.missing()
    for _ in range(DESCENT):
        if damping < SOFT or x.settled(BALANCED):
            return x, x
        step, lam = x.step(damping)
        longest = np.abs(step).max(initial=0.0)
        if not np.isfinite(longest):
            break
        if longest > LONGEST:
            damping *= 4.0
            if damping > STUCK:
                break
            continue
        x = x.moved(step, lam).closed()
        before, left = left, x.missing()
        damping *= float(np.clip(left / max(before, 1e-300), 0.3, 1.5)) * 0.7
    return None, x


def failure(x: Rest) -> NotConverged:
    """What remains where the search ended."""
    best = Rest.at(x.c, x.t, x.q)
    names = velocity_names(x.c.structure)
    left = best.equations.block("r")
    residuals = {n.name: float(-value) for n, value in zip(names, left, strict=True)}
    if not free(best.equations).Zv.shape[1]:
        what = "their forces do not balance it" if x.open() <= CLOSED else "they do not close any more"
        return NotConverged(
            f"no equilibrium of {x.c.structure.model.name!r} was found: joints and drivers leave nothing free, and "
            f"where the search ended {what}. Check lengths and drivers: it may be past a dead centre, or locked",
            residuals,
        )
    jumps = "; ".join(k.text for k in kinks(best.equations) if k.jump)
    if jumps:
        return NotConverged(
            f"no equilibrium of {x.c.structure.model.name!r} was found: the search ended where {jumps}, and a jumping "
            f"force is not balanced. Write what is smooth, for instance tanh(x/w) for sign(x)",
            residuals,
        )
    return NotConverged(
        f"no equilibrium of {x.c.structure.model.name!r} was found: where the search ended, {best.pushed()} and "
        f"nothing holds against it. Give a better guess, or add what has to hold it: a spring, a stop, a driver",
        residuals,
    )


# Loads that nothing carries: positions at rest that only the closing tolerance keeps from being singular.
#
# Where constraints lose rank without letting anything move, the structure can shake: w with G w = 0 for which the gaps
# grow as kappa s^2 / 2 with the way s along it. Forces that do work along w are balanced by no finite reaction.
# Newton's method ends beside the singular position, where G w = sigma u and the reaction is as large as the way
# s = sigma / kappa is short. A way whose gaps are within the closing tolerance says nothing:
# such reactions are made of it.


DENSE = 300  # rows or columns up to which all singular values are found
WEAK, NONE = 1e-3, 1e-11  # singular values of rows of unit length that are looked at: smaller ones carry nothing
STEP = 1e-3  # way along which it is seen how a singular value changes, in radians or parts of the mechanism's length
LOADED = 1e-4  # work of the forces along the shake, of what they could do: less is none
PART = 1e-3  # of a dependency: elements with less have none in it


def refuse_shaky(x: Rest) -> None:
    """Refuse a position at rest whose reactions are made of the closing tolerance.

    Raises
    ------
    SingularityError
        Naming the elements whose constraints depend on each other there, and what they let shake.
    """
    if not len(x.g):
        return
    if min(x.G.shape) > DENSE and surely_independent(x.G):  # others bend too much to be shaky
        return
    U, d, Vt = np.linalg.svd(x.G.toarray(), full_matrices=False)
    force = x.scale * Equations(State.resting(x.c, x.t, x.q)).block("r")
    for u, sigma, w in zip(U.T, d, Vt, strict=True):
        if not NONE * d[0] < sigma < WEAK * d[0]:
            continue
        there, back = (u @ x.moved(s * STEP * w, 0.0 * x.lam).G @ w for s in (1.0, -1.0))
        bends = abs(there - back) / (2.0 * STEP)
        if sigma**2 < 2.0 * CLOSED * bends and abs(w @ force) > LOADED * (np.abs(w) @ np.abs(force)):
            raise _refused(x, u, w)


def _refused(x: Rest, u: np.ndarray, w: np.ndarray) -> SingularityError:
    """The error that names what is shaky."""
    rows = x.c.structure.rows
    names = tuple(dict.fromkeys(r.element.name for r, part in zip(rows, u, strict=True) if abs(part) > PART))
    shakes = velocity_names(x.c.structure)[int(np.argmax(np.abs(w)))].name
    return SingularityError(
        f"{x.c.structure.model.name!r} has no equilibrium at t = {x.t:.6g} s: the constraints of {', '.join(names)} "
        f"depend on each other there, so that it can shake along {shakes}, and no finite reaction carries the load "
        f"along it. Move them out of this position, take one of them out, or give what yields: a spring, a bushing",
        x.t,
        names,
    )
