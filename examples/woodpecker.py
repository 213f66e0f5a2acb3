"""The woodpecker toy: a bird on a spring and a sleeve with play rattle down a pole, stick, slip and peck.

Data, idealisation and limit cycle: Ch. Glocker, Dynamik von Starrkoerpersystemen mit Reibung und Stoessen (1995); R. I.
Leine, Ch. Glocker and D. H. van Campen, Nonlinear dynamics of the woodpecker toy (2001). The middle of the sleeve stays
on the axis of the pole. Its lower and upper edge on the bird's side and the beak touch the pole, with friction; only
the beak bounces. The published equations are linear in the angles; here the geometry is exact. All play, all speeds and
gravity are multiplied by ``size``: where it is small, so are the angles, and both models are the same. The cycle of the
linear equations takes 0.146 s and 19 mm of the pole, that of the exact geometry 0.194 s and 56 mm.

Run it with ``python examples/woodpecker.py out``: it prints the events, and writes a page with the animation.
"""

import sys
from pathlib import Path

import flyball as fb

POLE, SLEEVE, HALF = 0.0025, 0.0031, 0.0058  # m: radius of the pole, inner radius and half height of the sleeve
HINGE, BIRD = 0.010, 0.025  # m: of the spring and of the bird's mass centre, from the axis of the pole
BEAK = (-0.0201, 0.020)  # m, from the bird's mass centre
START = {"sleeve.angle": (-0.10, 0.0), "spring.angle": (-0.18, -7.4), "sleeve.y": (0.0, -0.34)}  # values and rates


def mechanism(size: float = 1.0) -> fb.Mechanism:
    """The toy just before the lower edge of the sleeve hits the pole."""
    m = fb.Mechanism("woodpecker toy", planar=True, gravity=(0, -9.81 * size))
    side = SLEEVE - size * (SLEEVE - POLE)  # of the pole: its radius, if size is 1
    bark = BIRD + BEAK[0] - size * (BIRD + BEAK[0] - POLE)
    long = fb.Box(edges=(2 * POLE, 0.3, 2 * POLE), position=(0, -0.1, 0), looks=True)
    m.add(fb.Ground("pole", shape=[fb.Plane(position=(side, 0, 0), normal=(1, 0, 0)), long], color="#c9b48a"))
    m.add(fb.Ground("bark", shape=fb.Plane(position=(bark, 0, 0), normal=(1, 0, 0)), color="#c9b48a"))
    wall = {"edges": (0.001, 2 * HALF, 0.006), "looks": True}
    tube = [fb.Box(position=(x * (SLEEVE + 0.0005), 0, 0), contact=x > 0, **wall) for x in (1, -1)]
    m.add(fb.Body("sleeve", mass=0.3e-3, inertia=5e-9, shape=tube, color="#5b6770"))
    tip = (BEAK[0] + 1e-5, BEAK[1])
    bird = [
        fb.Sphere(radius=1e-5, position=tip, looks=True, contact=True),
        fb.Cone(
            radius=0.002,
            height=0.008,
            position=(BEAK[0] + 0.006, BEAK[1], 0),
            orientation=(0, "-90 deg", 0),
            looks=True,
        ),
        fb.Sphere(radius=0.006, position=(BEAK[0] + 0.012, BEAK[1], 0), looks=True),
        fb.Ellipsoid(semi_axes=(0.007, 0.019, 0.007), orientation=(0, 0, "-15 deg"), looks=True),
        fb.Rod(start=(HINGE - BIRD, 0, 0), end=(0, 0, 0), radius=0.0006, looks=True),
    ]
    m.add(fb.Body("bird", mass=4.5e-3, inertia=7e-7, position=(BIRD, 0), shape=bird, color="#a63d2f"))
    m.add(fb.PointOnLine("guide", "ground", "sleeve", at=(0, 0), axis=(0, 1)))
    m.add(fb.Revolute("spring", "sleeve", "bird", at=(HINGE, 0)))
    m.add(fb.CoordinateSpring("wire", "spring.angle", stiffness=0.0056))
    m.add(fb.Contact("sleeve contact", between=["pole"], others=["sleeve"], friction=0.3, restitution=0))
    m.add(fb.Contact("beak contact", between=["bark"], others=["bird"], friction=0.3, restitution=0.5))
    for name, (value, rate) in START.items():
        m.add(fb.Initial(name, value=size * value, rate=size * rate))
    return m


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    run = mechanism().simulate(1, outputs=2001)
    print(run.events)
    run.to_html(folder / "woodpecker.html")
