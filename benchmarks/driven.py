"""Fully driven mechanisms, 10 s with 501 outputs: ``simulate`` against the bare kinematics at the same times.

Kinematics: positions by Newton's method from those of the time before, velocities, accelerations, in flyball's own
compiled pieces; then the same with forces and reactions. Usage: ``python driven.py``.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contest
import numpy as np
from compiled_loops import KINEMATICS, REACTIONS, clock

import flyball as fb
from flyball.engine.entry_point import FOLLOW
from mechanisms import GRAVITY, Kernel, example, simulate, started

T_END, OUTPUTS, REPEATS = 10.0, 501, 7
COLUMNS = {
    "case": "case",
    "steps": "steps",
    "evaluations": "evaluations",
    "call_ms": "simulate [ms]",
    "run_ms": "its loop",
    "kinematics_ms": "kinematics [ms]",
    "reactions_ms": "with reactions",
    "ratio": "ratio to kinematics",
    "ratio_reactions": "to those with reactions",
}


def four_bar() -> fb.Mechanism:
    """A planar crank-rocker: ground 0.5, crank 0.2, coupler 0.5, rocker 0.4 m; the crank turns at 10 rad/s."""
    m = fb.Mechanism("four-bar", planar=True, gravity=(0.0, -GRAVITY))
    A, D = np.zeros(2), np.array([0.5, 0.0])
    B = 0.2 * np.array([np.cos(1.0), np.sin(1.0)])
    between = D - B
    size = np.hypot(*between)
    x = (size**2 + 0.5**2 - 0.4**2) / (2 * size)
    C = B + (x * between + np.sqrt(0.5**2 - x * x) * np.array([-between[1], between[0]])) / size
    for name, a, b, mass in (("crank", A, B, 1.0), ("coupler", B, C, 1.5), ("rocker", D, C, 0.8)):
        angle = float(np.arctan2(*(b - a)[::-1]))
        inertia = mass * float((b - a) @ (b - a)) / 12
        m.add(fb.Body(name, mass=mass, inertia=inertia, position=tuple((a + b) / 2), angle=angle))
    for name, i, j, at in (("A", "ground", "crank", A), ("B", "crank", "coupler", B), ("C", "coupler", "rocker", C),
                           ("D", "ground", "rocker", D)):  # fmt: skip
        m.add(fb.Revolute(name, i, j, at=tuple(at)))
    m.add(fb.Driver("motor", "A.angle", "10*t"))
    return m


MAKERS = {
    "slider-crank": partial(example, "slider_crank.toml"),
    "four-bar": four_bar,
    "Stewart": partial(example, "stewart.py"),
}


def compare(name: str, coordinates: str) -> dict[str, Any]:
    """One row."""
    model = MAKERS[name]()
    options = {"outputs": OUTPUTS, "coordinates": coordinates}
    run = simulate(model, T_END, **options)
    c, y = started(model, coordinates)
    clocks = {
        "call": lambda: timing.cpu(lambda: simulate(model, T_END, **options)),
        "loop": Kernel(model, T_END, OUTPUTS, task=FOLLOW, coordinates=coordinates).seconds,
        "kinematics": partial(clock, c, y, run.t, KINEMATICS),
        "reactions": partial(clock, c, y, run.t, REACTIONS),
    }
    ms = {key: 1e3 * value for key, value in timing.interleaved(clocks, REPEATS).items()}
    row = {"case": name, "steps": run.health.steps + run.health.rejected, "evaluations": run.health.evaluations}
    row |= {"call_ms": ms["call"], "run_ms": ms["loop"]}
    row |= {"kinematics_ms": ms["kinematics"], "reactions_ms": ms["reactions"]}
    row["ratio"] = row["run_ms"] / row["kinematics_ms"]
    return row | {"ratio_reactions": row["run_ms"] / row["reactions_ms"]}


def main() -> None:
    """Command line."""
    arguments = contest.parser(__doc__).parse_args()
    rows = [compare(name, arguments.coordinates) for name in MAKERS]
    print(timing.table(rows, COLUMNS))
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
