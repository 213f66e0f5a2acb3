"""A step of a pile on one and on more threads: wall time, in turn from one state, so that a busy spell hits both.

Usage: ``python benchmarks/threads.py [spheres:16000] [--threads 1 2] [--steps 250] [--seconds 60] [--json FILE]``. The
pile falls for so many steps first. Minima and lower quantiles of many steps, because other processes take cores; their
mean use of the machine, in cores, is printed (from /proc/stat), and whether the states were the same to the last bit.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contact_scenes as cs
import flyball_contact
import numpy as np

import flyball as fb

QUANTILES = (0, 5, 25, 50)  # of the wall time of a step [%]
REPEATS = 3  # steps from the stored state, after one that fills the caches
COLUMNS = {
    "threads": "threads",
    "steps": "steps",
    **{f"q{q}": f"{q} % [ms]" for q in QUANTILES},
    "ratio": "ratio of minima",
}


def busy() -> float:
    """Core seconds in which any process ran, since the machine was started."""
    fields = [int(x) for x in Path("/proc/stat").read_text(encoding="ascii").splitlines()[0].split()[1:9]]
    return (sum(fields) - fields[3] - fields[4]) / os.sysconf("SC_CLK_TCK")


def contest(what: str, count: int, threads: list[int], steps: int, seconds: float) -> list[dict]:
    """Steps on each number of threads, in turn."""
    stepper = flyball_contact.Run(flyball_contact.pile(cs.pile(what, count)), fb.Stepping(step=cs.H)).stepper
    stepper.run(steps, cs.H)
    kept, ends = stepper.save(), set()
    times: dict[int, list[float]] = {n: [] for n in threads}
    began, used, own = time.perf_counter(), busy(), time.process_time()
    while time.perf_counter() < began + seconds:
        for n in threads:
            stepper.threads = n
            stepper.restore(kept)
            stepper.run(1, cs.H)
            for _ in range(REPEATS):
                start = time.perf_counter()
                stepper.run(1, cs.H)
                times[n].append(time.perf_counter() - start)
            ends.add(stepper.movers.pose.tobytes() + stepper.workspaces.X.v.tobytes())
    others = (busy() - used - (time.process_time() - own)) / (time.perf_counter() - began)
    print(f"others used {others:.2f} cores; states at the end: {len(ends)}")
    rows = []
    for n, took in times.items():
        row = {"threads": n, "steps": len(took), "ratio": min(times[threads[0]]) / min(took)}
        rows.append(row | {f"q{q}": 1e3 * float(np.percentile(took, q)) for q in QUANTILES})
    return rows


def main() -> None:
    """Run what is asked."""
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("scene", nargs="?", default="spheres:16000")
    p.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    p.add_argument("--steps", type=int, default=250)
    p.add_argument("--seconds", type=float, default=60.0)
    p.add_argument("--json")
    a = p.parse_args()
    print(timing.heading())
    what, count = a.scene.split(":")
    rows = contest(what, int(count), a.threads, a.steps, a.seconds)
    print(timing.table(rows, COLUMNS), flush=True)
    timing.write_json(a.json, rows)


if __name__ == "__main__":
    main()
