"""Signed distances of every kind of pair of convex shapes against coal: 10,000 random pairs a kind.

A quarter of the pairs are apart or anywhere, a quarter deep in each other, a quarter graze (gaps within 1e-6 m), a
quarter are degenerate (parallel, in line, coincident). Where both differ by more than the tolerance a direction
decides: one that separates the shapes by more than the other says refutes it. Printed: pairs, largest difference of
those that agree [m], how often coal was refuted, how often flyball was, and time a pair [us].

Usage: python benchmarks/distances.py [--pairs N] [--tolerance METRES] [--json FILE]
"""

from __future__ import annotations

import timing  # first: fixes the thread counts

import argparse  # isort: skip
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.contact.against import MODES, NAMES, PAIRS, asked, judged, sample
from tests.contact.pairs import separations


def row(pair: tuple[int, int], count: int, tolerance: float) -> dict:
    """One kind of pair over all modes."""
    out = {"pair": "-".join(NAMES[k] for k in pair), "pairs": 0, "difference": 0.0, "coal refuted": 0, "refuted": 0}
    for mode in MODES:
        s = sample(*pair, count // len(MODES), mode)
        start = time.process_time()
        separations(s.geometry, s.pose)
        out[f"us {mode}"] = (time.process_time() - start) / len(s.ours) * 1e6
        if not np.isfinite(s.core).all():
            raise SystemExit(f"{out['pair']}, {mode}: not finite")
        v = judged(s, asked(s), tolerance)
        out["pairs"] += v.count
        out["difference"] = max(out["difference"], v.difference)
        out["coal refuted"] += len(v.refuted)
        out["refuted"] += len(v.wrong)
    return out


def main() -> None:
    """Print the table."""
    p = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    p.add_argument("--pairs", type=int, default=10_000)
    p.add_argument("--tolerance", type=float, default=2e-7)
    p.add_argument("--json")
    a = p.parse_args()
    sample(*PAIRS[0], 4, "apart")  # compiles
    print(f"{'':22}{'pairs':>7}{'difference':>12}{'coal':>7}{'flyball':>9}" + "".join(f"{m:>12}" for m in MODES))
    print(f"{'':22}{'':>7}{'[m]':>12}{'refuted':>7}{'refuted':>9}" + f"{'us':>12}" * len(MODES))
    rows = []
    for pair in PAIRS:
        r = row(pair, a.pairs, a.tolerance)
        rows.append(r)
        times = "".join(f"{r[f'us {m}']:12.2f}" for m in MODES)
        print(
            f"{r['pair']:22}{r['pairs']:7}{r['difference']:12.1e}{r['coal refuted']:7}{r['refuted']:9}{times}",
            flush=True,
        )
    timing.write_json(a.json, rows)


if __name__ == "__main__":
    main()
