"""Static equilibrium: where forces and reactions balance at rest, from a guess; whether it is stable.

Newton's method on r(q, lam) = -f - G^T lam = 0, g(q) = 0 with the exact stiffness K (reactions turn with the bodies).
Where it does not lead on, pseudo-transient continuation: a motion without inertia, evenly damped, whose steps grow as
it comes to rest (Kelley and Keyes 1998). It goes the way that the forces push, so it ends in stable equilibria.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import ModelError, NotConverged
from ..model.model import Model
from ..results.equilibrium import STABLE, UNSTABLE, Equilibrium
from ..tables.names import velocity_names
from .assemble import assemble
from .assembly.start import Assembly
from .linear.curves import snapshot
from .linear.derivatives import State
from .linear.kinks import kinks
from .linear.preload import preloaded
from .linear.rest import Rest
from .linear.stability import GROWTH, stability
from .linear.turning import turning as turn
from .linearize import without_inputs
from .options import Options
from .steps import tangent_step

NEWTON, DESCENT = 40, 400  # steps
ENDLESS = 15.0  # way in radians, or in the mechanism's lengths, after which nothing will hold it any more
ARRIVED = 1e-7  # Newton's last step: the next one would be its square
LONGEST = 0.3  # a step in radians, or parts of the mechanism's length
BALANCED = 1e-9  # forces left, of those that act
CLOSED = 1e-10  # of the mechanism's length
SOFT, HARD, STUCK = 1e-8, 1e2, 1e8  # dampings: where Newton takes over, where descent begins, where it gives up
SHOWN = 6


@dataclass(frozen=True, kw_only=True)
class EquilibriumOptions(Options):
    """What `Mechanism.equilibrium` is asked."""

    t: float
    parameters: Mapping[str, float] | None
    start: Equilibrium | None
    stable: bool
    preload: tuple[str, ...]
    turning: tuple[str, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.stable and self.turning:
            raise ModelError(
                "stable=True goes downhill from an unstable equilibrium; a steady motion has no hill to go down. Leave "
                "stable= out and begin nearer to the motion that is wanted: by described positions, or start="
            )
        if self.stable and self.preload:
            raise ModelError(
                "preload= holds the mechanism where it is drawn, stable=True moves it elsewhere; give one of the two"
            )
        if self.preload and self.turning:
            raise ModelError(
                "preload= holds a mechanism at rest, turning= asks for a motion; give one of the two. The effort of a "
                "driver tells what a steady motion needs along its coordinate"
            )


def resting(
    t: float, parameters: Mapping[str, float] | None, start: Equilibrium | None = None, stable: bool = False
) -> EquilibriumOptions:
    """What other analyses ask: where it rests."""
    return EquilibriumOptions(t=t, parameters=parameters, start=start, stable=stable, preload=(), turning=())


def equilibrium(model: Model, o: EquilibriumOptions) -> Equilibrium:
    """A static equilibrium near the mechanism as described, or a steady motion: see `Mechanism.equilibrium`."""
    a = assemble(model, t=o.t, parameters=o.parameters)
    begin = _begun(a, o.start)
    if o.turning:
        return _steady(begin, a, o.turning)
    if o.preload:
        return _finished(*preloaded(begin, o.preload), "preload")
    return _searched(Rest.at(a.compiled, a.t, begin.q), o.stable)


def _begun(a: Assembly, start: Equilibrium | None) -> Assembly:
    """Where the search begins: as assembled, or at another equilibrium."""
    if start is None:
        return a
    s = a.compiled.structure
    if not isinstance(start, Equilibrium) or list(start.assembly.compiled.structure.place) != list(s.place):
        raise ModelError(f"start must be an equilibrium of {s.model.name!r}, or of one with the same bodies")
    q, _ = a.compiled.take(start.assembly.compiled, start.assembly.t, start.assembly.q, start.assembly.v)
    return Assembly(a.compiled, a.t, q, np.zeros(s.nv))


def _searched(x: Rest, stable: bool) -> Equilibrium:
    """By Newton's method, and by descent where that does not lead on or a stable one is wanted."""
    way = "Newton's method"
    arrived = _newton(x)
    unstable = arrived is not None and stability(arrived).kind == UNSTABLE
    if arrived is not None and unstable and not stable and _far(x, arrived):
        downhill = _descent(x)  # Newton has led up a hill that the guess is not on
        below = None if downhill is None else _newton(downhill)
        if below is not None and stability(below).kind != UNSTABLE:
            return _finished(below, {}, "descent")
    if arrived is None or (stable and unstable):
        way = "descent"
        downhill = _descent(x if arrived is None else _pushed(arrived))
        arrived = None if downhill is None else _newton(downhill)
        if arrived is None:
            raise _failure(downhill or x)
    return _finished(arrived, {}, way)


def _far(x: Rest, y: Rest) -> bool:
    """Whether two positions are more than a long step apart."""
    return bool(np.abs(tangent_step(x.c, x.q, y.q) / x.scale).max(initial=0.0) > LONGEST)


def _steady(a: Assembly, described: Assembly, names: Sequence[str]) -> Equilibrium:
    """A steady motion; its stability by its eigenvalues, of which those of the turning itself are zero."""
    c = a.compiled
    found = turn(a, described, names, c.parameters)
    x = found.state
    f, _, r = without_inputs(x)
    w = np.linalg.eigvals(r.A)
    grows = w.real.max(initial=0.0) / max(np.abs(w).max(initial=0.0), 1e-300)
    q, v = c.take(x.c, x.t, x.q, x.v)
    return Equilibrium(
        t=x.t,
        stability=UNSTABLE if grows > GROWTH else STABLE,
        freedoms=tuple(f.labels),
        stiffness=r.K if r.K is not None else np.zeros((0, 0)),
        weakest={},
        least=float("nan"),
        unbalanced=found.unbalanced,
        method="Newton's method",
        parameters=dict(c.parameters),
        result=snapshot(x),
        assembly=Assembly(c, x.t, q, v),
        speeds=found.speeds,
    )


def _newton(x: Rest) -> Rest | None:
    """Newton's method with steps of limited length; None where it does not settle."""
    for _ in range(NEWTON):
        step, lam = x.step()
        longest = np.abs(step).max(initial=0.0)
        if not np.isfinite(longest):
            return None
        x = x.moved(step * min(1.0, LONGEST / max(longest, 1e-300)), lam)
        if longest < ARRIVED and x.open() <= CLOSED:
            best = Rest.at(x.c, x.t, x.q)  # the smallest reactions: self-stress would hide what is left
            if best.settled(BALANCED):
                return best
    return None


def _pushed(x: Rest) -> Rest:
    """A little way along the direction of least stiffness."""
    direction = stability(x).direction
    return x.moved(1e-2 * direction / np.abs(direction).max(), 0.0 * x.lam).closed()


def _descent(x: Rest) -> Rest | None:
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


def _finished(x: Rest, preload: dict[str, float], way: str) -> Equilibrium:
    s = stability(x)
    names = velocity_names(x.c.structure)
    large = np.argsort(-np.abs(s.direction))[:SHOWN]
    x.c.at(x.t, x.q, np.zeros(len(x.scale)))
    return Equilibrium(
        t=x.t,
        stability=s.kind,
        freedoms=tuple(s.free.labels),
        stiffness=s.stiffness,
        weakest={names[d].name: float(s.direction[d]) for d in large if abs(s.direction[d]) > 1e-3},
        least=s.least,
        unbalanced=x.unbalanced(),
        method=way,
        parameters=dict(x.c.parameters),
        result=snapshot(State.resting(x.c, x.t, x.q, x.lam)),
        assembly=Assembly(x.c, x.t, x.q, np.zeros(len(x.scale))),
        preload=preload,
        kinks=s.kinks,
    )


def _failure(x: Rest) -> NotConverged:
    """What remains where the search ended."""
    best = Rest.at(x.c, x.t, x.q)
    names = velocity_names(x.c.structure)
    left = best.equations.block("r")
    residuals = {n.name: float(-value) for n, value in zip(names, left, strict=True)}
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
