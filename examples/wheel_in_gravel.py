"""A driven wheel with lugs on a bed of grains, in the plane: its sinkage and drawbar pull against its slip.

A carriage moves at v, and the wheel turns at w, so its slip is s = 1 - v / (w R); it is free to sink under its weight.
This is the single-wheel test of terramechanics (M. G. Bekker 1956; J. Y. Wong 2008): with slip the wheel pulls more
and sinks deeper, until the pull reaches a limit below the friction of grains on each other times the weight.

Averaged over time the grains carry the weight, and the work of the motor is that of the pull and of losses.

Run it with ``python examples/wheel_in_gravel.py out``: it prints the figures, and writes a page with the animation.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

GRAIN, RADIUS, LUG, LUGS = 0.01, 0.1, 0.008, 16  # m: mean diameter, radius of the rim, height of lugs; their number
SIZES = GRAIN * np.linspace(0.8, 1.2, 5)  # m, diameters
COLORS = ("#e5862b", "#d9a441", "#c9704a", "#b85c38", "#e0b878")
FRICTION, SPEED, REST = 0.5, 3.0, 0.6  # of grains; turning speed [rad/s]; time until the wheel turns [s]
STEP = fb.Stepping(step=1e-3, solver="gauss-seidel")


def wheel(breadth: float = GRAIN) -> list[fb.Solid]:
    """A disc with lugs."""
    angle = 2 * np.pi * np.arange(LUGS) / LUGS
    r = RADIUS + LUG / 2
    lug = {"edges": (LUG, 0.6 * LUG, breadth)}
    lugs = [
        fb.Box(**lug, position=(r * np.cos(a), r * np.sin(a), 0), orientation=(np.cos(a / 2), 0, 0, np.sin(a / 2)))
        for a in angle
    ]
    return [fb.Cylinder(radius=RADIUS, length=breadth), *lugs]


def bed(length: float, layers: int) -> np.ndarray:
    """Places of loose grains in rows."""
    pitch = 1.22 * GRAIN
    row = int(length / pitch)
    k = np.arange(row * layers)
    places = pitch * np.stack([k % row + 0.6, k // row + 0.6], axis=1)
    return places + np.random.default_rng(1).uniform(-0.02, 0.02, places.shape) * GRAIN


def mechanism(slip: float = 0.3, length: float = 0.9, layers: int = 10, mass: float = 0.12) -> fb.Mechanism:
    """The wheel rests on the bed and then moves at a slip; the wheel and its fork have ``mass`` [kg] together."""
    numbers = {"speed": SPEED, "slip": slip, "rest": REST, "R": RADIUS + LUG}
    m = fb.Mechanism("wheel in gravel", planar=True, gravity=(0, -9.81), parameters=numbers)
    start = bed(length, layers)
    x, y = 0.2, float(start[:, 1].max()) + GRAIN + RADIUS + LUG
    walls = [fb.Box(edges=(GRAIN, 1.6 * y, GRAIN), position=(p, 0.8 * y, 0)) for p in (-GRAIN / 2, length + GRAIN / 2)]
    floor = fb.Box(edges=(length + 2 * GRAIN, GRAIN, GRAIN), position=(length / 2, -GRAIN / 2, 0))
    m.add(
        fb.Ground("trough", shape=[floor, *walls], color="#5b6770"),
        fb.Body(
            "carriage",
            mass=0.1,
            inertia=1e-4,
            position=(x, y),
            shape=fb.Box(edges=(0.06, 0.02, 0.01), position=(0, 0.17, 0), looks=True),
            color="#9aa6b3",
        ),
        fb.Body(
            "fork",
            mass=0.1 * mass,
            inertia=1e-5,
            position=(x, y),
            shape=fb.Box(edges=(0.016, 0.2, 0.01), position=(0, 0.09, 0.012), looks=True),
            color="#5b6b7c",
        ),
        fb.Body(
            "wheel", mass=0.9 * mass, inertia=0.45 * mass * RADIUS**2, position=(x, y), shape=wheel(), color="#2f6fb7"
        ),
        fb.Prismatic("rail", "ground", "carriage", at=(x, y), axis=(1, 0)),
        fb.Prismatic("guide", "carriage", "fork", at=(x, y), axis=(0, 1)),
        fb.Revolute("axle", "fork", "wheel", at=(x, y)),
        fb.Driver("pull", "rail.displacement", "speed*R*(1 - slip)*max(t - rest, 0)"),
        fb.Driver("motor", "axle.angle", "-speed*max(t - rest, 0)"),
    )
    size = np.random.default_rng(2).permutation(len(start)) % len(SIZES)
    for j, (d, color) in enumerate(zip(SIZES, COLORS, strict=True)):
        grain = fb.Sphere(radius=d / 2)
        m.add(fb.Bodies(f"grains {j}", shape=grain, density=2500, position=start[size == j], color=color))
    m.add(fb.Contact(friction=FRICTION))
    return m


def means(run: fb.Result, first: float = 1.0) -> dict[str, float]:
    """Means from a time on: forces in weights W of wheel and fork, torque in W R, height of the axle [m]."""
    late = run.t > first
    weight = 9.81 * sum(run.model[name].mass for name in ("fork", "wheel"))
    force = run["wheel"].contact_force[late].mean(axis=0) / weight
    return {
        "normal": float(force[1]),
        "traction": float(force[0]),
        "pull": float(-run["pull.effort"][late].mean() / weight),
        "torque": float(-run["motor.effort"][late].mean() / weight / (RADIUS + LUG)),
        "height": float(run["wheel.y"][late].mean()),
    }


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    for slip in (0.0, 0.3, 0.6):
        run = mechanism(slip).simulate(2.4, outputs=481, method=STEP)
        print(f"slip {slip}:", ", ".join(f"{k} {x:.3f}" for k, x in means(run).items()))
    run.to_html(folder / "wheel_in_gravel.html")
