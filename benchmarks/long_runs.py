"""Long motions against closed forms: the pendulum A01 over 2000 s and a free body over 1000 s.

Usage: ``python long_runs.py [--quick]`` (a tenth of the time).
"""

from __future__ import annotations

import argparse
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np

from mechanisms import MOMENTS, SPIN, free_body, free_body_exact, pendulum, pendulum_exact

COLUMNS = {
    "case": "case",
    "t_end": "t end [s]",
    "rtol": "rtol",
    "error": "largest error",
    "last": "error at the end",
    "energy": "energy [J]",
    "momentum": "momentum",
    "steps": "steps",
    "refused": "refused",
    "cpu_ms": "CPU ms per s",
}


def pendulum_run(t_end: float, rtol: float) -> dict[str, Any]:
    """Error of the mass's position [m]."""
    run, seconds = timed(pendulum(), t_end, rtol)
    error = np.abs(run["mass"].position - pendulum_exact(run.t)).max(axis=1)
    return common("A01 pendulum [m]", run, error, seconds, rtol)


def free_body_run(t_end: float, rtol: float) -> dict[str, Any]:
    """Error of the angular velocity in body axes [rad/s], and of the angular momentum in the world, relative."""
    run, seconds = timed(free_body(), t_end, rtol)
    body = run["body"]
    spin = np.einsum("nji,nj->ni", body.rotation, body.angular_velocity)
    error = np.abs(spin - free_body_exact(run.t)).max(axis=1)
    first = np.multiply(MOMENTS, SPIN)
    momentum = np.einsum("nij,nj->ni", body.rotation, spin * MOMENTS)
    row = common("free body [rad/s]", run, error, seconds, rtol)
    return row | {"momentum": float(np.abs(momentum - first).max() / np.linalg.norm(first))}


def timed(model: Any, t_end: float, rtol: float) -> tuple[Any, float]:
    """(result with two outputs a second, CPU seconds of the second of two calls)."""
    model.simulate(0.01, outputs=2)
    found = []
    seconds = timing.cpu(
        lambda: found.append(model.simulate(t_end, rtol=rtol, atol=1e-2 * rtol, outputs=int(2 * t_end) + 1))
    )
    return found[0], seconds


def common(case: str, run: Any, error: np.ndarray, seconds: float, rtol: float) -> dict[str, Any]:
    """Figures that every case has."""
    t_end = float(run.t[-1])
    row = {"case": case, "t_end": t_end, "rtol": rtol, "error": float(error.max()), "last": float(error[-1])}
    row |= {"energy": run.health.energy_drift, "steps": run.health.steps, "refused": run.health.rejected}
    return row | {"cpu_ms": 1e3 * seconds / t_end}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a tenth of the time")
    parser.add_argument("--json", metavar="FILE", help="write the rows")
    arguments = parser.parse_args()
    share = 0.1 if arguments.quick else 1.0
    rows = [pendulum_run(2000.0 * share, rtol) for rtol in (1e-8, 1e-10, 1e-12)]
    rows += [free_body_run(1000.0 * share, rtol) for rtol in (1e-8, 1e-10, 1e-12)]
    print(timing.table(rows, COLUMNS))
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
