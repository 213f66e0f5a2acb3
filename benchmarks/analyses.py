"""Analyses that are held to a time: modes and linear equations of 1000 bodies, kinematics of Andrews' mechanism.

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


def measured(what: str, run: Callable[[], object], tell: Callable[[object], str]) -> dict[str, object]:
    """One row."""
    found: list[object] = []
    seconds = timing.cpu(lambda: found.append(run()))
    return {"what": what, "seconds": seconds, "found": tell(found[0])}


def main() -> None:
    """Command line."""
    arguments = contest.parser(__doc__).parse_args()
    rows = [measured("first linear model (compiles)", chain(3).linearize, lambda L: f"{len(L.A)} states")]
    big, spatial, driven = chain(1000), chain(1000, planar=False), andrews()
    chain(3).modes()
    driven.kinematics(3, t_end=0.01)
    rows += [
        measured("linearize, 1000 planar links", big.linearize, lambda L: f"{len(L.A)} states"),
        measured("10 modes, 1000 planar links", lambda: big.modes(count=10), lambda m: f"{m.omega[0]:.5f} rad/s"),
        measured("10 modes, 1000 links on ball joints", lambda: spatial.modes(count=10), lambda m: m.kinds[0]),
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
