"""The engine called by address: what a loop of one's own costs to compile, and a right-hand side by its address.

    python benchmarks/door.py

Prints CPU seconds to compile the engine and the loop in a cache of their own, then microseconds for a right-hand side
of Andrews' mechanism by its address, and inside a kernel that contains it (which compiles for as long as the engine).
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("FLYBALL_CACHE", tempfile.mkdtemp())
sys.path.insert(0, str(Path(__file__).parents[1]))

import timing  # noqa: F401  isort: skip  (before numpy: it fixes the thread counts)

from tests.program.test_engine import classical_kernel, desk

import flyball as fb
from flyball.compiler.formulas import formula
from flyball.compiler.kernels import kernel
from flyball.engine.entry_point import MOTION, engine, run_task
from flyball.engine.motion import derivative
from flyball.numerics.integrators.time_loop import StepState
from flyball.tables.table_definitions import System, Work

CALLS = 100_000


@formula
def again(S, W, clock, n):
    """Right-hand sides, contained."""
    for _ in range(n):
        derivative(clock.real.t, clock.y[0], clock.K[0], S, W)


@kernel
def contained_kernel(S: System, W: Work, clock: StepState, n: int) -> None:
    again(S, W, clock, n)


def spent(work) -> float:
    """CPU seconds."""
    began = time.process_time()
    work()
    return time.process_time() - began


def main() -> None:
    began = time.process_time()
    _, S, W, R, clock, sheet = desk(fb.load("examples/andrews.toml"), "absolute")  # assembling asks the engine
    run_task(S, W, R, clock, sheet.rows, MOTION)
    print(f"engine compiled and called   {time.process_time() - began:8.2f} s")
    address = engine.address
    loop = lambda n: classical_kernel(address, S, W, R, clock, sheet, 1e-9, n)  # noqa: E731
    print(f"loop by its address        {spent(lambda: loop(1)):8.2f} s")
    print(f"loop that contains it        {spent(lambda: contained_kernel(S, W, clock, 1)):8.2f} s")
    for _ in range(3):
        through = spent(lambda: loop(CALLS // 4)) / CALLS * 1e6
        inside = spent(lambda: contained_kernel(S, W, clock, CALLS)) / CALLS * 1e6
        print(f"a right-hand side            {through:8.2f} us by its address, {inside:8.2f} us contained")


if __name__ == "__main__":
    main()
