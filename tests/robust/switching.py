"""Makers of what holds at times: stops, play, latches, ropes, clutches, events. The start may violate or jam them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import flyball as fb

from .dice import Dice, plus
from .joints import coordinates

Maker = Callable[[Dice, fb.Mechanism, str], Any]


def along(d: Dice, m: fb.Mechanism) -> str | None:
    """A coordinate of a joint, or of a body."""
    names = coordinates(m)
    return d.pick(names) if names else None


def _bounce(d: Dice) -> dict[str, float]:
    return d.pick(
        [{}, {"restitution": d.pick([0.0, 0.5, 1.0])}, {"stiffness": d.size(1e2, 1e5), "damping": d.pick([0, 5])}]
    )


def limit(d: Dice, m: fb.Mechanism, name: str):
    """Near zero, where every coordinate begins; at times violated at the start."""
    near, other = d.pick([0.0, 0.02, 0.2, 0.2]), d.number(0.1, 1.0)
    sides = d.pick(
        [{"lower": -near}, {"upper": near}, {"lower": -near, "upper": other}, {"lower": -other, "upper": near}]
    )
    if d.chance(0.05):
        sides = {"lower": 0.1}
    return fb.Limit(name, along(d, m), **sides, **_bounce(d))


def backlash(d: Dice, m: fb.Mechanism, name: str):
    """In one coordinate, or between two of one kind."""
    kind = d.pick([".angle", ".displacement"])
    found = [c for c in coordinates(m) if c.endswith(kind)]
    some = d.random.sample(found, min(len(found), d.whole(1, 2)))
    return fb.Backlash(name, some, gap=d.size(0.01, 0.5), **_bounce(d)) if some else None


def one_way(d: Dice, m: fb.Mechanism, name: str):
    return fb.OneWay(name, along(d, m), direction=d.pick([1, -1]))


def ratchet(d: Dice, m: fb.Mechanism, name: str):
    return fb.Ratchet(
        name, along(d, m), pitch=d.size(0.01, 0.5), direction=d.pick([1, -1]), restitution=d.pick([0, 0.3])
    )


def rope(d: Dice, m: fb.Mechanism, name: str):
    """Taut or slack at the start, over two or three points; rigid or elastic."""
    bodies = d.random.sample(["ground", *(b.name for b in m.bodies)], d.whole(2, min(3, len(m.bodies) + 1)))
    first = m[bodies[0]].position if bodies[0] != "ground" else (0.0,) * (2 if m.planar else 3)
    points = [d.near(m[b].position if b != "ground" else first, 0.4) for b in bodies]
    drawn = sum(math.dist(a, b) for a, b in itertools.pairwise(points))
    length = d.pick([{}, {"length": drawn * d.number(1.0, 1.3)}])
    return fb.Rope(name, bodies=bodies, at=points, **length, **_bounce(d))


def friction(d: Dice, m: fb.Mechanism, name: str):
    c = along(d, m)
    if c is None or not c.endswith((".angle", ".displacement")):
        return None
    joint, _, what = c.partition(".")
    static = d.size(0.01, 1.0)
    turning = {"radius": d.size(0.005, 0.2)} if what == "angle" or m[joint].thread else {}
    if m[joint].one_surface and any(isinstance(f, fb.JointFriction) and f.joint == joint for f in m.forces):
        return None
    return fb.JointFriction(
        name, joint, coordinate=what, static=static, kinetic=d.pick([None, 0.6 * static]), preload=d.pick([0, 5.0]),
        stribeck_speed=d.pick([None, 0.1]), **turning,
    )  # fmt: skip


def brake(d: Dice, m: fb.Mechanism, name: str):
    capacity = d.pick([d.size(0.01, 20.0), "2*abs(sin(9*t))", "where(t > 0.2, 5, 0)", "3*t"])
    return fb.Brake(name, along(d, m), capacity=capacity, static=d.pick([1, 1.5]))


def clutch(d: Dice, m: fb.Mechanism, name: str):
    kind = d.pick([".angle", ".displacement"])
    found = [c for c in coordinates(m) if c.endswith(kind)]
    if len(found) < 2:
        return None
    return fb.Clutch(name, *d.random.sample(found, 2), capacity=d.pick([d.size(0.01, 20.0), "where(t > 0.2, 5, 0)"]))


def event(d: Dice, m: fb.Mechanism, name: str):
    c, body = along(d, m), d.pick(m.bodies).name
    blow = d.vector(2.0)
    do = d.pick([[], [fb.Stop()], [fb.Lock(c)], [fb.Impulse(body, blow)], [fb.Lock(c), fb.Impulse(body, blow)]])
    when = d.pick([f"{c} - {d.number(-0.2, 0.2)}", f"{c}_rate", "t - 0.2", "sin(40*t)"])
    return fb.Event(name, when, direction=d.pick(["rising", "falling", "either"]), do=do, times=d.pick([None, 1, 3]))


KINDS: dict[str, Maker] = {
    "Limit": limit, "Backlash": backlash, "OneWay": one_way, "Ratchet": ratchet, "Rope": rope, "JointFriction": friction,
    "Brake": brake, "Clutch": clutch, "Event": event,
}  # fmt: skip
"""A maker of each; what a mechanism has no place for is None."""


def switched(d: Dice, m: fb.Mechanism, case: Any, kinds: list[str], most: int) -> None:
    """Add one or more of some kinds."""
    for k in range(d.whole(1, most)):
        make = KINDS[d.pick(kinds)]
        case.add(lambda k=k, make=make: make(d, m, f"S{k}"))
    if d.chance(0.4):
        body = d.pick(m.bodies)
        p = plus(body.position, 0.3, d.direction())
        case.add(lambda: fb.SpringDamper("pull", "ground", body.name, at=(p, body.position), stiffness=d.size(1, 100)))
