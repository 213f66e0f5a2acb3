"""The weights of ``flyball.tables.coordinate_choice``: fitted to the time of a stage in both coordinate layers.

Prints measured and estimated microseconds a stage, which layer is faster, which one the estimate takes, and the fitted
weights. Usage: ``python costs.py [--fit]``.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from mechanisms import flyball_planar, fourbars

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

CPU, STEPS, STAGES = 0.05, 40, 12  # a run is repeated for so many CPU seconds; steps tried in it
FAMILIES, SEEDS = ("chains", "trees", "loops", "redundant", "couplings", "windows"), range(4)


def cases() -> Iterator[tuple[str, Any]]:
    """Names and mechanisms: the examples, ladders of windows, random families."""
    import flyball as fb

    for path in sorted((ROOT / "examples").glob("*.toml")):
        yield path.stem, fb.load(path)
    for n in (1, 3, 10, 40):
        yield f"windows {n}", flyball_planar(fourbars(n))
    from tests.robust.families import made

    for family in FAMILIES:
        for seed in SEEDS:
            yield f"{family} {seed}", made(family, seed).mechanism


def stage_time(model: Any, coordinates: str) -> tuple[float, dict[str, float], Any]:
    """(microseconds a stage, counts, start) of one mechanism."""
    from flyball.engine.entry_point import INTEGRATE
    from flyball.numerics.integrators.butcher_tableaux import tableau
    from flyball.progress import no_progress
    from flyball.simulation.initial_state import find_initial_state
    from flyball.simulation.integration_options import default_integration
    from flyball.simulation.simulate import clock_for, run_compiled_loop
    from flyball.tables.coordinate_choice import work_counts

    model = model.snapshot()
    start = find_initial_state(model, 0.0, None, None, coordinates)
    options = default_integration(coordinates, 1e-7, 1e-9, STEPS)
    found = []
    spent = 0.0
    while spent < CPU or len(found) < 3:
        clock = clock_for(start, 0.0, 10.0, np.array([10.0]), options)
        begun = time.process_time()
        run_compiled_loop(start.assembly, clock, tableau("dop853"), no_progress, INTEGRATE)
        seconds = time.process_time() - begun
        spent += seconds
        found.append(seconds / (clock.count.accepted + clock.count.rejected) / STAGES)
    return 1e6 * float(np.median(found)), work_counts(start.assembly.compiled.structure), start


def measure() -> list[dict[str, Any]]:
    """One row for each mechanism and layer."""
    from flyball import FlyballError

    rows = []
    for name, model in cases():
        for layer in ("absolute", "joint"):
            try:
                us, n, start = stage_time(model, layer)
            except (FlyballError, ZeroDivisionError) as error:
                print(f"{name}, {layer}: {str(error)[:80]}", file=sys.stderr)
                continue
            if start.coordinates.startswith(layer):
                rows.append({"name": name, "layer": layer, "us": us, "counts": n})
    return rows


def fit(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Weights [ns] that fit the measured times, relative to each; none is negative."""
    names = list(rows[0]["counts"])
    A = np.array([[r["counts"][k] / r["us"] for k in names] for r in rows])
    x = lsq_linear(A, np.full(len(rows), 1000.0), (0.0, np.inf)).x
    return dict(zip(names, x.tolist(), strict=True))


def compare(rows: list[dict[str, Any]], estimate: Callable[[dict[str, float]], float]) -> None:
    """Print measured and estimated times side by side."""
    of = {(r["name"], r["layer"]): r for r in rows}
    right = lost = total = 0.0
    for name in dict.fromkeys(r["name"] for r in rows):
        if (name, "absolute") not in of or (name, "joint") not in of:
            continue
        here, there = of[name, "absolute"], of[name, "joint"]
        e, f = (estimate(r["counts"]) / 1000.0 for r in (here, there))
        chosen = there if f < e else here
        best = min(here["us"], there["us"])
        right += chosen["us"] == best
        lost = max(lost, chosen["us"] / best)
        total += 1
        mark = "" if chosen["us"] <= 1.1 * best else f"  {chosen['us'] / best:.2f} times the better"
        print(f"{name:24s} absolute {here['us']:8.2f} ({e:8.2f})  joint {there['us']:8.2f} ({f:8.2f}){mark}")
    print(f"the faster layer was chosen for {right:.0f} of {total:.0f}; at worst {lost:.2f} times the better time")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fit", action="store_true", help="fit the weights anew")
    chosen = parser.parse_args()
    rows = measure()
    if chosen.fit:
        weights = fit(rows)
        print({k: round(v, 1) for k, v in weights.items()})
        compare(rows, lambda n: sum(weights[k] * n[k] for k in n))
    else:
        from flyball.tables.coordinate_choice import estimated_time

        compare(rows, estimated_time)


if __name__ == "__main__":
    main()
