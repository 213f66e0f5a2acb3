"""Where flyball's time goes on the N-four-bar: counts and microseconds. Usage: ``python breakdown.py [N ...]``.

``stepping``: the compiled loop with two output times. ``output``: what 401 add to it. ``fixed``: what the whole call
takes besides the loop: preparation and report.
"""

from __future__ import annotations

import argparse
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
from mechanisms import Kernel, flyball_planar, fourbars

T_END, OUTPUTS, REPEATS = 10.0, 401, 5
COLUMNS = {
    "n": "N",
    "method": "method",
    "rtol": "rtol",
    "energy_error": "energy error [J]",
    "steps": "steps",
    "rejected": "refused",
    "evaluations": "evaluations",
    "factorisations": "factorisations",
    "fixed_ms": "fixed [ms]",
    "output_ms": "output [ms]",
    "stepping_ms": "stepping [ms]",
    "us_per_evaluation": "us per evaluation",
    "us_per_step": "us per step tried",
}


def breakdown(n: int, method: str, rtol: float) -> dict[str, Any]:
    """Counts of one run without outputs, and medians of its three parts."""
    from flyball import FlyballError

    model = flyball_planar(fourbars(n))
    options = {"method": method, "rtol": rtol}
    row: dict[str, Any] = {"n": n, "method": method, "rtol": rtol}
    try:
        full = model.simulate(T_END, outputs=OUTPUTS, **options)
        health = model.simulate(T_END, outputs=2, **options).health
    except FlyballError as error:
        print(f"N = {n}, {method}, rtol {rtol:g}: {error}")
        return row
    row["energy_error"] = full.health.energy_drift
    row |= {key: getattr(health, key) for key in ("steps", "rejected", "evaluations", "factorisations")}
    clocks = {
        "call": lambda: timing.cpu(lambda: model.simulate(T_END, outputs=OUTPUTS, **options)),
        "stepping": Kernel(model, T_END, 2, **options).seconds,
        "loop": Kernel(model, T_END, OUTPUTS, **options).seconds,
    }
    seconds = timing.interleaved(clocks, REPEATS)
    stepping = seconds["stepping"]
    row["fixed_ms"] = 1e3 * (seconds["call"] - seconds["loop"])
    row["output_ms"] = 1e3 * (seconds["loop"] - stepping)
    row |= {"stepping_ms": 1e3 * stepping, "us_per_evaluation": 1e6 * stepping / health.evaluations}
    row["us_per_step"] = 1e6 * stepping / (health.steps + health.rejected)
    return row


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("n", nargs="*", type=int, help="numbers of windows (1 10 40)")
    parser.add_argument("--json", metavar="FILE", help="write the rows")
    arguments = parser.parse_args()
    cases = (("dop853", 1e-6), ("dop853", 1e-8), ("rk45", 1e-6))
    rows = [breakdown(n, *case) for n in arguments.n or [1, 10, 40] for case in cases]
    print(timing.table(rows, COLUMNS))
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
