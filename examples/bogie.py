"""A railway bogie hunts: lateral motion of a frame and two wheelsets on conical wheels, seen from above.

Wheels creep: by J. J. Kalker's linear theory the force on a wheelset is proportional to its lateral creepage, and the
torque to the difference of the longitudinal creepages of its wheels, which a lateral displacement causes on a cone
(A. H. Wickens, *Fundamentals of Rail Vehicle Dynamics*, 2003, chapter 2; spin creepage and gravitational stiffness are
neglected). Both are expressions of sensors. The bogie is described in axes that move along the track at ``speed``.

A wheelset follows a sine of Klingel's wavelength, 2 pi sqrt(wheel_radius half_gauge / conicity). Beyond the critical
speed the motion grows.

Run it with ``python examples/bogie.py out``: it prints the critical speed, and writes the motion below it, the modes at
it and the root locus over speed into the folder.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

PARAMETERS = {
    "speed": "250 km/h",
    "conicity": 0.1,
    "wheel_radius": 0.46,
    "half_gauge": 0.75,  # half the distance of the contact points
    "longitudinal_creep": "6e6 N",  # Kalker's coefficients f11 and f22 of a wheel: force by creepage
    "lateral_creep": "6e6 N",
    "wheelset_mass": 1500.0,
    "wheelset_inertia": 900.0,
    "frame_mass": 3000.0,
    "frame_inertia": 3500.0,
    "half_base": 1.25,  # half the distance of the axles
    "half_width": 1.0,  # half the distance of the springs across
    "primary_x": "4e6 N/m",  # stiffness of an axle box
    "primary_y": "5e6 N/m",
    "secondary": "3e5 N/m",  # to the car body, which moves straight on
    "secondary_damping": "2e4 N*s/m",
    "gust": "40 kN",  # force on the frame for half a second
}
RAILS = tuple(fb.Box(edges=(6, 0.07, 0.02), position=(0, y, -0.4), looks=True) for y in (-0.75, 0.75))


def wheelset() -> tuple[fb.Box, ...]:
    """Shapes of an axle and its two wheels."""
    wheels = (fb.Box(edges=(0.92, 0.13, 0.4), position=(0, y, 0), looks=True) for y in (-0.75, 0.75))
    return fb.Box(edges=(0.16, 2.2, 0.16), looks=True), *wheels


def creep(k: int) -> tuple[fb.PointForce, fb.PointTorque]:
    """Creep force and torque of both wheels on wheelset k."""
    force = f"-2*lateral_creep*(rate_{k}/speed - yaw_{k})"
    cone = f"half_gauge*conicity*lateral_{k}/wheel_radius"
    torque = f"-2*longitudinal_creep*({cone} + half_gauge**2*yaw_rate_{k}/speed)"
    return (
        fb.PointForce(f"creep force {k}", f"wheelset {k}", force=("0", force)),
        fb.PointTorque(f"creep torque {k}", f"wheelset {k}", torque=torque),
    )


def mechanism(**parameters: float) -> fb.Mechanism:
    """The bogie; keyword arguments are values of its parameters."""
    m = fb.Mechanism("bogie", planar=True, parameters={**PARAMETERS, **parameters})
    beams = [fb.Box(edges=(3.2, 0.2, 0.25), position=(0, y, 0.3), looks=True) for y in (-1, 1)]
    beams.append(fb.Box(edges=(0.5, 1.8, 0.25), position=(0, 0, 0.3), looks=True))
    m.add(fb.Ground("track", shape=RAILS, color="#8a8f94"))
    inertia = {"mass": "wheelset_mass", "inertia": "wheelset_inertia"}
    places = {"wheelset 1": "half_base", "wheelset 2": "-half_base"}
    for name, x in places.items():
        m.add(fb.Body(name, position=(x, 0), shape=wheelset(), color="#a63d2f", **inertia))
    m.add(fb.Body("frame", mass="frame_mass", inertia="frame_inertia", shape=beams, color="#2f6fb7"))
    m.add(fb.PointOnLine("frame guide", "ground", "frame", at=(0, 0), axis=(0, 1)))
    spring = {"stiffness": "2*secondary", "damping": "2*secondary_damping"}
    turning = {"stiffness": "2*secondary*half_width**2", "damping": "2*secondary_damping*half_width**2"}
    m.add(fb.CoordinateSpring("secondary springs, lateral", "frame.y", **spring))
    m.add(fb.CoordinateSpring("secondary springs, yaw", "frame.angle", **turning))
    for k, (name, x) in enumerate(places.items(), start=1):
        m.add(fb.PointOnLine(f"guide {k}", "ground", name, at=(x, 0), axis=(0, 1)))
        lateral = {"weights": [1, -1, f"-({x})"], "stiffness": "2*primary_y"}
        turn = {"weights": [1, -1], "stiffness": "2*primary_x*half_width**2"}
        m.add(fb.CoordinateSpring(f"axle boxes {k}, lateral", [f"{name}.y", "frame.y", "frame.angle"], **lateral))
        m.add(fb.CoordinateSpring(f"axle boxes {k}, yaw", [f"{name}.angle", "frame.angle"], **turn))
        measured = {"lateral": "y", "rate": "vy", "yaw": "angle", "yaw_rate": "omega"}
        m.add(*(fb.Sensor(f"{sensor}_{k}", f"{name}.{of}") for sensor, of in measured.items()))
        m.add(*creep(k))
    gust = "gust*(step5(t, 0.1, 0, 0.2, 1) - step5(t, 0.6, 0, 0.7, 1))"
    m.add(fb.PointForce("side wind", "frame", force=("0", gust)))
    return m


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    m = mechanism()
    m.simulate(3, outputs=601).to_html(folder / "bogie.html")
    locus = m.root_locus("speed", np.linspace(20, 120, 41))
    locus.plot(folder / "bogie_over_speed.png")
    critical = locus.crossings[0].value
    print(f"critical speed {3.6 * critical:.1f} km/h")
    m.modes(parameters={"speed": critical}).to_html(folder / "bogie_modes.html")
