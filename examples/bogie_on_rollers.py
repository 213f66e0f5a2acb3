"""A railway bogie on a roller rig, or on track: two wheelsets in a frame, elastic contact, creep forces, flanges.

Each wheel stands on a roller that turns uniformly (or on a rail), with Hertz's normal force and Polach's creep force
(`WheelOnRail`). Above its critical speed the bogie hunts, in a limit cycle that the friction limit and the flanges
bound. On rollers the wavelength is shorter, and the critical speed lower, than on track.

A free wheelset of conicity c with the rolling radius r and contact points 2 e apart, on rail heads of the radius h that
are inclined as the cone is, follows a sine of the wavelength 2 pi sqrt(r e / (c (1 + h c / e))); on rollers of the
radius R it is 2 pi sqrt(r e / (c (1 + h c / e (1 + r / R)))): Klingel's, and its change.

Run it with ``python examples/bogie_on_rollers.py out``: it prints the critical speeds, and writes a page with the
motion above the critical speed into the folder.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

PARAMETERS = {
    "speed": "200 km/h",
    "conicity": 0.15,
    "wheel_radius": 0.46,
    "roller_radius": 0.6,
    "half_gauge": 0.75,  # half the distance of the contact points
    "head": 0.3,  # radius of the rail heads
    "friction": 0.35,
    "wheelset_mass": 1500.0,
    "box_mass": 100.0,
    "frame_mass": 3000.0,
    "car_weight": "120 kN",  # that the bogie carries
    "half_base": 1.25,  # half the distance of the axles
    "half_width": 1.0,  # half the distance of the springs across
    "primary_x": "3e6 N/m",  # of an axle box
    "primary_y": "4e6 N/m",
    "primary_z": "1.5e6 N/m",
    "secondary": "2e5 N/m",  # horizontal, of a side
    "secondary_damping": "1e4 N*s/m",
    "gust": "30 kN",  # force on the frame for a fifth of a second
}
TREAD = 0.034  # m: length of the cone towards the flange
FLANGE = 2.1  # slope of the flange
LOAD = "((frame_mass + 2*wheelset_mass + 2*box_mass)*9.81 + car_weight)/4"
BOXES = [fb.Box(edges=(0.35, 0.2, 0.3), position=(0, y, 0), looks=True) for y in (-1, 1)]
RAILS = [fb.Box(edges=(200, 0.07, 0.1), position=(90, y, -0.05), looks=True) for y in (-0.75, 0.75)]
BACK, FACE = -0.054, 0.065  # m: where the profile begins and ends


def wheel_profile(conicity: float) -> np.ndarray:
    """Points (y, z) of a cone with a flange, y outwards."""
    y = np.linspace(BACK, FACE, 120)
    s = np.clip((-TREAD - y) / 0.01, 0.0, 1.0)
    slope = conicity + (FLANGE - conicity) * s * s * (3 - 2 * s)
    z = np.r_[0.0, np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(y))]
    return np.column_stack([y, z - np.interp(0.0, y, z)])


def revolved(outline: np.ndarray, side: float, place: float = 0.0) -> fb.Mesh:
    """The solid of revolution about y of an outline (y, radius), around in order; mirrored for the right side."""
    n, turns = len(outline), 60
    angle = np.linspace(0, 2 * np.pi, turns, endpoint=False)
    y, r = outline.T
    around = np.broadcast_arrays(r * np.cos(angle)[:, None], side * y, r * np.sin(angle)[:, None])
    corners = np.stack(around, axis=-1).reshape(-1, 3)
    faces = []
    for k in range(turns):
        for j in range(n):
            a, b = k * n + j, k * n + (j + 1) % n
            c, d = (k + 1) % turns * n + j, (k + 1) % turns * n + (j + 1) % n
            faces += [(a, b, c), (b, d, c)] if side > 0 else [(a, c, b), (b, c, d)]
    return fb.Mesh(vertices=corners, faces=faces, position=(0, place, 0), looks=True)


def wheelset_shapes(radius: float, half_gauge: float, conicity: float) -> list[fb.Mesh | fb.Rod]:
    """An axle with two wheels of the profile, each with a mark that shows how it turns."""
    profile = wheel_profile(conicity)[::3]
    rim = np.column_stack([profile[:, 0], radius - profile[:, 1]])
    inside, hub = 0.86 * radius, 0.12
    web = [
        (FACE, inside),
        (0.03, 0.8 * radius),
        (0.04, 0.16),
        (0.06, hub),
        (-0.06, hub),
        (-0.01, 0.8 * radius),
        (BACK, inside),
    ]
    shapes: list[fb.Mesh | fb.Rod] = [fb.Rod(start=(0, -1.1, 0), end=(0, 1.1, 0), radius=0.08, looks=True)]
    for side in (1.0, -1.0):
        shapes.append(revolved(np.vstack([rim, web]), side, side * half_gauge))
        shapes.append(fb.Rod(start=(0, side * 0.76, 0.28), end=(0, side * 0.8, 0.28), radius=0.03, looks=True))
    return shapes


def roller(radius: float) -> list[fb.Mesh | fb.Rod]:
    """A roller with a rail's head, and a mark."""
    y = np.linspace(-0.036, 0.036, 9)
    head = np.column_stack([y, radius - y**2 / 0.6])
    inside = 0.88 * radius
    web = [
        (0.036, inside),
        (0.015, 0.84 * radius),
        (0.02, 0.16),
        (0.08, 0.1),
        (-0.08, 0.1),
        (-0.02, 0.16),
        (-0.015, 0.84 * radius),
        (-0.036, inside),
    ]
    axle = fb.Rod(start=(0, -0.25, 0), end=(0, 0.25, 0), radius=0.06, looks=True)
    mark = fb.Rod(start=(0, -0.03, 0.35), end=(0, 0.03, 0.35), radius=0.03, looks=True)
    return [revolved(np.vstack([head, web]), 1.0), axle, mark]


def frame_shapes(half_base: float) -> list[fb.Box]:
    """Two side beams and a cross beam, from the frame's centre of mass."""
    beams = [fb.Box(edges=(2 * half_base + 0.7, 0.16, 0.2), position=(0, y, 0), looks=True) for y in (-1, 1)]
    return [*beams, fb.Box(edges=(0.5, 1.9, 0.2), position=(0, 0, 0), looks=True)]


def add_wheelset(m: fb.Mechanism, k: int, x: str, shapes: list, rollers: bool) -> None:
    """Wheelset k at x: its axle box, springs to the frame, wheels on rollers or rails."""
    wheelset, box, ahead = f"wheelset {k}", f"box {k}", 0 if rollers else "speed"
    at = {"position": (x, 0, "wheel_radius"), "velocity": (ahead, 0, 0)}
    m.add(fb.Body(box, mass="box_mass", inertia=(20, 5, 20), shape=BOXES, color="#c08a3e", **at))
    spin = (0, "speed/wheel_radius", 0)
    solid = {"mass": "wheelset_mass", "inertia": (900, 100, 900), "shape": shapes, "color": "#8a8f94"}
    m.add(fb.Body(wheelset, angular_velocity=spin, **solid, **at))
    m.add(fb.Revolute(f"axle {k}", box, wheelset, at=at["position"], axis=(0, 1, 0)))
    stiffness = ("2*primary_x", "2*primary_y", "2*primary_z")
    turning = ("2*primary_z*half_width**2", "2e5", "2*primary_x*half_width**2")
    damping = {"damping": (0, 0, "4e4"), "torsional_damping": ("4e4*half_width**2", "2e3", 0)}
    springs = {"stiffness": stiffness, "torsional_stiffness": turning, **damping}
    m.add(fb.Bushing(f"primary {k}", "frame", box, at=at["position"], **springs))
    for name, side in (("left", 1), ("right", -1)):
        rail, own = "ground", f"{name} {k}"
        place = (x, f"{side}*half_gauge", 0)
        if rollers:
            rail = f"roller {own}"
            centre = (*place[:2], "-roller_radius")
            drawn = {"shape": roller(m.environment()["roller_radius"]), "color": "#5d6b78"}
            m.add(fb.Body(rail, mass=500, inertia=(50, 90, 50), position=centre, **drawn))
            m.add(fb.Revolute(f"{rail} axle", "ground", rail, at=centre, axis=(0, 1, 0)))
            m.add(fb.Driver(f"{rail} drive", f"{rail} axle.angle", "-speed/roller_radius*t"))
        profile = wheel_profile(m.environment()["conicity"])
        contact = {"wheel_profile": profile, "rail_arcs": [("head", 0.01), (0.08, 0.026), (0.013, 0.0355)]}
        contact |= {"inclination": "conicity", "friction": "friction", "dissipation": 0.3, "wheel_load": LOAD}
        contact |= {"roller_radius": "roller_radius"} if rollers else {}
        m.add(fb.WheelOnRail(own, rail, wheelset, at=place, axis=(0, side, 0), radius="wheel_radius", **contact))


def mechanism(rollers: bool = True, **parameters: float | str) -> fb.Mechanism:
    """The bogie; keyword arguments are values of its parameters."""
    m = fb.Mechanism("bogie on rollers", gravity=(0, 0, -9.81), parameters={**PARAMETERS, **parameters})
    n = m.environment()
    ahead, above = (0 if rollers else "speed", 0, 0), (0, 0, "wheel_radius + 0.3")
    frame = {"mass": "frame_mass", "inertia": (2000, 2500, 3500), "velocity": ahead}
    m.add(fb.Body("frame", position=above, shape=frame_shapes(n["half_base"]), color="#2f6fb7", **frame))
    car = "ground"
    if not rollers:
        car = "car"
        m.add(fb.Body(car, mass=1e4, inertia=(1e4, 1e5, 1e5), position=above, velocity=ahead))
        m.add(
            fb.Prismatic("line", "ground", car, at=above, axis=(1, 0, 0)),
            fb.Driver("run", "line.displacement", "speed*t"),
        )
        m.add(fb.Ground("track", shape=RAILS, color="#5d6b78"))
    side = {
        "stiffness": ("2*secondary", "2*secondary", 0),
        "damping": ("2*secondary_damping", "2*secondary_damping", 0),
    }
    yaw = {
        "torsional_stiffness": (0, 0, "2*secondary*half_width**2"),
        "torsional_damping": (0, 0, "2*secondary_damping*half_width**2"),
    }
    m.add(fb.Bushing("secondary", car, "frame", at=above, **side, **yaw))
    gust = "gust*(step5(t, 0.1, 0, 0.15, 1) - step5(t, 0.25, 0, 0.3, 1))"
    m.add(fb.PointForce("weight and wind", "frame", force=(0, gust, "-car_weight")))
    shapes = wheelset_shapes(n["wheel_radius"], n["half_gauge"], n["conicity"])
    for k, x in ((1, "half_base"), (2, "-half_base")):
        add_wheelset(m, k, x, shapes, rollers)
        m.add(fb.Sensor(f"lateral_{k}", f"wheelset {k}.y"))
    return m


def turning(rollers: bool = True) -> list[str]:
    """The coordinates that run uniformly in the steady motion."""
    rest = ["line.displacement", "frame.x", "box 1.x", "box 2.x"]
    if rollers:
        rest = [f"roller {side} {k} axle.angle" for side in ("left", "right") for k in (1, 2)]
    return [*rest, "axle 1.angle", "axle 2.angle"]


def growth(rollers: bool, speed: float) -> float:
    """Greatest real part of the eigenvalues [1/s] of the bogie that runs straight on."""
    m = mechanism(rollers, speed=speed)
    return float(m.linearize(about=m.equilibrium(turning=turning(rollers))).eigenvalues.real.max())


def critical_speed(rollers: bool) -> float:
    """Speed [m/s] at which hunting begins to grow, by bisection."""
    low, high = 45.0, 60.0
    while high - low > 0.05:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if growth(rollers, middle) > 1e-6 else (middle, high)
    return low


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    for rollers, where in ((False, "on track"), (True, "on rollers")):
        print(f"critical speed {where}: {3.6 * critical_speed(rollers):.1f} km/h")
    run = mechanism().simulate(3, outputs=901, rtol=1e-5)
    print(run.health)
    last = run["wheelset 1.y"][-300:]
    print(f"limit cycle at {PARAMETERS['speed']}: {1e3 * abs(last).max():.1f} mm")
    run.to_html(folder / "bogie_on_rollers.html")
