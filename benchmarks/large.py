"""A model file of five thousand bodies: what reading it, the first motion, the next one and a check take.

A planar and a spatial chain, a spatial tree with loops, and a chain in which every number is an expression and every
joint has a sensor, a controller and an initial value. ``first``: `simulate` of hardly any time, from the model as read
to the first right-hand sides; ``again``: the same call once more. The kernel is compiled before the clock starts.
Usage: ``python large.py``, with the number of bodies as an argument.
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Callable
from typing import Any

import timing

import flyball as fb
from flyball.model.model_files import dumps, loads

PARTS = ("build", "write", "read", "first", "again", "check")
COLUMNS = {"model": "model", "kilobytes": "file [kB]", **{p: f"{p} [s]" for p in PARTS}}


def chain(n: int) -> fb.Mechanism:
    """Bodies on hinges in a row, in the plane."""
    m = fb.Mechanism("chain", planar=True, gravity=(0, -9.81))
    for k in range(n):
        m.add(fb.Body(f"b{k}", mass=1, inertia=0.1, position=(k + 0.5, 0)))
        m.add(fb.Revolute(f"J{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=(k, 0)))
    return m


def spatial(n: int) -> fb.Mechanism:
    """Bodies on crossed hinges in a row, in space."""
    m = fb.Mechanism("spatial", gravity=(0, 0, -9.81))
    for k in range(n):
        m.add(fb.Body(f"b{k}", mass=1, inertia=(0.1, 0.1, 0.1), position=(k + 0.5, 0, 0)))
        ends = (f"b{k - 1}" if k else "ground", f"b{k}")
        m.add(fb.Revolute(f"J{k}", *ends, at=(k, 0, 0), axis=(0, 1, k % 2)))
    return m


def tree(n: int) -> fb.Mechanism:
    """A binary tree of balls and hinges in space; a link closes a loop at every tenth body."""
    dice = random.Random(1)
    m = fb.Mechanism("tree", gravity=(0, 0, -9.81))
    places = [(0.0, 0.0, 0.0)]
    for k in range(n):
        parent = (k - 1) // 2 if k else -1
        x, y, z = places[parent + 1]
        p = (x + dice.uniform(-1, 1), y + dice.uniform(-1, 1), z - 1)
        places.append(p)
        at = tuple((a + b) / 2 for a, b in zip(p, (x, y, z), strict=True))
        m.add(fb.Body(f"b{k}", mass=1, inertia=(0.1, 0.1, 0.1), position=p))
        ends = ("ground" if parent < 0 else f"b{parent}", f"b{k}")
        m.add(fb.Spherical(f"J{k}", *ends, at=at) if k % 3 else fb.Revolute(f"J{k}", *ends, at=at, axis=(1, 0, k % 2)))
        if k % 10 == 9:
            m.add(fb.Distance(f"L{k}", f"b{k - 3}", f"b{k}", at=(places[k - 2], p)))
    return m


def controlled(n: int) -> fb.Mechanism:
    """The chain with parameters, frames, sensors, controllers and initial values."""
    parameters: dict[str, Any] = {"g": 9.81, "m0": 1.0, "k": "20*m0", "L": 1.0}
    parameters |= {f"p{i}": f"{i}*m0" for i in range(30)}
    m = fb.Mechanism("controlled", planar=True, gravity=(0, "-g"), parameters=parameters)
    for k in range(n):
        mass = f"m0*(1 + p{k % 30}/100)"
        m.add(fb.Body(f"b{k}", mass=mass, inertia="m0*L**2/12", position=(f"{k}*L + L/2", 0)))
        m.add(fb.Frame(f"f{k}", f"b{k}", position=("L/2", 0)))
        m.add(fb.Revolute(f"J{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=(f"{k}*L", 0)))
        m.add(fb.Sensor(f"s{k}", f"J{k}.angle"), fb.Initial(f"J{k}.angle", rate="1 deg/s"))
        m.add(fb.Actuator(f"A{k}", f"J{k}.angle", force=f"-k*s{k} + 0.1*sin({k + 1}*t)"))
    return m


def parts(build: Callable[[int], fb.Mechanism], n: int) -> dict[str, Any]:
    """One row: CPU seconds of each part."""
    made: dict[str, Any] = {}

    def timed(name: str, work: Callable[[], Any]) -> float:
        def keep() -> None:
            made[name] = work()

        return timing.cpu(keep)

    row: dict[str, Any] = {"model": f"{build.__name__} {n}"}
    row["build"] = timed("build", lambda: build(n))
    row["write"] = timed("write", lambda: dumps(made["build"]))
    row["read"] = timed("read", lambda: loads(made["write"], fb.Mechanism))
    row["first"] = timed("first", lambda: made["read"].simulate(1e-6, outputs=2))
    row["again"] = timed("again", lambda: made["read"].simulate(1e-6, outputs=2))
    row["check"] = timed("check", lambda: loads(made["write"], fb.Mechanism).check()) - row["read"]
    row["kilobytes"] = len(made["write"]) / 1024
    return row


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("n", nargs="*", type=int, help="numbers of bodies (1000 5000)")
    parser.add_argument("--json", metavar="FILE", help="write the rows")
    arguments = parser.parse_args()
    for build in (chain, spatial, tree, controlled):
        build(3).simulate(0.01, outputs=2)  # imports, units, the kernel
        build(800).check()  # the sparse rank
    rows = [parts(build, n) for n in arguments.n or [1000, 5000] for build in (chain, spatial, tree, controlled)]
    print(timing.table(rows, COLUMNS))
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
