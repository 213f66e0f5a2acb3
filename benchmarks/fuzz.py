"""Thousands of random mechanisms and contact scenes, judged from outside: which agree, are refused, warned of, wrong.

Judges are formulas for poses and velocities (`fuzzing/physics.py`, `fuzzing/touching.py`), and the same motion by other
ways (`fuzzing/relations.py`). A case comes from the name of its family and a seed alone.
Usage: ``python fuzz.py``, or ``python fuzz.py --families loops dropped --first 1000 --count 50 --relations 15``.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

import timing
from fuzzing.content import KNOWN, NEW
from fuzzing.relations import RELATIONS
from fuzzing.scenes import SCENES
from fuzzing.verdicts import ALL, KINDS, Verdict, judged

COLUMNS = {"family": "family", **{k: k for k in KINDS}, "compared": "compared", "seconds": "seconds"}
GROUPS = {"mechanisms": [*NEW, *KNOWN], "new": list(NEW), "known": list(KNOWN), "contact": list(SCENES)}


def family(name: str, seeds: range, arguments: argparse.Namespace, listed: list[Verdict]) -> dict[str, Any]:
    """One row of the table; what does not agree is kept."""
    count: Counter[str] = Counter()
    seconds, compared = 0.0, 0
    for seed in seeds:
        verdict = judged(name, seed, arguments.relations, arguments.only)
        count[verdict.kind] += 1
        seconds += verdict.seconds
        compared += sum(v in ("agrees", "differs") for v in verdict.outcomes.values())
        if verdict.kind in ("wrong", "uneven") or (arguments.all and verdict.kind != "agrees"):
            listed.append(verdict)
            print("\n".join(lines(verdict)), flush=True)
    return {"family": name, **{k: count[k] for k in KINDS}, "compared": compared, "seconds": seconds}


def lines(v: Verdict) -> list[str]:
    """What is said of a case."""
    return [f"{v.family} {v.seed} {v.kind}: {f}" for f in v.findings]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    names = [*GROUPS, *ALL]
    parser.add_argument("--families", nargs="*", choices=names, default=["mechanisms", "contact"], metavar="NAME")
    parser.add_argument("--first", type=int, default=0, help="first seed (0)")
    parser.add_argument("--count", type=int, default=100, help="seeds of each family (100: 3000 mechanisms)")
    parser.add_argument(
        "--relations", type=int, default=4, help="other ways in which each motion is computed (4; 15: all)"
    )
    parser.add_argument("--only", nargs="*", choices=list(RELATIONS), metavar="NAME", help="these ways and no others")
    parser.add_argument("--all", action="store_true", help="list what is refused and warned of, too")
    parser.add_argument("--json", metavar="FILE", help="write rows and verdicts")
    arguments = parser.parse_args()
    chosen = [f for name in arguments.families for f in GROUPS.get(name, [name])]
    listed: list[Verdict] = []
    seeds = range(arguments.first, arguments.first + arguments.count)
    rows = [family(name, seeds, arguments, listed) for name in dict.fromkeys(chosen)]
    rows.append({"family": "all"} | {k: sum(r[k] for r in rows) for k in list(COLUMNS)[1:]})
    print(timing.table(rows, COLUMNS))
    told = [
        {"family": v.family, "seed": v.seed, "kind": v.kind, "findings": list(map(str, v.findings))} for v in listed
    ]
    timing.write_json(arguments.json, [*rows, *told])


if __name__ == "__main__":
    main()
