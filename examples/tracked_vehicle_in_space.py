"""A tracked vehicle in space: hull, 14 road wheels on torsion bars, two tracks of 80 shoes; it steers by skidding.

The sprockets are held at speeds of their own. With equal speeds the vehicle moves straight on. With opposite ones it
turns on the spot. With different ones it turns on a circle, wider than the speeds alone would make it: both tracks
slip. `quasi_static` is a model of this for comparison.

Run it with ``python examples/tracked_vehicle_in_space.py out``: it prints speed, yaw rate and radius of a turn, and
writes a page with the animation into the folder.
"""

import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import fsolve

import flyball as fb

SHOES, PITCH, THICKNESS, SHOE, WIDTH = 80, 0.15, 0.03, 8.0, 0.38  # number, m, m, kg, m
TEETH = 13
GAUGE = 2.0  # m, between the middles of the tracks
FRICTION, G = 0.8, 9.81
HULL, HEIGHT = 3000.0, 1.0  # kg, m
STEPS = fb.Stepping(step="4 ms", solver="gauss-seidel", tolerance=5e-3)


def running_gear(**options: float) -> fb.Mechanism:
    """One track with its wheels, seven of them on torsion bars."""
    bar = {"stiffness": 2e4, "damping": 1200.0, "load": 3600.0}
    road = [
        fb.TrackWheel(f"road_{k}", at=(x, 0.25), mass=30, radius=0.22, arm=(x - 0.25, 0.37), **bar)
        for k, x in enumerate(np.linspace(0.75, 4.2, 7))
    ]
    sprocket = fb.TrackWheel("sprocket", at=(5.0, 0.55), mass=60, teeth=TEETH)
    spring = {"stiffness": 2e5, "damping": 6e4, "load": 8e3}
    idler = fb.TrackWheel("idler", at=(0, 0.5), mass=40, radius=0.25, slide=(-1, 0), **spring)
    chain = {"shoes": SHOES, "pitch": PITCH, "thickness": THICKNESS, "mass": SHOE, "width": WIDTH}
    rollers = [fb.TrackWheel(f"roller_{k}", at=(1.7 * (k + 1), 0.7 + 0.04 * k), mass=10, radius=0.1) for k in range(2)]
    return fb.track("track", [sprocket, idler, *road, *rollers], spatial=True, **chain, **options)


def mechanism(left: float = 1.0, right: float = 1.0) -> fb.Mechanism:
    """The vehicle on level soil; motors hold the sprockets at the speeds ``left`` and ``right`` of their tracks [m/s].

    They are 0 in the first 0.2 s and rise within 0.4 s.
    """
    m = fb.Mechanism("tracked vehicle", gravity=(0, 0, -G), parameters={"left": left, "right": right})
    m.add(fb.Ground("soil", shape=fb.Plane(normal=(0, 0, 1))))
    box = fb.Box(edges=(4.6, 1.3, 0.5), looks=True)
    m.add(
        fb.Body("hull", mass=HULL, inertia=(900, 5500, 6000), position=(2.475, 0, HEIGHT), shape=box, color="#8a8f5b")
    )
    track = running_gear()
    lowest = min(b.position[2] for b in track.bodies) - (0.5 + 0.3) * THICKNESS
    for side, y in (("left", GAUGE / 2), ("right", -GAUGE / 2)):
        m.add(track, prefix=side, at=(0, y, 1e-3 - lowest), on="hull")
        rate = f"{side}*2*pi/({PITCH}*{TEETH})*step(t, 0.2, 0, 0.6, 1)/(1 m)"
        m.add(fb.Motor(f"{side}_drive", f"{side}.sprocket_axle", torque=f"-2e5*(rate + {rate})"))
    plates = [f"{side}.shoe_{k}" for side in ("left", "right") for k in range(SHOES)]
    m.add(fb.Contact("soil contact", between=plates, others="soil", friction=FRICTION))
    return m


def quasi_static(
    left: float, right: float, m: fb.Mechanism, ends: tuple[str, str] = ("road_0", "road_6"), gauge: float = GAUGE
) -> np.ndarray:
    """Forward and leftward velocity of the centre of mass [m/s] and yaw rate [rad/s] of a steady turn.

    Shoes press evenly on the ground between the outer road wheels, more on the outer track, and slide on it with
    Coulomb friction against their velocity (Steeds 1950). Their forces are the mass times the centripetal acceleration.
    """
    mass = sum(b.mass for b in m.bodies)
    centre = sum(b.mass * np.array(b.position, float) for b in m.bodies) / mass
    rear, front = (m[f"left.{name}"].position[0] - centre[0] for name in ends)
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(rear, front, 401), (gauge / 2, -gauge / 2)))
    track = np.where(y > 0, left, right)

    def residual(u: np.ndarray) -> np.ndarray:
        outwards = np.sign(y) * u[0] * u[2] * centre[2] / gauge / G
        force = FRICTION * mass * G * (0.5 - outwards) / 401
        slip = np.stack((u[0] - u[2] * y - track, u[1] + u[2] * x))
        fx, fy = -force * slip / np.hypot(*slip)
        inertia = mass * u[2] * u[0], mass * u[2] * u[1]
        return np.array([(fx.sum() + inertia[1]), (fy.sum() - inertia[0]), (x * fy - y * fx).sum()]) / (mass * G)

    start = ((left + right) / 2, 1e-3, 0.5 * (right - left) / gauge)
    return fsolve(residual, start, xtol=1e-10)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    left, right = 0.6, 1.2
    m = mechanism(left, right)
    start = time.process_time()
    run = m.simulate(4.0, outputs=101, method=STEPS)
    print(run.health)
    print(f"{4.0 / (time.process_time() - start):.3f} times real time on one core")
    late = run.t > 2.0
    yaw = run["hull"].angular_velocity[late, 2].mean()
    speed = np.hypot(*run["hull"].velocity[late, :2].T).mean()
    rolled = [-run[f"{s}.sprocket_axle.rate"][late].mean() * PITCH * TEETH / (2 * np.pi) for s in ("left", "right")]
    expected = quasi_static(*rolled, m)
    print(f"yaw rate {yaw:.4f} rad/s, quasi-static {expected[2]:.4f}; without slip {(right - left) / GAUGE:.4f}")
    print(f"radius {speed / yaw:.2f} m, quasi-static {np.hypot(*expected[:2]) / expected[2]:.2f} m")
    run.to_html(folder / "tracked_vehicle_in_space.html")
