"""N-four-bar for 10 s at an energy error of 1e-3 J: flyball and its peers side by side in one run.

Every engine gets the loosest setting that meets the target: a peer with fixed steps the smallest number of steps, found
by doubling and one bisection; flyball the loosest tolerance on a grid of half decades, with its own error control and
stabilization on. Then all are timed in turn. Usage: ``python fourbars.py [N ...] [--json FILE]``.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Callable
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np

from mechanisms import Planar, energy, flyball_planar, fourbars, fourbars_exact, gap, point

T_END, TARGET, SAMPLES, REPEATS = 10.0, 1e-3, 400, 3
TOLERANCES = tuple(10.0 ** (-e / 2) for e in range(6, 19))
METHODS = ("dop853", "rk45")
ATOL = 1e-2  # atol / rtol, as in flyball's defaults

# module, setting, first number of steps, largest N it is tried for
PEERS = (
    ("exudyn", "generalised-alpha 0.95", {1: 4000, 10: 8000, 40: 32000}, 40),
    ("exudyn", "generalised-alpha 0.7", {1: 4000, 10: 16000}, 10),
    ("exudyn", "generalised-alpha 0.95, full Newton", {1: 4000, 10: 16000}, 10),
    ("exudyn", "trapezoidal, index 2", {1: 4000}, 1),
    ("mujoco", "RK4, stiff", {1: 800, 10: 1600, 40: 3200}, 40),
    ("mujoco", "RK4, softer (4 steps)", {1: 800, 10: 1600, 40: 3200}, 40),
    ("pinocchio", "constraintDynamics, Python RK4", {1: 400, 10: 400, 40: 800}, 40),
)
GIVE_UP = 30.0  # CPU seconds of one run beyond which a peer's search ends

COLUMNS = {
    "n": "N",
    "engine": "engine",
    "setting": "setting",
    "resolution": "steps or rtol",
    "steps": "steps",
    "energy_error": "energy error [J]",
    "end_error": "end error [m]",
    "gap": "gap [m]",
    "cpu_ms": "CPU ms per s",
    "with_output_ms": "with output",
    "call_ms": "whole call",
}


def accuracy(p: Planar, n: int, q: np.ndarray, v: np.ndarray) -> dict[str, float]:
    """Energy error, error of the first joint on top at the end, and largest gap; the same for every engine."""
    if not (np.isfinite(q).all() and np.isfinite(v).all()) or len(q) < SAMPLES:
        return {"energy_error": float("inf")}
    e = energy(p, q, v)
    end = point(q[-1:], 0, (0.5, 0.0))[0] - fourbars_exact(n, np.array([0.0, T_END]))[-1]
    return {"energy_error": float(np.abs(e - e[0]).max()), "end_error": float(np.abs(end).max()), "gap": gap(p, q)}


def try_peer(module: Any, model: Any, p: Planar, n: int, steps: int, setting: str) -> tuple[dict[str, float], float]:
    """(accuracy, CPU seconds) of a peer at so many steps; a solver that gives up has an infinite error."""
    try:
        q, v, seconds = module.solve(model, T_END, steps, setting, SAMPLES)
    except (RuntimeError, ValueError, np.linalg.LinAlgError):
        return {"energy_error": float("inf")}, 0.0
    return accuracy(p, n, q, v), seconds


def find_peer(n: int, p: Planar, name: str, setting: str, steps: int) -> dict[str, Any]:
    """The fewest steps that meet the target, by doubling and one bisection; the best seen if none do."""
    module = importlib.import_module(f"peer_{name}")
    model = p if name == "exudyn" else n
    row: dict[str, Any] = {"n": n, "engine": name, "setting": setting, "met": False, "energy_error": float("inf")}
    while True:
        found, seconds = try_peer(module, model, p, n, steps, setting)
        if found["energy_error"] <= row["energy_error"]:
            row |= found | {"resolution": steps, "steps": steps}
        if found["energy_error"] <= TARGET:
            row["met"] = True
            break
        if seconds > GIVE_UP or steps > 1_000_000:
            break
        steps *= 2
    if row["met"]:
        between, _ = try_peer(module, model, p, n, steps * 3 // 4, setting)
        if between["energy_error"] <= TARGET:
            row |= between | {"resolution": steps * 3 // 4, "steps": steps * 3 // 4}
    row["clock"] = lambda: module.solve(model, T_END, row["steps"], setting)[2]
    return row


def coordinates(run: Any, rods: int) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and rates of flyball's result, (times, bodies, 3)."""
    views = [run[f"rod{i}"] for i in range(rods)]
    q = np.stack([np.column_stack([b.position, b.angle]) for b in views], axis=1)
    return q, np.stack([np.column_stack([b.velocity, b.angular_velocity]) for b in views], axis=1)


def find_flyball(n: int, p: Planar, method: str) -> dict[str, Any]:
    """The loosest tolerance of the grid that meets the target, with default stabilization."""
    from flyball import FlyballError

    model = flyball_planar(p)
    row: dict[str, Any] = {"n": n, "engine": "flyball", "setting": method, "met": False, "failed": []}
    row["energy_error"] = float("inf")
    for rtol in TOLERANCES:
        options = {"rtol": rtol, "atol": ATOL * rtol, "method": method}
        try:
            run = model.simulate(T_END, outputs=SAMPLES + 1, **options)
        except FlyballError as error:
            row["failed"].append(f"rtol {rtol:.1e}: {error}")
            continue
        found = accuracy(p, n, *coordinates(run, len(p.mass)))
        if found["energy_error"] > row["energy_error"]:
            continue
        row |= found | {"resolution": rtol, "steps": run.health.steps + run.health.rejected}
        row |= {"evaluations": run.health.evaluations, "factorisations": run.health.factorisations}
        if row["energy_error"] <= TARGET:
            row["met"] = True
            break
    row["model"], row["options"] = model, options
    return row


def clocks_of(row: dict[str, Any]) -> dict[str, Callable[[], float]]:
    """What is timed for one row. flyball: the call with output times, without, and the one that integrates nothing."""
    if row["engine"] != "flyball":
        return {"cpu": row.pop("clock")}
    model, options = row.pop("model"), row.pop("options")

    def clock(t_end: float, outputs: int) -> Callable[[], float]:
        return lambda: timing.cpu(lambda: model.simulate(t_end, outputs=outputs, **options))

    return {"call": clock(T_END, SAMPLES + 1), "bare": clock(T_END, 2), "nothing": clock(1e-9, 2)}


def compare(n: int) -> list[dict[str, Any]]:
    """All engines for one N: searched, then timed in turn."""
    p = fourbars(n)
    rows = [find_flyball(n, p, method) for method in METHODS]
    for name, setting, first, largest in PEERS:
        if n <= largest:
            rows.append(find_peer(n, p, name, setting, first.get(n, 400 * n)))
            print(f"  found {n} {name} {setting}: {rows[-1].get('resolution')}", flush=True)
    clocks = {(i, key): clock for i, row in enumerate(rows) if row["met"] for key, clock in clocks_of(row).items()}
    seconds = timing.interleaved(clocks, REPEATS)
    for i, row in enumerate(rows):
        if not row["met"]:
            row["resolution"] = f"not met ({timing.text(row.get('resolution'))})"
        elif row["engine"] == "flyball":
            call, bare, nothing = (1e3 * seconds[i, key] / T_END for key in ("call", "bare", "nothing"))
            row |= {"cpu_ms": bare - nothing, "with_output_ms": call - nothing, "call_ms": call}
        else:
            row["cpu_ms"] = 1e3 * seconds[i, "cpu"] / T_END
    return [{k: v for k, v in row.items() if not callable(v) and k not in ("model", "options")} for row in rows]


def ratios(rows: list[dict[str, Any]]) -> str:
    """Best peer over flyball's best, for stepping alone and for flyball's whole call."""
    peers = [r for r in rows if r["engine"] != "flyball" and r["met"]]
    ours = [r for r in rows if r["engine"] == "flyball" and r["met"]]
    if not peers or not ours:
        return "no ratio: the target was not met by both sides"
    peer = min(peers, key=lambda r: r["cpu_ms"])
    texts = [f"N = {rows[0]['n']}: best peer {peer['engine']} {peer['cpu_ms']:.3g} ms per s"]
    for key, label in (("cpu_ms", "stepping alone"), ("with_output_ms", "with 401 outputs"), ("call_ms", "whole call")):
        best = min(r[key] for r in ours)
        texts.append(f"flyball {label} {best:.3g} ms, ratio {peer['cpu_ms'] / best:.2f}")
    return "; ".join(texts)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("n", nargs="*", type=int, help="numbers of windows (1 10 40)")
    parser.add_argument("--json", metavar="FILE", help="write the rows")
    arguments = parser.parse_args()
    rows, lines = [], []
    for n in arguments.n or [1, 10, 40]:
        found = compare(n)
        rows += found
        lines.append(ratios(found))
        print(timing.table(found, COLUMNS), lines[-1], sep="\n", flush=True)
        for row in found:
            for text in row.get("failed", []):
                print(f"  flyball {row['setting']} failed at {text}")
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
