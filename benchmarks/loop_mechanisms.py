"""Spatial mechanisms with loops, as trees with cuts.

Sources
-------
Bricard's mechanism: problem A04 of the IFToMM library of computational benchmark problems (Gonzalez et al., 2006),
here with z up: its (x, y, z) are (x, z, -y). Five square rods of 1 m, 0.1 m and 1 kg, let go from rest.
The others are flyball's examples, the Stewart platform with springs in place of its drivers.
"""

from __future__ import annotations

import numpy as np
from trees import Array, Axis, Cut, Link, Tree, closed

from mechanisms import GRAVITY, GROUND

DOWN = np.array([0.0, 0.0, -GRAVITY])
X, Y, Z = np.eye(3)
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 0, -1), (1, -1, -1), (0, -1, -1), (0, -1, 0)], float)
HINGES = (Z, Y, X, Z, Y, X)  # axis through each corner
ROD = (1.0**2 + 0.1**2) / 12.0, 0.1**2 / 6.0  # moments of inertia across and along a square rod of 1 kg
SPEED = 12.0  # of the spatial four-bar's crank at the start [rad/s]


def bar(name: str, a: Array, b: Array, mass: float, across: float, along: float, parent: int, axes: tuple) -> Link:
    """A straight symmetric link from a to b, its centre in the middle."""
    d = (b - a) / np.linalg.norm(b - a)
    inertia = across * np.eye(3) + (along - across) * np.outer(d, d)
    return Link(name, mass, inertia, (a + b) / 2, parent, axes)


def bricard() -> Tree:
    """Rods along the edges of a cube, six hinges; cut at the fourth, so that two chains of three and two hang."""
    links = []
    for number, end in ((0, 1), (1, 2), (2, 3), (5, 4), (4, 3)):
        rod = number if end > number else number - 1
        parent = GROUND if number in (0, 5) else len(links) - 1
        axes = (Axis("hinge", CORNERS[number], HINGES[number]),)
        links.append(bar(f"rod {rod + 1}", CORNERS[number], CORNERS[end], 1.0, *ROD, parent, axes))
    cuts = (Cut(2, 4, CORNERS[3], HINGES[3]),)
    return Tree("Bricard", DOWN, tuple(links), cuts, np.zeros(5), redundant=True)


def spatial_four_bar() -> Tree:
    """Revolute, spherical, universal, revolute: a crank about z, a rocker about x; cut at the ball."""
    ball, cross, foot = np.array([0.15, 0, 0]), np.array([0.2, 0.5, 0.35]), np.array([0.2, 0.5, 0.0])
    first = np.array([0, -0.35, 0.5]) / np.hypot(0.35, 0.5)  # square to the coupler; the other lies in the rocker
    crank = bar("crank", 0 * X, ball, 0.4, 7.5e-4, 1e-5, GROUND, (Axis("hinge", 0 * X, Z),))
    rocker = bar("rocker", foot, cross, 0.6, 0.0062, 3e-5, GROUND, (Axis("hinge", foot, X),))
    axes = (Axis("hinge", cross, X), Axis("hinge", cross, first))
    coupler = bar("coupler", ball, cross, 0.8, 0.025, 1e-4, 1, axes)
    tree = Tree("spatial four-bar", DOWN, (crank, rocker, coupler), (Cut(0, 2, ball),), np.zeros(4))
    return closed(tree, {0: SPEED})


BASE_RADIUS, PLATE_RADIUS, SPREAD, HEIGHT = 0.9, 0.5, 24.0, 1.0
PLATE_MASS, PLATE_MOMENTS, PLATE_CENTRE = 120.0, (7.0, 8.0, 12.0), 0.12  # cabin and plate
BARREL, PISTON = (8.0, 0.7), (3.0, 0.8)  # mass and length of the rods of a leg
STIFFNESS = 4000.0  # along each leg [N/m]
PUSH = (0.4, -0.3, 0.5, 0.6, 0.4, 0.9)  # velocity of the platform's drawn centre and its turning, at the start


def stewart() -> Tree:
    """A platform on six legs (universal, prismatic, spherical joints) with springs along them; cut at the balls.

    The platform's own six freedoms are three slides and three hinges; it never tips by a right angle.
    """
    centre = (HEIGHT + PLATE_CENTRE) * Z
    axes = tuple(Axis("slide", centre, e) for e in (X, Y, Z)) + tuple(Axis("hinge", centre, e) for e in (Z, Y, X))
    links = [Link("platform", PLATE_MASS, np.diag(PLATE_MOMENTS), centre, GROUND, axes)]
    feet = circle(BASE_RADIUS, 0.0)
    tops = np.roll(circle(PLATE_RADIUS, 60.0), 1, axis=0) + HEIGHT * Z
    cuts = []
    for k, (foot, top) in enumerate(zip(feet, tops, strict=True)):
        links += leg(k, foot, top, 1 + 2 * k)
        cuts.append(Cut(2 + 2 * k, 0, top))
    tree = Tree("Stewart", DOWN, tuple(links), tuple(cuts), np.zeros(24))
    v, w = PUSH[:3], PUSH[3:]
    return closed(tree, dict(enumerate((*v, w[2], w[1], w[0]))))


def circle(radius: float, first: float) -> Array:
    """Six points in pairs on a level circle."""
    turns = np.radians([first + 120 * (k // 2) + (SPREAD / 2 if k % 2 else -SPREAD / 2) for k in range(6)])
    return radius * np.column_stack([np.cos(turns), np.sin(turns), 0 * turns])


def leg(k: int, foot: Array, top: Array, place: int) -> list[Link]:
    """Barrel and piston; the spring carries its share of the platform's weight as drawn."""
    d = (top - foot) / np.linalg.norm(top - foot)
    first = np.cross(Z, d) / np.linalg.norm(np.cross(Z, d))
    second = np.cross(d, first)
    load = PLATE_MASS * GRAVITY / (6.0 * d[2])
    cross = Axis("hinge", foot, first), Axis("hinge", foot, second)
    slide = Axis("slide", (foot + top) / 2, d, STIFFNESS, load / STIFFNESS)
    parts = []
    for name, (mass, length), a, b, parent, axes in (
        (f"barrel {k}", BARREL, foot, foot + BARREL[1] * d, GROUND, cross),
        (f"piston {k}", PISTON, top - PISTON[1] * d, top, place, (slide,)),
    ):
        parts.append(bar(name, a, b, mass, mass * length**2 / 12, 1e-3 * mass, parent, axes))
    return parts
