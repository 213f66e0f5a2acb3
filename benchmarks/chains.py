"""Serial pendulum of n links for 10 s at an energy drift of 1e-6 of its swing energy: flyball and its peers in one run.

n slender rods, 1 m and 1 kg in all, straight at 30 deg from hanging, let go from rest. With ``--rhs``: the time of one
right-hand side of flyball for n = 10 to 1000. Usage: ``python chains.py [n ...] [--rhs]``.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contest
import numpy as np
from compiled_loops import RIGHT_HAND_SIDE, clock
from contest import Contest, Flyball
from trees import Motion, planar_tree
from trees import planar_motion as tree_motion

from mechanisms import CHAIN_ANGLE, GRAVITY, chain, energy, flyball_planar, planar_motion, simulate, started

T_END, TARGET, SAMPLES = 10.0, 1e-6, 500
SWING = 0.5 * GRAVITY * (1.0 - np.cos(CHAIN_ANGLE))  # energy of the swing [J]
LENGTHS, RHS_LENGTHS = (10, 30, 100), (10, 30, 100, 300, 1000)
ACCURACY = {"drift": "drift / swing"}
RHS_COLUMNS = {"n": "n", "calls": "calls", "us": "us per right-hand side", "us_per_link": "us per link"}
RHS_CALLS, BENT = 200_000, 0.3  # links times calls of one reading; when the chain is looked at [s]

# module, setting, first resolution, longest chain it is tried for
PEERS = (
    ("mujoco", "RK4, stiff", {10: 4000, 30: 8000, 100: 40000}, 100),
    ("pinocchio", "Python RK4", {10: 4000, 30: 8000, 100: 40000}, 100),
    ("pinocchio", "SciPy DOP853", {10: 1e-6, 30: 1e-7, 100: 1e-7}, 100),
    ("drake", "RK3, error control", {10: 1e-6}, 10),
    ("exudyn_tree", "RK44", {10: 4000, 30: 8000}, 30),
    ("exudyn_tree", "RK67", {10: 2000, 30: 4000}, 30),
    ("exudyn_tree", "DOPRI5", {10: 1e-7, 30: 1e-7}, 30),
)


def compare(n: int, coordinates: str) -> list[dict[str, Any]]:
    """All engines for one length."""
    p = chain(n)
    tree = planar_tree(p)

    def accuracy(motion: Any) -> dict[str, float]:
        q, v = tree_motion(p, tree, motion) if isinstance(motion, Motion) else motion
        e = energy(p, q, v)
        return {"drift": float(np.abs(e - e[0]).max()) / SWING}

    one = Contest(f"n = {n}", T_END, accuracy, "drift", TARGET, SAMPLES)
    model = flyball_planar(p)
    loosest = 1e-2 if n < 100 else 1e-4
    ours = [Flyball(model, partial(planar_motion, p), method, coordinates, loosest) for method in ("dop853", "rk45")]
    peers = []
    for name, setting, first, longest in PEERS:
        if n <= longest:
            peers.append(contest.peer(name, setting, tree, T_END, first.get(n, 1e-7 if "DOP" in setting else 4000)))
    return contest.run(one, ours, peers)


def right_hand_sides(coordinates: str) -> list[dict[str, Any]]:
    """Time of one right-hand side of flyball, at a state on the way: bent and moving."""
    rows, clocks = [], {}
    for n in RHS_LENGTHS:
        model = flyball_planar(chain(n))
        c, _ = started(model, coordinates)
        y = simulate(model, BENT, outputs=2, rtol=1e-4, atol=1e-6, coordinates=coordinates).final[1]
        times = np.full(max(RHS_CALLS // n, 10), BENT)
        clocks[n] = partial(clock, c, y, times, RIGHT_HAND_SIDE)
        rows.append({"n": n, "calls": len(times)})
    seconds = timing.interleaved(clocks, 5)
    for row in rows:
        row["us"] = 1e6 * seconds[row["n"]] / row["calls"]
        row["us_per_link"] = row["us"] / row["n"]
    return rows


def main() -> None:
    """Command line."""
    parser = contest.parser(__doc__)
    parser.add_argument("n", nargs="*", type=int, help=f"numbers of links {LENGTHS}")
    parser.add_argument("--rhs", action="store_true", help="time right-hand sides of flyball only")
    arguments = parser.parse_args()
    rows = []
    if arguments.rhs:
        rows = right_hand_sides(arguments.coordinates)
        print(timing.table(rows, RHS_COLUMNS))
        timing.write_json(arguments.json, rows)
        return
    for n in arguments.n or LENGTHS:
        found = compare(n, arguments.coordinates)
        rows += found
        print(contest.show(found, ACCURACY), flush=True)
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
