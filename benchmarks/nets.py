"""Nets: how the time a point grows with their size, in the plane and in space.

``points``: point masses joined by rods without mass. ``rods``: rigid rods on hinges or balls where they meet. Both hang
by two corners, folded a little, and fall for 0.3 s. The time of a motion is that of the call less that of one that
ends where it begins; ``exponent`` is that of the time a point in the number of points, from the row above.
Usage: ``python nets.py [n ...]``: n x n points, 20 40 60 unless given.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from math import log
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np

import flyball as fb
from flyball.tables.coordinate_choice import work_counts
from flyball.tables.structure import structure

T_END = 0.3
COLUMNS = {
    "net": "net",
    "n": "n",
    "rows": "rows",
    "structure": "structure [s]",
    "start": "start [s]",
    "steps": "steps",
    "point": "CPU ms a point and second",
    "exponent": "exponent",
    "work": "products a point",
    "growth": "exponent",
}


def place(i: int, j: int, planar: bool) -> tuple[float, ...]:
    """Where a point of the net is drawn: rods are 0.8 to 1.1 m long."""
    if planar:
        return (0.9 * i, -0.8 * j - 0.1 * (i % 2))
    return (0.9 * i, -1.0 * j, -0.3 * ((i + j) % 2))


def lines(n: int) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Pairs of points that a rod joins."""
    across = [((i, j), (i + 1, j)) for j in range(n) for i in range(n - 1)]
    return across + [((i, j), (i, j + 1)) for j in range(n - 1) for i in range(n)]


def empty(planar: bool) -> fb.Mechanism:
    """Gravity."""
    return fb.Mechanism("net", planar=planar, gravity=(0, -9.81) if planar else (0, 0, -9.81))


def points(n: int, planar: bool) -> fb.Mechanism:
    """Point masses of 1 kg."""
    m = empty(planar)
    for i in range(n):
        for j in range(n):
            m.add(fb.Body(f"p{i}_{j}", mass=1, inertia=0, position=place(i, j, planar)))
    for k, (a, b) in enumerate(lines(n)):
        ends = (f"p{a[0]}_{a[1]}", f"p{b[0]}_{b[1]}")
        m.add(fb.Distance(f"L{k}", *ends, at=(place(*a, planar), place(*b, planar))))
    for name, i, x in (("A", 0, -0.5), ("B", n - 1, 0.9 * n - 0.4)):
        peg = (x, 1.0) if planar else (x, 0.0, 1.0)
        m.add(fb.Distance(name, "ground", f"p{i}_0", at=(peg, place(i, 0, planar))))
    return m


def rods(n: int, planar: bool) -> fb.Mechanism:
    """Slender rods of 1 kg."""
    m = empty(planar)
    joint = fb.Revolute if planar else fb.Spherical
    at: dict[tuple[int, int], str] = {}
    for k, ends in enumerate(lines(n)):
        a, b = (np.array(place(*p, planar)) for p in ends)
        inertia = float((b - a) @ (b - a)) / 12
        name = f"rod{k}"
        m.add(fb.Body(name, mass=1, inertia=inertia if planar else (inertia,) * 3, position=tuple((a + b) / 2)))
        for p in ends:
            other = at.setdefault(p, name)
            if other != name:
                m.add(joint(f"J{k}_{p[0]}_{p[1]}", other, name, at=place(*p, planar)))
    m.add(joint("A", "ground", at[0, 0], at=place(0, 0, planar)))
    peg = (0.9 * n, 1.0) if planar else (0.9 * n, 0.0, 1.0)
    m.add(fb.Distance("B", "ground", at[n - 1, 0], at=(peg, place(n - 1, 0, planar))))
    return m


def motion(m: fb.Mechanism, t_end: float) -> tuple[float, fb.Result]:
    """CPU seconds of a call, and its result."""
    begin = time.process_time()
    run = m.simulate(t_end, outputs=2)
    return time.process_time() - begin, run


def row(build: Callable[[int, bool], fb.Mechanism], n: int, planar: bool, last: dict[str, Any]) -> dict[str, Any]:
    """Figures of one net; ``last``: those of the smaller one."""
    begin = time.process_time()
    work = work_counts(structure(build(n, planar)))
    made = time.process_time() - begin
    m = build(n, planar)
    start, _ = motion(m, 1e-9)
    again, _ = motion(m, 1e-9)  # knows where it starts
    whole, run = motion(m, T_END)
    out = {
        "net": f"{build.__name__}, {'plane' if planar else 'space'}",
        "n": n,
        "rows": len(run.values.structure.rows),
        "structure": made,
        "start": start,
        "steps": run.health.steps,
        "point": 1e3 * (whole - again) / T_END / n**2,
        "work": work["factor"] / n**2,
    }
    if last:
        wider = log(n**2 / last["n"] ** 2)
        out["exponent"] = log(out["point"] / last["point"]) / wider
        out["growth"] = log(out["work"] / last["work"]) / wider
    return out


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("n", nargs="*", type=int, help="points along a side (20 40 60)")
    parser.add_argument("--json", metavar="FILE", help="write the rows")
    arguments = parser.parse_args()
    rows: list[dict[str, Any]] = []
    for build in (points, rods):
        for planar in (True, False):
            build(4, planar).simulate(0.01, outputs=2)
            last: dict[str, Any] = {}
            for n in arguments.n or [20, 40, 60]:
                last = row(build, n, planar, last)
                rows.append(last)
    print(timing.table(rows, COLUMNS))
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
