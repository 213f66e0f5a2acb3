"""Newton's cradle: one ball comes down on four that hang in a row, and the one at the other end flies off.

Of the many ways to keep momentum and energy among balls that touch, the cradle takes that in which each ball hits the
next: ``impacts="sequential"``.

Run it with ``python examples/newtons_cradle.py cradle.html``.
"""

import math
import sys

import flyball as fb

BALLS, RADIUS, LENGTH = 5, 0.02, 0.15  # LENGTH: from the pivot to the middle of a ball [m]
METHOD = fb.Stepping(step=1e-3, impacts="sequential")


def mechanism(lifted: int = 1, angle: float = 0.6) -> fb.Mechanism:
    """So many balls on the left are lifted by ``angle`` [rad]."""
    m = fb.Mechanism("Newton's cradle", planar=True, gravity=(0, -9.81))
    m.add(fb.Material("steel", restitution=1.0, friction=0.0))
    for k in range(BALLS):
        x, a = 2 * RADIUS * (k - (BALLS - 1) / 2), angle if k < lifted else 0.0
        ball = fb.Sphere(radius=RADIUS, material="steel")
        thread = fb.Cylinder(
            radius=0.0008, length=LENGTH, position=(0, LENGTH / 2, 0), orientation=(math.pi / 2, 0, 0), looks=True
        )
        m.add(
            fb.Body(
                f"ball {k + 1}",
                shape=(ball, thread),
                density=7800,
                position=(x - LENGTH * math.sin(a), -LENGTH * math.cos(a)),
                angle=-a,
                color="#98a4b2",
            ),
            fb.Revolute(f"pivot {k + 1}", "ground", f"ball {k + 1}", at=(x, 0), angle=-a),
        )
    m.add(fb.Contact())
    return m


if __name__ == "__main__":
    mechanism().simulate(4.0, outputs=401, method=METHOD).to_html(sys.argv[1])
