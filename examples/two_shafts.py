"""Two shafts coupled by ropes between drums, with a rubber element and a damper: torsional vibrations.

Two pretensioned strands run between the drums, one above and one below; while both are taut they act as one spring of
the relative displacement at the drums. Inelastic ropes are a coupling of the two angles. The rubber element holds the
second shaft, a damper acts on the first, and a motor shakes it.

Run it with ``python examples/two_shafts.py out``: it prints the modes with elastic and with inelastic ropes, and writes
a page with the animation and the Bode plot from the motor's torque to the second shaft into the folder.
"""

import sys
from pathlib import Path

import numpy as np

import flyball as fb

RADII, DISTANCE = (0.1, 0.2), 0.7  # m: of the drums, and between the shafts
PARAMETERS = {
    "inertia_1": "0.05 kg*m^2",
    "inertia_2": "0.4 kg*m^2",
    "rope_stiffness": "2e4 N/m",  # of one strand
    "rope_damping": "10 N*s/m",
    "rubber_stiffness": "500 N*m",  # per radian
    "rubber_damping": "2 N*m*s",
    "damper": "0.05 N*m*s",
    "torque": "12 N*m",
    "frequency": "4.4 Hz",
}


def strand(side: int) -> fb.Rod:
    """A strand of the rope: the common tangent of the drums above (1) or below (-1)."""
    r1, r2 = RADII
    across = (r1 - r2) / DISTANCE
    normal = np.array([across, side * np.sqrt(1 - across**2), 0])
    return fb.Rod(start=r1 * normal, end=np.array([DISTANCE, 0, 0]) + r2 * normal, radius=0.003, looks=True)


def mechanism(elastic: bool = True, **parameters: float) -> fb.Mechanism:
    """The shafts with elastic or inelastic ropes; keyword arguments are values of the parameters."""
    m = fb.Mechanism("two shafts", planar=True, parameters={**PARAMETERS, **parameters})
    m.add(fb.Ground("ropes", shape=(strand(1), strand(-1)), color="#7a6a53"))
    for k, radius, x, color in ((1, RADII[0], 0.0, "#a63d2f"), (2, RADII[1], DISTANCE, "#2f6fb7")):
        rim = fb.Tube(radius=radius, inner_radius=0.8 * radius, length=0.06, looks=True)
        arms = [fb.Box(edges=e, looks=True) for e in ((1.7 * radius, 0.02, 0.03), (0.02, 1.7 * radius, 0.03))]
        inertia = {"mass": 10, "inertia": f"inertia_{k}"}
        m.add(fb.Body(f"drum {k}", position=(x, 0), shape=(rim, *arms), color=color, **inertia))
        m.add(fb.Revolute(f"shaft {k}", "ground", f"drum {k}", at=(x, 0)))
    r1, r2 = RADII
    angles = ["shaft 1.angle", "shaft 2.angle"]
    if elastic:
        spring = {"stiffness": f"2*rope_stiffness*{r1}**2", "damping": f"2*rope_damping*{r1}**2"}
        m.add(fb.CoordinateSpring("rope", angles, weights=[1, -r2 / r1], **spring))
    else:
        m.add(fb.Coupler("rope", angles, weights=[r1, -r2]))
    m.add(fb.TorsionalSpringDamper("rubber", "shaft 2", stiffness="rubber_stiffness", damping="rubber_damping"))
    m.add(fb.TorsionalSpringDamper("damper", "shaft 1", damping="damper"))
    m.add(fb.Motor("motor", "shaft 1", torque="torque*sin(2*pi*frequency*t)"))
    return m


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    for elastic in (True, False):
        print("elastic ropes" if elastic else "inelastic ropes", mechanism(elastic).modes(), sep="\n")
    m = mechanism()
    m.linearize(["motor"], ["shaft 2.angle"]).bode("motor", "shaft 2.angle", path=folder / "two_shafts_bode.png")
    m.simulate(5, outputs=1001).to_html(folder / "two_shafts.html")
