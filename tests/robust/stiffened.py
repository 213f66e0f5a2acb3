"""Stiff springs, mounts and dampers up to 1e9 N/m for a random mechanism."""

from __future__ import annotations

import flyball as fb

from .dice import Dice, plus
from .joints import coordinates

LEAST, MOST = 1e3, 1e9  # N/m


def stiffened(d: Dice, m: fb.Mechanism, case, most: int) -> None:
    """Springs between points, mounts, springs along coordinates; most of what they hold dies out soon."""
    names = ["ground", *(b.name for b in m.bodies)]
    for k in range(d.whole(1, most)):
        i, j = d.random.sample(names, 2)
        i, j = (j, i) if j == "ground" else (i, j)
        p = d.near(m[j].position, 0.3)
        make = d.pick([_spring, _mount, _along])
        case.add(lambda k=k, i=i, j=j, p=p, make=make: make(d, m, f"S{k}", i, j, p))


def constants(d: Dice, m: fb.Mechanism) -> tuple[float, float]:
    """A stiffness, and a damping that is a part of the critical one of a kilogramme, or none at times."""
    k = d.size(LEAST, MOST)
    return k, 0.0 if d.chance(0.1) else 2.0 * d.size(0.02, 10.0) * k**0.5


def _spring(d: Dice, m: fb.Mechanism, name: str, i: str, j: str, p):
    k, c = constants(d, m)
    return fb.SpringDamper(
        name, i, j, at=(p, plus(p, d.size(0.1, 1.0), d.direction())), stiffness=k, damping=c,
    )  # fmt: skip


def _mount(d: Dice, m: fb.Mechanism, name: str, i: str, j: str, p):
    (k, c), (kt, ct) = constants(d, m), constants(d, m)
    return fb.Bushing(
        name, i, j, at=p, stiffness=k, damping=c, torsional_stiffness=1e-2 * kt, torsional_damping=1e-2 * ct
    )


def _along(d: Dice, m: fb.Mechanism, name: str, i: str, j: str, p):
    found = coordinates(m)
    if not found:
        return None
    k, c = constants(d, m)
    size = 1e-2 if "angle" in (along := d.pick(found)) else 1.0
    return fb.CoordinateSpring(name, along, stiffness=size * k, damping=size * c)
