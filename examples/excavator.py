"""The arm of an excavator: boom, arm and bucket with rocker and link, moved by three hydraulic cylinders.

The lengths of the cylinders are given over time; the forces that they need follow. Run it with
``python examples/excavator.py out``: it prints the largest forces, and writes a page with the animation.
"""

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np

import flyball as fb

POINTS = {  # m, as drawn: pins, eyes of cylinders (c: foot, p: head) and the bucket's tip
    "A": (0.0, 1.5), "B": (3.83, 4.71), "D": (4.5, 2.2), "E": (4.37, 2.68), "F": (4.93, 2.55), "G": (4.95, 2.05),
    "T": (3.8, 1.0), "c1": (0.7, 0.9), "p1": (1.4, 3.2), "c2": (2.0, 3.75), "p2": (3.4, 5.4), "c3": (4.2, 4.9),
}  # fmt: skip
BARS = {  # points through which each is drawn, mass [kg]
    "boom": (("A", "p1", "c2", "B"), 1200.0),
    "arm": (("p2", "c3", "B", "E", "D"), 600.0),
    "rocker": (("E", "F"), 40.0),
    "link": (("F", "G"), 40.0),
    "bucket": (("D", "G", "T", "D"), 500.0),
}
CYLINDERS = {
    "boom": ("ground", "c1", "boom", "p1"),
    "arm": ("boom", "c2", "arm", "p2"),
    "bucket": ("arm", "c3", "rocker", "F"),
}
STROKES = {"boom": 0.3, "arm": -0.35, "bucket": 0.2}  # m, there and back within `PERIOD`
PERIOD = 8.0  # s
COLORS = ("#e0a81f", "#e0a81f", "#5b6770", "#5b6770", "#3c444b")


def law(name: str) -> str:
    """Length of a cylinder over time [m]."""
    _, foot, _, head = CYLINDERS[name]
    start = float(np.hypot(*np.subtract(POINTS[head], POINTS[foot])))
    return f"{start} + {STROKES[name] / 2}*(1 - cos(2*pi*t/{PERIOD}))"


def mechanism() -> fb.Mechanism:
    """The arm on its frame."""
    m = fb.Mechanism("excavator arm", planar=True, gravity=(0, -9.81))
    frame = fb.Prism(outline=[(-1.6, 0), (0.9, 0), (0.9, 1.0), (0, 1.65), (-1.6, 1.2)], thickness=0.4, looks=True)
    m.add(fb.Ground("frame", shape=frame, color="#9aa6b3"))
    for color, (name, (points, mass)) in zip(COLORS, BARS.items(), strict=True):
        middle = np.mean([POINTS[p] for p in points], axis=0)
        at = [tuple(np.subtract(POINTS[p], middle)) for p in points]
        sides = [fb.Link(start=a, end=b, width=0.22, thickness=0.2, mass=mass / (len(at) - 1)) for a, b in pairwise(at)]
        m.add(fb.Body(name, position=tuple(middle), shape=sides, color=color))
        m.add(*(fb.Frame(f"{name} {p}", name, position=x) for p, x in dict(zip(points, at, strict=True)).items()))
    pins = {"A": ("ground", "boom"), "B": ("boom", "arm"), "D": ("arm", "bucket"), "E": ("arm", "rocker")}
    pins |= {"F": ("rocker", "link"), "G": ("link", "bucket")}
    m.add(*(fb.Revolute(p, i, j, at=POINTS[p]) for p, (i, j) in pins.items()))
    for name, (i, foot, j, head) in CYLINDERS.items():
        m.add(fb.LinearActuator(f"{name} cylinder", i, j, at=(POINTS[foot], POINTS[head]), length=law(name)))
    return m


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    run = mechanism().simulate(PERIOD, outputs=401)
    for name in CYLINDERS:
        print(f"{name} cylinder: {abs(run[f'{name} cylinder_drive.effort']).max() / 1e3:.1f} kN at most")
    run.to_html(folder / "excavator.html")
