"""Grains in a drum that turns slowly: their surface keeps an angle, the angle of repose, which grows with friction.

The grains turn with the drum as one body until their surface is too steep; from then on they slide down as fast as the
drum lifts them. The angle grows with the friction between grains and reaches a limit, because round grains roll; a
resistance against rolling raises it further. Grains without friction still do not flow like water, since they have to
climb over each other.

In a drum the mass centre of all grains is on the normal of their surface through the axis, however full the drum is, so
it gives the angle. The motor carries their weight at the arm of that mass centre.

Run it with ``python examples/rotating_drum.py out``: it prints angles, and writes a page with the animation.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

GRAIN, SIDES = 0.01, 24  # m: mean diameter of grains; of the drum
SIZES = GRAIN * np.linspace(0.8, 1.2, 5)  # m, diameters; grains of one size would form crystals
COLORS = ("#e5862b", "#d9a441", "#c9704a", "#b85c38", "#e0b878")
DENSITY, GRAVITY = 2500.0, 9.81
STEP = fb.Stepping(step=1e-3, solver="gauss-seidel")


def drum(radius: float) -> list[fb.Solid]:
    """A ring of flat pieces, with a rib on every third one so that the grains do not slide along it."""
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    side = 2 * (radius + GRAIN) * np.tan(np.pi / SIDES)
    return [
        fb.Box(
            edges=(thick, wide, 2 * GRAIN),
            position=(r * np.cos(a), r * np.sin(a), 0),
            orientation=(np.cos(a / 2), 0, 0, np.sin(a / 2)),
        )
        for k, a in enumerate(angle)
        for thick, wide, r in [(GRAIN, side, radius + GRAIN / 2), (GRAIN, GRAIN / 2, radius - GRAIN / 4)][
            : 1 + (k % 3 == 0)
        ]
    ]


def filling(radius: float) -> np.ndarray:
    """Places of loose grains in the lower half of the drum."""
    pitch = 1.22 * GRAIN
    n = int(radius / pitch)
    x = pitch * np.arange(-n, n + 1)
    places = np.stack(np.meshgrid(x, x[x < 0.2 * radius]), axis=-1).reshape(-1, 2)
    places = places[np.hypot(*places.T) < radius - 1.4 * GRAIN]
    return places + np.random.default_rng(1).uniform(-0.02, 0.02, places.shape) * GRAIN


def mechanism(friction: float = 0.4, rolling: float = 0.0, radius: float = 0.15, speed: float = 40.0) -> fb.Mechanism:
    """Grains in a drum that rests for 0.3 s and then turns by ``speed`` [deg/s]; ``rolling`` is in diameters."""
    m = fb.Mechanism("rotating drum", planar=True, gravity=(0, -GRAVITY), parameters={"speed": np.radians(speed)})
    m.add(fb.Body("drum", shape=drum(radius), density=DENSITY, color="#9aa6b3"))
    m.add(fb.Revolute("axle", "ground", "drum", at=(0, 0)), fb.Driver("motor", "axle.angle", "speed*max(t - 0.3, 0)"))
    start = filling(radius)
    size = np.random.default_rng(2).permutation(len(start)) % len(SIZES)
    for j, (d, color) in enumerate(zip(SIZES, COLORS, strict=True)):
        grain = fb.Sphere(radius=d / 2)
        m.add(fb.Bodies(f"grains {j}", shape=grain, density=DENSITY, position=start[size == j], color=color))
    m.add(fb.Contact(friction=friction, rolling_friction=rolling * GRAIN))
    return m


def mass_centre(run: fb.Result) -> tuple[np.ndarray, float]:
    """Mass centre of all grains, (times, 2) [m], and their mass [kg]."""
    mass = np.concatenate(
        [np.full(len(s.position), DENSITY * 4 / 3 * np.pi * s.shape.radius**3) for s in run.model.bulk]
    )
    places = np.concatenate([run[s.name].position[..., :2] for s in run.model.bulk], axis=1)
    return np.einsum("tnj,n->tj", places, mass) / mass.sum(), float(mass.sum())


def slope(run: fb.Result) -> np.ndarray:
    """Angle between the surface of the grains and the horizontal [deg], over time."""
    x, y = mass_centre(run)[0].T
    return np.degrees(np.arctan2(x, -y))


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    for friction, rolling in ((0, 0), (0.1, 0), (0.2, 0), (0.4, 0), (0.8, 0), (0.4, 0.1)):
        run = mechanism(friction, rolling).simulate(4.0, outputs=201, method=STEP)
        late = slope(run)[run.t > 2]
        print(f"friction {friction}, rolling {rolling} d: {late.mean():.1f} deg, {late.min():.1f} to {late.max():.1f}")
        if friction == 0.4:
            run.to_html(folder / f"rotating_drum_{rolling}.html")
