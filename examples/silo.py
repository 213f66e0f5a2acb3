"""Grains in a flat-bottomed silo, in the plane: discharge (Beverloo), pressure on the walls (Janssen), angle of repose.

Round grains of five diameters d, 8 mm on average. Through an outlet of breadth D flow C n sqrt(g) (D - k d)^1.5 grains
per second, n being their number per area (W. A. Beverloo, H. A. Leniger, J. van de Velde 1961; in space the exponent is
2.5). Below about 6 d they form arches and stop. What has left makes a heap on the floor. With a closed outlet the walls
carry a part of the weight: the pressure tends to a limit with depth (H. A. Janssen 1895). In his theory friction is
mobilised along the whole wall; here it is where the walls creep upwards (``creep``).

Grains resist rolling by ``rolling`` (of d), as angular ones do; round ones neither make a steep heap nor load the walls
by all their friction.

Run it with ``python examples/silo.py out``: it prints the flow, and writes a page with the animation.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

GRAIN, FLOOR, THICK = 0.008, -0.12, 0.01  # m: mean diameter, height of the floor below the silo, thickness of walls
SIZES = GRAIN * np.linspace(0.9, 1.1, 5)  # m, diameters
COLORS = ("#e5862b", "#d9a441", "#c9704a", "#b85c38", "#e0b878")
STEP = fb.Stepping(step=5e-4, solver="gauss-seidel")


def box(material: str, x: float, y: float, wide: float, tall: float) -> fb.Box:
    """A rectangle about a point."""
    return fb.Box(edges=(wide, tall, 0.02), position=(x, y, 0), material=material)


def mechanism(
    outlet: float = 0.08, count: int = 400, breadth: float = 0.12, rolling: float = 0.1, creep: float = 0.0
) -> fb.Mechanism:
    """Grains that begin to fall in loose rows; the outlet [m] is open, or closed if it is 0."""
    m = fb.Mechanism("silo", planar=True, gravity=(0, -9.81))
    pitch = 1.15 * GRAIN
    row = int(breadth / pitch)
    k, rng = np.arange(count), np.random.default_rng(1)
    start = pitch * np.stack([k % row - (row - 1) / 2, k // row + 1], axis=1)
    start += rng.uniform(-0.02, 0.02, (count, 2)) * GRAIN
    size = rng.permutation(count) % len(SIZES)
    tall, half, sides = float(start[:, 1].max()) + 0.02, (breadth - outlet) / 2 + THICK, (-1, 1)
    walls = [box("creeping", x * (breadth + THICK) / 2, tall / 2, THICK, tall) for x in sides]
    bottom = [box("resting", x * (outlet + half) / 2, -THICK / 2, half, THICK) for x in sides]
    tray = [box("resting", x * 0.3, FLOOR + 0.02, THICK, 0.05) for x in sides]
    tray.append(box("resting", 0, FLOOR - THICK / 2, 0.6, THICK))
    m.add(fb.Material("creeping", friction=0.5, surface_velocity=(0, creep, 0)), fb.Material("resting", friction=0.5))
    m.add(fb.Ground("walls", shape=walls, color="#9aa6b3"), fb.Ground("bottom", shape=bottom, color="#5b6770"))
    m.add(fb.Ground("tray", shape=tray, color="#5b6770"))
    for j, (d, color) in enumerate(zip(SIZES, COLORS, strict=True)):
        grain = fb.Sphere(radius=d / 2)
        m.add(fb.Bodies(f"grains {j}", shape=grain, density=2500, position=start[size == j], color=color))
    m.add(fb.Contact(friction=0.5, rolling_friction=rolling * GRAIN))
    return m


def positions(run: fb.Result) -> np.ndarray:
    """Centres of all grains, (times, grains, 2) [m]."""
    return np.concatenate([run[s.name].position[..., :2] for s in run.model.bulk], axis=1)


def flow(run: fb.Result, first: int = 40, last: int = 240) -> float:
    """Grains per second that pass the outlet, from the first of these numbers to the last."""
    out = (positions(run)[..., 1] < 0).sum(axis=1)
    a, b = np.searchsorted(out, (first, min(last, out[-1])))
    return float((out[b] - out[a]) / (run.t[b] - run.t[a]))


def wall_forces(run: fb.Result, breadth: float, edges: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Forces across both walls between the heights ``edges``, along them, and on the bottom, in the second half [N]."""
    table = run.contacts.table()
    late = table["t"] > run.t[-1] / 2
    times = len(np.unique(table["t"][late]))
    on_ground = late & ((table["side_1"] == "ground") | (table["side_2"] == "ground"))
    wall, bottom = on_ground & (abs(table["nx"]) > 0.9), on_ground & (abs(table["ny"]) > 0.9)
    across = np.histogram(table["y"][wall], edges, weights=abs(table["fx"][wall]))[0] / times
    return across, abs(table["fy"][wall].sum()) / times, abs(table["fy"][bottom].sum()) / times


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    for diameters in (6, 8, 10):
        run = mechanism(diameters * GRAIN, rolling=0.0).simulate(0.6, outputs=61, method=STEP)
        print(f"outlet of {diameters} diameters: {flow(run):.0f} grains/s")
    mechanism().simulate(1.5, outputs=151, method=STEP).to_html(folder / "silo.html")
