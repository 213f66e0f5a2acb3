"""Equilibrium of a mechanism that touches: where it comes to rest, what carries it, and whether it is stable."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...errors import AnalysisError, ModelError, NotConverged
from ...model.model import Model
from ...model.touching import smooth_only
from ...results.equilibrium import MARGINAL, UNJUDGED, Equilibrium
from ...results.touch import LIMIT, PARTING, SMOOTH, STICKS, Touch
from ..assemble import assemble
from ..assembly.start import Assembly
from ..compiled import compiled
from ..linear.curves import snapshot
from ..linear.derivatives import State
from ..linear.found import finished
from ..linear.rest import Rest
from ..linear.search import newton
from .closed import Place, closed
from .copy import joined_copy, open_copy, told
from .forces import LIMIT as NEAR
from .forces import PARTING as NOTHING
from .forces import Carried, as_contacts
from .holds import Holds, supported
from .settle import settled

Held = tuple[Holds, Mapping[str, float]]
"""What holds besides contacts, and the most that each part that sticks bears."""
NEARBY = 0.02  # a way in parts of the mechanism's length, or radians, that what rests is put right by
BALANCED = 1e-6  # forces left, of those that act, above which it does not rest


def rest(model: Model, begin: Assembly, parameters: Mapping[str, float] | None) -> Equilibrium:
    """Where a mechanism comes to rest, and what carries it there.

    Parameters
    ----------
    model : Model
        With its contacts.
    begin : Assembly
        Where it begins.
    parameters : mapping, optional

    Raises
    ------
    ModelError
        If it has many bodies, or surfaces that statics does not know.
    NotConverged
        If it does not come to rest.
    """
    refuse_bulk(model, "equilibrium")
    model = model.snapshot()
    place = _place(model, begin, parameters)
    bare, held = open_copy(model, place.at)
    place, judged, missing = _judged(model, bare, place, parameters)
    x = _resting(bare, place, parameters)
    found, bears = supported(model, place, x, held)
    if found.unbalanced > BALANCED:
        raise NotConverged(
            f"{model.name!r} came to rest where contacts and joints leave {found.unbalanced:.2g} of what acts "
            f"unbalanced; begin nearer to where it rests",
            {},
        )
    return _told(x, place, found, judged, missing, (held, bears))


def _place(model: Model, begin: Assembly, parameters: Mapping[str, float] | None) -> Place:
    """Where it comes to rest: where it is described, if what holds it bears that; else by steps of impulses.

    Raises
    ------
    NotConverged
        If it does not rest there, and has parts that steps by impulses do not know.
    """
    place = closed(model, begin)
    bare, held = open_copy(model, place.at)
    left = supported(model, place, _resting(bare, place, parameters), held)[0].unbalanced
    if left <= BALANCED:
        return place
    if unknown := smooth_only(model):
        raise NotConverged(
            f"{model.name!r} does not rest where it is described: {left:.2g} of what acts is left unbalanced. The way "
            f"to where it rests is found by steps of impulses, which do not know "
            f"{', '.join(e.title for e in unknown)}: "
            f"describe it where it rests, or simulate it with damping",
            {},
        )
    return closed(model, settled(model, begin, parameters))


def _resting(bare: Model, place: Place, parameters: Mapping[str, float] | None) -> Rest:
    """The model with what holds as constraints, at rest at a place."""
    c = compiled(bare, parameters=parameters)
    q, _ = c.take(place.at.compiled, place.at.t, place.at.q, 0.0 * place.at.v)
    return Rest(c, place.at.t, q, np.zeros(len(c.structure.rows)))


def refuse_bulk(model: Model, analysis: str) -> None:
    """Refuse many bodies, and events."""
    if model.events:
        without = ", ".join(f"{e.name!r}: None" for e in model.events)
        raise ModelError(
            f"{analysis} knows no events, and {model.name!r} has {', '.join(e.title for e in model.events)}; simulate "
            f"does. Without them: m.changed({{{without}}}).{analysis}(...)"
        )
    if model.bulk:
        names = ", ".join(e.title for e in model.bulk)
        raise ModelError(f"{analysis} does not know {names}; describe what touches as single bodies, or simulate it")


def place_of(model: Model, t: float, parameters: Mapping[str, float] | None) -> Place:
    """What touches as described."""
    return closed(model, assemble(model, t=t, parameters=parameters))


def _judged(
    model: Model, bare: Model, place: Place, parameters: Mapping[str, float] | None
) -> tuple[Place, Equilibrium | None, str]:
    """The place put right to rounding by the closed contacts as joints, and what these say of its stability."""
    joined, missing = joined_copy(bare, place)
    if missing:
        return place, None, told(missing)
    c = compiled(joined, parameters=parameters)
    q, _ = c.take(place.at.compiled, place.at.t, place.at.q, 0.0 * place.at.v)
    start = Rest(c, place.at.t, q, np.zeros(len(c.structure.rows)))
    try:
        arrived = newton(start)
        if arrived is None:
            return place, None, "Newton's method does not settle with the closed contacts as joints"
        far = c.values.length * NEARBY
        own, still = place.at.compiled, np.zeros(c.structure.nv)
        moved = Assembly(own, place.at.t, own.take(c, place.at.t, arrived.q, still)[0], still)
        now = own.moving(moved.t, moved.q, moved.v)
        if max(float(np.abs(now[k].p - b.p).max()) for k, b in place.bodies.items()) > far:
            return place, None, "the balance of forces is elsewhere with the closed contacts as joints"
        again = closed(model, moved)
        if [k.name for k in again.contacts] != [k.name for k in place.contacts]:
            return place, None, "contacts open where forces balance"
        return again, finished(arrived, {}, ""), ""
    except AnalysisError as error:
        return place, None, str(error)


def _told(x: Rest, place: Place, found: Carried, judged: Equilibrium | None, missing: str, held: Held) -> Equilibrium:
    c = x.c
    touches = touching(place, found, x, *held)
    result = snapshot(State.resting(c, x.t, x.q, found.lam))
    result.contacts = as_contacts(place, found.force)
    notes = _notes(touches, found, missing)
    kind = judged.stability if judged else UNJUDGED
    if judged and any(k.state in (LIMIT, PARTING) for k in touches) and kind != "unstable":
        kind = MARGINAL
    own = judged or Equilibrium(
        t=x.t, stability=UNJUDGED, freedoms=(), stiffness=np.zeros((0, 0)), weakest={}, least=float("nan"),
        unbalanced=0.0, method="", parameters={}, result=result, assembly=None,
    )  # fmt: skip
    return replace(
        own,
        stability=kind,
        unbalanced=found.unbalanced,
        method="steps of impulses" + (", then Newton's method" if judged else ""),
        parameters=dict(c.parameters),
        result=result,
        assembly=Assembly(c, x.t, x.q, np.zeros(len(x.scale))),
        touching=touches,
        notes=notes,
    )


def touching(place: Place, found: Carried, x: Rest, held: Holds, bears: Mapping[str, float]) -> tuple[Touch, ...]:
    """What every closed contact does, and all else that holds."""
    out = []
    lam = {name: float(found.lam[x.c.structure.slices[name]].sum()) for name in held.signs}
    stops = {name: sign * lam[name] for name, sign in held.signs.items() if name not in bears}
    most = max([*found.force[:, 0].tolist(), 0.0])
    for c, f in zip(place.contacts, found.force, strict=True):
        slides = float(np.hypot(f[1], f[2]))
        most_of_it = c.friction * float(f[0])
        used = slides / most_of_it if most_of_it > 0.0 else 0.0
        state = PARTING if f[0] <= NOTHING * most else SMOOTH if c.friction == 0.0 else STICKS
        state = LIMIT if state == STICKS and used >= 1.0 - NEAR else state
        out.append(Touch(c.name, state, float(f[0]), slides, used, c.gap))
    for name, bound in bears.items():
        used = abs(lam[name]) / bound if bound > 0.0 else 0.0
        out.append(Touch(name, LIMIT if used >= 1.0 - NEAR else STICKS, bound, abs(lam[name]), used))
    for name, effort in stops.items():
        out.append(Touch(name, PARTING if effort <= NOTHING * max(map(abs, stops.values())) else SMOOTH, effort))
    return tuple(out)


def _notes(touches: tuple[Touch, ...], found: Carried, missing: str) -> tuple[str, ...]:
    """What has to be said besides."""
    out = []
    for state, rule in (
        (PARTING, "nothing is carried there; what is said holds while it stays closed"),
        (LIMIT, "any more load along it would make it slide"),
    ):
        names = [k.name for k in touches if k.state == state]
        if names:
            out.append(f"{', '.join(names)} {state}: {rule}")
    if any(k.state in (STICKS, LIMIT) for k in touches):
        out.append(
            "friction holds it: positions nearby are equilibria too, and this is where it comes to rest from where it "
            "begins; it is judged while its contacts stick"
        )
    if not found.unique:
        out.append("contacts and joints share the load in more than one way: their forces are one of these")
    if missing:
        out.append(f"stability is not judged: {missing}")
    return tuple(out)
