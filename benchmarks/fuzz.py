"""Thousands of random mechanisms: how many run in good health, how many are refused and how, what is the worst.

A mechanism comes from the name of its family and a seed alone; what breaks is listed with both.
Usage: ``python fuzz.py``, or ``python fuzz.py --families loops friction --first 1000 --count 500``.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import timing

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.robust.families import FAMILIES, made
from tests.robust.verdict import Verdict, judge

import flyball as fb

KINDS = ("healthy", "warned", "ModelError", "AssemblyError", "SimulationError", "broken")
COLUMNS = {
    "family": "family",
    **{k: k for k in KINDS},
    "violation": "worst violation",
    "energy": "worst energy",
    "residual": "worst G vdot",
    "slowest": "slowest [s]",
    "seconds": "seconds",
}


def family(name: str, seeds: range, listed: list[str]) -> dict[str, Any]:
    """One row of the table; what breaks or draws a warning is added to the list."""
    count: Counter[str] = Counter()
    row: dict[str, Any] = {"family": name, "violation": 0.0, "energy": 0.0, "residual": 0.0, "slowest": 0.0}
    begin = time.process_time()
    for seed in seeds:
        verdict = judged(name, seed)
        count[verdict.kind] += 1
        if verdict.kind in ("broken", "warned"):
            listed.append(f"{name} {seed}: {verdict.kind}: {verdict.text}")
        if verdict.kind == "healthy":
            for key in ("violation", "energy", "residual"):
                row[key] = max(row[key], getattr(verdict, key))
        row["slowest"] = max(row["slowest"], verdict.seconds)
    return row | {k: count[k] for k in KINDS} | {"seconds": time.process_time() - begin}


def judged(name: str, seed: int) -> Verdict:
    """The verdict on one mechanism, however it fails."""
    try:
        return judge(made(name, seed))
    except Exception as error:
        return Verdict("broken", f"cannot be built: {type(error).__name__}: {error}")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--families", nargs="*", choices=list(FAMILIES), default=list(FAMILIES), metavar="NAME")
    parser.add_argument("--first", type=int, default=0, help="first seed (0)")
    parser.add_argument("--count", type=int, default=840, help="seeds of each family (840: ten thousand in all)")
    parser.add_argument("--json", metavar="FILE", help="write the rows")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", fb.PerformanceNotice)
    judge(made("chains", 0))  # what is not compiled yet is compiled here
    listed: list[str] = []
    seeds = range(arguments.first, arguments.first + arguments.count)
    rows = [family(name, seeds, listed) for name in arguments.families]
    total: dict[str, Any] = {"family": "all"}
    total |= {k: sum(r[k] for r in rows) for k in (*KINDS, "seconds")}
    total |= {k: max(r[k] for r in rows) for k in ("violation", "energy", "residual", "slowest")}
    print(timing.table([*rows, total], COLUMNS))
    for line in listed:
        print(line)
    timing.write_json(arguments.json, [*rows, total])


if __name__ == "__main__":
    main()
