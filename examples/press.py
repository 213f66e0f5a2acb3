"""A single-point eccentric press on elastic mounts in space: crank, connecting rod with a ball joint, ram.

The static sink is W / k, the six modes on the mounts follow from two quadratic equations, and the stroke from the
crank's angle. The press force acts between ram and frame: while the crank turns uniformly the ground does not feel it,
but the accelerations of the moving parts only.

Run it with ``python examples/press.py out``: it prints the sink, the frequencies on the mounts, and the range of the
force into the ground, and writes a page with the animation into the folder.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

SHAFT = 2.2  # m: height of the crank shaft above the mounts
MOUNTS = {f"mount {k}": (x, y, 0.0) for k, (x, y) in enumerate(((-0.5, -0.9), (0.5, -0.9), (-0.5, 0.9), (0.5, 0.9)), 1)}
PARAMETERS = {
    "speed": "120 rpm",
    "eccentricity": "50 mm",  # half the stroke
    "rod": "0.6 m",  # length of the connecting rod
    "press_force": "400 kN",
    "depth": "10 mm",  # way of the ram above its lowest position on which the press force acts
    "mount_stiffness": "1e6 N/m",  # of one mount, vertical
    "mount_shear": "4e5 N/m",  # the same, horizontal
    "mount_damping": "1e4 N*s/m",
}


def frame_shapes() -> tuple[fb.Box, ...]:
    """Bed, table, two columns and crown of the frame, from its mass centre 1 m above the mounts."""
    columns = (fb.Box(edges=(0.6, 0.3, 1.7), position=(0, y, 0.25), looks=True) for y in (-0.75, 0.75))
    bed = fb.Box(edges=(1.2, 2.0, 0.4), position=(0, 0, -0.8), looks=True)
    table = fb.Box(edges=(0.6, 0.9, 0.2), position=(0, 0, -0.5), looks=True)
    return bed, table, *columns, fb.Box(edges=(0.6, 1.8, 0.25), position=(0, 0, 1.2), looks=True)


def add_drive(m: fb.Mechanism) -> None:
    """Crank, connecting rod and ram, at the upper dead centre."""
    pin, wrist = (0, 0, f"{SHAFT} + eccentricity"), (0, 0, f"{SHAFT} + eccentricity - rod")
    middle = (0, 0, f"{SHAFT} + eccentricity - rod/2")
    flywheel = fb.Rod(start=(-0.51, 0, 0), end=(-0.39, 0, 0), radius=0.4, looks=True)
    shaft = fb.Rod(start=(-0.5, 0, 0), end=(0.5, 0, 0), radius=0.05, looks=True)
    eccentric = fb.Rod(start=(-0.15, 0, "eccentricity"), end=(0.15, 0, "eccentricity"), radius=0.13, looks=True)
    link = fb.Box(edges=(0.12, 0.14, "rod"), looks=True)
    slide = fb.Box(edges=(0.4, 0.5, 0.3), position=(0, 0, -0.1), looks=True)
    punch = fb.Cylinder(radius=0.12, length=0.3, position=(0, 0, -0.4), looks=True)
    crank = {"shape": (flywheel, shaft, eccentric), "color": "#a63d2f"}
    m.add(fb.Body("crank", mass=200, inertia=(10, 6, 6), position=(0, 0, SHAFT), **crank))
    m.add(fb.Body("connecting rod", mass=120, inertia=(5, 5, 0.5), position=middle, shape=link, color="#c08a3e"))
    m.add(fb.Body("ram", mass=300, inertia=(9, 9, 8), position=wrist, shape=(slide, punch), color="#2f6fb7"))
    m.add(fb.Revolute("main bearing", "frame", "crank", at=(0, 0, SHAFT), axis=(1, 0, 0)))
    m.add(fb.Universal("big end", "crank", "connecting rod", at=pin, axes=((1, 0, 0), (0, 1, 0))))
    m.add(fb.Spherical("ball", "connecting rod", "ram", at=wrist))
    m.add(fb.Prismatic("guide", "frame", "ram", at=wrist, axis=(0, 0, 1)))


def mechanism(**parameters: float) -> fb.Mechanism:
    """The press; keyword arguments are values of its parameters."""
    m = fb.Mechanism("eccentric press", gravity=(0, 0, -9.81), parameters={**PARAMETERS, **parameters})
    inertia = {"mass": 6000, "inertia": (5000, 3500, 2500)}
    m.add(fb.Body("frame", position=(0, 0, 1), shape=frame_shapes(), color="#5b6770", **inertia))
    add_drive(m)
    stiffness = ("mount_shear", "mount_shear", "mount_stiffness")
    for name, at in MOUNTS.items():
        m.add(fb.Bushing(name, "ground", "frame", at=at, stiffness=stiffness, damping="mount_damping"))
    m.add(fb.Driver("drive", "main bearing.angle", "speed*t"))
    height = "(2*eccentricity + value)"  # of the ram above its lowest position
    law = f"press_force*exp(-({height}/depth)**2)*(1 - tanh(rate/(0.05 m/s)))/2"
    m.add(fb.Actuator("workpiece", "guide.displacement", force=law))
    return m


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    m = mechanism()
    rest = m.equilibrium(parameters={"speed": 0.0})
    print(f"sink {1000 * (1 - rest['frame.z']):.2f} mm")
    print(m.modes(about=rest))
    run = m.simulate(10, outputs=np.linspace(6, 10, 801))  # from 6 s on the motion is periodic
    ground = sum(run[name].force[:, 2] for name in MOUNTS)
    print(f"force into the ground {ground.min() / 1000:.1f} to {ground.max() / 1000:.1f} kN")
    run.to_html(folder / "press.html")
