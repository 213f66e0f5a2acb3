"""A Stewart platform (hexapod): 13 bodies, 6 universal, 6 prismatic and 6 spherical joints; six cylinders move it.

The cylinders follow the lengths that a chosen motion of the platform asks for (inverse kinematics, in closed form);
that the platform then makes just this motion is for the simulation to find (forward kinematics, which has none).

Run it with ``flyball run examples/stewart.py --t-end "6 s"``.
"""

import math

import numpy as np

import flyball as fb

HEIGHT = 1.0
UP = np.array([0, 0, HEIGHT])  # the platform as drawn
#          x             y             z                 turn about z
MOTION = ("0.15*sin(t)", "0.1*sin(2*t)", "0.12*(1 - cos(t))", "0.25*sin(t)")


def hinges(radius: float, spread: float, first: float) -> np.ndarray:
    """Six points on a circle, in pairs ``spread`` [deg] apart."""
    turns = np.radians([first + 120 * (k // 2) + (spread / 2 if k % 2 else -spread / 2) for k in range(6)])
    return radius * np.column_stack([np.cos(turns), np.sin(turns), 0 * turns])


BASE = hinges(0.9, 24, 0)
PLATE = np.roll(hinges(0.5, 24, 60), 1, axis=0)  # along the platform's own axes


def length_law(base: np.ndarray, plate: np.ndarray) -> str:
    """How much longer than drawn a leg is, while the platform moves as told."""
    x, y, z, turn = MOTION
    across = f"({x} + {plate[0]}*cos({turn}) - {plate[1]}*sin({turn}) - {base[0]})"
    along = f"({y} + {plate[0]}*sin({turn}) + {plate[1]}*cos({turn}) - {base[1]})"
    drawn = math.dist(base, plate + UP)
    return f"sqrt({across}**2 + {along}**2 + ({HEIGHT} + {z})**2) - {drawn}"


def leg(m: fb.Mechanism, k: int, base: np.ndarray, top: np.ndarray, law: str) -> None:
    """Cylinder, piston and the three joints of leg k."""
    d = (top - base) / np.linalg.norm(top - base)
    first = np.cross((0, 0, 1), d)
    first /= np.linalg.norm(first)
    second = np.cross(d, first)
    barrel = fb.Rod(start=(0, 0, 0), end=0.7 * d, radius=0.035)
    piston = fb.Rod(start=-0.8 * d, end=(0, 0, 0), radius=0.018)
    m.add(fb.Body(f"barrel {k}", mass=8, position=base, shape=barrel, color="#5b6770"))
    m.add(fb.Body(f"piston {k}", mass=3, position=top, shape=piston, color="#c08a3e"))
    m.add(fb.Universal(f"foot {k}", "ground", f"barrel {k}", at=base, axes=(first, second)))
    m.add(fb.Prismatic(f"slide {k}", f"barrel {k}", f"piston {k}", at=(base + top) / 2, axis=d))
    m.add(fb.Spherical(f"ball {k}", f"piston {k}", "platform", at=top))
    m.add(fb.Driver(f"cylinder {k}", f"slide {k}.displacement", law))


def mechanism(laws: tuple[str, ...] | None = None) -> fb.Mechanism:
    """The hexapod; ``laws`` are those of its six displacements [m], if not those of the motion above."""
    m = fb.Mechanism("Stewart platform", gravity=(0, 0, -9.81))
    plate = fb.Cylinder(radius=0.55, length=0.05, position=(0, 0, 0.04))
    cabin = fb.Box(edges=(0.5, 0.36, 0.3), position=(0, 0, 0.2))
    m.add(fb.Body("platform", mass=120, position=UP, shape=(plate, cabin), color="#3b6ea5"))
    for k, (base, top) in enumerate(zip(BASE, PLATE, strict=True)):
        leg(m, k + 1, base, top + UP, laws[k] if laws else length_law(base, top))
    return m
