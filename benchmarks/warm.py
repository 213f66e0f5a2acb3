"""What asking again costs: calls of ``simulate`` that integrate next to nothing, and a sweep of a thousand motions.

Usage: python benchmarks/warm.py [--json FILE] [--runs N]
"""

from __future__ import annotations

import timing  # first: fixes the thread counts

import argparse  # isort: skip
import json
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import flyball as fb
from mechanisms import Kernel, example

NOTHING = 1e-6  # [s] of motion that no one waits for
REPEATS = 40


def chain(n: int) -> fb.Mechanism:
    """A planar pendulum of n links; a parameter is the mass of the first."""
    m = fb.Mechanism(f"chain of {n}", planar=True, gravity=(0, -9.81), parameters={"mass": 1.0})
    for k in range(n):
        m.add(fb.Body(f"b{k}", mass=1 if k else "mass", inertia=0.01, position=(k + 0.5, 0)))
        m.add(fb.Revolute(f"j{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=(k, 0)))
    return m


def stewart() -> fb.Mechanism:
    """The example with a parameter: the platform's mass."""
    given = example("stewart.py")
    m = fb.Mechanism(given.name, gravity=given.gravity, parameters={"mass": 1.0})
    for e in given.elements():
        heavy = e is given["platform"]
        m.add(fb.Body("platform", **fields(e, mass=f"{e.mass}*mass")) if heavy else e)
    return m


def fields(e: Any, **other: Any) -> dict[str, Any]:
    """Fields of an element as written, some of them changed."""
    from flyball.model.element import written_fields

    return {k: v for k, v in (written_fields(e) | other).items() if k not in ("name", "shape")} | {"shape": e.shape}


MECHANISMS: dict[str, tuple[Callable[[], fb.Mechanism], str]] = {
    "slider-crank": (lambda: example("slider_crank.toml"), "speed"),
    "Andrews": (lambda: example("andrews.toml"), "torque"),
    "Stewart platform": (stewart, "mass"),
    "chain of 100": (lambda: chain(100), "mass"),
}


def least(call: Callable[[int], Any]) -> float:
    """Milliseconds of CPU time, the least of some calls."""
    return 1e3 * min(timing.cpu(lambda k=k: call(k)) for k in range(REPEATS))


def calls(name: str) -> dict[str, float]:
    """A first, a same and another call."""
    make, parameter = MECHANISMS[name]
    m = make()
    value = m.environment()[parameter]
    make().simulate(NOTHING, outputs=2)  # loads what is compiled
    first = statistics.median(1e3 * timing.cpu(lambda: make_ready(make())) for _ in range(5))
    m.simulate(NOTHING, outputs=2)
    return {
        "first": first,
        "same": least(lambda k: m.simulate(NOTHING, outputs=2)),
        "other": least(lambda k: m.simulate(NOTHING, outputs=2, parameters={parameter: value * (1 + 1e-6 * (k + 1))})),
    }


def make_ready(m: fb.Mechanism) -> None:
    """The first call of a mechanism."""
    m.simulate(NOTHING, outputs=2)


def sweep(runs: int) -> dict[str, float]:
    """Andrews' mechanism over 0.03 s with that many torques: CPU seconds of the loop alone, and of the calls."""
    m = example("andrews.toml")
    torque = m.environment()["torque"]
    m.simulate(0.03)
    kernel = Kernel(m, 0.03, 501, rtol=1e-7)
    kernel.seconds()
    inside, outside = 0.0, 0.0
    for k in range(runs):
        if k % 10 == 0:
            inside += 10 * kernel.seconds()
        begin = time.process_time()
        m.simulate(0.03, parameters={"torque": torque * (1 + 1e-4 * k)})
        outside += time.process_time() - begin
    return {"runs": runs, "kernel": inside, "calls": outside, "beyond": 1e3 * (outside - 1.3 * inside) / runs}


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--runs", type=int, default=1000)
    asked = parser.parse_args()
    print(timing.heading(), "\n")
    print(
        f"A call with two outputs over {NOTHING:g} s [ms]: of a new mechanism, of a known one, at another parameter\n"
    )
    rows = {}
    for name in MECHANISMS:
        rows[name] = r = calls(name)
        print(f"{name:18} first {r['first']:8.2f}   same {r['same']:7.3f}   other {r['other']:7.2f}", flush=True)
    s = sweep(asked.runs)
    print(
        f"\n{asked.runs} runs of Andrews' mechanism over 0.03 s, 501 outputs each: loop {s['kernel']:.2f} s, "
        f"calls {s['calls']:.2f} s, {s['beyond']:.2f} ms a run beyond 1.3 times the loop"
    )
    if asked.json:
        asked.json.write_text(json.dumps({"machine": timing.machine(), "calls": rows, "sweep": s}, indent=1))


if __name__ == "__main__":
    main()
