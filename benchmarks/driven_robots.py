"""Robots with PD torques: a delta robot, a 3-RRR robot, a humanoid of 32 freedoms; flyball and its peers in one run.

What has to be reached: every mass centre, at 101 times, within 1e-6 of the longest way that one of them goes (that is
what flyball's default tolerance is meant to give), and with ``--coarse`` within 1e-4. The reference is flyball's motion
at rtol 1e-12, which each engine comes nearer to the finer it is run. Before anything is timed, the accelerations at the
start are compared between all engines. Usage: ``python driven_robots.py [delta] [3-RRR] [humanoid] [--coarse]``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contest
import numpy as np
from contest import Contest, Flyball
from loops import check_start
from robots import FALL, delta, humanoid, table_robot
from trees import Motion, Tree, flyball_motion, flyball_tree, planar_motion, planar_tree

from mechanisms import Planar, flyball_planar, simulate
from mechanisms import planar_motion as flyball_planar_motion

FINE, COARSE, LOOKS = 1e-6, 1e-4, 100
MAKERS: dict[str, Callable[[], Tree | Planar]] = {"delta": delta, "3-RRR": table_robot, "humanoid": humanoid}
SECONDS = {"delta": 10.0, "3-RRR": 10.0, "humanoid": FALL}
ACCURACY = {"error": "error / way"}

# module, setting, first resolution
PEERS = (
    ("pinocchio", "Python RK4", 2000),
    ("pinocchio", "SciPy DOP853", 1e-5),
    ("mujoco", "RK4, stiff", 2000),
    ("mujoco", "RK4, softer (4 steps)", 2000),
)
LOOPS_ONLY = ("RK4, softer (4 steps)",)
OTHERS = {
    "delta": (("exudyn_spatial", "generalised-alpha 0.95", 4000), ("exudyn_spatial", "trapezoidal, index 2", 4000)),
    "3-RRR": (("exudyn", "generalised-alpha 0.95", 4000), ("exudyn", "trapezoidal, index 2", 4000)),
    "humanoid": (("exudyn_tree", "RK44", 2000), ("exudyn_tree", "RK67", 1000), ("drake", "RK3, error control", 1e-5)),
}


def looked_at(name: str, motion: Any, tree: Tree, given: Tree | Planar) -> np.ndarray:
    """Positions of the mass centres at the times that are judged, (LOOKS + 1, bodies, 2 or 3)."""
    if isinstance(given, Planar):
        q = planar_motion(given, tree, motion)[0] if isinstance(motion, Motion) else motion[0]
        p = q[:, :, :2]
    else:
        p = motion.position
    every = (len(p) - 1) // LOOKS
    if every * LOOKS != len(p) - 1:
        raise ValueError(f"{name}: {len(p)} times are no multiple of {LOOKS}")
    return p[::every]


def compare(name: str, target: float, coordinates: str) -> list[dict[str, Any]]:
    """All engines for one robot."""
    given, t_end = MAKERS[name](), SECONDS[name]
    planar = isinstance(given, Planar)
    tree = planar_tree(given) if planar else given
    model = flyball_planar(given) if planar else flyball_tree(given)
    motion = partial(flyball_planar_motion, given) if planar else partial(flyball_motion, tree)
    if not planar:
        check_start(tree, model, coordinates, dict.fromkeys(module for module, *_ in (*PEERS, *OTHERS[name])))
    fine = looked_at(name, motion(simulate(model, t_end, rtol=1e-12, coordinates=coordinates)), tree, given)
    way = float(np.linalg.norm(fine - fine[0], axis=2).max())

    def accuracy(found: Any) -> dict[str, float]:
        p = looked_at(name, found, tree, given)
        if p.shape != fine.shape or not np.isfinite(p).all():
            return {"error": float("inf")}
        return {"error": float(np.abs(p - fine).max()) / way}

    case = f"{name}, {target:.0e}"
    one = Contest(case, t_end, accuracy, "error", target, patience=6.0, per=t_end)
    ours = [Flyball(model, motion, method, coordinates) for method in ("dop853", "rk45")]
    peers = []
    for module, setting, first in (*PEERS, *OTHERS[name]):
        if tree.cuts or setting not in LOOPS_ONLY:
            taken = given if module == "exudyn" else tree
            peers.append(contest.peer(module, setting, taken, t_end, first, LOOKS))
    return contest.run(one, ours, peers)


def main() -> None:
    """Command line."""
    parser = contest.parser(__doc__)
    parser.add_argument("name", nargs="*", help=", ".join(MAKERS))
    parser.add_argument("--coarse", action="store_true", help="to 1e-4 of the way in place of 1e-6")
    arguments = parser.parse_args()
    rows = []
    for name in arguments.name or MAKERS:
        found = compare(name, COARSE if arguments.coarse else FINE, arguments.coordinates)
        rows += found
        print(contest.show(found, ACCURACY, "CPU ms per s"), flush=True)
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
