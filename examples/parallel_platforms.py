"""A hexapod and a multi-axis test facility: the same legs, six or eight, each a cylinder and a piston under a platform.

A leg has a universal joint on the ground, a prismatic one, and a spherical one on the platform. Six legs of the hexapod
(13 bodies) leave the platform six freedoms, and the forces in their cylinders follow from the six equations of
equilibrium. With the eight legs of the test facility (17 bodies) the platform has six freedoms too: six equations for
eight forces. Drivers of the platform's pose prescribe its motion; the lengths of the cylinders follow from it.

Run it with ``python examples/parallel_platforms.py facility out``: it prints the freedoms and the lengths that the
cylinders need, and writes a page with the animation into the folder.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

HEIGHT = 1.2  # m: of the platform as drawn
CYLINDER, PISTON = 20.0, 8.0  # kg
MOTION = {"x": "0.06*sin(6*t)", "y": "0.04*sin(9*t)", "z": f"{HEIGHT} + 0.05*sin(12*t)"}
TURNS = {"roll": "0.06*sin(8*t)", "pitch": "0.05*sin(10*t)", "yaw": "0.04*sin(7*t)"}


def circle(radius: float, degrees: tuple[float, ...], height: float) -> np.ndarray:
    """Points on a level circle."""
    turns = np.radians(degrees)
    return np.column_stack([radius * np.cos(turns), radius * np.sin(turns), height + 0 * turns])


HEXAPOD = np.stack([circle(0.9, (-12, 12, 108, 132, 228, 252), 0), circle(0.5, (-48, 48, 72, 168, 192, 288), 1.1)], 1)
FACILITY = np.array(
    [((1.4 * x, 1.4 * y, 0), (0.7 * x, 0.7 * y, 1.1)) for x in (-1, 1) for y in (-1, 1)]  # four that carry
    + [((2.5, y, 1.2), (0.8, y, 1.2)) for y in (-0.6, 0.6)]  # two pairs that push from the side
    + [((x, 2.5, 1.2), (x, 0.8, 1.2)) for x in (-0.6, 0.6)]
)
"""Ends of the legs (legs, 2, 3), on ground and on the platform."""


def leg(m: fb.Mechanism, k: int, foot: np.ndarray, top: np.ndarray) -> None:
    """Cylinder and piston of leg k with their three joints; mass centres at a quarter and three quarters of it."""
    length = float(np.linalg.norm(top - foot))
    d = (top - foot) / length
    first = np.cross((0, 0, 1), d) / np.linalg.norm(np.cross((0, 0, 1), d))
    second = np.cross(d, first)
    axes = np.column_stack([first, second, d])
    for name, mass, side, radius, color in (
        ("cylinder", CYLINDER, -1, 0.045, "#5b6770"),
        ("piston", PISTON, 1, 0.024, "#c08a3e"),
    ):
        inertia = mass * axes @ np.diag([0.05, 0.05, 0.002]) @ axes.T
        near, far = side * length / 4 * d, -side * 0.3 * length * d
        shape = fb.Rod(start=near, end=far, radius=radius, looks=True)
        middle = (foot + top) / 2 + near
        m.add(fb.Body(f"{name} {k}", mass=mass, inertia=inertia, position=middle, shape=shape, color=color))
    m.add(fb.Universal(f"foot {k}", "ground", f"cylinder {k}", at=foot, axes=(first, second)))
    m.add(fb.Prismatic(f"slide {k}", f"cylinder {k}", f"piston {k}", at=(foot + top) / 2, axis=d))
    m.add(fb.Spherical(f"ball {k}", f"piston {k}", "platform", at=top))


def platform(name: str, legs: np.ndarray) -> fb.Mechanism:
    """A platform on legs without drives: six freedoms."""
    m = fb.Mechanism(name, gravity=(0, 0, -9.81))
    reach = 2 * np.abs(legs[:, 1, :2]).max(axis=0) + 0.1
    table = fb.Box(edges=(*reach, 0.12), looks=True)
    m.add(fb.Body("platform", mass=500, inertia=(60, 70, 110), position=(0, 0, HEIGHT), shape=table, color="#3b6ea5"))
    for k, (foot, top) in enumerate(legs, start=1):
        leg(m, k, foot, top)
    return m


def hexapod(length: str = "0.05*sin(6*t)") -> fb.Mechanism:
    """Six legs, all of which become longer than drawn by ``length`` [m], an expression of t."""
    m = platform("hexapod", HEXAPOD)
    m.add(*(fb.Driver(f"drive {k}", f"slide {k}.displacement", length) for k in range(1, 7)))
    return m


def mechanism(motion: dict[str, str] | None = None) -> fb.Mechanism:
    """The test facility, its platform moved by laws of its position and angles."""
    m = platform("test facility", FACILITY)
    motion = {**MOTION, **TURNS} if motion is None else motion
    m.add(*(fb.Driver(f"drive {k}", f"platform.{k}", law) for k, law in motion.items()))
    return m


if __name__ == "__main__":
    which = sys.argv[1] if len(sys.argv) > 1 else "facility"
    folder = Path(sys.argv[2] if len(sys.argv) > 2 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    legs = HEXAPOD if which == "hexapod" else FACILITY
    print(platform(which, legs).mobility())
    run = (hexapod() if which == "hexapod" else mechanism()).simulate(4, outputs=801)
    for k in range(1, len(legs) + 1):
        stroke = run[f"slide {k}.displacement"]
        print(f"cylinder {k}: {1000 * stroke.min():.1f} to {1000 * stroke.max():.1f} mm")
    run.to_html(folder / f"{which}.html")
