"""Static equilibrium: where forces and reactions balance at rest, from a guess; whether it is stable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ModelError, NotConverged, SingularityError
from ..model.model import Model
from ..model.touching import holds_at_times
from ..results.equilibrium import EIGENVALUES, MULTIPLIERS, STABLE, UNSTABLE, Equilibrium
from ..results.result import Result
from ..tables.names import velocity_names
from .assemble import assemble
from .assembly.start import Assembly
from .compiled import compiled
from .linear.controlled import found_rest
from .linear.curves import snapshot
from .linear.found import finished
from .linear.free import free
from .linear.inputs import with_inputs
from .linear.rest import Rest
from .linear.search import LONGEST, descent, failure, newton, pushed
from .linear.spectrum import spectrum
from .linear.stability import by_eigenvalues, stability
from .linear.turning import turning as turn
from .motion.start import begin as begin_motion
from .options import Options
from .resting.rest import rest
from .steps import tangent_step

ABOUT: dict[str, Any] = {
    "t": None, "parameters": None, "coordinates": "auto", "frozen": False, "inputs": (), "outputs": ()
}  # fmt: skip
"""What `linearize` is asked about an equilibrium, to judge it."""


@dataclass(frozen=True, kw_only=True)
class EquilibriumOptions(Options):
    """What `Mechanism.equilibrium` is asked."""

    t: float
    parameters: Mapping[str, float] | None
    start: Equilibrium | Result | None
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
    t: float, parameters: Mapping[str, float] | None, start: Equilibrium | Result | None = None, stable: bool = False
) -> EquilibriumOptions:
    """What other analyses ask: where it rests."""
    return EquilibriumOptions(t=t, parameters=parameters, start=start, stable=stable, preload=(), turning=())


def equilibrium(model: Model, o: EquilibriumOptions) -> Equilibrium:
    """A static equilibrium near the mechanism as described, or a steady motion: see `Mechanism.equilibrium`."""
    if model.controllers:
        return _controlled(model, o)
    a = assemble(model, t=o.t, parameters=o.parameters)
    begin = _begun(a, _guess(model, o))
    if holds_at_times(model):
        _refuse_smooth_only(o)
        return rest(model, begin, o.parameters)
    if o.turning:
        return _steady(begin, a, o.turning)
    if o.preload:
        return finished(*preloaded(begin, o.preload), "preload")
    return _searched(Rest.at(a.compiled, a.t, begin.q), o.stable)


def _controlled(model: Model, o: EquilibriumOptions) -> Equilibrium:
    """Where a mechanism rests with its controllers: no state of theirs changes. Its stability is that of the motion."""
    for name in ("stable", "preload", "turning"):
        if getattr(o, name):
            raise ModelError(f"{name}= is for mechanisms without controllers; leave it out")
    a = assemble(model, t=o.t, parameters=o.parameters)
    guess, c = _guess(model, o), a.compiled
    begin = _begun(a, guess)
    z = (guess or begin).compiled.z.tolist()
    at = dict(zip((x.name for x in c.structure.controls), z, strict=False))
    q, way = found_rest(model.snapshot(), c, a.t, begin.q, at)
    out = finished(Rest.at(c, a.t, q), {}, way)
    from .linearize import LinearizeOptions, small_motions  # linear models stand on statics

    linear, out.stability = small_motions(model, LinearizeOptions(about=out, **ABOUT))
    out.judged_by = MULTIPLIERS if linear.period else EIGENVALUES
    return out


def _refuse_smooth_only(o: EquilibriumOptions) -> None:
    """Refuse what has no meaning where a mechanism comes to rest by falling."""
    for name in ("preload", "turning", "stable"):
        if getattr(o, name):
            raise ModelError(
                f"{name}= is for mechanisms without contact; with contact it comes to rest by itself. Leave it out"
            )


def _guess(model: Model, o: EquilibriumOptions) -> Assembly | None:
    """The other equilibrium, or the end of the motion, that is to be begun at; controllers' states with it."""
    if isinstance(o.start, Result):
        start = begin_motion(model, o.start.final[0], o.parameters, o.start, "absolute")
        s = start.assembly.compiled.structure
        start.assembly.compiled.z = start.y[s.nq + s.nv :].copy()
        return start.assembly
    if o.start is None:
        return None
    if isinstance(o.start, Equilibrium):
        at: Assembly = o.start.assembly
        return at
    raise ModelError(
        f"start must be an equilibrium of {model.name!r}, or a result of simulate, not {type(o.start).__name__}"
    )


def _begun(a: Assembly, guess: Assembly | None) -> Assembly:
    """Where the search begins: as assembled, or where the guess is."""
    if guess is None:
        return a
    s = a.compiled.structure
    if list(guess.compiled.structure.place) != list(s.place):
        raise ModelError(f"start must be an equilibrium of {s.model.name!r}, or of one with the same bodies")
    q, _ = a.compiled.take(guess.compiled, guess.t, guess.q, guess.v)
    return Assembly(a.compiled, a.t, q, np.zeros(s.nv))


def _searched(x: Rest, stable: bool) -> Equilibrium:
    """By Newton's method, and by descent where that does not lead on or a stable one is wanted."""
    way, arrived, shaky = "Newton's method", None, None
    try:
        arrived = newton(x)
    except SingularityError as error:  # the forces may lead elsewhere
        shaky = error
    unstable = arrived is not None and stability(arrived).kind == UNSTABLE
    if arrived is not None and unstable and not stable and _far(x, arrived):
        downhill = descent(x)  # Newton has led up a hill that the guess is not on
        below = None if downhill is None else newton(downhill)
        if below is not None and stability(below).kind != UNSTABLE:
            return finished(below, {}, "descent")
    if arrived is None or (stable and unstable):
        way = "descent"
        downhill = descent(x if arrived is None else pushed(arrived))
        arrived = None if downhill is None else newton(downhill)
        if arrived is None:
            raise shaky or failure(downhill or x)
    return finished(arrived, {}, way)


def _far(x: Rest, y: Rest) -> bool:
    """Whether two positions are more than a long step apart."""
    return bool(np.abs(tangent_step(x.c, x.q, y.q) / x.scale).max(initial=0.0) > LONGEST)


def _steady(a: Assembly, described: Assembly, names: Sequence[str]) -> Equilibrium:
    """A steady motion; its stability by its eigenvalues, of which those of the turning itself are zero."""
    from .linearize import without_inputs

    c = a.compiled
    found = turn(a, described, names, c.parameters)
    x = found.state
    f, _, r = without_inputs(x)
    grows = by_eigenvalues(spectrum(r.A, r.doubt)) == UNSTABLE
    q, v = c.take(x.c, x.t, x.q, x.v)
    return Equilibrium(
        t=x.t,
        stability=UNSTABLE if grows else STABLE,
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


# Preload: what has to be added to forces for a mechanism to be in equilibrium where it is drawn.


BALANCED = 1e-9  # forces left, of those that act
ROUNDED = 1e-13  # part of a force along the free motions that is none


def preloaded(a: Assembly, names: Sequence[str]) -> tuple[Rest, dict[str, float]]:
    """The mechanism at rest with the smallest preloads that balance it, and those.

    The forces along the free motions Z have to vanish: Z^T (f + sum b_k w_k) = 0.

    Raises
    ------
    ModelError
        If there is no such force, or it has no law.
    NotConverged
        If these forces cannot balance it.
    """
    names = [names] if isinstance(names, str) else list(dict.fromkeys(names))
    model, inputs = with_inputs(a.compiled.structure.model, names)
    for i in inputs:
        if i.driver or i.name == i.parameter:
            what = "driver" if i.driver else "parameter"
            raise ModelError(f"{i.name!r} is a {what}; only forces and torques can be preloaded")
    c = compiled(model, parameters=a.compiled.parameters)
    c.follow(a.compiled.hints)
    x = Rest.at(c, a.t, a.q)
    e = x.equations
    own = free(e)
    Z = own.Z
    by = np.array([e.by_law(i.parameter)[e.at["r"]] for i in inputs]).T
    along = Z.T @ by
    most = (np.abs(by) * own.scale[:, None]).sum(axis=0) / own.scale[own.chosen, None]
    along[np.abs(along) <= ROUNDED * most] = 0.0  # what the constraints carry balances nothing
    w = np.linalg.lstsq(along, -Z.T @ e.block("r"), rcond=1e-10)[0]
    changed = c.parameters | {i.parameter: float(value) for i, value in zip(inputs, w, strict=True)}
    loaded = compiled(model, parameters=changed)
    loaded.follow(c.hints)
    y = Rest.at(loaded, a.t, a.q)
    if not y.settled(BALANCED):
        raise NotConverged(
            f"{', '.join(names)} cannot balance {model.name!r} where it is drawn: {y.pushed()} all the same; preload "
            f"other forces too",
            {n.name: float(-v) for n, v in zip(velocity_names(c.structure), y.equations.block("r"), strict=True)},
        )
    return y, dict(zip(names, w.tolist(), strict=True))
