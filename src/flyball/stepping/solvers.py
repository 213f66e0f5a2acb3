"""The solvers of a step's three cone problems, each with rooms of its own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..numerics.cone.choose import SMALL_ISLANDS, Auto
from ..numerics.cone.problem import Choices, Problem, Scratch, State
from ..numerics.cone.registry import ready
from .tables import BOUNCE, POSITIONS, VELOCITIES, Pace


class Solvers(NamedTuple):
    """The rooms of each problem's solver."""

    velocities: Auto
    positions: Auto
    impacts: Auto


def solvers(
    name: str, problems: tuple[Problem, Problem, Problem], X: State, W: Scratch, O: Choices, pace: Pace
) -> Solvers:
    """A solver for velocities, positions and impacts; its addresses go to ``pace.door``."""
    found = [ready(name, P, X, W, O) for P in problems]
    for place, one in zip((VELOCITIES, POSITIONS, BOUNCE), found, strict=True):
        pace.door[place] = one.kernel.address
    return Solvers(*(one.F for one in found))


def told(F: Solvers) -> np.ndarray:
    """What the solver of velocities picked, added up: see ``choose.py``; empty where there was nothing to pick."""
    return F.velocities.told if F.velocities.doors[SMALL_ISLANDS] else np.zeros(0, np.int64)
