"""A gripper on a gantry takes one part out of a bin of parts, lifts it and lays it on a tray.

The parts are poured into the bin. When they rest, ``target`` chooses the one that lies on top and away from the walls;
the gantry goes there, turns the fingers across the part, closes them and lifts. Two fingers that press by F each hold a
part of mass m as long as 2 mu F > m (g + a).

Run it with ``python examples/bin_picking.py out``: it prints what was lifted, and writes a page with the animation.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

RADIUS, LENGTH, DENSITY = 0.012, 0.036, 2700.0  # of the parts: m, m (of the straight piece), kg/m^3
BIN, TALL, THICK = (0.26, 0.2), 0.09, 0.008  # m: inside of the bin; height and thickness of its walls
HEIGHT, TRAY = 0.32, 0.3  # m: of the fingers' tips while they travel; distance of the tray from the bin along x
FINGER, OPEN, DEEP = (0.004, 0.014, 0.1), 0.018, 0.004  # m: edges; half the gap; how far the tips go below the axis
SETTLED = 1.2  # s
STEP = fb.Stepping(step=2e-3, solver="gauss-seidel")


def bin_walls() -> list[fb.Solid]:
    """A bin without a lid, on z = 0."""
    a, b = BIN
    sides = [fb.Box(edges=(THICK, b + 2 * THICK, TALL), position=(s * (a + THICK) / 2, 0, TALL / 2)) for s in (-1, 1)]
    ends = [fb.Box(edges=(a, THICK, TALL), position=(0, s * (b + THICK) / 2, TALL / 2)) for s in (-1, 1)]
    return [fb.Box(edges=(a + 2 * THICK, b + 2 * THICK, THICK), position=(0, 0, -THICK / 2)), *sides, *ends]


def gantry(m: fb.Mechanism) -> None:
    """Bridge along x, trolley along y, a wrist that turns about z and moves along it, two fingers."""
    x, z = TRAY, HEIGHT + FINGER[2]
    steel, blue = "#5b6b7c", "#2f6fb7"
    m.add(
        fb.Body(
            "bridge",
            mass=2,
            inertia=(0.02,) * 3,
            position=(x, 0, z + 0.3),
            color="#9aa6b3",
            shape=fb.Box(edges=(0.03, 0.34, 0.03), looks=True),
        ),
        fb.Body(
            "trolley",
            mass=1,
            inertia=(0.01,) * 3,
            position=(x, 0, z + 0.3),
            color=steel,
            shape=fb.Box(edges=(0.06, 0.06, 0.05), looks=True),
        ),
        fb.Body(
            "mast",
            mass=0.5,
            inertia=(0.01,) * 3,
            position=(x, 0, z),
            color=steel,
            shape=fb.Box(edges=(0.02, 0.02, 0.4), position=(0, 0, 0.2), looks=True),
        ),
        fb.Body(
            "palm",
            mass=0.4,
            inertia=(0.001,) * 3,
            position=(x, 0, z),
            color=steel,
            shape=fb.Box(edges=(0.09, 0.03, 0.02), position=(0, 0, 0.01), looks=True),
        ),
        fb.Prismatic("x axis", "ground", "bridge", at=(x, 0, z + 0.3), axis=(1, 0, 0)),
        fb.Prismatic("y axis", "bridge", "trolley", at=(x, 0, z + 0.3), axis=(0, 1, 0)),
        fb.Prismatic("z axis", "trolley", "mast", at=(x, 0, z), axis=(0, 0, 1)),
        fb.Revolute("wrist", "mast", "palm", at=(x, 0, z), axis=(0, 0, 1)),
    )
    for name, side in (("left", -1), ("right", 1)):
        at = (x + side * (OPEN + FINGER[0] / 2), 0, z - FINGER[2] / 2)
        m.add(
            fb.Body(name, shape=fb.Box(edges=FINGER), mass=0.05, position=at, color=blue),
            fb.Prismatic(f"{name} slide", "palm", name, at=at, axis=(-side, 0, 0)),
        )
    grip = "2*F*(step5(t, shut - 0.2, -1, shut, 1) - step5(t, free, 0, free + 0.1, 2)) - 20*rate"
    m.add(
        fb.Coupler("jaws", ["left slide.displacement", "right slide.displacement"], weights=[1, -1]),
        fb.Actuator("grip", "left slide.displacement", force=grip),
        fb.Limit("stop", "left slide.displacement", lower=0),
    )


def mechanism(count: int = 40, force: float = 4.0, friction: float = 0.5) -> fb.Mechanism:
    """``count`` parts fall into the bin; then the gantry goes to ``x``, ``y``, ``low`` and turns by ``turn``."""
    times = {"go": SETTLED, "down": SETTLED + 0.8, "shut": SETTLED + 1.6, "up": SETTLED + 1.8, "back": SETTLED + 2.6}
    times |= {"free": SETTLED + 4.2}
    place = {"x": 0.0, "y": 0.0, "low": TALL, "turn": 0.0, "F": force, "tray": TRAY, "high": HEIGHT}
    m = fb.Mechanism("bin picking", gravity=(0, 0, -9.81), parameters=times | place)
    m.add(fb.Material("part", friction=friction))
    m.add(
        fb.Ground("bin", shape=bin_walls(), color="#9aa6b3"),
        fb.Ground("tray", shape=fb.Box(edges=(0.16, 0.16, THICK), position=(TRAY, 0, -THICK / 2)), color="#c8b68c"),
    )
    pitch, rng, k = LENGTH + 2.3 * RADIUS, np.random.default_rng(1), np.arange(count)
    row, column = int(BIN[0] / pitch), int(BIN[1] / pitch)
    start = pitch * np.stack(
        [k % row - (row - 1) / 2, k // row % column - (column - 1) / 2, k // (row * column) + 0.6], axis=1
    )
    turn = rng.normal(size=(count, 4))
    turn /= np.linalg.norm(turn, axis=1)[:, None]
    part = fb.Capsule(radius=RADIUS, length=LENGTH)
    m.add(fb.Bodies("parts", shape=part, density=DENSITY, position=start, orientation=turn, color="#e5862b"))
    gantry(m)
    m.add(
        fb.Driver(
            "along", "x axis.displacement", "(x - tray)*(step5(t, go, 0, down, 1) - step5(t, back, 0, back + 0.8, 1))"
        ),
        fb.Driver("across", "y axis.displacement", "y*(step5(t, go, 0, down, 1) - step5(t, back, 0, back + 0.8, 1))"),
        fb.Driver("turning", "wrist.angle", "turn*step5(t, go, 0, down, 1)"),
        fb.Driver(
            "hoist",
            "z axis.displacement",
            "(low - high)*(step5(t, down, 0, shut - 0.2, 1) - step5(t, up, 0, back, 1))"
            " - (high - 0.012)*(step5(t, back + 0.8, 0, free, 1) - step5(t, free + 0.2, 0, free + 0.8, 1))",
        ),
        fb.Contact(friction=friction),
    )
    return m


def axes(run: fb.Result) -> np.ndarray:
    """Directions of the parts' axes at the end of a motion, (parts, 3)."""
    w, x, y, z = run["parts"].quaternion[-1].T
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)


def blocked(run: fb.Result, k: int) -> int:
    """Number of points of other parts, five on each axis, that are too near to where the fingers go for part ``k``."""
    places, axis = run["parts"].position[-1], axes(run)
    others = places[:, None] + np.linspace(-0.5, 0.5, 5)[:, None] * LENGTH * axis[:, None]
    away = np.delete(others, k, axis=0).reshape(-1, 3) - places[k]
    along = axis[k] * (1, 1, 0) / np.hypot(*axis[k, :2])
    across = np.abs(np.abs(away @ np.cross((0, 0, 1), along)) - OPEN - FINGER[0] / 2) < FINGER[0] / 2 + RADIUS
    return int((across & (np.abs(away @ along) < FINGER[1] / 2 + RADIUS) & (away[:, 2] > -DEEP - RADIUS)).sum())


def target(run: fb.Result) -> tuple[int, dict[str, float]]:
    """Return the number of the part to take at the end of a motion, and the parameters by which the gripper does.

    Its axis is within 25 degrees of the horizontal, the fingers fit between it and the walls, and as few other parts as
    possible are in their way; the highest of several.
    """
    places, axis = run["parts"].position[-1], axes(run)
    inside = (abs(places[:, :2]) < np.array(BIN) / 2 - OPEN - 2 * FINGER[0]).all(axis=1)
    lying = abs(axis[:, 2]) < np.sin(np.radians(25))
    k = min(np.flatnonzero(inside & lying).tolist(), key=lambda k: (blocked(run, k), -places[k, 2]))
    x, y, z = places[k].tolist()
    turn = float(np.arctan2(axis[k, 1], axis[k, 0])) % np.pi - np.pi / 2  # the fingers close across the axis
    return k, {"x": x, "y": y, "low": z - DEEP, "turn": turn}


def part_force(run: fb.Result, k: int, t: float) -> tuple[np.ndarray, float]:
    """Force of the fingers on part ``k`` [N], and the mean of their normal forces, at a time."""
    table = run.contacts.table()
    sides = np.stack([table["side_1"], table["side_2"]])
    now = np.isclose(table["t"], run.t[np.argmin(abs(run.t - t))])
    pair = now & np.isin(sides, ("left", "right")).any(axis=0) & (sides == f"parts[{k}]").any(axis=0)
    force = np.stack([table[c][pair] for c in ("fx", "fy", "fz")], axis=1)
    normal = np.stack([table[c][pair] for c in ("nx", "ny", "nz")], axis=1)
    sign = np.where(sides[1][pair] == f"parts[{k}]", 1.0, -1.0)
    return sign @ force, float(abs((force * normal).sum(axis=1)).sum()) / 2


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    m = mechanism()
    k, place = target(m.simulate(SETTLED, outputs=61, method=STEP))
    run = m.simulate(6.2, outputs=311, method=STEP, parameters=place)
    held, press = part_force(run, k, SETTLED + 3.6)
    height = run["parts"].position[:, k, 2].max()
    print(
        f"part {k} is lifted to {height:.3f} m; the fingers' force on it: {held.round(2)} N, each presses {press:.2f} N"
    )
    run.to_html(folder / "bin_picking.html")
