"""Recursive dynamics of a spatial chain of n revolute joints: microseconds of CPU for one state, and memory.

Usage: ``python benchmarks/long_chain.py [n]``; n is 1000 unless given. Axes and links have random directions.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import flyball as fb

REPETITIONS = 100


def chain(n: int) -> fb.Mechanism:
    """Links of 0.1 m that hang one on the other."""
    rng, m, at, before = np.random.default_rng(0), fb.Mechanism("chain", gravity=(0, 0, -9.81)), np.zeros(3), "ground"
    for k in range(n):
        step, axis = rng.normal(size=(2, 3))
        step *= 0.1 / np.linalg.norm(step)
        m.add(fb.Body(f"b{k}", mass=1, inertia=(0.01, 0.012, 0.013), position=tuple(at + step / 2)))
        m.add(fb.Revolute(f"J{k}", before, f"b{k}", at=tuple(at), axis=tuple(axis)))
        at, before = at + step, f"b{k}"
    return m


def microseconds(call: Callable[[], Any]) -> float:
    """The least CPU time of a call."""
    times = []
    for _ in range(REPETITIONS):
        begin = time.process_time_ns()
        call()
        times.append(time.process_time_ns() - begin)
    return min(times) * 1e-3


def main() -> None:
    """Print times."""
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    p = chain(n).prepare(coordinates="joint")
    q, v, a = np.random.default_rng(1).normal(size=(3, n))
    tau, M = np.empty(n), np.empty((n, n))
    for name in ("rnea", "aba"):
        print(f"{name:<14}{microseconds(p.bind(name, q, v, a, tau)):8.0f} us")
    print(f"{'mass_matrix':<14}{microseconds(lambda: p.mass_matrix(q, out=M)):8.0f} us")


if __name__ == "__main__":
    main()
