"""What a user waits for: ``import flyball``, and a first motion from the command line, compiled and not yet compiled.

Every figure is a fresh process. The warm cache is one that this script has just filled. Usage: ``python start.py``.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import timing

ROOT = Path(__file__).resolve().parents[1]
PILE = """
import flyball as fb
m = fb.Mechanism("pile", gravity=(0, 0, -9.81))
m.add(fb.Ground("floor", shape=fb.Plane()))
m.add(fb.Bodies("boxes", shape=fb.Box(edges=(0.2, 0.2, 0.2)), density=1000, position=[(0, 0, 0.5), (0.05, 0, 0.8)]))
m.add(fb.Contact(friction=0.3))
m.simulate(1.0, progress=False)
"""
EXAMPLE = ROOT / "examples" / "slider_crank.toml"
COLUMNS = {"what": "what", "wall": "wall [s]", "cpu": "CPU [s]"}


def spend(command: list[str], cache: Path) -> tuple[float, float]:
    """(wall, CPU) seconds of a process that keeps its compiled code in ``cache``.

    Raises
    ------
    SystemExit
        If the process fails; the message is what it wrote.
    """
    env = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"} | {"FLYBALL_CACHE": str(cache)}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    done = subprocess.run(command, env=env, capture_output=True, text=True)
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    return wall, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def measure(what: str, command: list[str], cache: Path, repeats: int) -> dict[str, Any]:
    """The least wall and the least CPU time of ``repeats`` runs."""
    wall, cpu = map(min, zip(*(spend(command, cache) for _ in range(repeats)), strict=True))
    return {"what": what, "wall": wall, "cpu": cpu}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5, help="runs of each warm figure (5)")
    parser.add_argument("--json", metavar="FILE", help="write the rows")
    arguments = parser.parse_args()
    python = [sys.executable]
    with tempfile.TemporaryDirectory() as folder:
        cache, out = Path(folder, "cache"), Path(folder, "out")
        motion = [*python, "-m", "flyball", "run", str(EXAMPLE), "--t-end", "10", "--out", str(out)]
        rows = [
            measure("python alone", [*python, "-c", "pass"], cache, arguments.repeats),
            measure("import flyball", [*python, "-c", "import flyball"], cache, arguments.repeats),
        ]
        print(timing.table(rows, COLUMNS), flush=True)
        rows += [
            measure("slider-crank 10 s, empty cache", motion, cache, 1),
            measure("slider-crank 10 s, warm cache", motion, cache, arguments.repeats),
            measure("two boxes fall on a floor 1 s, empty cache", [*python, "-c", PILE], Path(folder, "other"), 1),
            measure("two boxes, warm cache", [*python, "-c", PILE], Path(folder, "other"), arguments.repeats),
        ]
        if not out.is_dir() or not any(out.iterdir()):
            raise SystemExit("the command line wrote nothing: no motion was computed")
    print(timing.table(rows[2:], COLUMNS))
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
