"""Stiff mechanisms at equal error: flyball's methods, Exudyn's implicit solvers and MuJoCo, whole calls in one run.

A body of 1 g in a mount of 1e6 N/m, weakly and strongly damped; a pendulum in honey; a four-bar whose coupler is a
spring of 1e8 N/m; a car of 32 bodies on mounts of 1e3 to 1e8 N/m. Usage: ``python stiff.py [mount] [strong] [honey]
[coupler] [car]``. `governor.py`, `andrews.py` and `fourbars.py` have the other stiff ones.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contest
import numpy as np
from car import car
from contest import Contest, Flyball, Peer
from stiff_mechanisms import honey_exact, mounted_body, mounted_exact, pendulum_in_honey, stiff_coupler
from trees import Tree, flyball_tree, planar_motion, planar_tree

from mechanisms import Planar, flyball_planar, simulate

METHODS = ("radau", "dop853")
ALPHA = ("exudyn_spatial", "generalised-alpha 0.95"), ("exudyn_spatial", "generalised-alpha 0.7")
TRAPEZOIDAL = ("exudyn_spatial", "trapezoidal, index 2"), ("exudyn_spatial", "trapezoidal, index 2, full Newton")
MUJOCO = ("mujoco", "RK4, stiff"), ("mujoco", "implicitfast, stiff"), ("mujoco", "implicit, stiff")
ERROR = {"error": "error [m]"}
FINE = {"method": "dop853", "rtol": 1e-11}  # of motions that the others are compared with
EVEN = 100  # steps are multiples of it, so that samples lie on them


def off(exact: np.ndarray, found: np.ndarray) -> dict[str, float]:
    """Largest error at samples that both have: a peer may have every other one."""
    every = (len(exact) - 1) // (len(found) - 1)
    return {"error": float(np.abs(np.asarray(found) - exact[::every]).max())}


def of_tree(name: str, tree: Tree, setting: str, t_end: float, read: Callable, n: float, samples: int) -> Any:
    """What is compared, by a peer; samples lie on its steps."""
    n = EVEN * -(-n // EVEN)
    motion, seconds = import_module(f"peer_{name}").solve(tree, t_end, n, setting, samples)
    return (None if motion is None else read(motion)), seconds


def place(k: int, *axes: int) -> Callable[[Any], np.ndarray]:
    """Reads coordinates of a link's centre."""
    return lambda motion: motion.position[:, k][:, axes]


def of_body(name: str, *axes: int) -> Callable[[Any], np.ndarray]:
    """Reads the same of flyball's result."""
    return lambda run: run[name].position[:, axes]


def mount(damping: float, target: float) -> list[dict[str, Any]]:
    """1 g on rubber: a second of it."""
    tree, samples = mounted_body(damping), 1000
    exact = mounted_exact(damping, np.linspace(0.0, 1.0, samples + 1))[:, None]
    one = Contest(f"mount, {damping:g} N s/m", 1.0, partial(off, exact), "error", target, samples)
    peers = [Peer(n.partition("_")[0], s, partial(of_tree, n, tree, s, 1.0, place(0, 0)), 4000)
             for n, s in (*ALPHA, TRAPEZOIDAL[0], *MUJOCO)]  # fmt: skip
    return contest.run(one, [Flyball(flyball_tree(tree), of_body("body", 0), m) for m in METHODS], peers)


def honey() -> list[dict[str, Any]]:
    """A creeping pendulum, 10 s."""
    tree, samples = pendulum_in_honey(), 100
    exact = honey_exact(np.linspace(0.0, 10.0, samples + 1))
    one = Contest("honey", 10.0, partial(off, exact), "error", 4e-7, samples)
    peers = [Peer(n.partition("_")[0], s, partial(of_tree, n, tree, s, 10.0, place(0, 0, 1)), 1000)
             for n, s in (*ALPHA, TRAPEZOIDAL[0], *MUJOCO)]  # fmt: skip
    return contest.run(one, [Flyball(flyball_tree(tree), of_body("bob", 0, 1), m) for m in METHODS], peers)


def by_exudyn(p: Planar, setting: str, n: float, samples: int) -> Any:
    """The crank's centre in the planar model."""
    n = EVEN * -(-n // EVEN)
    motion, seconds = import_module("peer_exudyn").solve(p, 2.0, n, setting, samples)
    return (None if motion is None else motion[0][:, 0, :2]), seconds


def by_mujoco(p: Planar, setting: str, n: float, samples: int) -> Any:
    """The crank's centre."""
    tree = planar_tree(p)
    n = EVEN * -(-n // EVEN)
    motion, seconds = import_module("peer_mujoco").solve(tree, 2.0, n, setting, samples)
    return (None if motion is None else planar_motion(p, tree, motion)[0][:, 0, :2]), seconds


def coupler() -> list[dict[str, Any]]:
    """A spring for a coupler, 2 s to 1e-3 m."""
    p, samples = stiff_coupler(), 100
    model = flyball_planar(p)
    exact = of_body("rod0", 0, 1)(simulate(model, 2.0, outputs=samples + 1, **FINE))
    one = Contest("coupler", 2.0, partial(off, exact), "error", 1e-3, samples)
    peers = [Peer("exudyn", s, partial(by_exudyn, p, s), 500) for _, s in (*ALPHA, *TRAPEZOIDAL)]
    peers += [Peer("mujoco", s, partial(by_mujoco, p, s), 100_000) for _, s in MUJOCO]
    return contest.run(one, [Flyball(model, of_body("rod0", 0, 1), m) for m in METHODS], peers)


def car_on_mounts() -> list[dict[str, Any]]:
    """All 32 bodies for a second to 1e-5 m, each engine against its own motion by much shorter steps.

    Rotations of mounts are measured in three ways (a rotation vector, Tait and Bryan's angles, three hinges), so that
    motions differ by parts of a micrometre to a millimetre, which is printed.
    """
    tree, samples, t_end = car(), 100, 1.0
    model = flyball_tree(tree)
    names = [link.name for link in tree.links]

    def ours(run: Any) -> np.ndarray:
        return np.stack([run[n].position for n in names], axis=1)

    exact = ours(simulate(model, t_end, outputs=samples + 1, method="radau", rtol=1e-9))
    fine = {}
    for name, setting, steps in (("exudyn_spatial", ALPHA[0][1], 16_000), ("mujoco", "RK4, stiff", 200_000)):
        fine[name] = import_module(f"peer_{name}").solve(tree, t_end, steps, setting, samples)[0].position
        print(f"  car, {name}: its motion differs by {np.abs(fine[name] - exact).max():.1e} m", flush=True)
    one = Contest("car", t_end, partial(off, exact), "error", 1e-5, samples)
    rows = contest.run(one, [Flyball(model, ours, m) for m in METHODS], [])
    for n, s in (*ALPHA, *TRAPEZOIDAL, *MUJOCO):
        peer = Peer(n.partition("_")[0], s, partial(of_tree, n, tree, s, t_end, lambda m: m.position), 1000)
        rows += contest.run(Contest("car", t_end, partial(off, fine[n]), "error", 1e-5, samples), [], [peer])
    return rows


CASES: dict[str, Callable[[], list[dict[str, Any]]]] = {
    "mount": partial(mount, 10.0, 1e-6),
    "strong": partial(mount, 1000.0, 3e-8),
    "honey": honey,
    "coupler": coupler,
    "car": car_on_mounts,
}


def main() -> None:
    """Command line."""
    parser = contest.parser(__doc__)
    parser.add_argument("cases", nargs="*", choices=[*CASES, []], default=[], metavar="CASE")
    arguments = parser.parse_args()
    rows = []
    for name in arguments.cases or CASES:
        found = CASES[name]()
        print(contest.show(found, ERROR))
        rows += found
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
