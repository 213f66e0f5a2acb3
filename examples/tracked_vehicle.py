"""A tracked vehicle in the plane: hull, four road wheels on torsion bars, idler, sprocket with teeth, 54 hinged shoes.

The upper run hangs between sprocket and idler in a discrete catenary: the horizontal tension is the same in all its
pins, and shape and length of the run give it back. The soil carries the weight. The sprocket drives by form: the speed
is pitch times teeth per turn.

Run it with ``python examples/tracked_vehicle.py out``: it prints tension, force of the soil and speeds, and writes a
page with the animation into the folder.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.optimize import fsolve

import flyball as fb

SHOES, PITCH, THICKNESS, SHOE = 54, 0.15, 0.03, 8.0  # number, m, m, kg
TEETH = 13
SPEED = 1.5  # m/s
G = 9.81
STEPS = fb.Stepping(step="4 ms", solver="gauss-seidel", tolerance=5e-3)


def running_gear(**options: float) -> fb.Mechanism:
    """The track with its wheels; what stands on ground in it will stand on the hull."""
    bar = {"stiffness": 2e4, "damping": 1200.0, "load": 2000.0}
    road = [
        fb.TrackWheel(f"road_{k}", at=(x, 0.25), mass=30, radius=0.22, arm=(x - 0.25, 0.37), **bar)
        for k, x in enumerate((0.75, 1.3, 1.85, 2.4))
    ]
    sprocket = fb.TrackWheel("sprocket", at=(3.15, 0.55), mass=60, teeth=TEETH)
    spring = {"stiffness": 2e5, "damping": 6e4, "load": 10e3}
    idler = fb.TrackWheel("idler", at=(0, 0.5), mass=40, radius=0.25, slide=(-1, 0), **spring)
    chain = {"shoes": SHOES, "pitch": PITCH, "thickness": THICKNESS, "mass": SHOE}
    return fb.track("track", [sprocket, idler, *road], **chain, **options)


def mechanism() -> fb.Mechanism:
    """The vehicle on level soil; its motor holds the sprocket at the speed asked, 0 in the first half second."""
    m = fb.Mechanism("tracked vehicle", planar=True, gravity=(0, -G), parameters={"speed": SPEED})
    m.add(fb.Ground("soil", shape=fb.Plane(normal=(0, 1))))
    box = fb.Box(edges=(3.0, 0.5, 1.0), looks=True)
    m.add(fb.Body("hull", mass=800, inertia=900, position=(1.6, 0.95), shape=box, color="#8a8f5b"))
    track = running_gear()
    lowest = min(b.position[1] for b in track.bodies) - THICKNESS / 2
    m.add(track, prefix="track", at=(0, 1e-3 - lowest), on="hull")
    m.add(fb.Contact("soil contact", between=[f"track.shoe_{k}" for k in range(SHOES)], others="soil", friction=0.8))
    rate = f"speed*2*pi/({PITCH}*{TEETH})*step(t, 0.5, 0, 1.5, 1)/(1 m)"
    m.add(fb.Motor("drive", "track.sprocket_axle", torque=f"-2e4*(rate + {rate})"))
    return m


def pins(run: fb.Result, prefix: str = "") -> tuple[np.ndarray, np.ndarray]:
    """Places (SHOES, times, 2) [m] and forces (SHOES, times, 2) [N] of the pins."""
    places, forces = [], []
    for k in range(SHOES):
        angle = run[f"{prefix}shoe_{k}.angle"]
        places.append(run[f"{prefix}shoe_{k}"].position - PITCH / 2 * np.stack((np.cos(angle), np.sin(angle)), axis=-1))
        forces.append(run[f"{prefix}pin_{k}"].force[..., :2])
    return np.array(places), np.array(forces)


def catenary(start: np.ndarray, end: np.ndarray, links: int) -> tuple[float, np.ndarray]:
    """Horizontal tension [N] and pins of rigid links that hang between two points, the left one first.

    Half the weight of a link is at each of its pins: link k has the slope (V + k w) / H. H and V follow from the ends.
    """
    k = np.arange(links)

    def steps(x: np.ndarray) -> np.ndarray:
        angle = np.arctan2(x[1] + (k + 0.5) * SHOE * G, x[0])
        return PITCH * np.stack((np.cos(angle), np.sin(angle)), axis=-1)

    span = np.hypot(*(end - start))
    first = SHOE * G * links * np.sqrt(span / 24 / (links * PITCH - span))  # a shallow parabola
    x = fsolve(lambda x: steps(x).sum(axis=0) - (end - start), (first, -links / 2 * SHOE * G), xtol=1e-12)
    return float(x[0]), start + np.vstack(([0, 0], np.cumsum(steps(x), axis=0)))


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    m = mechanism()
    run = m.simulate(4.0, outputs=201, method=STEPS)
    print(run.health)
    soil = sum(run.contacts.between("ground", f"track.shoe_{k}").force for k in range(SHOES))
    weight = G * sum(b.mass for b in m.bodies)
    rolled = -run["track.sprocket_axle.rate"] * PITCH * TEETH / (2 * np.pi)
    print(f"soil carries {soil[100:, 1].mean():.0f} N of {weight:.0f} N")
    print(f"speed {run['hull'].velocity[100:, 0].mean():.4f} m/s, of the sprocket {rolled[100:].mean():.4f} m/s")
    run.to_html(folder / "tracked_vehicle.html")
