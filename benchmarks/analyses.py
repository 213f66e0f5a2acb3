"""Analyses that are held to a time: linear equations and modes of 3000 bodies, equilibria, driven motions.

CPU time, warm; the first row is the one compilation that linear analyses need. Usage: ``python analyses.py``.
"""

from __future__ import annotations

from collections.abc import Callable

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import contest
import numpy as np

import flyball as fb
from mechanisms import GRAVITY, example

COLUMNS = {"what": "what", "seconds": "CPU [s]", "found": "found"}


def aslant(n: int) -> fb.Mechanism:
    """A chain of n uniform rods, 1 m and 1 kg in all, drawn 0.2 rad beside where it hangs."""
    m = fb.Mechanism("chain", planar=True, gravity=(0, -GRAVITY))
    before, way = "ground", np.array([np.sin(0.2), -np.cos(0.2)]) / n
    for k in range(n):
        at = tuple((k + 0.5) * way)
        m.add(fb.Body(f"rod {k}", mass=1 / n, inertia=n**-3 / 12, position=at, angle=0.2))
        m.add(fb.Revolute(f"J{k}", before, f"rod {k}", at=tuple(k * way)))
        before = f"rod {k}"
    return m


def chain(n: int, planar: bool = True) -> fb.Mechanism:
    """A hanging chain of n uniform rods, 1 m and 1 kg in all, on hinges or ball joints."""
    m = fb.Mechanism("chain", planar=planar, gravity=(0, -GRAVITY) if planar else (0, 0, -GRAVITY))
    before, I = "ground", n**-3 / 12
    for k in range(n):
        y = [-(k + 0.5) / n, -k / n]
        at, joint = ([(0, h) for h in y]) if planar else ([(0, 0, h) for h in y])
        m.add(fb.Body(f"rod {k}", mass=1 / n, inertia=I if planar else (I, I, I / 100), position=at))
        kind = fb.Revolute if planar else fb.Spherical
        m.add(kind(f"J{k}", before, f"rod {k}", at=joint))
        before = f"rod {k}"
    return m


def andrews() -> fb.Mechanism:
    """Andrews' mechanism, its crank driven in place of its motor."""
    m = example("andrews.toml")
    m.forces[:] = [f for f in m.forces if type(f).__name__ != "Motor"]
    m.add(fb.Driver("drive", "crank.angle", "200*t"))
    return m


def damped(n: int) -> fb.Mechanism:
    """The chain with a damper in every hinge."""
    m = chain(n)
    for k in range(n):
        m.add(fb.CoordinateSpring(f"damper {k}", f"J{k}.angle", stiffness=0, damping=1e-4))
    return m


def ladder(n: int) -> fb.Mechanism:
    """Two hanging chains of n rods with a rung at every hinge: n loops, 3 n bodies."""
    m, h = fb.Mechanism("ladder", planar=True, gravity=(0, -GRAVITY)), 1 / n
    for k in range(n):
        for side, x in (("left", 0.0), ("right", 0.3)):
            before = f"{side} {k - 1}" if k else "ground"
            m.add(fb.Body(f"{side} {k}", mass=h, inertia=h**3 / 12, position=(x, -(k + 0.5) * h)))
            m.add(fb.Revolute(f"{side} hinge {k}", before, f"{side} {k}", at=(x, -k * h)))
        m.add(fb.Body(f"rung {k}", mass=h, inertia=h * 0.09 / 12, position=(0.15, -(k + 1) * h)))
        for side, x in (("left", 0.0), ("right", 0.3)):
            m.add(fb.Revolute(f"{side} end {k}", f"{side} {k}", f"rung {k}", at=(x, -(k + 1) * h)))
    return m


def pushed(m: fb.Mechanism) -> fb.Mechanism:
    """With a force at its last body that is an input."""
    at = m.bodies[-1].position
    m.add(fb.PointForce("push", m.bodies[-1].name, at=at, force=(0,) * len(at)))
    return m


def measured(what: str, run: Callable[[], object], tell: Callable[[object], str]) -> dict[str, object]:
    """One row."""
    found: list[object] = []
    seconds = timing.cpu(lambda: found.append(run()))
    return {"what": what, "seconds": seconds, "found": tell(found[0])}


def main() -> None:
    """Command line."""
    arguments = contest.parser(__doc__).parse_args()
    rows = [measured("first linear model (compiles)", chain(3).linearize, lambda L: f"{len(L.A)} states")]
    driven = andrews()
    chain(3).modes()
    driven.kinematics(3, t_end=0.01)
    for what, m in (
        ("3000 planar links", pushed(chain(3000))),
        ("3000 links on ball joints", pushed(chain(3000, planar=False))),
        ("3000 planar links with dampers", pushed(damped(3000))),
        ("1000 loops of 3 bodies", pushed(ladder(1000))),
    ):
        middle = f"{m.bodies[len(m.bodies) // 2].name}.x"
        linear: list[fb.LinearModel] = []
        rows += [
            measured(
                f"linearize, {what}",
                lambda m=m, middle=middle, to=linear: to.append(m.linearize(["push.x"], [middle])),
                lambda _, of=linear: repr(of[0].descriptor),
            ),
            measured(
                "    ten eigenvalues, one response of it",
                lambda of=linear: (of[0].descriptor.nearest(10), of[0].response([1.0])),
                lambda r: f"slowest {abs(r[0][0]):.5g} rad/s",
            ),
            measured(
                f"ten modes, {what}", lambda m=m: m.modes(count=10), lambda r: f"{r.omega[0]:.5f} rad/s, {r.kinds[0]}"
            ),
        ]
    hung = chain(300)
    rows += [
        measured(
            "equilibrium, 300 planar links drawn aslant",
            lambda: aslant(300).equilibrium(),
            lambda e: f"{e.stability}, {e.method}",
        ),
        measured("equilibrium, 300 planar links as they hang", hung.equilibrium, lambda e: e.stability),
        measured(
            "kinematics, Andrews, 1000 times",
            lambda: driven.kinematics(1000, t_end=0.03),
            lambda r: f"violation {r.health.violation:.1e}",
        ),
    ]
    driven.inverse_dynamics(3, t_end=0.01)
    rows.append(
        measured(
            "inverse dynamics, Andrews, 1000 times",
            lambda: driven.inverse_dynamics(1000, t_end=0.03),
            lambda r: f"drive at most {np.abs(r.efforts['drive']).max():.4g} N m",
        )
    )
    print(timing.table(rows, COLUMNS))
    timing.write_json(arguments.json, rows)
    assert np.isfinite([row["seconds"] for row in rows]).all()


if __name__ == "__main__":
    main()
