"""The scenes of contact that engines are compared on, as numbers: every engine's model is built from these.

S1: ten cubes of 1 m and 1000 kg on each other. S2: N bodies dropped into a box. S5: ten cubes of 1 kg under one of
1000 kg (or 1e5). Steps of 5 ms, gravity 9.81 m/s^2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

H, G, RADIUS, DENSITY = 5e-3, 9.81, 0.1, 1000.0
PILE_FRICTION, STACK_FRICTION = 0.3, 0.5
BOX = (0.08, 0.07, 0.06)  # half edges of boxes in piles
CAPSULE = (0.06, 0.05)  # radius, half length
CYLINDER = (0.07, 0.06)
KINDS = ("sphere", "box", "capsule", "cylinder")


@dataclass(frozen=True)
class Pile:
    """Bodies above a box without a lid.

    Attributes
    ----------
    kind : (n,) of str
    position : (n, 3) [m]
    quaternion : (n, 4)
    half : float [m]
        Half the side of the box, whose floor is z = 0.
    """

    kind: np.ndarray
    position: np.ndarray
    quaternion: np.ndarray
    half: float


def pile(what: str, count: int) -> Pile:
    """A pile to be: ``spheres``, ``boxes`` or ``mixed``, on a jittered grid."""
    per_row = round(count ** (1.0 / 3.0))
    wide = 2.2 * RADIUS if what == "spheres" else 0.26
    half = 0.5 * wide * per_row + 0.01
    rng = np.random.default_rng(0)
    layer, rest = np.divmod(np.arange(count), per_row * per_row)
    row, column = np.divmod(rest, per_row)
    middle = 0.5 * (per_row - 1)
    x = np.stack([(column - middle) * wide, (row - middle) * wide, 0.5 * wide + 0.01 + layer * wide], axis=1)
    if what == "spheres":
        x[:, 2] += 0.01 - 0.5 * wide + RADIUS
    x[:, :2] += rng.uniform(-0.1, 0.1, (count, 2)) * RADIUS
    kind = {
        "spheres": np.full(count, "sphere"),
        "boxes": np.full(count, "box"),
        "mixed": np.array(KINDS)[rng.permutation(count) % 4],
    }[what]
    e = rng.normal(size=(count, 4))
    e /= np.linalg.norm(e, axis=1)[:, None]
    if what == "spheres":
        e[:] = 1.0, 0.0, 0.0, 0.0
    return Pile(kind, x, e, half)


@dataclass(frozen=True)
class Stack:
    """Cubes of 1 m on each other: masses, positions of their centres, and turns about the vertical."""

    mass: np.ndarray
    position: np.ndarray
    yaw: np.ndarray


def stack(mass: list[float], shifted: bool) -> Stack:
    """A stack just touching; or dropped from gaps of 1 mm, shifted by 3 cm and yawed by 3.4 degrees in turn."""
    n = len(mass)
    k = np.arange(n)
    x = np.zeros((n, 3))
    x[:, 2] = 0.5 + k
    yaw = np.zeros(n)
    if shifted:
        x[:, 0] = 0.03 * (-1.0) ** k
        x[:, 2] += 1e-3 * (1 + k)
        yaw = 0.06 * (k % 2)
    return Stack(np.array(mass, float), x, yaw)


STACKS = {"S1": [1000.0] * 10, "S5": [1.0] * 10 + [1000.0], "1e5:1": [1.0] * 10 + [1e5]}


def sphere_mass() -> float:
    """Mass [kg] of a sphere of S2."""
    return DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
