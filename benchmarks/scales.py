"""Mechanisms in other units of length, mass and time, by powers of two: every number of the result is the scaled one.

Usage: ``python benchmarks/scales.py [--seeds N] [--only TEXT ...] [--analyses NAME ...] [--all-differences]``. Without
options motions of all examples and 200 random mechanisms in all six scales; ``--analyses all`` asks for all others, too
(`scaled_answers.ANALYSES`). What may differ, and why, is listed in `EXEMPT`.

Where libraries round otherwise in other units, `ROUNDED` says so, and numbers agree to `ROUNDING`: ``pow`` of the C
library, and LAPACK where it compares numbers with powers of ten or balances a matrix. Code made for one mechanism is
not compared: whether it is used depends on the time that its compilation takes.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import runpy
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
from fuzzing import content, scaled_answers, scenes, verdicts
from fuzzing.scaling import Scale, Unsupported, scaled

import flyball as fb
from flyball.simulation.integration_options import BAUMGARTE_RATE

ROUNDING = 1e-9  # difference by rounding of libraries, relative to the largest value of a curve
ROOT = Path(__file__).resolve().parents[1]
SCALES = {
    "mass up": Scale(mass=2.0**20), "mass down": Scale(mass=2.0**-20),
    "time up": Scale(time=2.0**10), "time down": Scale(time=2.0**-10),
    "length up": Scale(length=2.0**10), "length down": Scale(length=2.0**-10),
}  # fmt: skip
SPAN = 0.2  # of an example [s]
OUTPUTS = 11
MAX_STEPS = 3000
FAMILIES = (*content.FAMILIES, *scenes.SCENES)
MOTION = "simulate"
ROUNDED = {
    "assemble": "LAPACK: singular values of velocity equations in units of energy",
    "mobility": "LAPACK: singular values, and inverses of matrices that mix units",
    **dict.fromkeys(
        ("linearize", "modes", "kinematics", "inverse_dynamics"), "LAPACK: inverses of matrices that mix units"
    ),
    "equilibrium": "LAPACK: least squares of forces and gaps",
    **dict.fromkeys(
        ("sensitivity instant", "sensitivity equilibrium", "sensitivity modes"),
        "LAPACK: inverses of matrices that mix units",
    ),
}  # fmt: skip
"""Analyses in which a library rounds otherwise in other units, and where: they agree to `ROUNDING`."""
Made = tuple[fb.Mechanism, float, dict[str, Any]]


def cases(seeds: int) -> Iterator[tuple[str, Callable[[], Made]]]:
    """Names, and functions that return (mechanism, time span, options)."""
    for path in sorted((ROOT / "examples").glob("*.*")):
        if path.suffix in (".toml", ".py"):
            yield path.name, lambda path=path: _example(path)
    for family in FAMILIES:
        for seed in range(seeds):
            yield f"{family} {seed}", lambda family=family, seed=seed: _random(family, seed)


def _example(path: Path) -> Made:
    m = fb.load(path) if path.suffix == ".toml" else runpy.run_path(str(path))["mechanism"]()
    return m, SPAN, {"method": "impulse"} if any(isinstance(e, fb.Contact) for e in m.elements()) else {}


def _random(family: str, seed: int) -> Made:
    case = verdicts.made(family, seed)
    dropped = ("outputs", "max_steps")
    return case.mechanism, case.t_end, {k: v for k, v in case.options.items() if k not in dropped}


NOT_CONVERTED = {
    **dict.fromkeys(("cam_follower.toml", "gear_backlash.toml"), "play with weights"),
    **dict.fromkeys(("clock_escapement.toml", "geneva_drive.toml", "safety_brake.toml"), "events set parameters"),
    **dict.fromkeys(("dominoes.py", "pile_in_a_box.py", "silo.py", "wrecking_ball.py"), "sets of bodies"),
    **dict.fromkeys(("bin_picking.py", "hourglass.py", "rotating_drum.py", "wheel_in_gravel.py"), "sets of bodies"),
    "bogie_on_rollers.py": "laws of wheels on rails",
    "crane.toml": "ropes over pulleys",
    "excavator.py": "laws of linear actuators",
    "truck.py": "laws of gear boxes",
    **dict.fromkeys(("bogie.py", "differential.py", "planetary.py"), "sensors of angular velocities"),
}
"""Examples that `fuzzing.scaling` cannot write in other units."""
EXEMPT = {
    "shaken": "elastic ropes: places within a step at which both the force and the gap of a rope are guards",
    "soft": "pow() of overlaps rounds otherwise in other units of length",
}
"""Motions that may differ, by family, and why."""
ROBOTS = ("quadruped.py", "robot_arm_circle.py", "five_bar.py", "seven_axes.py", "governor_criterion.py", "truck.py")
"""Examples with laws of controllers, tables made by Python, roads or tyres, not rewritten here in other units."""
LARGE = ("tracked_vehicle_in_space.py",)
"""Examples that take minutes; the same elements are in smaller ones."""
UNDECIDED = {
    ("sticking 0", "kinematics"): "friction at rates that are rounding has their sign",
    ("car.toml", "singularities"): "its driver is along an angle of a body, which is no curve of a linear model",
}
"""Other analyses that may differ, and why."""


def is_exempt(name: str, scale: str, analysis: str = MOTION) -> bool:
    """Whether an answer may differ in that scale."""
    known = name.partition(" ")[0]
    if known in (*ROBOTS, *LARGE):
        return True
    if analysis != MOTION:
        return (name, analysis) in UNDECIDED
    return known in EXEMPT and (known == "shaken" or scale.startswith("length"))


def in_units(options: dict[str, Any], s: Scale) -> dict[str, Any]:
    """Options of `simulate` in other units."""
    out = dict(options)
    for name in ("max_step", "step"):
        if out.get(name) is not None:
            out[name] = out[name] * s.time
    if out.get("stabilization") == "baumgarte":  # its default rates are 10/s
        for name in ("alpha", "beta"):
            out[name] = (out.get(name) or BAUMGARTE_RATE) / s.time
    if isinstance(method := out.get("method"), fb.Stepping):
        units = {"step": s.time, "tolerance": s.length / s.time}
        given = {k: getattr(method, k) * x for k, x in units.items() if getattr(method, k) is not None}
        out["method"] = dataclasses.replace(method, **given)
    return out


def answers(m: fb.Mechanism, t_end: float, options: dict[str, Any], s: Scale) -> dict[str, Any]:
    """Everything a motion says, in the units before scaling: arrays, and texts without numbers."""
    chosen = {"outputs": OUTPUTS, "progress": False} | options
    if not any(isinstance(e, fb.Contact) for e in m.elements()):  # impulse time stepping has other options
        chosen = {"max_steps": MAX_STEPS, "specialize": False} | chosen
    try:
        run = m.simulate(t_end, **in_units(chosen, s))
    except fb.FlyballError as error:
        return {"error": type(error).__name__}
    out: dict[str, Any] = {"t": run.t / s.time} | scaled_answers.curves(run, s)
    out["events"] = [f"{e.name} {e.kind}" for e in run.events]
    out["event times"] = np.array([e.t for e in run.events]) / s.time
    out["energy lost"] = np.array([e.lost for e in run.events]) / s.of("J")
    out["counts"] = [run.health.steps, run.health.rejected]
    out["method"] = run.health.method.partition(":")[0]
    out["warnings"] = len(run.health.warnings)
    return out


def differences(one: dict[str, Any], other: dict[str, Any], allowed: float = 0.0) -> list[str]:
    """What differs by more than allowed, and by how much relative to the largest value."""
    out = [f"{k} is in one result only" for k in one.keys() ^ other.keys()]
    for k in one.keys() & other.keys():
        a, b = one[k], other[k]
        if not isinstance(a, np.ndarray):
            out += [f"{k}: {a!r:.60} and {b!r:.60}"] if a != b else []
        elif a.shape != b.shape:
            out.append(f"{k}: shapes {a.shape} and {b.shape}")
        elif not np.array_equal(a, b, equal_nan=True):
            size = np.nanmax(np.abs(a), initial=1e-300)
            off = np.nanmax(np.abs(a - b), initial=0.0) / size
            first = int(np.argmax(np.asarray(a != b).reshape(len(a), -1).any(axis=1))) if a.ndim else 0
            if not off <= allowed or not np.array_equal(np.isnan(a), np.isnan(b)):
                out.append(f"{k}: {off:.2g} from output {first}")
    return out


def compared(made: Made, names: list[str], analysis: str = MOTION) -> Iterator[tuple[str, list[str] | str]]:
    """(scale, differences or why there is no comparison) of each scale."""
    m, t_end, options = made
    own: dict[str, Any] | None = None
    allowed = ROUNDING if analysis in ROUNDED else 0.0

    def asked(m: fb.Mechanism, s: Scale) -> dict[str, Any]:
        return answers(m, t_end * s.time, options, s) if analysis == MOTION else scaled_answers.asked(analysis, m, s)

    for name in names:
        s = SCALES[name]
        try:
            other = scaled(m, s)
        except Unsupported as why:
            yield name, str(why)
            continue
        own = own or asked(scaled(m, Scale()), Scale())
        yield name, differences(own, asked(other, s), allowed)


def main() -> None:
    """Compare and report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5, help="random mechanisms of each family")
    parser.add_argument("--only", nargs="*", default=[], help="cases whose names contain one of these")
    parser.add_argument("--scales", nargs="*", default=list(SCALES))
    parser.add_argument("--analyses", nargs="*", default=[MOTION], help="names, or all")
    parser.add_argument("--all-differences", action="store_true")
    asked = parser.parse_args()
    analyses = [MOTION, *scaled_answers.ANALYSES] if asked.analyses == ["all"] else asked.analyses
    total: Counter[str] = Counter()
    warnings.simplefilter("ignore")
    for name, make in cases(asked.seeds):
        if asked.only and not any(x in name for x in asked.only):
            continue
        for analysis in analyses:
            for scale, found in compared(make(), asked.scales, analysis):
                label = f"{name:28} {analysis:20} {scale:12}"
                if isinstance(found, str):
                    print(f"{label} none: {found}", flush=True)
                    total["none"] += 1
                    continue
                total[f"{analysis}, {scale}: {'differs' if found else 'equal'}"] += 1
                if found:
                    total["failed"] += not is_exempt(name, scale, analysis)
                    what = found if asked.all_differences else sorted(found)[:2]
                    print(f"{label} {len(found)}: " + "; ".join(what), flush=True)
    for k, n in sorted(total.items()):
        print(f"{k}: {n}")
    sys.exit(total["failed"] > 0)


if __name__ == "__main__":
    main()
