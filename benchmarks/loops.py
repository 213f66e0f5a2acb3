"""Spatial loops for 10 s at an energy error of 1e-3 J: flyball and its peers side by side in one run.

Bricard's mechanism, a spatial four-bar with a universal and a spherical joint, a Stewart platform on springs. Before
anything is timed, the energies and accelerations at the start are compared between all engines.
Usage: ``python loops.py [bricard] [four-bar] [stewart]``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from importlib import import_module
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contest
import numpy as np
from contest import Contest, Flyball
from loop_mechanisms import bricard, spatial_four_bar, stewart
from trees import Motion, Tree, energy, flyball_motion, flyball_tree, gap

from mechanisms import simulate

T_END, TARGET, SAMPLES = 10.0, 1e-3, 500
MAKERS: dict[str, Callable[[], Tree]] = {
    "bricard": bricard,
    "four-bar": spatial_four_bar,
    "stewart": stewart,
}
ACCURACY = {"energy_error": "energy error [J]", "end_error": "end error [m]", "gap": "gap [m]"}
FINE = {"rtol": 1e-12, "atol": 1e-14}  # of the run whose end the others are compared with
SAME, SOFT = 1e-6, 5e-3  # relative differences of starts that are no difference: in general, for soft constraints
SHORT = 1e-6  # seconds of the runs that tell energies at the start

ENGINES = ("pinocchio", "mujoco", "exudyn_spatial")

# module, setting, first resolution
PEERS = (
    ("pinocchio", "Python RK4", 1000),
    ("pinocchio", "Python RK4, 5/s", 1000),
    ("pinocchio", "SciPy DOP853", 1e-5),
    ("pinocchio", "SciPy DOP853, 20/s", 1e-5),
    ("mujoco", "RK4, stiff", 2000),
    ("mujoco", "RK4, softer (4 steps)", 2000),
    ("exudyn_spatial", "generalised-alpha 0.95", 8000),
    ("exudyn_spatial", "trapezoidal, index 2", 8000),
)


def check_start(tree: Tree, model: Any, coordinates: str, engines: Iterable[str] = ENGINES) -> None:
    """Print how much the engines differ at the start in energy [part of its kinetic and lifted size] and acceleration.

    Raises
    ------
    SystemExit
        If they do not have the same mechanism.
    """
    run = simulate(model, SHORT, outputs=2, coordinates=coordinates)
    views = [run[link.name] for link in tree.links]
    ours = np.array([np.r_[v.acceleration[0], v.angular_acceleration[0]] for v in views])
    ours_energy = energy(tree, flyball_motion(tree, run))[0]
    size = sum(link.mass for link in tree.links) * float(np.linalg.norm(tree.gravity))  # a metre's height
    for name in engines:
        module = import_module(f"peer_{name}")
        motion, _ = module.solve(tree, SHORT, 1, next(iter(module.SETTINGS)), 1)
        in_energy = abs(energy(tree, motion)[0] - ours_energy) / size
        in_motion = float(np.abs(module.start_accelerations(tree) - ours).max() / np.abs(ours).max())
        limit = SOFT if name == "mujoco" else SAME
        found = f"{in_energy:.1e} in energy, {in_motion:.1e} in acceleration"
        print(f"  {tree.name}, {name}: differs at the start by {found}")
        if not (in_energy <= SAME and in_motion <= limit):
            raise SystemExit(f"{tree.name} is another mechanism in {name}")


def compare(name: str, coordinates: str) -> list[dict[str, Any]]:
    """All engines for one mechanism."""
    tree = MAKERS[name]()
    model = flyball_tree(tree)
    check_start(tree, model, coordinates)
    fine = simulate(model, T_END, outputs=2, coordinates=coordinates, **FINE)
    end = flyball_motion(tree, fine).position[-1]

    def accuracy(motion: Motion) -> dict[str, float]:
        if not np.isfinite(motion.position).all() or len(motion.position) < contest.ENOUGH:
            return {"energy_error": float("inf")}
        e = energy(tree, motion)
        off = float(np.abs(motion.position[-1] - end).max())
        return {"energy_error": float(np.abs(e - e[0]).max()), "end_error": off, "gap": gap(tree, motion)}

    one = Contest(name, T_END, accuracy, "energy_error", TARGET, SAMPLES, patience=6.0, per=T_END)
    ours = [Flyball(model, partial(flyball_motion, tree), method, coordinates) for method in ("dop853", "rk45")]
    peers = [contest.peer(n, s, tree, T_END, first) for n, s, first in PEERS]
    return contest.run(one, ours, peers)


def main() -> None:
    """Command line."""
    parser = contest.parser(__doc__)
    parser.add_argument("name", nargs="*", help=", ".join(MAKERS))
    arguments = parser.parse_args()
    rows = []
    for name in arguments.name or MAKERS:
        found = compare(name, arguments.coordinates)
        rows += found
        print(contest.show(found, ACCURACY, "CPU ms per s"), flush=True)
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
