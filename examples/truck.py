"""A truck of 17 bodies on 4 tyres: over a ramp, through a lane change with a driver, on a rough road.

Frame, cab, engine, bed and seat on rubber mounts; two axle beams on springs and radius rods; front wheels on universal
joints, kingpin and spin; an engine with its map, a gear box and a differential; a driver who looks ahead, steers along
a path and holds the speed with both pedals. Run it with ``flyball run examples/truck.py --t-end 6 --out out``, or as it
is, for a table of figures.
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
SIDES = {"left": 1, "right": -1}
AXLES = {"front": 2.4, "rear": -2.0}  # places along the frame [m]
WHEELBASE = AXLES["front"] - AXLES["rear"]
FINAL, RATIOS = 4.0, (6.5, 3.9, 2.4, 1.5, 1.0)  # of the differential, of the gear box
ENGINE = {  # torques [N m] at speeds and throttles; closed, it brakes
    "speeds": (0, 600, 1000, 1400, 1800, 2200, 2600),
    "throttles": (0, 0.3, 0.6, 1),
    "torques": (
        (0, 40, 80, 120), (-40, 120, 280, 400), (-55, 200, 480, 780), (-70, 220, 520, 850), (-85, 190, 480, 800),
        (-100, 140, 400, 680), (-120, 40, 200, 380),
    ),
    "speed_unit": "rpm",
    "limit": "2600 rpm",
}  # fmt: skip


def ramp(spacing: float = 0.05) -> fb.RoadProfile:
    """A ramp up and down from x = 10 m to 18 m, rounded as the tyres would round it."""
    x = np.arange(-10.0, 60.0, spacing)
    up, down = (np.clip((x - at) / 3.0, 0.0, 1.0) for at in (10.0, 15.0))
    rise = [s**3 * (10.0 - 15.0 * s + 6.0 * s**2) for s in (up, down)]
    return fb.RoadProfile(heights=RAMP * (rise[0] - rise[1]), spacing=spacing, start=-10.0, width=20.0)


def truck(surface: fb.RoadProfile | fb.RandomRoad | None = None, speed: float = 8.0, lane: float = 0.0) -> fb.Mechanism:
    """The truck; ``lane``: how far to the left the driver changes near x = 60 m [m]. At rest nobody drives it."""
    m = fb.Mechanism("truck", gravity=(0, 0, -9.81), parameters={"v": speed})
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
    if speed:
        _driver(m, lane)
    for axle in AXLES:
        _axle(m, axle, body, mount, bool(speed))
    _driveline(m, body, speed)
    return m


def _driver(m: fb.Mechanism, lane: float) -> None:
    """Who holds the speed by throttle and brake, and steers along a path."""
    x = np.arange(-10.0, 300.0, 5.0)
    path = np.c_[x, lane * (0.5 + 0.5 * np.tanh((x - 60.0) / 20.0))]
    m.add(fb.SpeedDriver("pedals", setpoint="v", measured="frame.vx", kp=0.5, ki=0.1, initial=0.1))
    m.add(fb.Lag("pressure", of="pedals.brake", time=0.1))
    m.add(fb.PathDriver("steers", "frame", path=path, rear=(AXLES["rear"], 0, 0), wheelbase=WHEELBASE, start=8.0))


def _driveline(m: fb.Mechanism, body, speed: float) -> None:
    """Crankshaft and output shaft in the engine, gear box between them, differential to the rear wheels."""
    rate = FINAL * speed / (RADIUS - 0.01)  # of the output shaft [rad/s]
    gear = next((k for k, r in enumerate(RATIOS, 1) if r * rate < 220.0), len(RATIOS))
    shafts = (("crank", 60, 2.5, 2.3, RATIOS[gear - 1] * rate), ("output", 30, 0.2, 1.7, rate))
    disc = fb.Cylinder(radius=0.2, length=0.1, orientation=(0, "90 deg", 0))
    for name, mass, inertia, x, turns in shafts:
        body(name, mass, (inertia,) * 3, (x, 0, 1.0), angular_velocity=(turns, 0, 0), shape=disc)
        m.add(fb.Revolute(f"{name}_bearing", "engine", name, at=(x, 0, 1.0), axis=(1, 0, 0)))
    angles = ("crank_bearing.angle", "output_bearing.angle")
    if speed:
        m.add(fb.GearBox("box", *angles, ratios=RATIOS, capacity=1500, gear=gear, up="2200 rpm", down="1000 rpm"))
        m.add(fb.EngineMap("diesel", "crank_bearing", throttle="pedals.throttle", **ENGINE))
    spins = tuple(f"spin rear {side}.angle" for side in SIDES)
    m.add(fb.Coupler("differential", (angles[1], *spins), weights=(1, -FINAL / 2, -FINAL / 2)))


def _axle(m: fb.Mechanism, axle: str, body, mount, driven: bool) -> None:
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
        _wheel(m, axle, side, body, driven)


def _wheel(m: fb.Mechanism, axle: str, side: str, body, driven: bool) -> None:
    """A wheel with its tyre and brake: in front on kingpin and spin axis, which the driver turns, behind driven."""
    front = axle == "front"
    wheel, at = f"{axle} {side}", (AXLES[axle], 1.0 * SIDES[side], RADIUS - 0.03)
    turned = fb.Cylinder(radius=0.97 * RADIUS, length=0.3, orientation=("90 deg", 0, 0))
    body(wheel, 130 if front else 90, (8, 11, 8) if front else (6, 11, 6), at,
         angular_velocity=(0, f"v/{RADIUS - 0.01}", 0), shape=turned)  # fmt: skip
    if front:
        m.add(fb.Universal(f"hub {side}", "front axle", wheel, at=at, axes=((0, 0, 1), (0, 1, 0))))
        steering = {"stiffness": 2e5, "damping": 2e3, "force": "2e5*steers" if driven else None}
        m.add(fb.CoordinateSpring(f"steering {side}", f"hub {side}.angle_1", **steering))
        spin = f"hub {side}.angle_2"
    else:
        m.add(fb.Revolute(f"spin {wheel}", "rear axle", wheel, at=at, axis=(0, 1, 0)))
        spin = f"spin {wheel}.angle"
    if driven:
        m.add(fb.Actuator(f"brake {wheel}", spin, force="-9e3*pressure*tanh(rate/0.2)"))
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
