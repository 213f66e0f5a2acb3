"""Studies of Andrews' mechanism, 0.03 s a run: whole time against that of the compiled kernels alone.

``kernel``: the compiled loop of a run by itself, mean of a thousand runs, the least of three readings. ``CPU`` is
that of the process and ``ratio`` what it is of the kernels'; ``wall`` is a clock's. On a shared machine that measures
the neighbours too: its ratio is to the kernels of the same points alone, called by as many threads right before each
study, the least of both. Of some studies the quickest. ``simulate``: CPU of `m.simulate` with a curve read, in a loop
over some of the points. Stiffnesses and torques only forces see; with another length all tables are others.
What is being done is told as it begins, and each row as it is found; by tables all takes some four times as long.
Usage: ``python study.py [--runs 10000] [--threads 1 2] [--vary stiffness d] [--repeats 3] [--engines made tables]``.
"""

from __future__ import annotations

import argparse
import inspect
import time
from collections.abc import Callable
from functools import partial
from threading import Thread

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np
from flyball.analysis.runs.desk import Desk
from flyball.analysis.runs.lean import shared
from flyball.analysis.runs.spread import BLOCK

import flyball as fb
from flyball.analysis.motion.choice import SimulateOptions
from flyball.analysis.runs.compute import Question
from flyball.analysis.runs.reading import readings
from flyball.analysis.runs.single import Motion
from mechanisms import example

VARIED = {"stiffness": 0.1, "torque": 0.1, "d": 0.001}  # by how much, as part of the model's value
OF = ["end(K2.x)", "end(crank.rate)"]
FEW, FEWER = 1000, 200  # runs whose kernels are measured alone; runs of `simulate`
COLUMNS = {
    "varied": "varied",
    "engine": "engine",
    "runs": "runs",
    "threads": "threads",
    "kernel": "kernel [ms]",
    "cpu": "CPU a run [ms]",
    "ratio": "ratio",
    "wall": "wall a run [ms]",
    "wall_ratio": "ratio to kernels on as many threads",
    "simulate": "simulate [ms]",
}


class Kernels:
    """The compiled loops of a study's runs, without anything about them."""

    def __init__(self, m: fb.Mechanism, study: fb.Study) -> None:
        usual = {k: p.default for k, p in inspect.signature(m.simulate).parameters.items()} | study.question(0)
        model, single = m.snapshot(), Motion()
        asked = readings(OF, partial(single.named, model))
        question = Question(model, single, SimulateOptions.asked(usual), study.parameters, asked, study.t)
        self.shared, self.points = shared(question, study.points[0], study.points), study.points

    def through(self, points: np.ndarray, clock: Callable[[], float], spent: list[float]) -> None:
        """Time [s] of the calls for some points, as a clock tells it."""
        desk, total = Desk(self.shared), 0.0
        spread = self.shared.filling.spread
        spread.given = len(spread.points)  # tables are made for those that are asked for next, by each thread

        def timed(*arguments: object) -> int:
            nonlocal total
            start = clock()
            used = call(*arguments)
            total += clock() - start
            return used

        call, desk.call = desk.call, timed
        for k in range(0, len(points), BLOCK):
            self.shared.filling.also(points[k : k + BLOCK])
            for _ in desk.compute(points[k : k + BLOCK], lambda: False):
                pass
        spent.append(total)

    def each(self, repeats: int) -> float:
        """CPU seconds of one."""
        spent: list[float] = []
        for _ in range(repeats):
            self.through(self.points[:FEW], time.thread_time, spent)
        return min(spent) / len(self.points[:FEW])

    def wall(self, threads: int) -> float:
        """Seconds of all, divided among threads."""
        spent: list[float] = []
        parts = [(self.points[k::threads], time.perf_counter, spent) for k in range(threads)]
        pool = [Thread(target=self.through, args=part) for part in parts]
        for thread in pool:
            thread.start()
        for thread in pool:
            thread.join()
        return max(spent)


def asked(m: fb.Mechanism, name: str, runs: int, threads: int, made: bool) -> fb.Study:
    """A study of random points."""
    value, part = m.environment()[name], VARIED[name]
    return m.study({name: (value * (1 - part), value * (1 + part))}, OF, t_end=0.03, design="random", samples=runs,
                   threads=threads, specialize=made, progress=False)  # fmt: skip


def points(m: fb.Mechanism, name: str, runs: int) -> np.ndarray:
    """Those of the study."""
    value, part = m.environment()[name], VARIED[name]
    u = np.random.default_rng(0).random((runs, 1))
    return value * (1 - part) + 2.0 * value * part * u


def say(text: str) -> None:
    """At once: a row takes minutes where the machine is shared."""
    print(f"{time.strftime('%H:%M:%S')} {text}", flush=True)


def measured(
    m: fb.Mechanism, name: str, runs: int, threads: int, made: bool, repeats: int
) -> tuple[fb.Study, float, float, Kernels, float]:
    """(study, CPU seconds, wall seconds, its kernels, wall seconds of these): the least of each."""
    kernels = Kernels(m, asked(m, name, min(FEW, runs), threads, made))
    kernels.points = points(m, name, runs)
    found, cpu, wall, alone = None, np.inf, np.inf, np.inf
    for k in range(repeats):
        say(f"  {k + 1} of {repeats}: {runs} kernels alone, then the study")
        alone = min(alone, kernels.wall(threads))
        start = time.process_time(), time.perf_counter()
        found = asked(m, name, runs, threads, made)
        cpu, wall = min(cpu, time.process_time() - start[0]), min(wall, time.perf_counter() - start[1])
    return found, cpu, wall, kernels, alone


def alone(m: fb.Mechanism, study: fb.Study) -> float:
    """CPU seconds of a run by `simulate`, a curve read."""
    count = min(FEWER, len(study)) // 2
    start = time.process_time()
    for k in range(count):
        m.simulate(**study.question(k))["K2"].x  # noqa: B018
    return (time.process_time() - start) / count


def row(
    m: fb.Mechanism, s: fb.Study, what: tuple[str, bool, int], took: tuple[float, float, float], each: float
) -> dict[str, object]:
    """Of the table: CPU and wall seconds of a run and what the latter is of the kernels', CPU seconds of a kernel."""
    name, made, threads = what
    cpu, wall, ratio = took
    told = {"varied": name, "engine": "made" if made else "tables", "runs": len(s), "threads": threads}
    times = {"kernel": 1e3 * each, "cpu": 1e3 * cpu, "ratio": cpu / each, "wall": 1e3 * wall, "wall_ratio": ratio}
    return told | times | {"simulate": 1e3 * alone(m, s)}


def main() -> None:
    """Command line."""
    told = argparse.ArgumentParser(description=__doc__)
    told.add_argument("--runs", type=int, default=10_000)
    told.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    told.add_argument("--vary", nargs="+", default=list(VARIED), choices=VARIED)
    told.add_argument("--repeats", type=int, default=3)
    told.add_argument("--engines", nargs="+", default=["made", "tables"])
    asked = told.parse_args()
    m, rows, runs = example("andrews.toml"), [], asked.runs
    print(timing.heading(), flush=True)
    say("the engine is compiled if it is not yet, which takes 20 to 30 s of CPU time")
    m.simulate(0.03, specialize=False)
    for made in (engine == "made" for engine in asked.engines):
        for name in asked.vary:
            for threads in asked.threads:
                say(f"{name}, {'made code' if made else 'tables'}, threads: {threads}")
                s, cpu, wall, kernels, calls = measured(m, name, runs, threads, made, asked.repeats)
                rows.append(
                    row(
                        m,
                        s,
                        (name, made, threads),
                        (cpu / runs, wall / runs, wall / calls),
                        kernels.each(asked.repeats),
                    )
                )
                say("  " + ", ".join(f"{COLUMNS[k]} {timing.text(x)}" for k, x in list(rows[-1].items())[4:]))
    print(timing.table(rows, COLUMNS))


if __name__ == "__main__":
    main()
