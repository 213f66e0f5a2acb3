"""Random contact scenes: from touch to touch, or in impulse time stepping."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from tests.robust.dice import Dice
from tests.robust.families import Case

import flyball as fb

G = 9.81


def _space(d: Dice, name: str, t_end: float, **options: Any) -> tuple[Case, fb.Mechanism]:
    m = fb.Mechanism(name, planar=d.planar, gravity=(0, -G) if d.planar else (0, 0, -G))
    return Case(m, t_end, options), m


def _steps(step: float) -> fb.Stepping:
    """Solved far more exactly than unless asked, so that other ways agree."""
    return fb.Stepping(step=step, tolerance=1e-9)


def _contact(d: Dice, **more: Any) -> fb.Contact:
    return fb.Contact(**{"friction": d.pick([0.0, 0.3, 0.8]), "restitution": d.pick([0.0, 0.5, 0.9, 1.0])} | more)


def _floor(d: Dice, m: fb.Mechanism, slope: float = 0.0) -> None:
    up = (-math.sin(slope), math.cos(slope)) if d.planar else (-math.sin(slope), 0.0, math.cos(slope))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=up if not d.planar else (*up, 0.0))))


def _ball(d: Dice, m: fb.Mechanism, name: str, r: float, p: Any, **more: Any) -> None:
    mass = d.size(0.2, 5.0)
    inertia = 0.4 * mass * r * r
    m.add(
        fb.Body(
            name,
            mass=mass,
            inertia=inertia if d.planar else (inertia,) * 3,
            shape=fb.Sphere(radius=r),
            position=p,
            **more,
        )
    )


def _box(d: Dice, m: fb.Mechanism, name: str, edges: Any, p: Any, **more: Any) -> None:
    a, b, c = edges
    mass = d.size(0.2, 5.0)
    inertia = (
        mass / 12 * (a * a + b * b)
        if d.planar
        else tuple(mass / 12 * x for x in (b * b + c * c, a * a + c * c, a * a + b * b))
    )
    m.add(fb.Body(name, mass=mass, inertia=inertia, shape=fb.Box(edges=edges), position=p, **more))


def _spin(d: Dice, size: float) -> Any:
    return d.number(-size, size) if d.planar else d.vector(size)


def _over(d: Dice, x: float, h: float) -> tuple[float, ...]:
    return (x, h) if d.planar else (x, d.number(-0.02, 0.02), h)


def dropped(d: Dice) -> Case:
    """Balls on a floor or a slope, next to one another."""
    case, m = _space(d, "dropped", d.pick([0.5, 1.0]))
    _floor(d, m, d.pick([0.0, 0.0, 0.2]))
    for k in range(d.whole(1, 3)):
        r = d.number(0.05, 0.15)
        _ball(
            d,
            m,
            f"b{k}",
            r,
            _over(d, 0.5 * k, r + 0.15 + d.number(0, 0.5)),
            velocity=d.vector(1.0),
            angular_velocity=_spin(d, 8.0),
        )
    m.add(_contact(d))
    return case


def rolling(d: Dice) -> Case:
    """A ball laid on a floor, sliding and spinning: it slides until it rolls."""
    case, m = _space(d, "rolling", 1.0)
    _floor(d, m)
    r = d.number(0.05, 0.2)
    v = d.number(-3, 3)
    spin = d.number(-20, 20)
    p, w = ((0.0, r), spin) if d.planar else ((0.0, 0.0, r), (0.0, -spin, 0.0))
    _ball(d, m, "b", r, p, velocity=(v, 0.0) if d.planar else (v, 0.0, 0.0), angular_velocity=w)
    m.add(fb.Contact(friction=d.pick([0.1, 0.3, 0.6])))
    return case


def bouncing(d: Dice) -> Case:
    """One ball without friction on a floor: known in closed form."""
    case, m = _space(d, "bouncing", 1.0)
    _floor(d, m)
    r = d.number(0.05, 0.2)
    h = r + d.number(0.1, 1.0)
    p = (0.0, h) if d.planar else (0.0, 0.0, h)
    v = (1.0, d.number(-1, 1)) if d.planar else (1.0, 0.0, d.number(-1, 1))
    _ball(d, m, "b", r, p, velocity=v, angular_velocity=_spin(d, 3.0))
    m.add(fb.Contact(friction=0.0, restitution=d.pick([0.5, 0.8, 1.0, 0.3])))
    return case


def colliding(d: Dice) -> Case:
    """Two balls in free flight meet: momentum and restitution."""
    case, m = _space(d, "colliding", 1.0)
    m.gravity = d.pick([(0.0,) * len(m.gravity), m.gravity])
    for k, x in enumerate((-0.5, 0.5)):
        p = (x, d.number(-0.03, 0.03)) if d.planar else (x, d.number(-0.03, 0.03), d.number(-0.03, 0.03))
        v = (-3 * x, 0.0) if d.planar else (-3 * x, 0.0, 0.0)
        _ball(d, m, f"b{k}", d.number(0.05, 0.2), p, velocity=v, angular_velocity=_spin(d, 5.0))
    m.add(_contact(d))
    return case


def boxes(d: Dice) -> Case:
    """A box on a floor, laid, thrown or tilted."""
    case, m = _space(d, "boxes", d.pick([0.3, 0.6]))
    _floor(d, m, d.pick([0.0, 0.1]))
    edges = (d.number(0.1, 0.3), d.number(0.1, 0.3), d.number(0.1, 0.3))
    half = 0.5 * np.linalg.norm(edges)
    lean = {"angle": d.number(-1, 1)} if d.planar else {"orientation": tuple(d.number(-1, 1) for _ in range(3))}
    _box(
        d,
        m,
        "a",
        edges,
        _over(d, 0.0, half + 0.05 + d.number(0, 0.2)),
        velocity=d.vector(1.0),
        angular_velocity=_spin(d, 3.0),
        **lean,
    )
    m.add(_contact(d, restitution=d.pick([0.0, 0.4])))
    if d.chance(0.4):
        r = 0.08
        _ball(d, m, "b", r, _over(d, 0.5, r + 0.1), velocity=d.vector(1.5))
    return case


def sliding(d: Dice) -> Case:
    """A box that slides on a slope, or sticks to it: known in closed form as long as it lies flat."""
    case, m = _space(d, "sliding", 0.6)
    slope = d.number(0.0, 0.6)
    _floor(d, m, slope)
    edges = (0.4, 0.1, 0.4) if d.planar else (0.4, 0.4, 0.1)
    c, s = math.cos(slope), math.sin(slope)
    v = d.pick([0.0, 0.0, d.number(-1, 1)])
    if d.planar:
        p, lean, vel = (-0.05 * s, 0.05 * c), {"angle": slope, "angular_velocity": 0.0}, (v * c, v * s)
    else:
        p, lean, vel = (
            (-0.05 * s, 0.0, 0.05 * c),
            {"orientation": (0.0, -slope, 0.0), "angular_velocity": (0.0,) * 3},
            (v * c, 0.0, v * s),
        )
    _box(d, m, "a", edges, p, velocity=vel, **lean)
    m.add(fb.Contact(friction=d.number(0.1, 0.8)))
    return case


def piled(d: Dice) -> Case:
    """Several balls and boxes in impulse time stepping."""
    case, m = _space(d, "piled", 0.3, method=_steps(d.pick([1e-3, 2e-3, 5e-3])))
    _floor(d, m)
    for k in range(d.whole(2, 6)):
        size = d.number(0.1, 0.2)
        p = _over(d, d.number(-0.1, 0.1), 0.2 + 0.4 * k)
        if d.chance(0.5):
            _ball(d, m, f"b{k}", size / 2, p, velocity=d.vector(0.5), angular_velocity=_spin(d, 2.0))
        else:
            _box(d, m, f"b{k}", (size, 1.3 * size, 0.8 * size), p, velocity=d.vector(0.5))
    m.add(_contact(d))
    return case


def capsules(d: Dice) -> Case:
    """A capsule on a floor, with a ball."""
    case, m = _space(d, "capsules", 0.5)
    _floor(d, m)
    r, length = d.number(0.04, 0.1), d.number(0.1, 0.4)
    mass = d.size(0.3, 3)
    a, b = 0.5 * mass * r * r, mass * (length + 2 * r) ** 2 / 12
    lean = {"angle": d.number(-3, 3)} if d.planar else {"orientation": tuple(d.number(-1, 1) for _ in range(3))}
    flat = {"orientation": (0.0, math.pi / 2, 0.0)} if d.planar else {}  # its axis in the plane, along x
    m.add(
        fb.Body(
            "c",
            mass=mass,
            inertia=b if d.planar else (b, b, a),
            shape=fb.Capsule(radius=r, length=length, **flat),
            position=_over(d, 0.0, length + r + 0.1),
            velocity=d.vector(1.0),
            angular_velocity=_spin(d, 3),
            **lean,
        )
    )
    m.add(_contact(d, restitution=d.pick([0.0, 0.5])))
    return case


def jointed(d: Dice) -> Case:
    """A pendulum that meets a floor, or a ball."""
    case, m = _space(d, "jointed", 0.6)
    _floor(d, m)
    h = d.number(0.4, 0.8)
    axis = {} if d.planar else {"axis": (0, 1, 0)}
    top = (0.0, h) if d.planar else (0.0, 0.0, h)
    a = d.number(-1.2, -0.2)
    length = h + d.number(-0.05, 0.1)
    tip = (
        (length * math.cos(a), h + length * math.sin(a))
        if d.planar
        else (length * math.cos(a), 0.0, h + length * math.sin(a))
    )
    r = 0.05
    _ball(d, m, "bob", r, tip)
    m.add(fb.Revolute("J", "ground", "bob", at=top, **axis))
    if d.chance(0.5):
        _ball(
            d,
            m,
            "b",
            0.08,
            (d.number(-0.3, 0.2), 0.08 + d.number(0, 0.1))
            if d.planar
            else (d.number(-0.3, 0.2), 0.0, 0.08 + d.number(0, 0.1)),
        )
    m.add(_contact(d))
    if d.chance(0.4):
        m.add(fb.TorsionalSpringDamper("T", "J", stiffness=2.0, damping=d.pick([0.0, 0.1])))
    return case


def soft(d: Dice) -> Case:
    """Contacts that give way, in impulse time stepping."""
    case, m = _space(d, "soft", 0.4, method=_steps(2e-4))
    _floor(d, m)
    r = 0.1
    for k in range(d.whole(1, 2)):
        _ball(d, m, f"b{k}", r, _over(d, 0.3 * k, r + 0.1 + 0.1 * k), velocity=d.vector(0.5))
    laws = (
        {"law": "linear", "stiffness": d.size(1e3, 1e4), "damping": d.pick([0.0, 2.0])},
        {"law": "hertz", "stiffness": d.size(1e4, 1e5)},
        {"law": "hunt-crossley", "stiffness": d.size(1e4, 1e5), "dissipation": 0.2},
    )
    law = d.pick(laws)
    m.add(fb.Contact(friction=d.pick([0.0, 0.3]), **law))
    return case


def slowed(d: Dice) -> Case:
    """A ball that rolls or spins against rolling and spinning friction, in steps: known in closed form."""
    d.planar = False
    case, m = _space(d, "slowed", 1.0, method=_steps(1e-3))
    _floor(d, m)
    r = d.number(0.05, 0.2)
    v = d.number(0.2, 2.0) if d.chance(0.7) else 0.0
    spin = 0.0 if v else d.number(1.0, 9.0)
    _ball(d, m, "b", r, (0.0, 0.0, r), velocity=(v, 0.0, 0.0), angular_velocity=(0.0, v / r, spin))
    m.add(
        fb.Contact(
            friction=0.8,
            rolling_friction=d.size(1e-4, 2e-2) if v else 0.0,
            spinning_friction=0.0 if v else d.size(1e-4, 1e-2),
        )
    )
    return case


def carried(d: Dice) -> Case:
    """A box laid on a belt, in steps: it slides until it goes with the belt."""
    d.planar = False
    case, m = _space(d, "carried", 1.0, method=_steps(1e-3))
    m.add(fb.Material("belt", friction=d.number(0.1, 0.6), surface_velocity=(d.number(-2, 2), d.number(-1, 1), 0.0)))
    m.add(fb.Material("dry", friction=1.0), fb.Ground("floor", shape=fb.Plane(), material="belt"))
    _box(
        d,
        m,
        "a",
        (0.4, 0.4, 0.02),
        (0.0, 0.0, 0.01),
        velocity=(0.0, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, 0.0),
        material="dry",
    )
    m.add(fb.Contact())
    return case


def planked(d: Dice) -> Case:
    """A plank on a hinge with a spring, on which a ball falls."""
    case, m = _space(d, "planked", 0.6)
    axis = {} if d.planar else {"axis": (0, 1, 0)}
    edges = (1.2, 0.05, 0.4) if d.planar else (1.2, 0.4, 0.05)
    _box(d, m, "plank", edges, (0.0, 0.0) if d.planar else (0.0, 0.0, 0.0))
    m.add(fb.Revolute("J", "ground", "plank", at=(0.0, 0.0) if d.planar else (0.0, 0.0, 0.0), **axis))
    m.add(fb.TorsionalSpringDamper("T", "J", stiffness=d.size(5, 100), damping=d.pick([0.0, 0.3])))
    for k in range(d.whole(1, 2)):
        r = d.number(0.04, 0.1)
        x = d.number(0.15, 0.5) * (-1) ** k
        _ball(
            d,
            m,
            f"b{k}",
            r,
            _over(d, x, 0.025 + r + d.number(0.01, 0.3)),
            velocity=d.vector(0.3),
            angular_velocity=_spin(d, 3.0),
        )
    m.add(_contact(d))
    return case


def walled(d: Dice) -> Case:
    """A ball, or two, between a floor and walls."""
    case, m = _space(d, "walled", 1.0)
    _floor(d, m)
    for name, side in (("left", -1.0), ("right", 1.0)):
        p = (side * 0.6, 0.0) if d.planar else (side * 0.6, 0.0, 0.0)
        m.add(fb.Ground(name, shape=fb.Plane(normal=(-side, 0.0, 0.0)), position=p))
    for k in range(d.whole(1, 2)):
        r = d.number(0.05, 0.12)
        _ball(
            d,
            m,
            f"b{k}",
            r,
            _over(d, 0.6 * k - 0.3, r + d.number(0.02, 0.5)),
            velocity=d.vector(3.0),
            angular_velocity=_spin(d, 5.0),
        )
    m.add(_contact(d))
    return case


def thrown(d: Dice) -> Case:
    """A box and a ball in free flight meet: momenta."""
    case, m = _space(d, "thrown", 0.8)
    m.gravity = (0.0,) * len(m.gravity)
    lean = {"angle": d.number(-1, 1)} if d.planar else {"orientation": tuple(d.number(-1, 1) for _ in range(3))}
    edges = tuple(d.number(0.2, 0.5) for _ in range(3))
    origin = (0.0, 0.0) if d.planar else (0.0, 0.0, 0.0)
    _box(d, m, "a", edges, origin, velocity=d.vector(0.2), angular_velocity=_spin(d, 2.0), **lean)
    away = (0.8, *(d.number(-0.1, 0.1) for _ in range(len(origin) - 1)))
    _ball(
        d,
        m,
        "b",
        d.number(0.05, 0.15),
        away,
        velocity=(-2.0, *(0.0,) * (len(origin) - 1)),
        angular_velocity=_spin(d, 5.0),
    )
    m.add(_contact(d))
    return case


SCENES = {
    f.__name__: f
    for f in (
        dropped,
        rolling,
        bouncing,
        colliding,
        boxes,
        sliding,
        piled,
        capsules,
        jointed,
        soft,
        slowed,
        carried,
        planked,
        walled,
        thrown,
    )
}


def made(family: str, seed: int) -> Case:
    """The scene of a family and a seed: planar for even seeds; one in three in impulse time stepping."""
    d = Dice(f"{family} {seed}", planar=seed % 2 == 0)
    case = SCENES[family](d)
    if "method" not in case.options and seed % 3 == 2:
        case.options["method"] = _steps(d.pick([1e-3, 2e-3]))
    return case
