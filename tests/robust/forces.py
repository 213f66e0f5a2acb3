"""A maker for every force of the registry, laws of every kind, drivers that may ask for too much."""

from __future__ import annotations

import flyball as fb

from .dice import Dice, plus
from .joints import coordinates


def law(d: Dice, m: fb.Mechanism, size: float, inputs=()) -> object:
    """A number or an expression of time, inputs, sensors and tables."""
    x = d.pick(["t", *inputs, *(s.name for s in m.sensors if isinstance(s, fb.Sensor)), *("t",)])
    choice = d.whole(0, 6)
    if choice == 0:
        return d.number(-size, size)
    if choice == 1 and m.tables:
        return f"{size:.6g}*{d.pick(m.tables).name}({x})"
    if choice == 2:
        return f"{size:.6g}*where({x} > 0.1, 1, -0.5)"
    if choice == 3:
        return f"-{size:.6g}*tanh({x})"
    if choice == 4:
        return f"{size:.6g}*step5(t, 0.05, 0, 0.2, 1)*cos(3*{x})"
    return f"{size:.6g}*sin({d.number(1, 20):.4g}*{x})"


def driven(d: Dice) -> str:
    """A law for a driver, from gentle to impossible."""
    size, rate = d.size(0.01, 5.0), d.size(0.5, 30.0)
    return d.pick(
        [
            f"{size:.5g}*t",
            f"{size:.5g}*t**2",
            f"{size:.5g}*(1 - cos({rate:.4g}*t))",
            f"{size:.5g}*sin({rate:.4g}*t)",
            f"step5(t, 0.1, 0, 0.4, {size:.5g})",
            f"where(t < 0.2, 0, {size:.5g})",
            f"where(t < 0.2, 0, {size:.5g}*(t - 0.2))",
            f"{size:.5g}/(0.3 - t) - {size:.5g}/0.3",
            f"{size:.5g}*sqrt(0.25 - t) - {size:.5g}/2",
        ]
    )


def stiffness(d: Dice, stiff: bool) -> float:
    return d.size(1e3, 1e8) if stiff else d.size(0.1, 1e3)


def _spring(d: Dice, m: fb.Mechanism, name: str, i: str, j: str, p, stiff: bool):
    length = d.pick([None, None, d.size(0.01, 2.0)])
    force = d.pick([None, None, law(d, m, 5.0, ("length", "rate"))])
    ends = (p, plus(p, d.size(0.01, 1.0), d.direction()))
    return fb.SpringDamper(
        name, i, j, at=ends, stiffness=stiffness(d, stiff), damping=d.pick([0, d.size(0.01, 10)]), length=length,
        force=force,
    )  # fmt: skip


def _bushing(d: Dice, m: fb.Mechanism, name: str, i: str, j: str, p, stiff: bool):
    k = d.pick([stiffness(d, stiff), tuple(stiffness(d, stiff) for _ in p)])
    turning = 0.1 * stiffness(d, stiff)
    damping = d.pick([0.0, 0.3])
    return fb.Bushing(name, i, j, at=p, stiffness=k, torsional_stiffness=turning, damping=damping)


def _rope(d: Dice, m: fb.Mechanism, name: str, i: str, j: str, p, stiff: bool):
    bodies, points = [i, j], [p, plus(p, d.size(0.1, 1.0), d.direction())]
    if d.chance(0.5):
        bodies.append(i)
        points.append(plus(points[-1], d.size(0.1, 1.0), d.direction()))
    length = d.pick([None, d.size(0.1, 2.0)])
    return fb.Rope(name, bodies, at=points, stiffness=stiffness(d, stiff), damping=d.pick([0, 1.0]), length=length)


def _path_spring(d: Dice, m: fb.Mechanism, name: str, i: str, j: str, p, stiff: bool):
    points = [p, plus(p, d.size(0.1, 1.0), d.direction())]
    points.append(plus(points[-1], d.size(0.1, 1.0), d.direction()))
    length = d.pick([None, d.size(0.1, 2.0)])
    force = d.pick([None, law(d, m, 5.0, ("length", "rate"))])
    return fb.PathSpring(name, [i, j, i], at=points, stiffness=stiffness(d, stiff), length=length, force=force)


def _along(kind: str, ending: str, coordinate: bool):
    """A force along a coordinate of some joint, or of some body."""

    def make(d: Dice, m: fb.Mechanism, name: str, i: str, j: str, p, stiff: bool):
        bodies = [f"{b.name}.{a}" for b in m.bodies for a in ("xy" if m.planar else "xyz")]
        found = coordinates(m, ending) + (bodies if coordinate else [])
        if not found:
            return None
        return _MAKE[kind](d, m, name, d.pick(found), stiff)

    return make


def _coordinate_spring(d: Dice, m: fb.Mechanism, name: str, along: str, stiff: bool):
    force = d.pick([None, law(d, m, 3.0, ("value", "rate"))])
    damping = d.pick([0, d.size(0.01, 10)])
    return fb.CoordinateSpring(
        name, along, stiffness=stiffness(d, stiff), damping=damping, rest=d.number(-1, 1), force=force
    )


def _friction(d: Dice, m: fb.Mechanism, name: str, along: str, stiff: bool):
    joint, _, what = along.partition(".")
    static = d.size(0.01, 1.0)
    turning = {"radius": d.size(0.005, 0.1)} if what == "angle" or m[joint].thread else {}
    if m[joint].one_surface and any(isinstance(f, fb.JointFriction) and f.joint == joint for f in m.forces):
        return None
    return fb.JointFriction(
        name, joint, coordinate=what, static=static, kinetic=d.pick([None, 0.7 * static]), preload=d.pick([0, 5.0]),
        stick_speed=d.pick([None, d.size(1e-3, 0.1)]), bending_length=d.pick([None, 0.1]), viscous=d.pick([0, 0.1]), **turning,
    )  # fmt: skip


def _detent(d: Dice, m: fb.Mechanism, name: str, along: str, stiff: bool):
    holds = d.pick([{"holding": d.size(0.1, 5.0)}, {"barrier": d.size(0.01, 1.0)}])
    return fb.Detent(name, along, pitch=d.size(0.05, 0.7), notch=d.number(-1, 1), damping=d.pick([0, 0.1]), **holds)


def _brake(d: Dice, m: fb.Mechanism, name: str, along: str, stiff: bool):
    return fb.Brake(
        name, along, capacity=d.pick([0.0, d.size(0.01, 10.0), "1 + 0.5*sin(3*t)"]), static=d.pick([1, 1.3])
    )


def _clutch(d: Dice, m: fb.Mechanism, name: str, along: str, stiff: bool):
    turning = "angle" in along.partition(".")[2]
    others = [x for x in coordinates(m) if x != along and ("angle" in x.partition(".")[2]) == turning]
    if not others:
        return None
    return fb.Clutch(
        name, along, d.pick(others), capacity=d.pick([0.0, d.size(0.01, 10.0), "2*t"]), static=d.pick([1, 1.2])
    )


_MAKE = {
    "Detent": _detent,
    "CoordinateSpring": _coordinate_spring,
    "Actuator": lambda d, m, name, along, stiff: fb.Actuator(name, along, force=law(d, m, 5.0, ("value", "rate"))),
    "TorsionalSpringDamper": lambda d, m, name, along, stiff: fb.TorsionalSpringDamper(
        name, along.partition(".")[0], stiffness=stiffness(d, stiff), damping=d.pick([0, 0.5]), angle=d.number(-1, 1)
    ),
    "Motor": lambda d, m, name, along, stiff: fb.Motor(
        name, along.partition(".")[0], torque=law(d, m, 3.0, ("angle", "rate"))
    ),
    "JointFriction": _friction,
    "Brake": _brake,
    "Clutch": _clutch,
}


def _point_force(d: Dice, m: fb.Mechanism, name: str, i: str, j: str, p, stiff: bool):
    axes = d.pick(["world", "body"])
    return fb.PointForce(name, j, force=[law(d, m, 5.0) for _ in p], at=p, axes=axes)


def _point_torque(d: Dice, m: fb.Mechanism, name: str, i: str, j: str, p, stiff: bool):
    torque = law(d, m, 2.0) if m.planar else [law(d, m, 2.0) for _ in p]
    return fb.PointTorque(name, j, torque=torque, axes=d.pick(["world", "body"]))


FORCES = {
    "SpringDamper": _spring,
    "Bushing": _bushing,
    "Rope": _rope,
    "PathSpring": _path_spring,
    "PointForce": _point_force,
    "PointTorque": _point_torque,
    "CoordinateSpring": _along("CoordinateSpring", "", True),
    "Detent": _along("Detent", "", True),
    "Actuator": _along("Actuator", "", True),
    "TorsionalSpringDamper": _along("TorsionalSpringDamper", ".angle", False),
    "Motor": _along("Motor", ".angle", False),
    "JointFriction": _along("JointFriction", "", False),
    "Brake": _along("Brake", "", True),
    "Clutch": _along("Clutch", "", False),
}
