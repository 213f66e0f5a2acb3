"""An hourglass: grains run through its neck at a constant rate, which grows with the neck by Beverloo's law.

Grains of diameter d, n of them per area or volume, pass a neck of breadth D at C n sqrt(g) (D - k d)^(3/2) per second
in the plane and at C n sqrt(g) (D - k d)^(5/2) in space (W. A. Beverloo, H. A. Leniger, J. van de Velde 1961). Unlike
the rate of water it does not depend on the height of filling: the grains above a neck carry each other like an arch,
and below it they fall freely.

Run it with ``python examples/hourglass.py out``: it prints the rates, and writes a page with the animation.
"""

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np

import flyball as fb

GRAIN, THICK = 0.004, 0.003  # m: mean diameter, thickness of the glass
SIZES = GRAIN * np.linspace(0.9, 1.1, 3)  # m, diameters
COLORS = ("#e5862b", "#d9a441", "#c9704a")
STEEP = np.tan(np.radians(50))  # slope of the funnel
FULL, PANELS = 400, 12  # grains; panels of the glass around its axis, in space
STEP = fb.Stepping(step=5e-4, solver="gauss-seidel", iterations=100)


def panel(low: tuple[float, float], high: tuple[float, float], way: float, wide: float) -> fb.Hull:
    """A flat piece of the wall from one (radius, height) to another, in the direction ``way`` around the axis.

    Its half breadth is ``wide`` of its radius, at least half a grain.
    """
    e, across = np.array([[np.cos(way), 0, np.sin(way)], [-np.sin(way), 0, np.cos(way)]])
    (x, y), (dx, dy) = low, np.subtract(high, low)
    out = THICK * np.array([abs(dy), -dx * np.sign(dy)]) / np.hypot(dx, dy)
    corners = [(x, y), high, (x + out[0], y + out[1]), (high[0] + out[0], high[1] + out[1])]
    return fb.Hull(
        vertices=[r * e + (0, h, 0) + s * max(wide * r, GRAIN / 2) * across for r, h in corners for s in (-1, 1)]
    )


def glass(neck: float, radius: float, tall: float, planar: bool) -> list[fb.Solid]:
    """The walls of both chambers, and the floor of the lower one; the neck is at height 0."""
    n = 2 if planar else PANELS
    wide = 0 if planar else np.tan(np.pi / n)
    rise = STEEP * (radius - neck / 2)
    outline = [(neck / 2, 0.0), (radius, rise), (radius, tall)]
    walls = [
        panel((a[0], side * a[1]), (b[0], side * b[1]), 2 * np.pi * k / n, wide)
        for a, b in pairwise(outline)
        for side in (1, -1)
        for k in range(n)
    ]
    deep = GRAIN if planar else 2 * (radius + THICK)
    return [*walls, fb.Box(edges=(2 * (radius + THICK), THICK, deep), position=(0, -tall - THICK / 2, 0))]


def filling(count: int, neck: float, radius: float, planar: bool) -> np.ndarray:
    """Places of loose grains in the upper chamber, from its lowest."""
    pitch = 1.15 * GRAIN
    row = pitch * (np.arange(-int(radius / pitch) - 1, int(radius / pitch) + 2))
    y = pitch * np.arange(1, 2 + int(count / (1 if planar else row.size**1.2)) + row.size)
    x, z = (v.ravel() for v in np.meshgrid(row, [0.0] if planar else row))
    wide = np.minimum(neck / 2 + y / STEEP, radius) - GRAIN * (0.6 + 0.6 / STEEP)
    found = [(a, h, b) for h, w in zip(y, wide, strict=True) for a, b in zip(x, z, strict=True) if np.hypot(a, b) < w]
    places = np.array(found[:count])
    places += np.random.default_rng(1).uniform(-0.02, 0.02, places.shape) * GRAIN
    return places[:, :2] if planar else places


def mechanism(neck: float = 6 * GRAIN, count: int = FULL, radius: float = 0.05, planar: bool = True) -> fb.Mechanism:
    """Grains that begin to fall in loose rows above a neck of breadth ``neck`` [m], in a chamber of ``radius`` [m]."""
    m = fb.Mechanism("hourglass", planar=planar, gravity=(0, -9.81) if planar else (0, -9.81, 0))
    start = filling(count, neck, radius, planar)
    tall = float(start[:, 1].max()) + 2 * GRAIN
    m.add(fb.Ground("glass", shape=glass(neck, radius, tall, planar), color="#9aa6b3"))
    size = np.random.default_rng(2).permutation(count) % len(SIZES)
    for j, (d, color) in enumerate(zip(SIZES, COLORS, strict=True)):
        grain = fb.Sphere(radius=d / 2)
        m.add(fb.Bodies(f"grains {j}", shape=grain, density=2500, position=start[size == j], color=color))
    m.add(fb.Contact(friction=0.5))
    return m


def passed(run: fb.Result) -> np.ndarray:
    """Number of grains below the neck, over time."""
    return sum((run[s.name].position[..., 1] < 0).sum(axis=1) for s in run.model.bulk)


def rate(run: fb.Result, first: float = 0.2, last: float = 0.7) -> float:
    """Grains per second, from the time when a part ``first`` of all has passed to the time of ``last``."""
    n = passed(run)
    a, b = np.searchsorted(n, np.array([first, last]) * sum(len(s.position) for s in run.model.bulk))
    return float(np.polyfit(run.t[a:b], n[a:b], 1)[0])


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    for diameters in (5, 7, 9, 11):
        run = mechanism(diameters * GRAIN).simulate(0.6, outputs=121, method=STEP)
        print(f"neck of {diameters} diameters: {rate(run):.0f} grains/s")
    for count in (FULL, 2 * FULL):
        run = mechanism(count=count).simulate(1.0, outputs=201, method=STEP)
        print(f"{count} grains: {rate(run):.0f} grains/s")
    mechanism().simulate(1.2, outputs=241, method=STEP).to_html(folder / "hourglass.html")
