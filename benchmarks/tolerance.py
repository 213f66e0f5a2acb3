"""What a tolerance gives: errors of motions as parts of their size, and what they cost, by rtol; of flyball alone.

The error is the largest of four, at 501 times and over all bodies: of positions by the longest way that a mass centre
goes, of rotations by the largest turn (one radian at most), of velocities and angular velocities by the fastest. The
reference is the same motion at rtol 1e-12. Usage: ``python tolerance.py [name ...]``.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np
from loop_mechanisms import bricard, spatial_four_bar, stewart
from robots import FALL, delta, humanoid, table_robot
from trees import flyball_tree

import flyball as fb
from mechanisms import EXAMPLES, chain, example, flyball_planar, free_body, pendulum

RTOLS = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
USUAL = 1e-7  # simulate's own
SECONDS = {"andrews": 0.03, "car_axis": 3.0, "chaplygin_sleigh": 5.0, "governor": 3.0, "heavy_top": 1.0,
           "planetary": 4.0, "rolling_race": 1.2}  # fmt: skip
FOLLOWED = ("cam", "double_wishbone", "peaucellier", "quick_return", "slider_crank", "spatial_slider_crank", "stewart",
            "toggle_press", "slider_crank_singularities", "n_four_bar")  # fmt: skip
# (followed by Newton's method, whatever the tolerance; the last passes singular positions, where 1e-12 cannot be had)


def cases() -> Iterator[tuple[str, Callable[[], fb.Mechanism], float]]:
    """Names, makers and seconds: the examples that are integrated, and the mechanisms of the contests."""
    for path in sorted(EXAMPLES.iterdir()):
        if path.suffix in (".toml", ".py") and path.stem not in FOLLOWED:
            yield path.stem, partial(example, path.name), SECONDS.get(path.stem, 10.0)
    yield "chain of 10 (contest)", lambda: flyball_planar(chain(10)), 10.0
    yield "chain of 30 (contest)", lambda: flyball_planar(chain(30)), 10.0
    for make, seconds in ((bricard, 10.0), (spatial_four_bar, 1.0), (stewart, 10.0), (delta, 10.0), (humanoid, FALL)):
        yield f"{make.__name__} (contest)", lambda make=make: flyball_tree(make()), seconds
    yield "3-RRR (contest)", lambda: flyball_planar(table_robot()), 10.0
    yield "pendulum, 100 s", pendulum, 100.0
    yield "free body, 100 s", free_body, 100.0


def motion(model: fb.Mechanism, run: fb.Result) -> list[np.ndarray]:
    """Positions, rotations (angles in the plane), velocities, angular velocities of all bodies."""
    turn = "angle" if model.planar else "rotation"
    views = [run[b.name] for b in model.bodies]
    return [
        np.stack([getattr(v, a) for v in views], axis=1) for a in ("position", turn, "velocity", "angular_velocity")
    ]


def turned(R: np.ndarray, r: np.ndarray) -> float:
    """Largest angle between rotations (or the difference of angles), to first order where it is small [rad]."""
    if R.ndim < 4:
        return float(np.abs(R - r).max())
    d = np.einsum("tkij,tkil->tkjl", r, R)
    axis = np.stack([d[..., 2, 1] - d[..., 1, 2], d[..., 0, 2] - d[..., 2, 0], d[..., 1, 0] - d[..., 0, 1]], axis=-1)
    far = np.arccos(np.clip((np.trace(d, axis1=-2, axis2=-1) - 1) / 2, -1, 1))
    return float(np.where(far > 1e-3, far, np.linalg.norm(axis, axis=-1) / 2).max())


def part(a: float, of: float) -> float:
    """A ratio, 0 where there is nothing."""
    return a / of if of else 0.0


def error(found: list[np.ndarray], fine: list[np.ndarray]) -> float:
    """The largest of the four."""
    (P, R, V, W), (p, r, v, w) = found, fine
    start = np.broadcast_to(r[:1], r.shape)
    return max(
        part(np.linalg.norm(P - p, axis=-1).max(), np.linalg.norm(p - p[0], axis=-1).max()),
        part(turned(R, r), min(turned(r, start), 1.0)),
        part(np.linalg.norm(V - v, axis=-1).max(), np.linalg.norm(v, axis=-1).max()),
        part(np.abs(W - w).max(), np.abs(w).max()),
    )


def row(name: str, make: Callable[[], fb.Mechanism], seconds: float) -> dict[str, Any]:
    """Errors of one mechanism, and right-hand sides at the usual tolerance and at a tenth of it."""
    model = make()
    fine = motion(model, model.simulate(seconds, rtol=1e-12, progress=False))
    out: dict[str, Any] = {"case": name, "seconds": seconds}
    for rtol in RTOLS:
        run = model.simulate(seconds, rtol=rtol, progress=False)
        out[f"error {rtol:g}"] = error(motion(model, run), fine)
        out[f"evaluations {rtol:g}"] = run.health.evaluations
    out["dearer"] = out[f"evaluations {USUAL / 10:g}"] / out[f"evaluations {USUAL:g}"]
    return out


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="*", help="parts of names")
    parser.add_argument("--json", metavar="FILE", help="write the rows")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", fb.StartWarning)
    rows = [row(*c) for c in cases() if not arguments.name or any(part in c[0] for part in arguments.name)]
    columns = {"case": "case", "seconds": "seconds"} | {f"error {r:g}": f"rtol {r:g}" for r in RTOLS}
    print(timing.table(rows, columns | {"dearer": "cost of a tenth"}))
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
