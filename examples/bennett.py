"""Bennett's linkage (1903): four bars and four hinges in space that should lock, and move all the same.

Opposite bars are equal. Each has a length (the distance of its two hinge axes) and a twist (their angle), and hinges
follow each other without offset. With sin(twist) / length equal for all bars the linkage moves, although a count of
freedoms gives -2: three of its 20 rows are redundant. Of two successive hinge angles the product tan(a/2) tan(b/2) is
constant.

Run it with ``python examples/bennett.py out``: it prints its mobility, and writes a page with the animation.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

LENGTHS = (0.30, 0.18)  # m, of opposite pairs
TWIST = np.radians(50)  # of the first pair
TWISTS = (TWIST, float(np.arcsin(LENGTHS[1] / LENGTHS[0] * np.sin(TWIST))))
RATIO = float(np.sin((TWISTS[1] + TWISTS[0]) / 2) / np.sin((TWISTS[1] - TWISTS[0]) / 2))
COLORS = ("#a63d2f", "#2f6fb7", "#c08a3e")


def axes(angle: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Point [m] and direction of each of the four hinge axes as drawn, for the angle [rad] of the first hinge."""
    other = 2 * np.arctan(RATIO / np.tan(angle / 2))
    p, R, out = np.zeros(3), np.eye(3), []
    for k, turn in enumerate((angle, other, -angle, -other)):
        out.append((p, R[:, 2]))
        c, s = np.cos(turn), np.sin(turn)
        R = R @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])  # about the hinge, then along the bar and twisted about it
        p = p + LENGTHS[k % 2] * R[:, 0]
        c, s = np.cos(TWISTS[k % 2]), np.sin(TWISTS[k % 2])
        R = R @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return out


def mechanism(angle: str = "100 deg") -> fb.Mechanism:
    """The linkage on its fourth bar; its first hinge is driven at constant speed."""
    at = axes(np.radians(float(angle.removesuffix(" deg"))))
    m = fb.Mechanism("Bennett's linkage", gravity=(0, 0, -9.81), parameters={"speed": "30 rpm"})
    for k in range(3):
        (p, _), (q, _) = at[k], at[k + 1]
        middle = (p + q) / 2
        bar = fb.Rod(start=tuple(p - middle), end=tuple(q - middle), radius=0.008)
        pins = [
            fb.Rod(start=tuple(x - middle - 0.03 * z), end=tuple(x - middle + 0.03 * z), radius=0.006)
            for x, z in at[k : k + 2]
        ]
        m.add(fb.Body(f"bar {k + 1}", position=tuple(middle), shape=[bar, *pins], density=2700, color=COLORS[k]))
    bodies = ["ground", "bar 1", "bar 2", "bar 3", "ground"]
    for k, (p, z) in enumerate(at):
        m.add(fb.Revolute(f"{'ABCD'[k]}", bodies[k], bodies[k + 1], at=tuple(p), axis=tuple(z)))
    m.add(fb.Driver("motor", "A.angle", "speed*t"))
    return m


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    m = mechanism()
    print(m.mobility())
    m.simulate(2, outputs=201).to_html(folder / "bennett.html")
