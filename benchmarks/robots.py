"""Robots with PD torques at their joints, as numbers: a delta robot, a planar 3-RRR robot, a humanoid.

Sizes are of common machines, chosen round: the delta robot reaches 0.6 m, the 3-RRR robot lies on a table, the humanoid
weighs 73 kg and has 32 freedoms: its trunk's six, and 26 hinges.
"""

from __future__ import annotations

import numpy as np
from loop_mechanisms import DOWN, X, Y, Z, bar
from trees import Array, Axis, Cut, Link, Motor, Tree

from mechanisms import GROUND, Planar

BASE, ARM, ROD, PLATE, SPREAD = 0.2, 0.24, 0.6, 0.05, 0.04  # of the delta robot [m]; SPREAD: half the rods' distance
ARM_MASS, ROD_MASS, PLATE_MASS = 0.8, 0.15, 1.2
DELTA_MOTORS = ((60.0, 2.3, 0.3, 6.3), (60.0, 2.3, -0.15, 5.2), (60.0, 2.3, 0.25, 7.4))
FREE = tuple(("slide", e) for e in (X, Y, Z)) + tuple(("hinge", e) for e in (Z, Y, X))

PIVOTS, CORNERS, LEG = 0.5, 0.12, 0.3  # of the 3-RRR robot: radii of base and platform, both links of a leg [m]
TABLE_MOTORS = ((0, 150.0, 7.0, 0.15, 5.0), (3, 150.0, 7.0, -0.12, 6.0), (6, 150.0, 7.0, 0.1, 4.0))


def free(at: Array) -> tuple[Axis, ...]:
    """Six freedoms."""
    return tuple(Axis(kind, at, e) for kind, e in FREE)


def delta() -> Tree:
    """Three arms turn about level axes; pairs of rods between balls keep the platform parallel to the base.

    The rods hang on the arms by universal joints, so that none spins, and are cut at the platform.
    """
    height = np.sqrt(ROD**2 - (BASE + ARM - PLATE) ** 2)
    moments = PLATE_MASS * np.array([0.06**2 / 4, 0.06**2 / 4, 0.06**2 / 2])
    centre = -height * Z
    links = [Link("platform", PLATE_MASS, np.diag(moments), centre, GROUND, free(centre))]
    cuts, motors, n = [], [], 6
    for k, motor in enumerate(DELTA_MOTORS):
        out = np.array([np.cos(2 * np.pi * k / 3), np.sin(2 * np.pi * k / 3), 0.0])
        along = np.cross(Z, out)
        shoulder, elbow, wrist = BASE * out, (BASE + ARM) * out, PLATE * out + centre
        arm = len(links)
        across = ARM_MASS * ARM**2 / 12
        hinge = (Axis("hinge", shoulder, along),)
        links.append(bar(f"arm {k}", shoulder, elbow, ARM_MASS, across, 0.02 * across, GROUND, hinge))
        motors.append(Motor(n, *motor))
        n += 1
        for side in (-1.0, 1.0):
            a, b = elbow + side * SPREAD * along, wrist + side * SPREAD * along
            second = np.cross(along, b - a) / np.linalg.norm(b - a)
            axes = (Axis("hinge", a, along), Axis("hinge", a, second))
            across = ROD_MASS * ROD**2 / 12
            name = f"rod {k}{'ab'[side > 0]}"
            links.append(bar(name, a, b, ROD_MASS, across, 1e-3 * across, arm, axes))
            cuts.append(Cut(len(links) - 1, 0, b))
            n += 2
    return Tree("delta", DOWN, tuple(links), tuple(cuts), np.zeros(n), motors=tuple(motors))


def table_robot() -> Planar:
    """3-RRR: a platform on three legs of two links; motors turn the first ones."""
    masses, starts, hinges = [], [], []
    for k in range(3):
        out = np.array([np.cos(2 * np.pi * k / 3), np.sin(2 * np.pi * k / 3)])
        pivot, corner = PIVOTS * out, CORNERS * out
        half = (PIVOTS - CORNERS) / 2
        side = np.array([-out[1], out[0]])
        elbow = (pivot + corner) / 2 + np.sqrt(LEG**2 - half**2) * side
        for a, b, mass in ((pivot, elbow, 1.0), (elbow, corner, 0.8)):
            masses.append(mass)
            starts.append((*(a + b) / 2, float(np.arctan2(*(b - a)[::-1]))))
        i = 2 * k
        hinges += [(GROUND, tuple(pivot), i, (-LEG / 2, 0.0)), (i, (LEG / 2, 0.0), i + 1, (-LEG / 2, 0.0))]
        hinges.append((i + 1, (LEG / 2, 0.0), 6, tuple(corner)))
    mass = np.array([*masses, 1.5])
    inertia = np.r_[mass[:6] * LEG**2 / 12, 1.5 * CORNERS**2 / 2]
    start = np.array([*starts, (0.0, 0.0, 0.0)])
    return Planar("3-RRR", mass, inertia, start, np.zeros((7, 3)), tuple(hinges), 0.0, motors=TABLE_MOTORS)


# name, mass, from and to (the joint is at from), side of a square section, axis, stiffness, damping, pose
LEG_LINKS = (
    ("hip turn", 1.2, (0, 0.1, 0.92), (0, 0.1, 0.86), 0.09, Z, 20, 1.2, 0.1),
    ("hip roll", 1.2, (0, 0.1, 0.86), (0, 0.1, 0.84), 0.09, X, 150, 15, 0.15),
    ("thigh", 7.0, (0, 0.1, 0.84), (0, 0.1, 0.46), 0.11, Y, 150, 15, -0.5),
    ("shank", 3.5, (0, 0.1, 0.46), (0, 0.1, 0.10), 0.08, Y, 60, 5, 0.9),
    ("ankle", 0.6, (0, 0.1, 0.10), (0, 0.1, 0.06), 0.07, Y, 6, 0.2, -0.4),
    ("foot", 1.1, (-0.06, 0.1, 0.04), (0.18, 0.1, 0.04), 0.06, X, 0.4, 0.02, -0.1),
)
ARM_LINKS = (
    ("shoulder swing", 0.8, (0, 0.2, 1.40), (0, 0.22, 1.40), 0.08, Y, 40, 3, 0.4),
    ("shoulder roll", 0.8, (0, 0.22, 1.40), (0, 0.24, 1.38), 0.08, X, 40, 3, 0.2),
    ("upper arm", 2.0, (0, 0.24, 1.36), (0, 0.24, 1.10), 0.07, Z, 1.5, 0.05, 0.3),
    ("forearm", 1.3, (0, 0.24, 1.10), (0, 0.24, 0.86), 0.06, Y, 12, 0.8, -0.8),
    ("wrist", 0.3, (0, 0.24, 0.86), (0, 0.24, 0.84), 0.05, Z, 0.1, 0.003, 0.2),
    ("hand", 0.5, (0, 0.24, 0.84), (0, 0.24, 0.72), 0.06, X, 1.0, 0.04, 0.3),
)
NECK_LINKS = (
    ("neck", 0.6, (0, 0, 1.46), (0, 0, 1.54), 0.08, Z, 6, 0.3, 0.4),
    ("head", 4.4, (0.02, 0, 1.54), (0.02, 0, 1.74), 0.16, Y, 20, 1.2, 0.2),
)
TRUNK, TRUNK_SIZE, TRUNK_MASS = np.array([0.0, 0.0, 1.18]), (0.2, 0.32, 0.52), 35.0
THROWN = (0.5, 0.0, 3.0, 0.8, 1.2, 0.3)  # velocity of the trunk, and its turning about z, y, x, at the start
FALL = 2.0  # seconds that it is followed


def humanoid() -> Tree:
    """Thrown up and turning, its joints held to a pose by PD torques: no joint is at rest for the two seconds."""
    J = TRUNK_MASS / 12 * np.diag([sum(s * s for s in TRUNK_SIZE) - s * s for s in TRUNK_SIZE])
    links = [Link("trunk", TRUNK_MASS, J, TRUNK, GROUND, free(TRUNK))]
    for chain, side in ((LEG_LINKS, 1), (LEG_LINKS, -1), (ARM_LINKS, 1), (ARM_LINKS, -1), (NECK_LINKS, 0)):
        parent = 0
        for name, mass, a, b, size, axis, stiffness, damping, pose in chain:
            mirror = np.array([1.0, side or 1.0, 1.0])
            a, b = mirror * a, mirror * b
            across, along = mass * (size**2 + (b - a) @ (b - a)) / 12, mass * size**2 / 6
            turn = pose * (1.0 if side >= 0 or axis is Y else -1.0)
            held = (Axis("hinge", a, axis, float(stiffness), turn, float(damping)),)
            links.append(bar(f"{name} {'LMR'[1 - side]}", a, b, mass, across, along, parent, held))
            parent = len(links) - 1
    rates = np.r_[THROWN, np.zeros(26)]
    return Tree("humanoid", DOWN, tuple(links), (), rates)
