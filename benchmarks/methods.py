"""What each method costs at a given error: on Andrews' mechanism, the stiff governor A05 and a heavy top.

Usage: ``python methods.py [--error E]`` (of positions at eleven times, as a part of the mechanism's way; 1e-5). Each
method gets the loosest tolerance, or the longest step, that reaches it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np
from very_long import heavy_top

import flyball as fb

EXAMPLES = Path(__file__).parents[1] / "examples"
PROBLEMS: dict[str, tuple[Callable[[], fb.Mechanism], float]] = {
    "Andrews, 0.03 s": (lambda: fb.load(EXAMPLES / "andrews.toml"), 0.03),
    "governor A05, 1 s": (lambda: fb.load(EXAMPLES / "governor.toml"), 1.0),
    "heavy top, 1 s": (heavy_top, 1.0),
}
METHODS: dict[str, dict[str, Any]] = {
    "dop853": {"method": "dop853"},
    "rk45": {"method": "rk45"},
    "radau": {"method": "radau"},
    "radau, index 3": {"method": "radau", "stabilization": "none", "coordinates": "absolute"},
    "generalised-alpha": {"method": "generalised-alpha"},
    "variational": {"method": "variational"},
}
EVEN = ("generalised-alpha", "variational")
DEAR = 10.0  # CPU seconds of a run above which a method is given up


def choices(name: str, t_end: float) -> list[dict[str, float]]:
    """From loose to tight; steps of fixed width end at the output times."""
    if name in EVEN:
        return [{"step": t_end / (10 * 2**n), "rtol": 1e-9} for n in range(1, 18)]
    return [{"rtol": x} for x in 10.0 ** -np.arange(3.0, 12.5, 0.5)]


def missed(r: fb.Result, exact: fb.Result, m: fb.Mechanism) -> float:
    """Error of positions as a part of the way that mass centres go."""
    way = max(np.abs(exact[b.name].position - exact[b.name].position[0]).max() for b in m.bodies)
    return max(np.abs(r[b.name].position - exact[b.name].position).max() for b in m.bodies) / way


def cheapest(m: fb.Mechanism, t_end: float, exact: fb.Result, name: str, asked: float) -> dict[str, Any]:
    """Figures of the first choice that reaches the error."""
    for choice in choices(name, t_end):
        options = METHODS[name] | choice | {"outputs": 11, "specialize": "auto" if name in EVEN else False}
        if name not in ("dop853", "rk45"):
            del options["specialize"]
        try:
            error = missed(m.simulate(t_end, **options), exact, m)
        except fb.SimulationError:
            continue
        clock = [timing.cpu(lambda options=options: m.simulate(t_end, **options)) for _ in range(3)]
        if error <= asked:
            steps = m.simulate(t_end, **options).health.steps
            return {"error": error, "steps": steps, "cpu": 1e3 * min(clock)} | choice
        if min(clock) > DEAR:
            break
    return {"error": np.nan, "steps": 0, "cpu": np.nan}


def main() -> None:
    """Run all, print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--error", type=float, default=1e-5)
    asked = parser.parse_args()
    rows = []
    for problem, (make, t_end) in PROBLEMS.items():
        m = make()
        exact = m.simulate(t_end, outputs=11, rtol=1e-12)
        for name in METHODS:
            rows.append({"problem": problem, "method": name} | cheapest(m, t_end, exact, name, asked.error))
    columns = {
        "problem": "problem", "method": "method", "rtol": "rtol", "step": "step [s]", "steps": "steps",
        "error": "error", "cpu": "CPU [ms]",
    }  # fmt: skip
    print(timing.table([{k: row.get(k, "") for k in columns} for row in rows], columns))


if __name__ == "__main__":
    main()
