"""A five-bar robot draws a figure of eight: torques of its two motors by recursive dynamics with a closed loop.

Two cranks on ground and two rods move the pen in the plane. Drivers of the pen give the motion of all joints; for this
motion ``p.rnea(q, v, a, drives=[...])`` gives the torques along the two cranks, as arrays over all times, with the
loop.

Run it with ``python examples/five_bar.py out``: it prints the largest torques, and writes a page with the animation
into the folder.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

CRANK, ROD, APART = 0.2, 0.28, 0.24  # m
PEN = (0.0, 0.36)  # m: as drawn
MOTORS = ("left_motor", "right_motor")


def elbow(side: int) -> np.ndarray:
    """Place of an elbow as drawn; the elbows point outwards."""
    hinge = np.array([side * APART / 2, 0.0])
    d = np.array(PEN) - hinge
    r = np.hypot(*d)
    a = np.arccos((CRANK**2 + r**2 - ROD**2) / (2 * CRANK * r))
    turn = np.arctan2(d[1], d[0]) - side * a
    return hinge + CRANK * np.array([np.cos(turn), np.sin(turn)])


def bar(name: str, start: np.ndarray, end: np.ndarray, mass: float, color: str) -> fb.Body:
    """A bar of a square cross-section between two points of the drawn configuration."""
    d = np.subtract(end, start)
    turn = float(np.arctan2(d[1], d[0]))
    shape = fb.Box(edges=(float(np.hypot(*d)), 0.02, 0.02), mass=mass)
    return fb.Body(name, position=tuple((np.add(start, end) / 2).tolist()), angle=turn, shape=shape, color=color)


def mechanism() -> fb.Mechanism:
    """The robot, its pen driven along a figure of eight."""
    m = fb.Mechanism("five-bar", planar=True, gravity=(0, -9.81), parameters={"width": 0.1, "height": 0.06, "T": "2 s"})
    for side, name in ((-1, "left"), (1, "right")):
        hinge, bend = np.array([side * APART / 2, 0.0]), elbow(side)
        m.add(
            bar(f"{name}_crank", hinge, bend, 0.5, "#2f6fb7"), bar(f"{name}_rod", bend, np.array(PEN), 0.3, "#c8ccd2")
        )
        m.add(fb.Revolute(f"{name}_motor", "ground", f"{name}_crank", at=tuple(hinge.tolist())))
        m.add(fb.Revolute(f"{name}_elbow", f"{name}_crank", f"{name}_rod", at=tuple(bend.tolist())))
    m.add(fb.Revolute("pen_joint", "left_rod", "right_rod", at=PEN))
    m.add(fb.Frame("pen", "left_rod", position=(ROD / 2, 0)))
    m.add(fb.Driver("pen_x", "pen.x", "width*sin(2*pi*t/T)"))
    m.add(fb.Driver("pen_y", "pen.y", f"{PEN[1]} + height*sin(4*pi*t/T)"))
    return m


def torques(m: fb.Mechanism, times: np.ndarray) -> np.ndarray:
    """Torques of the motors at times, (n, 2) [N m]."""
    run = m.kinematics(times)
    p = m.changed({d.name: None for d in m.drivers}).prepare(coordinates="joint")
    joints = [name.partition(".")[0] for name in p.names]
    q, v, a = (np.array([run[f"{j}.{what}"] for j in joints]).T for what in ("angle", "rate", "acceleration"))
    return p.rnea(q, v, a, drives=[f"{name}.angle" for name in MOTORS])


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    m = mechanism()
    print("largest torques [N m]:", np.abs(torques(m, np.linspace(0, 2, 201))).max(axis=0).round(4))
    m.simulate(2, outputs=201).to_html(folder / "five_bar.html")
