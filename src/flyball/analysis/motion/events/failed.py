"""What is said where an instant has no answer."""

from __future__ import annotations

from ....constraints.modes import FRICTION, LOCK, ONE_WAY, RATCHET, SLIP, STOP
from ....numerics.cone.dense.problem import DRIVEN, GRIPS, NOT_HELD
from ..jams import Unresolved, jam
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
        return Unresolved(jam(jammed[0], n.here.t), t=n.here.t)
    if found.ended == NOT_HELD or not sliding:
        why = "what they hold cannot be held together: one of them must give way"
    else:
        why = (
            "friction grows with the load that it makes itself faster than that can hold it (a jam, or Painleve's "
            f"paradox), at {' and '.join(elements(n, sliding))}: with less friction, or an elastic stop or joint, "
            "there is a solution"
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
