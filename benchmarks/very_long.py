"""Ten million steps of a free body and of a heavy top by the variational method: drift of energy and momentum.

Usage: ``python very_long.py [--quick] [--figure FILE]`` (a hundredth of the steps; a picture of the drifts).
"""

from __future__ import annotations

import argparse
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np

import flyball as fb
from mechanisms import free_body

STEPS = 10_000_000
CASES = {"free body": 0.02, "heavy top": 0.0005}
"""Width of steps [s]: some 0.1 rad of turn each."""
COLUMNS = {
    "case": "case",
    "method": "method",
    "steps": "steps",
    "t_end": "t end [s]",
    "energy": "energy, largest",
    "trend": "energy, trend",
    "momentum": "momentum, largest",
    "cpu": "CPU [s]",
}


def heavy_top() -> fb.Mechanism:
    """Geradin and Cardona's, spinning at 150 rad/s about a fixed point, with no axis along gravity."""
    m = fb.Mechanism("heavy top", gravity=(0, 0, -9.81))
    m.add(
        fb.Body(
            "body", mass=15.0, inertia=(0.234375, 0.46875, 0.234375), position=(0, 1, 0), velocity=(4.61538, 0, 0),
            angular_velocity=(0, 150, -4.61538),
        )
    )  # fmt: skip
    m.add(fb.Spherical("tip", "ground", "body", at=(0, 0, 0)))
    return m


def run(case: str, steps: int, times: np.ndarray, **options: Any) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """(figures, relative errors of the energy, and of the momentum that is kept), at the times."""
    m = free_body() if case == "free body" else heavy_top()
    t_end = steps * CASES[case]
    m.simulate(CASES[case], outputs=2, **options)
    found = []
    seconds = timing.cpu(lambda: found.append(m.simulate(t_end, outputs=times * t_end, max_steps=2 * steps, **options)))
    r = found[-1]
    kinetic = r.energy.kinetic
    energy = r.energy.total
    off = (energy - energy[0]) / kinetic[0]
    L = momentum(r, m["body"])
    kept = L[:, 2:] if case == "heavy top" else L
    turn = np.linalg.norm(kept - kept[0], axis=1) / np.linalg.norm(L[0])
    trend = np.polyfit(r.t / t_end, off, 1)[0]
    figures = {
        "case": case, "method": options["method"], "steps": r.health.steps, "t_end": t_end,
        "energy": float(np.abs(off).max()), "trend": float(trend), "momentum": float(turn.max()), "cpu": seconds,
    }  # fmt: skip
    return figures, off, turn


def momentum(r: fb.Result, body: fb.Body) -> np.ndarray:
    """Angular momentum about the origin (n, 3)."""
    b = r["body"]
    J = r.values.system.bodies.inertia[0].reshape(3, 3)
    spin = np.einsum("nij,jk,nlk,nl->ni", b.rotation, J, b.rotation, b.angular_velocity)
    return spin + r.values.system.bodies.mass[0] * np.cross(b.position, b.velocity)


def draw(path: str, steps: int, times: np.ndarray, curves: dict[str, tuple[np.ndarray, np.ndarray]]) -> None:
    """Both drifts over the number of steps."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained", sharex=True)
    for name, (energy, turn) in curves.items():
        for ax, y in zip(axes, (energy, turn), strict=True):
            ax.loglog(times[1:] * steps, np.maximum(np.abs(y[1:]), 1e-17), lw=0.9, label=name)
    for ax, what in zip(axes, ("energy / kinetic energy", "angular momentum kept, relative"), strict=True):
        ax.set_xlabel("steps")
        ax.set_title(f"error of {what}", fontsize=10)
        ax.grid(alpha=0.3)
    axes[0].legend(fontsize=8)
    figure.savefig(path, dpi=110)


def main() -> None:
    """Run all, print the table, draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--figure")
    asked = parser.parse_args()
    steps = STEPS // 100 if asked.quick else STEPS
    times = np.unique(np.r_[0, np.round(np.geomspace(1, steps, 1500))]) / steps  # ends of steps
    rows, curves = [], {}
    for case, step in CASES.items():
        figures, energy, turn = run(case, steps, times, method="variational", step=step)
        rows.append(figures)
        curves[f"{case}, variational"] = (energy, turn)
        figures, energy, turn = run(case, steps, times, method="rk45", step=step, specialize=False)
        rows.append(figures)
        curves[f"{case}, Runge-Kutta of order 5"] = (energy, turn)
    print(timing.table(rows, COLUMNS))
    if asked.figure:
        draw(asked.figure, steps, times, curves)


if __name__ == "__main__":
    main()
