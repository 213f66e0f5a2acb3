"""Schatz's linkage (1929), the heart of the Turbula mixer: six hinges in space, neighbours at right angles.

It is a special Bricard linkage. The hinges on ground are parallel, sqrt(3) lengths apart; the three middle bodies have
one length each, the first and last none. A count of freedoms gives 0, and it moves all the same: one row is redundant.
The middle body, the mixing drum, turns, rocks and swings while the driving shaft turns through whole turns.

Run it with ``python examples/schatz.py out``: it prints its mobility, and writes a page with the animation.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

LENGTH = 0.2  # m
START = 1.0  # rad, angle of the first hinge as drawn
COLORS = ("#5b6770", "#a63d2f", "#c08a3e", "#2f6fb7", "#5b6770")


def frames(angles: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Point and axes of the six hinges, for the angles of the first five; lengths in units of `LENGTH`."""
    p, R, out = np.zeros(3), np.eye(3), []
    for a, length in zip(angles, (0, 1, 1, 1, 0), strict=True):
        out.append((p, R))
        c, s = np.cos(a), np.sin(a)
        R = R @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        p = p + length * R[:, 0]
        R = R @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # twisted by a right angle
    return [*out, (p, R)]


def closure(rest: np.ndarray) -> np.ndarray:
    """Distance of the sixth hinge from its place on ground, and components of its axis across the first."""
    p, R = frames(np.r_[START, rest])[-1]
    return np.r_[p - (np.sqrt(3), 0, 0), R[:2, 2]]


def drawn() -> np.ndarray:
    """Angles of the first five hinges as drawn, by Newton's method."""
    x = np.array([1.0839, 1.9389, 0.9739, 0.6013])
    for _ in range(6):
        J = np.column_stack([(closure(x + 1e-6 * e) - closure(x - 1e-6 * e)) / 2e-6 for e in np.eye(4)])
        x = x - np.linalg.lstsq(J, closure(x), rcond=None)[0]
    return np.r_[START, x]


def mechanism() -> fb.Mechanism:
    """The linkage on its frame; its first hinge is driven at constant speed."""
    m = fb.Mechanism("Schatz's linkage", gravity=(0, 0, -9.81), parameters={"speed": "30 rpm"})
    at = [(LENGTH * p, R[:, 2]) for p, R in frames(drawn())]
    for k in range(5):
        (p, y), (q, z) = at[k], at[k + 1]
        middle = (p + q) / 2
        ends = [(p - middle - 0.03 * y, p - middle + 0.03 * y), (q - middle - 0.034 * z, q - middle + 0.034 * z)]
        if k % 4:
            ends.append((p - middle, q - middle))
        shape = [
            fb.Rod(start=tuple(a), end=tuple(b), radius=r)
            for (a, b), r in zip(ends, (0.01, 0.008, 0.009), strict=False)
        ]
        if k == 2:
            shape.append(fb.Rod(start=tuple(0.35 * (p - q)), end=tuple(0.35 * (q - p)), radius=0.035))
        m.add(fb.Body(f"body {k + 1}", position=tuple(middle), shape=shape, density=2700, color=COLORS[k]))
    bodies = ["ground", *(f"body {k}" for k in range(1, 6)), "ground"]
    for k, (p, z) in enumerate(at):
        m.add(fb.Revolute("ABCDEF"[k], bodies[k], bodies[k + 1], at=tuple(p), axis=tuple(z)))
    m.add(fb.Driver("motor", "A.angle", "speed*t"))
    return m


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    m = mechanism()
    print(m.mobility())
    m.simulate(4, outputs=401).to_html(folder / "schatz.html")
