"""Watt's governor with stiff springs (IFToMM A05), 10 s to 1e-6 m at the end: flyball and its peers in one run.

The end is the sleeve's height s(10 s) from equations in three coordinates, integrated by themselves to 5e-11 m;
published markers up to 3 s agree with them to 1e-6 m. The springs are so stiff and so damped that explicit methods are
bound by stability. Usage: ``python governor.py``.
"""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contest
import numpy as np
from contest import Contest, Flyball, Peer
from trees import Axis, Link, Spring, Tree

from mechanisms import GRAVITY, GROUND, example

T_END, TARGET, SAMPLES = 10.0, 1e-6, 500
END = 0.6196229171  # height of the sleeve [m]
ACCURACY = {"end_error": "end error [m]"}
X, Y, Z = np.eye(3)
SPIN = 2.0 * np.pi  # of the whole at the start [rad/s]
ROD, BALL, DENSITY, STIFFNESS, DAMPING, FREE = 0.3, 5.0, 3000.0, 8e5, 4e4, 0.5

# module, setting, first resolution
PEERS = (
    ("mujoco", "RK4, stiff", 80_000),
    ("exudyn_spatial", "generalised-alpha 0.95", 160_000),
    ("exudyn_spatial", "generalised-alpha 0.7", 160_000),
    ("exudyn_spatial", "trapezoidal, index 2", 80_000),
)


def cuboid(mass: float, x: float, y: float, z: float) -> np.ndarray:
    """Inertia of a box about its centre."""
    return mass / 12.0 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])


def governor() -> Tree:
    """Shaft, sleeve and two arms with balls, all turning with the shaft."""
    shaft = Link("shaft", ROD, cuboid(ROD, 0.01, 0.01, 1.0), 0.5 * Z, GROUND, (Axis("hinge", 0 * Z, Z),))
    mass = DENSITY * 0.1**3
    sleeve = Link("sleeve", mass, cuboid(mass, 0.1, 0.1, 0.1), 0.5 * Z, 0, (Axis("slide", 0.5 * Z, Z),))
    links, springs = [shaft, sleeve], []
    for name, side in (("left", -1.0), ("right", 1.0)):
        hinge = Z + 0.05 * side * X
        along = np.cos(np.pi / 6) * side * X - 0.5 * Z
        centre = hinge + (0.5 * ROD + BALL) / (ROD + BALL) * along
        links.append(Link(name, ROD + BALL, arm_inertia(along, centre - hinge), centre, 0, (Axis("hinge", hinge, Y),)))
        ends = (1, 0.5 * Z + 0.05 * side * X, len(links) - 1, hinge + 0.5 * along)
        springs.append(Spring(*ends, STIFFNESS, DAMPING, FREE))
    gravity = np.array([0.0, 0.0, -GRAVITY])
    return Tree("governor", gravity, tuple(links), (), np.array([SPIN, 0.0, 0.0, 0.0]), tuple(springs))


def arm_inertia(along: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Of a square rod of 1 m and 10 mm with a ball (a point) at its end, about the centre of mass."""
    d = np.outer(along, along)
    rod = ROD * ((1.0 + 1e-4) / 12.0 * (np.eye(3) - d) + 1e-4 / 6.0 * d)

    def away(mass: float, r: np.ndarray) -> np.ndarray:
        return mass * (r @ r * np.eye(3) - np.outer(r, r))

    return rod + away(ROD, 0.5 * along - centre) + away(BALL, along - centre)


def accuracy(height: float) -> dict[str, float]:
    """Error of the sleeve's height at the end."""
    return {"end_error": abs(float(height) - END)}


def solve(name: str, tree: Tree, setting: str, resolution: float, samples: int) -> tuple[Any, float]:
    """The sleeve's height at the end."""
    motion, seconds = import_module(f"peer_{name}").solve(tree, T_END, resolution, setting, samples)
    return (None if motion is None else motion.position[-1, 1, 2]), seconds


def main() -> None:
    """Command line."""
    arguments = contest.parser(__doc__).parse_args()
    one = Contest("governor", T_END, accuracy, "end_error", TARGET, SAMPLES, per=T_END, patience=8.0)
    model, tree = example("governor.toml"), governor()

    def height(run: Any) -> float:
        return run["guide"].displacement[-1]

    ours = [Flyball(model, height, method, arguments.coordinates) for method in ("dop853", "rk45", "radau")]
    peers = [Peer(n.partition("_")[0], s, partial(solve, n, tree, s), first) for n, s, first in PEERS]
    rows = contest.run(one, ours, peers)
    print(contest.show(rows, ACCURACY, "CPU ms per s"))
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
