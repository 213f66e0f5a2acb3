"""Whole calls of ``simulate`` with code made for the mechanism: never, as chosen, and always; short and long motions.

Each figure is of a process of its own, whose cache has the engine for all mechanisms and no made code (cold), or the
made code too (warm).

Usage: python benchmarks/specialised_calls.py [NAME ...] [--runs N] [--longest SECONDS] [--json FILE]
"""

from __future__ import annotations

import timing  # first: fixes the thread counts

import argparse  # isort: skip
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import flyball as fb
from mechanisms import example

MECHANISMS: dict[str, tuple[Callable[[], fb.Mechanism], str]] = {
    "Andrews": (lambda: example("andrews.toml"), "torque"),
    "Bricard": (lambda: example("bricard.toml"), ""),
    "Stewart platform": (lambda: example("stewart.py"), ""),
    "double wishbone": (lambda: example("double_wishbone.toml"), ""),
}
SPANS = (0.01, 0.1, 1.0, 10.0, 100.0)  # seconds of motion
WISHES = {"never": False, "auto": "auto", "always": True}


def one(name: str, span: float, wish: str, runs: int) -> None:
    """What a process of its own does: the motion, or so many of it with other values of a parameter; prints seconds."""
    make, parameter = MECHANISMS[name]
    m = make()
    m.simulate(1e-6, outputs=2, specialize=False)  # loads what serves every mechanism
    begin = time.perf_counter(), time.process_time()
    r = None
    for k in range(runs):
        given = {parameter: m.environment()[parameter] * (1 + 1e-4 * k)} if parameter else {}
        r = m.simulate(span, parameters=given, specialize=WISHES[wish], progress=False)
    took = time.perf_counter() - begin[0], time.process_time() - begin[1]
    print(json.dumps([*took, r.health.engine if r else ""]))


def asked(name: str, span: float, wish: str, runs: int, cache: Path) -> tuple[float, float, str]:
    """Seconds by the wall clock, CPU seconds, and which engine it was."""
    words = [sys.executable, __file__, "--one", name, str(span), wish, "--runs", str(runs)]
    env = os.environ | {"NUMBA_CACHE_DIR": str(cache)}
    said = subprocess.run(words, capture_output=True, text=True, env=env, check=True)
    wall, cpu, engine = json.loads(said.stdout.splitlines()[-1])
    return wall, cpu, engine


def figures(name: str, span: float, runs: int, folder: Path) -> dict[str, tuple[float, float, str]]:
    """All of one line."""
    line = {}
    for wish in WISHES:
        cache = folder / wish
        shutil.rmtree(cache, ignore_errors=True)
        shutil.copytree(folder / "engine", cache)
        line[wish] = asked(name, span, wish, runs, cache)
    line |= {f"{wish}, warm": asked(name, span, wish, runs, folder / "always") for wish in ("auto", "always")}
    return line


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--one", nargs=3)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--longest", type=float, default=max(SPANS))
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    if given.one:
        one(given.one[0], float(given.one[1]), given.one[2], given.runs)
        return
    print(timing.heading(), "\n")
    print("Seconds of a call by the wall clock, and CPU seconds of its process\n")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        asked("Andrews", 1e-3, "never", 1, Path(folder) / "engine")
        for name in given.names or MECHANISMS:
            jobs = [(span, 1) for span in SPANS if span <= given.longest] + [(0.03, given.runs)]
            for span, runs in jobs:
                line = figures(name, span, runs, Path(folder))
                rows.append({"name": name, "span": span, "runs": runs} | line)
                told = "   ".join(f"{w} {wall:8.3f} ({cpu:7.3f})" for w, (wall, cpu, _) in line.items())
                print(f"{name:18} {runs:5d} x {span:6g} s   {told}   auto: {line['auto'][2]}", flush=True)
    if given.json:
        given.json.write_text(json.dumps({"machine": timing.machine(), "rows": rows}, indent=1))


if __name__ == "__main__":
    main()
