"""Answers of one state of the source beside those of another: every curve of every result, to the last bit or to 1e-12.

All example files and random mechanisms (`fuzzing/`) in both coordinate layers: motions with every quantity that a
result has, events, linear equations at the start. Where arithmetic was changed, a motion is compared as far as rounding
can be told from the motion's own growth: beside each stands the same motion at a slightly other tolerance.
Usage: ``python answers.py record FILE`` in one checkout, ``python answers.py compare FILE`` in the other.
"""

from __future__ import annotations

import argparse
import os
import pickle
import subprocess
import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
from fuzzing import content, scenes, verdicts

import flyball as fb

ROOT = Path(__file__).resolve().parents[1]
Answer = dict[str, Any]
LAYERS = ("joint", "absolute")
OUTPUTS = 20
SPAN = 0.2  # of an example [s]
RTOL = 1e-9
EXACT, GROWN = 1e-12, 10.0
"""Allowed difference: this of the largest value of the curve, or so many times what another tolerance changes."""


def cases(seeds: int) -> Iterator[tuple[str, Any]]:
    """Names, and functions that return (mechanism, time span, options)."""
    for path in sorted((ROOT / "examples").glob("*.toml")):
        yield path.name, lambda path=path: (fb.load(path), SPAN, {})
    for family in [*content.FAMILIES, *scenes.SCENES]:
        for seed in range(seeds):
            yield f"{family} {seed}", lambda family=family, seed=seed: _random(family, seed)


def _random(family: str, seed: int) -> tuple[fb.Mechanism, float, dict[str, Any]]:
    case = verdicts.made(family, seed)
    dropped = ("rtol", "atol", "outputs", "max_steps", "coordinates")
    return case.mechanism, case.t_end, {k: v for k, v in case.options.items() if k not in dropped}


def answers(make: Any) -> Answer:
    """Every answer of a mechanism, by name: arrays, or the type of an error."""
    out: Answer = {}
    m, t_end, options = make()
    for layer in LAYERS:
        out |= _of(f"{layer} motion", lambda layer=layer: _motion(m, t_end, options | {"coordinates": layer}))
        if not isinstance(options.get("method"), fb.Stepping):
            near = options | {"coordinates": layer, "rtol": 1.1 * RTOL}
            out |= _of(f"{layer} nearby", lambda near=near: _motion(m, t_end, near))
    out |= _of("linear", lambda: {"A": m.linearize(frozen=True).A})
    return out


def _of(name: str, ask: Any) -> Answer:
    try:
        return {f"{name}: {k}": v for k, v in ask().items()}
    except Exception as error:
        return {f"{name}: error": type(error).__name__}


def _motion(m: fb.Mechanism, t_end: float, options: dict[str, Any]) -> Answer:
    chosen = {"progress": False, "outputs": OUTPUTS} | options
    if isinstance(options.get("method"), fb.Stepping):
        chosen.pop("rtol", None)
    else:
        chosen = {"rtol": RTOL, "max_steps": 20000} | chosen
    run = m.simulate(t_end, **chosen)
    data = run.to_xarray()
    out: Answer = {str(k): np.asarray(v) for k, v in data.data_vars.items() if np.asarray(v).dtype.kind == "f"}
    out["time"] = run.t
    out["events"] = np.array([e.t for e in run.events])
    out["names of events"] = [f"{e.name} {e.kind}" for e in run.events]
    return out


def difference(name: str, old: Answer, new: Answer) -> str:
    """What is said of an answer: ``bits``, ``close``, or how it differs."""
    a, b = old[name], new.get(name)
    if b is None:
        return f"{name}: is missing now"
    if isinstance(a, str | list) or isinstance(b, str | list):
        return "bits" if a == b else f"{name}: {a!r:.80} is {b!r:.80} now"
    if a.shape != b.shape:
        return f"{name}: shape {a.shape} is {b.shape} now"
    if np.array_equal(a, b, equal_nan=True):
        return "bits"
    size = float(np.nanmax(np.abs(a), initial=0.0))
    nearby = old.get(name.replace(" motion: ", " nearby: "))
    grown = np.abs(a - nearby) if isinstance(nearby, np.ndarray) and nearby.shape == a.shape else np.zeros(a.shape)
    allowed = EXACT * size + GROWN * np.maximum.accumulate(np.nan_to_num(grown), axis=0)
    excess = np.abs(a - b) - allowed
    if not (excess > 0.0).any() and np.array_equal(np.isnan(a), np.isnan(b)):
        return "close"
    return f"{name}: {np.nanmax(np.abs(a - b)):.3g} of {size:.3g}"


def record(path: Path, seeds: int) -> None:
    """Write the answers of this checkout."""
    commit = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True).stdout.strip()
    found = {name: answers(make) for name, make in cases(seeds)}
    path.write_bytes(pickle.dumps({"commit": commit, "seeds": seeds, "answers": found}))
    print(f"{len(found)} mechanisms at {commit[:12]}, {sum(map(len, found.values()))} answers")


def compare(path: Path) -> int:
    """Say how the answers of this checkout differ. Returns how many differ."""
    kept = pickle.loads(path.read_bytes())
    total: Counter[str] = Counter()
    for name, make in cases(kept["seeds"]):
        old, new = kept["answers"][name], answers(make)
        said = [difference(k, old, new) for k in old if " nearby: " not in k]
        said += [f"{k}: is new" for k in new if k not in old]
        differ = [s for s in said if s not in ("bits", "close")]
        total.update(s if s in ("bits", "close") else "differ" for s in said)
        for s in differ[:3]:
            print(f"{name}, {s}", flush=True)
    print(f"beside {kept['commit'][:12]}: " + ", ".join(f"{n} {k}" for k, n in sorted(total.items())))
    return total["differ"]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["record", "compare"])
    parser.add_argument("file", type=Path)
    parser.add_argument("--seeds", type=int, default=30, help="random mechanisms of each family (30: some 1000)")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    if arguments.what == "record":
        record(arguments.file, arguments.seeds)
    elif compare(arguments.file):
        sys.exit(1)


if __name__ == "__main__":
    main()
