"""A delta robot picks and places: the torques that its three motors need, by inverse dynamics.

Drivers prescribe the path of the platform. `kinematics` finds the angles of the arms along it (inverse kinematics), and
`inverse_dynamics` the torques of the motors and the reactions of all joints for these angles. The parallelograms are
pairs of rods with universal and ball joints, because of which the platform does not turn.

Run it with ``python examples/delta_robot.py out``: it prints the ranges of the torques, and writes a page with the
animation into the folder.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

BASE, PLATE, ARM, ROD, APART = 0.2, 0.06, 0.3, 0.7, 0.05  # m: radii of hinges, lengths, half the width of a pair
MOTORS = tuple(f"motor_{k}" for k in (1, 2, 3))
HEIGHT = -0.62  # m: of the platform as drawn


def elbow(outward: np.ndarray) -> np.ndarray:
    """Place of an elbow as drawn: on the circle about the hinge, at the length of the rods from the platform."""
    dx, dz = PLATE - BASE, HEIGHT  # from the arm's hinge to that of the platform, in the plane of the arm
    far = np.hypot(dx, dz)
    a = np.arctan2(dz, dx) + np.arccos((far**2 + ARM**2 - ROD**2) / (2 * far * ARM))
    return outward * (BASE + ARM * np.cos(a)) + np.array([0, 0, ARM * np.sin(a)])


def arm(m: fb.Mechanism, k: int) -> None:
    """Motor, arm and two rods number k."""
    turn = 2 * np.pi * k / 3
    outward, along, up = (
        np.array([np.cos(turn), np.sin(turn), 0]),
        np.array([-np.sin(turn), np.cos(turn), 0]),
        (0, 0, 1),
    )
    hinge, bend = BASE * outward, elbow(outward)
    plate = PLATE * outward + np.multiply(HEIGHT, up)
    name = f"{k + 1}"
    shape = fb.Rod(start=hinge - bend, end=(0, 0, 0), radius=0.016)
    cross = fb.Rod(start=-APART * along, end=APART * along, radius=0.01, looks=True)
    m.add(fb.Body(f"arm_{name}", mass=0.6, position=bend, shape=(shape, cross), color="#2f6fb7"))
    m.add(fb.Revolute(MOTORS[k], "ground", f"arm_{name}", at=hinge, axis=along))
    for side, letter in ((-1, "a"), (1, "b")):
        top, end = bend + side * APART * along, plate + side * APART * along
        rod = fb.Rod(start=top - end, end=(0, 0, 0), radius=0.006)
        m.add(fb.Body(f"rod_{name}{letter}", mass=0.1, position=end, shape=rod, color="#c8ccd2"))
        m.add(fb.Universal(f"top_{name}{letter}", f"arm_{name}", f"rod_{name}{letter}", at=top, axes=(along, outward)))
        m.add(fb.Spherical(f"end_{name}{letter}", f"rod_{name}{letter}", "platform", at=end))


def mechanism() -> fb.Mechanism:
    """The robot, its platform driven along a path: up, across and down, and back."""
    m = fb.Mechanism("delta robot", gravity=(0, 0, -9.81), parameters={"load": 0.5, "stroke": 0.25, "lift": 0.1})
    disk = fb.Cylinder(radius=0.07, length=0.012, mass=0.3)
    load = fb.Sphere(radius=0.03, mass="load", position=(0, 0, -0.03))
    m.add(fb.Body("platform", position=(0, 0, HEIGHT), shape=(disk, load), color="#e5862b"))
    for k in range(3):
        arm(m, k)
    across = "stroke*(step5(t, 0.1, -0.5, 0.5, 0.5) - step5(t, 0.7, 0, 1.1, 1))"
    up = "lift*(1 - (2*step5(t, 0.1, 0, 0.5, 1) - 1)**2 + 1 - (2*step5(t, 0.7, 0, 1.1, 1) - 1)**2)"
    for axis, law in (("x", across), ("y", "0"), ("z", f"{HEIGHT} - 0.05 + {up}")):
        m.add(fb.Driver(f"platform_{axis}", f"platform.{axis}", law))
    return m


def torques(m: fb.Mechanism, times: np.ndarray) -> fb.InverseDynamics:
    """Torques of the motors that move the platform of ``m`` as its drivers say."""
    along = m.kinematics(times)
    free = m.changed({d.name: None for d in m.drivers})
    return free.inverse_dynamics(times, {f"{name}.angle": along[f"{name}.angle"] for name in MOTORS})


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    m = mechanism()
    for name, drive in torques(m, np.linspace(0, 1.2, 241)).drives.items():
        print(f"{name}: {drive.effort.min():.3f} to {drive.effort.max():.3f} N m")
    m.simulate(1.2, outputs=241).to_html(folder / "delta_robot.html")
