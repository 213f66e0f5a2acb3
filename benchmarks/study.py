"""Studies of Andrews' mechanism, 0.03 s a run: whole time against that of the compiled kernels alone.

``kernel``: the compiled loop of a run by itself, mean of a thousand runs, the least of three readings. ``CPU`` is
that of the process and ``ratio`` what it is of the kernels'; ``wall`` is a clock's, which on a shared machine
measures the neighbours too, and its ratio is to the kernels' time divided by the threads. Of three studies the
quickest. ``simulate``: CPU of `m.simulate` with a curve read, in a loop over some of the points. Stiffnesses and
torques only forces see; with another length each run is assembled by itself. Usage: ``python study.py [--runs 10000]
[--threads 1 2]``.
"""

from __future__ import annotations

import argparse
import inspect
import time
from functools import partial

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np

import flyball as fb
from flyball.analysis.motion.choice import SimulateOptions
from flyball.analysis.runs import lean
from flyball.analysis.runs.compute import Question
from flyball.analysis.runs.reading import readings
from flyball.analysis.runs.single import Motion
from mechanisms import example

VARIED = {"stiffness": 0.1, "torque": 0.1, "d": 0.001}  # by how much, as part of the model's value
OF = ["end(K5.x)", "end(crank.rate)"]
REPEATS, FEW, FEWER = 3, 1000, 400  # readings; runs whose kernels are measured; runs that are assembled by themselves
COLUMNS = {
    "varied": "varied",
    "engine": "engine",
    "runs": "runs",
    "threads": "threads",
    "kernel": "kernel [ms]",
    "cpu": "CPU a run [ms]",
    "ratio": "ratio",
    "wall": "wall a run [ms]",
    "wall_ratio": "ratio to kernels / threads",
    "simulate": "simulate [ms]",
}


def kernel(m: fb.Mechanism, study: fb.Study) -> float:
    """Seconds of the compiled loop of a run, without anything about it."""
    usual = {k: p.default for k, p in inspect.signature(m.simulate).parameters.items()} | study.question(0)
    model, single = m.snapshot(), Motion()
    asked = readings(OF, partial(single.named, model))
    question = Question(model, single, SimulateOptions.asked(usual), study.parameters, asked, study.t)
    desk, call, spent = lean.Desk(lean.shared(question, study.points[0])), lean.motion_kernel, [0.0]

    def timed(*arguments: object) -> int:
        start = time.thread_time()
        used = call(*arguments)
        spent[0] += time.thread_time() - start
        return used

    def reading() -> float:
        spent[0] = 0.0
        for point in study.points[:FEW]:
            desk.run(point)
        return spent[0] / len(study.points[:FEW])

    lean.motion_kernel = timed
    try:
        return min(reading() for _ in range(REPEATS))
    finally:
        lean.motion_kernel = call


def measured(m: fb.Mechanism, name: str, runs: int, threads: int, made: bool) -> tuple[fb.Study, float, float]:
    """(study, CPU seconds, wall seconds) of the quickest."""
    value, part = m.environment()[name], VARIED[name]

    def once() -> tuple[fb.Study, float, float]:
        cpu, wall = time.process_time(), time.perf_counter()
        s = m.study({name: (value * (1 - part), value * (1 + part))}, OF, t_end=0.03, design="random", samples=runs,
                    threads=threads, specialize=made, progress=False)  # fmt: skip
        return s, time.process_time() - cpu, time.perf_counter() - wall

    return min((once() for _ in range(REPEATS)), key=lambda found: found[2])


def alone(m: fb.Mechanism, study: fb.Study) -> float:
    """CPU seconds of a run by `simulate`, a curve read."""
    count = min(FEWER, len(study)) // 2
    start = time.process_time()
    for k in range(count):
        m.simulate(**study.question(k))["K5"].x  # noqa: B018
    return (time.process_time() - start) / count


def main() -> None:
    """Command line."""
    told = argparse.ArgumentParser(description=__doc__)
    told.add_argument("--runs", type=int, default=10_000)
    told.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    asked = told.parse_args()
    m, rows = example("andrews.toml"), []
    for made in (True, False):
        each = np.nan
        for name in VARIED:
            runs = min(asked.runs, FEWER) if name == "d" else asked.runs
            for threads in asked.threads:
                s, cpu, wall = measured(m, name, runs, threads, made)
                each = kernel(m, s) if name != "d" else each
                rows.append(
                    {
                        "varied": name,
                        "engine": "made" if made else "tables",
                        "runs": runs,
                        "threads": threads,
                        "kernel": 1e3 * each,
                        "cpu": 1e3 * cpu / runs,
                        "ratio": cpu / runs / each,
                        "wall": 1e3 * wall / runs,
                        "wall_ratio": wall / runs * threads / each,
                        "simulate": 1e3 * alone(m, s),
                    }
                )
                print(f"{name}, {rows[-1]['engine']}, {threads} threads: done", flush=True)
    print(timing.table(rows, COLUMNS))


if __name__ == "__main__":
    main()
