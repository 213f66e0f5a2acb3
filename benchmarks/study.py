"""Studies of Andrews' mechanism, 0.03 s a run: CPU time of a run against that of its compiled kernels.

``kernel`` is the CPU time of the compiled loop in a run, ``run`` that of all of it in a study on one thread,
``simulate`` that of `m.simulate` with both curves read and the result judged. Stiffnesses and torques only forces see;
with another length all tables are others, and made code serves only runs that have its numbers 0, 1 and -1.
Usage: ``python study.py [--runs 1000] [--vary stiffness d] [--repeats 3] [--engines made tables]``.
"""

from __future__ import annotations

import argparse
import time

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np

import flyball as fb
from flyball.compiler.kernels import BoundKernel
from mechanisms import example

VARIED = {"stiffness": 0.1, "torque": 0.1, "d": 0.001}  # by how much, as part of the model's value
CURVES = ["K2.x", "crank.rate"]
FEWER = 100  # runs of `simulate`
COLUMNS = {
    "varied": "varied",
    "engine": "engine",
    "runs": "runs",
    "kernel": "kernel [ms]",
    "run": "run [ms]",
    "ratio": "ratio",
    "simulate": "simulate [ms]",
}


class Kernels:
    """Adds up the CPU time of the compiled loops."""

    def __init__(self) -> None:
        self.seconds, self._call = 0.0, BoundKernel.__call__
        kernels = self

        def timed(self: BoundKernel, task: int) -> int:
            start = time.thread_time()
            used = kernels._call(self, task)
            kernels.seconds += time.thread_time() - start
            return used

        BoundKernel.__call__ = timed  # type: ignore[method-assign]


def asked(m: fb.Mechanism, name: str, runs: int, made: bool) -> fb.Study:
    """A study of random points."""
    value, part = m.environment()[name], VARIED[name]
    return m.study({name: (value * (1 - part), value * (1 + part))}, [f"end({c})" for c in CURVES], t_end=0.03,
                   design="random", samples=runs, threads=1, specialize=made, progress=False)  # fmt: skip


def row(m: fb.Mechanism, kernels: Kernels, name: str, runs: int, made: bool, repeats: int) -> dict[str, object]:
    """Of the table; of some readings the one whose ratio is the least."""
    study, found = asked(m, name, FEWER, made), (np.inf, 0.0, 0.0)
    for _ in range(repeats):
        kernels.seconds, start = 0.0, time.process_time()
        asked(m, name, runs, made)
        spent = time.process_time() - start
        found = min(found, (spent / kernels.seconds, spent / runs, kernels.seconds / runs))
    start = time.process_time()
    for k in range(FEWER):
        r = m.simulate(**study.question(k))
        assert r.health.doubtful == ()
        assert np.isfinite([r.curve(c)[1][-1] for c in CURVES]).all()
    each = (time.process_time() - start) / FEWER
    ratio, run, kernel = found
    told = {"varied": name, "engine": "made" if made else "tables", "runs": runs}
    return told | {"kernel": 1e3 * kernel, "run": 1e3 * run, "ratio": ratio, "simulate": 1e3 * each}


def main() -> None:
    """Command line."""
    told = argparse.ArgumentParser(description=__doc__)
    told.add_argument("--runs", type=int, default=1000)
    told.add_argument("--vary", nargs="+", default=list(VARIED), choices=VARIED)
    told.add_argument("--repeats", type=int, default=3)
    told.add_argument("--engines", nargs="+", default=["made", "tables"])
    o = told.parse_args()
    m, kernels = example("andrews.toml"), Kernels()
    print(timing.heading(), flush=True)
    m.simulate(0.03, specialize=False)  # the engine is compiled if it is not yet
    rows = [row(m, kernels, name, o.runs, engine == "made", o.repeats) for engine in o.engines for name in o.vary]
    print(timing.table(rows, COLUMNS))


if __name__ == "__main__":
    main()
