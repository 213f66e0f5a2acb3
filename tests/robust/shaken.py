"""Small mechanisms with what holds at times, under loads that go to and fro: rests are long, steps are wide."""

from __future__ import annotations

import math
from typing import Any

import flyball as fb

from .dice import Dice
from .switching import KINDS

RIGID = ("Limit", "Limit", "Backlash", "OneWay", "Ratchet", "Brake", "JointFriction")


def load(d: Dice, size: float) -> str:
    """A law of time that changes its sign, with a mean; at times it begins, ends or jumps on the way."""
    parts = [f"{d.number(-0.5, 0.5) * size}"]
    for _ in range(d.whole(1, 2)):
        parts.append(f"{d.size(0.3, 1.0) * size}*{d.pick(['sin', 'cos'])}({d.size(1, 40)}*t + {d.number(0, 6)})")
    law = " + ".join(f"({p})" for p in parts)
    a = d.number(0.2, 2.0)
    return d.pick([law, law, f"where(t < {a}, 0, {law})", f"({law})*step(t, {a}, 0, {a + d.size(1e-3, 1)}, 1)"])


def wheel(d: Dice, m: fb.Mechanism, case: Any) -> None:
    """One or two on shafts or rails, driven by motors."""
    for k in range(d.whole(1, 2)):
        p = (float(k), 0.0) if d.planar else (float(k), 0.0, 0.0)
        inertia = 0.2 if d.planar else (0.1, 0.1, 0.2)
        m.add(fb.Body(f"b{k}", mass=d.size(0.3, 3), inertia=inertia, position=p))
        turn = {} if d.planar else {"axis": (0, 0, 1)}
        along = (1, 0) if d.planar else (1, 0, 0)
        if d.chance(0.6):
            m.add(fb.Revolute(f"J{k}", "ground", f"b{k}", at=p, **turn))
            m.add(fb.Motor(f"M{k}", f"J{k}", torque=load(d, 2.0)))
        else:
            m.add(fb.Prismatic(f"J{k}", "ground", f"b{k}", at=p, axis=along))
            m.add(fb.Actuator(f"M{k}", f"J{k}.displacement", force=load(d, 5.0)))
    for k in range(d.whole(1, 2)):
        case.add(lambda k=k: KINDS[d.pick(RIGID)](d, m, f"S{k}"))


def pendulum(d: Dice, m: fb.Mechanism, case: Any) -> None:
    """A chain under gravity, with stops, pushed at its end."""
    n = d.whole(1, 3)
    for k in range(n):
        at, middle = ((k, 0), (k + 0.5, 0)) if d.planar else ((k, 0, 0), (k + 0.5, 0, 0))
        inertia = 1 / 12 if d.planar else (1e-3, 1 / 12, 1 / 12)
        m.add(fb.Body(f"b{k}", mass=1, inertia=inertia, position=middle))
        turn = {} if d.planar else {"axis": d.pick([(0, 1, 0), (0, 1, 0), (0, 0, 1)])}
        m.add(fb.Revolute(f"J{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=at, **turn))
    m.add(fb.PointForce("push", f"b{n - 1}", force=tuple(load(d, 20.0) for _ in range(2 if d.planar else 3))))
    for k in range(d.whole(1, 3)):
        case.add(lambda k=k: KINDS[d.pick(["Limit", "Limit", "JointFriction", "Rope", "Ratchet"])](d, m, f"S{k}"))


def tethered(d: Dice, m: fb.Mechanism, case: Any) -> None:
    """A ball on ropes, thrown and pushed."""
    p = d.vector(0.6)
    inertia = 0.0025 if d.planar else (0.0025,) * 3
    m.add(fb.Body("b0", mass=1, inertia=inertia, position=p, velocity=d.vector(2.0)))
    if d.chance(0.7):
        m.add(fb.PointForce("push", "b0", force=tuple(load(d, 20.0) for _ in p)))
    for k in range(d.whole(1, 3)):
        ends = d.vector(0.5)
        length = math.dist(ends, p) * d.pick([1.0, d.number(1, 2)])
        bounce = d.pick([{}, {"restitution": d.number(0, 1)}, {"stiffness": d.size(1e2, 1e4)}])
        case.add(lambda k=k, ends=ends, length=length, bounce=bounce: fb.Rope(f"r{k}", ["ground", "b0"], at=[ends, p], length=length, **bounce))  # fmt: skip


def landing(d: Dice, m: fb.Mechanism, case: Any) -> None:
    """A ball on a floor, lifted and dropped by a force."""
    m.add(fb.Ground("floor", shape=fb.Plane()))
    up = d.pick([0.0, 0.0, d.number(0, 1)])
    m.add(fb.Body("b0", mass=1, shape=fb.Sphere(radius=0.1), position=(0, 0, 0.1 + up)))
    m.add(fb.PointForce("push", "b0", force=(d.pick(["0", load(d, 5.0)]), 0, load(d, 20.0))))
    m.add(fb.Contact(friction=d.pick([0, 0.3]), restitution=d.pick([0, 0.5])))
    case.options["method"] = "dop853"


def noted(d: Dice, m: fb.Mechanism, case: Any) -> None:
    """An event of a coordinate, only noted."""
    names = [f"{j.name}.angle" for j in m.joints if isinstance(j, fb.Revolute)] or ["b0.x"]
    when = f"{d.pick(names)} - {d.number(0.05, 0.5)}"
    case.add(lambda: fb.Event("note", when, direction=d.pick(["rising", "falling", "either"])))


MAKERS = (wheel, wheel, pendulum, tethered, landing)
