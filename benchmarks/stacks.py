"""Stacks of cubes, 2 s in steps of 5 ms, flyball beside MuJoCo in one run.

S1: ten cubes of 1000 kg; S5: ten of 1 kg under one of 1000 kg; the same under 1e5 kg; each just touching, and dropped
from gaps of 1 mm, shifted by 3 cm and yawed by 3.4 degrees in turn. Times are CPU milliseconds of whole steps of one
thread, means over all steps, engines taking steps in turn. A cube has fallen where its centre is off by half a metre.

Usage: ``python benchmarks/stacks.py [S1 S5 1e5:1] [--solver NAME] [--json FILE]``.
"""

from __future__ import annotations

import argparse

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contact_scenes as cs
import flyball_contact
import numpy as np

import flyball as fb

STEPS = round(2.0 / cs.H)
COLUMNS = {
    "scene": "scene",
    "engine": "engine",
    "mean": "ms a step",
    "median": "median",
    "overlap": "overlap [mm]",
    "worst": "ever [mm]",
    "sinks": "top sinks [mm]",
    "drift": "drift [mm]",
    "kinetic": "kinetic energy [J]",
    "stands": "stands",
}


def contest(name: str, shifted: bool, solver: str) -> list[dict]:
    """A stack on every engine, in turn step by step."""
    import peer_mujoco_contact as mj

    s = cs.stack(cs.STACKS[name], shifted)
    options = fb.Stepping(step=cs.H, solver=solver)
    runs = {
        "flyball": flyball_contact.Run(flyball_contact.stack(s), options),
        "flyball, 5 iterations": flyball_contact.Run(
            flyball_contact.stack(s), fb.Stepping(step=cs.H, solver=solver, iterations=5)
        ),
        "MuJoCo Newton stiff": mj.Run(mj.stack(s, "stiff"), "Newton"),
        "MuJoCo CG stiff": mj.Run(mj.stack(s, "stiff"), "CG"),
        "MuJoCo Newton soft": mj.Run(mj.stack(s, "soft"), "Newton"),
    }
    times: dict[str, list[float]] = {k: [] for k in runs}
    for _ in range(STEPS):
        for key, run in runs.items():
            times[key].append(run.step())
    rows = []
    rest = 0.5 + np.arange(len(s.mass))
    for key, run in runs.items():
        x = run.centres()
        row = {"scene": f"{name}{', shifted' if shifted else ''}", "engine": key, **run.figures()}
        row["mean"], row["median"] = 1e3 * float(np.mean(times[key])), 1e3 * float(np.median(times[key]))
        row["sinks"] = 1e3 * float(rest[-1] - x[-1, 2])
        row["drift"] = 1e3 * float(np.abs(x[:, :2] - s.position[:, :2]).max())
        row["stands"] = bool((np.abs(x[:, 2] - rest) < 0.5).all())
        rows.append(row)
    return rows


def main() -> None:
    """Run what is asked."""
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("stacks", nargs="*", default=list(cs.STACKS))
    p.add_argument("--solver", default="auto")
    p.add_argument("--json")
    a = p.parse_args()
    print(timing.heading())
    flyball_contact.Run(flyball_contact.stack(cs.stack([1.0, 1.0], False)), fb.Stepping(solver=a.solver)).step()
    rows = []
    for name in a.stacks:
        for shifted in (False, True):
            found = contest(name, shifted, a.solver)
            rows += found
            print(timing.table(found, COLUMNS), flush=True)
    timing.write_json(a.json, rows)


if __name__ == "__main__":
    main()
