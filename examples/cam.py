"""A cam and its follower: an eccentric circular cam turns steadily under a roller, a spring presses the follower down.

Closed form for the lift (any text on machine theory): y = -e cos(a) + sqrt((R + r)^2 - e^2 sin(a)^2). The spring is
stiff enough for the roller never to leave the cam: the contact force stays positive.

Run it with ``flyball run examples/cam.py --t-end "1 s"``.
"""

import math

import flyball as fb

R, r, e = 0.05, 0.015, 0.02  # cam, roller, eccentricity [m]


def mechanism(points: int = 360) -> fb.Mechanism:
    """The cam's profile is the spline through so many points of its circle."""
    m = fb.Mechanism("cam and follower", planar=True, gravity=(0, -9.81), parameters={"speed": "300 rpm"})
    turns = [2 * math.pi * k / points for k in range(points)]
    profile = [(R * math.cos(a), R * math.sin(a) - e) for a in turns]
    top = R - e + r  # the roller's centre, as drawn: at its lowest
    m.add(
        fb.Body(
            "cam",
            mass=0.6,
            inertia=0.6 * R**2 / 2,
            com=(0, -e),
            shape=(
                fb.Cylinder(radius=R, length=0.02, position=(0, -e, 0)),
                fb.Cylinder(radius=0.012, length=0.04),
            ),
            color="#c08a3e",
        ),
        fb.Body(
            "follower",
            mass=0.3,
            inertia=2e-4,
            position=(0, top),
            com=(0, 0.06),
            shape=(
                fb.Cylinder(radius=r, length=0.02),
                fb.Box(edges=(0.012, 0.12, 0.012), position=(0, 0.06, 0)),
                fb.Box(edges=(0.04, 0.006, 0.02), position=(0, 0.05, 0)),
            ),
            color="#5b6770",
        ),
        fb.Revolute("shaft", "ground", "cam", at=(0, 0)),
        fb.Translational("guide", "ground", "follower", at=(0, top), axis=(0, 1), displacement=top),
        fb.Cam("contact", "cam", "follower", points=profile, at=(0, top), radius=r),
        fb.SpringDamper(
            "spring",
            "ground",
            "follower",
            at=((0, top + 0.13), (0, top + 0.05)),
            stiffness="2 N/mm",
            length="100 mm",
        ),
        fb.Driver("motor", "shaft.angle", "speed*t"),
    )
    return m
