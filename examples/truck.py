"""A truck of 17 bodies on 4 tyres: over a ramp, through a lane change with a driver, on a rough road.

Frame, cab, engine, bed and seat on rubber mounts; two axle beams on springs and radius rods; steered front wheels; a
driver who looks ahead and steers towards a path, and holds the speed with the rear wheels. Run it with
``flyball run examples/truck.py --t-end 6 --out out``, or as it is, for a table of figures.
"""

from __future__ import annotations

import numpy as np

import flyball as fb

RADIUS, LOAD = 0.5, 30e3  # of a tyre [m], [N]
TYRE = fb.FialaTyre(
    radius=RADIUS, stiffness=8e5, damping=2e3, nominal_load=LOAD, slip_stiffness=2.4e5, cornering_stiffness=1.6e5,
    friction=0.8, relaxation_length=0.3, lateral_relaxation_length=0.5, trail=0.05, rolling_resistance=0.006,
)  # fmt: skip
RAMP = 0.2  # height [m]
AHEAD = 20.0  # distance at which the driver looks [m]
SIDES = {"left": 1, "right": -1}
AXLES = {"front": 2.4, "rear": -2.0}  # places along the frame [m]


def ramp(spacing: float = 0.05) -> fb.RoadProfile:
    """A ramp up and down from x = 10 m to 18 m, rounded as the tyres would round it."""
    x = np.arange(-10.0, 60.0, spacing)
    up, down = (np.clip((x - at) / 3.0, 0.0, 1.0) for at in (10.0, 15.0))
    rise = [s**3 * (10.0 - 15.0 * s + 6.0 * s**2) for s in (up, down)]
    return fb.RoadProfile(heights=RAMP * (rise[0] - rise[1]), spacing=spacing, start=-10.0, width=20.0)


def truck(surface: fb.RoadProfile | fb.RandomRoad | None = None, speed: float = 8.0, lane: float = 0.0) -> fb.Mechanism:
    """The truck; ``lane``: how far to the left the driver changes at x = 30 m [m]."""
    m = fb.Mechanism("truck", gravity=(0, 0, -9.81), parameters={"v": speed, "lane": lane})
    m.add(fb.Road("road", surface=surface))
    if isinstance(surface, fb.RoadProfile):  # to be seen
        x = surface.heights[::10]
        seen = fb.HeightField(
            heights=np.repeat([[z] for z in x], 2, axis=1), dx=10 * surface.spacing, dy=8.0,
            position=(surface.start, -4.0, 0.0), looks=True,
        )  # fmt: skip
        m.add(fb.Ground("asphalt", shape=seen))

    def body(name, mass, inertia, position, **more):
        m.add(fb.Body(name, mass=mass, inertia=inertia, position=position, velocity=("v", 0, 0), **more))

    def mount(a, b, at, stiffness, damping, **more):
        m.add(fb.Bushing(f"mount {len(m.forces)}", a, b, at=at, stiffness=stiffness, damping=damping, **more))

    body("frame", 2500, (800, 6000, 6000), (0, 0, 1.0), shape=fb.Box(edges=(6.4, 1.0, 0.25)))
    body("cab", 900, (500, 600, 500), (2.6, 0, 1.9), shape=fb.Box(edges=(1.6, 2.2, 1.6)))
    body("engine", 700, (60, 150, 150), (2.2, 0, 1.0), shape=fb.Box(edges=(1.2, 0.7, 0.7)))
    body("bed", 3000, (2000, 5000, 6000), (-1.2, 0, 1.6), shape=fb.Box(edges=(4.2, 2.3, 0.8)))
    body("seat", 90, (5, 5, 5), (2.4, 0.5, 2.0), shape=fb.Box(edges=(0.5, 0.5, 0.5)))
    for s in SIDES.values():
        for x in (3.2, 2.0):
            mount("frame", "cab", (x, 0.5 * s, 1.4), 2e5, 6e3)
        for x in (2.6, 1.8):
            mount("frame", "engine", (x, 0.3 * s, 0.9), 5e5, 3e3)
        for x in (-2.8, -1.2, 0.4):
            mount("frame", "bed", (x, 0.6 * s, 1.2), 2e6, 1e4)
        for x in (2.2, 2.6):
            mount("cab", "seat", (x, 0.5 + 0.2 * s, 1.8), 4e3, 2e2)
    m.add(fb.Frame("eyes", "frame", position=(AHEAD, 0, 0)))
    m.add(fb.Sensor("eyes_x", "eyes.x"), fb.Sensor("eyes_y", "eyes.y"), fb.Sensor("pace", "frame.vx"))
    for axle in AXLES:
        _axle(m, axle, body, mount)
    return m


def _axle(m: fb.Mechanism, axle: str, body, mount) -> None:
    """One axle beam with its springs, radius rods, wheels and tyres."""
    x, front = AXLES[axle], axle == "front"
    beam, height = f"{axle} axle", RADIUS - 0.03
    body(beam, 400, (150, 20, 150), (x, 0, height), shape=fb.Box(edges=(0.2, 1.6, 0.2)))
    for side, s in SIDES.items():
        spring = ((x, 0.5 * s, height), (x, 0.5 * s, 1.0))
        stiffness = 2.5e5 if front else 4e5
        m.add(fb.SpringDamper(f"spring {axle} {side}", beam, "frame", at=spring, stiffness=stiffness, damping=1.5e4,
                              length=0.59))  # fmt: skip
        brace = ((x, 0.45 * s, height), (x, 0.3 * s, 1.0))
        m.add(fb.SpringDamper(f"brace {axle} {side}", beam, "frame", at=brace, stiffness=2e4, damping=2e3))
        windup = {"torsional_stiffness": (0, 2e5, 0), "torsional_damping": (0, 2e3, 0)}  # of the leaves, in braking
        mount(beam, "frame", (x, 0.5 * s, height), (0, 1.2e6, 0), (0, 1e4, 0), **windup)
        reach, rod = -1.2 if front else 1.2, f"rod {axle} {side}"
        body(rod, 15, (0.1, 2, 2), (x + 0.5 * reach, 0.6 * s, height + 0.05), shape=fb.Box(edges=(1.2, 0.08, 0.08)))
        at = (x, 0.6 * s, height)
        m.add(fb.Universal(f"eye {axle} {side}", beam, rod, at=at, axes=((0, 1, 0), (0, 0, 1))))
        m.add(fb.Spherical(f"ball {axle} {side}", "frame", rod, at=(x + reach, 0.6 * s, height + 0.1)))
        _wheel(m, axle, side, body)


def _wheel(m: fb.Mechanism, axle: str, side: str, body) -> None:
    """A wheel with its tyre: in front on a knuckle that the driver turns, behind driven."""
    x, s, front = AXLES[axle], SIDES[side], axle == "front"
    wheel, carrier, height = f"{axle} {side}", f"{axle} axle", RADIUS - 0.03
    if front:
        carrier = f"knuckle {side}"
        at = (x, 0.95 * s, height)
        body(carrier, 40, (2, 2, 2), at)
        m.add(fb.Revolute(f"kingpin {side}", "front axle", carrier, at=at, axis=(0, 0, 1)))
        torque = "2e5*(0.3*tanh(0.05*(lane*(0.5 + 0.5*tanh((eyes_x - 45)/8)) - eyes_y)) - angle)"
        m.add(fb.TorsionalSpringDamper(f"steering {side}", f"kingpin {side}", damping=2e3, torque=torque))
    at = (x, 1.0 * s, height)
    turned = fb.Cylinder(radius=0.97 * RADIUS, length=0.3, orientation=("90 deg", 0, 0))
    body(wheel, 90, (6, 11, 6), at, angular_velocity=(0, f"v/{RADIUS - 0.01}", 0), shape=turned)
    m.add(fb.Revolute(f"spin {wheel}", carrier, wheel, at=at, axis=(0, 1, 0)))
    if not front:
        m.add(fb.Motor(f"drive {wheel}", f"spin {wheel}", torque="1e4*(v - pace)"))
    m.add(fb.Tyre(f"tyre {wheel}", "road", wheel, model=TYRE))


def mechanism() -> fb.Mechanism:
    """The truck before its ramp."""
    return truck(ramp())


if __name__ == "__main__":
    rest = truck(speed=0.0).equilibrium()
    loads = {f"{a} {s}": round(rest[f"tyre {a} {s}.load"]) for a in AXLES for s in SIDES}
    print("static wheel loads [N]", loads)
    run = mechanism().simulate(4.0)
    print("over the ramp: largest load", round(run["tyre rear left"].load.max()), "N")
    print(run.health)
