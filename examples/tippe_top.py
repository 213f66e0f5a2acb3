"""A tippe top: a ball whose mass centre lies below its middle, spun fast, turns upside down.

Friction at the point of contact does it. Whatever friction is, Jellett's quantity stays as it is: the angular momentum
about the mass centre along the line from there to the point of contact (J. H. Jellett, *A Treatise on the Theory of
Friction*, 1872). (With a stem, as a toy has one, it would then stand on that.)

Run it with ``flyball run examples/tippe_top.py --t-end 3 --outputs 301 --max-step 0.0005 --out out``.
"""

import math

import flyball as fb

RADIUS, BELOW = 0.02, 0.006  # of the ball; mass centre below its middle [m]
MASS, ACROSS, ALONG = 0.02, 3.0e-6, 3.2e-6  # [kg], [kg m^2] about the mass centre


def mechanism(spin: float = 180.0, tilt: float = 0.1) -> fb.Mechanism:
    """Let go from rest but for a spin [rad/s] about the vertical, its axis leaning by ``tilt`` [rad].

    Its mass centre stands still, so the point of contact slides at once. (Spun about its own leaning axis it comes to
    roll within a tenth of a second, and what rolls without sliding does not turn over.)
    """
    m = fb.Mechanism("tippe top", gravity=(0, 0, -9.81))
    ball = fb.Sphere(radius=RADIUS, looks=True, contact=True)
    knob = fb.Capsule(radius=0.15 * RADIUS, length=0.1 * RADIUS, position=(0, 0, 0.9 * RADIUS), looks=True)
    ring = fb.Torus(radius=0.866 * RADIUS, tube_radius=0.05 * RADIUS, position=(0, 0, 0.5 * RADIUS), looks=True)
    m.add(
        fb.Ground("table", shape=fb.Plane(), color="#9aa6b3"),
        fb.Body(
            "top",
            shape=(ball, knob, ring),
            mass=MASS,
            com=(0, 0, -BELOW),
            inertia=(ACROSS, ACROSS, ALONG),
            position=(0, 0, RADIUS),
            orientation=(tilt, 0, 0),
            velocity=(spin * BELOW * math.sin(tilt), 0, 0),
            angular_velocity=(0, 0, spin),
            color="#c8465a",
        ),
        fb.Contact(friction=0.3),
    )
    return m
