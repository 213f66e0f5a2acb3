"""Whole systems: simulated seconds per CPU second of flyball, and the same systems in Exudyn, MuJoCo and Pinocchio.

Truck, bogie, press, hexapod, shafts, robots of six and seven axes, tracked vehicle, governor, as the examples describe
them. ``own`` prints the first and the next call of each at the loosest tolerance at which its motion is converged to
1e-4 of its longest path, with the error found against a run at a tolerance 1000 times tighter. The other names compare
engines at equal error in one run. Usage: ``python systems.py [own] [arm6] [arm7] [press] [truck] [track]``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contest
import numpy as np
import system_peers as peers
from contest import Contest, Flyball, Peer
from trees import Axis, Cut, Link, Tree, flyball_tree

import flyball as fb
from mechanisms import EXAMPLES, GROUND, example, simulate

CONVERGED, LOOKS = 1e-4, 100
TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
OWN = {
    "system": "system",
    "rtol": "rtol",
    "error": "error / path",
    "steps": "steps",
    "first": "first call [s/CPU s]",
    "next": "next calls [s/CPU s]",
}
X, Y, Z = np.eye(3)
SPEED = 8.0  # of the truck [m/s]
STEP = 4e-3  # of the examples with tracks [s]: each is an output time where forces are averaged
TRUCK_SETTINGS = ("generalised-alpha 0.95", "generalised-alpha 0.7")  # trapezoidal, index 2: no end in minutes


def module(name: str) -> Any:
    """An example as a module."""
    import sys

    if str(EXAMPLES) not in sys.path:
        sys.path.insert(0, str(EXAMPLES))
    return import_module(name)


@dataclass(frozen=True)
class System:
    """A mechanism of the examples and how long it moves."""

    make: Callable[[], fb.Mechanism]
    t_end: float
    options: dict[str, Any] = field(default_factory=dict)


def arm(axes: int, friction: float | None = None) -> fb.Mechanism:
    """The robot with elastic gears; without brakes unless there is friction."""
    m = module("seven_axes").mechanism(friction or 0.0, axes)
    return m if friction else m.changed({f.name: None for f in m.forces if isinstance(f, fb.Brake)})


def coasting() -> fb.Mechanism:
    """The truck on level road without its driver: wheels held straight by springs, no drive."""
    m = module("truck").truck(None, SPEED)
    parts: dict[str, Any] = {f.name: None for f in m.forces if isinstance(f, fb.Motor)}
    for f in m.forces:
        if isinstance(f, fb.TorsionalSpringDamper):
            parts[f.name] = fb.TorsionalSpringDamper(f.name, f.joint, stiffness=2e5, damping=2e3)
    return m.changed(parts | {s.name: None for s in m.sensors})


def rough_road() -> fb.Mechanism:
    """The truck on a random road of class C at 15 m/s."""
    return module("truck").truck(fb.RandomRoad(roughness="C", length=300, track=2, start=-10, run_in=15), speed=15.0)


SYSTEMS = {
    "truck over a ramp": System(lambda: module("truck").mechanism(), 4.0),
    "truck on a rough road": System(lambda: rough_road(), 4.0),
    "truck, lane change": System(lambda: module("truck").truck(None, lane=3.0), 10.0),
    "bogie on rollers, hunting": System(lambda: module("bogie_on_rollers").mechanism(), 3.0),
    "press": System(lambda: module("press").mechanism(), 10.0),
    "hexapod, driven": System(lambda: module("stewart").mechanism(), 6.0),
    "two shafts": System(lambda: module("two_shafts").mechanism(), 5.0),
    "robot of 6 axes": System(partial(arm, 6), 2.5),
    "robot of 7 axes": System(partial(arm, 7), 2.5),
    "robot of 7 axes, dry friction": System(partial(arm, 7, 1.0), 2.5),
    "governor": System(lambda: example("governor.toml"), 10.0),
}


def positions(m: fb.Mechanism, run: fb.Result) -> np.ndarray:
    """Places of all bodies at LOOKS + 1 times, (times, bodies, 2 or 3)."""
    every = (len(run.t) - 1) // LOOKS
    return np.stack([run[b.name].position[::every] for b in m.bodies], axis=1)


def longest(p: np.ndarray) -> float:
    """The longest distance from its start that a body gets."""
    return float(np.linalg.norm(p - p[0], axis=2).max())


def turns(m: fb.Mechanism, run: fb.Result) -> np.ndarray:
    """Rotations of all bodies at LOOKS + 1 times: bodies that turn in place move too."""
    every = (len(run.t) - 1) // LOOKS
    if m.planar:
        return np.stack([run[b.name].angle[::every] for b in m.bodies], axis=1)
    return np.stack([run[b.name].rotation[::every] for b in m.bodies], axis=1)


def own_row(name: str, s: System) -> dict[str, Any]:
    """Loosest tolerance at which positions [of the longest path] and rotations [rad] are converged; times of calls."""
    m = s.make()
    for rtol in TOLERANCES:
        coarse, fine = (simulate(m, s.t_end, rtol=r, outputs=501, progress=False) for r in (rtol, 1e-3 * rtol))
        p, q = positions(m, fine), positions(m, coarse)
        error = max(
            float(abs(p - q).max()) / max(longest(p), 1e-9), float(abs(turns(m, fine) - turns(m, coarse)).max())
        )
        if error <= CONVERGED:
            break
    again = s.make()
    first = timing.cpu(lambda: simulate(again, s.t_end, rtol=rtol, progress=False))
    later = min(timing.cpu(lambda: simulate(again, s.t_end, rtol=rtol, progress=False)) for _ in range(3))
    steps = coarse.health.steps + coarse.health.rejected
    return {"system": name, "rtol": rtol, "error": error, "steps": steps, "first": s.t_end / first,
            "next": s.t_end / later}  # fmt: skip


def own() -> list[dict[str, Any]]:
    """flyball alone."""
    rows = []
    for name, s in SYSTEMS.items():
        rows.append(own_row(name, s))
        print(timing.table(rows[-1:], OWN).splitlines()[-1], flush=True)
    print(timing.table(rows, OWN))
    return rows


def off(exact: np.ndarray, found: np.ndarray) -> dict[str, float]:
    """Largest error in parts of the longest path, at samples that both have."""
    every = (len(found) - 1) // (len(exact) - 1)
    size = float(np.abs(exact - exact[0]).max())
    return {"error": float(np.abs(np.asarray(found)[::every] - exact).max()) / size}


def steps_of(n: float) -> float:
    """A multiple of LOOKS."""
    return LOOKS * -(-n // LOOKS) if n >= 1 else n


def compare_arm(axes: int, target: float = 1e-6) -> list[dict[str, Any]]:
    """The robot under computed torque, gears elastic, without friction."""
    m, numbers, t_end = arm(axes), peers.ArmNumbers(module("seven_axes"), axes), 2.5

    def angles(run: Any) -> np.ndarray:
        return np.column_stack([run[f"joint_{k + 1}.angle"] for k in range(axes)])

    exact = angles(simulate(m, t_end, rtol=1e-11, outputs=LOOKS + 1))
    one = Contest(f"robot of {axes} axes", t_end, partial(off, exact), "error", target, LOOKS, 8.0, t_end)

    def by_mujoco(n: float, samples: int) -> Any:
        return peers.mujoco_arm(numbers, t_end, steps_of(n), samples)

    others = [
        Peer("mujoco", "RK4, mj_inverse in a compiled callback", by_mujoco, 2000),
        Peer("pinocchio", "SciPy DOP853", partial(peers.pinocchio_arm, numbers, t_end), 1e-5),
    ]
    return contest.run(one, [Flyball(m, angles, method) for method in ("dop853", "rk45")], others)


def press() -> Tree:
    """The eccentric press on its four mounts (as one), flywheel coasting, without a workpiece."""
    shaft, e, rod = 2.2, 0.05, 0.6
    frame_mass, k, shear, c = 6000.0, 4e6, 1.6e6, 4e4
    bounce = [Axis("slide", 0 * Z, d, x, 0.0, c) for d, x in ((X, shear), (Y, shear), (Z, k))]
    arms = ((X, 0.9), (Y, 0.5))
    rock = [Axis("hinge", 0 * Z, d, k * a * a, 0.0, c * a * a) for d, a in arms]
    rock.append(Axis("hinge", 0 * Z, Z, shear * (0.9**2 + 0.5**2), 0.0, c * (0.9**2 + 0.5**2)))
    frame = Link("frame", frame_mass, np.diag((5000.0, 3500.0, 2500.0)), Z, GROUND, (*bounce, *rock))
    ram_at, pin_at = (shaft + e - rod) * Z, (shaft + e) * Z
    crank = Link("crank", 200.0, np.diag((10.0, 6.0, 6.0)), shaft * Z, 0, (Axis("hinge", shaft * Z, X),))
    link = Link("rod", 120.0, np.diag((5.0, 5.0, 0.5)), pin_at - rod / 2 * Z, 1,
                (Axis("hinge", pin_at, X), Axis("hinge", pin_at, Y)))  # fmt: skip
    ram = Link("ram", 300.0, np.diag((9.0, 9.0, 8.0)), ram_at, 0, (Axis("slide", ram_at, Z),))
    rates = np.zeros(10)
    rates[6] = 4 * np.pi
    rates[7] = -4 * np.pi + 4 * np.pi * e / rod  # the wrist stands still where the crank's pin is uppermost
    return Tree("press", np.array([0, 0, -9.81]), (frame, crank, link, ram), (Cut(2, 3, ram_at),), rates)


def compare_press(target: float = 1e-6) -> list[dict[str, Any]]:
    """Positions of the four bodies; each engine against its own motion by finer steps.

    The rotation of a mount is measured as three angles or a rotation vector, so motions of engines may differ.
    """
    tree, t_end = press(), 5.0
    m = flyball_tree(tree)

    def ours(run: Any) -> np.ndarray:
        return np.stack([run[link.name].position for link in tree.links], axis=1)

    exact = ours(simulate(m, t_end, rtol=1e-11, outputs=LOOKS + 1))
    rows = contest.run(Contest("press", t_end, partial(off, exact), "error", target, LOOKS, 4.0, t_end),
                       [Flyball(m, ours, method) for method in ("dop853", "rk45", "radau")], [])  # fmt: skip
    fine = {"pinocchio": ("SciPy DOP853, 20/s", 1e-11), "mujoco": ("RK4, stiff", 200_000),
            "exudyn_spatial": ("trapezoidal, index 2", 64_000)}  # fmt: skip
    for name, setting, first in (("pinocchio", "SciPy DOP853, 20/s", 1e-6), ("pinocchio", "Python RK4", 2000),
                                 ("mujoco", "RK4, stiff", 4000), ("mujoco", "RK4, softer (4 steps)", 4000),
                                 ("exudyn_spatial", "generalised-alpha 0.95", 4000),
                                 ("exudyn_spatial", "trapezoidal, index 2", 4000)):  # fmt: skip
        solve = import_module(f"peer_{name}").solve
        own_fine = solve(tree, t_end, fine[name][1], fine[name][0], LOOKS)[0].position
        print(f"  press, {name}: its fine motion differs from flyball's by {off(exact, own_fine)['error']:.1e}")

        def positions_of(n: float, samples: int, solve: Any = solve, setting: str = setting) -> Any:
            motion, seconds = solve(tree, t_end, steps_of(n), setting, samples)
            return (None if motion is None else motion.position), seconds

        case = Contest("press", t_end, partial(off, own_fine), "error", target, LOOKS, 4.0, t_end)
        rows += contest.run(case, [], [Peer(name.partition("_")[0], setting, positions_of, first)])
    return rows


def compare_truck(target: float = 1e-6) -> list[dict[str, Any]]:
    """Truck that drops on its tyres and coasts: flyball's Fiala tyre, Exudyn's rolling disc; each against itself."""
    m, tyre, t_end = coasting(), module("truck").TYRE, 4.0
    exact = positions(m, simulate(m, t_end, rtol=1e-11, outputs=LOOKS + 1))
    ours = [Flyball(m, partial(positions, m), method) for method in ("dop853", "rk45")]
    rows = contest.run(Contest("truck", t_end, partial(off, exact), "error", target, LOOKS, 20.0, t_end), ours, [])

    def solve(setting: str, n: float, samples: int) -> Any:
        return peers.exudyn_truck(m, tyre, SPEED, t_end, setting, steps_of(n), samples)

    fine = solve("generalised-alpha 0.95", 16_000, LOOKS)[0]
    print(f"  truck, Exudyn: its fine motion differs in height by {np.abs(fine - exact)[:, :, 2].max():.1e} m")
    case = Contest("truck", t_end, partial(off, fine), "error", target, LOOKS, 8.0, t_end)
    others = [Peer("exudyn", setting, partial(solve, setting), 400) for setting in TRUCK_SETTINGS]
    return rows + contest.run(case, [], others)


def stepped_track(engine: str, name: str, t_end: float, tracks: tuple[str, ...]) -> tuple[dict[str, Any], Any]:
    """The second call of an example with tracks on level soil: row of the table, and the example."""
    example_ = module(name)
    m = example_.mechanism()
    weight = example_.G * sum(b.mass for b in m.bodies)
    run = m.simulate(t_end, outputs=round(t_end / STEP) + 1, method=example_.STEPS, progress=False)
    seconds = timing.cpu(lambda: m.simulate(t_end, outputs=201, method=example_.STEPS, progress=False))
    shoes = [f"{track}.shoe_{k}" for track in tracks for k in range(example_.SHOES)]
    soil = sum(run.contacts.between("ground", shoe).force for shoe in shoes)
    late = run.t > t_end / 2.0
    upward = soil[late, 1 if m.planar else 2].mean()
    return {"engine": engine, "h": run.health.contact.step, "seconds": seconds / t_end,
            "speed": run["hull"].velocity[late, 0].mean(), "soil": upward / weight,
            "overlap": 1e3 * run.health.contact.worst_overlap}, example_  # fmt: skip


def compare_track() -> list[dict[str, Any]]:
    """Tracked vehicles on level soil: flyball's examples for 4 s and 2 s, and the planar one by MuJoCo's contacts.

    MuJoCo's contacts are as stiff as its steps allow.
    """
    t_end = 4.0
    row, example_ = stepped_track("flyball", "tracked_vehicle", t_end, ("track",))
    rows = [row, stepped_track("flyball, in space", "tracked_vehicle_in_space", 2.0, ("left", "right"))[0]]
    weight = example_.G * sum(b.mass for b in example_.mechanism().bodies)
    for h in (5e-3, 2e-3, 1e-3, 5e-4):
        try:
            found = peers.mujoco_track(example_.mechanism(), example_.SPEED, t_end, h, (2 * h, 1.0))
        except RuntimeError as error:
            rows.append({"engine": f"mujoco: {error}", "h": h})
            continue
        rows.append({"engine": "mujoco", "h": h, "seconds": found["seconds"] / t_end, "speed": found["speed"],
                     "soil": found["soil"] / weight, "overlap": 1e3 * found["overlap"]})  # fmt: skip
    columns = {"engine": "engine", "h": "step [s]", "seconds": "CPU s per s", "speed": "speed [m/s]",
               "soil": "force of soil / weight", "overlap": "overlap [mm]"}  # fmt: skip
    print(timing.table(rows, columns))
    return rows


CASES: dict[str, Callable[[], list[dict[str, Any]]]] = {
    "own": own,
    "arm6": partial(compare_arm, 6),
    "arm7": partial(compare_arm, 7),
    "press": compare_press,
    "truck": compare_truck,
    "track": compare_track,
}


def main() -> None:
    """Command line."""
    parser = contest.parser(__doc__)
    parser.add_argument("cases", nargs="*", choices=[*CASES, []], default=[], metavar="CASE")
    arguments = parser.parse_args()
    rows = []
    for name in arguments.cases or CASES:
        found = CASES[name]()
        if name not in ("own", "track"):
            print(contest.show(found, {"error": "error / path"}, "CPU ms per s"), flush=True)
        rows += found
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
