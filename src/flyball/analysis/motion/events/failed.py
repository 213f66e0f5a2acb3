"""What is said where an instant has no answer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ....constraints.modes import FRICTION, LOCK, ONE_WAY, RATCHET, SLIP, STOP
from ....errors import ModelError
from ....model.touch import Touch
from ....numerics.cone.dense.problem import DRIVEN, GRIPS, NOT_HELD
from ....tables.system import G_LAW, G_SHARED
from ..jams import Overlap, Unresolved, bodies, jam
from .bounds import told
from .instant import Instant, Part
from .modes import Decided, elements

ROLES = {
    STOP: "is closed",
    RATCHET: "is latched",
    FRICTION: "has friction",
    ONE_WAY: "goes one way only",
    SLIP: "has friction",
    LOCK: "is locked",
}


def who(n: Instant, parts: list[Part]) -> str:
    """Elements of rows, with the part that they take."""
    seen = dict.fromkeys((n.here.structure.switches[p.switch].element.title, ROLES[n.kind[p.switch]]) for p in parts)
    return " and ".join(f"{title}, which {role}" for title, role in seen)


def guard_names(n: Instant, fired: Iterable[int]) -> list[str]:
    """Whose guards these are: events, elements that hold, those whose laws have corners; each once."""
    out = []
    for g in fired:
        kind, s = int(n.S.guards.kind[g]), int(n.S.guards.of[g])
        if kind == G_LAW:
            out.append(n.here.structure.events[int(g)].title)
            continue
        for k in np.flatnonzero(n.W.modes.shared).tolist() if kind == G_SHARED else [s]:
            e = n.here.structure.switches[k].element
            out.append(n.name(k) if e.category == "events" else e.title)
    return list(dict.fromkeys(out))


def quantity(n: Instant, s: int) -> str:
    """What a switch acts along, as an expression of coordinates; the length of a rope."""
    x = n.here.structure.switches[s]
    if not x.switch.along:
        return "its length"
    if not x.switch.summed:
        return x.switch.along[0]
    weights = x.element.switch_weights(n.here.c.values.numbers[x.element.name], x.switch.label)
    terms = [f"{w:+.6g}*{c}".replace("1*", "", abs(w) == 1.0) for w, c in zip(weights, x.switch.along, strict=True)]
    return " ".join(f"{y[0]} {y[1:]}" for y in terms).removeprefix("+ ")


def beyond(n: Instant, s: int) -> ModelError:
    """A motion that begins past a stop, or against a freewheel."""
    x = n.here.structure.switches[s]
    e, model = x.element, n.here.structure.model
    metric = not x.switch.along or model.unit(x.switch.along[0], e) == "m"
    unit, what = "m" if metric else "rad", quantity(n, s)
    if isinstance(e, Touch):
        return Overlap(
            f"{e.title}: {bodies(e)} overlap at the start by {n.W.modes.lower[s] - n.x[s]:.3g} m; move one of them, "
            f"or give method='impulse', which puts them side by side"
        )
    if n.kind[s] == STOP:
        lower, upper = n.W.modes.lower[s], n.W.modes.upper[s]
        if not np.isfinite(upper):
            rule = f"at least {told(lower, unit)}"
        elif not np.isfinite(lower):
            rule = f"at most {told(upper, unit)}"
        else:
            rule = f"within {told(lower, unit)} and {told(upper, unit)}"
        said = f"{what} is {told(n.x[s], unit)} and must be {rule}"
    else:
        said = f"the rate of {what} is {n.rate[s]:.6g} {unit}/s and must not be negative"
    return ModelError(f"{e.title}: the motion begins beyond it: {said}; change the start or the limit")


def sunk(n: Instant, s: int, past: float) -> Unresolved:
    """What is open is past its bound: no motion of rigid bodies leads there."""
    e = n.here.structure.switches[s].element
    what = f"{bodies(e)} are in each other" if isinstance(e, Touch) else f"{quantity(n, s)} is beyond it"
    return Unresolved(
        f"at t = {n.here.t:.9g} s {e.title}: {what} by {past:.3g} {n.units[s]}: where they met was not seen. Follow "
        f"it more closely (max_step=, a smaller rtol)",
        t=n.here.t,
    )


def endless(n: Instant, recent: Iterable[Sequence[int]], many: int, within: float) -> Unresolved:
    """Events that come ever closer; ``recent``: the guards that fired at the last of them."""
    names = guard_names(n, (g for fired in recent for g in fired))
    return Unresolved(
        f"at t = {n.here.t:.9g} s events follow each other without end ({many} within {within:.2g} s): "
        f"{', '.join(names)}",
        t=n.here.t,
    )


def accumulating(n: Instant, guard: int, many: int, end: float) -> Unresolved:
    """Events of one guard, ``many`` so far, that come ever closer towards the time ``end``."""
    return Unresolved(
        f"at t = {n.here.t:.9g} s {guard_names(n, [guard])[0]} has happened {many} times, ever sooner after the last, "
        f"without end before t = {end:.6g} s",
        t=n.here.t,
    )


def no_impulses(n: Instant, parts: list[Part]) -> Unresolved:
    """Velocities cannot change as all ask."""
    return Unresolved(
        f"at t = {n.here.t:.9g} s no impulses let the velocities fulfil all that is asked of them at once; it is asked "
        f"by {who(n, parts)}. Where a driver moves what a stop or a lock holds, one of them must give way",
        t=n.here.t,
    )


def no_forces(n: Instant, found: Decided) -> Unresolved:
    """Accelerations cannot be as all ask."""
    sliding = [p for p in found.parts if p.rule in (DRIVEN, GRIPS)]
    jammed = [n.here.structure.switches[p.switch].element for p in sliding]
    if found.ended != NOT_HELD and len(jammed) == 1 and hasattr(jammed[0], "joint"):
        return Unresolved(jam(jammed[0], n.here.t, True), t=n.here.t)
    if found.ended == NOT_HELD or not sliding:
        why = "what they hold cannot be held together: one of them must give way"
    else:
        why = (
            f"no loads were found that go with the friction of {' and '.join(elements(n, sliding))}. Either it grows "
            "with the load that it makes itself faster than that can hold it (a jam, or Painleve's paradox): with less "
            "friction, or an elastic stop or joint, there is a solution. Or there is one, and the search ended short "
            "of it"
        )
    return Unresolved(
        f"at t = {n.here.t:.9g} s no forces fulfil all that is asked of them at once; it is asked by "
        f"{who(n, found.parts)}; {why}",
        t=n.here.t,
    )


def no_end(t: float, names: list[str], rounds: int) -> Unresolved:
    """What happens at an instant has no end."""
    return Unresolved(
        f"at t = {t:.9g} s events follow each other without end ({rounds} times at one instant): "
        f"{', '.join(dict.fromkeys(names))}; each undoes what the other did",
        t=t,
    )
