import sys
import numpy as np
import flyball as fb

PITCH, TEETH = 0.15, 13


def gear():
    road = [
        fb.TrackWheel(f"road_{k}", at=(0.75 + 0.55 * k, 0.25), mass=30, radius=0.22, arm=(0.5 + 0.55 * k, 0.37), stiffness=2e4, damping=1200, load=2000)
        for k in range(4)
    ]
    return fb.track(
        "track",
        [
            fb.TrackWheel("sprocket", at=(3.15, 0.55), mass=60, teeth=TEETH),
            fb.TrackWheel("idler", at=(0, 0.5), mass=40, radius=0.25, slide=(-1, 0), stiffness=4e5, damping=4e3, load=10e3),
            *road,
        ],
        shoes=int(sys.argv[1]) if len(sys.argv) > 1 else 54, pitch=PITCH, thickness=0.03, mass=8,
    )
def vehicle():
    m = fb.Mechanism("tracked vehicle", planar=True, gravity=(0, -9.81))
    m.add(fb.Ground("soil", shape=fb.Plane(normal=(0, 1))))
    m.add(fb.Body("hull", mass=800, inertia=900, position=(1.6, 0.9), shape=fb.Box(edges=(3, .5, 1), looks=True)))
    t = gear()
    low = min(b.position[1] for b in t.bodies if b.name.startswith("shoe"))
    m.add(t, prefix="track", at=(0, .016 - low), on="hull")
    m.add(fb.Contact("soil contact", between=[f"track.shoe_{k}" for k in range(sum(b.name.startswith("shoe") for b in t.bodies))], others="soil", friction=0.8))
    m.add(fb.Motor("drive", "track.sprocket_axle", torque="-800*step(t,1,0,1.5,1)"))
    return m
