"""N-four-bar for 10 s at an energy error of 1e-3 J: flyball and its peers side by side in one run; N = 1000 by itself.

For N = 1000 only flyball is timed, over 1 s and 4 s: per window, against N = 40 at the same tolerance.
With ``--radau``: the energy error of that method through all singular positions, at every hundredth of a second, with
each hinge once and twice.
Usage: ``python fourbars.py [N ...] [--radau] [--json FILE]``.
"""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contest
import numpy as np
from contest import Contest, Flyball
from trees import Tree, planar_tree
from trees import planar_motion as tree_motion

import flyball as fb
from mechanisms import (
    Kernel,
    Planar,
    energy,
    flyball_planar,
    fourbars,
    fourbars_exact,
    gap,
    planar_motion,
    point,
    simulate,
)

T_END, TARGET, SAMPLES = 10.0, 1e-3, 500
METHODS = ("dop853", "rk45")
LARGE, MIDDLE, SPANS = 1000, 40, (1.0, 4.0)  # windows, windows to compare with, seconds
LARGE_OPTIONS = {"rtol": 10**-6.5, "method": "dop853"}  # what N = 40 needs for 10 s

# module, setting, first number of steps, largest N it is tried for
PEERS = (
    ("exudyn", "generalised-alpha 0.95", {1: 16000, 10: 24000}, 10),
    ("exudyn", "generalised-alpha 0.95, full Newton", {1: 12000}, 1),
    ("mujoco", "RK4, stiff", {1: 4800, 10: 9600, 40: 12800}, 40),
    ("mujoco", "RK4, softer (4 steps)", {1: 4800, 10: 9600}, 10),
    ("pinocchio", "Python RK4", {1: 800, 10: 800, 40: 1200}, 40),
)
ACCURACY = {"energy_error": "energy error [J]", "end_error": "end error [m]", "gap": "gap [m]"}
TIGHT = (1e-7, 1e-9, 1e-10, 1e-11, 1e-12)
RADAU_COLUMNS = {
    "n": "N",
    "hinges": "hinges",
    "rtol": "rtol",
    "energy_error": "energy error [J]",
    "steps": "steps",
    "cpu": "CPU s",
}
SCALE_COLUMNS = {
    "n": "N",
    "span": "seconds",
    "energy_error": "energy error [J]",
    "steps": "steps",
    "evaluations": "evaluations",
    "cpu_ms": "CPU ms per s",
    "window_us": "us per s and window",
    "ratio": "ratio per window",
}


def accuracy(p: Planar, tree: Tree, n: int, motion: Any) -> dict[str, float]:
    """Energy error, error of the first joint on top at the end, and largest gap; the same for every engine."""
    q, v = motion if len(motion) == 2 else tree_motion(p, tree, motion)
    if not (np.isfinite(q).all() and np.isfinite(v).all()) or len(q) < contest.ENOUGH:
        return {"energy_error": float("inf")}
    e = energy(p, q, v)
    end = point(q[-1:], 0, (0.5, 0.0))[0] - fourbars_exact(n, np.array([0.0, T_END]))[-1]
    return {"energy_error": float(np.abs(e - e[0]).max()), "end_error": float(np.abs(end).max()), "gap": gap(p, q)}


def compare(n: int, coordinates: str) -> list[dict[str, Any]]:
    """All engines for one N."""
    p = fourbars(n)
    tree = planar_tree(p)
    judge = partial(accuracy, p, tree, n)
    one = Contest(f"N = {n}", T_END, judge, "energy_error", TARGET, SAMPLES, patience=30.0, per=T_END)
    model = flyball_planar(p)
    ours = [Flyball(model, partial(planar_motion, p), method, coordinates, 1e-3) for method in METHODS]
    peers = []
    for name, setting, first, largest in PEERS:
        if n <= largest:
            given = p if name == "exudyn" else tree
            peers.append(contest.peer(name, setting, given, T_END, first.get(n, 800 * n)))
    return contest.run(one, ours, peers)


def scaling(span: float, coordinates: str) -> list[dict[str, Any]]:
    """flyball's time per window for N = 40 and N = 1000, stepping alone."""
    rows, clocks = [], {}
    options = LARGE_OPTIONS | {"coordinates": coordinates}
    for n in (MIDDLE, LARGE):
        model = flyball_planar(fourbars(n))
        health = simulate(model, span, outputs=101, **options).health
        row = {"n": n, "span": span, "energy_error": health.energy_drift, "steps": health.steps + health.rejected}
        rows.append(row | {"evaluations": health.evaluations})
        clocks[n] = Kernel(model, span, 2, **options).seconds
    seconds = timing.interleaved(clocks, 7)
    for row in rows:
        row["cpu_ms"] = 1e3 * seconds[row["n"]] / span
        row["window_us"] = 1e3 * row["cpu_ms"] / row["n"]
        row["ratio"] = row["window_us"] / rows[0]["window_us"]
    return rows


def implicit(n: int) -> list[dict[str, Any]]:
    """Energy errors of `radau`, by tolerances, with each hinge once and twice."""
    rows = []
    for hinges in (1, 2):
        model = flyball_planar(fourbars(n))
        for k in range(len(model.joints) if hinges == 2 else 0):
            j = model.joints[k]
            model.add(fb.Revolute(f"{j.name} again", j.body_i, j.body_j, at=j.at))
        for rtol in TIGHT:
            row = {"n": n, "hinges": hinges, "rtol": rtol, "energy_error": float("nan")}
            rows.append(row)
            begin = time.process_time()
            try:
                health = simulate(model, T_END, outputs=1001, method="radau", rtol=rtol).health
            except fb.SimulationError as error:
                print(f"  N = {n}, rtol {rtol:g}: {error}", flush=True)
                continue
            row |= {"energy_error": health.energy_drift, "steps": health.steps, "cpu": time.process_time() - begin}
    return rows


def main() -> None:
    """Command line."""
    parser = contest.parser(__doc__)
    parser.add_argument("--radau", action="store_true", help="energy errors of radau, alone")
    parser.add_argument("n", nargs="*", type=int, help=f"numbers of windows (1 10 40 {LARGE})")
    arguments = parser.parse_args()
    rows = []
    for n in arguments.n or ((1, 10, 40) if arguments.radau else (1, 10, 40, LARGE)):
        if arguments.radau:
            found = implicit(n)
            print(timing.table(found, RADAU_COLUMNS), flush=True)
        elif n == LARGE:
            found = [row for span in SPANS for row in scaling(span, arguments.coordinates)]
            print(timing.table(found, SCALE_COLUMNS), flush=True)
        else:
            found = compare(n, arguments.coordinates)
            print(contest.show(found, ACCURACY, "CPU ms per s"), flush=True)
        rows += found
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
