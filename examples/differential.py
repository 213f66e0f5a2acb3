"""A bevel-gear differential: two wheels turn at different speeds, and each gets half of the torque.

The side gears and pinions mesh by couplings of their angles, seen from the cage. They keep the mean of both wheels'
speeds at the speed of the cage. One wheel meets a quarter of the resistance of the other, as on ice, and turns four
times as fast in the end. The second pinion repeats what the first one says: one of the constraints is redundant.

Run it with ``python examples/differential.py out``: it prints the speeds at the end and their mean, and writes a page
with the animation into the folder.
"""

import math
import sys
from pathlib import Path

import flyball as fb

SIDE_TEETH, PINION_TEETH, MODULE = 24, 16, 0.005  # MODULE: pitch diameter per tooth [m]
SIDE, PINION = MODULE * SIDE_TEETH / 2, MODULE * PINION_TEETH / 2  # pitch radii [m]; all pitch cones meet at the origin
PARAMETERS = {
    "torque": "20 N*m",
    "resistance_left": "0.5 N*m*s",
    "resistance_right": "2 N*m*s",
    "wheel_inertia": "0.5 kg*m^2",
    "cage_inertia": "0.05 kg*m^2",
    "pinion_mass": 0.2,
    "pinion_inertia": "1e-4 kg*m^2",
}


def bevel(base: tuple[float, ...], turn: tuple[float, ...], radius: float, height: float) -> tuple[fb.Cone, fb.Box]:
    """Pitch cone of a bevel gear, its axis turned from z by two angles, and a bar on its back that shows it turning."""
    place = {"position": base, "orientation": (*turn, 0), "looks": True}
    return fb.Cone(radius=radius, height=height, **place), fb.Box(edges=(2 * radius, 0.01, 0.01), **place)


def add_wheel(m: fb.Mechanism, name: str, side: int) -> None:
    """Wheel, half shaft and side gear in one body that turns in the cage, and the resistance it meets."""
    base = (side * PINION, 0, 0)
    shaft = fb.Rod(start=base, end=(side * 0.3, 0, 0), radius=0.012, looks=True)
    wheel = fb.Rod(start=(side * 0.28, 0, 0), end=(side * 0.32, 0, 0), radius=0.12, looks=True)
    mark = fb.Box(edges=(0.05, 0.2, 0.02), position=(side * 0.3, 0, 0), looks=True)
    shape = (*bevel(base, (0, -side * math.pi / 2), SIDE, PINION), shaft, wheel, mark)
    inertia = {"mass": 10, "inertia": ("wheel_inertia", 0.4, 0.4)}
    m.add(fb.Body(name, position=(0, 0, 0), shape=shape, color="#2f6fb7", **inertia))
    m.add(fb.Revolute(f"{name} shaft", "cage", name, at=(0, 0, 0), axis=(1, 0, 0)))
    m.add(fb.Sensor(f"speed_{name}", f"{name}.omega_x"))
    m.add(fb.PointTorque(f"{name} resistance", name, torque=(f"-resistance_{name}*speed_{name}", 0, 0)))


def add_pinion(m: fb.Mechanism, k: int, side: int) -> None:
    """A pinion in the cage that meshes with both side gears: forwards with one, backwards with the other."""
    at, name = (0, side * SIDE, 0), f"pinion {k}"
    shape = bevel((0, 0, 0), (side * math.pi / 2, 0), PINION, SIDE)
    inertia = {"mass": "pinion_mass", "inertia": ("pinion_inertia",) * 3}
    m.add(fb.Body(name, position=at, shape=shape, color="#c08a3e", **inertia))
    m.add(fb.Revolute(f"pin {k}", "cage", name, at=at, axis=(0, side, 0)))
    for wheel, sense in (("left", 1), ("right", -1)):
        angles, weights = (f"{wheel} shaft.angle", f"pin {k}.angle"), (SIDE_TEETH, sense * PINION_TEETH)
        m.add(fb.Coupler(f"{wheel} mesh {k}", angles, weights=weights))


def mechanism(pinions: int = 2, **parameters: float) -> fb.Mechanism:
    """The differential with one or two pinions; keyword arguments are values of its parameters."""
    m = fb.Mechanism("differential", parameters={**PARAMETERS, **parameters})
    ring = fb.Tube(
        radius=0.1, inner_radius=0.075, length=0.02, position=(-0.08, 0, 0), looks=True, orientation=(0, math.pi / 2, 0)
    )
    arms = [fb.Box(edges=(0.11, 0.015, 0.03), position=(-0.03, y, 0), looks=True) for y in (-0.085, 0.085)]
    inertia = {"mass": 4, "inertia": ("cage_inertia", 0.03, 0.03)}
    m.add(fb.Body("cage", position=(0, 0, 0), shape=(ring, *arms), color="#5b6770", **inertia))
    m.add(fb.Revolute("cage bearing", "ground", "cage", at=(0, 0, 0), axis=(1, 0, 0)))
    add_wheel(m, "left", -1)
    add_wheel(m, "right", 1)
    for k, side in ((1, 1), (2, -1))[:pinions]:
        add_pinion(m, k, side)
    m.add(fb.Motor("engine", "cage bearing", torque="torque"))
    return m


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    run = mechanism().simulate(6, outputs=1201)
    left, right = run["speed_left"].value[-1], run["speed_right"].value[-1]
    cage = run["cage bearing.angle_rate"][-1]
    print(f"left {left:.4f}, right {right:.4f}, mean {(left + right) / 2:.4f}, cage {cage:.4f} rad/s")
    run.to_html(folder / "differential.html")
