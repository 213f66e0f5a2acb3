"""A car as numbers, for every engine alike: 32 bodies on rubber mounts of 1e3 to 1e8 N/m, wheels on double wishbones.

The chassis drops on its tyres, which are springs to fixed points of the road; arms, knuckles, tie rods, engine and what
else there is hang in mounts with six stiffnesses. Loops are closed by eight balls. Invented, in the sizes of a saloon.
"""

from __future__ import annotations

import numpy as np
from trees import Array, Axis, Cut, Link, Spring, Tree

from mechanisms import GRAVITY, GROUND

X, Y, Z = np.eye(3)
DAMPING = 0.05  # of what swings on a mount, as part of the critical one
TURNING = 1e-2  # torsional stiffness of a mount by its stiffness [m^2]: it is some 0.1 m long
LOOSE = 1e-5  # the same of mounts that are nearly balls, and of arms about their axis
WHEEL, TRACK, BASE = 0.3, 0.75, 1.3  # radius, half the track and half the wheelbase [m]
TYRE, STRUT = (2e5, 200.0), (3e4, 2e3)  # N/m, N s/m
DROP, ROLL, PITCH = -0.5, 0.4, 0.2  # velocity [m/s] and rates [rad/s] of the chassis at the start


def block(mass: float, size: tuple[float, float, float]) -> Array:
    """Inertia of a box."""
    x, y, z = size
    return mass / 12.0 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])


def mount(at: Array, mass: float, stiffness: float, loose: tuple[bool, bool, bool] = (False, False, False)) -> tuple:
    """Three slides and three hinges with springs and dampers: a rubber mount."""
    c = 2.0 * DAMPING * np.sqrt(stiffness * mass)
    turns = [stiffness * (LOOSE if free else TURNING) for free in loose]
    inertia = mass * TURNING
    slides = [Axis("slide", at, d, stiffness, 0.0, c) for d in (X, Y, Z)]
    hinges = [
        Axis("hinge", at, d, k, 0.0, 2.0 * DAMPING * np.sqrt(k * inertia))
        for d, k in zip((X, Y, Z), turns, strict=True)
    ]
    return (*slides, *hinges)


class Car:
    """Collects links in depth-first order."""

    def __init__(self) -> None:
        self.links: list[Link] = []
        self.cuts: list[Cut] = []
        self.springs: list[Spring] = []

    def add(self, name: str, mass: float, size: tuple, centre: Array, parent: int, axes: tuple) -> int:
        """A link; returns its number."""
        self.links.append(Link(name, mass, block(mass, size), np.asarray(centre, float), parent, axes))
        return len(self.links) - 1

    def on(self, parent: int, name: str, mass: float, size: tuple, centre: tuple, stiffness: float) -> int:
        """A link that hangs in a mount at its centre."""
        at = np.array(centre)
        return self.add(name, mass, size, at, parent, mount(at, mass, stiffness))

    def corner(self, name: str, x: float, side: float, chassis: int, frame: int, steered: int) -> None:
        """Lower arm, knuckle and wheel on a frame; upper arm on the chassis, tie rod on what steers."""
        hub = np.array([x, side * TRACK, WHEEL])
        foot, top = hub - 0.12 * Z - 0.08 * side * Y, hub + 0.2 * Z - 0.1 * side * Y
        inner = np.array([x, side * 0.35, 0.2])
        lower = self.arm(f"lower arm {name}", 4.0, inner, foot, frame, 1e7)
        ball = mount(foot, 10.0, 1e8, (True, True, True))
        knuckle = self.add(f"knuckle {name}", 10.0, (0.1, 0.1, 0.3), hub - 0.05 * side * Y, lower, ball)
        self.add(f"wheel {name}", 20.0, (0.4, 0.2, 0.4), hub, knuckle, (Axis("hinge", hub, Y),))
        self.springs += [
            Spring(GROUND, hub - WHEEL * Z, knuckle, hub, *TYRE, WHEEL),
            Spring(GROUND, hub - side * Y, knuckle, hub, 0.5 * TYRE[0], TYRE[1], 1.0),
            Spring(GROUND, hub - X, knuckle, hub, 0.5 * TYRE[0], TYRE[1], 1.0),
            Spring(chassis, inner + 0.6 * Z, lower, 0.4 * inner + 0.6 * foot, *STRUT, strut(inner, foot)),
        ]
        self.waiting.append((name, top, np.array([x, side * 0.42, 0.45]), hub, knuckle, steered))

    def arm(self, name: str, mass: float, a: Array, b: Array, parent: int, stiffness: float) -> int:
        """A link from a mount at a, which turns about x, to b."""
        size = (0.1, float(np.linalg.norm(b - a)), 0.03)
        return self.add(name, mass, size, 0.5 * (a + b), parent, mount(a, mass, stiffness, (True, False, False)))

    def rod(self, name: str, hub: Array, side: float, knuckle: int, steered: int) -> None:
        """From what steers to the knuckle, ahead of the hub."""
        a, b = np.array([hub[0] + 0.12, side * 0.4, 0.25]), hub + 0.12 * X - 0.1 * side * Y
        size = (0.02, float(np.linalg.norm(b - a)), 0.02)
        rod = self.add(f"rod {name}", 1.0, size, 0.5 * (a + b), steered, mount(a, 1.0, 1e7, (True, True, True)))
        self.cuts.append(Cut(rod, knuckle, b))

    waiting: list


def strut(inner: Array, foot: Array) -> float:
    """Free length of a strut: it carries a quarter of the car as drawn."""
    drawn = float(np.linalg.norm(inner + 0.6 * Z - 0.4 * inner - 0.6 * foot))
    return drawn + 0.08


def car() -> Tree:
    """The whole: 32 links."""
    c = Car()
    axes = tuple(Axis(kind, 0.6 * Z, d) for kind, d in [("slide", X), ("slide", Y), ("slide", Z), ("hinge", Z),
                                                        ("hinge", Y), ("hinge", X)])  # fmt: skip
    chassis = c.add("chassis", 900.0, (4.0, 1.6, 0.8), 0.6 * Z, GROUND, axes)
    engine = c.on(chassis, "engine", 150.0, (0.6, 0.6, 0.6), (1.4, 0.0, 0.6), 3e5)
    c.on(engine, "gearbox", 60.0, (0.4, 0.4, 0.4), (1.4, 0.45, 0.55), 1e8)
    for name, mass, place, stiffness in (
        ("exhaust", 15.0, (-0.5, 0.0, 0.25), 1e3), ("seat", 80.0, (0.2, 0.35, 0.6), 1e4),
        ("battery", 20.0, (1.7, -0.5, 0.7), 1e6), ("tank", 40.0, (-1.2, 0.0, 0.4), 1e5),
        ("dashboard", 15.0, (0.8, 0.0, 0.9), 1e6), ("rack on the roof", 10.0, (0.0, 0.0, 1.4), 1e7),
    ):  # fmt: skip
        c.on(chassis, name, mass, (0.4, 0.3, 0.2), place, stiffness)
    for name, x in (("front", BASE), ("rear", -BASE)):
        c.waiting = []
        frame = c.on(chassis, f"{name} frame", 25.0, (0.5, 0.8, 0.1), (x, 0.0, 0.25), 1e7)
        sides = (("left", 1.0), ("right", -1.0))
        for side, y in sides:
            c.corner(f"{name} {side}", x, y, chassis, frame, frame)
        steered = frame
        if name == "front":
            steered = c.on(frame, "steering", 5.0, (0.1, 0.8, 0.1), (x + 0.12, 0.0, 0.25), 5e7)
        for (_, y), (corner, _, _, hub, knuckle, _) in zip(sides, c.waiting, strict=True):
            c.rod(corner, hub, y, knuckle, steered)
        for corner, top, inner, _, knuckle, _ in c.waiting:
            upper = c.arm(f"upper arm {corner}", 3.0, inner, top, chassis, 5e6)
            c.cuts.append(Cut(upper, knuckle, top))
    rates = np.zeros(sum(len(link.axes) for link in c.links))
    rates[[2, 4, 5]] = DROP, PITCH, ROLL
    return Tree("car", np.array([0.0, 0.0, -GRAVITY]), tuple(c.links), tuple(c.cuts), rates, tuple(c.springs))
