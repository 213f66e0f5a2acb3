"""Planar linkages from a table: legs of Jansen and Klann, six-bars, Hoeken's line, a pantograph, Schmidt's coupling.

A point is given, or lies at two distances from two points (a dyad): ``("W", "X", 50, "Y", 41.5, +1)`` lies 50 from X
and 41.5 from Y, on the left (+1) or right (-1) side of the line from X to Y. Bars are rigid through all their points; a
hinge joins all bars at a point. The first bar turns.

Run one with ``python examples/linkages.py jansen out``: it prints its freedoms, and writes a page with the animation.
"""

import sys
from dataclasses import dataclass
from itertools import combinations, cycle
from pathlib import Path

import numpy as np

import flyball as fb

COLORS = ("#a63d2f", "#5b6770", "#c08a3e", "#2f6fb7", "#4f8a5b", "#8a5b8a", "#7a6a53")


@dataclass
class Linkage:
    """Given points [m], dyads in the order of construction, bars, and the unit of all lengths [m]."""

    given: dict[str, tuple[float, float]]
    dyads: list[tuple[str, str, float, str, float, int]]
    bars: dict[str, tuple[str, ...]]
    ground: tuple[str, ...]
    unit: float = 0.01
    trace: str = ""


LINKAGES = {
    # Theo Jansen's leg (1991): his eleven "holy numbers"; the foot S walks on a nearly straight line.
    "jansen": Linkage(
        {"O": (0, 0), "Y": (-38, -7.8), "X": (15, 0)},
        [("W", "X", 50, "Y", 41.5, -1), ("U", "X", 61.9, "Y", 39.3, 1), ("V", "W", 55.8, "Y", 40.1, -1),
         ("T", "V", 39.4, "U", 36.7, -1), ("S", "T", 65.7, "U", 49, -1)],
        {"crank": ("O", "X"), "upper rod": ("X", "W"), "lower rod": ("X", "U"), "rocker": ("Y", "W", "V"),
         "lower rocker": ("Y", "U"), "shin rod": ("V", "T"), "foot": ("T", "U", "S")},
        ("O", "Y"), trace="S",
    ),
    # Watt's first six-bar: two four-bars that share the ternary coupler; the last rod runs between two couplers.
    "watt": Linkage(
        {"A": (0, 0), "D": (60, 0), "B": (0, 20)},
        [("C", "B", 55, "D", 45, 1), ("E", "B", 30, "C", 45, 1), ("F", "C", 28, "D", 60, -1),
         ("G", "E", 45, "F", 50, 1)],
        {"crank": ("A", "B"), "coupler": ("B", "C", "E"), "rocker": ("D", "C", "F"), "rod": ("E", "G"),
         "arm": ("F", "G")},
        ("A", "D"), trace="G",
    ),
    # Stephenson's third six-bar: a four-bar whose coupler point drives a dyad on ground.
    "stephenson": Linkage(
        {"A": (0, 0), "D": (60, 0), "B": (0, 20), "H": (80, 45)},
        [("C", "B", 55, "D", 45, 1), ("E", "B", 40, "C", 35, 1), ("G", "E", 55, "H", 50, 1)],
        {"crank": ("A", "B"), "coupler": ("B", "C", "E"), "rocker": ("D", "C"), "rod": ("E", "G"), "arm": ("H", "G")},
        ("A", "D", "H"), trace="G",
    ),
    # Hoeken's line (1926): crank 1, ground 2, coupler 2.5 and 2.5 more, rocker 2.5; the coupler's end runs straight.
    "hoeken": Linkage(
        {"A": (0, 0), "D": (20, 0), "B": (-10, 0)},
        [("C", "B", 25, "D", 25, 1), ("P", "B", 50, "C", 25, 1)],
        {"crank": ("A", "B"), "coupler": ("B", "C", "P"), "rocker": ("D", "C")},
        ("A", "D"), trace="P",
    ),
    # Klann's leg (US patent 6260862, 1998), measured in a figure: crank, two rockers, connecting rod and leg.
    "klann": Linkage(
        {"A": (41.4, 26.64), "B": (27.69, 19.71), "D": (27.69, 31.09), "C": (36.04, 25.41)},
        [("E", "C", 14.91, "B", 6.63, -1), ("K", "C", 25.4, "E", 10.62, -1), ("H", "D", 8.46, "K", 13.94, -1),
         ("S", "K", 24.47, "H", 38.23, -1)],
        {"crank": ("A", "C"), "connecting rod": ("C", "E", "K"), "lower rocker": ("B", "E"), "upper rocker": ("D", "H"),
         "leg": ("H", "K", "S")},
        ("A", "B", "D"), trace="S",
    ),
    # Scheiner's pantograph (1603), led round a circle by a crank: Q draws what P draws, three times as large, from O.
    "pantograph": Linkage(
        {"Z": (15, 20), "P": (19, 20), "O": (0, 0)},
        [("A", "O", 20, "P", 36, 1), ("B", "O", 60, "A", 40, 1), ("D", "P", 40, "B", 36, -1),
         ("Q", "B", 108, "D", 72, 1)],
        {"crank": ("Z", "P"), "arm": ("O", "A", "B"), "forearm": ("B", "D", "Q"), "upper rod": ("P", "D"),
         "lower rod": ("A", "P")},
        ("Z", "O"), trace="Q",
    ),
    # Schmidt's coupling (US patent 3242694, 1966): shafts whose distance may change; the middle disk has no bearing.
    "schmidt": Linkage(
        {"A": (0, 0), "C": (30, 0)}
        | {f"a{k}": (24 * np.cos(np.pi * k / 1.5), 24 * np.sin(np.pi * k / 1.5)) for k in range(3)}
        | {f"b{k}": (15 + 24 * np.cos(np.pi * k / 1.5), 20 + 24 * np.sin(np.pi * k / 1.5)) for k in range(3)}
        | {f"c{k}": (30 + 24 * np.cos(np.pi * k / 1.5), 24 * np.sin(np.pi * k / 1.5)) for k in range(3)},
        [],
        {"driving disk": ("A", "a0", "a1", "a2"), "middle disk": ("b0", "b1", "b2")}
        | {"driven disk": ("C", "c0", "c1", "c2")}
        | {f"link {k}": (f"a{k}", f"b{k}") for k in range(3)}
        | {f"rod {k}": (f"b{k}", f"c{k}") for k in range(3)},
        ("A", "C"), trace="c0",
    ),
}  # fmt: skip


def points_of(linkage: Linkage) -> dict[str, np.ndarray]:
    """All points as drawn [m]."""
    at = {name: np.array(p, float) for name, p in linkage.given.items()}
    for name, a, r, b, s, side in linkage.dyads:
        d = at[b] - at[a]
        length = np.hypot(*d)
        along = (length**2 + r**2 - s**2) / (2 * length)
        square = r**2 - along**2
        across = np.sqrt(square) if square > 1e-12 * r**2 else 0.0  # 0 where the two circles touch
        at[name] = at[a] + (along * d + side * across * np.array([-d[1], d[0]])) / length
    return {name: linkage.unit * p for name, p in at.items()}


def mechanism(name: str = "jansen", speed: str = "30 rpm") -> fb.Mechanism:
    """One of `LINKAGES`, its first bar driven at constant speed."""
    linkage = LINKAGES[name]
    at = points_of(linkage)
    width = 2 * linkage.unit
    m = fb.Mechanism(f"linkage of {name.capitalize()}", planar=True, gravity=(0, -9.81), parameters={"speed": speed})
    ends: dict[str, list[str]] = {p: ["ground"] for p in linkage.ground}
    for color, (bar, points) in zip(cycle(COLORS), linkage.bars.items(), strict=False):
        middle = np.mean([at[p] for p in points], axis=0)
        sides = [
            fb.Link(start=tuple(at[p] - middle), end=tuple(at[q] - middle), width=width, thickness=width / 2)
            for p, q in combinations(points, 2)
            if np.hypot(*(at[p] - at[q])) > 0
        ]
        m.add(fb.Body(bar, position=tuple(middle), shape=sides, density=2700, color=color))
        for p in points:
            ends.setdefault(p, []).append(bar)
            m.add(fb.Frame(f"{bar} {p}", bar, position=tuple(at[p] - middle)))
    for p, bars in ends.items():
        for k, bar in enumerate(bars[1:], start=1):
            m.add(fb.Revolute(p if len(bars) == 2 else f"{p}{k}", bars[0], bar, at=tuple(at[p])))
    first = next(iter(linkage.bars.values()))[0]
    m.add(fb.Driver("motor", f"{first}.angle", "speed*t"))
    return m


if __name__ == "__main__":
    name = sys.argv[1] if len(sys.argv) > 1 else "jansen"
    folder = Path(sys.argv[2] if len(sys.argv) > 2 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    m = mechanism(name)
    print(m.mobility())
    m.simulate(4, outputs=401).to_html(folder / f"{name}.html")
