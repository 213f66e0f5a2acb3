"""Piles: N bodies dropped into a box, 2 s in steps of 5 ms, flyball beside MuJoCo in one run.

Usage: ``python benchmarks/piles.py [spheres:1000 boxes:1000 mixed:1000 ...] [--alone] [--json FILE]``. Times are CPU
milliseconds of whole steps of one thread, means over all steps; steps of both engines are taken in turn, so that a busy
spell of the machine hits both. MuJoCo stops where its steps have taken `LIMIT` seconds; means are then over the same
steps of both. Without arguments: spheres 1000, 4000, 16,000; boxes and mixed shapes 1000; and spheres 100,000 alone.
"""

from __future__ import annotations

import argparse

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contact_scenes as cs
import flyball_contact
import numpy as np

import flyball as fb

USUAL = ("spheres:1000", "boxes:1000", "mixed:1000", "spheres:4000", "spheres:16000")
ALONE = 50_000  # bodies from which on flyball runs alone
LIMIT = 150.0  # CPU seconds of a peer's steps
STEPS = round(2.0 / cs.H)
COLUMNS = {
    "scene": "scene",
    "engine": "engine",
    "mean": "ms a step",
    "ratio": "times flyball",
    "last": "ms at the end",
    "steps": "steps",
    "contacts": "contacts",
    "overlap": "overlap at the end [mm]",
    "worst": "ever [mm]",
    "kinetic": "kinetic energy [J]",
}


def contest(what: str, count: int, alone: bool) -> list[dict]:
    """A scene on every engine, in turn step by step."""
    p = cs.pile(what, count)
    runs = {"flyball": flyball_contact.Run(flyball_contact.pile(p), fb.Stepping(step=cs.H))}
    if not alone and count < ALONE:
        import peer_mujoco_contact as mj

        runs["MuJoCo CG stiff"] = mj.Run(mj.pile(p, "stiff"), "CG")
        runs["MuJoCo CG soft"] = mj.Run(mj.pile(p, "soft"), "CG")
    times: dict[str, list[float]] = {k: [] for k in runs}
    for _ in range(STEPS):
        for name, run in runs.items():
            if name == "flyball" or sum(times[name]) < LIMIT:
                times[name].append(run.step())
    rows = []
    for name, run in runs.items():
        n = len(times[name])
        row = {"scene": f"{what} {count}", "engine": name, "steps": n, **run.figures()}
        row["mean"] = 1e3 * float(np.mean(times[name]))
        row["last"] = 1e3 * float(np.median(times[name][-50:]))
        row["ratio"] = row["mean"] / (1e3 * float(np.mean(times["flyball"][:n])))
        rows.append(row)
    return rows


def main() -> None:
    """Run what is asked."""
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("scenes", nargs="*", default=[*USUAL, "spheres:100000"])
    p.add_argument("--alone", action="store_true", help="flyball only")
    p.add_argument("--json")
    a = p.parse_args()
    print(timing.heading())
    flyball_contact.Run(flyball_contact.pile(cs.pile("mixed", 8)), fb.Stepping(step=cs.H)).step()  # compiled before
    rows = []
    for scene in a.scenes:
        what, count = scene.split(":")
        found = contest(what, int(count), a.alone)
        rows += found
        print(timing.table(found, COLUMNS), flush=True)
    timing.write_json(a.json, rows)


if __name__ == "__main__":
    main()
